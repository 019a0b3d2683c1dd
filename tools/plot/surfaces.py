"""Panel of curved surfaces: each shown twice, coloured by H and by K. Side by side where there is one time; else one
column a time, H above K."""

import numpy as np

import raster
from colours import curvature_colours, draw_bars
from labels import number, wrapped
from style import DPI, WIDTH, time_name, time_text
from tubes import caption

MAX_HEIGHT = 5.4  # inches of all rows together
MAX_SIZE = 2.7  # inches of one surface
GAP, HEADER, LABEL_WIDTH, RIM = 0.14, 0.24, 22, 0.02  # RIM: around each surface
SCALE_BAR = 0.35  # inches right of the last column


def _areas(surface):
    """Area that belongs to each value, near enough for a colour scale."""
    a, b, c = (surface.points[:, corner] for corner in range(3))
    cell = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2 + 1e-300
    return np.broadcast_to(cell[:, None] / surface.H.shape[1], surface.H.shape)


class _Size:
    """Extent of a surface in the plane of the view, in units of length; of none: nothing."""

    def __init__(self, surface, view):
        self.low, self.high = view.extent(surface.points.reshape(-1, 3)) if surface else (np.zeros(2), np.zeros(2))
        self.width, self.height = self.high - self.low


class SurfacePanel:
    """Sizes everything in inches first, so that the figure can be made to fit; then draws."""

    def __init__(self, results, labels, columns):
        self.columns, self.view = columns, raster.View()
        lone = len(results) == 1  # its label is the title of the picture
        self.labels = [""] if lone else [wrapped(label, LABEL_WIDTH) for label in labels]
        lines = [line for label in self.labels for line in label.split("\n")]
        left = 0.3 + 0.062 * max(map(len, lines))
        self.beside = len(columns) == 1  # H beside K, not above
        shown = [surface for column in columns for surface in column.cells if surface]
        self.H, self.K = curvature_colours(results, shown, [_areas(surface).ravel() for surface in shown])
        self.sizes = [[_Size(surface, self.view) for surface in column.cells] for column in columns]

        widths = [max(size.width for size in column) for column in self.sizes] * (2 if self.beside else 1)
        heights = [max(size.height for size in row) for row in zip(*self.sizes)]
        pictures = 1 if self.beside else 2  # above each other, of every result
        self.captions = [[caption(column, row) for column in columns] for row in range(len(results))]
        below = [max(0.16 * text.count("\n") + 0.14 * bool(text) for text in row) for row in self.captions]
        room_x = WIDTH - left - SCALE_BAR - GAP * len(widths)
        room_y = MAX_HEIGHT - sum(below) - pictures * GAP * len(results)
        biggest = max([*widths, *heights])
        self.scale = min(room_x / sum(widths), room_y / (pictures * sum(heights)), MAX_SIZE / biggest)

        pitch = [max(self.scale * width, 0.62) + GAP for width in widths]
        slack = np.clip((room_x + GAP * len(widths) - sum(pitch)) / len(widths), 0, 0.6)
        self.centres = left + np.cumsum([p + slack for p in pitch]) - np.array(pitch) / 2 - slack / 2
        if lone and self.beside:  # above their colour bars
            self.centres = np.array([0.29, 0.73]) * WIDTH
        elif lone:  # in the middle of the page
            ends = self.centres[0] - pitch[0] / 2, self.centres[-1] + pitch[-1] / 2
            self.centres += (WIDTH - SCALE_BAR - sum(ends)) / 2
        self.right = self.centres[-1] + self.scale * widths[-1] / 2
        self.left = min(left, self.centres[0] - self.scale * widths[0] / 2) - 0.12

        times = [column.time for column in columns]
        self.titles = ["last state" if t is None else f"{time_name(i)} = {time_text(t)}" for i, t in enumerate(times)]
        if self.beside and not columns[0].time:
            self.titles = [""]  # the only time there is, and zero: no more than a shape
        self.height, self.middles = HEADER if any(self.titles) else 0.08, []  # of each row of pictures, from the top
        for tall, caption_room in zip(heights, below):
            for picture in range(pictures):
                self.middles.append(self.height + self.scale * tall / 2)
                self.height += self.scale * tall + GAP
            self.height += caption_room
        self.pictures, self.heights = pictures, heights

    def draw(self, figure, bottom):
        """Draws into the figure with the panel's lower edge `bottom` inches above the figure's."""
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
        if not self.beside:
            for middle, letter in zip(self.middles, "HK" * len(self.labels)):
                axes.text(self.left, self.top - middle, letter, ha="right", va="center", style="italic")
        self._draw_scale_bar(axes)

    def _draw_surface(self, axes, surface, row, index):
        size = self.sizes[index][row]
        per_pixel = self.scale * DPI  # pixels a unit of length
        wide, tall = (int(np.ceil(extent * per_pixel + 2 * RIM * DPI)) for extent in (size.width, size.height))
        rim = (np.array([wide, tall]) / per_pixel - (size.width, size.height)) / 2
        samples = raster.sample(
            surface.points,
            surface.normal,
            np.stack([surface.H, surface.K], axis=-1),
            surface.order,
            surface.closed,
            self.view,
            (size.low[0] - rim[0], size.high[1] + rim[1]),
            per_pixel * raster.OVERSAMPLING,
            wide * raster.OVERSAMPLING,
            tall * raster.OVERSAMPLING,
        )
        there = np.isfinite(samples.depth)
        for picture, colours in enumerate((self.H, self.K)):
            x = self.centres[picture if self.beside else index]
            y = self.top - self.middles[row * self.pictures + (0 if self.beside else picture)]
            image = raster.shaded(samples, colours.rgb(samples.values[there, picture]))
            # On whole pixels, so that nothing is drawn in between.
            left, low = round(x * DPI - wide / 2) / DPI, round(y * DPI - tall / 2) / DPI
            axes.imshow(
                image,
                extent=(left, left + wide / DPI, low, low + tall / DPI),
                interpolation="none",
                aspect="auto",
                zorder=2,
            )
        words = self.captions[row][index]
        if words:
            below = y - self.scale * self.heights[row] / 2 - 0.05
            middle = self.centres.mean() if self.beside else x
            axes.text(middle, below, words, ha="center", va="top", fontsize=6.5, linespacing=1.1)
        axes.set(xlim=(0, axes.figure.get_figwidth()), ylim=(0, axes.figure.get_figheight()))  # imshow changes them

    def _draw_scale_bar(self, axes):
        longest = max(self.heights)
        bar = float(f"{longest / 3:.0e}")
        x, y = self.right + 0.14, self.top - self.middles[-1] - self.scale * self.heights[-1] / 2
        axes.plot([x, x], [y, y + self.scale * bar], color="0.1", linewidth=1.0, solid_capstyle="butt")
        axes.text(x + 0.05, y + self.scale * bar / 2, number(bar), ha="left", va="center", fontsize=7)

    def draw_colour_bars(self, figure, bottom):
        """Two colour bars in the 0.5 inches above `bottom`."""
        draw_bars(figure, bottom, self.H, self.K)
