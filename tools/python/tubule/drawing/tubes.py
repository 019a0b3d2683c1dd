"""Panels of shapes: which frames they show, and their layout. Panel of tubes r(z): left halves coloured by H,
right ones by K, unless others are asked for."""

import re
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np
from matplotlib.collections import QuadMesh

from . import style
from .colours import bars_height, colours_of, draw_bars
from .labels import number, wrapped
from .results import BadInput
from .raster import shade
from .style import draw_scale_bar, time_text, time_title

MAX_COLUMNS, MAX_COLUMNS_NARROW = 6, 3
LEAST_SPREAD = 0.25  # part of the spread of frames over their numbers, the rest is over changes of the energy
MAX_HEIGHT = 5.6  # inches of all rows together
MAX_TUBE_WIDTH = 1.5  # inches
ROW_GAP, HEADER = 0.14, 0.24
SCALE_BAR = 0.3  # inches right of the last column
STRIPS = 40  # across half a tube
MIN_POINTS, POINTS_PER_INCH = 300, 150  # along a tube


@dataclass
class Column:
    time: float | None  # None: the last state of runs that ended before the first common time or after the last
    cells: list  # a Frame or None for each result
    stops: list  # why the run ended with this frame, or None


def same_time(a, b, span):
    return abs(a - b) <= 1e-6 * abs(b) + 1e-12 * span


def check_quantities(results, frames_of, names):
    """Raises BadInput if frames lack one of these."""
    for name in names:
        for result in results:
            if any(frame.quantity(name) is None for frame in frames_of(result)):
                why = ", which those have where it varies" if name == "H0" else ""
                raise BadInput(f"{result.path}: not all of its frames have {name}{why}")


def spread_over_change(times, results, count):
    """Numbers of so many of the times, the first and the last among them, between which the energies change about equally."""
    place = LEAST_SPREAD * np.linspace(0, 1, len(times))
    for result in results:
        if result.has_energy(2):
            change = np.concatenate([[0], np.cumsum(np.abs(np.diff(result.series["energy"])))])
            place = place + np.interp(times, result.series["time"], change) / (change[-1] or 1.0) / len(results)
    picks = {0, len(times) - 1}
    while len(picks) < count:  # the one that is farthest from those chosen
        picks.add(int(np.abs(place[:, None] - place[list(picks)]).min(axis=1).argmax()))
    return sorted(picks)


def choose_columns(results, times=None, frames_of=attrgetter("frames")):
    """Columns of frames at the wanted times (infinity: the last ones), else at up to six of the available times, between which
    the energies change equally.

    Times that all results have go before others. Of several results, the last frame of one that did not get
    to its end is no common time: it stands, with the reason, in the first later column.
    """
    span = max(result.end_time for result in results)
    lone = len(results) == 1

    def is_stop(result, frame):
        return result.stopped_early is not None and frame.time >= result.last_shape_time

    def has(result, time):
        """The frame at that time, or None because the run had stopped."""
        ended = result.stopped_early is not None and result.end_time < time
        return ended or any(same_time(frame.time, time, span) for frame in frames_of(result))

    candidates = []
    for time in sorted(f.time for r in results for f in frames_of(r) if lone or not is_stop(r, f)):
        if not candidates or not same_time(time, candidates[-1], span):
            candidates.append(time)
    shared = [time for time in candidates if all(has(result, time) for result in results)]
    if len(shared) > 2:
        candidates = shared
    with_end = times is not None and np.inf in times
    times = [time for time in times or [] if time < np.inf]
    if times or with_end:
        available = sorted({f.time for r in results for f in frames_of(r)})
        for time in times:
            if not any(same_time(time, other, span) for other in available):
                unit = results[0].scale("time")  # asked for are times of the files
                known = ", ".join(time_text(t / unit) for t in available[:12]) + (", ..." if len(available) > 12 else "")
                raise BadInput(f"--times: no result has a frame at t = {number(time / unit)}; there are frames at {known}")
        candidates = sorted(set(times))
    elif len(candidates) > (most := MAX_COLUMNS_NARROW if style.is_narrow() else MAX_COLUMNS):
        candidates = [candidates[i] for i in spread_over_change(candidates, results, most)]

    columns = [Column(time, [None] * len(results), [None] * len(results)) for time in candidates]
    last = Column(None, [None] * len(results), [None] * len(results))
    for row, result in enumerate(results):
        for frame in frames_of(result):
            column = next((c for c in columns if same_time(frame.time, c.time, span)), None)
            if column is None and is_stop(result, frame) and not times and not with_end:
                column = next((c for c in columns if c.time > frame.time), last)
            if column:
                column.cells[row] = frame
                column.stops[row] = result.stopped_early if is_stop(result, frame) else None
        if with_end:
            end = frames_of(result)[-1:]
            last.cells[row], last.stops[row] = (end or [None])[0], result.stopped_early if end else None
    return columns + ([last] if any(last.cells) else [])


