"""Pictures of results: what `tubule plot` draws, as figures of matplotlib."""

from __future__ import annotations

import os
import re
import reprlib
from collections.abc import Iterable
from contextlib import contextmanager

from .cases import case_with_units, file_name
from .commands import Scan
from .results import Result, read


def draw(what, output: str | os.PathLike | Iterable[str | os.PathLike] | None = None, *, kind: str = "all",
         times: Iterable[float] = (), colour: Iterable[str] = (), labels: Iterable[str] = (), plane: tuple[str, float] = ("z", 0.0),
         scale: str = "run", series: Iterable[str] = (), x: str = "time", logx: bool = False, logy: bool = False,
         quantity: str = "", slices: Iterable[str] = (), camera: tuple[float, float] = (-37.0, 22.0), width: float = 7.0, dpi: float = 300,
         units: str = ""):  # fmt: skip
    """The picture that `tubule plot` makes, as a matplotlib.figure.Figure. Needs the packages matplotlib and h5py.

    what      a Result, several ones (labelled by what differs in their cases), or names of result files; a Scan that
              was run with an output, or the name of its file
    output    also writes it: .png, .svg or .pdf, or several of them
    kind      "profiles", "surface", "cuts", "energy", "balance", "all", or several as in "surface,energy"
    times     of the frames to show; infinity stands for the last one
    colour    of shapes: "H", "K", "u_n", "p", "H0", "energy_density"
    series    draws these series against the series x, and nothing else
    quantity, slices    of a scan: what its map shows; KEY=VALUE of axes that are cut
    camera    azimuth and elevation in degrees
    width     inches of the page, 3 to 20
    dpi       pixels per inch, 30 to 1200
    units     keys of [units], as "length=50 nm,bending_rigidity=20 kT", or "none"; by default those of the case
    The others are as the options of `tubule plot`. Raises ValueError for what cannot be drawn.

    >>> figure = draw(tubule.run(tube), kind="energy")
    >>> figure.get_size_inches()[0]
    7.0
    """
    import matplotlib

    from .drawing import command_line, plot, scan, style

    outputs = [file_name(path) for path in ([output] if isinstance(output, (str, os.PathLike)) else output or [])]
    words = [f"--kind={kind}", f"--colour={','.join(colour)}", f"--scale={scale}", f"--plane={plane[0]}={float(plane[1])!r}", f"--x={x}",
             f"--camera={float(camera[0])!r},{float(camera[1])!r}", f"--width={float(width)!r}", f"--units={units}",
             f"--times={','.join('end' if time == float('inf') else repr(float(time)) for time in times)}",
             f"--series={','.join(series)}", *(f"--label={label}" for label in labels)]  # fmt: skip
    with _errors(command_line):
        options = command_line.plot_options([*words, *["--logx"] * bool(logx), *["--logy"] * bool(logy), "result"])
        style.check_outputs(outputs)
        with matplotlib.rc_context(style.SETTINGS), style.page(dpi, options.width):
            if found := _scan_of(what, units):
                figure = scan.figure_of(found, quantity, list(slices))
            else:
                if quantity or slices:
                    raise command_line.BadInput("--quantity and --slices belong to scans, and this is none")
                results = [each if isinstance(each, Result) else read(each) for each in _listed(what)]
                figure = plot.figure_of([result._shown(units) for result in results], options)
            style.save(figure, outputs)
            return figure


def film(result: Result, output: str | os.PathLike, *, colour: str = "H", fps: float = 10) -> None:
    """The film that `tubule plot --movie` makes, .gif or .mp4 (needs ffmpeg). Needs the packages matplotlib and h5py.

    colour   "H", "K", "u_n", "p"

    Raises ValueError for what cannot be shown, RuntimeError where a program is missing.
    """
    import matplotlib

    from .drawing import command_line, movie, style

    if not isinstance(result, Result):
        raise TypeError(f"a result is wanted, not {reprlib.repr(result)}: read() gives that of a file")
    with _errors(command_line):
        shown = result._shown()
        options = command_line.plot_options([f"--colour={colour}", f"--fps={float(fps)!r}", "result"])
        with matplotlib.rc_context(style.SETTINGS):
            movie.draw(shown, shown.shapes, file_name(output), options.colour[0], shown.title, options.fps, options.camera)


@contextmanager
def _errors(command_line):
    """Words of the command in the terms of functions."""
    try:
        yield
    except command_line.Unavailable as error:
        raise RuntimeError(str(error)) from None
    except (command_line.BadInput, ValueError) as error:
        raise ValueError(re.sub("--(?=[a-z])", "", str(error)).removeprefix("tubule plot: ")) from None


def _listed(what) -> list:
    return [what] if isinstance(what, (Result, str, os.PathLike)) else list(what)


def _scan_of(what, units: str):
    """The scan as the drawing code reads it, in these units; None where it is none."""
    from .drawing import scan
    from .drawing.units import are_wanted

    if isinstance(what, Scan) and what.file is None:
        raise ValueError("this scan has no file: give scan() an output")
    file = what.file if isinstance(what, Scan) else os.fspath(what) if isinstance(what, (str, os.PathLike)) else None
    if file is None or not isinstance(what, Scan) and not scan.is_scan(file):
        return None
    found = scan.Scan(file)
    if not are_wanted(units, found.has_units):
        return found
    return found.convert(lambda sets: case_with_units(found.text, [*found.sets, *sets], file, units).units)
