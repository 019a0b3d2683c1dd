"""Writes one HTML page that shows a result of tubule in any browser, without a network. See `tubule view --help`."""

import base64
import itertools
import json
import os
import re
import shlex
import sys
from operator import attrgetter

import matplotlib
import numpy as np
from matplotlib.collections import QuadMesh
from matplotlib.colors import Normalize, to_hex
from matplotlib.figure import Figure

from . import command_line, flow, raster, scan, units
from .colours import Colours
from .labels import as_label, flatten, in_unit
from .movie import shared_colours
from .raster import division, lattice
from .results import BadInput, Surface, opened
from .tubes import choose_columns

HERE = os.path.dirname(os.path.abspath(__file__))
STEPS = 65535  # of 16-bit numbers
# Symbols, and words for those whose colours are not from print.
SYMBOLS = {name: flow.SYMBOLS.get(name, name) for name in ("H", "K", "u_n", "u_t", "u_theta", "p", "energy_density")}
WORDS = {
    "u_n": "normal velocity u\u2099, > 0: outward",
    "u_t": "velocity along the profile",
    "u_theta": "azimuthal velocity",
    "energy_density": "energy density f(H, K)",
}
OUTLIERS = 0.5  # percent of the energy densities at either end that may be beyond the colour scale


def encoded(values, kind):
    return base64.b64encode(np.ascontiguousarray(values).astype(kind).tobytes()).decode()


def packed(values, low, high):
    """16-bit integers: 0 is low, 65535 is high."""
    scale = STEPS / (high - low) if high > low else 0
    return encoded(np.clip(np.round((np.asarray(values) - low) * scale), 0, STEPS), "<u2")


def node_triangles(cells, order):
    """The order^2 flat triangles between the nodes of each cell, nodes in VTK's order."""
    places, corners = division(order)
    number = {tuple(place): i for i, place in enumerate(lattice(order))}
    nodes = np.array([number[tuple(place)] for place in np.rint(order * places).astype(int)])
    return cells[:, nodes[corners]].reshape(-1, 3)


class Shape:
    """A frame: points [n, 2] of a profile (r, z) or [n, 3] of a surface, and numbers for each point."""

    def __init__(self, frame):
        self.time, self.parameter, self.period = frame.time, frame.parameter, frame.period
        if isinstance(frame, Surface):
            self.mesh, self.points, data = frame.mesh, frame.nodes["points"], frame.nodes
            self.cells, self.order = frame.cells, frame.order
        else:
            self.mesh, self.points, data = None, np.column_stack([frame.r, frame.z]), vars(frame)
        names = [name for name in data if name in SYMBOLS or name.startswith("mode_")]
        self.fields = {name: data[name] for name in names if data[name] is not None}
        self.u = data.get("u")


def colour_table(name):
    return encoded(matplotlib.colormaps[name](np.linspace(0, 1, 256))[:, :3] * 255 + 0.5, "u1")


def field_colours(name, values, result, printed):
    """As `tubule plot` draws them: the scale of H, K and p is from the frames that it draws, others from all."""
    if name in ("H", "K", "p"):
        return shared_colours(result, printed, name)
    label = WORDS.get(name, f"normal displacement of mode {name.removeprefix('mode_')}")
    label = in_unit(label, result.unit(units.OF_FRAMES.get(name)))
    if name == "energy_density":
        low, high = np.percentile(values, [OUTLIERS, 100 - OUTLIERS])
        half = 0.0 if high > low else 0.5
        return Colours("viridis", Normalize(low - half, high + half), "neither", label)
    largest = float(np.abs(values).max()) or 1.0
    return Colours(flow.VELOCITY, Normalize(-largest, largest), "neither", label)


