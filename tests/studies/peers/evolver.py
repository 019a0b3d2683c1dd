"""Surface Evolver: meshes, datafiles, and how it is driven. Its energy is INT h^2 by one of its methods, h = H/2."""

import re
from itertools import combinations
from math import pi

import numpy as np

PROGRAM, PACKAGE = "evolver-nox-d", "evolver-nox"
TUBE_LENGTH, TORUS_AREA = 6.0, 8 * pi**2
# Newton's method with a line search, until a step gains less than 1e-8 of the energy.
DESCEND = """old := 1e30; steps := 0;
while (old - total_energy > 1e-8*total_energy && steps < 40) do { old := total_energy; hessian_seek; steps += 1; };
"""
GROOM = "{V; u; hessian_seek} %d;\n"


def spheroid(v):
    """Half axes a, a, c of the prolate of area 4 pi and reduced volume v."""
    low, high = 1 + 1e-9, 20.0
    for _ in range(100):
        q = (low + high) / 2
        e = np.sqrt(1 - 1 / q**2)
        a = np.sqrt(2 / (1 + q / e * np.arcsin(e)))
        low, high = (q, high) if a**3 * q > v else (low, q)
    return a, a * q


def geodesic_sphere(n):
    """An icosahedron with every face divided into n^2: points, triangles."""
    corners = np.array([np.roll((x, y * (1 + 5**0.5) / 2, 0), k) for x in (-1, 1) for y in (-1, 1) for k in range(3)])
    close = np.linalg.norm(corners[:, None] - corners, axis=2) < 2.1
    points, known, triangles = [], {}, []
    for face in combinations(range(12), 3):
        A, B, C = corners[list(face)]
        if not all(close[i, j] for i, j in combinations(face, 2)):
            continue
        if np.linalg.det([A, B, C]) < 0:
            B, C = C, B
        at = {}
        for i, j in ((i, j) for i in range(n + 1) for j in range(n + 1 - i)):
            p = A * (n - i - j) + B * i + C * j
            p = p / np.linalg.norm(p)
            at[i, j] = known.setdefault(tuple(np.round(p, 9)), len(points))
            points += [p] if at[i, j] == len(points) else []
        triangles += [(at[i, j], at[i + 1, j], at[i, j + 1]) for i, j in at if i + j < n]
        triangles += [(at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]) for i, j in at if i + j < n - 1]
    return np.array(points), triangles


def rows_of_triangles(rows, columns):
    """Equilateral, closed in both directions, rows even: parameters in [0, 1)^2 and triangles."""
    points = [(i / rows, (j + i % 2 / 2) / columns) for i in range(rows) for j in range(columns)]
    triangles = []
    for i, j in ((i, j) for i in range(rows) for j in range(columns)):
        here, above, shift = i * columns, (i + 1) % rows * columns, i % 2
        a, b = here + j, here + (j + 1) % columns
        c, d = above + (j + shift) % columns, above + (j + 1 + shift) % columns
        triangles += [(a, b, c), (b, d, c)]
    return np.array(points), triangles


def surface(method, points, triangles, area=None, volume=None, tension=0, period=None):
    """The datafile of a closed surface, or of a tube with that period in z."""
    text = f"torus\nperiods\n99 0 0\n0 99 0\n0 0 {period}\n" if period else ""
    text += f"quantity bend energy method {method} global\n"
    text += f"quantity size fixed = {area!r} method facet_area global\n" if area else ""
    text += f"quantity tense energy modulus {tension} method facet_area global\n" if tension else ""
    edges, faces = {}, []
    for a, b, c in triangles:
        sides = [(p, q) if (q, p) not in edges else (q, p) for p, q in ((a, b), (b, c), (c, a))]
        numbers = [edges.setdefault(side, len(edges) + 1) for side in sides]
        faces.append([n if side[0] == p else -n for n, side, p in zip(numbers, sides, (a, b, c))])
    text += "vertices\n"
    text += "".join(f"{k} {x:.17g} {y:.17g} {z:.17g}\n" for k, (x, y, z) in enumerate(points, 1)) + "edges\n"
    for (p, q), k in edges.items():
        rise = (points[q][2] - points[p][2]) / period if period else 0
        wrap = "* * " + ("+" if rise < -0.5 else "-" if rise > 0.5 else "*") if period else ""
        text += f"{k} {p + 1} {q + 1} {wrap}\n"
    text += "faces\n" + "".join(f"{k} {a} {b} {c} density 0\n" for k, (a, b, c) in enumerate(faces, 1))
    text += f"bodies\n1 {' '.join(map(str, range(1, len(faces) + 1)))} volume {volume!r}\n" if volume else ""
    return text + "read\n"


