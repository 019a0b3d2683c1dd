"""Draws the paper's tubular cells as fluids in three dimensions, beside the axisymmetric equilibria: cuts, and what is
left of the energy over time. The folder has results moving_lL_K.hdf and rest_lL_K.hdf for L = 2, 3, 4 and K = 0, 006, 012."""

import os

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from . import command_line, style
from .cuts import cut
from .labels import formula, number
from .results import read_result

LENGTHS, K42 = (2, 3, 4), {"0": 0.0, "006": 0.06, "012": 0.12}
HEIGHT = 5.4  # inches


def energy_left(moving, rest):
    """E + E_kin of the run less the energy of the equilibrium."""
    series = moving.series
    return series["energy"] + series.get("kinetic_energy", 0) - rest.series["energy"][-1]


def draw_cuts(axes, moving, rest, shift, colour):
    """The surface where it is cut by y = 0, wide and pale; the axisymmetric equilibrium, thin and dark."""
    shape, frame = moving.surfaces[-1], rest.frames[-1]
    segments = cut(shape, 1, shape.points[..., 1].mean())[..., [0, 2]]
    middle = (segments.reshape(-1, 2).max(axis=0) + segments.reshape(-1, 2).min(axis=0)) / 2
    axes.add_collection(LineCollection(segments - middle + [shift, 0], colors=[colour], linewidths=3, alpha=0.45), autolim=False)
    z = frame.z - (frame.z.max() + frame.z.min()) / 2
    axes.plot(np.concatenate([frame.r, -frame.r[::-1]]) + shift, np.concatenate([z, z[::-1]]), color="0.1", linewidth=0.6)


def draw(folder, outputs):
    figure = Figure(figsize=(style.WIDTH, HEIGHT))
    colours = dict(zip(K42, style.line_colours(len(K42))))
    for column, length in enumerate(LENGTHS):
        shapes = figure.add_axes([0.02 + 0.33 * column, 0.43, 0.31, 0.53])
        shapes.set(aspect="equal", xlim=(-2.15, 2.15), ylim=(-2.6, 2.6))
        shapes.axis("off")
        shapes.set_title(f"l = {length}", pad=2)
        left = figure.add_axes([0.085 + 0.315 * column, 0.09, 0.26, 0.25])
        for place, (name, colour) in enumerate(colours.items()):
            moving, rest = (read_result(os.path.join(folder, f"{kind}_l{length}_{name}.hdf")) for kind in ("moving", "rest"))
            draw_cuts(shapes, moving, rest, 1.42 * (place - 1), colour)
            time, more = moving.series["time"], energy_left(moving, rest)
            left.plot(time[1:], np.abs(more[1:]), color=colour)
        left.set(xscale="log", yscale="log", xlabel="time", xlim=(1e-3, None))
        if column == 0:
            left.set_ylabel("energy above that at rest")
    handles = [Line2D([], [], color=c, linewidth=3, alpha=0.6, label=f"{formula('k_{42}')} = {number(K42[n])}") for n, c in colours.items()]
    handles.append(Line2D([], [], color="0.1", linewidth=0.6, label="axisymmetric, at rest"))
    figure.legend(handles=handles, ncols=4, loc="center", bbox_to_anchor=(0.52, 0.395))
    for letter, y in (("a", 0.985), ("b", 0.395)):
        figure.text(0.008, y, f"({letter})", va="top", fontsize=9)
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw, "folder")