def described_fields(shapes, result, printed):
    """Fields that every shape has, with the ends of one colour scale for all times."""
    out, names = [], [*SYMBOLS, *sorted(shapes[0].fields.keys() - SYMBOLS)]
    for name in names:
        if not all(name in shape.fields for shape in shapes):
            continue
        values = np.concatenate([shape.fields[name] for shape in shapes])
        colours = field_colours(name, values, result, printed)
        out.append({"name": name, "symbol": SYMBOLS.get(name, name.replace("_", " ")), "words": colours.label,
                    "unit": result.unit(units.OF_FRAMES.get(name)), "low": float(values.min()), "high": float(values.max()),
                    "shown": [float(colours.norm.vmin), float(colours.norm.vmax)], "colours": colour_table(colours.map)})  # fmt: skip
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
    """How the run ended, in words, and the list of its warnings."""
    out = {key: str(about[key]) for key in ("stop", "stop_message", "advice") if str(about.get(key, ""))}
    if "estimated_error" in about:
        error = float(about["estimated_error"])
        out["estimated_error"] = f"{error:.2g} of E_ref" if error < 1 else "unknown"
    return out, [line for line in str(about.get("warnings", "")).split("\n") if line]


def run_page(result):
    """The data of the page of a Result."""
    if not result.shapes:
        raise BadInput(f"{result.path}: no shapes to show")
    columns = choose_columns([result], None, attrgetter("shapes"))
    shapes = [Shape(frame) for frame in result.shapes]
    fields = described_fields(shapes, result, [column.cells[0] for column in columns])
    along = "parameter" if result.is_equilibrium and "parameter" in result.series else "time"
    about, warnings = ending(result.about)
    return {
        "kind": "shapes",
        "title": result.title.replace(r"\$", "$"),
        "file": os.path.basename(result.path),
        "case": [f"{key} = {value}" for key, value in flatten(result.case).items()],
        "about": about,
        "warnings": warnings,
        "along": along,
        "along_words": result.parameter_name if along == "parameter" else along,
        "series": {name: finite(values) for name, values in result.series.items() if name != "wall_seconds"},
        "meanings": result.meanings,
        "units": {name: unit for name, of in result.dimensions.items() if (unit := result.unit(of))},
        "length_unit": result.unit("length"),
        "view": raster.View().axes.T.tolist(),
        "rim": raster.RIM_SHADE,
        "fields": fields,
        **packed_shapes(shapes, fields),
    }


def drawn_lines(part):
    """Lines and dots that `tubule plot` draws on a map, in coordinates of its axes, with the labels of its legend."""
    panel = Figure().add_subplot()
    handles = [(handle, to_hex(handle.get_color()), handle.get_linewidth())
               for handle in scan.draw_map(part, "outcome", panel) if hasattr(handle, "get_color")]  # fmt: skip

    def label(*look):
        """Equal ones, such as closed forms, stand in the legend in the order in which they are drawn."""
        found = next((handle for handle in handles if handle[1:] == look), None)
        if found:
            handles.remove(found)
        return found[0].get_label() if found else ""

    lines = []
    for one in (c for c in panel.collections if not isinstance(c, QuadMesh) and not c.get_hatch()):
        look = to_hex(one.get_edgecolor()[0]), float(one.get_linewidth()[0])
        ways = [way.tolist() for path in one.get_paths() for way in path.to_polygons(closed_only=False)]
        dashes = list(one.get_linestyle()[0][1] or [])
        lines.append({"colour": look[0], "width": look[1], "dashes": dashes, "label": label(*look), "ways": ways})
    dots = [{"label": label(to_hex(line.get_color()), line.get_linewidth()), "places": line.get_xydata().tolist()}
            for line in panel.lines]  # fmt: skip
    return {"lines": [line for line in lines if line["ways"]], "dots": dots}


def numbers_of(part):
    return [name for name, data in part.points.items() if data.shape == part.shape and data.dtype.kind in "fiu"]


def packed_slice(found, cut):
    """What a map of two axes, or curves over one, show where the others are cut."""
    part = scan.Slice(found, cut)
    hatches = ("vesiculated limit is lower", part.vesiculated), ("not reached", part.unreached)
    out = {"hatches": {words: np.flatnonzero(where).tolist() for words, where in hatches if where.any()},
           "equal": [[float(value), lowest] for *_, value, _, lowest in part.equal]}  # fmt: skip
    if part.all_starts:  # the numbers are those of the initial shapes
        places = found.places(cut)
        index = tuple(places.get(i, 0 if i == found.starts else slice(None)) for i in range(len(found.axes)))
        out["starts"] = found.best_starts()[index].ravel().tolist()
    else:
        texts = part.points.get("message", np.zeros(0)).ravel()  # older scans have none
        out["points"] = {name: finite(part.points[name].astype(float).ravel()) for name in numbers_of(part)}
        out["messages"] = {k: text.decode(errors="replace") for k, text in enumerate(texts) if text}
    return part, out | (drawn_lines(part) if len(part.axes) == 2 else {"lines": [], "dots": []})


