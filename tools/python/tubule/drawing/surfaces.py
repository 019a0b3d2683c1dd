"""Panel of curved surfaces, coloured by H, K, normal velocity (with arrows for the flow along the surface), pressure, H0,
energy density or modes. One shape has the quantities side by side; of several results with one shape each, the results are
side by side; else there is one column per time. Quantities are then above each other."""

from dataclasses import replace
from operator import attrgetter

import numpy as np

from . import flow, raster, style
from .colours import colours_of, normal_velocity, relative_colours
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


def quantities(names, results, surfaces, of):
    """Names and colours, whose scales all surfaces share; of the normal velocity relative to its largest value, which is
    that `of` the run or the shape."""
    areas = [node_areas(surface).ravel() for surface in surfaces]
    for name in names:
        if name == "u_n":
            yield name, normal_velocity(of)
        elif name.startswith("mode_"):
            yield name, relative_colours(f"normal displacement of mode {name.removeprefix('mode_')}")
        else:
            yield name, colours_of(name, results, surfaces, areas)


class SurfacePanel(ShapesPanel):
    COLUMN_GAP, LABEL_WIDTH, SLACK = 0.14, 22, 0.6
    MAX_LENGTH = MAX_WIDTH = 2.7
    BAR = 1 / 3

    def __init__(self, results, labels, columns, names, camera=raster.CAMERA, by_run=False):
        self.view = raster.View(*camera)
        surfaces = [surface for column in columns for surface in column.cells if surface]
        of = "run" if by_run else "shape"
        self.quantities = dict(quantities(names, results, surfaces, of))
        if "u_n" in names:
            self.motions = flow.motions_of(results, attrgetter("surfaces"), by_run)
            if any(self.motions[id(surface)].largest("u_t", surface) for surface in surfaces):
                u_t = flow.SYMBOLS["u_t"]
                self.arrow = f"{u_t} along the surface; this\nlong: max |{u_t}| of the {of}"
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

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        axes = super().draw(figure, bottom)
        if self.pictures > 1:
            left = min(self.left + 0.1, self.centres[0] - self.widths[0] / 2) - 0.12
            for middle, name in zip(self.middles, [*self.quantities] * len(self.labels)):
                symbol = flow.SYMBOLS.get(name, name.replace("_", " "))
                axes.text(left, bottom + self.height - middle, symbol, ha="right", va="center", style="italic")

    def _samples(self, surface):
        """The surface as samples of the smallest picture that contains it: the quantities, then the velocity in the view."""
        per_pixel = self.scale * style.DPI  # pixels per unit of length
        low, high = self.view.extent(surface.points.reshape(-1, 3))
        wide, tall = (int(np.ceil(extent * per_pixel + 2 * RIM * style.DPI)) for extent in high - low)
        rim = (np.array([wide, tall]) / per_pixel - (high - low)) / 2
        motion = self.motions.get(id(surface))
        fields = [motion.relative(surface) if name == "u_n" else surface.quantity(name) for name in self.quantities]
        fields = [values[..., None] for values in fields]
        if self.arrow:
            fields.append(surface.u @ self.view.axes)
        return raster.sample(
            surface.points, surface.normal, np.concatenate(fields, axis=-1), surface.order, surface.closed, self.view,
            (low[0] - rim[0], high[1] + rim[1]),
            per_pixel * raster.OVERSAMPLING, wide * raster.OVERSAMPLING, tall * raster.OVERSAMPLING,
        )  # fmt: skip

    def _draw_shape(self, axes, surface, row, places):
        samples = self._samples(surface)
        there = np.isfinite(samples.depth)
        tall, wide = (extent // raster.OVERSAMPLING for extent in samples.shape)
        for picture, ((x, y), (name, colours)) in enumerate(zip(places, self.quantities.items())):
            image = raster.shaded(samples, colours.rgb(samples.values[there, picture]))
            # On whole pixels, so that nothing is drawn in between.
            left, low = round(x * style.DPI - wide / 2) / style.DPI, round(y * style.DPI - tall / 2) / style.DPI
            extent = (left, left + wide / style.DPI, low, low + tall / style.DPI)
            axes.imshow(image, extent=extent, interpolation="none", aspect="auto", zorder=2)
            if name == "u_n" and (u_t := self.motions[id(surface)].scale("u_t", surface)):
                per_inch, velocity = style.DPI * raster.OVERSAMPLING, samples.values[:, len(self.quantities) :]
                flow.draw_surface_arrows(axes, samples, velocity, u_t, left, low + tall / style.DPI, per_inch)
        axes.set(xlim=(0, axes.figure.get_figwidth()), ylim=(0, axes.figure.get_figheight()))  # imshow changes them

    def scales(self):
        shown = [*self.quantities.values()]
        if len(shown) + bool(self.arrow) > 2 and "u_n" in self.quantities:  # little room for words
            at = [*self.quantities].index("u_n")
            shown[at] = replace(shown[at], label=shown[at].label.split(" / ")[0])
        return shown
