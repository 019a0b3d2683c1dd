"""The pictures of `tubule chart`."""

import re
import textwrap

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from . import style
from .labels import as_label, power

FLOOR = 1e-16  # an error of zero is drawn here
SMALL = 6.5
SIDE = 2.6  # inches beside the axes, for text
CHARACTERS = 60  # of a line there
FAILED = {"marker": "x", "ls": "", "markersize": 5, "mew": 1.1}


def series_styles(chart):
    names = list(dict.fromkeys(series.name for series in chart.series))
    markers = style.MARKERS * len(names)
    return {name: {"color": colour, "marker": marker} for name, colour, marker in zip(names, style.line_colours(len(names)), markers)}


def in_words(text):
    """Settings as `key=value`, in the words of a reader."""
    text = re.sub(r"\belements=(\S+)", r"\1 elements,", text)
    text = re.sub(r"\btime_tolerance=([^\s;]+)", lambda m: f"tolerance {power(float(m[1]), 1)}", text)
    return re.sub(r"(\w)=(?=\S)", r"\1 ", text).rstrip(",")


def sorted_runs(jobs, runs, truth, names):
    """Runs of each series that reached all times, by key, and the others with their jobs."""
    by_series, failed = {name: {} for name in names}, {}
    for job in jobs:
        run = runs[job.key]
        if run.key == truth.key or job.series not in by_series:
            continue
        if run.reached(truth.values):
            by_series[job.series][run.key] = run
        else:
            failed[run.key] = (job, run)
    return by_series, failed


def words_beside(front, named, failed):
    """The settings of the front, and one line per reason for which runs of a series stopped early."""
    lines = ["The front, cheapest first:"] + [f"{n}  {in_words(named[run.key])}" for n, run in enumerate(front, 1)]
    stops = {}
    for job, run in failed.values():
        stops.setdefault(f"{job.series}: {run.outcome}: ", []).append(f"{in_words(job.varied)} (t = {run.stop_time:.3g})")
    if stops:
        lines += ["", "Stopped early:", *(words + "; ".join(which) for words, which in stops.items())]
    return "\n".join(part for line in lines for part in textwrap.wrap(line, CHARACTERS, subsequent_indent="      "))


def work_precision(chart, jobs, runs, truth, front, named, outputs, error_of):
    """All runs, faint, and a line through the best of each series; crosses on the upper edge for those that failed,
    numbers on the front of all, named beside."""
    styles, height = series_styles(chart), 3.9
    figure = Figure(figsize=(style.WIDTH, height))
    width = style.WIDTH - SIDE - 0.6
    axes = figure.add_axes([0.6 / style.WIDTH, 0.42 / height, width / style.WIDTH, 1 - 0.72 / height])
    by_series, failed = sorted_runs(jobs, runs, truth, styles)

    def place(run):
        return run.cpu_s, max(error_of(run, truth), FLOOR)

    def plot(points, **look):
        axes.loglog([p[0] for p in points], [p[1] for p in points], **look)

    for name, of in by_series.items():
        points = sorted(map(place, of.values()))
        plot(points, ls="", alpha=0.45, markersize=2.5, zorder=2, **styles[name])
        plot([p for i, p in enumerate(points) if all(p[1] < q[1] for q in points[:i])], ls="-", zorder=3, **styles[name])
    plot([place(run) for run in front], color="0.75", lw=4, zorder=1, solid_capstyle="round")
    for number, run in enumerate(front, 1):
        axes.annotate(str(number), place(run), (-4, -8), textcoords="offset points", fontsize=SMALL, zorder=5, ha="right")
    for job, run in failed.values():
        axes.plot(max(run.cpu_s, 1e-3), 0.985, transform=axes.get_xaxis_transform(), color=styles[job.series]["color"],
                  clip_on=False, zorder=6, **FAILED)  # fmt: skip
    finish_axes(axes, chart, truth)
    handles = [Line2D([], [], label=name, **styles[name]) for name in styles]
    handles += [Line2D([], [], color="0.3", label="stopped early", **FAILED)] * bool(failed)
    axes.legend(handles=handles, loc="best", fontsize=SMALL)
    figure.text(1 - (SIDE - 0.08) / style.WIDTH, 1 - 0.12 / height, words_beside(front, named, failed), va="top", fontsize=5.8,
                linespacing=1.25)  # fmt: skip
    style.save(figure, list(map(str, outputs)))