def scan_page(found):
    """The data of the page of a Scan."""
    with opened(found.path) as file:
        case = os.path.basename(str(file["scan"].attrs["path"]))
        sets = [str(text) for text in file["case"].attrs.get("set", [])] if "case" in file else []
        stops = list(file["points/stop"].attrs["names"])
    own = [i for i in range(len(found.axes)) if i != found.starts]
    chosen = [i for i in range(len(found.axes)) if i == found.starts or i in own[2:]]
    options = [[*([""] if i == found.starts else []), *found.axes[i].texts] for i in chosen]  # "": that of least energy
    slices = {}
    for picks in itertools.product(*(range(len(texts)) for texts in options)):
        texts = [(found.axes[i].key, options[n][pick]) for n, (i, pick) in enumerate(zip(chosen, picks))]
        part, slices[",".join(map(str, picks))] = packed_slice(found, [f"{key}={text}" for key, text in texts if text])
    return {
        "kind": "scan",
        "title": as_label(found.title).replace(r"\$", "$") or os.path.basename(found.path),
        "file": os.path.basename(found.path),
        "command": ["tubule run " + shlex.quote(case), *(f"--set {shlex.quote(text)}" for text in sets)],
        "axes": [{"key": axis.key, "label": axis.label, "texts": axis.texts, "values": axis.values.tolist(),
                  "borders": axis.borders().tolist(), "logarithmic": axis.logarithmic,
                  "numeric": bool(axis.is_numeric)} for axis in part.axes],
        "choices": [{"key": found.axes[i].key, "label": found.axes[i].label, "texts": texts,
                     "starts": bool(i == found.starts)} for i, texts in zip(chosen, options)],
        "names": {"outcome": found.names, "stop": stops},
        "quantities": {name: found.label(name) for name in numbers_of(part)},
        "units": {name: unit for name in numbers_of(part) if (unit := found.unit_of(name)[0])},
        "outcome_colours": [scan.COLOURS.get(name, "#ffffff") for name in found.names],
        "colours": colour_table("viridis"),
        "slices": slices,
    }  # fmt: skip


def page_of(data):
    def text(name):
        with open(os.path.join(HERE, name), encoding="utf-8") as file:
            return file.read()

    try:  # without "<", no words of the data end their element or change how the rest of the page is read
        script = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    except ValueError:
        raise BadInput(f"{data['file']}: contains numbers that are not finite") from None
    scripts = ["view.js", *(["view_body.js"] if data["kind"] == "shapes" else []), f"view_{data['kind']}.js"]
    title = data["title"].replace("&", "&amp;").replace("<", "&lt;")
    parts = {"TITLE": title, "SCRIPT": "\n".join(map(text, scripts)), "DATA": script}
    # In one pass: what is put in may have such places itself.
    return re.sub(f"@({'|'.join(parts)})@", lambda place: parts[place[1]], text("view.html"))


def write(path, output, option=""):
    """The page of a result or a scan; `option` as --units."""
    if not output.endswith((".html", ".htm")):
        raise BadInput(f"{output}: must end in .html")
    page = page_of(scan_page(scan.read(path, option)) if scan.is_scan(path) else run_page(units.read(path, option)))
    try:
        with open(output, "w", encoding="utf-8") as file:
            file.write(page)
    except OSError as error:
        raise BadInput(f"{output}: cannot be written: {error.strerror}") from error


def main(options):
    output = options.output or os.path.splitext(options.result)[0] + ".html"
    write(options.result, output, options.units)
    command_line.say(output, sys.stdout)
    return 0
