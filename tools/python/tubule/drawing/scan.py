"""Maps of scans: the outcome of each point, the boundaries between outcomes, and closed forms."""

import json
import os
import re

import h5py
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from . import style
from .labels import as_label, formula
from .results import BadInput, opened, values

HEIGHT = 4.2  # inches
# By name of the outcome: light for shapes at rest, dark for early stops.
COLOURS = {
    "uniform-tube": "#d6e4f0",
    "unduloid": "#f6c667",
    "sphere": "#cfe8cf",
    "closed": "#8fc18f",
    "pinched": "#8a1538",
    "overhang": "#5e4fa2",
    "ill-posed": "#1a1a1a",
    "self-intersection": "#b5651d",
    "failed": "#ff00ff",
    "undecided": "#9aa5ad",
    "prolate": "#d6e4f0",
    "oblate": "#f6c667",
    "stomatocyte": "#8fc18f",
    "pear": "#c6b5dc",
}
VERDICTS = {
    "agrees": {"marker": "o", "color": "black", "markerfacecolor": "white", "markersize": 6, "mew": 1.2},
    "symmetry-broken": {"marker": "^", "color": "black", "markersize": 6},
    "other-outcome": {"marker": "X", "color": "black", "markersize": 6},
    "no-answer": {"marker": "$?$", "color": "black", "markersize": 6},
}
# What can be drawn of points, and how it is called.
QUANTITIES = {
    "outcome": "outcome",
    "energy": "energy where the run stopped",
    "time": "time where the run stopped",
    "energy_error": "estimated error of the energy / " + formula("E_{ref}"),
    "E_ref": formula("E_{ref}"),
    "r_min": "smallest radius",
    "r_max": "largest radius",
    "area": "area",
    "volume": "volume",
    "height": "height",
    "tension": "tension",
    "pressure": "pressure",
    "growth": "largest growth rate",
    "free_energy": "energy with that of loads",
    "steps": "steps",
    "elements": "elements",
    "wall_seconds": "wall time in s",
    "cpu_seconds": "CPU time in s",
}
AT_REST = ("uniform-tube", "unduloid", "sphere", "closed", "prolate", "oblate", "stomatocyte", "pear")
THRESHOLD_DASHES = ("--", ":", "-.", (0, (6, 2, 1, 2, 1, 2)), (0, (1, 4)))
NAMES = {
    "equilibrium.reduced_volume": "reduced volume",
    "energy.H0": "spontaneous curvature " + formula("H_0"),
    "shape.length": "length L",
    "model.tension": "tension " + formula("\\sigma"),
    "model.pressure": "pressure " + formula("P"),
    "model.force": "axial force " + formula("N"),
    "shape.radius": "radius",
    "shape.mode.0.amplitude": "amplitude A",
}


class Axis:
    def __init__(self, group):
        self.key = ", ".join(group.attrs["keys"])
        self.logarithmic = bool(group.attrs["logarithmic"])
        numbers = values(group["values"])
        self.texts = [", ".join(text.decode() for text in row) for row in values(group["texts"])]
        self.is_numeric = numbers.shape[1] == 1 and np.isfinite(numbers).all() and (np.diff(numbers[:, 0]) > 0).all()
        self.values = numbers[:, 0] if self.is_numeric else np.arange(len(numbers), dtype=float)

    @property
    def label(self):
        modulus = re.fullmatch(r"energy\.k(\d+)", self.key)
        return formula(f"k_{{{modulus[1]}}}") if modulus else NAMES.get(self.key, self.key)

    def place(self, value):
        """Of a value on the axis, given as text; None if it has no such value."""
        if value in self.texts:
            return self.texts.index(value)
        try:
            number = float(value)
        except ValueError:
            return None
        near = np.flatnonzero(np.isclose(self.values, number, rtol=1e-9, atol=0)) if self.is_numeric else []
        return int(near[0]) if len(near) else None

    def borders(self):
        """Midpoints between the values, and as far beyond the first and last."""
        v = np.log(self.values) if self.logarithmic else self.values
        if v.size == 1:
            borders = np.array([v[0] - 0.5, v[0] + 0.5])
        else:
            middle = (v[1:] + v[:-1]) / 2
            borders = np.concatenate([[2 * v[0] - middle[0]], middle, [2 * v[-1] - middle[-1]]])
        return np.exp(borders) if self.logarithmic else borders

    def mark(self, axis):
        if not self.is_numeric:
            axis.set_ticks(self.values, self.texts)


def is_scan(path):
    if not os.path.isfile(path):
        return False  # reported where it is read
    try:
        with h5py.File(path) as file:
            return "scan" in file and "points" in file
    except OSError:
        return False  # reported where it is read


