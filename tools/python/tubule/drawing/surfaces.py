"""Panel of curved surfaces, coloured by normal velocity (with arrows for the flow along the surface), H, K or pressure.
With one time the quantities are side by side; else there is one column per time, with the quantities above each other."""

from dataclasses import dataclass

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from . import flow, raster, style
from .colours import Colours, curvature_colours, draw_bar, pressure_colours
from .labels import wrapped
from .results import BadInput
from .style import WIDTH, draw_scale_bar, time_title
from .tubes import caption

MAX_HEIGHT = 5.4  # inches of all rows together
MAX_SIZE = 2.7  # inches of one surface
GAP, HEADER, LABEL_WIDTH, RIM = 0.14, 0.24, 22, 0.02  # RIM: around each surface
SCALE_BAR = 0.35  # inches right of the last column
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
            if any(getattr(surface, name) is None for surface in result.surfaces):
                raise BadInput(f"{result.path}: not all of its frames have {name}")
    return list(dict.fromkeys(wanted))


@dataclass
class Quantity:
    """The quantity that colours a surface: its values at the nodes and its colour map."""

    name: str
    symbol: str
    colours: Colours

    def at_nodes(self, surface, motion):
        values = getattr(surface, self.name)
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
    return [found[name] for name in names]


class SurfacePanel:
    """Sizes everything in inches first, so that the figure can be made to fit; then draws."""

    def __init__(self, results, labels, columns, names):
        self.columns, self.view = columns, raster.View()
        lone = len(results) == 1  # its label is the title of the picture
        self.labels = [""] if lone else [wrapped(label, LABEL_WIDTH) for label in labels]
        lines = [line for label in self.labels for line in label.split("\n")]
        left = 0.3 + 0.062 * max(map(len, lines))
        self.beside = len(columns) == 1  # H beside K, not above
        shown = [surface for column in columns for surface in column.cells if surface]
        self.quantities = quantities(names, results, shown)
        self.motions = [flow.Motion(result.surfaces) for result in results]
        self.velocity = "u_n" in names
        motions = [m for column in columns for m, surface in zip(self.motions, column.cells) if surface]
        self.arrows = self.velocity and any(motion.largest("u_t", surface) for motion, surface in zip(motions, shown))
        # Lower and upper ends of each surface in the plane of the view, [column, row, 2, 2]; of none: nothing.
        self.ends = np.array([[self.view.extent(s.points.reshape(-1, 3)) if s else np.zeros((2, 2)) for s in column.cells] for column in columns])
        sizes = np.diff(self.ends, axis=2)[:, :, 0]
        widths = list(sizes[..., 0].max(axis=1)) * (len(names) if self.beside else 1)
        heights = list(sizes[..., 1].max(axis=0))
        pictures = 1 if self.beside else len(names)  # above each other, for every result
        self.captions = [[self._words(column, row) for column in columns] for row in range(len(results))]
        below = [max(0.16 * text.count("\n") + 0.14 * bool(text) for text in row) for row in self.captions]
        room_x = WIDTH - left - SCALE_BAR - GAP * len(widths)
        room_y = MAX_HEIGHT - sum(below) - pictures * GAP * len(results)
        biggest = max([*widths, *heights])
        self.scale = min(room_x / sum(widths), room_y / (pictures * sum(heights)), MAX_SIZE / biggest)

        pitch = [max(self.scale * width, 0.62) + GAP for width in widths]
        slack = np.clip((room_x + GAP * len(widths) - sum(pitch)) / len(widths), 0, 0.6)
        self.centres = left + np.cumsum([p + slack for p in pitch]) - np.array(pitch) / 2 - slack / 2
        if lone and self.beside:  # above their colour bars
            self.centres = WIDTH * np.array([left + width / 2 for left, width in slots(len(names))])
        elif lone:  # in the middle of the page
            ends = self.centres[0] - pitch[0] / 2, self.centres[-1] + pitch[-1] / 2
            self.centres += (WIDTH - SCALE_BAR - sum(ends)) / 2
        else:  # in the middle of what is right of the labels
            self.centres += (room_x + GAP * len(widths) - sum(pitch) - slack * len(widths)) / 2
        self.right = self.centres[-1] + self.scale * widths[-1] / 2
        self.left = min(left, self.centres[0] - self.scale * widths[0] / 2) - 0.12

        self.titles = [time_title(i, column.time) for i, column in enumerate(columns)]
        if self.beside and not columns[0].time:
            self.titles = [""]  # only the time zero: a shape without a time
        self.height, self.middles = HEADER if any(self.titles) else 0.08, []  # of each row of pictures, from the top
        for tall, caption_room in zip(heights, below):
            for picture in range(pictures):
                self.middles.append(self.height + self.scale * tall / 2)
                self.height += self.scale * tall + GAP
            self.height += caption_room
        self.pictures, self.heights = pictures, heights

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
        return "\n".join(words for words in (caption(column, row), *moving) if words)

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        width, height = figure.get_size_inches()
        axes = figure.add_axes([0, 0, 1, 1])
        axes.set(xlim=(0, width), ylim=(0, height))
        axes.axis("off")
        self.top = bottom + self.height
        for index, column in enumerate(self.columns):
            middle = self.centres.mean() if self.beside else self.centres[index]
            axes.text(middle, self.top - 0.06, self.titles[index], ha="center", va="top")
            for row, surface in enumerate(column.cells):
                if surface:
                    self._draw_surface(axes, surface, row, index)
        for row, label in enumerate(self.labels):
            rows = self.middles[row * self.pictures : (row + 1) * self.pictures]
            axes.text(0.1, self.top - np.mean(rows), label, ha="left", va="center", linespacing=1.25)
        if not self.beside and len(self.quantities) > 1:
            for middle, quantity in zip(self.middles, self.quantities * len(self.labels)):
                axes.text(self.left, self.top - middle, quantity.symbol, ha="right", va="center", style="italic")
        low = self.top - self.middles[-1] - self.scale * self.heights[-1] / 2
        draw_scale_bar(axes, self.right + 0.14, low, max(self.heights) / 3, self.scale)

    def _samples(self, surface, row, ends):
        """The surface as samples of the smallest picture that contains it: the quantities, then the velocity in the view."""
        per_pixel = self.scale * style.DPI  # pixels per unit of length
        wide, tall = (int(np.ceil(extent * per_pixel + 2 * RIM * style.DPI)) for extent in ends[1] - ends[0])
        rim = (np.array([wide, tall]) / per_pixel - (ends[1] - ends[0])) / 2
        fields = [quantity.at_nodes(surface, self.motions[row])[..., None] for quantity in self.quantities]
        if self.arrows:
            fields.append(surface.u @ self.view.axes)
        return raster.sample(
            surface.points, surface.normal, np.concatenate(fields, axis=-1), surface.order, surface.closed, self.view,
            (ends[0][0] - rim[0], ends[1][1] + rim[1]),
            per_pixel * raster.OVERSAMPLING, wide * raster.OVERSAMPLING, tall * raster.OVERSAMPLING,
        )  # fmt: skip

    def _draw_surface(self, axes, surface, row, index):
        samples = self._samples(surface, row, self.ends[index, row])
        there = np.isfinite(samples.depth)
        tall, wide = (extent // raster.OVERSAMPLING for extent in samples.shape)
        for picture, quantity in enumerate(self.quantities):
            x = self.centres[picture if self.beside else index]
            y = self.top - self.middles[row * self.pictures + (0 if self.beside else picture)]
            image = raster.shaded(samples, quantity.colours.rgb(samples.values[there, picture]))
            # On whole pixels, so that nothing is drawn in between.
            left, low = round(x * style.DPI - wide / 2) / style.DPI, round(y * style.DPI - tall / 2) / style.DPI
            extent = (left, left + wide / style.DPI, low, low + tall / style.DPI)
            axes.imshow(image, extent=extent, interpolation="none", aspect="auto", zorder=2)
            motion = self.motions[row]
            u_t = motion.scale("u_t", surface) if quantity.name == "u_n" else 0
            if u_t:
                per_inch, velocity = style.DPI * raster.OVERSAMPLING, samples.values[:, len(self.quantities) :]
                flow.draw_surface_arrows(axes, samples, velocity, u_t, left, low + tall / style.DPI, per_inch)
        words = self.captions[row][index]
        if words:
            below = y - self.scale * self.heights[row] / 2 - 0.05
            middle = self.centres.mean() if self.beside else x
            axes.text(middle, below, words, ha="center", va="top", fontsize=6.5, linespacing=1.1)
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
