#!/usr/bin/python3
"""Draws results of tubule: profiles and surfaces at the output times, energies over time. See `tubule plot --help`."""

import argparse
import os
import sys
from operator import attrgetter

EXIT_BAD_INPUT, EXIT_UNAVAILABLE = 2, 4
DEBIAN_PACKAGES = {"numpy": "python3-numpy", "matplotlib": "python3-matplotlib", "h5py": "python3-h5py"}


def arguments():
    parser = argparse.ArgumentParser(prog="tubule plot", description=__doc__)
    parser.add_argument("results", nargs="+")
    parser.add_argument("-o", "--output", action="append", default=[])
    parser.add_argument("--times", default="")
    parser.add_argument("--kind", choices=("profiles", "surface", "energy", "all"), default="all")
    parser.add_argument("--term", action="append", default=[], help="NAME=LABEL of an energy term")
    return parser.parse_args()


def draw(paths, outputs, times, kind, term_labels):
    """Reads all, decides what can be drawn, lays the panels out from top to bottom and writes the pictures."""
    from matplotlib.figure import Figure

    import style
    from curves import CurvePanel
    from energy import EnergyPanel
    from labels import row_labels
    from results import BadInput, read_result
    from surfaces import SurfacePanel
    from tubes import TubePanel, choose_columns

    style.check_outputs(outputs)
    results = [read_result(path) for path in paths]
    names = [os.path.splitext(os.path.basename(path))[0] for path in paths]
    labels = row_labels([r.case for r in results], names if len(results) > 1 else [results[0].title])

    tubes = surfaces = energy = None
    profile_columns = choose_columns(results, times) if any(r.frames for r in results) else []
    if kind in ("profiles", "all") and profile_columns:
        shown_frames = [frame for column in profile_columns for frame in column.cells if frame]
        graphs = all(frame.is_graph and frame.u_t is None for frame in shown_frames)
        tubes = (TubePanel if graphs else CurvePanel)(results, labels, profile_columns)
    shown = [i for i, r in enumerate(results) if r.surfaces]
    surface_columns = choose_columns([results[i] for i in shown], times, attrgetter("surfaces")) if shown else []
    if kind in ("surface", "all") and surface_columns:
        surfaces = SurfacePanel([results[i] for i in shown], [labels[i] for i in shown], surface_columns)
    # A surface that was only looked at has one row, which is no curve; so has a single stationary shape.
    least = [2 if (r.surfaces or r.is_equilibrium) and kind == "all" else 1 for r in results]
    drawable = [i for i, r in enumerate(results) if r.has_energy(least[i])]
    if kind in ("energy", "all") and drawable:
        marked = [column.time for column in profile_columns or surface_columns if column.time is not None]
        energy = EnergyPanel([results[i] for i in drawable], [labels[i] for i in drawable], marked, term_labels)
    panels = [panel for panel in (tubes, surfaces, energy) if panel]
    if not panels:
        wanted = {
            "profiles": "no profiles",
            "surface": "no surfaces",
            "energy": "no energy series",
            "all": "neither frames nor an energy series",
        }
        raise BadInput(f"{', '.join(paths)}: {wanted[kind]} to draw")

    bars = 0.62
    title = 0.2 if len(results) == 1 else 0.0
    coloured = [panel for panel in (tubes, surfaces) if panel]
    tall = title + sum(panel.height for panel in panels) + bars * len(coloured) + 0.1
    figure = Figure(figsize=(style.WIDTH, tall))
    top = figure.get_figheight() - 0.05
    if title:
        figure.text(0.5, top / figure.get_figheight(), ", ".join(labels[0]), ha="center", va="top", fontsize=9)
        top -= title
    for letter, panel in zip("abc", panels):
        top -= panel.height
        panel.draw(figure, top)
        if len(panels) > 1:
            figure.text(0.01, (top + panel.height) / figure.get_figheight(), f"({letter})", va="top", fontsize=9)
        if panel in coloured:
            top -= bars
            panel.draw_colour_bars(figure, top + 0.08)
    style.save(figure, outputs)


def main():
    options = arguments()
    base = os.path.splitext(options.results[0])[0]
    outputs = options.output or [base + ".png", base + ".svg"]
    try:
        times = [float(time) for time in options.times.split(",") if time]
    except ValueError:
        print(f"tubule plot: --times: '{options.times}' is not a list of numbers t1,t2,...", file=sys.stderr)
        return EXIT_BAD_INPUT
    for module, package in DEBIAN_PACKAGES.items():
        try:
            __import__(module)
        except ImportError:
            print(f"tubule plot: {sys.executable} has no {module}; install the package {package}", file=sys.stderr)
            return EXIT_UNAVAILABLE
    # A result file never changes in place, so there is nothing to lock against; on some disks locks fail.
    os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")
    from results import BadInput

    try:
        draw(options.results, outputs, times, options.kind, dict(term.split("=", 1) for term in options.term))
    except BadInput as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    for path in outputs:
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
