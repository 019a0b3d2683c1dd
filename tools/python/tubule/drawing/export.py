"""Writes a shape of a result as flat triangles. See `tubule export --help`."""

import sys

from . import command_line, formats, triangles
from .results import Surface, read_frame


def triangles_of(shape, subdivide):
    """Points and corners of a Frame or a Surface of results.py."""
    if isinstance(shape, Surface):
        return triangles.of_surface(shape.points, shape.nodes["node"][shape.cells], shape.order, subdivide or shape.order, shape.period)
    return triangles.of_profile(shape.r, shape.z, shape.H, shape.K, subdivide or 4, shape.period)


def main(options):
    for path in options.output:
        command_line.check_output(path, formats.FORMATS, "triangles are")
    found = triangles_of(read_frame(options.result, options.frame), options.subdivide)
    for path in options.output:
        formats.write(path, *found)
        command_line.say(path, sys.stdout)
    return 0
