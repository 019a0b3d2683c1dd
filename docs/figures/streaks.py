"""The flow on a moving surface as streaks (line integral convolution of noise along the tangential velocity, in the picture), on
the colours of the normal velocity at one scale: streaks.py RESULT -o PICTURE."""

import numpy as np
from matplotlib.figure import Figure

from . import command_line, flow, raster, style
from .colours import colours_of, draw_bars
from .results import read_result, tangential
from .surfaces import node_areas

TIMES = 0.005, 0.02, 0.05, 0.2
RIM, HEAD, FOOT = 0.05, 0.24, 0.75  # inches: beside each surface, above and below the row
REACH = 26  # samples that a streak extends to either side
CONTRAST = 0.32


def convolved(samples, velocity, seed=1):
    """For each sample the mean of noise along the stream line through it, with mean 0 and deviation 1; 0 beside the surface."""
    height, width = samples.shape
    there = np.isfinite(samples.depth)
    way = tangential(velocity, np.where(there[:, None], samples.normal, [0, 0, 1]))[:, :2] * [1, -1]
    way = np.where(there[:, None], way, 0) / (np.linalg.norm(way, axis=1, keepdims=True) + 1e-300)
    noise = np.random.default_rng(seed).standard_normal(height * width)
    row, column = np.divmod(np.flatnonzero(there), width)
    total, count = np.zeros(row.size), np.zeros(row.size)
    for sign in (1, -1):
        x, y = column + 0.5, row + 0.5
        going = np.ones(row.size, bool)
        for _ in range(REACH):
            place = np.clip(y.astype(int), 0, height - 1) * width + np.clip(x.astype(int), 0, width - 1)
            going &= there[place]
            total += noise[place] * going
            count += going
            x, y = x + sign * way[place, 0], y + sign * way[place, 1]
    mean = total / np.maximum(count, 1)
    out = np.zeros(height * width)
    out[there] = (mean - mean.mean()) / mean.std()
    return out


def draw(path, outputs):
    result = read_result(path)
    shapes = [min(result.surfaces, key=lambda surface: abs(surface.time - time)) for time in TIMES]
    colours = colours_of("u_n", [result], shapes, [node_areas(surface).ravel() for surface in shapes])
    view, motion = raster.View(), flow.Motion(result.surfaces)
    ends = [view.extent(surface.points.reshape(-1, 3)) for surface in shapes]
    low, high = np.min([end[0] for end in ends], axis=0), np.max([end[1] for end in ends], axis=0)
    room = style.WIDTH / len(shapes) - 2 * RIM
    scale = room / (high - low)[0]
    tall = scale * (high - low)[1]
    figure = Figure(figsize=(style.WIDTH, HEAD + tall + FOOT + 0.2))
    per_inch = style.DPI * raster.OVERSAMPLING
    wide, high_pixels = (int(np.ceil(inches * style.DPI)) for inches in (room, tall))
    for k, surface in enumerate(shapes):
        fields = np.concatenate([surface.u_n[..., None], surface.u @ view.axes], axis=-1)
        samples = raster.sample(surface.points, surface.normal, fields, surface.order, surface.closed, view, (low[0], high[1]),
                                scale * per_inch, wide * raster.OVERSAMPLING, high_pixels * raster.OVERSAMPLING)  # fmt: skip
        there = np.isfinite(samples.depth)
        streaks = convolved(samples, samples.values[:, 1:])[there, None]
        rgb = np.clip(colours.rgb(samples.values[there, 0]) * (1 - CONTRAST / 2 + CONTRAST / 4 * np.clip(streaks, -2, 2)), 0, 1)
        axes = style.axes_at(figure, RIM + k * style.WIDTH / len(shapes), FOOT + 0.2, wide / style.DPI, high_pixels / style.DPI)
        axes.axis("off")
        axes.imshow(raster.shaded(samples, rgb), interpolation="none", aspect="auto")
        middle = (k + 0.5) / len(shapes)
        figure.text(middle, 1 - 0.06 / figure.get_figheight(), f"t = {style.time_text(surface.time)}", ha="center", va="top")
        figure.text(middle, (FOOT + 0.05) / figure.get_figheight(), motion.words(surface).replace("\n", ", "), ha="center", fontsize=6.5)
    draw_bars(figure, 0.05, [colours])
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw, "result")


if __name__ == "__main__":
    main()