def read(path):
    with opened(path) as file:
        axes = [Axis(file["axes"][name]) for name in sorted(file["axes"], key=int)]
        points = {name: values(data) for name, data in file["points"].items()}
        names = list(file["points/outcome"].attrs["names"])
        title = file["scan"].attrs["title"]
        starts = file["scan"].attrs.get("start_axis")
        boundary = values(file["boundary"])
        crossings = values(file["crossing"]).mean(axis=1) if "crossing" in file else []
        thresholds = [
            (line.attrs["label"], values(line["first"]), values(line["second"]), values(line["values"]))
            for line in file["thresholds"].values()
        ]
        equal = {name: values(data) for name, data in file["equal_energies"].items()} if starts is not None else None
    return axes, points, names, title, boundary, crossings, thresholds, starts, equal


def positions(path, axes, slices):
    """Of each axis that is cut, the place of its value: {axis number: place}."""
    places = {}
    for text in slices:
        key, equals, value = text.partition("=")
        if not equals:
            raise BadInput(f"--slice {text}: must have the form key=value")
        numbers = [i for i, axis in enumerate(axes) if axis.key == key]
        if not numbers:
            raise BadInput(f"--slice {text}: {path} varies {', '.join(axis.key for axis in axes)}")
        place = axes[numbers[0]].place(value)
        if place is None:
            raise BadInput(f"--slice {text}: {key} has the values {', '.join(axes[numbers[0]].texts)}")
        places[numbers[0]] = place
    return places


def lowest(points, names, starts):
    """Of several starts the shape of the least energy, the first one where there is none; an axis of length 1 is left."""
    at_rest = np.isin(points["outcome"], [k for k, name in enumerate(names) if name in AT_REST])
    energy = np.where(at_rest, points["free_energy"], np.inf)
    best = np.expand_dims(np.argmin(energy, axis=starts), starts)
    return {name: np.take_along_axis(data, best, starts) for name, data in points.items()}


def differing(outcome):
    """Pairs of neighbours whose outcomes differ, by their numbers."""
    number = np.arange(outcome.size).reshape(outcome.shape)
    pairs = []
    for axis in range(outcome.ndim):
        a, b = [slice(None)] * outcome.ndim, [slice(None)] * outcome.ndim
        a[axis], b[axis] = slice(None, -1), slice(1, None)
        a, b = tuple(a), tuple(b)
        differ = (outcome[a] != outcome[b]) & (outcome[a] > 0) & (outcome[b] > 0)
        pairs += zip(number[a][differ], number[b][differ])
    return pairs


def equal_energies(axes, equal, shape, kept):
    """Places where the energies of two kinds are equal: (places of the two neighbours, axis, value, kinds, lowest)."""
    out = []
    for ends, axis, kinds, value, is_lowest in zip(
        equal["points"], equal["axis"], equal["kinds"], equal["value"], equal["lowest"]
    ):
        if np.isfinite(value):
            places = [tuple(np.unravel_index(end, shape)[i] for i in kept) for end in ends]
            out.append((*places, kept.index(axis), value, tuple(kinds), bool(is_lowest)))
    return out


class Slice:
    """The part of a scan that is drawn: two axes or one, the others at one value each."""

    def __init__(self, path, scan, slices):
        axes, points, self.names, self.title, boundary, crossings, thresholds, starts, equal = scan
        cut = positions(path, axes, slices)
        self.all_starts, self.equal = None, []
        best_of_starts = starts is not None and starts not in cut
        kept = [i for i in range(len(axes)) if i not in cut and not (best_of_starts and i == starts)]
        if len(kept) > 2:
            more = " ".join(f"--slice {axes[i].key}={axes[i].texts[0]}" for i in kept[2:])
            raise BadInput(f"{path}: a picture has one or two axes, this scan {len(kept)} axes: "
                           f"{', '.join(axes[i].key for i in kept)}: cut it, as by {more}")  # fmt: skip
        if not kept:
            raise BadInput(f"{path}: a picture has one or two axes: cut fewer")
        shape = points["outcome"].shape
        self.axes = [axes[i] for i in kept]
        if best_of_starts:
            if not cut:
                self.equal = equal_energies(axes, equal, shape, kept)
            self.all_starts = [{name: data[tuple(cut.get(i, start if i == starts else slice(None)) for i in range(len(axes)))]
                                for name, data in points.items()} for start in range(shape[starts])]  # fmt: skip
            points = lowest(points, self.names, starts)
            cut[starts] = 0
        self.points = {name: data[tuple(cut.get(i, slice(None)) for i in range(len(axes)))] for name, data in points.items()}
        self.thresholds = [] if set(cut) - {starts} else thresholds
        if starts is not None:
            self.boundary, self.crossings = differing(self.points["outcome"]), []
            boundary = []
        else:
            self.boundary, self.crossings = [], []
        for number, ends in enumerate(boundary):
            places = [np.unravel_index(end, shape) for end in ends]
            if any(place[i] != at for place in places for i, at in cut.items()):
                continue
            inside = self.points["outcome"].shape
            self.boundary.append([np.ravel_multi_index([place[i] for i in kept], inside) for place in places])
            if len(crossings):
                self.crossings.append(crossings[number])
        if best_of_starts:
            del cut[starts]
        if cut:
            where = ", ".join(f"{axes[i].key} = {axes[i].texts[place]}" for i, place in sorted(cut.items()))
            self.title = f"{self.title}: {where}" if self.title else where