def profile(points, area, volume=None):
    """The datafile of a surface of revolution about the x axis: a closed profile, or one from pole to pole."""
    text = "string\nspace_dimension 2\nquantity bend energy method sq_mean_curv_cyl global\n"
    text += f"quantity size fixed = {area!r} method edge_general_integral global\n"
    text += "scalar_integrand: 2*pi*y*sqrt(x3^2+x4^2)\n"
    if volume:
        text += f"quantity vol fixed = {volume!r} method edge_vector_integral global\n"
        text += "vector_integrand:\nq1: pi*y^2\nq2: 0\n"
    text += "constraint 1\nformula: y = 0\nvertices\n"
    poles, n = (1, len(points)) if volume else (), len(points)
    text += "".join(f"{k} {x:.17g} {y:.17g} {'constraint 1' * (k in poles)}\n" for k, (x, y) in enumerate(points, 1))
    text += "edges\n" + "".join(f"{k} {k} {k % n + 1} density 0\n" for k in range(1, n + (not volume)))
    return text + "read\n"


def vesicle(v, method, n, grade=0.0):
    """The spheroid as a stretched geodesic sphere; a grade > 0 moves its points to the poles."""
    points, triangles = geodesic_sphere(n)
    a, c = spheroid(v)
    latitude, longitude = np.arcsin(np.clip(points[:, 2], -1, 1)), np.arctan2(points[:, 1], points[:, 0])
    latitude = latitude + grade * np.sin(2 * latitude)
    r, z = a * np.cos(latitude), c * np.sin(latitude)
    points = np.transpose([r * np.cos(longitude), r * np.sin(longitude), z])
    return surface(method, points, triangles, 4 * pi, 4 * pi / 3 * v), f"g; {DESCEND}"


def vesicle_profile(v, n):
    """From the spheroid of v = 0.9, since that of 0.8 is too far from rest; refined from 16 edges."""
    a, c = spheroid(0.9)
    angles = np.linspace(0, pi, 17)
    points = np.transpose([-c * np.cos(angles), a * np.sin(angles) * (np.arange(17) % 16 > 0)])
    steps = [f"vol.target := {4 * pi / 3 * w!r}; {DESCEND}" for w in np.arange(0.88, v - 0.001, -0.02)]
    refined = ("r; " + DESCEND) * int(np.log2(n / 16))
    return profile(points, 4 * pi, 4 * pi / 3 * 0.9), f"g; {DESCEND}{''.join(steps)}{refined}"


def torus(method, n, refinements=0, groomed=True):
    """Ratio 2, 2n by n points, its area held."""
    points, triangles = rows_of_triangles(2 * n, n)
    u, w = 2 * pi * points.T
    points = np.transpose([(2 + np.cos(w)) * np.cos(u), (2 + np.cos(w)) * np.sin(u), np.sin(w)])
    commands = f"g 5; {GROOM % 10}" + ("r; " + GROOM % 5) * refinements if groomed else f"g 5; {DESCEND}"
    return surface(method, points, triangles, TORUS_AREA), commands


def torus_profile(n):
    """Refined from 32 edges; 2048 fail."""
    angles = 2 * pi * np.arange(32) / 32
    commands = f"g; {DESCEND}" + ("r; " + DESCEND) * int(np.log2(n / 32))
    return profile(np.transpose([np.cos(angles), 2 + np.sin(angles)]), TORUS_AREA), commands


def tube(method, n):
    """Under the tension at which it rests, then its nine lowest eigenvalues: two translations and seven more."""
    points, triangles = rows_of_triangles(n, n)
    z, w = points.T * [[TUBE_LENGTH], [2 * pi]]
    points = np.transpose([np.cos(w), np.sin(w), z])
    commands = "linear_metric on; g; hessian; hessian; ritz(-2, 9);\n"
    return surface(method, points, triangles, tension=0.25, period=TUBE_LENGTH), commands


def finish(kind):
    return f'printf "RESULT %.15g %d\\n", bend.value, {kind}_count;\nq\nq\n'


def results(output):
    """The energy, the eigenvalues but those of translations, and the number of triangles or edges."""
    energy, size = re.findall(r"^RESULT (\S+) (\d+)", output, re.M)[-1]
    eigenvalues = re.findall(r"^ *\d+\. +(-?[0-9.e+-]+) *$", output, re.M)
    return float(energy), [float(value) for value in eigenvalues[2:]], int(size)
