"""Draws a triangle mesh beside the initial shape that was made of it, both with the edges of their triangles.

rough_mesh.py MESH.off RESULT.hdf -o PICTURE
"""

import numpy as np
from matplotlib.figure import Figure

from . import command_line, raster, style
from .results import BadInput, read_result

SIDE, GAP, TITLE = 3.1, 0.2, 0.3  # inches of one picture, between both, above them
EDGE, DARKER = 0.035, 0.55  # part of the height of a triangle that its edges take; their brightness
COLOUR = np.array([0.78, 0.82, 0.87])


def read_off(path):
    """Corners [triangle, 3, 3] of a mesh of triangles. Raises BadInput."""
    try:
        with open(path) as file:
            words = file.read().split()
        vertices, faces = int(words[1]), int(words[2])
        points = np.array(words[4 : 4 + 3 * vertices], float).reshape(-1, 3)
        corners = np.array(words[4 + 3 * vertices :][: 4 * faces], int).reshape(-1, 4)
        return points[corners[:, 1:]]
    except (OSError, ValueError, IndexError) as error:
        raise BadInput(f"{path}: cannot be read as triangles in OFF: {error}")


def flat_normals(corners):
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.repeat(normal[:, None], 3, axis=1)


def picture(points, normals, order, view, low, high):
    """RGBA of the surface with the edges of its cells; `low` and `high` are the corners of the picture in the view."""
    scale = raster.OVERSAMPLING * style.DPI * SIDE / max(high - low)
    width, height = (raster.OVERSAMPLING * int(np.ceil(x * scale / raster.OVERSAMPLING)) for x in high - low)
    places = np.broadcast_to(raster.lattice(order) / order, points.shape)
    samples = raster.sample(points, normals, places, order, True, view, (low[0], high[1]), scale, width, height)
    on_edge = samples.values[np.isfinite(samples.depth)].min(axis=1) < EDGE
    return raster.shaded(samples, np.where(on_edge, DARKER, 1)[:, None] * COLOUR)


def draw(paths, outputs):
    corners, start = read_off(paths[0]), read_result(paths[1]).surfaces[0]
    view = raster.View()
    ends = np.array([view.extent(points.reshape(-1, 3)) for points in (corners, start.points)])
    margin = 0.01 * np.ptp(ends)
    low, high = ends[:, 0].min(axis=0) - margin, ends[:, 1].max(axis=0) + margin
    wide, tall = SIDE * (high - low) / max(high - low)
    figure = Figure(figsize=(style.WIDTH, tall + TITLE + 0.05))
    left = (style.WIDTH - 2 * wide - GAP) / 2
    shown = (
        (f"the file: {len(corners)} triangles", corners, flat_normals(corners), 1),
        (f"the initial shape: {len(start.points)} curved triangles", start.points, start.normal, start.order),
    )
    for column, (title, points, normals, order) in enumerate(shown):
        x = left + column * (wide + GAP)
        axes = figure.add_axes([x / style.WIDTH, 0.02, wide / style.WIDTH, tall / figure.get_figheight()])
        axes.imshow(picture(points, normals, order, view, low, high))
        axes.axis("off")
        figure.text((x + wide / 2) / style.WIDTH, 1 - 0.06 / figure.get_figheight(), title, ha="center", va="top")
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw, "paths", nargs=2)
