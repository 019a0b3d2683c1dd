"""Panel (b): bending energy over time, in total and by term, with the times of the profiles marked. Where the membrane
has inertia, each result has axes of its own, with its kinetic energy as a band on top and the first moments as an inset.
Equilibria are over the parameter of their branch."""

import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter

from . import style
from .labels import formula, in_unit, number
from .style import DASHES, MARKERS, Legend, axes_at, few_ticks, line_colours, time_name, time_text

STOP_MARK = {"color": "crimson", "marker": "x", "linestyle": "", "markersize": 6, "markeredgewidth": 1.6}
HEIGHT = 2.15  # inches of the axes
KINETIC, BAND_ALPHA = "kinetic E\u2096, up to E + E\u2096", 0.25
VISIBLE = 2e-3  # part of the total below which a term would coincide with the zero line
LEAST_CHANGE = 0.25  # of the height of the panel: terms are left out rather than that the total shows less of it
INSET = 0.45, 0.42, 0.53, 0.55  # of the first moments: left, bottom, width, height as parts of the axes
ROOM = 0.62  # inches for labels below and above the axes
MOST_AXES = 4  # beside each other
SETTLED = 0.3  # the initial phase ends when this part of the change is left


def monotone_cubic(x, y, points):
    """Fritsch-Carlson interpolation: smooth between large steps, without overshoot. x strictly increasing."""
    if x.size < 2:
        return np.full(points.shape, y[0])
    step, rise = np.diff(x), np.diff(y)
    secant = rise / step
    slope = np.empty_like(y)
    slope[0] = _end_slope(step, secant)
    slope[-1] = _end_slope(step[::-1], secant[::-1])
    w1, w2 = 2 * step[1:] + step[:-1], step[1:] + 2 * step[:-1]
    same_sign = secant[1:] * secant[:-1] > 0
    safe = np.where(same_sign, secant[1:], 1), np.where(same_sign, secant[:-1], 1)
    slope[1:-1] = np.where(same_sign, (w1 + w2) / (w1 / safe[1] + w2 / safe[0]), 0)
    i = np.clip(np.searchsorted(x, points, side="right") - 1, 0, x.size - 2)
    t = (points - x[i]) / step[i]
    return y[i] + rise[i] * t * t * (3 - 2 * t) + step[i] * t * (1 - t) * (slope[i] * (1 - t) - slope[i + 1] * t)


def _end_slope(step, secant):
    """Slope of the parabola through the first three points, limited to prevent overshoot."""
    if step.size < 2:
        return secant[0]
    slope = ((2 * step[0] + step[1]) * secant[0] - step[0] * secant[1]) / (step[0] + step[1])
    return np.clip(slope, *sorted((0.0, 3 * secant[0])))


def settling_time(result):
    """Time after which at most SETTLED of the energy's change is left; infinite if it is constant."""
    time, energy = result.series["time"], result.series["energy"]
    if result.has_inertia:
        energy = energy + result.series["kinetic_energy"]  # bending energy oscillates
    left = np.abs(energy - energy[-1])
    if left.max() <= 1e-9 * np.abs(energy).max():
        return np.inf
    late = np.flatnonzero(left > SETTLED * left.max())
    return time[min(late[-1] + 1, time.size - 1)] if late.size else time[0]


def _matters(result, name):
    """Whether a term is above VISIBLE of the total."""
    values = result.series.get(f"energy_{name}", np.zeros(1))
    return np.abs(values).max() > VISIBLE * np.abs(result.series["energy"]).max()


def visible_terms(results):
    """Terms to draw: those that matter in some result."""
    names = list(dict.fromkeys(name for result in results for name in result.terms))
    return [name for name in names if any(_matters(result, name) for result in results)]


def _lines_of(words):
    """The text in one line if it is short."""
    line = ", ".join(words)
    return line if len(line) <= 32 else ",\n".join(words)


