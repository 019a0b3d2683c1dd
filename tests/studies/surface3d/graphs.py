"""Equilibrium surfaces without an axis by Fourier series and spherical harmonics; shares nothing with the program.

Tubes r(z, theta) and closed surfaces r(theta, phi) of the energy INT k20 (H - H0)^2 dS, with area, volume, tension or
pressure given. SymPy differentiates the densities, Newton's method finds the coefficients of r.
"""

import functools

import numpy as np
import sympy
from scipy.special import lpmv

JETS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))  # derivatives of r by (s, t)


@functools.lru_cache
def densities(closed):
    """Function of s, H0 and r, r_s, ... r_tt: area, volume, INT (H - H0)^2 dS per ds dt; their first and second
    derivatives by r ... r_tt."""
    s, t, H0 = sympy.symbols("s t H0")
    r = sympy.Function("r")(s, t)
    jets = sympy.symbols("r rs rt rss rst rtt")
    if closed:  # s, t: polar and azimuthal angle
        X = r * sympy.Matrix([sympy.sin(s) * sympy.cos(t), sympy.sin(s) * sympy.sin(t), sympy.cos(s)])
    else:  # s: along the axis, t: around it
        X = sympy.Matrix([r * sympy.cos(t), r * sympy.sin(t), s])
    twice = [X.diff(s, 2), X.diff(s, t), X.diff(t, 2)]
    values = [r.diff(*([s] * i + [t] * j)) if i + j else r for i, j in JETS]

    def flat(vector):
        for symbol, value in zip(reversed(jets), reversed(values)):
            vector = vector.subs(value, symbol)
        return vector.subs(t, 0)

    X, a, b, L, M, N = (flat(v) for v in (X, X.diff(s), X.diff(t), *twice))
    cross = a.cross(b)
    E, F, G = a.dot(a), a.dot(b), b.dot(b)
    J = sympy.sqrt(E * G - F**2)
    H = (L.dot(cross) * G - 2 * M.dot(cross) * F + N.dot(cross) * E) / J**3
    volume = X.dot(cross) / 3 if closed else -(X[0] * cross[0] + X[1] * cross[1]) / 2
    sign = 1 if closed else -1  # outward normals; H < 0 on convex surfaces
    parts = [J, volume, J * (sign * H - H0) ** 2]
    first = [part.diff(y) for part in parts for y in jets]
    second = [part.diff(y).diff(x) for part in parts for y in jets for x in jets]
    return sympy.lambdify((s, H0, *jets), [*parts, *first, *second], cse=True, modules="numpy")


class Graph:
    """Values of r and its derivatives at quadrature points, as a matrix (6, points, coefficients)."""

    def __init__(self, closed, s, weights, basis, H0=0.0):
        self.closed, self.s, self.weights, self.basis, self.H0 = closed, s, weights, basis, H0

    def sums(self, c):
        """Area, volume and INT (H - H0)^2, with gradients and Hessians by the coefficients."""
        out = densities(self.closed)(self.s, self.H0, *(self.basis @ c))
        out = [np.broadcast_to(value, self.s.shape) * self.weights for value in out]
        values = np.array([part.sum() for part in out[:3]])
        first = np.einsum("fjp,jpc->fc", np.reshape(out[3:21], (3, 6, -1)), self.basis)
        blocks, hessians = np.reshape(out[21:], (3, 6, 6, -1)), []
        for block in blocks:
            half = np.einsum("ijp,jpc->ipc", block, self.basis)
            hessians.append(np.tensordot(self.basis, half, ((0, 1), (0, 1))))
        return values, first, np.array(hessians)

    def equilibrium(self, c, k20, area=None, volume=None, tension=0.0, pressure=0.0, along=None, steps=40):
        """Coefficients, energy, area, volume, tension, pressure. along = (index, value): the coefficient is given, and
        the tension or pressure (those that are not multipliers) with the name `along[2]` found."""
        multipliers, c = np.array([tension, -pressure]), np.array(c, float)
        held = [area, volume]
        for _ in range(steps):
            values, first, second = self.sums(c)
            n, unknown = len(c), [i for i in (0, 1) if held[i] is not None or (along and along[2] == i)]
            F = k20 * first[2] + multipliers @ first[:2]
            rows = [first[i] for i in (0, 1) if held[i] is not None]
            right = [values[i] - held[i] for i in (0, 1) if held[i] is not None]
            if along:
                rows.append(np.eye(n)[along[0]])
                right.append(c[along[0]] - along[1])
            K = np.zeros((n + len(unknown),) * 2)
            K[:n, :n] = k20 * second[2] + np.tensordot(multipliers, second[:2], 1)
            for k, i in enumerate(unknown):
                K[:n, n + k] = first[i]
                K[n + k, :n] = rows[k]
            change = np.linalg.solve(K, -np.concatenate([F, right]))
            factor = min(1.0, 0.1 / np.abs(self.basis[0] @ change[:n]).max())
            c += factor * change[:n]
            multipliers[unknown] += factor * change[n:]
            if factor == 1 and np.abs(change[:n]).max() < 1e-11:
                break
        else:
            raise ArithmeticError("Newton's method does not converge")
        values = self.sums(c)[0]
        return c, k20 * values[2], values[0], values[1], multipliers[0], -multipliers[1]


