"""Panel of curved surfaces, coloured by normal velocity (with arrows for the flow along the surface), H, K, pressure or modes.
With one time the quantities are side by side; else there is one column per time, with the quantities above each other."""

from dataclasses import dataclass

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from . import flow, raster, style
from .colours import Colours, curvature_colours, draw_bar, pressure_colours
from .results import BadInput
from .style import WIDTH
from .tubes import ShapesPanel

RIM = 0.02  # inches around each surface
SLOTS = {1: ((0.29, 0.42),), 2: ((0.12, 0.34), (0.56, 0.34))}  # left end and width of colour bars, parts of the page


def slots(count):
    """Height for this many colour bars side by side."""
    return SLOTS.get(count) or tuple((0.05 + 0.95 * i / count, 0.95 / count - 0.06) for i in range(count))


def node_areas(surface):
    """Approximate area of each value, for a colour scale."""
    a, b, c = (surface.points[:, corner] for corner in range(3))
    cell = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2 + 1e-300
    return np.broadcast_to(cell[:, None] / surface.H.shape[1], surface.H.shape)


def choose_colours(results, wanted):
    """Names of the quantities to colour by: the requested ones, else the normal velocity of moving surfaces, else H and K."""
    if not wanted:
        return ["u_n"] if all(result.moves for result in results) else ["H", "K"]
    for name in wanted:
        for result in results:
            if any(surface.quantity(name) is None for surface in result.surfaces):
                raise BadInput(f"{result.path}: not all of its frames have {name}")
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
    u_n = flow.SYMBOLS["u_n"]
    label = f"normal velocity {u_n} / max |{u_n}| of the shape, > 0: outward"
    found = {"u_n": Quantity("u_n", u_n, Colours(flow.VELOCITY, Normalize(-1, 1), "neither", label))}
    for name, colours in zip("HK", curvature_colours(results, surfaces, areas)):
        colours.label = colours.label.format("")
        found[name] = Quantity(name, name, colours)
    if "p" in names:
        found["p"] = Quantity("p", "p", pressure_colours([surface.p.ravel() for surface in surfaces], areas))
    for name in names:
        if name.startswith("mode_"):
            number = name.removeprefix("mode_")
            found[name] = Quantity(name, f"mode {number}", Colours(flow.VELOCITY, Normalize(-1, 1), "neither", f"normal displacement of mode {number}"))
    return [found[name] for name in names]


class SurfacePanel(ShapesPanel):
    COLUMN_GAP, LABEL_WIDTH, SLACK = 0.14, 22, 0.6
    MAX_LENGTH = MAX_WIDTH = 2.7
    BAR = 1 / 3

    def __init__(self, results, labels, columns, names):
        self.view = raster.View()
        shown = [(row, surface) for column in columns for row, surface in enumerate(column.cells) if surface]
        self.quantities = quantities(names, results, [surface for _, surface in shown])
        self.motions = [flow.Motion(result.surfaces) for result in results]
        self.velocity = "u_n" in names
        self.arrows = self.velocity and any(self.motions[row].largest("u_t", surface) for row, surface in shown)
        self.beside = len(columns) == 1  # H beside K, not above
        self.pictures, self.copies = (1, len(names)) if self.beside else (len(names), 1)
        super().__init__(results, labels, columns)
        if self.lone and self.beside:  # above their colour bars
            self.centres = WIDTH * np.array([left + width / 2 for left, width in slots(len(names))])

    def _size(self, surface):
        low, high = self.view.extent(surface.points.reshape(-1, 3))
        return high - low

    def _title(self, index, column):
        return "" if self.beside and not column.time else super()._title(index, column)  # only the time zero: a shape without a time

    def scale_by_run(self):
        """Velocities are relative to the largest ones of their run, so that shapes can be compared over time."""
        for motion in self.motions:
            motion.by_run = True
        for quantity in self.quantities:
            quantity.colours.label = quantity.colours.label.replace("of the shape", "of the run")

    def _words(self, column, row):
        """Below the pictures of that row and column."""
        surface = column.cells[row]
        moving = [self.motions[row].words(surface)] if self.velocity and surface else []
        return "\n".join(words for words in (super()._words(column, row), *moving) if words)

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        axes = super().draw(figure, bottom)
        if self.pictures > 1:
            left = min(self.left + 0.1, self.centres[0] - self.widths[0] / 2) - 0.12
            for middle, quantity in zip(self.middles, self.quantities * len(self.labels)):
                axes.text(left, bottom + self.height - middle, quantity.symbol, ha="right", va="center", style="italic")

    def _samples(self, surface, row):
        """The surface as samples of the smallest picture that contains it: the quantities, then the velocity in the view."""
        per_pixel = self.scale * style.DPI  # pixels per unit of length
        low, high = self.view.extent(surface.points.reshape(-1, 3))
        wide, tall = (int(np.ceil(extent * per_pixel + 2 * RIM * style.DPI)) for extent in high - low)
        rim = (np.array([wide, tall]) / per_pixel - (high - low)) / 2
        fields = [quantity.at_nodes(surface, self.motions[row])[..., None] for quantity in self.quantities]
        if self.arrows:
            fields.append(surface.u @ self.view.axes)
        return raster.sample(
            surface.points, surface.normal, np.concatenate(fields, axis=-1), surface.order, surface.closed, self.view,
            (low[0] - rim[0], high[1] + rim[1]),
            per_pixel * raster.OVERSAMPLING, wide * raster.OVERSAMPLING, tall * raster.OVERSAMPLING,
        )  # fmt: skip

    def _draw_shape(self, axes, surface, row, places):
        samples, motion = self._samples(surface, row), self.motions[row]
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

    def draw_colour_bars(self, figure, bottom):
        """A colour bar for each quantity, and what the arrows mean, in the 0.5 inches above `bottom`."""
        room = slots(len(self.quantities) + self.arrows)
        for (left, width), quantity in zip(room, self.quantities):
            colours = quantity.colours
            label = colours.label if len(room) < 3 or quantity.name == "p" else colours.label.split(" / ")[0]
            mappable = ScalarMappable(colours.norm, colours.map)
            draw_bar(figure, bottom, left, width, mappable, label, colours.extend)
        if self.arrows:
            u_t = flow.SYMBOLS["u_t"]
            words = f"{u_t} along the surface; this\nlong: max |{u_t}| of the {'run' if self.motions[0].by_run else 'shape'}"
            flow.draw_arrow_key(figure, room[-1][0], bottom, words)
