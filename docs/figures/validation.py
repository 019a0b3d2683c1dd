"""Draws the paper's validation: its surface coloured by curvature, and errors of recovered curvatures against the mesh
width, from the table that curvature_table prints."""

import math

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator

from . import command_line, style
from .labels import SUPERSCRIPT
from .results import BadInput
from .tables import read_rows

SURFACE, MESH = "dumbbell", "structured"
QUANTITIES = {"H": "H", "K": "K", "grad_H": "\u2207H", "grad_K": "\u2207K"}
RECOVERIES = {
    "elementwise": "(i) element by element",
    "smoothed": "(i), smoothed as in the paper",
    "normal": "(ii) from the projected normal",
    "weak": "(iii) weak",
    "patch": "patch recovery, the default",
    "exact_nodal": "exact at the nodes",
}


def read_table(path):
    """{(k, recovery, quantity): [(h, error), ...]} of the validation surface, coarse first. Raises BadInput."""
    lines = {}
    for row in read_rows(path, ("surface", "mesh", "recovery"), ("k", "h", *QUANTITIES)):
        if row.surface != SURFACE or row.mesh != MESH or row.recovery not in RECOVERIES:
            continue
        for quantity in QUANTITIES:
            point = row.h, getattr(row, quantity)
            if min(point) <= 0:
                raise BadInput(f"{path}: h and errors must be positive numbers, not {quantity} = {point[1]} at h = {point[0]}")
            lines.setdefault((int(row.k), row.recovery, quantity), []).append(point)
    if not lines:
        raise BadInput(f"{path}: has no rows for the surface {SURFACE}, {MESH}")
    return {key: sorted(points, reverse=True) for key, points in lines.items()}


def profile(angle):
    """r, z, outward normal (r, z), H and K at an angle from the pole of the dumbbell: theory.md (4.5), (7.9)."""
    c, s = np.cos(angle), np.sin(angle)
    scale, scale1, scale2 = 0.25 + 0.75 * c * c, -1.5 * c * s, -1.5 * (c * c - s * s)
    r, r1, r2 = scale * s, scale1 * s + scale * c, scale2 * s + 2 * scale1 * c - scale * s
    z, z1, z2 = c, -s, -c
    speed = np.hypot(r1, z1)
    along, around = (z2 * r1 - r2 * z1) / speed**3, z1 / (speed * r)
    return r, z, -z1 / speed, r1 / speed, along + around, along * around


