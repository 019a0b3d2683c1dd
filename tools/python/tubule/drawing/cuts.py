"""Panel of plane cuts: the curves in which a plane x, y or z = constant intersects the surfaces, superposed for all times."""

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from . import raster, style
from .labels import MINUS, in_unit, number
from .results import BadInput
from .style import line_colours, time_title

PIECES, FEWEST = 300, 2  # along the side of a square of all cells; minimum per cell
HALVINGS = 48  # of the side of a piece
HEIGHT, LEGEND, LEFT, GAP = 2.3, 1.1, 0.5, 0.3  # inches of the axes, of the legend beside them, left of and between them


def _meeting(order, heights, start, end):
    """Barycentric positions, on the lines from `start` to `end`, where the polynomials of `heights` (a row each) vanish.
    By bisection: they are < 0 at exactly one end."""
    low, high = start, end
    below = (raster.lagrange(order, start) * heights).sum(axis=1) < 0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        same = (((raster.lagrange(order, middle) * heights).sum(axis=1) < 0) == below)[:, None]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return (low + high) / 2


def cut(surface, axis, level):
    """Segments [n, 2 ends, 3] of the curves where coordinate `axis` is `level`. Their ends lie on the curved triangles
    and in the plane to rounding; in between they are chords."""
    heights = surface.points[..., axis] - level
    n = max(FEWEST, int(np.ceil(PIECES / np.sqrt(len(heights)))))
    places, corners = raster.division(n)
    below = (heights @ raster.lagrange(surface.order, places).T < 0)[:, corners]  # [cell, piece, corner]
    cell, piece = np.nonzero(below.any(axis=2) & ~below.all(axis=2))
    sides = np.array([[0, 1], [1, 2], [2, 0]])
    crossed = below[cell, piece][:, sides[:, 0]] != below[cell, piece][:, sides[:, 1]]  # two sides of each piece
    which, side = np.nonzero(crossed)
    ends = corners[piece[which, None], sides[side]]
    ends = np.sort(ends, axis=1)  # so that neighbours in a cell find the same point
    owner = cell[which]
    at = _meeting(surface.order, heights[owner], places[ends[:, 0]], places[ends[:, 1]])
    points = np.einsum("pn,pni->pi", raster.lagrange(surface.order, at), surface.points[owner])
    return points.reshape(-1, 2, 3)


class CutPanel:
    """One drawing per result, with a common scale; one colour per time."""

    def __init__(self, results, labels, columns, plane):
        self.labels = [""] if len(results) == 1 else [", ".join(label) for label in labels]
        axis, self.level = plane[0], plane[1] * results[0].scale("length")
        self.unit, self.time_unit = results[0].unit("length"), results[0].unit("time")
        self.axis = "xyz".index(axis)
        self.across = [i for i in range(3) if i != self.axis]
        self.columns = columns
        self.cuts = [[cut(s, self.axis, self.level) if s else None for s in column.cells] for column in columns]
        points = [c[..., self.across].reshape(-1, 2) for column in self.cuts for c in column if c is not None and len(c)]
        self.name = f"{axis} = {number(self.level)} {self.unit}".rstrip()
        if not points:
            raise BadInput(f"--plane: {self.name.replace(MINUS, '-')} meets none of the surfaces")
        points = np.concatenate(points)
        low, high = points.min(axis=0), points.max(axis=0)
        rim = 0.05 * (high - low).max()
        self.low, self.high = low - rim, high + rim
        wide, tall = self.high - self.low
        room = (style.WIDTH - LEFT - LEGEND - GAP * len(results)) / len(results)
        self.scale = min(room / wide, HEIGHT / tall)
        self.wide, self.tall = self.scale * wide, self.scale * tall
        self.height = self.tall + 0.62

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        width, height = figure.get_size_inches()
        colours = line_colours(len(self.columns))
        whole = len(self.labels) * (self.wide + GAP) + LEGEND
        left = LEFT + max(0, (width - LEFT - whole) / 2)
        for row, label in enumerate(self.labels):
            axes = figure.add_axes([left / width, (bottom + 0.38) / height, self.wide / width, self.tall / height])
            axes.set(xlim=(self.low[0], self.high[0]), ylim=(self.low[1], self.high[1]))
            axes.set_xlabel(in_unit("xyz"[self.across[0]], self.unit), labelpad=1)
            if row:
                axes.tick_params(labelleft=False)
            else:
                axes.set_ylabel(in_unit("xyz"[self.across[1]], self.unit), labelpad=1)
            axes.set_title(label, pad=3)
            for colour, column in zip(colours, self.cuts):
                if column[row] is not None:
                    lines = LineCollection(column[row][..., self.across], colors=[colour], linewidths=1, capstyle="round")
                    axes.add_collection(lines, autolim=False)
            left += self.wide + GAP
        titles = [time_title(i, column.time, self.time_unit) for i, column in enumerate(self.columns)]
        handles = [Line2D([], [], color=colour, label=title) for colour, title in zip(colours, titles)]
        axes.legend(handles=handles, title=f"cut {self.name}", title_fontsize=7, loc="upper left",
                    bbox_to_anchor=(1.02, 1.02), borderaxespad=0, labelspacing=0.35)  # fmt: skip
