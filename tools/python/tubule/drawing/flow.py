"""Velocities on shapes: their symbols, colours and arrows, and the positions of arrows on a curved surface."""

import numpy as np
from matplotlib.patches import FancyArrowPatch

from .labels import power
from .results import tangential

LONGEST_ARROW, SHORTEST_ARROW = 0.17, 0.035  # inches
STILL = 5e-3  # part of the largest speed of a run below which a shape is drawn as at rest
ROUNDING = 1e-6  # lengths per unit of time: speeds of an initial shape that does not move
VELOCITY = "RdBu_r"
SYMBOLS = {"u_n": "u\u2099", "u_t": "u\u209c", "u_theta": "u\u03b8", "H0": "H\u2080", "energy_density": "f"}
SPACING = 0.15  # inches between arrows on a surface
STEEPEST = 0.3  # smallest cosine between the normal and the eye that has arrows


def arrow_style(length):
    """Head size for an arrow of this length in inches: short arrows have small heads."""
    head = 2.6 * min(1.0, 0.25 + length / LONGEST_ARROW)
    style = f"-|>,head_length={head},head_width={head / 2}"
    return dict(arrowstyle=style, mutation_scale=1, color="0.1", linewidth=0.8, shrinkA=0, shrinkB=0)


def draw_arrow_key(figure, left, bottom, words):
    """Legend of the longest arrow; `left` is a part of the page, `bottom` inches below its 0.5 inches."""
    wide, tall = figure.get_size_inches()
    x, y = left * wide, bottom + 0.42
    ends = (x / wide, y / tall), ((x + LONGEST_ARROW) / wide, y / tall)
    figure.add_artist(FancyArrowPatch(*ends, transform=figure.transFigure, **arrow_style(LONGEST_ARROW)))
    figure.text((x + LONGEST_ARROW + 0.08) / wide, y / tall, words, va="center", fontsize=8, linespacing=1.3)


class Motion:
    """Speeds of the shapes of one result, for quantities relative to the largest value on each shape or, `by_run`, of all."""

    def __init__(self, shapes, unit="", rate=1.0, by_run=False):
        self.shapes, self.by_run = shapes, by_run
        self.unit, self.rounding = unit, ROUNDING * rate  # of speeds; `rate`: of one length per unit of time of the case
        self.fastest = max((shape.speed for shape in shapes), default=0.0)

    def still(self, shape):
        return shape.speed <= max(STILL * self.fastest, self.rounding * shape.size)

    def largest(self, name, shape):
        """The largest |u_n| or |u_t|; 0 where nothing moves."""
        return 0.0 if self.still(shape) else shape.largest(name)

    def scale(self, name, shape):
        """What velocities are drawn relative to; 0 where the shape has none."""
        largest = self.largest(name, shape)
        return largest and (max(self.largest(name, other) for other in self.shapes) if self.by_run else largest)

    def relative(self, shape):
        """u_n over what it is drawn relative to; 0 at rest."""
        return shape.u_n / (self.scale("u_n", shape) or np.inf)

    def words(self, shape):
        """The caption below the picture."""
        found = {"u_n": self.largest("u_n", shape), "u_t": self.largest("u_t", shape), "u_theta": shape.largest("u_theta")}
        if not any(found.values()) and shape.speed > self.rounding * shape.size:
            found = {"u": shape.speed}
        lines = (f"|{SYMBOLS.get(name, name)}| \u2264 {power(value, 2)} {self.unit}".rstrip() for name, value in found.items() if value)
        return "\n".join(lines) or "at rest"


def motions_of(results, frames_of, by_run):
    """The motion to which each shape belongs, by the id of the shape."""
    motions = {}
    for result in results:
        motion = Motion(frames_of(result), result.unit("length/time"), result.scale("1/time"), by_run)
        motions |= {id(shape): motion for shape in motion.shapes}
    return motions


def surface_arrows(samples, velocity, spacing):
    """Samples, evenly spaced in the picture, where the outside is seen and not too steep, and the tangential velocity there.

    `velocity` [samples, 3] and what comes back are in the coordinates of the view: right, up, towards the eye.
    """
    height, width = samples.shape
    pitch = max(1, round(spacing))
    rows = np.arange(pitch // 2, height, max(1, round(pitch * np.sqrt(0.75))))
    places = [np.arange(pitch // 2 if i % 2 else 0, width, pitch) + row * width for i, row in enumerate(rows)]
    places = np.concatenate(places) if places else np.zeros(0, int)
    normal = samples.normal[places]
    size = np.linalg.norm(normal, axis=1)
    seen = np.isfinite(samples.depth[places]) & samples.outside[places] & (normal[:, 2] > STEEPEST * size) & (size > 0)
    places = places[seen]
    return places, tangential(velocity[places], samples.normal[places])


def draw_surface_arrows(axes, samples, velocity, largest, left, top, per_inch):
    """Arrows relative to the `largest` tangential speed; `left` and `top` in inches are the corner of the picture."""
    places, along = surface_arrows(samples, velocity, SPACING * per_inch)
    arrows = LONGEST_ARROW * along[:, :2] / largest  # foreshortened, as the surface is
    row, column = np.divmod(places, samples.shape[1])
    middles = np.column_stack([left + (column + 0.5) / per_inch, top - (row + 0.5) / per_inch])
    for middle, arrow in zip(middles, arrows):
        length = np.hypot(*arrow)
        if length >= SHORTEST_ARROW:
            axes.add_patch(FancyArrowPatch(middle - arrow / 2, middle + arrow / 2, zorder=5, **arrow_style(length)))