def picture(curvature, colours, limit, points=500):
    """The surface seen from the side, its axis level, as an RGBA image; curvature 0 is white, +-limit full colour."""
    angle = np.linspace(1e-3, math.pi - 1e-3, 2000)
    values = dict(zip("r z nr nz H K".split(), profile(angle)))
    z = np.linspace(-1, 1, points)
    at = {name: np.interp(z, values["z"][::-1], column[::-1]) for name, column in values.items()}
    height = np.linspace(-0.5, 0.5, points // 2)[:, None]
    inside = np.abs(height) < at["r"]
    sine = np.where(inside, height / np.maximum(at["r"], 1e-9), 0)
    normal = at["nr"] * sine, at["nr"] * np.sqrt(1 - sine**2), at["nz"] + 0 * sine
    light = np.array([0.55, 0.75, -0.35]) / np.linalg.norm([0.55, 0.75, -0.35])
    shade = 0.55 + 0.45 * np.clip(sum(n * l for n, l in zip(normal, light)), 0, 1)
    rgba = plt.get_cmap(colours)(np.clip(0.5 + 0.5 * at[curvature] / limit, 0, 1))[None, :, :].repeat(len(height), 0)
    rgba[..., :3] *= shade[..., None]
    rgba[..., 3] = inside
    return rgba


def draw_surface(figure, left, bottom, name, colours, limit):
    axes = figure.add_axes([left, bottom, 0.33, 0.16])
    axes.imshow(picture(name, colours, limit), extent=(-1, 1, -0.5, 0.5), origin="lower", interpolation="bilinear")
    axes.axis("off")
    scale = figure.add_axes([left + 0.345, bottom + 0.02, 0.011, 0.12])
    figure.colorbar(ScalarMappable(Normalize(-limit, limit), colours), cax=scale, ticks=(-limit, 0, limit))
    scale.set_title(name, pad=4)


def draw_slope(axes, fine, coarse, order, above):
    """A dashed line of this order from a point, (h, error), to another h; labelled above one end or below the other."""
    h, error = fine
    end = error * (coarse / h) ** order
    axes.plot([h, coarse], [error, end], color="0.5", linestyle="--", linewidth=0.7, zorder=1)
    axes.annotate("h" + (SUPERSCRIPT[str(order)] if order > 1 else ""), (h, error) if above else (coarse, end),
                  (0, 5 if above else -6), textcoords="offset points", fontsize=6.5, color="0.35", ha="center",
                  va="center")


def draw(path, outputs):
    lines = read_table(path)
    orders = sorted({k for k, _, _ in lines})
    looks = {
        name: {"color": colour, "marker": marker, "markersize": 3.2}
        for name, colour, marker in zip(RECOVERIES, style.line_colours(len(RECOVERIES)), style.MARKERS)
    }
    looks["exact_nodal"].update(linestyle=":", mfc="white", color="0.25")
    looks["patch"].update(color="#c2410c", linewidth=1.6)

    figure = Figure(figsize=(style.WIDTH, 7.0))
    figure.text(0.012, 0.975, "(a)")
    draw_surface(figure, 0.08, 0.815, "H", "PuOr", 8)
    draw_surface(figure, 0.56, 0.815, "K", "RdBu_r", 12)
    figure.text(0.012, 0.785, "(b)")
    low, width, height, gap = 0.115, 0.205, 0.2, 0.02
    shown = [point for points in lines.values() for point in points]
    widths = min(h for h, _ in shown) / 1.25, max(h for h, _ in shown) * 1.25
    errors = min(e for _, e in shown) / 4, max(e for _, e in shown) * 4
    for row, k in enumerate(orders):
        for column, (quantity, title) in enumerate(QUANTITIES.items()):
            bottom = low + (len(orders) - 1 - row) * (height + gap)
            axes = figure.add_axes([0.1 + column * (width + gap), bottom, width, height])
            axes.set(xscale="log", yscale="log", xlim=widths, ylim=errors)
            for name, look in looks.items():
                points = lines.get((k, name, quantity), [])
                axes.plot(*zip(*points), zorder=4 if name == "patch" else 3, **look)
            gradient = quantity.startswith("grad")
            panel = [points for (order, _, which), points in lines.items() if (order, which) == (k, quantity)]
            (h, least), (coarsest, _) = min(points[-1] for points in panel), panel[0][0]
            draw_slope(axes, (h, least / 2), coarsest, k if gradient else k + 1, above=False)
            if k < 4:  # orders found in the paper
                most = max(points[-1][1] for points in panel)
                draw_slope(axes, (h, 1.8 * most), 1.6 * h, 1 if gradient else 2, above=True)
            axes.xaxis.set_major_locator(FixedLocator([0.05, 0.1, 0.2, 0.4]))
            axes.xaxis.set_minor_locator(NullLocator())
            axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.yaxis.set_major_locator(LogLocator(numticks=12))
            axes.yaxis.set_minor_formatter(NullFormatter())
            axes.tick_params(which="both", top=True, right=True)
            if row == 0:
                axes.set_title(title, pad=4)
            if row < len(orders) - 1:
                axes.set_xticklabels([])
            else:
                axes.set_xlabel("longest edge h", labelpad=1)
            if column == 0:
                axes.set_ylabel(f"k = {k}:  relative L\u00b2 error")
            else:
                axes.set_yticklabels([])
    handles = [Line2D([], [], label=text, **looks[name]) for name, text in RECOVERIES.items()]
    figure.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.53, 0.004), ncols=3)
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw)
