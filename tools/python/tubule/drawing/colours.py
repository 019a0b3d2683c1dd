"""Colours of curvature: H orange to violet, K blue to red, white where H = H0 (if that varies: at the mean) and K = 0."""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.ticker import FuncFormatter, MaxNLocator

from .labels import number, power

COVERED = 0.98  # part of the membrane area whose curvature is inside the colour scale
MARGIN = 1.25  # the colour scale extends beyond that by this factor
ROUNDING = 1e-9  # a uniform tube has K = 0 up to this; the colour scale must not magnify it


@dataclass
class Colours:
    map: str  # as matplotlib names it
    norm: Normalize
    extend: str  # where values lie beyond the scale
    label: str

    def rgb(self, values):
        return plt.get_cmap(self.map)(self.norm(values))[..., :3]


def colour_scale(values, areas, centre):
    """A symmetric scale around `centre` that covers nearly all area, so that a pinching neck does not bleach the rest."""
    distance = np.abs(np.concatenate(values) - centre)
    area = np.concatenate(areas)
    order = np.argsort(distance)
    covered = np.cumsum(area[order]) / area.sum()
    half = MARGIN * distance[order][min(np.searchsorted(covered, COVERED), distance.size - 1)]
    if half < ROUNDING * max(1.0, abs(centre)):
        half = max(1.0, abs(centre))
    beyond_low = any((v < centre - half).any() for v in values)
    beyond_high = any((v > centre + half).any() for v in values)
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[beyond_low, beyond_high]
    return Normalize(centre - half, centre + half), extend


def curvature_colours(results, frames, areas):
    """Colours of H and K on these frames; `areas` has the area of each of their values, one list per frame."""
    common_H0 = {result.H0 for result in results}
    centre, white = (common_H0.pop(), "H\u2080 = ") if len(common_H0) == 1 else (0.0, "")
    if centre is None:
        found = np.average(np.concatenate([frame.H.ravel() for frame in frames]), weights=np.concatenate(areas))
        centre, white = float(f"{found:.2g}"), "mean \u2248 "
    label = "mean curvature H = \u03ba\u2081 + \u03ba\u2082{}" + (f", white: {white}{number(centre)}" if centre else "")
    H = Colours("PuOr", *colour_scale([frame.H.ravel() for frame in frames], areas, centre), label)
    K = Colours("RdBu_r", *colour_scale([frame.K.ravel() for frame in frames], areas, 0.0), "Gaussian curvature K{}")
    return H, K


def pressure_colours(values, areas):
    mean = float(np.average(np.concatenate(values), weights=np.concatenate(areas)))
    return Colours("PRGn", *colour_scale(values, areas, mean), f"pressure p, white: its mean {power(mean, 3)}")


def draw_bars(figure, bottom, H, K, H_where="", K_where=""):
    """Two colour bars in the 0.5 inches above `bottom`; the words say which part of the picture they are for."""
    for left, colours, where in ((0.12, H, H_where), (0.56, K, K_where)):
        mappable = ScalarMappable(colours.norm, colours.map)
        draw_bar(figure, bottom, left, 0.34, mappable, colours.label.format(where), colours.extend)


def draw_bar(figure, bottom, left, width, mappable, label, extend="neither"):
    """One colour bar in the 0.5 inches above `bottom`; `left` and `width` are parts of the page."""
    height = figure.get_figheight()
    axes = figure.add_axes([left, (bottom + 0.38) / height, width, 0.09 / height])
    bar = figure.colorbar(mappable, cax=axes, orientation="horizontal", extend=extend)
    bar.outline.set_linewidth(0.5)
    bar.set_label(label, labelpad=2)
    bar.ax.tick_params(width=0.5, length=2.5)
    bar.locator = MaxNLocator(5)
    bar.formatter = FuncFormatter(lambda value, _: number(value))
    bar.solids.set_rasterized(True)
    bar.solids.set_edgecolor("face")
