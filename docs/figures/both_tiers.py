"""Draws error against CPU time of both tiers, one panel a scene, from tables of `tubule chart`."""

from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from . import command_line, style
from .tables import read_rows

COLUMNS = 3
MODELS = ("gradient-flow", "overdamped", "stokes", "fluid")
LOWEST = 1e-11  # errors below are drawn there
# What follows the tier in the name of a series, in the order of the legend.
MARKERS = {
    "": ("o", "accuracy requested"),
    "gradient-flow": ("v", "gradient flow"),
    "overdamped": ("<", "overdamped"),
    "stokes": (">", "Stokes"),
    "fluid": ("^", "fluid"),
    "bdf2": ("s", "scheme bdf2, mesh given"),
    "bdf": ("D", "scheme bdf"),
    "alpha": ("P", "scheme alpha"),
    "euler": ("X", "scheme euler"),
    "paper": ("*", "scheme paper"),
}
TIERS = ("axisym", "surface3d")


def look_of(series):
    tier, _, kind = series.partition(", ")
    return {"color": style.line_colours(3)[TIERS.index(tier)], "marker": MARKERS[kind][0], "markersize": 4}


def draw_scene(axes, path):
    rows = [row for row in read_rows(path, ("series", "outcome", "error"), ("cpu_s",)) if row.series != "reference"]
    runs = [row for row in rows if row.outcome == "finished"]
    for series in dict.fromkeys(row.series for row in runs):
        own = [(row.cpu_s, max(float(row.error), LOWEST)) for row in runs if row.series == series]
        line = {} if series.partition(", ")[2] in ("", *MODELS) else {"ls": ""}
        axes.loglog(*zip(*own), lw=0.8, **line, **look_of(series))
    for row in rows:
        if row.outcome != "finished":  # at the upper edge
            axes.plot(row.cpu_s, 1, "x", color=look_of(row.series)["color"], transform=axes.get_xaxis_transform(), clip_on=False)
    axes.set_title(path.stem.replace("_", " "))
    axes.grid(color="0.92", linewidth=0.4)


def draw(paths, outputs):
    figure = Figure(figsize=(style.WIDTH, 4.6))
    panels = figure.subplots(2, COLUMNS, sharex=True, sharey=True).flat
    for i, axes in enumerate(panels):
        if i < len(paths):
            draw_scene(axes, Path(paths[i]))
        else:
            axes.set_axis_off()
        if i + COLUMNS >= len(paths):  # none below
            axes.set_xlabel("CPU time of a run (s)")
            axes.tick_params(labelbottom=True)
        if i % COLUMNS == 0:
            axes.set_ylabel("error of the energy / E_ref")
    handles = [Line2D([], [], color=style.line_colours(3)[i], lw=3, label=f"tier {tier}") for i, tier in enumerate(TIERS)]
    handles += [Line2D([], [], color="0.3", ls="", marker=marker, label=label) for marker, label in MARKERS.values()]
    figure.axes[-1].legend(handles=handles, loc="center")
    figure.tight_layout()
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw, nargs="+")
