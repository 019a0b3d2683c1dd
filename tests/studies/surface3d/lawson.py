#!/usr/bin/python3
"""Lawson's minimal surfaces xi_{g,1} in the unit 3-sphere, by Plateau's problem; shares nothing with the program.

Lawson (Annals of Mathematics 92 (1970) 335) fills a quadrilateral of geodesics and continues it by half turns about
them. Here flat triangles in R^4 with corners on the sphere have the least area; 4 (g + 1) copies close up to a surface
of genus g, for g = 1 Clifford's torus.

    lawson.py N FILE.off        the surface of genus 2 in space, 24 N^2 triangles
"""

import itertools
import sys
from pathlib import Path

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

# Far from the surface of genus 2: what is seen from there, and from elsewhere, are conformal images of each other.
POLES = np.array([[1, 1, 0, 0], [1, -1, np.sqrt(1.5), np.sqrt(0.5)]])


def corners(genus):
    """Two points each on the circles x_3 = x_4 = 0 and x_1 = x_2 = 0, pi/2 and pi/(genus + 1) apart."""
    turn = np.pi / (genus + 1)
    return np.array([[1, 0, 0, 0], [0, 1, 0, 0]], float), np.array([[0, 0, 1, 0], [0, 0, np.cos(turn), np.sin(turn)]])


def between(p, q, t):
    """Points of the geodesic from p to q, which are orthogonal."""
    return np.outer(np.cos(np.pi / 2 * t), p) + np.outer(np.sin(np.pi / 2 * t), q)


def normals(X):
    """Unit vectors orthogonal to the points of a grid, X[i, j], and to its lines."""
    frames = np.stack([X, np.gradient(X, axis=0), np.gradient(X, axis=1)], axis=-2)
    others = [np.delete(np.arange(4), k) for k in range(4)]
    out = np.stack([(-1) ** k * np.linalg.det(frames[..., others[k]]) for k in range(4)], axis=-1)
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


def triangles(n):
    """Corners of the triangles of a grid of n x n squares, the diagonals alternating."""
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    out = []
    for i, j in itertools.product(range(n), range(n)):
        a, b, c, d = at[i, j], at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]
        out += [(a, b, c), (a, c, d)] if (i + j) % 2 == 0 else [(a, b, d), (b, c, d)]
    return np.array(out)


def area_and_derivatives(X, nu, cells):
    """Area of flat triangles; gradient and Hessian where the points move as cos(w) X + sin(w) nu, at w = 0."""
    x, y = X[cells], nu[cells]
    a, b = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    aa, bb, ab = (np.einsum("ti,ti->t", p, q) for p, q in ((a, a), (b, b), (a, b)))
    S = aa * bb - ab**2
    by_a, by_b = 2 * (bb[:, None] * a - ab[:, None] * b), 2 * (aa[:, None] * b - ab[:, None] * a)
    eye = np.eye(4)[None]

    def outer(p, q):
        return p[:, :, None] * q[:, None, :]

    aa2, bb2 = (2 * (size[:, None, None] * eye - outer(p, p)) for size, p in ((bb, b), (aa, a)))
    ab2 = 2 * (2 * outer(a, b) - outer(b, a) - ab[:, None, None] * eye)
    full = np.concatenate([np.concatenate([aa2, ab2], 2), np.concatenate([ab2.transpose(0, 2, 1), bb2], 2)], 1)
    slope = np.concatenate([by_a, by_b], 1)
    root = np.sqrt(S)[:, None]
    slope_A = slope / (4 * root)
    full_A = full / (4 * root[:, :, None]) - outer(slope, slope) / (8 * root[:, :, None] ** 3)
    J = np.zeros((len(cells), 8, 3))
    J[:, :4, 0], J[:, 4:, 0], J[:, :4, 1], J[:, 4:, 2] = -y[:, 0], -y[:, 0], y[:, 1], y[:, 2]
    twice = np.stack([np.concatenate([x[:, 0], x[:, 0]], 1), np.concatenate([-x[:, 1], 0 * x[:, 1]], 1),
                      np.concatenate([0 * x[:, 2], -x[:, 2]], 1)], 2)  # fmt: skip
    H = J.transpose(0, 2, 1) @ full_A @ J
    H[:, range(3), range(3)] += np.einsum("ti,tik->tk", slope_A, twice)
    g = np.einsum("ti,tik->tk", slope_A, J)
    gradient = np.bincount(cells.ravel(), g.ravel(), len(X))
    rows, columns = np.repeat(cells, 3, axis=1).ravel(), np.tile(cells, (1, 3)).ravel()
    return root.sum() / 2, gradient, scipy.sparse.csc_matrix((H.ravel(), (rows, columns)), (len(X),) * 2)


