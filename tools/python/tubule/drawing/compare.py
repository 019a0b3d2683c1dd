"""Draws the output of `tubule compare --json` (standard input): energies over time, and differences of energy, rate, area,
volume and shapes. See `tubule compare --help`."""

import json
import sys

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from . import command_line, style

HEIGHT = 2.3  # inches of the axes
SERIES = {"energy": "energy E", "rate": "rate dE/dt", "area": "area", "volume": "volume"}
SHAPES = {"hausdorff": ("shape", "shape, Hausdorff"), "l2": ("shape_l2", "shape, L2")}
DEPTH = 1e-7  # of the largest difference: smaller ones are on the lower edge
EARLIEST = 1e-4  # of the end time: start of a logarithmic time axis


def time_is_logarithmic(times):
    """Whether most rows are at the very beginning."""
    return len(times) > 4 and times[len(times) // 2] < 0.1 * times[-1]


def relative(series):
    """Times, relative differences, and the indices of those without interpolation."""
    pairs = zip(series["a"], series["b"])
    values = [abs(a - b) / series["scale"] for a, b in pairs]
    return series["times"], values, [unsure == 0 for unsure in series["unsure"]]


class Page:
    def __init__(self, comparison):
        self.comparison = comparison
        self.series = {series["name"]: series for series in comparison["series"]}
        self.tolerances = {check["quantity"]: check["tolerance"] for check in comparison["checks"]}
        self.frames = comparison["frames"]
        energy = self.series.get("energy")
        self.energy = energy if energy and len(energy["times"]) > 1 else None
        self.logarithmic = bool(self.energy) and time_is_logarithmic(energy["times"])

    def draw(self, outputs):
        height = HEIGHT + 0.5
        figure = Figure(figsize=(style.WIDTH, height))
        width = (0.36 if self.energy else 0.6, 0.36)
        if self.energy:
            self._energies(figure.add_axes([0.075, 0.4 / height, width[1], HEIGHT / height]))
        left = 0.52 if self.energy else 0.1
        self._differences(figure.add_axes([left, 0.4 / height, width[0] * 0.75, HEIGHT / height]))
        style.save(figure, outputs)

    def _time_axis(self, axes):
        if self.logarithmic:
            end = self.energy["times"][-1]
            axes.set_xscale("log")
            axes.set_xlim(EARLIEST * end, 1.3 * end)
        axes.set_xlabel("time t", labelpad=2)

    def _energies(self, axes):
        dark, light = style.line_colours(2)
        for side, colour, dashes in (("a", dark, "-"), ("b", light, "--")):
            name = f"{side.upper()}: {self.comparison[side]['file'].rsplit('/', 1)[-1]}"
            axes.plot(self.energy["times"], self.energy[side], dashes, color=colour, label=name)
        self._time_axis(axes)
        axes.set_ylabel("bending energy E", labelpad=3)
        axes.legend(loc="best")

    def _differences(self, axes):
        lines = [(name, label) for name, label in SERIES.items() if name in self.series]
        count = len(lines) + (len(SHAPES) if self.frames else 0)
        colours = iter(style.line_colours(count))
        markers = iter(style.MARKERS)
        for name, label in lines:
            times, values, sure = relative(self.series[name])
            colour = next(colours)
            axes.plot(times, values, color=colour, linewidth=0.8)
            at_rows = [i for i, known in enumerate(sure) if known]
            axes.plot([times[i] for i in at_rows], [values[i] for i in at_rows], next(markers), color=colour, label=label)
            self._tolerance(axes, name, colour)
        for key, (name, label) in SHAPES.items() if self.frames else ():
            colour = next(colours)
            values = [frame[key] / frame["size"] for frame in self.frames]
            axes.plot([frame["time"] for frame in self.frames], values, next(markers), color=colour, label=label)
            self._tolerance(axes, name, colour)
        top = max([*self.tolerances.values(), *(max(line.get_ydata(), default=0) for line in axes.get_lines())], default=0)
        axes.set_yscale("log", nonpositive="clip")
        if top > 0:
            lowest = min((y for line in axes.get_lines() for y in line.get_ydata() if y > 0))
            axes.set_ylim(max(DEPTH * top, lowest / 3), 3 * top)
        self._time_axis(axes)
        axes.set_ylabel("relative difference of A and B", labelpad=3)
        handles, labels = axes.get_legend_handles_labels()
        if self.tolerances:
            handles.append(Line2D([], [], color="0.4", linestyle="-.", linewidth=0.8))
            labels.append("tolerance")
        axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0)

    def _tolerance(self, axes, name, colour):
        if self.tolerances.get(name, 0) > 0:
            axes.axhline(self.tolerances[name], color=colour, linestyle="-.", linewidth=0.8)


def main():
    return command_line.run(Page(json.load(sys.stdin)).draw, sys.argv[1:], str)
