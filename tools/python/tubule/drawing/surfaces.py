"""Panel of curved surfaces, coloured by H, K, normal velocity (with arrows for the flow along the surface), pressure, H0,
energy density or modes. One shape has the quantities side by side; of several results with one shape each, the results are
side by side; else there is one column per time. Quantities are then above each other."""

from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from . import flow, raster, style
from .colours import BAR_HEIGHT, SYMBOLS, Colours, colours_of, draw_bar
from .labels import wrapped
from .tubes import Column, ShapesPanel, check_quantities

RIM = 0.02  # inches around each surface


def node_areas(surface):
    """Approximate area of each value, for a colour scale."""
    a, b, c = (surface.points[:, corner] for corner in range(3))
    cell = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2 + 1e-300
    return np.broadcast_to(cell[:, None] / surface.H.shape[1], surface.H.shape)


def choose_colours(results, wanted):
    """Names of the quantities to colour by: the requested ones, else H of moving surfaces, H and K of others."""
    if not wanted:
        return ["H"] if all(result.moves for result in results) else ["H", "K"]
    check_quantities(results, attrgetter("surfaces"), wanted)
    return list(dict.fromkeys(wanted))


@dataclass
class Quantity:
    """The quantity that colours a surface: its values at the nodes and its colour map."""

    name: str
    symbol: str
    colours: Colours

    def at_nodes(self, surface, motion):
        values = surface.quantity(self.name)
        if self.name != "u_n":
            return values
        return values / (motion.scale("u_n", surface) or np.inf)  # at rest: white


def quantities(names, results, surfaces):
    """Scales of colours that all surfaces share; of the normal velocity relative to its largest value on each."""
    areas = [node_areas(surface).ravel() for surface in surfaces]
    found = []
    for name in names:
        if name == "u_n":
            u_n = SYMBOLS[name]
            label = f"normal velocity {u_n} / max |{u_n}| of the shape, > 0: outward"
            colours = Colours(flow.VELOCITY, Normalize(-1, 1), "neither", label)
        elif name.startswith("mode_"):
            number = name.removeprefix("mode_")
            colours = Colours(flow.VELOCITY, Normalize(-1, 1), "neither", f"normal displacement of mode {number}")
        else:
            colours = colours_of(name, results, surfaces, areas)
        found.append(Quantity(name, SYMBOLS.get(name, name.replace("_", " ")), colours))
    return found


