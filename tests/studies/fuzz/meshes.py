"""Mesh files, OBJ, OFF, PLY and STL, ascii and binary: sound ones, spoilt surfaces, and files with damaged text or bytes.

The program runs a surface from each for a moment: no crash, no hang; a refusal names the mesh or the case, and of a spoilt
text the line."""

import math
import re
import struct

from cases import broken_text
from sandbox import Finding

STUDY = 40
CASE = """tier = "surface3d"
energy = {{k20 = 1.0}}
shape = {{kind = "file", path = "mesh.{}"{}}}
discretisation = {{order = {}}}
accuracy = {{energy = 0.1}}
time = {{end = 1e-4, limit = 0.3}}
"""


def sphere(n):
    """An octahedron whose faces are divided n times along each edge, pushed out to the unit sphere."""
    numbers, points, faces = {}, [], []

    def number(*corner):
        if corner not in numbers:
            numbers[corner] = len(points)
            points.append([x / math.sqrt(sum(y * y for y in corner)) for x in corner])
        return numbers[corner]

    for sx in (1, -1):
        for sy in (1, -1):
            for sz in (1, -1):
                for i in range(n):
                    for j in range(n - i):
                        at = lambda a, b: number(sx * a, sy * b, sz * (n - a - b))  # noqa: E731
                        triangles = [(at(i, j), at(i + 1, j), at(i, j + 1))]
                        if i + j + 2 <= n:
                            triangles.append((at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)))
                        faces += triangles if sx * sy * sz > 0 else [t[::-1] for t in triangles]
    return points, faces


def torus(n):
    points, faces = [], []
    for i in range(2 * n):
        for j in range(n):
            u, v = math.pi * i / n, 2 * math.pi * j / n
            points.append([(2 + math.cos(v)) * math.cos(u), (2 + math.cos(v)) * math.sin(u), math.sin(v)])
            a, b = i * n + j, i * n + (j + 1) % n
            c, d = (a + n) % (2 * n * n), (b + n) % (2 * n * n)
            faces.append((a, c, d, b))  # quadrilaterals
    return points, faces


def spoil(rng, points, faces):
    """One change of the surface that may or may not leave it sound; its name."""
    point, face = rng.randrange(len(points)), rng.randrange(len(faces))
    kind = rng.choice(("stretch", "noise", "move", "far", "flip", "drop", "again", "join", "index", "polygon", "empty", "inside out"))
    match kind:
        case "stretch":
            scale = [10 ** rng.uniform(-2, 1) for _ in range(3)]
            points[:] = [[x * s for x, s in zip(p, scale)] for p in points]
        case "noise":
            size = 10 ** rng.uniform(-6, 0)
            points[:] = [[x + rng.gauss(0, size) for x in p] for p in points]
        case "move":
            points[point] = list(points[rng.randrange(len(points))])
        case "far":
            points[point][rng.randrange(3)] = rng.choice((1e9, 1e100, 1e160, 1e300, 1e-300, float("nan"), float("inf")))
        case "flip":
            faces[face] = faces[face][::-1]
        case "drop":
            del faces[face]
        case "again":
            faces.append(faces[face])
        case "join":
            other = rng.randrange(len(points))
            faces[:] = [tuple(other if v == point else v for v in f) for f in faces]
        case "index":
            faces[face] = (*faces[face][:2], rng.choice((-1, len(points), 2**31 - 1, faces[face][0])))
        case "polygon":
            faces[face] = tuple(rng.randrange(len(points)) for _ in range(rng.choice((0, 1, 2, 4, 5, 40))))
        case "empty":
            del (points if rng.random() < 0.5 else faces)[:]
        case "inside out":
            faces[:] = [f[::-1] for f in faces]
    return kind


def line(entries):
    return " ".join(map(str, entries)) + "\n"


def obj(points, faces):
    return "".join("v " + line(p) for p in points) + "".join("f " + line(v + 1 for v in f) for f in faces)


def off(points, faces):
    counts = f"OFF\n{len(points)} {len(faces)} 0\n"
    return counts + "".join(map(line, points)) + "".join(line((len(f), *f)) for f in faces)


def ply(points, faces, kind="ascii"):
    head = (
        f"ply\nformat {kind} 1.0\nelement vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    if kind == "ascii":
        return head + "".join(map(line, points)) + "".join(line((len(f), *f)) for f in faces)
    order = "<" if kind == "binary_little_endian" else ">"
    body = b"".join(struct.pack(order + "3d", *p) for p in points)
    return head.encode() + body + b"".join(struct.pack(f"{order}B{len(f)}i", len(f), *f) for f in faces)


def corners(points, faces):
    """Triangles by their corners; what no STL can say is left out."""
    fans = [(f[0], f[i], f[i + 1]) for f in faces for i in range(1, len(f) - 1)]
    return [[points[v] for v in t] for t in fans if all(0 <= v < len(points) for v in t)]


def stl(points, faces):
    facets = (" outer loop\n" + "".join("vertex " + line(p) for p in t) + " endloop\n" for t in corners(points, faces))
    return "solid a\n" + "".join(f"facet normal 0 0 0\n{facet}endfacet\n" for facet in facets) + "endsolid a\n"


def stl_binary(points, faces):
    triangles = [[min(max(x, -3e38), 3e38) for p in t for x in p] for t in corners(points, faces)]
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(struct.pack("<12fH", 0, 0, 0, *t, 0) for t in triangles)


FORMATS = (
    ("obj", obj),
    ("off", off),
    ("ply", ply),
    ("ply", lambda points, faces: ply(points, faces, "binary_little_endian")),
    ("ply", lambda points, faces: ply(points, faces, "binary_big_endian")),
    ("stl", stl),
    ("stl", stl_binary),
)


def one(rng, box):
    points, faces = sphere(rng.choice((2, 3, 4))) if rng.random() < 0.8 else torus(rng.choice((4, 6)))
    what = rng.choice(("sound", "spoilt", "spoilt", "spoilt", "broken", "broken", "broken"))
    if what == "spoilt":
        for _ in range(rng.choice((1, 1, 2))):
            if points and faces:
                what = spoil(rng, points, faces)
    ending, write = rng.choice(FORMATS)
    try:
        contents = write(points, faces)
    except struct.error:  # a number that the format has no place for
        return "no such file"
    if what == "broken":
        raw = contents if isinstance(contents, bytes) else contents.encode()
        contents = broken_text(rng, raw.decode("latin-1"), "latin-1")
    box.write(f"mesh.{ending}", contents)
    new = (", remesh = 100", ", remesh = 100, fill_holes = true", ", remesh = 100, wrap = 0.3", ", remesh = 100, weld = 0.1")
    further = rng.choice(("", "", ", weld = 1e-6", ", weld = 10.0", ", smoothing = 2", *new))
    box.write("case.toml", CASE.format(ending, further, rng.choice((2, 3, 4))))
    done = box.run("run", "case.toml", "--quiet", "--overwrite", limit=30)
    if done.status == 2:
        if not re.search(rf"mesh\.{ending}|case\.toml:\d+:\d+: ", done.err):
            raise Finding("no-place", f"refused without naming file or case: {done.err[:500]!r}")
        return "refused"
    return f"exit {done.status}"