def border_lines(axes, boundary, shape):
    """The sides that the cells of neighbouring points share, for each pair that differs."""
    x, y = axes[0].borders(), axes[1].borders()
    lines = []
    for a, b in boundary:
        (i, j), (k, _) = np.unravel_index(a, shape), np.unravel_index(b, shape)
        if k > i:
            lines.append([(x[i + 1], y[j]), (x[i + 1], y[j + 1])])
        else:
            lines.append([(x[i], y[j + 1]), (x[i + 1], y[j + 1])])
    return lines


def refined(axes, boundary, crossings, shape):
    """Where on the sides of the grid's cells the outcome changes."""
    places = []
    for (a, b), value in zip(boundary, crossings):
        (i, j), (k, _) = np.unravel_index(a, shape), np.unravel_index(b, shape)
        places.append((value, axes[1].values[j]) if k > i else (axes[0].values[i], value))
    return np.transpose(places)


def lines_of_equal_energy(part):
    """Through the places where energies are equal, cell by cell: {lowest: [[(x, y), (x, y)], ...]}."""
    x, y = part.axes[0].values, part.axes[1].values
    cells = {}  # (kinds, cell): [(place, lowest)]
    for (i, j), _, axis, value, kinds, is_lowest in part.equal:
        place = (value, y[j]) if axis == 0 else (x[i], value)
        for cell in ((i, j), (i, j - 1) if axis == 0 else (i - 1, j)):
            cells.setdefault((kinds, cell), []).append((place, is_lowest))
    lines = {True: [], False: []}
    for ends in cells.values():
        if len(ends) == 2:
            lines[ends[0][1] and ends[1][1]].append([ends[0][0], ends[1][0]])
    return lines


def draw_equal_energies(part, panel):
    handles = []
    for is_lowest, look, label in (
        (True, {"color": "black", "linewidth": 1.8, "linestyle": "-"}, "equal energies"),
        (False, {"color": "0.3", "linewidth": 1.0, "linestyle": (0, (2, 2))}, "the same, a third is lower"),
    ):
        if lines := lines_of_equal_energy(part)[is_lowest]:
            panel.add_collection(LineCollection(lines, capstyle="round" if is_lowest else "butt", **look))
            handles.append(Line2D([], [], label=label, **look))
    return handles


def draw_lost_starts(part, panel):
    """Dots where the search from one of the starts found no shape: one of lower energy may be missing there."""
    lost = np.zeros(part.points["outcome"].shape, bool)
    at_rest = [k for k, name in enumerate(part.names) if k == 0 or name in AT_REST]
    for points in part.all_starts or []:
        lost |= ~np.isin(points["outcome"], at_rest)
    if not lost.any():
        return []
    i, j = np.nonzero(lost)
    look = {"color": "0.35", "marker": ".", "markersize": 2.5, "linestyle": ""}
    panel.plot(part.axes[0].values[i], part.axes[1].values[j], **look)
    return [Line2D([], [], label=f"a start leads to no shape ({lost.sum()})", **look)]


def without_lines(part):
    """Borders between outcomes where no line of equal energies passes."""
    shape = part.points["outcome"].shape
    crossed = {(np.ravel_multi_index(a, shape), np.ravel_multi_index(b, shape))
               for a, b, _, _, _, is_lowest in part.equal if is_lowest}  # fmt: skip
    return [pair for pair in part.boundary if tuple(pair) not in crossed]


def draw_outcomes(part, panel):
    colours = ListedColormap([COLOURS.get(name, "#ffffff") for name in part.names])
    norm = BoundaryNorm(np.arange(-0.5, len(part.names)), len(part.names))
    shown = np.ma.masked_equal(part.points["outcome"].astype(float), 0)
    panel.pcolormesh(part.axes[0].borders(), part.axes[1].borders(), shown.T, cmap=colours, norm=norm, rasterized=True)


def draw_values(part, quantity, panel):
    shown = np.ma.masked_invalid(part.points[quantity])
    mesh = panel.pcolormesh(part.axes[0].borders(), part.axes[1].borders(), shown.T, cmap="viridis", rasterized=True)
    bar = panel.figure.add_axes([0.74, 0.11, 0.02, 0.8])
    panel.figure.colorbar(mesh, cax=bar, label=QUANTITIES[quantity])


