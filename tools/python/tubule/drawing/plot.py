"""Draws results of tubule: shapes and cuts at the output times, energies over time. See `tubule plot --help`."""

import argparse
import math
import os
import re
import sys
from operator import attrgetter

from matplotlib.figure import Figure

from . import command_line, scan, style
from .balance import BalancePanel, has_balance
from .curves import CurvePanel
from .cuts import CutPanel
from .energy import EnergyPanel
from .labels import as_label, row_labels
from .results import BadInput, read_result
from .series import Choice, SeriesPanel
from .surfaces import SurfacePanel, choose_colours
from .tubes import TubePanel, choose_columns

COLOURS = ("u_n", "H", "K", "p")
SCALES = ("run", "shape")
NOTHING = {
    "profiles": "no profiles",
    "surface": "no surfaces",
    "cuts": "no surfaces",
    "energy": "no energy series",
    "balance": "no dissipation over time",
    "all": "neither frames nor an energy series",
}


def arguments():
    parser = argparse.ArgumentParser(prog="tubule plot", description=__doc__)
    parser.add_argument("results", nargs="+")
    parser.add_argument("-o", "--output", action="append", default=[])
    parser.add_argument("--times", default="")
    parser.add_argument("--colour", default="", help="quantities to colour surfaces by: u_n,H,K,p")
    parser.add_argument("--plane", default="z=0", help="plane of the cuts")
    parser.add_argument("--kind", choices=NOTHING, default="all")
    parser.add_argument("--label", action="append", default=[], help="of each result, instead of what its case differs by")
    parser.add_argument("--scale", choices=SCALES, default="run",
                        help="velocities relative to the largest of")  # fmt: skip
    parser.add_argument("--series", default="", help="series to draw, and nothing else")
    parser.add_argument("--x", default="time", help="the series they are drawn against")
    parser.add_argument("--from", type=float, dest="low", help="from this value of it")
    parser.add_argument("--to", type=float, dest="high", help="up to this one")
    parser.add_argument("--logy", action="store_true", help="with a logarithmic axis")
    parser.add_argument("--dpi", type=float, default=style.DPI, help="pixels per inch")
    parser.add_argument("--movie", default="", help="film to write, .mp4 or .gif, and nothing else")
    parser.add_argument("--fps", type=float, default=10.0, help="of a film: frames per second, 0.1 to 100")
    parser.add_argument("--confirmed", help="of a scan: the JSON of `tubule confirm`, whose points are marked")
    parser.add_argument("--quantity", default="", help="of a scan: what its map shows")
    parser.add_argument("--slice", action="append", default=[], help="of a scan: KEY=VALUE of an axis that is cut")
    parser.add_argument("--term", action="append", default=[], help="NAME=LABEL of an energy term")
    return parser.parse_args()


class Page:
    """The panels to draw: first shapes, then series with the times of the shapes marked."""

    def __init__(self, results, labels, options):
        self.results, self.labels, self.options = results, labels, options
        self.marked = []

    def wants(self, *kinds):
        return self.options.kind in (*kinds, "all")

    def profiles(self):
        if not any(r.frames for r in self.results):
            return
        columns = choose_columns(self.results, self.options.times)
        self.marked = [column.time for column in columns if column.time is not None]
        if self.wants("profiles"):
            shown = [frame for column in columns for frame in column.cells if frame]
            graphs = all(frame.is_graph and frame.u_t is None for frame in shown)
            yield (TubePanel if graphs else CurvePanel)(self.results, self.labels, columns)

    def surfaces(self):
        shown = [(r, label) for r, label in zip(self.results, self.labels) if r.surfaces]
        if not shown:
            return
        results, labels = zip(*shown)
        columns = choose_columns(results, self.options.times, attrgetter("surfaces"))
        self.marked = self.marked or [column.time for column in columns if column.time is not None]
        if self.wants("surface"):
            yield SurfacePanel(results, labels, columns, choose_colours(results, self.options.colour))
        if self.options.kind == "cuts" or (self.options.kind == "all" and all(r.moves for r in results)):
            yield CutPanel(results, labels, columns, self.options.plane)

    def series(self):
        everything = self.options.kind == "all"
        if self.wants("energy"):
            # A surface at rest and a single stationary shape have one row, which makes no curve.
            least = [2 if everything and (r.surfaces or r.is_equilibrium) else 1 for r in self.results]
            shown = [i for i, r in enumerate(self.results) if r.has_energy(least[i])]
            if shown:
                yield EnergyPanel(*self._of(shown), self.marked, self.options.terms)
        if self.wants("balance"):
            shown = [i for i, r in enumerate(self.results) if has_balance(r) and (r.moves or not everything)]
            if shown:
                yield BalancePanel(*self._of(shown), self.marked)

    def _of(self, shown):
        return [self.results[i] for i in shown], [self.labels[i] for i in shown]

    def panels(self):
        if self.options.series:
            return [SeriesPanel(self.results, self.labels, self.options.series)]
        return [*self.profiles(), *self.surfaces(), *self.series()]


