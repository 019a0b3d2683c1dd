"""Draws the paper's tubular cells at rest: shapes, energy against length, distance to the capsule against k42.

tubular.py FOLDER -o PICTURE: results named l2.hdf ... (branches in k42) and length_0.hdf ... (as said in tools/figures).
"""

import os

import numpy as np
from matplotlib.figure import Figure

from . import command_line, style
from .labels import formula, number
from .results import read_result

SHOWN = (0.0, 0.06, 0.12)  # k42


def mirrored(frame):
    z = frame.z - (frame.z[0] + frame.z[-1]) / 2
    return np.concatenate([frame.r, -frame.r[::-1]]), np.concatenate([z, z[::-1]])


def capsule(radius, length, points=60):
    angle = np.linspace(0, np.pi / 2, points)
    r, z = radius * np.cos(angle), length / 2 + radius * np.sin(angle)
    right = np.concatenate([r[::-1], r]), np.concatenate([z[::-1], -z])
    return np.concatenate([right[0], -right[0][::-1]]), np.concatenate([right[1], right[1][::-1]])


def nearest(values, wanted):
    return int(np.argmin(np.abs(values - wanted)))


def draw(folder, outputs):
    lengths = (2, 3, 4)
    branches = {length: read_result(os.path.join(folder, f"l{length}.hdf")) for length in lengths}
    colours = dict(zip(SHOWN, style.line_colours(len(SHOWN))))
    k42 = formula("k_{42}")

    figure = Figure(figsize=(style.WIDTH, 5.6))
    shapes = figure.add_axes([0.03, 0.46, 0.95, 0.52])
    shapes.set_aspect("equal")
    shapes.axis("off")
    for column, (length, branch) in enumerate(branches.items()):
        shift = 2.2 * column
        r, z = capsule(0.5, length)
        shapes.plot(r + shift, z, color="0.6", linestyle=":", linewidth=0.9)
        for (value, colour), dashes in zip(colours.items(), ("-", "-", (0, (3, 2)))):  # the last two nearly coincide
            frame = branch.frames[nearest(branch.series["parameter"], value)]
            r, z = mirrored(frame)
            shapes.plot(r + shift, z, color=colour, linestyle=dashes)
        shapes.text(shift, 2.62, f"l = {length}", ha="center")
    shapes.plot([5.9, 5.9], [-2.5, -1.5], color="0.1", linewidth=1.0, solid_capstyle="butt")
    shapes.text(5.98, -2.0, "1", va="center", fontsize=7)

    energy = figure.add_axes([0.09, 0.09, 0.37, 0.29])
    for value, colour in colours.items():
        results = [
            read_result(os.path.join(folder, name))
            for name in sorted(os.listdir(folder))
            if name.startswith(f"length_{value:g}_") and name.endswith(".hdf")
        ]
        rows = sorted((r.case["shape"]["length"], r.series["energy"][0]) for r in results if "energy" in r.series)
        energy.plot(*np.transpose(rows), color=colour, label=f"{k42} = {number(value)}")
        energy.axhline(4 * np.pi * (0.125 + value / 0.25), color=colour, linestyle=":", linewidth=0.9)
    energy.set(xlabel="length l of the capsule's cylinder", ylabel="energy (dotted: capsule)")
    energy.set_ylim(bottom=0)
    energy.legend(ncols=3, loc="lower left", bbox_to_anchor=(-0.12, 1.0), columnspacing=1.0, handlelength=1.4)

    distance = figure.add_axes([0.6, 0.09, 0.37, 0.29])
    for (length, branch), marker in zip(branches.items(), style.MARKERS):
        distance.plot(
            branch.series["parameter"], branch.series["distance_to_start"], color="0.2", marker=marker, label=f"l = {length}"
        )
    distance.set(xlabel=k42, ylabel="distance to the capsule")
    distance.set_ylim(bottom=0)
    distance.legend()
    for letter, x, y in (("a", 0.01, 0.975), ("b", 0.01, 0.44), ("c", 0.51, 0.44)):
        figure.text(x, y, f"({letter})", va="top", fontsize=9)
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw, "folder")
