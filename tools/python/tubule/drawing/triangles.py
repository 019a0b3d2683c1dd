"""Shapes as flat triangles: points [n, 3] and corners [m, 3], counter-clockwise seen from outside. numpy only."""

import numpy as np

from .raster import division, lagrange

AROUND = 24  # points around the widest circle of a profile that is not subdivided
FEWEST = 6  # around any other circle
SAME = 1e-9  # of the size of a profile: shorter distances are none


def join_periods(points, period):
    """Moves cells [cell, node, 3] of a tube, which remeshing leaves whole periods away from the others, beside these."""
    z = points[..., 2]
    z -= period * np.round((z.mean(axis=1, keepdims=True) - np.median(z)) / period)


def of_surface(points, nodes, order, subdivide, period):
    """Each curved cell divided into subdivide^2 triangles, whose corners lie on it.

    points [cell, node of the cell, 3] in VTK's order, nodes [cell, node of the cell] the numbers that neighbours share. One
    `period` of a tube, of which they may be several, is open at its ends.
    """
    points, nodes = np.array(points, float), np.array(nodes, np.int64)
    if period > 0:
        join_periods(points, period)
        count = nodes.max() + 1
        height = np.empty(count)
        height[nodes] = points[..., 2]
        nodes += count * np.round((points[..., 2] - height[nodes]) / period).astype(np.int64)
    places, corners = division(subdivide)
    at = np.round(subdivide * places).astype(int)
    # What neighbours know of a place: the ends of its side, and how many steps it is from the first. A corner is both ends.
    key = np.empty((len(nodes), len(at), 3), np.int64)
    for j, steps in enumerate(at):
        ends = np.flatnonzero(steps)
        if len(ends) == 3:
            key[:, j] = np.stack([np.arange(len(nodes)), np.full(len(nodes), j), np.full(len(nodes), -1)], axis=1)
            continue
        a, b = nodes[:, ends[0]], nodes[:, ends[-1]]
        key[:, j] = np.stack([np.minimum(a, b), np.maximum(a, b), np.where(a <= b, steps[ends[-1]], steps[ends[0]])], axis=1)
        if len(ends) == 1:
            key[:, j, 2] = 0
    _, first, number = np.unique(key.reshape(-1, 3), axis=0, return_index=True, return_inverse=True)
    found = np.einsum("pn,cnx->cpx", lagrange(order, places), points).reshape(-1, 3)[first]
    return found, number.reshape(len(nodes), -1)[:, corners].reshape(-1, 3)


def interpolated(s, values, at):
    """Cubics through the four values [n, k] around each place."""
    i = np.clip(np.searchsorted(s, at) - 2, 0, len(s) - 4)[:, None] + np.arange(4)
    x, t, out = s[i], np.asarray(at)[:, None], 0.0
    for k in range(4):
        others = [j for j in range(4) if j != k]
        out = out + np.prod((t - x[:, others]) / (x[:, [k]] - x[:, others]), axis=1)[:, None] * values[i[:, k]]
    return out


def circles(r, z, H, K, around, period):
    """(r, z) and the number of points of each circle of a surface of revolution, and whether the last is the first.

    Triangles are as long as 1/around of the widest circle, and shorter where curvatures are large.
    """
    widest, step = r.max(), np.hypot(np.diff(r), np.diff(z))
    kept = np.concatenate([[True], step > SAME * widest])
    r, z, H, K = r[kept], z[kept], H[kept], K[kept]
    s = np.concatenate([[0], np.cumsum(step[kept[1:]])])
    length = 2 * np.pi / around * np.sqrt(2 / np.maximum(H**2 - 2 * K, 2 / widest**2))
    steps = np.concatenate([[0], np.cumsum(np.diff(s) * (1 / length[1:] + 1 / length[:-1]) / 2)])
    at = np.interp(np.linspace(0, steps[-1], max(3, int(np.ceil(steps[-1]))) + 1), steps, s)
    poles = r[0] < SAME * widest, r[-1] < SAME * widest
    joined = period == 0 and not any(poles) and np.hypot(r[0] - r[-1], z[0] - z[-1]) < SAME * widest
    known = np.column_stack([s, r, z])
    if period > 0 or joined:
        turn = [s[-1], 0, period]
        known = np.concatenate([known[-3:-1] - turn, known, known[1:3] + turn])
    else:  # beyond a pole the profile is its mirror image
        before, after = known[2:0:-1] * [-1, -1, 1], known[-2:-4:-1] * [-1, -1, 1] + [2 * s[-1], 0, 0]
        known = np.concatenate([before[: 2 * poles[0]], known, after[: 2 * poles[1]]])
    rz = interpolated(known[:, 0], known[:, 1:], at)
    count = np.maximum(FEWEST, np.round(2 * np.pi * rz[:, 0] / np.interp(at, s, length)).astype(int))
    if period > 0 or joined:
        count[-1] = count[0]
    for end, pole in zip((0, -1), poles):
        if pole:
            count[end], rz[end, 0] = 1, 0.0
    return rz, count, joined


def of_profile(r, z, H, K, subdivide, period=0.0):
    """The surface of revolution of a profile, given by points with their curvatures: circles of points, joined by triangles.

    Poles are fans; a tube is open at the ends of its period.
    """
    rz, count, joined = circles(*(np.asarray(a, float) for a in (r, z, H, K)), AROUND * subdivide, period)
    begin = np.concatenate([[0], np.cumsum(count)])
    ring = np.repeat(np.arange(len(count)), count)
    angle = 2 * np.pi * (np.arange(begin[-1]) - begin[ring]) / count[ring]
    points = np.column_stack([rz[ring, 0] * np.cos(angle), rz[ring, 0] * np.sin(angle), rz[ring, 1]])
    triangles = []
    for i, (n, m) in enumerate(zip(count[:-1], count[1:])):
        low, high = np.arange(n), np.arange(m)
        # Around the axis the sides of both circles take turns by their middles; each has the other's last corner opposite.
        if n > 1:
            opposite = np.searchsorted((high + 0.5) / m, (low + 0.5) / n) % m if m > 1 else 0 * low
            triangles.append(np.stack([begin[i] + low, begin[i] + (low + 1) % n, begin[i + 1] + opposite], axis=1))
        if m > 1:
            opposite = np.searchsorted((low + 0.5) / n, (high + 0.5) / m, side="right") % n if n > 1 else 0 * high
            triangles.append(np.stack([begin[i] + opposite, begin[i + 1] + (high + 1) % m, begin[i + 1] + high], axis=1))
    triangles = np.concatenate(triangles)
    if joined:
        triangles = np.where(triangles >= begin[-2], triangles - begin[-2], triangles)
        points = points[: begin[-2]]
    return points, triangles
