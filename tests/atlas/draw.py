#!/usr/bin/python3
"""Draws a map of the atlas: draw.py MAP.csv -o PICTURE. The place of a point is coloured like the nearest judged one."""

import argparse
import csv
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fuzz"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools/python/tubule"))
import numpy as np  # noqa: E402
from drawing import style  # noqa: E402
from lattice import FINEST  # noqa: E402
from maps import MAPS  # noqa: E402
from matplotlib.colors import ListedColormap  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402
from scipy.interpolate import NearestNDInterpolator  # noqa: E402

# In the order of the legend; lightness falls with how bad it is, so that it reads in grey, too.
COLOURS = {
    "right: finished": "#deebf7",
    "right: ended by the physics": "#9ecae1",
    "told": "#fec44f",
    "undecided": "#969696",
    "false alarm": "#d95f0e",
    "silent": "#000000",
}
PIXELS = 400


def label(row):
    if row["kind"] != "right":
        return row["kind"]
    return "right: finished" if row["stop"] in ("finished", "stationary") else "right: ended by the physics"


def panel(axes, chart, rows):
    names = list(COLOURS)
    place = np.array([[int(r["i"]), int(r["j"])] for r in rows]) / (chart.across * FINEST)
    nearest = NearestNDInterpolator(place, [names.index(label(r)) for r in rows])
    at = (np.arange(PIXELS) + 0.5) / PIXELS
    image = nearest(*np.meshgrid(at, at))
    axes.imshow(image, origin="lower", extent=(0, 1, 0, 1), aspect="auto", vmin=-0.5, vmax=len(names) - 0.5,
                cmap=ListedColormap(list(COLOURS.values())), interpolation="nearest")  # fmt: skip
    axes.plot(*place.T, ".", color="0.35", markersize=0.6)
    for axis, shown in ((axes.xaxis, chart.x), (axes.yaxis, chart.y)):
        fractions = (0, 0.25, 0.5, 0.75, 1)
        axis.set_ticks(fractions, [f"{shown.value(f):.3g}" for f in fractions])


def draw(path, outputs):
    chart = MAPS[path.stem]
    rows = list(csv.DictReader(open(path, newline="")))
    variants = [v for v in chart.variants if any(r["variant"] == v for r in rows)]
    wide = 0.75
    side = (style.WIDTH - wide - 0.35 * 2) / 3
    height = side + 0.95
    figure = Figure(figsize=(style.WIDTH, height))
    for k, variant in enumerate(variants):
        axes = figure.add_axes([(0.55 + k * (side + 0.35)) / style.WIDTH, 0.42 / height, side / style.WIDTH, side / height])
        panel(axes, chart, [r for r in rows if r["variant"] == variant])
        axes.set_title(variant or chart.title, pad=3)
        axes.set_xlabel(chart.x.key)
        axes.set_ylabel(chart.y.key) if k == 0 else axes.tick_params(labelleft=False)
    present = {label(r) for r in rows}
    handles = [Patch(facecolor=c, edgecolor="0.4", linewidth=0.4, label=n) for n, c in COLOURS.items() if n in present]
    if len(variants) == 1:
        figure.legend(handles=handles, loc="center left", bbox_to_anchor=((0.75 + side) / style.WIDTH, 0.5))
    else:
        figure.legend(handles=handles, loc="upper center", ncols=len(handles), bbox_to_anchor=(0.5, 1.0))
    style.save(figure, outputs)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("-o", "--output", nargs="+", required=True)
    a = parser.parse_args()
    draw(a.table, a.output)
