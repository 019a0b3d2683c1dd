"""Panel of profiles that are not graphs r(z): sections through the axis, coloured by H and K, or other quantities; by the
normal velocity with arrows for the velocity along the profile."""

from operator import attrgetter

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path

from .colours import normal_velocity
from .flow import LONGEST_ARROW, SHORTEST_ARROW, SYMBOLS, arrow_style, motions_of
from .labels import power
from .tubes import ProfilePanel

BAND, OUTLINE = 2.8, 3.8  # points: the coloured line, and its outline
POINTS_PER_INCH, MIN_POINTS = 150, 200  # along a profile
ARROW_SPACING, ARROW_DISTANCE = 0.19, 0.075  # inches along a profile, and outside of it


class Section:
    """One profile in inches, evenly spaced points: x from the axis, y along it, unit normal, arc length."""

    def __init__(self, frame, scale):
        r, z = scale * frame.r, scale * (frame.z - (frame.z.min() + frame.z.max()) / 2)
        self.along = np.concatenate([[0], np.cumsum(np.hypot(np.diff(r), np.diff(z)))])
        self.length = self.along[-1]
        self.places = np.linspace(0, self.length, max(MIN_POINTS, int(POINTS_PER_INCH * self.length)))
        self.x, self.y = self.at(r), self.at(z)
        # The inside is to the left of the profile, outward is to the right.
        step = np.gradient(self.x), np.gradient(self.y)
        size = np.hypot(*step) + 1e-300
        self.normal = step[1] / size, -step[0] / size

    def at(self, values):
        return np.interp(self.places, self.along, values)

    def beside(self, places, distance):
        """Points displaced outward by a distance."""
        x, y = self.x + distance * self.normal[0], self.y + distance * self.normal[1]
        return np.interp(places, self.places, x), np.interp(places, self.places, y)


def arrows(section, u_t, largest):
    """Positions along the profile from tail to head of each visible arrow; one of the `largest` speed is the longest."""
    count = max(3, round(section.length / ARROW_SPACING))
    middles = (np.arange(count) + 0.5) * section.length / count
    lengths = LONGEST_ARROW * np.interp(middles, section.places, u_t) / largest
    seen = np.abs(lengths) >= SHORTEST_ARROW
    return [
        np.clip(np.linspace(middle - length / 2, middle + length / 2, 9), 0, section.length)
        for middle, length in zip(middles[seen], lengths[seen])
    ]


class CurvePanel(ProfilePanel):
    MARGIN = 0.14
    COLUMN_GAP = 0.1
    MAX_LENGTH = 3.2

    def __init__(self, results, labels, columns, names, by_run):
        self.velocity = names == ["u_n"]
        if self.velocity:
            self.of, self.motions = "run" if by_run else "shape", motions_of(results, attrgetter("frames"), by_run)
            if any(frame and frame.u_t is not None for column in columns for frame in column.cells):
                u_t = SYMBOLS["u_t"]
                self.arrow = f"velocity {u_t} along the profile;\nthis long: max |{u_t}| of the {self.of}"
        super().__init__(results, labels, columns, names)

    def _choose_colours(self, results, frames, areas):
        return [normal_velocity(self.of)] if self.velocity else super()._choose_colours(results, frames, areas)

    def _words(self, column, row):
        words, frame, result = super()._words(column, row), column.cells[row], self.results[row]
        if frame and frame.parameter is not None:
            space = "\n" if len(result.parameter_name) > 8 else " "
            value = f"{power(frame.parameter, 4)} {result.parameter_unit}".rstrip()
            words.insert(1, f"{result.parameter_name}{space}= {value}")
        return words

    def _draw_shape(self, axes, frame, row, places):
        ((x, y),) = places
        section = Section(frame, self.scale)
        u_t = self.motions[id(frame)].scale("u_t", frame) if self.velocity else 0
        closing = np.concatenate([section.x, -section.x[::-1]]), np.concatenate([section.y, section.y[::-1]])
        axes.fill(x + closing[0], y + closing[1], color="0.95", linewidth=0, zorder=0)
        for side in (-1, 1):
            points = np.column_stack([x + side * section.x, y + section.y])
            axes.plot(*points.T, color="0.1", linewidth=OUTLINE, solid_capstyle="butt", zorder=3)
            colour = self._colour(section, frame, side)
            pieces = np.stack([points[:-2], points[1:-1], points[2:]], axis=1)  # overlapping: no gaps between
            axes.add_collection(
                LineCollection(pieces, colors=colour[1:-1], linewidths=BAND, rasterized=True, zorder=4), autolim=False
            )
            for along in arrows(section, section.at(frame.u_t), u_t) if u_t else ():
                way_x, way_y = section.beside(along, ARROW_DISTANCE)
                way = Path(np.column_stack([x + side * way_x, y + way_y]))
                axes.add_patch(FancyArrowPatch(path=way, zorder=5, **arrow_style(abs(along[-1] - along[0]))))
        self._draw_axis(axes, frame, x, y)

    def _colour(self, section, frame, side):
        """The colours of the points of one side."""
        if not self.velocity:
            _, values, colours = self._halves(frame)[side > 0]
            return colours.rgb(section.at(values))
        if frame.u_n is None:
            return np.full((section.x.size, 3), 0.7)
        return self.colours[0].rgb(section.at(self.motions[id(frame)].relative(frame)))
