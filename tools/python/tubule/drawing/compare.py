"""Draws the output of `tubule compare --json` (standard input): energies over time, and differences of energy, rate, area,
volume and shapes. See `tubule compare --help`."""

import json
import sys

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from . import command_line, style, units
from .labels import in_unit, pretty_unit

HEIGHT = 2.3  # inches of the axes
SERIES = {"energy": "energy E", "rate": "rate dE/dt", "area": "area", "volume": "volume"}
SHAPES = {"hausdorff": ("shape", "shape, Hausdorff"), "l2": ("shape_l2", "shape, L2")}
DEPTH = 1e-7  # of the largest difference: smaller ones are on the lower edge
EARLIEST = 1e-4  # of the end time: start of a logarithmic time axis


class Page:
    """`known`: units of the results by their dimensions."""

    def __init__(self, comparison, known):
        self.comparison, self.frames = comparison, comparison["frames"]
        self.series = {series["name"]: series for series in comparison["series"]}
        self.tolerances = {check["quantity"]: check["tolerance"] for check in comparison["checks"]}
        (self.time, self.time_unit), (self.one, self.energy_unit) = (
            (known[of]["scale"], pretty_unit(known[of]["unit"])) if of in known else (1.0, "") for of in ("time", "energy")
        )
        times = self.time * np.array(self.series["energy"]["times"] if "energy" in self.series else [])
        self.times = times if len(times) > 1 else []
        # Whether most rows are at the very beginning
        self.logarithmic = len(times) > 4 and times[len(times) // 2] < 0.1 * times[-1]

    def draw(self, outputs):
        figure = Figure(figsize=(style.WIDTH, HEIGHT + 0.5))
        if len(self.times):
            self._energies(style.axes_at(figure, 0.525, 0.4, 2.52, HEIGHT))
        left, width = (3.64, 1.89) if len(self.times) else (0.7, 3.15)
        self._differences(style.axes_at(figure, left, 0.4, width, HEIGHT))
        style.save(figure, outputs)

    def _time_axis(self, axes):
        if self.logarithmic:
            axes.set_xscale("log")
            axes.set_xlim(EARLIEST * self.times[-1], 1.3 * self.times[-1])
        axes.set_xlabel(in_unit("time t", self.time_unit), labelpad=2)

    def _energies(self, axes):
        for side, colour, dashes in zip("ab", style.line_colours(2), ("-", "--")):
            name = f"{side.upper()}: {self.comparison[side]['file'].rsplit('/', 1)[-1]}"
            axes.plot(self.times, self.one * np.array(self.series["energy"][side]), dashes, color=colour, label=name)
        self._time_axis(axes)
        axes.set_ylabel(in_unit("bending energy E", self.energy_unit), labelpad=3)
        axes.legend(loc="best")

    def _lines(self):
        """Name, label, times and differences of each quantity, and at which times it is known without interpolation."""
        for name, label in SERIES.items():
            if name in self.series:
                series = self.series[name]
                times, a, b, unsure = (np.array(series[key], float) for key in ("times", "a", "b", "unsure"))
                yield name, label, times, np.abs(a - b) / series["scale"], unsure == 0
        for key, (name, label) in SHAPES.items() if self.frames else ():
            times, values = np.transpose([(frame["time"], frame[key] / frame["size"]) for frame in self.frames])
            yield name, label, times, values, None

    def _differences(self, axes):
        lines = list(self._lines())
        for (name, label, times, values, known), colour, marker in zip(lines, style.line_colours(len(lines)), style.MARKERS):
            if known is None:
                axes.plot(self.time * times, values, marker, color=colour, label=label)
            else:
                axes.plot(self.time * times, values, color=colour, linewidth=0.8)
                axes.plot(self.time * times[known], values[known], marker, color=colour, label=label)
            if self.tolerances.get(name, 0) > 0:
                axes.axhline(self.tolerances[name], color=colour, linestyle="-.", linewidth=0.8)
        drawn = np.concatenate([list(self.tolerances.values()), *(line[3] for line in lines)])
        axes.set_yscale("log", nonpositive="clip")
        if (top := drawn.max(initial=0)) > 0:
            axes.set_ylim(max(DEPTH * top, drawn[drawn > 0].min() / 3), 3 * top)
        self._time_axis(axes)
        axes.set_ylabel("relative difference of A and B", labelpad=3)
        handles, labels = axes.get_legend_handles_labels()
        if self.tolerances:
            handles.append(Line2D([], [], color="0.4", linestyle="-.", linewidth=0.8))
            labels.append("tolerance")
        axes.legend(handles=handles, labels=labels, loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0)


def main():
    comparison = json.load(sys.stdin)
    known = units.of_files([comparison[side]["file"] for side in "ab"])
    return command_line.run(Page(comparison, known).draw, sys.argv[1:], str)
