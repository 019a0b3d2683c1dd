"""Draws branches of vesicles: energy against reduced volume, stability, and shapes along the branches."""

import os

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from . import command_line, style
from .results import read_result

LIMITS = (0.48, 0.97)  # of the reduced volume
HEIGHT = 5.2  # inches
STRIP = 0.34  # of the height, for shapes
SCALE = 0.0118  # reduced volume per unit of length
LINES = ("-", (0, (3, 1.5)), ":")  # stable, and what a shape is unstable against


def stability(series):
    """For each shape 0: stable, 1: a mode m > 0 grows, 2: the energy falls in an axisymmetric direction. Neutral
    motions do not count."""
    growth = [values for name, values in series.items() if name.startswith("growth_") and name != "growth_0"]
    waves = np.any([values > 1e-3 for values in growth], axis=0) if growth else np.zeros(series["time"].size, bool)
    return np.where(series["negative_directions"] > 0, 2, waves.astype(int))


def draw(paths, outputs):
    results = [read_result(path) for path in paths]
    names = [os.path.splitext(os.path.basename(path))[0].removeprefix("branch_") for path in paths]
    figure = Figure(figsize=(style.WIDTH, HEIGHT))
    axes = figure.add_axes([0.09, STRIP + 0.09, 0.88, 0.9 - STRIP])
    strip = figure.add_axes([0.09, 0.005, 0.88, STRIP], sharex=axes)  # shapes, each at its reduced volume
    strip.axis("off")
    axes.set_xlim(*LIMITS)
    strip.set_ylim(0, (LIMITS[1] - LIMITS[0]) * (STRIP * HEIGHT) / (0.88 * style.WIDTH))  # equal scales
    tops = strip.get_ylim()[1] * np.array([0.7, 0.3, 0.1])
    handles = []
    for row, (name, result, colour) in enumerate(zip(names, results, style.line_colours(len(results)))):
        series = result.series
        v, energy, bad = series["reduced_volume"], series["energy"] / (16 * np.pi), stability(series)
        for i in range(v.size - 1):
            axes.plot(v[i : i + 2], energy[i : i + 2], color=colour, linestyle=LINES[max(bad[i], bad[i + 1])])
        for kind, mark in ((1, "<"), (2, "x")):
            at = series["special"] == kind
            axes.plot(v[at], energy[at], color=colour, marker=mark, linestyle="", markersize=6)
        handles.append(Line2D([], [], color=colour, label=name))
        for wanted in np.arange(0.525, 0.95, 0.05):
            i = int(np.argmin(np.abs(v - wanted) + 1e-3 * (bad > 0)))  # prefers the stable one
            if abs(v[i] - wanted) > 0.01:
                continue
            frame = result.frames[i]
            z = frame.z - (frame.z.max() + frame.z.min()) / 2
            x = v[i] + SCALE * np.concatenate([frame.r, -frame.r[::-1]])
            strip.plot(x, tops[row] + SCALE * np.concatenate([z, z[::-1]]), color=colour, linewidth=0.9, clip_on=False)
    handles += [
        Line2D([], [], color="0.3", linestyle=LINES[1], label="unstable against a mode m > 0"),
        Line2D([], [], color="0.3", linestyle=LINES[2], label="unstable against an axisymmetric wave"),
        Line2D([], [], color="0.3", linestyle="", marker="<", label="fold"),
        Line2D([], [], color="0.3", linestyle="", marker="x", label="bifurcation"),
    ]
    axes.set(xlabel="reduced volume", ylabel="energy / 16\u03c0")
    axes.legend(handles=handles)
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw, "results", "+")
