#!/usr/bin/python3
"""Draws maps of the atlas: draw.py MAP.csv... -o PICTURE. A place is coloured like the nearest judged point, or
white where there is none near; a region is named by how its runs ended."""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fuzz"))
sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools/python/tubule"))
import numpy as np  # noqa: E402
from drawing import style  # noqa: E402
from lattice import FINEST, read_table  # noqa: E402
from maps import MAPS  # noqa: E402
from matplotlib.colors import ListedColormap  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402
from PIL import Image  # noqa: E402
from scipy import ndimage  # noqa: E402
from scipy.spatial import cKDTree  # noqa: E402

# In the order of the legend; lightness falls with how bad it is, so that it reads in grey, too.
COLOURS = {
    "right: finished": "#deebf7",
    "right: ended by the physics": "#9ecae1",
    "told": "#fec44f",
    "undecided": "#969696",
    "false alarm": "#d95f0e",
    "silent": "#000000",
}
PLAIN = ("finished", "stationary", "found", "aligned")  # how runs end that need no name
BRANCHES = ("prolate", "oblate", "stomatocyte", "pear", "no region")
PIXELS = 300
NAMED = 0.04  # part of a panel above which a region gets its name
GAP, HEAD, FOOT = 0.42, 0.3, 0.36  # inches: between panels, above and below a row of them


def label(row):
    if row["kind"] != "right":
        return row["kind"]
    return "right: finished" if row["stop"] in (*PLAIN, *BRANCHES) else "right: ended by the physics"


def panel(axes, chart, rows):
    names = list(COLOURS)
    stops = sorted({row["stop"] for row in rows})
    place = np.array([[int(r["i"]), int(r["j"])] for r in rows]) / (chart.across * FINEST)
    at = np.meshgrid(*[(np.arange(PIXELS) + 0.5) / PIXELS] * 2)
    away, near = cKDTree(place).query(np.stack(at, axis=-1))
    judged = away < 0.8 / chart.across  # else no point of its cell is judged: white
    image = np.where(judged, np.array([names.index(label(r)) for r in rows])[near], np.nan)
    stop = np.array([stops.index(r["stop"]) for r in rows])[near]
    axes.imshow(image, origin="lower", extent=(0, 1, 0, 1), aspect="auto", vmin=-0.5, vmax=len(names) - 0.5,
                cmap=ListedColormap(list(COLOURS.values())), interpolation="nearest")  # fmt: skip
    axes.plot(*place.T, ".", color="0.35", markersize=0.4)
    for kind in ("false alarm", "silent"):  # to be seen where they are few
        axes.plot(*place[[row["kind"] == kind for row in rows]].T, "D", color=COLOURS[kind], markersize=3, clip_on=False)
    for kind in np.unique(image[judged]):
        for k, word in enumerate(stops):
            if word not in PLAIN:
                name_regions(axes, (image == kind) & (stop == k), word, dark=names[int(kind)] == "silent")
    for axis, shown in ((axes.xaxis, chart.x), (axes.yaxis, chart.y)):
        fractions = (0, 0.5, 1) if shown.log else (0, 0.25, 0.5, 0.75, 1)
        axis.set_ticks(fractions, [f"{float(f'{shown.value(f):.2g}'):g}" for f in fractions])


def name_regions(axes, where, word, dark):
    """Draws the edges of regions, and writes `word` into each large connected one, where it is widest."""
    if where.any():
        axes.contour(where, [0.5], extent=(0, 1, 0, 1), colors="0.3", linewidths=0.4)
    regions, count = ndimage.label(np.pad(where, 1))
    for k in range(1, count + 1):
        region = regions == k
        if region.sum() < NAMED * PIXELS**2:
            continue
        inside = ndimage.distance_transform_edt(region)
        y, x = (np.array(np.unravel_index(inside.argmax(), inside.shape)) - 0.5) / PIXELS
        edge = max(0.22, 0.022 * len(word))
        axes.text(min(max(x, edge), 1 - edge), y, word, ha="center", va="center", fontsize=6, color="white" if dark else "0.1")


def draw(paths, outputs):
    tables = [(MAPS[path.stem], read_table(path)) for path in paths]
    columns = 3 if all(len(chart.variants) % 3 == 0 for chart, _ in tables) else 4
    panels = []
    for chart, rows in tables:
        for variant in chart.variants:
            own = [row for row in rows if row["variant"] == variant]
            if own:
                panels.append((chart, variant, own))
    lines = -(-len(panels) // columns)
    side = (style.WIDTH - 0.55 - GAP * (columns - 1) - 0.1) / columns
    tall = min(side, 1.6)
    height = lines * (tall + HEAD + FOOT) + 0.2
    figure = Figure(figsize=(style.WIDTH, height))
    for k, (chart, variant, rows) in enumerate(panels):
        left, top = 0.55 + k % columns * (side + GAP), height - 0.2 - k // columns * (tall + HEAD + FOOT) - HEAD
        axes = figure.add_axes([left / style.WIDTH, (top - tall) / height, side / style.WIDTH, tall / height])
        panel(axes, chart, rows)
        axes.set_title(f"{chart.title}\n{variant}" if variant else chart.title, pad=3, fontsize=7)
        axes.set_xlabel(chart.x.key, labelpad=1)
        if k % columns == 0 or panels[k - 1][0] is not chart:
            axes.set_ylabel(chart.y.key, labelpad=1)
        else:
            axes.tick_params(labelleft=False)
    present = {label(row) for _, _, rows in panels for row in rows}
    handles = [Patch(facecolor=c, edgecolor="0.4", linewidth=0.4, label=n) for n, c in COLOURS.items() if n in present]
    figure.legend(handles=handles, loc="upper center", ncols=len(handles), bbox_to_anchor=(0.5, 1.0), borderaxespad=0.1)
    style.save(figure, outputs)
    for path in outputs:
        if path.endswith(".png"):
            Image.open(path).convert("RGB").quantize(64).save(path, optimize=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", type=Path, nargs="+")
    parser.add_argument("-o", "--output", nargs="+", required=True)
    a = parser.parse_args()
    style.apply()
    draw(a.tables, a.output)