def patch(n, genus=2):
    """Points (n + 1, n + 1, 4) of the patch of least area, and its area."""
    P, Q = corners(genus)
    t = np.arange(n + 1) / n
    u, v = (x[..., None] for x in np.meshgrid(t, t, indexing="ij"))
    low, high = between(P[0], Q[0], t)[:, None], between(Q[1], P[1], t)[:, None]
    left, right = between(P[0], Q[1], t)[None], between(Q[0], P[1], t)[None]
    bilinear = (1 - u) * (1 - v) * P[0] + u * (1 - v) * Q[0] + (1 - u) * v * Q[1] + u * v * P[1]
    X = (1 - v) * low + v * high + (1 - u) * left + u * right - bilinear
    X /= np.linalg.norm(X, axis=-1, keepdims=True)
    nu, cells = normals(X).reshape(-1, 4), triangles(n)
    X = X.reshape(-1, 4)
    inside = np.flatnonzero(np.pad(np.ones((n - 1, n - 1), bool), 1).ravel())
    for _ in range(30):
        area, gradient, hessian = area_and_derivatives(X, nu, cells)
        w = np.zeros(len(X))
        w[inside] = scipy.sparse.linalg.spsolve(hessian[inside][:, inside], -gradient[inside])
        w *= min(1, 0.1 / np.abs(w).max())
        X, nu = np.cos(w)[:, None] * X + np.sin(w)[:, None] * nu, np.cos(w)[:, None] * nu - np.sin(w)[:, None] * X
        if np.abs(w).max() < 1e-12:
            return X.reshape(n + 1, n + 1, 4), area
    raise ArithmeticError("Newton's method for Plateau's problem does not converge")


def surface(n, genus=2):
    """Points (N, 4) and triangles of the closed surface."""
    P, Q = corners(genus)
    X = patch(n, genus)[0].reshape(-1, 4)
    turns = [2 * (np.outer(p, p) + np.outer(q, q)) - np.eye(4) for p in P for q in Q]
    group = [np.eye(4)]
    seen = {tuple(np.round(X.mean(0), 6) + 0.0)}
    for element in group:
        for turn in turns:
            new = element @ turn
            key = tuple(np.round((X @ new.T).mean(0), 6) + 0.0)
            if key not in seen:
                seen.add(key)
                group.append(new)
    points = np.concatenate([X @ element.T for element in group])
    _, first, where = np.unique(np.round(points, 7) + 0.0, axis=0, return_index=True, return_inverse=True)
    cells = np.concatenate([triangles(n) + k * len(X) for k in range(len(group))])
    return points[first], oriented(where.ravel()[cells])


def oriented(cells):
    """The triangles, all turned the same way."""
    sides = {}
    for k, cell in enumerate(cells):
        for i in range(3):
            sides.setdefault(frozenset((cell[i], cell[i - 1])), []).append(k)
    out, queue, done = cells.copy(), [0], {0}
    for k in queue:
        a = out[k]
        for i in range(3):
            for m in sides[frozenset((a[i], a[i - 1]))]:
                if m in done:
                    continue
                done.add(m)
                queue.append(m)
                b = list(out[m])
                if b[(b.index(a[i - 1]) + 1) % 3] == a[i]:  # the common side runs the same way in both
                    out[m] = out[m][::-1]
    return out


def in_space(points, pole):
    """Stereographic projection from this point of the sphere to R^3."""
    pole = np.asarray(pole, float) / np.linalg.norm(pole)
    basis = np.linalg.svd(pole[None])[2][1:]
    return (points @ basis.T) / (1 - points @ pole)[:, None]


def write_off(path, points, cells):
    a, b, c = (points[cells[:, k]] for k in range(3))
    if np.einsum("ti,ti->", a, np.cross(b, c)) < 0:
        cells = cells[:, ::-1]
    lines = ["OFF", f"{len(points)} {len(cells)} 0"]
    lines += [" ".join(f"{x:.17g}" for x in point) for point in points]
    lines += [f"3 {a} {b} {c}" for a, b, c in cells]
    path.write_text("\n".join(lines) + "\n")


def area_in_the_sphere(genus=2, most=128):
    """The area of the surface, extrapolated (Romberg, squares of the width), and the last change."""
    rows, n = [], most // 16
    while n <= most:
        row = [4 * (genus + 1) * patch(n, genus)[1]]
        for k, coarser in enumerate(rows[-1] if rows else []):
            row.append(row[k] + (row[k] - coarser) / (4 ** (k + 1) - 1))
        rows.append(row)
        n *= 2
    return rows[-1][-1], abs(rows[-1][-1] - rows[-2][-1])


if __name__ == "__main__":
    points, cells = surface(int(sys.argv[1]))
    write_off(Path(sys.argv[2]), in_space(points, POLES[0]), cells)
