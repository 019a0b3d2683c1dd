"""Panel of any series of results against time, or against another series: `tubule plot --series`."""

import difflib
from dataclasses import dataclass

import numpy as np
from matplotlib.lines import Line2D

from .labels import number
from .results import BadInput
from .style import DASHES, line_colours

HEIGHT = 2.6  # inches of the axes


@dataclass
class Choice:
    """What is drawn: the series `names` against the series `x`, where x is between `low` and `high` (None: no limit)."""

    names: list
    x: str = "time"
    low: float | None = None
    high: float | None = None
    logarithmic: bool = False

    def of(self, result, name):
        """x and values of a result in the range; BadInput if there is nothing to draw."""
        for wanted in (self.x, name):
            if wanted not in result.series:
                near = difflib.get_close_matches(wanted, result.series, 3, 0.5)
                hint = f"; did you mean {' or '.join(near)}?" if near else ""
                raise BadInput(f"{result.path}: has no series {wanted}; it has {', '.join(sorted(result.series)) or 'none'}{hint}")
        x, y = result.series[self.x], result.series[name]
        inside = (x >= (-np.inf if self.low is None else self.low)) & (x <= (np.inf if self.high is None else self.high))
        if not inside.any():
            raise BadInput(f"{result.path}: no row has a {self.x} in the range; it goes from {number(x.min())} to {number(x.max())}")
        if self.logarithmic:
            y = np.where(y > 0, y, np.nan)  # a gap
            if not np.isfinite(y[inside]).any():
                raise BadInput(f"{result.path}: {name} is nowhere positive in the range, as --logy needs it")
        return x[inside], y[inside]


class SeriesPanel:
    """A line for each result and series; results differ by colour, series by dashes."""

    def __init__(self, results, labels, choice):
        self.results, self.labels, self.choice = results, labels, choice
        self.lines = [[choice.of(result, name) for name in choice.names] for result in results]
        self.meanings = {name: text for result in results for name, text in result.meanings.items()}
        self.height = HEIGHT + 0.62

    def _name(self, name):
        return "time t" if name == "time" else self.meanings.get(name, name)

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        width, height = figure.get_size_inches()
        handles = self._legend_entries()
        beside = 0.5 + 0.06 * max((len(handle.get_label()) for handle in handles), default=-8)
        axes = figure.add_axes([0.75 / width, (bottom + 0.4) / height, (width - 0.9 - beside) / width, HEIGHT / height])
        dashes = ("-", *DASHES * len(self.choice.names))
        for lines, colour in zip(self.lines, line_colours(len(self.results))):
            for (x, y), style in zip(lines, dashes):
                axes.plot(x, y, color=colour, linestyle=style, marker="o" if x.size == 1 else "")
        if self.choice.logarithmic:
            axes.set_yscale("log")
        axes.margins(x=0)
        axes.set_xlabel(self._name(self.choice.x))
        axes.set_ylabel(self._name(self.choice.names[0]) if len(self.choice.names) == 1 else "")
        if handles:
            axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0)

    def _legend_entries(self):
        """Of the results if there are several, and of the series likewise."""
        handles = []
        if len(self.results) > 1:
            colours = line_colours(len(self.results))
            handles += [Line2D([], [], color=c, label=", ".join(label)) for c, label in zip(colours, self.labels)]
        if len(self.choice.names) > 1:
            dashes = ("-", *DASHES * len(self.choice.names))
            handles += [Line2D([], [], color="0.3", linestyle=d, label=self._name(n)) for n, d in zip(self.choice.names, dashes)]
        return handles
