"""Maps of scans: the outcome of each point, the boundaries between outcomes, and closed forms."""

import json
import re

import h5py
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

import style
from labels import as_label, formula
from results import BadInput

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
}
VERDICTS = {
    "agrees": {"marker": "o", "color": "black", "markerfacecolor": "white", "markersize": 6, "mew": 1.2},
    "symmetry-broken": {"marker": "^", "color": "black", "markersize": 6},
    "other-outcome": {"marker": "X", "color": "black", "markersize": 6},
    "no-answer": {"marker": "$?$", "color": "black", "markersize": 6},
}
THRESHOLD_DASHES = ("--", ":", "-.", (0, (6, 2, 1, 2, 1, 2)), (0, (1, 4)))
NAMES = {
    "energy.H0": "spontaneous curvature " + formula("H_0"),
    "shape.length": "length L",
    "shape.radius": "radius",
    "shape.mode.0.amplitude": "amplitude A",
}


class Axis:
    def __init__(self, group):
        self.key = ", ".join(group.attrs["keys"])
        self.logarithmic = bool(group.attrs["logarithmic"])
        values = group["values"][()]
        self.texts = [", ".join(text.decode() for text in row) for row in group["texts"][()]]
        self.is_numeric = values.shape[1] == 1 and np.isfinite(values).all() and (np.diff(values[:, 0]) > 0).all()
        self.values = values[:, 0] if self.is_numeric else np.arange(len(values), dtype=float)

    @property
    def label(self):
        modulus = re.fullmatch(r"energy\.k(\d+)", self.key)
        return formula(f"k_{{{modulus[1]}}}") if modulus else NAMES.get(self.key, self.key)

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
    try:
        with h5py.File(path) as file:
            return "scan" in file and "points" in file
    except OSError:
        return False  # reported where it is read


def read(path):
    with h5py.File(path) as file:
        axes = [Axis(file["axes"][name]) for name in sorted(file["axes"], key=int)]
        points = {name: data[()] for name, data in file["points"].items()}
        names = list(file["points/outcome"].attrs["names"])
        title = file["scan"].attrs["title"]
        boundary = file["boundary"][()]
        crossings = file["crossing"][()].mean(axis=1) if "crossing" in file else []
        thresholds = [
            (line.attrs["label"], line["first"][()], line["second"][()], line["values"][()])
            for line in file["thresholds"].values()
        ]
    return axes, points, names, title, boundary, crossings, thresholds


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


def draw_map(axes, points, names, boundary, crossings, thresholds, panel):
    outcomes = points["outcome"].astype(float)
    shown = np.ma.masked_equal(outcomes, 0)
    colours = ListedColormap([COLOURS.get(name, "#ffffff") for name in names])
    norm = BoundaryNorm(np.arange(-0.5, len(names)), len(names))
    panel.pcolormesh(axes[0].borders(), axes[1].borders(), shown.T, cmap=colours, norm=norm, rasterized=True)
    panel.add_collection(LineCollection(border_lines(axes, boundary, outcomes.shape), colors="black", linewidths=0.8))
    handles = []
    if len(crossings):
        x, y = refined(axes, boundary, crossings, outcomes.shape)
        panel.plot(x, y, ".", color="black", markersize=3)
        handles.append(Line2D([], [], color="black", marker=".", markersize=3, linestyle="", label="refined"))
    for dashes, (label, first, second, values) in zip(THRESHOLD_DASHES, thresholds):
        panel.contour(axes[0].values[first], axes[1].values[second], values.T, [0], colors="#c0392b",
                      linestyles=[dashes], linewidths=1.2)
        handles.append(Line2D([], [], color="#c0392b", linestyle=dashes, label=label))
    panel.set(xlabel=axes[0].label, ylabel=axes[1].label)
    if axes[1].logarithmic:
        panel.set_yscale("log")
    axes[1].mark(panel.yaxis)
    return handles


def draw_line(axes, points, names, panel):
    for k, name in enumerate(names):
        here = points["outcome"] == k
        if k > 0 and here.any():
            panel.plot(axes[0].values[here], points["energy"][here], "o", color=COLOURS.get(name), markeredgecolor="0.3",
                       markeredgewidth=0.4)
    panel.set(xlabel=axes[0].label, ylabel="energy where the run stopped")
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


def draw(path, outputs, confirmed=None):
    axes, points, names, title, boundary, crossings, thresholds = read(path)
    if len(axes) > 2:
        raise BadInput(f"{path}: a picture has one or two axes, this scan {len(axes)}: {', '.join(a.key for a in axes)}")
    if not points["outcome"].any():
        raise BadInput(f"{path}: no point is finished yet")
    figure = Figure(figsize=(style.WIDTH, HEIGHT))
    panel = figure.add_axes([0.09, 0.11, 0.62, 0.8])
    if len(axes) == 2:
        handles = draw_map(axes, points, names, boundary, crossings, thresholds, panel)
        if confirmed:
            shape = points["outcome"].shape
            handles += draw_confirmed(axes, read_confirmed(confirmed, points["outcome"].size), shape, panel)
    elif confirmed:
        raise BadInput(f"{path}: has one axis; --confirmed marks points of a map")
    else:
        handles = draw_line(axes, points, names, panel)
    if axes[0].logarithmic:
        panel.set_xscale("log")
    axes[0].mark(panel.xaxis)
    panel.set_title(as_label(title))
    patches = [
        Patch(facecolor=COLOURS.get(name, "#ffffff"), edgecolor="0.3", linewidth=0.4, label=f"{name} ({count})")
        for k, name in enumerate(names)
        if k > 0 and (count := int((points["outcome"] == k).sum()))
    ]
    figure.legend(handles=patches + handles, loc="upper left", bbox_to_anchor=(0.72, 0.92))
    style.save(figure, outputs)
    plt.close("all")
