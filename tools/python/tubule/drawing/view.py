"""Writes one HTML page that shows a result of tubule in any browser, without a network. See `tubule view --help`."""

import base64
import json
import os
import re
import sys

import matplotlib
import numpy as np

from . import command_line, scan
from .labels import as_label, flatten
from .raster import lattice
from .results import BadInput, Surface, opened, read_result

HERE = os.path.dirname(os.path.abspath(__file__))
THREE = "/usr/share/javascript/three/three.min.js"
LICENCE = "three.js (https://threejs.org), copyright three.js authors, MIT License"
STEPS = 65535  # of 16-bit numbers
SIGNED = {"u_n", "u_t", "u_theta"}  # 0 has the colour in the middle
WORDS = {
    "H": "mean curvature H",
    "K": "Gaussian curvature K",
    "u_n": "normal velocity, > 0: outward",
    "u_t": "velocity along the profile",
    "u_theta": "azimuthal velocity",
    "p": "pressure p",
    "energy_density": "energy density f(H, K)",
}
OUTLIERS = 0.5  # percent of the values at either end of the colour scale that may be beyond it


def encoded(values, kind):
    return base64.b64encode(np.ascontiguousarray(values).astype(kind).tobytes()).decode()


def packed(values, low, high):
    """16-bit integers: 0 is low, 65535 is high."""
    scale = STEPS / (high - low) if high > low else 0
    return encoded(np.clip(np.round((np.asarray(values) - low) * scale), 0, STEPS), "<u2")


def node_triangles(cells, order):
    """The order^2 flat triangles between the nodes of each cell, nodes in VTK's order."""
    number = {tuple(place): i for i, place in enumerate(lattice(order))}
    corners = []
    for i in range(order):
        for j in range(order - i):
            k = order - i - j
            corners.append([(k, i, j), (k - 1, i + 1, j), (k - 1, i, j + 1)])
            if i + j < order - 1:
                corners.append([(k - 1, i + 1, j), (k - 2, i + 1, j + 1), (k - 1, i, j + 1)])
    pick = np.array([[number[place] for place in triangle] for triangle in corners])
    return cells[:, pick].reshape(-1, 3)


class Shape:
    """A frame: points [n, 2] of a profile (r, z) or [n, 3] of a surface, and numbers for each point."""

    def __init__(self, frame):
        self.time, self.parameter, self.period = frame.time, frame.parameter, frame.period
        if isinstance(frame, Surface):
            self.mesh, self.points, data = frame.mesh, frame.nodes["points"], frame.nodes
            self.cells, self.order = frame.cells, frame.order
        else:
            self.mesh, self.points, data = None, np.column_stack([frame.r, frame.z]), vars(frame)
        self.fields = {name: data[name] for name in WORDS if data.get(name) is not None}
        self.u = data.get("u")


def colour_table(name):
    return encoded(matplotlib.colormaps[name](np.linspace(0, 1, 256))[:, :3] * 255 + 0.5, "u1")


def described_fields(shapes):
    """Fields that every shape has, with the ends of one colour scale for all times."""
    out = []
    for name, words in WORDS.items():
        if not all(name in shape.fields for shape in shapes):
            continue
        values = np.concatenate([shape.fields[name] for shape in shapes])
        low, high = float(values.min()), float(values.max())
        shown = np.percentile(values, [OUTLIERS, 100 - OUTLIERS])
        if name in SIGNED:
            shown = np.array([-1, 1]) * np.abs(shown).max()
        if not shown[1] > shown[0]:
            shown = shown[0] - 0.5, shown[0] + 0.5
        out.append({"name": name, "words": words, "low": low, "high": high, "shown": [float(x) for x in shown],
                    "colours": colour_table("RdBu_r" if name in SIGNED else "viridis")})
    return out


def packed_shapes(shapes, fields):
    low = np.min([shape.points.min(axis=0) for shape in shapes], axis=0)
    high = np.max([shape.points.max(axis=0) for shape in shapes], axis=0)
    fastest = max((float(np.linalg.norm(s.u, axis=1).max()) for s in shapes if s.u is not None), default=0.0)
    frames = []
    for shape in shapes:
        frame = {"time": shape.time, "parameter": shape.parameter, "mesh": shape.mesh, "period": shape.period,
                 "points": [packed(column, *ends) for column, *ends in zip(shape.points.T, low, high)],
                 "fields": {f["name"]: packed(shape.fields[f["name"]], f["low"], f["high"]) for f in fields}}
        if shape.u is not None and fastest > 0:
            frame["u"] = [packed(column, -fastest, fastest) for column in shape.u.T]
        frames.append(frame)
    meshes = {s.mesh: encoded(node_triangles(s.cells, s.order), "<u4") for s in shapes if s.mesh is not None}
    return {"low": low.tolist(), "high": high.tolist(), "fastest": fastest, "frames": frames, "meshes": meshes,
            "rounding": float((high - low).max() / STEPS / 2)}


