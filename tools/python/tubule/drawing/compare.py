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
        figure = Figure(figsize=(style.WIDTH, HEIGHT + 0.5))
        if self.energy:
            self._energies(style.axes_at(figure, 0.525, 0.4, 2.52, HEIGHT))
        left, width = (3.64, 1.89) if self.energy else (0.7, 3.15)
        self._differences(style.axes_at(figure, left, 0.4, width, HEIGHT))
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
            series, colour = self.series[name], next(colours)
            points = [(t, abs(a - b) / series["scale"]) for t, a, b in zip(series["times"], series["a"], series["b"])]
            axes.plot([t for t, _ in points], [value for _, value in points], color=colour, linewidth=0.8)
            at_rows = [point for point, unsure in zip(points, series["unsure"]) if unsure == 0]  # without interpolation
            axes.plot([t for t, _ in at_rows], [value for _, value in at_rows], next(markers), color=colour, label=label)
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
        axes.legend(handles=handles, labels=labels, loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0)

    def _tolerance(self, axes, name, colour):
        if self.tolerances.get(name, 0) > 0:
            axes.axhline(self.tolerances[name], color=colour, linestyle="-.", linewidth=0.8)


def main():
    return command_line.run(Page(json.load(sys.stdin)).draw, sys.argv[1:], str)
