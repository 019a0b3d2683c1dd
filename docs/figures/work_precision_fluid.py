"""Draws error against CPU time of a fluid and of Stokes flow, from the table of tests/studies/benchmark/work_precision_fluid.py."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from . import command_line, style
from .results import BadInput
from .tables import read_rows

MODELS = {"fluid": "fluid, with inertia", "stokes": "Stokes flow"}
REFERENCE = "reference"  # the run that the others are compared with; its error is its distance to the next finest

STAR = {"color": "k", "marker": "*", "markersize": 6.5, "mew": 0.7, "ls": ""}


def read_table(path):
    """{model: rows}; `asked` is 0 with explicit settings. Raises BadInput."""
    rows = read_rows(path, ("model", "series"), ("asked", "error", "estimate", "cpu_s"))
    runs = {model: [row for row in rows if row.model == model] for model in MODELS}
    for model, of_model in runs.items():
        if not any(run.series == REFERENCE for run in of_model) or len(of_model) == 1:
            raise BadInput(f"{path}: has no reference, or no other run, of {model}")
    return runs


def best(runs):
    """Runs for which no other is better in both error and time, cheapest first."""
    front = []
    for run in sorted(runs, key=lambda run: (run.cpu_s, run.error)):
        if not front or run.error < front[-1].error:
            front.append(run)
    return front


def draw_model(axes, runs, styles):
    reference = next(run for run in runs if run.series == REFERENCE)
    # Nothing is known below the error of the reference.
    runs = [run._replace(error=max(run.error, reference.error)) for run in runs if run is not reference]
    axes.axhspan(reference.error * 1e-6, reference.error, color="0.93", zorder=0)
    axes.annotate("within the error of the reference", (1, reference.error), (-8, -3), ha="right", va="top",
                  xycoords=("axes fraction", "data"), textcoords="offset points", fontsize=6.5, color="0.35")
    for series, look in styles.items():
        every = [run for run in runs if run.series == series]
        front = best(every)
        faint = {**look, "ls": "", "alpha": 0.3, "markersize": 2.5}
        axes.loglog([run.cpu_s for run in every], [run.error for run in every], zorder=1, **faint)
        axes.loglog([run.cpu_s for run in front], [run.error for run in front], zorder=2, **look)
    for run in runs:
        if run.asked > 0:
            axes.loglog([run.cpu_s] * 2, [run.error, run.estimate], color="k", lw=0.6, zorder=2)
            axes.loglog(run.cpu_s, run.error, zorder=4, **STAR)
            axes.loglog(run.cpu_s, run.estimate, mfc="white", zorder=3, **STAR)
    axes.set_ylim(bottom=reference.error / 3)


def draw(path, outputs):
    """All runs, faint, and a line through the best of each kind. Stars: requested accuracies; hollow: the estimates."""
    table = read_table(path)
    given = [run for runs in table.values() for run in runs if run.asked == 0 and run.series != REFERENCE]
    names = list(dict.fromkeys(run.series for run in given))
    kinds = list(dict.fromkeys(name.split(",")[0] for name in names))
    orders = sorted({name.split(",")[1] for name in names})
    colours = dict(zip(orders, style.line_colours(len(orders))))
    markers = dict(zip(orders, style.MARKERS))
    styles = {}
    for name in names:
        kind, order = name.split(",")
        even = kinds.index(kind) > 0
        styles[name] = {"color": colours[order], "marker": markers[order], "ls": "--" if even else "-"}
        if even:
            styles[name]["mfc"] = "white"
    figure = Figure(figsize=(style.WIDTH, 3.6))
    for left, (model, title) in zip((0.085, 0.575), MODELS.items()):
        axes = figure.add_axes([left, 0.255, 0.415, 0.69])
        draw_model(axes, table[model], styles)
        axes.set_title(title)
        axes.set_xlabel("CPU time of a whole run (s)")
        if left < 0.5:
            axes.set_ylabel("largest error of the energy, relative to E_ref")
    handles = [Line2D([], [], label=name, **styles[name]) for name in names]
    handles.append(Line2D([], [], label="requested accuracy", **STAR))
    handles.append(Line2D([], [], label="error that the run states", mfc="white", **STAR))
    figure.legend(handles=handles, loc="lower center", ncol=4)
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw)