def draw_map(part, quantity, panel):
    axes, shape = part.axes, part.points["outcome"].shape
    if quantity == "outcome":
        draw_outcomes(part, panel)
    else:
        draw_values(part, quantity, panel)
    borders = border_lines(axes, without_lines(part), shape)
    panel.add_collection(LineCollection(borders, colors="black", linewidths=0.8))
    handles = draw_equal_energies(part, panel)
    if len(part.crossings):
        x, y = refined(axes, part.boundary, part.crossings, shape)
        panel.plot(x, y, ".", color="black", markersize=3)
        handles.append(Line2D([], [], color="black", marker=".", markersize=3, linestyle="", label="refined"))
    handles += draw_lost_starts(part, panel)
    for dashes, (label, first, second, values) in zip(THRESHOLD_DASHES, part.thresholds):
        panel.contour(axes[0].values[first], axes[1].values[second], values.T, [0], colors="#c0392b",
                      linestyles=[dashes], linewidths=1.2)
        handles.append(Line2D([], [], color="#c0392b", linestyle=dashes, label=label))
    panel.set(xlabel=axes[0].label, ylabel=axes[1].label)
    if axes[1].logarithmic:
        panel.set_yscale("log")
    axes[1].mark(panel.yaxis)
    return handles


def draw_line(part, quantity, panel):
    for points in part.all_starts or [part.points]:
        for k, name in enumerate(part.names):
            here = points["outcome"] == k
            if k > 0 and here.any():
                panel.plot(part.axes[0].values[here], points[quantity][here], "o", color=COLOURS.get(name),
                           markeredgecolor="0.3", markeredgewidth=0.4)
    for *_, value, _, is_lowest in part.equal:
        panel.axvline(value, color="black", linewidth=0.8, linestyle="-" if is_lowest else ":")
    panel.set(xlabel=part.axes[0].label, ylabel=QUANTITIES[quantity])
    return []


def read_confirmed(path, scan):
    """(number of the point, verdict) for each point of the JSON of `tubule confirm`."""
    try:
        with open(path) as file:
            points = json.load(file)["points"]
        found = [(int(point["point"]), point["values"]["verdict"]) for point in points]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInput(f"{path}: is not what `tubule confirm --json` prints") from error
    if any(number >= scan or number < 0 for number, _ in found):
        raise BadInput(f"{path}: belongs to another scan, with more points")
    return found


def draw_confirmed(axes, confirmed, shape, panel):
    """A mark at each point that was run in three dimensions, by what came out."""
    places = [np.unravel_index(number, shape) for number, _ in confirmed]
    handles = []
    for verdict, look in VERDICTS.items():
        here = [place for place, (_, found) in zip(places, confirmed) if found == verdict]
        if here:
            x, y = (axis.values[list(index)] for axis, index in zip(axes, zip(*here)))
            panel.plot(x, y, linestyle="", clip_on=False, zorder=4, **look)
            handles.append(Line2D([], [], linestyle="", label=f"3D: {verdict} ({len(here)})", **look))
    return handles


def figure_of(path, quantity="", slices=(), confirmed=None):
    """The map of a scan file, or curves over its only axis."""
    part = Slice(path, read(path), slices)
    if not part.points["outcome"].any():
        raise BadInput(f"{path}: no point is finished yet")
    if quantity and quantity not in QUANTITIES:
        raise BadInput(f"--quantity {quantity}: must be one of {', '.join(QUANTITIES)}")
    is_map = len(part.axes) == 2
    of_outcomes = not is_map or quantity in ("", "outcome")
    figure = Figure(figsize=(style.WIDTH, HEIGHT))
    panel = figure.add_axes([0.09, 0.11, 0.62, 0.8])
    if confirmed and (not is_map or slices):
        raise BadInput(f"{path}: --confirmed marks points of a scan of two axes, without --slice")
    if is_map:
        handles = draw_map(part, quantity or "outcome", panel)
        if confirmed:
            shape = part.points["outcome"].shape
            handles += draw_confirmed(part.axes, read_confirmed(confirmed, part.points["outcome"].size), shape, panel)
    else:
        handles = draw_line(part, quantity if quantity not in ("", "outcome") else "energy", panel)
    if part.axes[0].logarithmic:
        panel.set_xscale("log")
    part.axes[0].mark(panel.xaxis)
    panel.set_title(as_label(part.title))
    patches = [
        Patch(facecolor=COLOURS.get(name, "#ffffff"), edgecolor="0.3", linewidth=0.4, label=f"{name} ({count})")
        for k, name in enumerate(part.names)
        if of_outcomes and k > 0 and (count := int((part.points["outcome"] == k).sum()))
    ]
    left = 0.72 if of_outcomes else 0.84
    figure.legend(handles=patches + handles, loc="upper left", bbox_to_anchor=(left, 0.92))
    return figure