def tube(length, waves, rings, keep, H0=0.0):
    """cos(2 pi j z/length) cos(k theta), j <= waves, k <= rings, where keep(j, k)."""
    pairs = [(j, k) for j in range(waves + 1) for k in range(rings + 1) if keep(j, k)]
    # Half a period and half a turn of the midpoint rule: all products of cosines used are integrated.
    m, n = 2 * waves + 8, 2 * rings + 8
    z, theta = (np.arange(m) + 0.5) * length / (2 * m), (np.arange(n) + 0.5) * np.pi / n
    q = 2 * np.pi / length

    def cosines(k, x, scale, order):
        return (scale * k) ** order * np.cos(scale * k * x + order * np.pi / 2)

    basis = np.array([[np.outer(cosines(j, z, q, a), cosines(k, theta, 1, b)).ravel() for j, k in pairs] for a, b in JETS])
    weights = np.full(m * n, 4 * (length / (2 * m)) * (np.pi / n))
    return pairs, Graph(False, np.repeat(z, n), weights, basis.transpose(0, 2, 1), H0)


def sphere(degree, keep, H0=0.0):
    """P_l^m(cos theta) cos(m phi), normalised, l <= degree, where keep(l, m)."""
    pairs = [(l, m) for l in range(degree + 1) for m in range(l + 1) if keep(l, m)]
    x, w = np.polynomial.legendre.leggauss(2 * degree + 8)
    turns = 2 * degree + 8
    theta, phi = np.arccos(x), (np.arange(turns) + 0.5) * np.pi / turns

    def legendre(l, m):
        """P_l^m by theta: values, first and second derivatives, of maximum about 1."""
        P, sine, cosine = lpmv(m, l, x), np.sin(theta), x
        down = (l + m) * lpmv(m, l - 1, x) if l > m else 0 * x
        one = (l * cosine * P - down) / sine
        two = -cosine / sine * one - (l * (l + 1) - (m / sine) ** 2) * P
        return np.array([P, one, two]) / np.abs(P).max()

    def cosines(m, order):
        return float(m) ** order * np.cos(m * phi + order * np.pi / 2)

    basis = []
    tables = [legendre(l, m) for l, m in pairs]
    for a, b in JETS:
        basis.append([np.outer(tables[i][a], cosines(m, b)).ravel() for i, (l, m) in enumerate(pairs)])
    weights = np.repeat(w / np.sin(theta), turns) * 2 * np.pi / turns
    return pairs, Graph(True, np.repeat(theta, turns), weights, np.array(basis).transpose(0, 2, 1), H0)


def helix(length, waves, H0=0.0):
    """Coils: cos(k (theta + 2 pi z/length)), k <= waves."""
    n, q = 2 * waves + 8, 2 * np.pi / length
    x = (np.arange(n) + 0.5) * np.pi / n
    basis = np.array([[q**a * float(k) ** (a + b) * np.cos(k * x + (a + b) * np.pi / 2) for k in range(waves + 1)] for a, b in JETS])
    return Graph(False, 0 * x, np.full(n, 2 * length * np.pi / n), basis.transpose(0, 2, 1), H0)


def ellipsoid(graph, a, b, c):
    """Coefficients of a graph over the sphere, by least squares."""
    turns = np.count_nonzero(graph.s == graph.s[0])
    phi = np.tile((np.arange(turns) + 0.5) * np.pi / turns, len(graph.s) // turns)
    flat, high = np.sin(graph.s), np.cos(graph.s)
    radius = 1 / np.sqrt((flat * np.cos(phi) / a) ** 2 + (flat * np.sin(phi) / b) ** 2 + (high / c) ** 2)
    return np.linalg.lstsq(graph.basis[0], radius, rcond=None)[0]
