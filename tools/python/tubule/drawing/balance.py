"""Panel of dissipation, kinetic energy, the defect of the energy identity and the estimated error, against the logarithm
of time."""

import numpy as np
from matplotlib.lines import Line2D

from .style import DASHES, line_colours

HEIGHT = 1.7  # inches of the axes
DECADES = 9  # the most that are shown below the largest value
LINES = ("dissipation", "kinetic_energy", "identity_defect", "energy_error")  # series


def has_balance(result):
    """Whether there is anything to draw: two times after the start, and dissipation."""
    return "dissipation" in result.series and (result.series["time"] > 0).sum() > 1


def line(series, name):
    """Positive times and the magnitude of the series there; NaN, a gap, where it is zero."""
    later = series["time"] > 0
    values = np.abs(series[name][later])
    return series["time"][later], np.where(values > 0, values, np.nan)


def line_of(result, name):
    """The same of a result; an error that is not known, E_ref in the rows, is a gap."""
    time, values = line(result.series, name)
    if name == "energy_error" and "E_ref" in result.about:
        values = np.where(values < result.about["E_ref"], values, np.nan)
    return time, values


class BalancePanel:
    """Lines of `results` (all have a balance); one label per result; `times` marked."""

    def __init__(self, results, labels, times):
        self.results, self.labels, self.times = results, labels, times
        present = [name for name in LINES if any(self._has(result, name) for result in results)]
        self.styles = dict(zip(present, ("-", *DASHES)))
        self.height = HEIGHT + 0.55

    @staticmethod
    def _has(result, name):
        return name in result.series and bool(np.isfinite(line_of(result, name)[1]).any())

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        width, height = figure.get_size_inches()
        axes = figure.add_axes([0.5 / width, (bottom + 0.38) / height, (width - 2.45) / width, HEIGHT / height])
        axes.set(xscale="log", yscale="log", xlabel="time t")
        largest = 0.0
        for result, colour in zip(self.results, line_colours(len(self.results))):
            for name, dashes in self.styles.items():
                if self._has(result, name):
                    time, values = line_of(result, name)
                    axes.plot(time, values, color=colour, linestyle=dashes, linewidth=1)
                    largest = max(largest, np.nanmax(values))
        for time in (time for time in self.times if time > 0):
            axes.axvline(time, color="0.75", linewidth=0.5, zorder=0)
        starts = [result.series["time"][result.series["time"] > 0][0] for result in self.results]
        axes.set_xlim(min(starts), max(result.series["time"][-1] for result in self.results))
        if largest:
            low, high = axes.get_ylim()
            axes.set_ylim(max(low, largest * 10.0**-DECADES), high)
        axes.legend(handles=self._legend_entries(), loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0,
                    labelspacing=0.45)  # fmt: skip

    def _legend_entries(self):
        lone = len(self.results) == 1
        shade = line_colours(1)[0] if lone else "0.3"
        names = {name: text for result in self.results for name, text in result.meanings.items()}
        handles = [Line2D([], [], color=shade, linestyle=dashes, label=names[name].split(", ")[0]) for name, dashes in self.styles.items()]
        if not lone:
            colours = line_colours(len(self.results))
            handles = [Line2D([], [], color=c, label=", ".join(l)) for c, l in zip(colours, self.labels)] + handles
        return handles
