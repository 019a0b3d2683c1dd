"""Draws error against CPU time from a table with the columns series, energy_asked, error, estimate, cpu_ms."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from . import command_line, style
from .tables import read_rows


# CPU milliseconds of the prototype with settings tuned by hand, quintic B-splines, for its errors, which were
# relative to E(0), which is 0.3946 of E_ref.
PROTOTYPE = ((0.3946e-4, 0.51), (0.3946e-6, 1.3), (0.3946e-8, 4.8))
FLOOR = 1e-16  # an error of zero is drawn here


def read_table(path):
    """{series: rows (energy_asked, error, estimate, cpu_ms), by requested accuracy, coarse first}. Raises BadInput."""
    lines = {}
    for series, *values in read_rows(path, ("series",), ("energy_asked", "error", "estimate", "cpu_ms")):
        lines.setdefault(series, []).append(values)
    return {name: sorted(rows, reverse=True) for name, rows in lines.items()}


def draw(path, outputs):
    """Filled: errors; hollow: the estimates of the program; dotted lines: requested accuracies."""
    lines = read_table(path)
    figure = Figure(figsize=(style.WIDTH, 4.2))
    axes = figure.add_axes([0.09, 0.215, 0.8, 0.73])
    axes.set_title("The paper's tube in gradient flow, k42 = 0.12", loc="left")
    reference = np.array(PROTOTYPE)
    handles = [Line2D([], [], color="0.55", linestyle="--", marker="D", markersize=4, label="prototype, tuned by hand")]
    axes.loglog(reference[:, 1], reference[:, 0], color="0.55", linestyle="--", marker="D", markersize=4, zorder=1)
    for index, ((name, rows), colour) in enumerate(zip(lines.items(), style.line_colours(len(lines)))):
        _, error, estimate, cpu = np.array(rows).T
        error, estimate = np.maximum(error, FLOOR), np.maximum(estimate, FLOOR)
        marker = style.MARKERS[index % len(style.MARKERS)]
        axes.loglog(cpu, error, color=colour, marker=marker, zorder=3)
        axes.loglog(cpu, estimate, color=colour, marker=marker, mfc="white", linestyle="", zorder=3)
        axes.vlines(cpu, np.minimum(error, estimate), np.maximum(error, estimate), colors=[colour], lw=0.6, zorder=2)
        handles.append(Line2D([], [], color=colour, marker=marker, label=name))
    hollow = {"color": "0.3", "marker": "o", "mfc": "white", "linestyle": ""}
    handles.append(Line2D([], [], label="estimate by the run itself", **hollow))
    axes.set_xlabel("CPU time of a whole run (ms)")
    axes.set_ylabel("largest error of the energy, relative to E_ref")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    for asked in sorted({row[0] for rows in lines.values() for row in rows}):
        axes.axhline(asked, color="0.6", linewidth=0.6, linestyle=":", zorder=0)
        text = "asked: " + f"{asked:.0e}".replace("e-0", "e-")
        axes.annotate(text, (1, asked), (4, 0), xycoords=("axes fraction", "data"), textcoords="offset points",
                      va="center", fontsize=6.5, color="0.35")
    axes.margins(x=0.08, y=0.1)
    figure.legend(handles=handles, loc="lower center", ncol=4)
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw)
