"""Files of flat triangles, for other programs. numpy only."""

import os

import numpy as np

from .command_line import BadInput, check_output


def stl(points, corners):
    """Binary, in single precision, as the format has it."""
    a, b, c = (points[corners[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    facets = np.zeros(len(corners), [("numbers", "<f4", (4, 3)), ("attributes", "<u2")])
    facets["numbers"] = np.stack([normal, a, b, c], axis=1)
    return b"triangles of tubule".ljust(80) + np.uint32(len(corners)).tobytes() + facets.tobytes()


def ply(points, corners):
    """Binary, in double precision."""
    faces = np.empty(len(corners), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, corners
    head = ["ply", "format binary_little_endian 1.0", "comment of tubule", f"element vertex {len(points)}",
            *(f"property double {x}" for x in "xyz"), f"element face {len(corners)}", "property list uchar int vertex_indices", "end_header\n"]  # fmt: skip
    return "\n".join(head).encode() + points.astype("<f8").tobytes() + faces.tobytes()


def obj(points, corners):
    """Text, all digits."""
    lines = [*("v {!r} {!r} {!r}\n".format(*row) for row in points.tolist()), *("f {} {} {}\n".format(*row) for row in (corners + 1).tolist())]
    return "".join(lines).encode()


FORMATS = {".stl": stl, ".ply": ply, ".obj": obj}


def write(path, points, corners):
    """A file of that name is replaced."""
    check_output(path, FORMATS, "triangles are")
    try:
        with open(path, "wb") as file:
            file.write(FORMATS[os.path.splitext(path)[1].lower()](points, corners))
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from error