def finite(values):
    return [float(x) if np.isfinite(x) else None for x in values]


def ending(about):
    """How the run ended, in words."""
    out = {key: str(about[key]) for key in ("stop", "stop_message", "advice", "warnings") if str(about.get(key, ""))}
    if "estimated_error" in about:
        error = float(about["estimated_error"])
        out["estimated_error"] = f"{error:.2g} of E_ref" if error < 1 else "unknown"
    return out


def run_page(path):
    result = read_result(path)
    shapes = [Shape(frame) for frame in sorted([*result.frames, *result.surfaces], key=lambda frame: frame.time)]
    if not shapes:
        raise BadInput(f"{path}: no shapes to show")
    fields = described_fields(shapes)
    along = "parameter" if result.is_equilibrium and "parameter" in result.series else "time"
    vary = result.case.get("equilibrium", {}).get("branch", {}).get("vary", along)
    return {
        "kind": "shapes",
        "title": result.title.replace(r"\$", "$"),
        "file": os.path.basename(path),
        "case": [f"{key} = {value}" for key, value in flatten(result.case).items()],
        "about": ending(result.about),
        "along": along,
        "along_words": vary if along == "parameter" else along,
        "series": {name: finite(values) for name, values in result.series.items() if name != "wall_seconds"},
        "meanings": result.meanings,
        "fields": fields,
        **packed_shapes(shapes, fields),
    }


def scan_page(path):
    found = scan.Scan(path)
    axes, points, names, title = found.axes, found.points, found.names, found.title
    if len(axes) > 2:
        raise BadInput(f"{path}: a scan of {len(axes)} axes has no map; view one of two axes")
    with opened(path) as file:
        case = os.path.basename(str(file["scan"].attrs["path"]))
        sets = [str(text) for text in file["case"].attrs.get("set", [])] if "case" in file else []
        stops = list(file["points/stop"].attrs["names"])
    numbers = {name: data for name, data in points.items() if data.ndim == len(axes) and data.dtype.kind in "fiu"}
    return {
        "kind": "scan",
        "title": as_label(title).replace(r"\$", "$") or os.path.basename(path),
        "file": os.path.basename(path),
        "command": ["tubule run " + case, *(f"--set {text}" for text in sets)],
        "axes": [{"key": axis.key, "label": axis.label, "texts": axis.texts} for axis in axes],
        "names": {"outcome": names, "stop": stops},
        "outcome_colours": [scan.COLOURS.get(name, "#ffffff") for name in names],
        "colours": colour_table("viridis"),
        "points": {name: finite(data.astype(float).ravel()) for name, data in numbers.items()},
    }


def page_of(data):
    def text(name):
        with open(os.path.join(HERE, name), encoding="utf-8") as file:
            return file.read()

    try:
        with open(THREE, encoding="utf-8") as file:
            three = file.read() if data["kind"] == "shapes" else ""
    except OSError:
        raise command_line.Unavailable(f"tubule view needs {THREE}; install the package libjs-three") from None
    try:  # without "<", no words of the data end their element or change how the rest of the page is read
        script = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    except ValueError:
        raise BadInput(f"{data['file']}: contains numbers that are not finite") from None
    parts = {"TITLE": data["title"].replace("&", "&amp;").replace("<", "&lt;"), "LICENCE": LICENCE if three else "",
             "THREE": three, "SCRIPT": text("view.js"), "DATA": script}  # fmt: skip
    # In one pass: what is put in may have such places itself.
    return re.sub(f"@({'|'.join(parts)})@", lambda place: parts[place[1]], text("view.html"))


def write(path, output):
    if not output.endswith((".html", ".htm")):
        raise BadInput(f"{output}: must end in .html")
    page = page_of(scan_page(path) if scan.is_scan(path) else run_page(path))
    try:
        with open(output, "w", encoding="utf-8") as file:
            file.write(page)
    except OSError as error:
        raise BadInput(f"{output}: cannot be written: {error.strerror}") from error


def main(options):
    output = options.output or os.path.splitext(options.result)[0] + ".html"
    write(options.result, output)
    command_line.say(output, sys.stdout)
    return 0