def relative_ticks(axis, name):
    """On an axis with small changes of a large number, ticks are relative to that number; returns the label of the axis,
    which says so. (Matplotlib would write the number above the axis, where the times are.)"""
    low, high = sorted(axis.get_view_interval())
    if high - low > 1e-3 * max(abs(low), abs(high)):
        return name
    exponent = int(np.floor(np.log10(high - low)))
    base = np.floor(low / 10 ** (exponent + 1)) * 10 ** (exponent + 1)
    axis.set_major_formatter(FuncFormatter(lambda value, _: number((value - base) / 10**exponent)))
    return f"({name} \u2212 {base:.{max(0, -exponent - 1)}f}) / " + formula(f"10^{{{exponent}}}")


class EnergyPanel:
    """Lines of `results` (all with an energy series); one label per result; `times` marked on them. `window`: first and last
    time or None, and whether the axis is logarithmic."""

    def __init__(self, results, labels, times, window=(None, None, False)):
        self.results, self.times = results, times
        self.low, self.high, self.logx = window
        self.term_labels = {name: label for result in results for name, label in result.term_labels.items()}
        self.lone = len(results) == 1
        self.kinetic = any(result.has_inertia for result in results)
        self.total = "bending E" if self.kinetic else "total"
        self.labels = [self.total] if self.lone else [_lines_of(label) for label in labels]
        self.end = max(result.series["time"][-1] for result in results) or 1.0  # a run with only its start
        if self.high is not None:
            self.end = min(self.end, self.high)
        self.settled = max(map(settling_time, results))
        self.time_unit = results[0].unit("time")
        self.colours = line_colours(len(results))
        self.terms = [] if self._terms_hide_change() else visible_terms(results)
        self.apart = self.kinetic and 1 < len(results) <= MOST_AXES
        self.rows = len(results) if self.apart and style.is_narrow() else 1
        self.legend = Legend(self._legend_entries())
        self.height = self.rows * (HEIGHT + ROOM) + self.legend.below

    def _terms_hide_change(self):
        """Whether an axis with all terms would show the total as a straight line."""
        rows = [result.series for result in self.results]
        every = [values for row in rows for name, values in row.items() if name.startswith("energy_") and name != "energy_error"]
        if not every:
            return False
        change = max(float(np.ptp(row["energy"])) for row in rows)
        span = max(row["energy"].max() for row in rows) - min(float(values.min()) for values in every)
        return change < LEAST_CHANGE * span

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        every = list(zip(self.results, self.colours, MARKERS * len(self.results)))
        decades = self.logx or (self.low is None and self.settled < 0.01 * self.end)
        start = self.low if self.low is not None else self._first_time() if decades else 0.0
        settled = min(map(settling_time, self.results)) if self.apart else self.settled
        initial = settled if self.apart else min((t for t in self.times if t >= settled), default=settled) * 1.03
        enlarged = not decades and self.low is None and initial < 0.3 * self.end  # the initial phase
        beside = enlarged and not self.kinetic and not style.is_narrow()  # not as an inset
        # What is drawn in which axes: lines, end of time, words of that, title
        parts = [(every, self.end, "", "")]
        if beside:
            parts = [(every, initial, " (initial phase)", ""), (every, self.end, " (whole run)", "")]
        elif self.apart:
            parts = [([one], self.end, "", label) for one, label in zip(every, self.labels)]
        drawn = []
        for place, (some, end, words, title) in zip(self._places(figure, bottom, len(parts), 0.3 if beside else 0.12), parts):
            axes = axes_at(figure, *place, sharey=drawn[0] if drawn else None)
            axes.tick_params(labelleft=self.rows > 1 or not drawn)
            self._lines(axes, start, end, decades, some)
            axes.set_xlabel(in_unit(f"time t{words}", self.time_unit), labelpad=2)
            axes.set_title(title, pad=11)
            drawn.append(axes)
        for axes, (some, *_) in zip(drawn, parts) if enlarged and not beside else ():  # with the range of all energies known
            self._draw_inset(axes, some, initial)
        name = in_unit("energy" if self.kinetic else "bending energy E", self.results[0].unit("energy"))
        name = relative_ticks(drawn[0].yaxis, name)
        for axes in drawn if self.rows > 1 else drawn[:1]:
            axes.set_ylabel(name, labelpad=3)
        self.legend.draw(drawn[-1], bottom)

    def _places(self, figure, bottom, count, gap):
        """Places of so many axes, in inches: the first at the top or on the left."""
        left, low, wide = 0.6, bottom + self.legend.below + 0.38, figure.get_figwidth() - 0.7 - (self.legend.right or 0.1)
        if self.rows > 1:
            return [(left, low + (count - 1 - k) * (HEIGHT + ROOM), wide, HEIGHT) for k in range(count)]
        size = (wide - gap * (count - 1)) / count
        return [(left + k * (size + gap), low, size, HEIGHT) for k in range(count)]

    def _draw_inset(self, axes, some, end):
        inset = axes.inset_axes(INSET)
        inset.tick_params(labelsize=6, length=2, pad=1.5)
        self._lines(inset, 0.0, end, False, some, named=False)
        few_ticks(inset.xaxis, 1.0, 0.4)
        few_ticks(inset.yaxis, 1.0, 0.4)
        for line in inset.lines:
            line.set_markersize(2.5)

    def _first_time(self):
        steps = [result.series["time"][1] for result in self.results if result.series["time"].size > 1]
        positive = [time for time in self.times if time > 0] + steps
        return max(min(positive) / 3, 1e-6 * self.end)

    def _lines(self, axes, start, end, log, some, named=True):
        if log:
            axes.set_xscale("log")
        axes.set_xlim(start, end if log else end + 0.02 * (end - start))
        if not log:
            few_ticks(axes.xaxis, axes.get_position().width * style.WIDTH, 0.4)
        grid = (np.geomspace if log else np.linspace)(start, end, 500)
        for one in some:
            self._lines_of_result(axes, grid, *one)
        self._mark_times(axes, start, end, named)

    def _lines_of_result(self, axes, grid, result, colour, marker):
        time, start, end = result.series["time"], grid[0], grid[-1]
        grid = np.union1d(grid[(grid >= time[0]) & (grid <= time[-1])], time[(time >= start) & (time <= end)])

        def between(name, points=grid):
            return monotone_cubic(time, result.series[name], points)

        several = sum(_matters(result, name) for name in self.terms) > 1
        for name, dashes in zip(self.terms, DASHES * len(self.terms)):
            if several and _matters(result, name):
                axes.plot(grid, between(f"energy_{name}"), color=colour, linestyle=dashes, linewidth=0.8)
        bending = between("energy")
        axes.plot(grid, bending, color=colour, zorder=3)
        if result.has_inertia:
            total = bending + np.maximum(between("kinetic_energy"), 0)
            axes.fill_between(grid, bending, total, color=colour, linewidth=0, alpha=BAND_ALPHA, zorder=1)
            axes.plot(grid, total, color=colour, linewidth=0.6, zorder=2)
        marks = np.array([t for t in self.times if time[0] <= t <= time[-1] * (1 + 1e-9) and start <= t <= end])
        values = between("energy", np.minimum(marks, time[-1]))
        axes.plot(marks, values, marker, color=colour, mec="white", mew=0.4, clip_on=False, zorder=4)
        if result.stopped_early and start <= time[-1] <= end:
            axes.plot(time[-1], result.series["energy"][-1], clip_on=False, zorder=5, **STOP_MARK)

    def _mark_times(self, axes, start, end, named):
        """t0, t1, ... above the axes; of overlapping labels only the first is kept."""
        inches = axes.get_position().width * style.WIDTH
        before = -1.0
        for index, time in enumerate(self.times):
            if not start <= time <= end:
                continue
            axes.axvline(time, color="0.75", linewidth=0.5, zorder=0)
            place = axes.transLimits.transform(axes.transScale.transform((time, 1)))[0] * inches
            if named and place - before > 0.095:
                axes.annotate(time_name(index), (time, 1), (0, 2), xycoords=("data", "axes fraction"),
                              textcoords="offset points", ha="center", va="bottom", fontsize=7)  # fmt: skip
                before = place

    def _legend_entries(self):
        handles = []
        for result, label, colour, marker in zip(self.results, self.labels, self.colours, MARKERS * len(self.results)):
            if not self.apart:  # else its axes have its name
                handles.append(Line2D([], [], color=colour, marker=marker, mec="white", mew=0.4, label=label))
            if result.stopped_early:
                time = time_text(result.about.get("stop_time", result.end_time), self.time_unit)
                text = f"{result.stopped_early} at t = {time}"
                handles.append(Line2D([], [], label=text, **STOP_MARK))
        shade = self.colours[0] if self.lone else "0.3"
        if self.kinetic:
            handles.append(Patch(facecolor=to_rgba(shade, BAND_ALPHA), edgecolor=shade, linewidth=0.6, label=KINETIC))
        if len(self.terms) > 1:
            if not self.lone:
                handles.append(Line2D([], [], color=shade, label=self.total))
            for dashes, name in zip(DASHES * len(self.terms), self.terms):
                text = formula(self.term_labels.get(name, f"E_{{{name}}}"))
                handles.append(Line2D([], [], color=shade, linewidth=0.9, linestyle=dashes, label=text))
        return handles