def figure_of(results, options):
    """Decides what can be drawn of the results and lays the panels out from top to bottom."""
    if not results:
        raise BadInput("no result to draw")
    names = [as_label(os.path.splitext(os.path.basename(result.path))[0]) for result in results]
    labels = row_labels([r.case for r in results], names if len(results) > 1 else [results[0].title])
    if options.label:
        if len(options.label) != len(results):
            raise BadInput(f"--label: {len(options.label)} labels, but {len(results)} results")
        labels = [[as_label(label)] for label in options.label]
    panels = Page(results, labels, options).panels()
    if not panels:
        raise BadInput(f"{', '.join(result.path for result in results)}: {NOTHING[options.kind]} to draw")

    bars = 0.62
    title = 0.2 if len(results) == 1 else 0.0
    coloured = [panel for panel in panels if hasattr(panel, "draw_colour_bars")]
    tall = title + sum(panel.height for panel in panels) + bars * len(coloured) + 0.1
    figure = Figure(figsize=(style.WIDTH, tall))
    top = figure.get_figheight() - 0.05
    if title:
        figure.text(0.5, top / figure.get_figheight(), ", ".join(labels[0]), ha="center", va="top", fontsize=9)
        top -= title
    for panel in panels if options.scale == "run" else ():
        if hasattr(panel, "scale_by_run"):
            panel.scale_by_run()
    for letter, panel in zip("abcde", panels):
        top -= panel.height
        panel.draw(figure, top)
        if len(panels) > 1:
            figure.text(0.01, (top + panel.height) / figure.get_figheight(), f"({letter})", va="top", fontsize=9)
        if panel in coloured:
            top -= bars
            panel.draw_colour_bars(figure, top + 0.08)
    return figure


def require_valid(options):
    """Raises ValueError for what no picture can show, on the command line and in draw()."""
    for option, value, allowed in (("kind", options.kind, NOTHING), ("scale", options.scale, SCALES), ("plane", options.plane[0], "xyz"),
                                   *(("colour", name, COLOURS) for name in options.colour)):  # fmt: skip
        if not isinstance(value, str) or value not in [*allowed]:
            raise ValueError(f"--{option}: {value!r} is not one of {', '.join(allowed)}")
    if not all(map(math.isfinite, [options.plane[1], *options.times])):
        raise ValueError("--times and --plane: a number must be finite")


def read_arguments(options):
    """Converts the texts to values; raises ValueError with the reason."""
    try:
        options.times = [float(time) for time in options.times.split(",") if time]
    except ValueError:
        raise ValueError(f"--times: '{options.times}' is not a list of numbers t1,t2,...") from None
    options.colour = [name for name in options.colour.split(",") if name]
    plane = re.fullmatch(r"([xyz])=([-+.\deE]+)", options.plane)
    try:
        options.plane = plane[1], float(plane[2])
    except (TypeError, ValueError):
        raise ValueError(f"--plane: '{options.plane}' is not x, y or z = number, such as z=0") from None
    require_valid(options)
    names = [name for name in options.series.split(",") if name]
    if not names and (options.low is not None or options.high is not None or options.logy or options.x != "time"):
        raise ValueError("--x, --from, --to and --logy belong to --series")
    options.series = Choice(names, options.x, options.low, options.high, options.logy) if names else None
    options.terms = dict(term.split("=", 1) for term in options.term)


def draw_movie(options):
    from . import movie  # no picture needs it

    paths = options.results
    if len(paths) > 1 or scan.is_scan(paths[0]):
        raise BadInput(f"{paths[0]}: --movie shows one result, and no scan")
    if options.series or options.kind != "all" or options.output or len(options.colour) > 1 or options.dpi != style.DPI:
        raise BadInput("--movie goes with --times, --label, --fps and one --colour only")
    result = read_result(paths[0])
    frames = result.surfaces or result.frames
    if options.times:
        columns = choose_columns([result], options.times, attrgetter("surfaces" if result.surfaces else "frames"))
        frames = [column.cells[0] for column in columns if column.cells[0]]
    title = as_label(options.label[0]) if options.label else result.title
    movie.draw(result, frames, options.movie, (options.colour or ["H"])[0], title, options.fps)


def draw_any(options, outputs):
    """A scan, or runs."""
    if not any(scan.is_scan(path) for path in options.results):
        for option in ("confirmed", "quantity", "slice"):
            if getattr(options, option):
                raise BadInput(f"{options.results[0]}: is no scan, to which --{option} belongs")
        style.save(figure_of([read_result(path) for path in options.results], options), outputs)
        return
    if len(options.results) > 1 or options.times or options.colour or options.kind != "all" or options.series:
        raise BadInput(f"{options.results[0]}: a scan is drawn alone, without --times, --colour, --kind and --series")
    style.save(scan.figure_of(options.results[0], options.quantity, options.slice, options.confirmed), outputs)


def main():
    options = arguments()
    base = os.path.splitext(options.results[0])[0]
    outputs = options.output or [base + ".png", base + ".svg"]
    try:
        read_arguments(options)
    except ValueError as error:
        command_line.say(f"tubule plot: {error}")
        return command_line.EXIT_BAD_INPUT
    if options.movie:
        try:
            draw_movie(options)
        except BadInput as error:
            command_line.say(error)
            return command_line.EXIT_BAD_INPUT
        except command_line.Unavailable as error:
            command_line.say(error)
            return command_line.EXIT_UNAVAILABLE
        command_line.say(options.movie, sys.stdout)
        return 0

    def draw(pictures):
        with style.resolution(options.dpi):
            draw_any(options, pictures)

    return command_line.run(draw, outputs, str)
