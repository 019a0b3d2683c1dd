"""Panels of series: any against time or another series (`tubule plot --series`), and dissipation, kinetic energy, the
energy-balance residual and the estimated error against the logarithm of time."""

import difflib

import numpy as np
from matplotlib.lines import Line2D

from .labels import in_unit, number
from .results import BadInput
from .style import DASHES, Legend, axes_at, line_colours, result_handles

HEIGHT, BALANCE_HEIGHT = 2.6, 1.7  # inches of the axes
DECADES = 9  # the most of a balance that are shown below the largest value
BALANCE = ("dissipation", "kinetic_energy", "identity_defect", "energy_error")
LONGEST_WORDS = 36  # of a label: longer ones leave the axis, and the name stands there instead


def meanings(results):
    return {name: text for result in results for name, text in result.meanings.items()}


def units_of_series(results):
    return {name: result.unit(of) for result in results for name, of in result.dimensions.items()}


class SeriesPanel:
    """A line for each result and each of `options.series`, against `options.x` where it is between `low` and `high`,
    numbers of the file. Results differ by colour, series by dashes."""

    def __init__(self, results, labels, options):
        self.options, self.meanings, self.units = options, meanings(results), units_of_series(results)
        self.dashes = dict(zip(options.series, ("-", *DASHES * len(options.series))))
        self.lines = [[self._line(result, name) for name in options.series] for result in results]
        handles = result_handles(labels)
        if len(options.series) > 1:
            handles += [Line2D([], [], color="0.3", linestyle=d, label=self._name(n)) for n, d in self.dashes.items()]
        self.legend = Legend(handles)
        self.height = HEIGHT + 0.62 + self.legend.below

    def _line(self, result, name):
        """x and values of a result in the range; BadInput if there is nothing to draw."""
        o = self.options
        for wanted in (o.x, name):
            if wanted not in result.series:
                near = difflib.get_close_matches(wanted, result.series, 3, 0.5)
                hint = f"; did you mean {' or '.join(near)}?" if near else ""
                raise BadInput(f"{result.path}: has no series {wanted}; it has {', '.join(sorted(result.series)) or 'none'}{hint}")
        x, y = result.series[o.x], result.series[name]
        one = result.scale(result.dimensions.get(o.x, ""))
        inside = (x >= (-np.inf if o.low is None else o.low * one)) & (x <= (np.inf if o.high is None else o.high * one))
        if not inside.any():
            raise BadInput(f"{result.path}: no row has a {o.x} in the range; it goes from {number(x.min() / one)} to {number(x.max() / one)}")
        if o.logx:
            inside &= x > 0
            if not inside.any():
                raise BadInput(f"{result.path}: {o.x} is nowhere positive in the range, as --logx needs it")
        if o.logy:
            y = np.where(y > 0, y, np.nan)  # a gap
            if not np.isfinite(y[inside]).any():
                raise BadInput(f"{result.path}: {name} is nowhere positive in the range, as --logy needs it")
        return x[inside], y[inside]

    def _name(self, name):
        words = self.meanings.get(name, name)
        return in_unit("time t" if name == "time" else words if len(words) <= LONGEST_WORDS else name.replace("_", " "), self.units.get(name, ""))

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        axes = axes_at(figure, 0.75, bottom + self.legend.below + 0.4, figure.get_figwidth() - 0.9 - self.legend.right, HEIGHT)
        for lines, colour in zip(self.lines, line_colours(len(self.lines))):
            for (x, y), dashes in zip(lines, self.dashes.values()):
                axes.plot(x, y, color=colour, linestyle=dashes, marker="o" if x.size == 1 else "")
        if self.options.logx:
            axes.set_xscale("log")
        if self.options.logy:
            axes.set_yscale("log")
        axes.margins(x=0)
        names = self.options.series
        axes.set(xlabel=self._name(self.options.x), ylabel=self._name(names[0]) if len(names) == 1 else "")
        self.legend.draw(axes, bottom)


def has_balance(result):
    """Whether there is anything to draw: two times after the initial one, and dissipation."""
    return "dissipation" in result.series and (result.series["time"] > 0).sum() > 1


def magnitude(result, name):
    """Positive times and the magnitude of the series there; NaN, a gap, where it is zero, or an error that is not known (E_ref
    in the rows). None where nothing is left."""
    if name not in result.series:
        return None
    time, values = result.series["time"], np.abs(result.series[name])
    values = np.where(values > 0, values, np.nan)
    if name == "energy_error" and "E_ref" in result.about:
        values = np.where(values < result.about["E_ref"], values, np.nan)
    later = time > 0
    return (time[later], values[later]) if np.isfinite(values[later]).any() else None


class BalancePanel:
    """Lines of `results` (all have a balance); one label per result; `times` marked."""

    def __init__(self, results, labels, times):
        self.results, self.labels, self.times = results, labels, times
        present = [name for name in BALANCE if any(magnitude(result, name) for result in results)]
        self.styles = dict(zip(present, ("-", *DASHES)))
        shade, names, units = line_colours(1)[0] if len(results) == 1 else "0.3", meanings(results), units_of_series(results)
        words = {name: in_unit(names[name].split(", ")[0], units.get(name, "")) for name in present}
        lines = [Line2D([], [], color=shade, linestyle=dashes, label=words[name]) for name, dashes in self.styles.items()]
        self.legend = Legend(result_handles(labels) + lines)
        self.height = BALANCE_HEIGHT + 0.55 + self.legend.below

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        axes = axes_at(figure, 0.5, bottom + self.legend.below + 0.38, figure.get_figwidth() - 0.6 - (self.legend.right or 0.1), BALANCE_HEIGHT)
        axes.set(xscale="log", yscale="log", xlabel=in_unit("time t", self.results[0].unit("time")))
        largest = 0.0
        for result, colour in zip(self.results, line_colours(len(self.results))):
            for name, dashes in self.styles.items():
                if line := magnitude(result, name):
                    axes.plot(*line, color=colour, linestyle=dashes, linewidth=1)
                    largest = max(largest, np.nanmax(line[1]))
        for time in (time for time in self.times if time > 0):
            axes.axvline(time, color="0.75", linewidth=0.5, zorder=0)
        times = [result.series["time"] for result in self.results]
        axes.set_xlim(min(time[time > 0][0] for time in times), max(time[-1] for time in times))
        if largest:
            low, high = axes.get_ylim()
            axes.set_ylim(max(low, largest * 10.0**-DECADES), high)
        self.legend.draw(axes, bottom)