def caption(column, row, result):
    """Why the run of a row ended with the frame in this column, and when unless the column's header says it, or
    frames have numbers in place of times."""
    stop, frame = column.stops[row], column.cells[row]
    time = time_text(frame.time, result.unit("time")) if frame else ""
    if not stop:
        return f"t = {time}" if frame and column.time is None and not result.is_equilibrium else ""
    shown = column.time is not None and same_time(frame.time, column.time, frame.time)
    return stop if shown or result.is_equilibrium else f"{stop}\nt = {time}"


def ring_areas(frame):
    """Area of each value of a profile, up to a common factor."""
    return np.abs(frame.r) * np.hypot(np.gradient(frame.r), np.gradient(frame.z)) + 1e-300


class ShapesPanel:
    """A row of shapes for each result, a column for each time, bars of their colours below. Sizes everything in inches
    first, so that the figure can be made to fit; then draws. What a shape covers, how it is drawn, by which scales() of
    colours, and what is written below it is defined by derived classes."""

    MARGIN = 0.0  # inches of margin around a shape
    COLUMN_GAP, LABEL_WIDTH, SLACK = 0.14, 16, 0.5
    MAX_LENGTH, MAX_WIDTH = MAX_HEIGHT, MAX_TUBE_WIDTH  # inches of the largest shape
    BAR = 1 / 2  # of the longest shape
    pictures, copies = 1, 1  # of each shape: above each other, beside each other
    motions = {}  # by the id of a shape, where its velocity is shown
    arrow = ""  # what the longest arrow means, if there are any

    def __init__(self, results, labels, columns):
        self.results, self.columns = results, columns
        self.lone = len(results) == 1  # its label is the title of the picture
        self.labels = [""] if self.lone else [wrapped(label, self.LABEL_WIDTH) for label in labels]
        self.shapes = [shape for column in columns for shape in column.cells if shape]
        self.left = (0.45 if self.pictures > 1 else 0.2) + 0.062 * max(len(line) for label in self.labels for line in label.split("\n"))
        self.titles = [self._title(index, column) for index, column in enumerate(columns)]
        self.captions = [["\n".join(filter(None, self._words(column, row))) for column in columns]
                         for row in range(len(results))]  # fmt: skip
        below = [max(0.16 * text.count("\n") + 0.14 * bool(text) for text in row) for row in self.captions]

        sizes = np.array([[self._size(shape) if shape else (0, 0) for shape in column.cells] for column in columns])
        widths, self.lengths = np.repeat(sizes[..., 0].max(axis=1), self.copies), sizes[..., 1].max(axis=0)
        gap = self.COLUMN_GAP + 2 * self.MARGIN
        room_x = style.WIDTH - self.left - SCALE_BAR - 0.1 - gap * len(widths)
        room_y = MAX_HEIGHT - sum(below) - self.pictures * (ROW_GAP + 2 * self.MARGIN) * len(results)
        self.scale = min(
            room_x / sum(widths),
            room_y / (self.pictures * sum(self.lengths)),
            self.MAX_WIDTH / max(widths),
            self.MAX_LENGTH / max(self.lengths),
        )
        self.widths = self.scale * widths
        self._place_columns(room_x, gap)
        self._place_rows(below)

    def _place_columns(self, room, gap):
        least = np.maximum(self.widths, 0.62)  # a column's title needs room even where the shape is small
        pitch = least * min(1, room / sum(least)) + gap
        spare = room + gap * len(pitch) - sum(pitch)
        slack = min(spare / len(pitch), self.SLACK)
        self.centres = self.left + np.cumsum(pitch + slack) - pitch / 2 - slack / 2
        if self.lone:
            occupied = self.centres[0] - self.widths[0] / 2, self.centres[-1] + self.widths[-1] / 2
            self.centres += max(style.WIDTH - SCALE_BAR - sum(occupied), 2 * (self.left - occupied[0])) / 2
        else:  # in the middle of what is right of the labels
            self.centres += (spare - slack * len(pitch)) / 2

    def _place_rows(self, below):
        self.height, self.middles = HEADER if any(self.titles) else 0.08, []  # of each row of pictures, from the top
        for length, label, caption_room in zip(self.lengths, self.labels, below):
            tall = max(self.scale * length + 2 * self.MARGIN, 0.14 * (label.count("\n") + 1) / self.pictures)
            for _ in range(self.pictures):
                self.middles.append(self.height + tall / 2)
                self.height += tall + ROW_GAP
            self.height += caption_room
        self.height += bars_height(len(self.scales()) + bool(self.arrow))

    def _title(self, index, column):
        if column.time is not None and all(result.is_equilibrium for result in self.results):
            return f"shape {number(column.time)}" if len(self.columns) > 1 else ""
        return time_title(index, column.time, self.results[0].unit("time"))

    def _words(self, column, row):
        """Below the shape of that row and column."""
        shape = column.cells[row]
        moves = self.motions and shape and shape.u_n is not None
        return [caption(column, row, self.results[row]), self.motions[id(shape)].words(shape) if moves else ""]

    def draw(self, figure, bottom):
        """Draws the panel with its lower edge `bottom` inches above that of the figure."""
        axes = figure.add_axes([0, 0, 1, 1])
        axes.set(xlim=(0, figure.get_figwidth()), ylim=(0, figure.get_figheight()))
        axes.axis("off")
        top = bottom + self.height
        for index, column in enumerate(self.columns):
            xs = self.centres[index * self.copies : (index + 1) * self.copies]
            axes.text(np.mean(xs), top - 0.06, self.titles[index], ha="center", va="top")
            for row, shape in enumerate(column.cells):
                ys = [top - middle for middle in self.middles[row * self.pictures : (row + 1) * self.pictures]]
                if shape:
                    self._draw_shape(axes, shape, row, [(x, y) for y in ys for x in xs])
                if self.captions[row][index]:
                    below = ys[-1] - self.scale * self.lengths[row] / 2 - self.MARGIN - 0.07
                    axes.text(np.mean(xs), below, self.captions[row][index], ha="center", va="top", fontsize=6.5, linespacing=1.1)
        for row, label in enumerate(self.labels):
            y = top - np.mean(self.middles[row * self.pictures : (row + 1) * self.pictures])
            axes.text(0.1, y, label, ha="left", va="center", linespacing=1.25)
        right = self.centres[-1] + self.widths[-1] / 2 + self.MARGIN
        low = top - self.middles[-1] - self.scale * self.lengths[-1] / 2
        draw_scale_bar(axes, right + 0.14, low, self.BAR * max(self.lengths), self.scale, self.results[0].unit("length"))
        draw_bars(figure, bottom + 0.08, self.scales(), self.arrow)
        return axes


