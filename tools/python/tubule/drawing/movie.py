"""A film of one result: the shape at its frames, and the energy beside it. Camera, size and colour scale stay the same."""

import os
import shutil
import subprocess
import sys
import time

import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.figure import Figure

from . import raster
from .colours import colours_of, draw_bar
from .command_line import Unavailable, check_output, say
from .labels import in_unit
from .results import BadInput, Surface
from .style import draw_scale_bar, few_ticks, line_colours, time_text
from .surfaces import node_areas
from .tubes import ring_areas

SIZE, DPI = (8.0, 4.5), 100  # inches; pixels per inch: 800 x 450, even as codecs want them
BOX = 0.35, 0.75, 4.1, 3.45  # of the shape: left, bottom, width, height in inches
AROUND, ALONG = 72, 240  # pieces of a profile that is turned around the axis
FORMATS = (".mp4", ".gif")
SAY_EVERY = 5.0  # seconds between lines about the progress, off a terminal


def as_surface(frame, name):
    """The frame; the surface of revolution of a profile with this field: flat triangles with the normals of the profile."""
    if isinstance(frame, Surface):
        return frame
    values = frame.quantity(name)
    step = np.hypot(np.diff(frame.r), np.diff(frame.z))
    along = np.concatenate([[0], np.cumsum(step)])
    places = np.linspace(0, along[-1], ALONG + 1)
    r, z, v = (np.interp(places, along, array) for array in (frame.r, frame.z, values))
    way = np.column_stack([np.gradient(z), -np.gradient(r)])  # outward is to the right of the profile
    way /= np.linalg.norm(way, axis=1, keepdims=True) + 1e-300
    angle = np.linspace(0, 2 * np.pi, AROUND + 1)
    node = np.arange(r.size * angle.size).reshape(r.size, angle.size)
    a, b, c, d = node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]
    cells = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)

    def turned(radial, axial):
        """Vectors at the nodes of the cells."""
        around = np.stack([np.outer(radial, np.cos(angle)), np.outer(radial, np.sin(angle)),
                           np.outer(axial, np.ones(angle.size))], axis=-1)  # fmt: skip
        return around.reshape(-1, 3)[cells]

    poles = max(frame.r[0], frame.r[-1]) < 1e-6 * frame.r.max()
    ring = np.hypot(frame.r[0] - frame.r[-1], frame.z[0] - frame.z[-1]) < 1e-6 * frame.r.max()  # a torus
    there = np.repeat(v, angle.size)[cells]
    return Surface(frame.time, 1, bool(poles or ring), turned(r, z), turned(*way.T), **{"H": there, "K": there, name: there})


def shared_colours(result, frames, name):
    """One scale for all frames."""
    if any(frame.quantity(name) is None for frame in frames):
        raise BadInput(f"--colour: not all frames have {name}")
    areas = [(node_areas if isinstance(frame, Surface) else ring_areas)(frame).ravel() for frame in frames]
    return colours_of(name, [result], frames, areas)