class SurfacePanel(ShapesPanel):
    COLUMN_GAP, LABEL_WIDTH, SLACK = 0.14, 22, 0.6
    MAX_LENGTH = MAX_WIDTH = 2.7
    BAR = 1 / 3

    def __init__(self, results, labels, columns, names, camera=raster.CAMERA):
        self.view = raster.View(*camera)
        shown = [(row, surface) for column in columns for row, surface in enumerate(column.cells) if surface]
        self.quantities = quantities(names, results, [surface for _, surface in shown])
        motions = [flow.Motion(result.surfaces, result.unit("length/time"), result.scale("1/time")) for result in results]
        self.motions = {id(surface): motions[row] for row, surface in shown}
        self.velocity = "u_n" in names
        self.arrows = self.velocity and any(motions[row].largest("u_t", surface) for row, surface in shown)
        self.names_of_columns = None
        if len(columns) == 1 and len(results) > 1:
            (column,) = columns
            self.names_of_columns = [wrapped(label, self.LABEL_WIDTH) for label in labels]
            columns = [Column(column.time, [cell], [stop]) for cell, stop in zip(column.cells, column.stops)]
            results, labels = results[:1], [""]
        self.beside = len(columns) == 1  # H beside K, not above
        self.pictures, self.copies = (1, len(names)) if self.beside else (len(names), 1)
        super().__init__(results, labels, columns)
        if self.beside and not style.is_narrow():  # above their colour bars
            self.centres = style.WIDTH * np.array([left + width / 2 for left, width, _ in style.slots(len(names))])

    def _size(self, surface):
        low, high = self.view.extent(surface.points.reshape(-1, 3))
        return high - low

    def _title(self, index, column):
        if self.names_of_columns:
            return self.names_of_columns[index]
        return "" if self.beside and not column.time else super()._title(index, column)  # only the time zero: a shape without a time

    def scale_by_run(self):
        """Velocities are relative to the largest ones of their run, so that shapes can be compared over time."""
        for motion in self.motions.values():
            motion.by_run = True
        for quantity in self.quantities:
            quantity.colours.label = quantity.colours.label.replace("of the shape", "of the run")

    def _words(self, column, row):
        """Below the pictures of that row and column."""
        surface = column.cells[row]
        moving = [self.motions[id(surface)].words(surface)] if self.velocity and surface else []
        return "\n".join(words for words in (super()._words(column, row), *moving) if words)

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        axes = super().draw(figure, bottom)
        if self.pictures > 1:
            left = min(self.left + 0.1, self.centres[0] - self.widths[0] / 2) - 0.12
            for middle, quantity in zip(self.middles, self.quantities * len(self.labels)):
                axes.text(left, bottom + self.height - middle, quantity.symbol, ha="right", va="center", style="italic")

    def _samples(self, surface):
        """The surface as samples of the smallest picture that contains it: the quantities, then the velocity in the view."""
        per_pixel = self.scale * style.DPI  # pixels per unit of length
        low, high = self.view.extent(surface.points.reshape(-1, 3))
        wide, tall = (int(np.ceil(extent * per_pixel + 2 * RIM * style.DPI)) for extent in high - low)
        rim = (np.array([wide, tall]) / per_pixel - (high - low)) / 2
        fields = [quantity.at_nodes(surface, self.motions[id(surface)])[..., None] for quantity in self.quantities]
        if self.arrows:
            fields.append(surface.u @ self.view.axes)
        return raster.sample(
            surface.points, surface.normal, np.concatenate(fields, axis=-1), surface.order, surface.closed, self.view,
            (low[0] - rim[0], high[1] + rim[1]),
            per_pixel * raster.OVERSAMPLING, wide * raster.OVERSAMPLING, tall * raster.OVERSAMPLING,
        )  # fmt: skip

    def _draw_shape(self, axes, surface, row, places):
        samples, motion = self._samples(surface), self.motions[id(surface)]
        there = np.isfinite(samples.depth)
        tall, wide = (extent // raster.OVERSAMPLING for extent in samples.shape)
        for picture, ((x, y), quantity) in enumerate(zip(places, self.quantities)):
            image = raster.shaded(samples, quantity.colours.rgb(samples.values[there, picture]))
            # On whole pixels, so that nothing is drawn in between.
            left, low = round(x * style.DPI - wide / 2) / style.DPI, round(y * style.DPI - tall / 2) / style.DPI
            extent = (left, left + wide / style.DPI, low, low + tall / style.DPI)
            axes.imshow(image, extent=extent, interpolation="none", aspect="auto", zorder=2)
            u_t = motion.scale("u_t", surface) if quantity.name == "u_n" else 0
            if u_t:
                per_inch, velocity = style.DPI * raster.OVERSAMPLING, samples.values[:, len(self.quantities) :]
                flow.draw_surface_arrows(axes, samples, velocity, u_t, left, low + tall / style.DPI, per_inch)
        axes.set(xlim=(0, axes.figure.get_figwidth()), ylim=(0, axes.figure.get_figheight()))  # imshow changes them

    def bars(self):
        return len(self.quantities) + self.arrows

    def draw_colour_bars(self, figure, bottom):
        """A colour bar for each quantity, and what the arrows mean."""
        room = style.slots(self.bars())
        for (left, width, line), quantity in zip(room, self.quantities):
            colours = quantity.colours
            label = colours.label.split(" / ")[0] if len(room) > 2 and quantity.name == "u_n" else colours.label
            draw_bar(figure, bottom + line * BAR_HEIGHT, left, width, ScalarMappable(colours.norm, colours.map), label, colours.extend)
        if self.arrows:
            left, _, line = room[-1]
            u_t = flow.SYMBOLS["u_t"]
            by_run = next(iter(self.motions.values())).by_run
            words = f"{u_t} along the surface; this\nlong: max |{u_t}| of the {'run' if by_run else 'shape'}"
            flow.draw_arrow_key(figure, left, bottom + line * BAR_HEIGHT, words)