class ProfilePanel(ShapesPanel):
    """Profiles, coloured by a quantity on the left and another or the same on the right."""

    def __init__(self, results, labels, columns, names):
        if len(names) > 2:
            raise BadInput("--colour: a profile has two halves, and at most as many colours")
        self.names, frames = names, [frame for column in columns for frame in column.cells if frame]
        areas = [ring_areas(frame) for frame in frames]
        self.colours = self._choose_colours(results, frames, areas)
        super().__init__(results, labels, columns)

    def _size(self, frame):
        return 2 * frame.r.max(), frame.length

    def _choose_colours(self, results, frames, areas):
        return [colours_of(name, results, frames, areas) for name in self.names]

    def _halves(self, frame):
        """Side, values and colours of the left and the right half."""
        return [(side, frame.quantity(self.names[k]), self.colours[k]) for side, k in ((-1, 0), (1, -1))]

    def _draw_axis(self, axes, frame, x, y):
        reach = 0.5 * self.scale * frame.length + max(0.05, self.MARGIN)
        axes.plot([x, x], [y - reach, y + reach], color="0.1", linewidth=0.4, dashes=(12, 3, 2, 3), zorder=2)

    def scales(self):
        if len(self.names) < 2:
            return self.colours
        # The name, where it is drawn, what is white.
        parts = zip(self.colours, ("left", "right"))
        return [replace(c, label=re.sub("(,|$)", rf" ({side} halves)\1", c.label, count=1)) for c, side in parts]


class TubePanel(ProfilePanel):
    """Draws tubes r(z) as shaded bodies."""

    def _draw_shape(self, axes, frame, row, places):
        ((x, y),) = places
        points = max(MIN_POINTS, int(POINTS_PER_INCH * self.scale * frame.length))
        place = np.linspace(0, frame.z.size - 1, points)  # as dense as the samples of the frame

        def sampled(values):
            return np.interp(place, np.arange(frame.z.size), values)

        r = self.scale * sampled(frame.r)
        z = self.scale * sampled(frame.z - (frame.z.min() + frame.z.max()) / 2) + y
        # Strips of equal angle around the axis.
        s = np.sin(np.linspace(0, np.pi / 2, STRIPS + 1))
        middle = (s[1:] + s[:-1]) / 2
        towards_eye = np.cos(np.arctan2(np.diff(r), np.diff(z)))[:, None] * np.sqrt(1 - middle**2)
        dim = shade(towards_eye)[..., None]
        for side, values, colours in self._halves(frame):
            values = sampled(values)
            rgb = colours.rgb((values[1:] + values[:-1]) / 2)[:, None] * dim
            corners = np.stack([x + side * r[:, None] * s, np.broadcast_to(z[:, None], (z.size, s.size))], axis=-1)
            mesh = QuadMesh(corners, antialiased=False, rasterized=True, linewidth=0, zorder=1)
            mesh.set_facecolor(rgb.reshape(-1, 3))
            axes.add_collection(mesh, autolim=False)
            axes.plot(x + side * r, z, color="0.1", linewidth=0.7, solid_capstyle="butt", zorder=3)
        self._draw_axis(axes, frame, x, y)