class Stage:
    """The page on which one frame after the other is drawn."""

    def __init__(self, result, frames, name, title, camera=raster.CAMERA):
        self.result, self.frames, self.quantity = result, frames, name
        self.colours = shared_colours(result, frames, name)
        self.view = raster.View(*camera)
        ends = [self.view.extent(as_surface(frame, "H").points.reshape(-1, 3)) for frame in frames]
        self.low, self.high = np.min([low for low, _ in ends], axis=0), np.max([high for _, high in ends], axis=0)
        self.scale = min(np.array(BOX[2:]) / (self.high - self.low))  # inches per unit of length
        self.figure = Figure(figsize=SIZE)
        self.figure.text(0.5, 0.985, title, ha="center", va="top", fontsize=10)
        self._draw_shape_axes()
        self._draw_energy()

    def _draw_shape_axes(self):
        draw_bar(self.figure, 0.1, (0.06, 0.44, 0), self.colours)
        axes = self.figure.add_axes([0, 0, 1, 1])
        axes.set(xlim=(0, SIZE[0]), ylim=(0, SIZE[1]))
        axes.axis("off")
        centre = np.array(BOX[:2]) + np.array(BOX[2:]) / 2
        size = self.scale * (self.high - self.low)
        left, bottom = np.round((centre - size / 2) * DPI) / DPI
        self.pixels = np.ceil(size * DPI).astype(int)  # width, height
        extent = left, left + self.pixels[0] / DPI, bottom, bottom + self.pixels[1] / DPI
        self.image = axes.imshow(np.zeros((2, 2, 4), np.uint8), extent=extent, interpolation="none", aspect="auto")
        axes.set(xlim=(0, SIZE[0]), ylim=(0, SIZE[1]))  # imshow changes them
        draw_scale_bar(axes, BOX[0] + BOX[2] + 0.05, BOX[1], (self.high - self.low)[1] / 3, self.scale, self.result.unit("length"))
        self.words = axes.text(BOX[0], SIZE[1] - 0.45, "", va="top", fontsize=9)

    def _x(self, frame):
        """What the energy is drawn against: time, or the parameter of a branch."""
        return frame.time if frame.parameter is None else frame.parameter

    def _draw_energy(self):
        parameter = self.frames[0].parameter is not None
        series = self.result.series
        self.dot, key = None, "parameter" if parameter and "parameter" in series else "time"
        self.name = self.result.parameter_name if parameter else "t"
        if "energy" not in series or len(series["energy"]) < 2:
            return
        axes = self.figure.add_axes([0.66, 0.17, 0.31, 0.68])
        # One line a branch.
        ends = np.flatnonzero(np.diff(series.get("branch", series["energy"] * 0))) + 1
        for x, y in zip(np.split(series[key], ends), np.split(series["energy"], ends)):
            axes.plot(x, y, color=line_colours(1)[0])
        few_ticks(axes.xaxis, 2.4, 0.6)  # numbers of small times are long
        x = in_unit(self.name, self.result.parameter_unit) if parameter else in_unit("time t", self.result.unit("time"))
        axes.set(xlabel=x, ylabel=in_unit("energy E", self.result.unit("energy")))
        (self.dot,) = axes.plot([], [], "o", color="C3", markersize=6)
        self.energy = np.asarray(series[key]), np.asarray(series["energy"])

    def draw(self, index):
        frame = self.frames[index]
        shape = as_surface(frame, self.quantity)
        width, height = self.pixels
        per_unit = self.scale * DPI * raster.OVERSAMPLING
        samples = raster.sample(
            shape.points, shape.normal, shape.quantity(self.quantity)[..., None], shape.order, shape.closed, self.view,
            (self.low[0], self.high[1]), per_unit, width * raster.OVERSAMPLING, height * raster.OVERSAMPLING,
        )  # fmt: skip
        there = np.isfinite(samples.depth)
        self.image.set_data(raster.shaded(samples, self.colours.rgb(samples.values[there, 0])))
        unit = self.result.unit("time") if frame.parameter is None else self.result.parameter_unit
        self.words.set_text(f"{self.name} = {time_text(self._x(frame), unit)}")
        if self.dot:
            x, energy = self.energy
            nearest = int(np.argmin(np.abs(x - self._x(frame))))
            self.dot.set_data([x[nearest]], [energy[nearest]])


class Progress:
    """On a terminal a line that changes, elsewhere a line now and then."""

    def __init__(self, count):
        self.count, self.last, self.live = count, time.monotonic(), sys.stderr.isatty()

    def __call__(self, done):
        if self.live:
            end = "\n" if done == self.count else ""
            print(f"\rframe {done} of {self.count}", end=end, file=sys.stderr, flush=True)
        elif time.monotonic() - self.last > SAY_EVERY:
            say(f"frame {done} of {self.count}")
            self.last = time.monotonic()


def writer_for(path, fps):
    check_output(path, FORMATS, "a film is")
    if path.lower().endswith(".gif"):
        return PillowWriter(fps=fps)
    if not shutil.which("ffmpeg"):
        raise Unavailable(f"{path}: needs ffmpeg; install the package ffmpeg, or write a .gif")
    return FFMpegWriter(fps=fps, codec="h264", extra_args=["-pix_fmt", "yuv420p", "-crf", "20"])


def draw(result, frames, path, name, title, fps, camera):
    """Writes the film of these frames of a result, coloured by a quantity; a file of that name is replaced at the end."""
    writer = writer_for(path, fps)
    if len(frames) < 2:
        raise BadInput(f"{result.path}: has {len(frames)} frames; a film needs two or more (time.output in the case)")
    stage, progress = Stage(result, frames, name, title, camera), Progress(len(frames))
    base, ending = os.path.splitext(path)
    part = f"{base}.part{ending}"
    try:
        with writer.saving(stage.figure, part, DPI):
            for index in range(len(frames)):
                stage.draw(index)
                writer.grab_frame()
                progress(index + 1)
        os.replace(part, path)
    except subprocess.CalledProcessError as error:
        if isinstance(error.__context__, KeyboardInterrupt):  # Ctrl-C reaches ffmpeg, too
            raise error.__context__
        raise Unavailable(f"{path}: ffmpeg failed: {(error.stderr or error.output or '').strip()[-200:]}") from error
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error}") from error
    finally:
        if os.path.exists(part):
            os.remove(part)
