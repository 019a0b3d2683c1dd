"""Colours of quantities: H orange to violet, K blue to red, white where H = H0 and K = 0, or at the mean where H0 varies or
all values are far from it; velocities, pressure, H0 and the density of energy."""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.ticker import FuncFormatter, MaxNLocator

from . import style
from .flow import SYMBOLS, VELOCITY, draw_arrow_key
from .labels import formula, in_unit, number, power
from .units import OF_FRAMES

COVERED = 0.98  # part of the membrane area whose curvature is inside the colour scale
MARGIN = 1.25  # the colour scale extends beyond that by this factor
WHOLE = 2.2  # and up to the last value if that is within this factor
FAR = 0.5  # of the range of values: from there on white is their mean
LONG, LETTER = 50, 0.047  # letters of a label above which it has two lines, and inches of one
BAR_HEIGHT = 0.66  # inches of a colour bar with its label
ROUNDING = 1e-9  # a uniform tube has K = 0 up to this; the colour scale must not magnify it
MAPS = {"H": "PuOr", "K": "RdBu_r", "H0": "PuOr", "p": "PRGn"}
LABELS = {
    "H": "mean curvature H = \u03ba\u2081 + \u03ba\u2082",
    "K": "Gaussian curvature K",
    "H0": "spontaneous curvature H\u2080",
    "p": "pressure p",
    "energy_density": "bending energy per area f",
    "u_n": "normal velocity u\u2099",
}


@dataclass
class Colours:
    map: str  # as matplotlib names it
    norm: Normalize
    extend: str  # where values lie beyond the scale
    label: str

    def rgb(self, values):
        return plt.get_cmap(self.map)(self.norm(values))[..., :3]


def covered_to(part, value, area):
    """Where the values, from the lowest on, have this part of the area."""
    order = np.argsort(value)
    place = np.searchsorted(np.cumsum(area[order]) / area.sum(), part)
    return value[order][np.minimum(place, value.size - 1)]


def colour_scale(value, area, centre, one=1.0):
    """A symmetric scale around `centre` that covers nearly all area, so that a pinching neck does not bleach the rest.
    `one`: what the number 1 of the file is."""
    distance = np.abs(value - centre)
    half = MARGIN * covered_to(COVERED, distance, area)
    if half < distance.max() <= WHOLE * half:
        half = distance.max()
    if half < ROUNDING * max(one, abs(centre)):
        half = max(one, abs(centre))
    beyond = bool(value.min() < centre - half), bool(value.max() > centre + half)
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[beyond]
    return Normalize(centre - half, centre + half), extend


def covered_range(value, area):
    """Lowest and highest value, but for what nearly no area has."""
    rest = (1 - COVERED) / 2
    return covered_to(np.array([rest, 1 - rest]), value, area)


def is_far(centre, value, area):
    """Whether all values lie so far to one side of `centre` that a scale around it would show little of how they differ."""
    low, high = covered_range(value, area)
    return max(low - centre, centre - high) > FAR * (high - low) > 0


def about_mean(value, area, one):
    """A scale around the rounded mean, and words that say so."""
    low, high = covered_range(value, area)
    digits = 2 if high == low else max(2, 1 + int(np.ceil(np.log10(max(abs(low), abs(high)) / (high - low)))))
    centre = float(f"{np.average(value, weights=area):.{digits}g}")
    return colour_scale(value, area, centre, one), f", white: mean \u2248 {number(centre)}"


def colours_of(name, results, shapes, areas):
    """The colours of a quantity: one scale for all shapes; `areas` has the area of each of their values, a list per shape."""
    value, area = np.concatenate([np.ravel(shape.quantity(name)) for shape in shapes]), np.concatenate(areas)
    one, label = results[0].scale(OF_FRAMES[name]), in_unit(LABELS[name], results[0].unit(OF_FRAMES[name]))
    if name == "u_n":
        largest = float(np.abs(value).max()) or 1.0
        return Colours(VELOCITY, Normalize(-largest, largest), "neither", label + ", > 0: outward")
    if name == "energy_density":
        low, high = covered_range(value, area)
        low, high = min(0.0, low), MARGIN * high
        extend = "max" if value.max() > high else "neither"
        return Colours("magma_r", Normalize(low, max(high, low + ROUNDING * one)), extend, label)
    centre, words = 0.0, ""
    if name == "H":
        common = {result.H0 for result in results}
        centre = common.pop() if len(common) == 1 else 0.0
        words = f", white: {formula('H_0')} = {number(centre)}" if centre else ""
    if name in ("H0", "p") or centre is None or (name in "HK" and is_far(centre, value, area)):
        scale, words = about_mean(value, area, one)
    else:
        scale = colour_scale(value, area, centre, one)
    if scale[1] != "neither":  # a neck, say
        words += f", from {power(value.min(), 2)} to {power(value.max(), 2)}"
    return Colours(MAPS[name], *scale, label + words)


def relative_colours(words):
    """Those of a quantity relative to its largest magnitude."""
    return Colours(VELOCITY, Normalize(-1, 1), "neither", words)


def normal_velocity(of):
    return relative_colours(f"normal velocity {SYMBOLS['u_n']} / max |{SYMBOLS['u_n']}| of the {of}, > 0: outward")


def bars_height(count):
    """Inches that so many colour bars need."""
    return BAR_HEIGHT * (count if style.is_narrow() else 1)


def draw_bars(figure, bottom, shown, arrow=""):
    """Bars of a list of Colours; behind them the longest arrow, if there are words for it."""
    room = style.slots(len(shown) + bool(arrow))
    for slot, colours in zip(room, shown):
        draw_bar(figure, bottom, slot, colours)
    if arrow:
        left, _, line = room[-1]
        draw_arrow_key(figure, left, bottom + line * BAR_HEIGHT, arrow)


def draw_bar(figure, bottom, slot, colours):
    """One colour bar above `bottom`; `slot` as style.slots() gives them."""
    left, width, line = slot
    height, inches = figure.get_figheight(), width * figure.get_figwidth()
    axes = figure.add_axes([left, (bottom + line * BAR_HEIGHT + 0.38) / height, width, 0.09 / height])
    mappable, label = ScalarMappable(colours.norm, colours.map), colours.label
    bar = figure.colorbar(mappable, cax=axes, orientation="horizontal", extend=colours.extend)
    bar.outline.set_linewidth(0.5)
    if len(label) > min(LONG, inches / LETTER):
        name, _, rest = label.partition(",")
        label = f"{name}\n{rest.strip()}" if rest else label
    bar.set_label(label, labelpad=2, fontsize=8 if "\n" not in label else 7)
    bar.ax.tick_params(width=0.5, length=2.5)
    bar.locator = MaxNLocator(max(2, min(5, int(inches / 0.4))))
    bar.formatter = FuncFormatter(lambda value, _: number(value))
    bar.solids.set_rasterized(True)
    bar.solids.set_edgecolor("face")