def finish_axes(axes, chart, truth):
    """Limits, ticks and words, and the band where errors are below that of the reference."""
    if truth.known_to > 0:
        bottom = min(axes.get_ylim()[0], truth.known_to / 2)
        axes.set_ylim(bottom=bottom)
        axes.axhspan(bottom, truth.known_to, color="0.93", zorder=0)
        axes.annotate("within the error of the reference", (1, truth.known_to), (-3, 2), ha="right", va="bottom",
                      xycoords=("axes fraction", "data"), textcoords="offset points", fontsize=SMALL, color="0.35")  # fmt: skip
    axes.set_ylim(top=axes.get_ylim()[1] * 4)
    relative = "E_ref" if "energy" in chart.quantity else "its largest value"
    axes.set(xlabel="CPU time of a whole run (s)", ylabel=f"largest error of {chart.quantity}, relative to {relative}")
    at = ", ".join(f"{time:g}" for time in truth.values)
    axes.set_title(f"{as_label(chart.title or chart.case.stem)}; t = {at}", loc="left", fontsize=7)
    axes.tick_params(which="both", top=True, right=True)
    low, high = axes.get_xlim()
    if high < 100 * low:  # powers of ten alone are too sparse
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())


def stability_map(chart, lines, runs, outputs):
    """A panel for each mesh, a bar for each series: up to the largest stable value, with a mark at the smallest unstable
    one, which says how that run ended."""
    styles = series_styles(chart)
    panels = sorted({line.against for line in lines})
    inches = 0.17 * len(styles)
    height = inches + 1.15
    figure = Figure(figsize=(style.WIDTH, height))
    names = list(reversed(styles))
    left, right = 0.2, 0.985
    width = (right - left + 0.03) / len(panels)
    values = [value for line in lines for value in line.values]
    lowest = min(values) / 1.5
    for column, against in enumerate(panels):
        axes = figure.add_axes([left + column * width, 0.62 / height, width - 0.03, inches / height])
        for line in (line for line in lines if line.against == against):
            draw_limits(axes, names.index(line.series.name), line, runs, styles[line.series.name]["color"], lowest)
        axes.set(xscale="log", xlim=(lowest, 5 * max(values)), ylim=(-0.6, len(names) - 0.4), xlabel=chart.map.key.rpartition(".")[2])
        axes.set_yticks(range(len(names)), names if column == 0 else [""] * len(names), fontsize=SMALL)
        axes.tick_params(axis="y", length=0)
        axes.tick_params(axis="x", which="both", top=True)
        axes.set_title(f"{as_label(chart.against.rpartition('.')[2])} = {against:g}", fontsize=7)
    figure.text(left, 1 - 0.12 / height, as_label(chart.title or chart.case.stem), va="top", fontsize=7.5)
    handles = [
        Patch(color="0.5", label="stable"),
        Line2D([], [], color="0.3", label="run stopped", **FAILED),
        Line2D([], [], color="0.3", ls="", marker="o", mfc="white", label="energy grew by 10 %"),
    ]
    figure.legend(handles=handles, loc="lower center", bbox_to_anchor=((left + right) / 2, 0), ncol=3, fontsize=SMALL)
    style.save(figure, list(map(str, outputs)))


def draw_limits(axes, place, line, runs, colour, lowest):
    """The bar of a line of the map, and the run that bounds it."""
    found = {value: runs[key] for i, value in enumerate(line.values) if (key := line.job(i).key) in runs}
    stable = [value for value, run in found.items() if run.stable]
    unstable = [value for value, run in found.items() if not run.stable]
    if stable:
        axes.barh(place, max(stable) - lowest, left=lowest, height=0.62, color=colour)
    if not unstable:
        axes.annotate("all stable", (max(stable, default=lowest), place), (3, 0), textcoords="offset points", va="center",
                      fontsize=5.8)  # fmt: skip
    elif found[min(unstable)].finished:
        axes.plot(min(unstable), place, ls="", marker="o", mfc="white", color=colour, markersize=4)
    else:
        axes.plot(min(unstable), place, color=colour, **FAILED)
