"""Pictures of results: what `tubule plot` draws, as figures of matplotlib."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from types import SimpleNamespace

from . import _core
from .cases import file_name
from .commands import Scan
from .results import Frame, Result, read


def draw(what, output: str | os.PathLike | Iterable[str | os.PathLike] | None = None, *, kind: str = "all",
         times: Iterable[float] = (), colour: Iterable[str] = (), labels: Iterable[str] = (), plane: tuple[str, float] = ("z", 0.0),
         scale: str = "run", series: Iterable[str] = (), x: str = "time", logy: bool = False, quantity: str = "",
         slices: Iterable[str] = (), dpi: float = 300):  # fmt: skip
    """The picture that `tubule plot` makes, as a matplotlib.figure.Figure. Needs the packages matplotlib and h5py.

    what      a Result, several ones (labelled by what differs in their cases), or names of result files; a Scan that
              was run with an output, or the name of its file
    output    also writes it: .png, .svg or .pdf, or several of them
    kind      "profiles", "surface", "cuts", "energy", "balance", "all"
    times     of the frames to show
    colour    of surfaces: "u_n", "H", "K", "p"
    series    draws these series against the series x, and nothing else
    quantity, slices    of a scan: what its map shows; KEY=VALUE of axes that are cut
    dpi       pixels per inch, 30 to 1200
    The others are as the options of `tubule plot`. Raises ValueError for what cannot be drawn.

    >>> figure = draw(tubule.run(tube), kind="energy")
    >>> figure.get_size_inches()[0]
    7.0
    """
    import matplotlib

    from .drawing import plot, scan, style
    from .drawing.results import BadInput

    outputs = [file_name(path) for path in ([output] if isinstance(output, (str, os.PathLike)) else output or [])]
    try:
        style.check_outputs(outputs)
        with matplotlib.rc_context(style.SETTINGS), style.resolution(dpi):
            file = _scan_file(what)
            if file is not None:
                figure = scan.figure_of(file, quantity, list(slices))
            else:
                if quantity or slices:
                    raise BadInput("--quantity and --slices belong to scans, and this is none")
                results = [each if isinstance(each, Result) else read(each) for each in _listed(what)]
                choice = plot.Choice(list(series), x, None, None, logy) if series else None
                options = SimpleNamespace(kind=kind, times=[float(time) for time in times], colour=list(colour), label=[str(l) for l in labels],
                                          plane=(plane[0], float(plane[1])), scale=scale, series=choice, terms=_term_labels(results))  # fmt: skip
                plot.require_valid(options)
                figure = plot.figure_of([_plain(result) for result in results], options)
            style.save(figure, outputs)
            return figure
    except (BadInput, ValueError) as error:
        raise ValueError(re.sub("--(?=[a-z])", "", str(error))) from None


def _listed(what) -> list:
    return [what] if isinstance(what, (Result, str, os.PathLike)) else list(what)


def _scan_file(what) -> str | None:
    from .drawing.scan import is_scan

    if isinstance(what, Scan):
        if what.file is None:
            raise ValueError("this scan has no file: give scan() an output")
        return what.file
    return os.fspath(what) if isinstance(what, (str, os.PathLike)) and is_scan(os.fspath(what)) else None


def _term_labels(results: list[Result]) -> dict[str, str]:
    labels: dict[str, str] = {}
    for result in results:
        labels |= result.case._core.term_labels
    return labels


def _plain(result: Result):
    """The result as the modules of drawing/ read it from a file."""
    from .drawing.labels import effective_case
    from .drawing.results import Result as Plain
    from .drawing.results import in_time, series_in_time

    case = effective_case(result._core.case_text, result._core.case_sets)
    profiles = [_profile(frame) for frame in result.frames if frame.kind != "surface"]
    surfaces = [_surface(frame) for frame in result.frames if frame.kind == "surface"]
    meanings = {name: _core.series_meaning(name) for name in result.series}
    return Plain(result._name, case, result.about, series_in_time(dict(result.series)), in_time(profiles), in_time(surfaces), meanings)


def _profile(frame: Frame):
    from .drawing.results import Frame as Plain

    given = {name: frame.arrays[name] for name in ("z", "r", "H", "K", "u_n", "u_t", "u_theta") if name in frame.arrays}
    return Plain(frame.time, **given, parameter=frame.numbers.get("parameter"))


def _surface(frame: Frame):
    from .drawing.results import Surface as Plain

    points, cells, node = frame._whole()
    given = {name: frame.arrays[name][node][cells] for name in ("normal", "H", "K", "u", "u_n", "p") if name in frame.arrays}
    return Plain(frame.time, frame.order, frame._mesh["period"] == 0, points[cells], **given)
