"""Draws the cost of a step in three dimensions with each measure for its linear system, from the table of step_costs."""

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from . import command_line, style
from .results import BadInput
from .tables import read_rows

PARTS = ("solvers", "lagged")  # "threads" needs a quiet machine and may be missing
STEP, SYSTEM = "a step", "its system, with border"
CHOSEN = "LDL^T single, METIS on nodes"
DENSE = "the same, H and K first"  # twenty times as long as the others: only in the table


def read_table(path):
    """The rows. Raises BadInput."""
    numbers = ("order", "triangles", "threads", "whole", "analysis", "factors", "iterations")
    rows = read_rows(path, ("part", "measure"), numbers)
    for part in PARTS:
        if not any(row.part == part for row in rows):
            raise BadInput(f"{path}: has no rows of {part}")
    return rows


def draw_solvers(axes, rows, colours):
    """One bar per measure: its linear solve and the rest of a step, as numbers: solve of step. Bold: the method of the program."""
    by_name = {row.measure: row for row in rows}
    rest = by_name[STEP].whole - by_name[SYSTEM].whole
    names = [name for name in by_name if name not in (STEP, SYSTEM, DENSE)]
    for place, name in enumerate(reversed(names)):
        row, left = by_name[name], 0
        parts = (row.analysis, row.factors, row.whole - row.analysis - row.factors, rest)
        for part, colour in zip(parts, colours):
            axes.barh(place, part, left=left, color=colour, height=0.7)
            left += part
        axes.annotate(f"{row.whole:.0f} of {left:.0f}", (left, place), (2, 0), textcoords="offset points", va="center", fontsize=6.5)
    axes.set_yticks(range(len(names)), reversed(names))
    for label in axes.get_yticklabels():
        label.set_fontweight("bold" if label.get_text() == CHOSEN else "normal")
    axes.set_xlim(0, 1.7 * axes.get_xlim()[1])
    axes.tick_params(axis="y", length=0)


def draw_lagged(axes, rows, sizes):
    """Time of the linear solve with kept factors over that with new ones; numbers are iterations."""
    for index, (size, colour) in enumerate(zip(sizes, style.line_colours(len(sizes)))):
        line = [row for row in rows if (row.order, row.triangles) == size]
        if not line:
            continue
        lags = [int(row.measure.split()[-1]) for row in line]
        ratios = [row.whole / line[0].whole for row in line]
        axes.plot(lags, ratios, color=colour, marker=style.MARKERS[index], label=f"k = {size[0]:g}, {size[1]:g}")
        axes.annotate(f"{line[-1].iterations:.0f}", (lags[-1], ratios[-1]), (4, 0), textcoords="offset points",
                      va="center", fontsize=6.5)
    axes.axhline(1, color="0.6", linewidth=0.6, linestyle=":", zorder=0)
    axes.set_xscale("log", base=2)
    axes.set_xticks((1, 2, 4, 8), ("1", "2", "4", "8"))
    axes.set_xlim(0.9, 10)
    axes.set_xlabel("steps for which factors are kept")
    axes.set_ylabel("system's time over that of n = 1")
    axes.set_title("lagged factors (numbers: iterations)")
    axes.legend()


def draw_threads(axes, rows, sizes, colours):
    """Wall time of one thread over that of two."""
    names = list(dict.fromkeys(row.measure for row in rows))
    for index, name in enumerate(names):
        line = {(row.order, row.triangles, row.threads): row.whole for row in rows if row.measure == name}
        places = [place + 0.27 * (index - 1) for place in range(len(sizes))]
        gains = [line[(*size, 1)] / line[(*size, 2)] for size in sizes]
        axes.bar(places, gains, width=0.25, color=colours[index], label=name)
    axes.axhline(1, color="0.6", linewidth=0.6, linestyle=":", zorder=0)
    axes.set_xticks(range(len(sizes)), [f"{order:g}, {triangles:g}" for order, triangles in sizes], fontsize=6)
    axes.set_xlabel("k, triangles")
    axes.set_ylabel("wall time of one thread over two")
    axes.set_ylim(top=1.35 * axes.get_ylim()[1])
    axes.set_title("two threads")
    axes.legend(loc="upper left", ncol=1)


def draw(path, outputs):
    rows = read_table(path)
    sizes = sorted({(row.order, row.triangles) for row in rows})
    orders = sorted({order for order, _ in sizes})
    triangles = sorted({number for _, number in sizes})
    colours = [*style.line_colours(3), "0.85"]
    figure = Figure(figsize=(style.WIDTH, 7.6))
    for i, order in enumerate(orders):
        for j, number in enumerate(triangles):
            axes = figure.add_axes([0.255 + 0.25 * j, 0.735 - 0.295 * i, 0.225, 0.235])
            draw_solvers(axes, [r for r in rows if (r.part, r.order, r.triangles) == ("solvers", order, number)], colours)
            axes.set_title(f"k = {order:g}, {number:g} triangles")
            if j > 0:
                axes.set_yticklabels([])
            if i + 1 == len(orders):
                axes.set_xlabel("CPU time, one thread (ms)")
    names = ("analysis", "factors", "solution", "rest of the step")
    handles = [Patch(color=colour, label=label) for label, colour in zip(names, colours)]
    figure.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.6, 0.352), ncol=4)
    threads = [r for r in rows if r.part == "threads"]
    width = 0.4 if threads else 0.9
    draw_lagged(figure.add_axes([0.085, 0.06, width, 0.26]), [r for r in rows if r.part == "lagged"], sizes)
    if threads:
        draw_threads(figure.add_axes([0.585, 0.06, 0.4, 0.26]), threads, sizes, style.line_colours(3))
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw)
