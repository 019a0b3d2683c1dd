#!/usr/bin/python3
"""Draws maps of the atlas: draw.py MAP.csv... -o PICTURE. A place is coloured like the nearest judged point, or
white where there is none near; a region is named by how its runs ended, or has a number that stands for it below. Maps of one
colour are named below."""

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
SHOWN = {"told": "detected", "silent": "undetected"}  # what the legend calls them
PLAIN = ("finished", "stationary", "found", "aligned")  # how runs end that need no name
BRANCHES = ("prolate", "oblate", "stomatocyte", "pear", "no region")
PIXELS = 300
NAMED = 0.04  # part of a panel above which a region gets its name
LETTER, LINE = 0.048, 0.09  # inches of the name of a region
GAP, HEAD, FOOT = 0.42, 0.3, 0.36  # inches: between panels, above and below a row of them


def label(row):
    if row["kind"] != "right":
        return row["kind"]
    return "right: finished" if row["stop"] in (*PLAIN, *BRANCHES) else "right: ended by the physics"


def panel(axes, chart, rows, numbers):
    names = list(COLOURS)
    stops = sorted({row["stop"] for row in rows})
    place = np.array([[int(r["i"]), int(r["j"])] for r in rows]) / (chart.across * FINEST)
    at = np.meshgrid(*[(np.arange(PIXELS) + 0.5) / PIXELS] * 2)
    away, near = cKDTree(place).query(np.stack(at, axis=-1), p=np.inf)  # in squares
    judged = away < 0.51 / chart.across  # else no point of its cell is judged: white
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
                name_regions(axes, (image == kind) & (stop == k), word, numbers, dark=names[int(kind)] == "silent")
    for axis, shown in ((axes.xaxis, chart.x), (axes.yaxis, chart.y)):
        fractions = (0, 0.5, 1) if shown.log else (0, 0.25, 0.5, 0.75, 1)
        axis.set_ticks(fractions, [f"{float(f'{shown.value(f):.2g}'):g}" for f in fractions])


def name_regions(axes, where, word, numbers, dark):
    """Draws the edges of regions, and writes `word` or its number into each large connected one, where there is room."""
    if where.any():
        axes.contour(where, [0.5], extent=(0, 1, 0, 1), colors="0.3", linewidths=0.4)
    regions, count = ndimage.label(np.pad(where, 1))
    wide, tall = axes.get_position().size * axes.figure.get_size_inches()
    for k in range(1, count + 1):
        region = regions == k
        if region.sum() < NAMED * PIXELS**2:
            continue
        for text in (word, str(numbers.get(word, len(numbers) + 1))):
            box = int(PIXELS * LINE / tall), int(PIXELS * LETTER * len(text) / wide)
            room = ndimage.binary_erosion(region, np.ones(box))
            if room.any() or text != word:
                break
        if text != word:
            numbers.setdefault(word, int(text))
        inside = ndimage.distance_transform_edt(room if room.any() else region)
        y, x = (np.array(np.unravel_index(inside.argmax(), inside.shape)) - 0.5) / PIXELS
        axes.text(x, y, text, ha="center", va="center", fontsize=6, color="white" if dark else "0.1")


def draw(paths, outputs):
    tables = [(MAPS[path.stem], read_table(path)) for path in paths]
    columns = 3 if all(len(chart.variants) % 3 == 0 for chart, _ in tables) else 4
    panels, plain, numbers = [], {}, {}
    for chart, rows in tables:
        for variant in chart.variants:
            own = [row for row in rows if row["variant"] == variant]
            if {(label(row), row["stop"]) for row in own} == {(label(own[0]), own[0]["stop"])} if own else False:
                plain.setdefault(f"{label(own[0])} everywhere: {chart.title}", []).append(variant)
            elif own:
                panels.append((chart, variant, own))
    lines = -(-len(panels) // columns)
    side = (style.WIDTH - 0.55 - GAP * (columns - 1) - 0.1) / columns
    tall = min(side, 1.6)
    everywhere = [f"{words} ({', '.join(variants)})" if any(variants) else words for words, variants in plain.items()]
    height = lines * (tall + HEAD + FOOT) + 0.2 + 0.16 * (len(everywhere) + 1)
    figure = Figure(figsize=(style.WIDTH, height))
    for k, (chart, variant, rows) in enumerate(panels):
        left, top = 0.55 + k % columns * (side + GAP), height - 0.2 - k // columns * (tall + HEAD + FOOT) - HEAD
        axes = figure.add_axes([left / style.WIDTH, (top - tall) / height, side / style.WIDTH, tall / height])
        panel(axes, chart, rows, numbers)
        axes.set_title(f"{chart.title}\n{variant}" if variant else chart.title, pad=3, fontsize=7)
        axes.set_xlabel(chart.x.key, labelpad=1)
        if k % columns == 0 or panels[k - 1][0] is not chart:
            axes.set_ylabel(chart.y.key, labelpad=1)
        else:
            axes.tick_params(labelleft=False)
    present = {label(row) for _, _, rows in panels for row in rows}
    handles = [Patch(facecolor=c, edgecolor="0.4", linewidth=0.4, label=SHOWN.get(n, n)) for n, c in COLOURS.items() if n in present]
    figure.legend(handles=handles, loc="upper center", ncols=len(handles), bbox_to_anchor=(0.5, 1.0), borderaxespad=0.1)
    below = everywhere + ([", ".join(f"{number}: {word}" for word, number in numbers.items())] if numbers else [])
    figure.text(0.55 / style.WIDTH, 0.03 / height, "\n".join(below), va="bottom", fontsize=7, linespacing=1.3)
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