class BranchPanel:
    """Energies of equilibria over the parameter of their branch; the shapes that are drawn are marked by their numbers."""

    def __init__(self, results, labels, numbers):
        self.results, self.numbers = results, numbers
        self.colours = line_colours(len(results))
        labels = [_lines_of(label) for label in labels] if len(results) > 1 else []
        self.legend = Legend([Line2D([], [], color=colour, label=label) for colour, label in zip(self.colours, labels)])
        self.height = HEIGHT + ROOM + self.legend.below

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        axes = axes_at(figure, 0.6, bottom + self.legend.below + 0.38, figure.get_figwidth() - 0.7 - (self.legend.right or 0.1), HEIGHT)
        for result, colour in zip(self.results, self.colours):
            rows = result.series
            x, y = (rows["parameter"], rows["energy"]) if "parameter" in rows else (rows["time"], rows["energy"])
            ends = np.flatnonzero(np.diff(rows["branch"])) + 1 if "branch" in rows else []
            for part in np.split(np.arange(x.size), ends):
                if part.size:
                    fine = np.linspace(part[0], part[-1], 20 * part.size)
                    axes.plot(*(monotone_cubic(part.astype(float), values[part], fine) for values in (x, y)), color=colour)
            for shape in self.numbers:
                if shape in rows["time"]:
                    at = np.searchsorted(rows["time"], shape)
                    axes.plot(x[at], y[at], "o", color=colour, mec="white", mew=0.4, clip_on=False)
                    axes.annotate(number(shape), (x[at], y[at]), (3, 3), textcoords="offset points", fontsize=6)
            if result.stopped_early:
                axes.plot(x[-1], y[-1], clip_on=False, zorder=5, **STOP_MARK)
        few_ticks(axes.xaxis, axes.get_position().width * style.WIDTH)
        keys = {result.vary for result in self.results}
        name = self.results[0].parameter_name if len(keys) == 1 and "" not in keys else "parameter of the branch"
        along = all("parameter" in result.series for result in self.results)
        unit = self.results[0].parameter_unit if len({result.parameter_unit for result in self.results}) == 1 else ""
        axes.set_xlabel(in_unit(name, unit) if along else "number of the shape", labelpad=2)
        axes.set_ylabel(relative_ticks(axes.yaxis, in_unit("bending energy E", self.results[0].unit("energy"))), labelpad=3)
        self.legend.draw(axes, bottom)
