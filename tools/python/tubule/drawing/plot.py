"""Draws results of tubule: shapes and cuts at the output times, energies over time. See `tubule plot --help`."""

import os
import sys
import textwrap
from operator import attrgetter

from matplotlib.figure import Figure

from . import command_line, scan, style, units
from .curves import CurvePanel
from .cuts import CutPanel
from .energy import BranchPanel, EnergyPanel
from .labels import as_label, row_labels, sorted_by_value
from .results import BadInput
from .series import BalancePanel, SeriesPanel, has_balance
from .surfaces import SurfacePanel, choose_colours
from .tubes import TubePanel, check_quantities, choose_columns

NO_SURFACES = "no surfaces to draw; those of tier axisym are drawn by --kind profiles"
NOTHING = {
    "profiles": "no profiles to draw; those of tier surface3d are drawn by --kind surface or cuts",
    "surface": NO_SURFACES,
    "cuts": NO_SURFACES,
    "energy": "no energy series to draw",
    "balance": "no dissipation over time to draw",
    "all": "neither frames nor an energy series to draw",
}


class Page:
    """The panels to draw: first shapes, then series with the times of the shapes marked."""

    def __init__(self, results, labels, options):
        self.results, self.labels, self.options = results, labels, options
        self.times = [time * results[0].scale("time") for time in options.times]  # they are those of the files
        self.marked = []

    def wants(self, kind):
        return bool({kind, "all"} & set(self.options.kind))

    def profiles(self):
        if not any(r.frames for r in self.results):
            return
        columns = choose_columns(self.results, self.times)
        self.marked = [column.time for column in columns if column.time is not None]
        if self.wants("profiles"):
            shown = [frame for column in columns for frame in column.cells if frame]
            names = list(dict.fromkeys(self.options.colour or ["H", "K"]))
            moves = any(frame.u_n is not None for frame in shown)
            check_quantities(self.results, attrgetter("frames"), [name for name in self.options.colour if moves or name != "u_n"])
            if all(frame.is_graph for frame in shown) and names != ["u_n"]:
                yield TubePanel(self.results, self.labels, columns, names)
            else:
                yield CurvePanel(self.results, self.labels, columns, names, self.options.scale == "run")

    def surfaces(self):
        shown = self._of(attrgetter("surfaces"))
        if not shown:
            return
        results, labels = shown
        columns = choose_columns(results, self.times, attrgetter("surfaces"))
        self.marked = self.marked or [column.time for column in columns if column.time is not None]
        if self.wants("surface"):
            names = choose_colours(results, self.options.colour)
            yield SurfacePanel(results, labels, columns, names, self.options.camera, self.options.scale == "run")
        if "cuts" in self.options.kind or ("all" in self.options.kind and all(r.moves for r in results)):
            yield CutPanel(results, labels, columns, self.options.plane)

    def series(self):
        everything, scale = "all" in self.options.kind, self.results[0].scale("time")

        def has_energy(r):
            """A surface at rest and a single stationary shape have one row, which makes no curve."""
            return r.has_energy(2 if everything and (r.surfaces or r.is_equilibrium) else 1)

        if self.wants("energy"):
            if runs := self._of(lambda r: has_energy(r) and not r.is_equilibrium):
                low, high = (end and end * scale for end in (self.options.low, self.options.high))
                yield EnergyPanel(*runs, self.marked, (low, high, self.options.logx))
            if equilibria := self._of(lambda r: has_energy(r) and r.is_equilibrium):
                yield BranchPanel(*equilibria, self.marked)
        if self.wants("balance"):
            if shown := self._of(lambda r: has_balance(r) and (r.moves or not everything)):
                yield BalancePanel(*shown, self.marked)

    def _of(self, wanted):
        """The results for which this holds, and their labels; nothing if there are none."""
        return list(zip(*((r, label) for r, label in zip(self.results, self.labels) if wanted(r))))

    def panels(self):
        if self.options.series:
            return [SeriesPanel(self.results, self.labels, self.options)]
        return [*self.profiles(), *self.surfaces(), *self.series()]


def figure_of(results, options):
    """Decides what can be drawn of the results and lays the panels out from top to bottom."""
    if not results:
        raise BadInput("no result to draw")
    units.in_common(results)
    if not options.label:
        results = [results[i] for i in sorted_by_value([r.case for r in results])]
    names = [as_label(os.path.splitext(os.path.basename(result.path))[0]) for result in results]
    labels = row_labels([r.case for r in results], names if len(results) > 1 else [results[0].title])
    if options.label:
        if len(options.label) != len(results):
            raise BadInput(f"--label: {len(options.label)} labels, but {len(results)} results")
        labels = [[as_label(label)] for label in options.label]
    panels = Page(results, labels, options).panels()
    if not panels:
        raise BadInput(f"{', '.join(result.path for result in results)}: {NOTHING[options.kind[0]]}")

    heading = textwrap.wrap(", ".join(labels[0]), int(style.WIDTH / 0.072)) if len(results) == 1 else []
    title = 0.16 * len(heading) + 0.04 * bool(heading)
    figure = Figure(figsize=(style.WIDTH, title + sum(panel.height for panel in panels) + 0.1))
    top = figure.get_figheight() - 0.05
    if title:
        figure.text(0.5, top / figure.get_figheight(), "\n".join(heading), ha="center", va="top", fontsize=9)
        top -= title
    for letter, panel in zip("abcde", panels):
        if len(panels) > 1:
            figure.text(0.01, top / figure.get_figheight(), f"({letter})", va="top", fontsize=9)
        top -= panel.height
        panel.draw(figure, top)
    return figure


def draw_movie(options):
    from . import movie  # no picture needs it

    paths = options.results
    if len(paths) > 1 or scan.is_scan(paths[0]):
        raise BadInput(f"{paths[0]}: --movie shows one result, and no scan")
    if options.series or options.kind != ["all"] or options.output or len(options.colour) > 1 or options.dpi != style.DPI or options.width != style.WIDTH:
        raise BadInput("--movie goes with --times, --label, --fps, --camera, --units and one --colour only")
    result = units.read(paths[0], options.units)
    frames = result.shapes
    if options.times:
        columns = choose_columns([result], [time * result.scale("time") for time in options.times], attrgetter("shapes"))
        frames = [column.cells[0] for column in columns if column.cells[0]]
    title = as_label(options.label[0]) if options.label else result.title
    movie.draw(result, frames, options.movie, (options.colour or ["H"])[0], title, options.fps, options.camera)


def draw_any(options, outputs):
    """A scan, or runs."""
    if not any(scan.is_scan(path) for path in options.results):
        for option in ("confirmed", "quantity", "slice"):
            if getattr(options, option):
                raise BadInput(f"{options.results[0]}: is no scan, to which --{option} belongs")
        style.save(figure_of([units.read(path, options.units) for path in options.results], options), outputs)
        return
    if len(options.results) > 1 or options.times or options.colour or options.kind != ["all"] or options.series:
        raise BadInput(f"{options.results[0]}: a scan is drawn alone, without --times, --colour, --kind and --series")
    found = scan.read(options.results[0], options.units)
    style.save(scan.figure_of(found, options.quantity, options.slice, options.confirmed), outputs)


def main(options):
    if options.movie:
        draw_movie(options)
        command_line.say(options.movie, sys.stdout)
        return 0
    base = os.path.splitext(options.results[0])[0]

    def draw(pictures):
        with style.page(options.dpi, options.width):
            draw_any(options, pictures)

    return command_line.run(draw, options.output or [base + ".png", base + ".svg"], str)
