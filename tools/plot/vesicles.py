#!/usr/bin/python3
"""Draws branches of vesicles: energy against reduced volume, stability, and shapes along the branches."""

import os
import sys

import command_line
import numpy as np
import style
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from results import read_result

LIMITS = (0.48, 0.97)  # of the reduced volume
HEIGHT = 4.4  # inches
SCALE = 0.0075  # reduced volume per unit of length


def unstable(series):
    """Where an axisymmetric direction or a wave around the axis grows; neutral motions do not count."""
    growth = [values for name, values in series.items() if name.startswith("growth_")]
    grows = series["negative_directions"] > 0
    return np.any([grows, *(values > 1e-3 for values in growth)], axis=0)


def draw(paths, outputs):
    results = [read_result(path) for path in paths]
    names = [os.path.splitext(os.path.basename(path))[0].removeprefix("branch_") for path in paths]
    figure = Figure(figsize=(style.WIDTH, HEIGHT))
    axes = figure.add_axes([0.09, 0.33, 0.88, 0.64])
    strip = figure.add_axes([0.09, 0.01, 0.88, 0.22], sharex=axes)  # shapes, each at its reduced volume
    strip.axis("off")
    axes.set_xlim(*LIMITS)
    strip.set_ylim(0, (LIMITS[1] - LIMITS[0]) * (0.22 * HEIGHT) / (0.88 * style.WIDTH))  # equal scales
    tops = strip.get_ylim()[1] * np.array([0.68, 0.27, 0.1])
    handles = []
    for row, (name, result, colour) in enumerate(zip(names, results, style.line_colours(len(results)))):
        series = result.series
        v, energy, bad = series["reduced_volume"], series["energy"] / (16 * np.pi), unstable(series)
        for i in range(v.size - 1):
            dotted = bad[i] or bad[i + 1]
            axes.plot(v[i : i + 2], energy[i : i + 2], color=colour, linestyle=":" if dotted else "-")
        for kind, mark in ((1, "<"), (2, "x")):
            at = series["special"] == kind
            axes.plot(v[at], energy[at], color=colour, marker=mark, linestyle="", markersize=6)
        handles.append(Line2D([], [], color=colour, label=name))
        for wanted in np.arange(0.525, 0.95, 0.05):
            i = int(np.argmin(np.abs(v - wanted) + 1e-3 * bad))  # prefers the stable one
            if abs(v[i] - wanted) > 0.01:
                continue
            frame = result.frames[i]
            z = frame.z - (frame.z.max() + frame.z.min()) / 2
            x = v[i] + SCALE * np.concatenate([frame.r, -frame.r[::-1]])
            strip.plot(x, tops[row] + SCALE * np.concatenate([z, z[::-1]]), color=colour, linewidth=0.9)
    handles += [
        Line2D([], [], color="0.3", linestyle=":", label="unstable"),
        Line2D([], [], color="0.3", linestyle="", marker="<", label="fold"),
        Line2D([], [], color="0.3", linestyle="", marker="x", label="bifurcation"),
    ]
    axes.set(xlabel="reduced volume", ylabel="energy / 16\u03c0")
    axes.legend(handles=handles)
    style.save(figure, outputs)


if __name__ == "__main__":
    sys.exit(command_line.main(__doc__, draw, "results", "+"))
