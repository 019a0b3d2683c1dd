"""Draws the paper's tubular cells at rest, under K^2 and under (H - H0)^4: shapes and how they differ, energy against length,
distance to the capsule against the modulus.

tubular.py FOLDER -o PICTURE: results named k42_l2.hdf ... (branches) and length_K42_K40_00.hdf ... (as said in tools/figures).
"""

import os

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from . import command_line, style
from .labels import formula, number
from .results import read_result

DASHES = {"k42": "-", "k40": (0, (3, 2))}
SHOWN = {"k42": (0.0, 0.06, 0.12), "k40": (0.0, 0.02, 0.06)}
NAMES = {"k42": formula("k_{42}"), "k40": formula("k_{40}")}
LENGTHS = (2, 3, 4)
K20, RADIUS = 0.125, 0.5


def half_profile(frame):
    """r and z from the lower pole to the upper one, centred."""
    return frame.r, frame.z - (frame.z[0] + frame.z[-1]) / 2


def capsule(radius, length, points=60):
    angle = np.linspace(0, np.pi / 2, points)
    r, z = radius * np.cos(angle), length / 2 + radius * np.sin(angle)
    right = np.concatenate([r[::-1], r]), np.concatenate([z[::-1], -z])
    return np.concatenate([right[0], -right[0][::-1]]), np.concatenate([right[1], right[1][::-1]])


def at_value(branch, value):
    return branch.frames[int(np.argmin(np.abs(branch.series["parameter"] - value)))]


def displacement(frame, first):
    """From the equator to the upper pole, by the part of the length of the profile: how far outside the first shape it is."""
    lines = []
    for r, z in map(half_profile, (first, frame)):
        s = np.concatenate([[0], np.cumsum(np.hypot(np.diff(r), np.diff(z)))])
        part = np.linspace(0.5, 1, 201)
        lines.append((part, np.interp(part, s / s[-1], r), np.interp(part, s / s[-1], z)))
    (part, r, z), (_, r1, z1) = lines
    dr, dz = np.gradient(r), np.gradient(z)
    return 2 * part - 1, ((r1 - r) * dz - (z1 - z) * dr) / np.hypot(dr, dz)


def colours(key):
    return dict(zip(SHOWN[key], style.line_colours(len(SHOWN[key]))))


def draw_shapes(axes, branches):
    for column, length in enumerate(LENGTHS):
        shift = 2.2 * column
        r, z = capsule(RADIUS, length)
        axes.plot(r + shift, z, color="0.6", linestyle=":", linewidth=0.9)
        axes.plot([shift, shift], [-0.6 - length / 2, 0.6 + length / 2], color="0.8", linewidth=0.6)
        for key, side in (("k42", -1), ("k40", 1)):
            for (value, colour), dashes in zip(colours(key).items(), ("-", "-", (0, (3, 2)))):  # the last two may coincide
                r, z = half_profile(at_value(branches[key, length], value))
                axes.plot(side * r + shift, z, color=colour, linestyle=dashes)
            axes.text(shift + 0.12 * side, 0.66 + length / 2, NAMES[key], ha="right" if side < 0 else "left", fontsize=7)
        axes.text(shift, 1.02 + length / 2, f"l = {length}", ha="center")
    axes.set_ylim(-2.75, 3.35)
    axes.plot([5.9, 5.9], [-2.5, -1.5], color="0.1", linewidth=1.0, solid_capstyle="butt")
    axes.text(5.98, -2.0, "1", va="center", fontsize=7)


def draw_differences(figure, branches):
    for column, length in enumerate(LENGTHS):
        axes = style.axes_at(figure, 0.75 + 2.15 * column, 3.05, 1.68, 1.05)
        for key, dashes in DASHES.items():
            branch = branches[key, length]
            for value, colour in list(colours(key).items())[1:]:
                axes.plot(*displacement(at_value(branch, value), at_value(branch, 0)), color=colour, linestyle=dashes)
        axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
        axes.set(xlabel="equator to pole", xlim=(0, 1), title=f"l = {length}")
        if column == 0:
            axes.set_ylabel("outward shift")


def energies(folder, key, value):
    """Lengths and energies of separate equilibria."""
    k42, k40 = (value, 0) if key == "k42" else (0, value)
    names = [name for name in sorted(os.listdir(folder)) if name.startswith(f"length_{k42:g}_{k40:g}_") and name.endswith(".hdf")]
    results = [read_result(os.path.join(folder, name)) for name in names]
    return np.transpose(sorted((r.case["shape"]["length"], r.series["energy"][0]) for r in results if "energy" in r.series))


def draw_energies(axes, folder, key):
    for value, colour in colours(key).items():
        axes.plot(*energies(folder, key, value), color=colour, linestyle=DASHES[key])
        axes.axhline(4 * np.pi * (K20 + value / RADIUS**2), color=colour, linestyle=":", linewidth=0.9)  # of the capsule
    handles = [Line2D([], [], color=colour, linestyle=DASHES[key], label=number(value)) for value, colour in colours(key).items()]
    axes.legend(handles=handles, title=NAMES[key], title_fontsize=7, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0),
                columnspacing=0.8, handlelength=1.8)  # fmt: skip
    axes.set(xlabel="length l", xlim=(1, 5))
    axes.set_ylim(bottom=0)


def draw_distances(axes, branches):
    for length, marker in zip(LENGTHS, style.MARKERS):
        for key in SHOWN:
            series = branches[key, length].series
            axes.plot(series["parameter"], series["distance_to_start"], color="0.2", marker=marker, markersize=3, linewidth=0.9,
                      markerfacecolor="0.2" if key == "k42" else "white", linestyle=DASHES[key])  # fmt: skip
    handles = [Line2D([], [], color="0.2", marker=marker, markersize=3, label=f"l = {length}") for length, marker in zip(LENGTHS, style.MARKERS)]
    axes.set(xlabel=" or ".join(NAMES.values()), ylabel="distance to the capsule")
    axes.set_ylim(0, 0.34)
    axes.legend(handles=handles, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0), columnspacing=0.8, handlelength=1.8)


def draw(folder, outputs):
    branches = {(key, length): read_result(os.path.join(folder, f"{key}_l{length}.hdf")) for key in SHOWN for length in LENGTHS}
    figure = Figure(figsize=(style.WIDTH, 7.6))
    shapes = style.axes_at(figure, 0.2, 4.4, 6.6, 3.15)
    shapes.set_aspect("equal")
    shapes.axis("off")
    draw_shapes(shapes, branches)
    draw_differences(figure, branches)
    for place, key in enumerate(SHOWN):
        axes = style.axes_at(figure, 0.55 + 2.0 * place, 0.45, 1.6, 1.55)
        draw_energies(axes, folder, key)
        if place == 0:
            axes.set_ylabel("energy")
    draw_distances(style.axes_at(figure, 4.9, 0.45, 1.95, 1.55), branches)
    for letter, x, y in (("a", 0.05, 7.5), ("b", 0.05, 4.2), ("c", 0.05, 2.5), ("d", 4.3, 2.5)):
        figure.text(x / style.WIDTH, y / 7.6, f"({letter})", va="top", fontsize=9)
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw, "folder")
