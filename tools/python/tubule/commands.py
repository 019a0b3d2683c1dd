"""What the program does, as functions."""

from __future__ import annotations

import html
import json
import operator
import os
import reprlib
import tempfile
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any

import numpy as np

from . import _core
from .cases import Case, as_case, as_mapping, file_name, toml_value
from .results import Frame, Result, read

Progress = Callable[[float, float, float], None]


def run(case, *, output: str | os.PathLike | None = None, overwrite: bool = False,
        progress: Progress | None = None, threads: int = 0) -> Result:
    """Runs a case of any tier, or finds its equilibria, in this process.

    case      a Case, or what Case takes
    output    a result file, written during the run: a kill loses the last seconds. Without it all stays in memory
    overwrite replace the result of another case in that file, which is refused otherwise
    progress  called with (time, energy, step) at most ten times a second; what it raises ends the run
    threads   for loops over elements of tier surface3d, at most one a processor; 0: one a processor

    A run that cannot go on is no exception: see Result.stop. Each note on the case and each of Result.warnings is a
    warning of Python (UserWarning), too. Ctrl-C raises KeyboardInterrupt. Raises CaseError for bad input, ValueError or TypeError for other arguments that make no sense, RuntimeError where nothing could be computed.

    >>> result = run(tube)
    >>> result.stop, len(result.frames)
    ('finished', 4)
    """
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be a function, not {reprlib.repr(progress)}")
    file = None if output is None else file_name(output)
    return Result(_core.run(as_case(case)._core, progress, file, bool(overwrite), _integer("threads", threads), None))


def _integer(name: str, value) -> int | None:
    """As C++ has them. Raises TypeError for what is none, ValueError for one of more than 31 bits."""
    if value is None:
        return None
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be an integer, not {reprlib.repr(value)}") from None
    if abs(number) >= 2**31:
        raise ValueError(f"{name} = {reprlib.repr(number)}: is too large")
    return number


def _text(name: str, value) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{name} must be a text, not {reprlib.repr(value)}")
    return value


def _list(name: str, values, text) -> str:
    """As the command has it; empty where there is none."""
    if values is None:
        return ""
    if not (texts := [text(value) for value in values]):
        raise ValueError(f"{name} must not be empty")
    return ",".join(texts)


def run_many(cases: Iterable, *, jobs: int | None = None) -> list[Result]:
    """Runs cases side by side, one thread each, on all processors. Their results, in order.

    The first exception of a run, or Ctrl-C, ends the others and is raised.
    """
    prepared, enough = [as_case(case)._core for case in cases], _core.Flag()
    with ThreadPoolExecutor(max_workers=_core.scan_threads(_integer("jobs", jobs))) as pool:
        runs = [pool.submit(_core.run, case, None, None, False, 1, enough) for case in prepared]
        try:
            for each in wait(runs, return_when=FIRST_EXCEPTION).done:
                each.result()
            return [Result(each.result()) for each in runs]
        except BaseException:
            enough.raise_it()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def equilibrium(case, **options) -> Result:
    """As run(), of a case that has a table [equilibrium]: each row of the series is a shape.

    Raises ValueError if it has none.
    """
    case = as_case(case)
    if not case._core.is_equilibrium:
        raise ValueError("this case moves: an equilibrium needs a table [equilibrium]")
    return run(case, **options)


def stability(subject, *, model: str = "", Re: float | None = None, gamma: float | None = None,
              tension: float | None = None, modes: int = 2, waves: int | None = None, q: Iterable[float] | None = None,
              rates: int | None = None, frame: int | None = None, numerical: bool = False, fit: tuple[int, ...] | None = None,
              kT: float | None = None) -> dict:
    """Growth rates of a case or a result: `tubule stability --json`, docs/schemas/stability.json.

    model, Re, gamma, tension   instead of the case's; model "all" for every one
    modes, waves, q             m = 0 ... modes; n (spheres: l) up to waves, or these wave numbers
    rates, numerical            numerical spectra: how many rates for each m (3), of a surface in all (10); also where a
                                closed form is known
    kT                          also mean squares of amplitudes at this temperature
    frame, fit                  of a result: which frame; or the rate of wave n or (n, m), fitted to its series

    Raises ValueError for what cannot be asked.
    """
    o = _core.StabilityOptions()
    integers = {"modes": modes, "waves": waves, "rates": rates, "frame": frame}
    given = {"model": _text("model", model), "Re": Re, "gamma": gamma, "tension": tension, "kT": kT, "numerical": bool(numerical)}
    for name, value in (given | {name: _integer(name, value) for name, value in integers.items()}).items():
        try:
            setattr(o, name, value)
        except TypeError:
            raise TypeError(f"{name} must be {getattr(type(o), name).__doc__}, not {reprlib.repr(value)}") from None
    o.q = _list("q", q, lambda x: repr(float(x)))
    o.fit = _list("fit", fit, lambda n: str(operator.index(n)))
    if isinstance(subject, Result):
        return json.loads(_core.stability(subject._core, subject._name, o))
    return json.loads(_core.stability(as_case(subject)._core, o))


def compare(a: Result, b: Result, *, align: bool = False, shapes: bool = True,
            frames: Iterable[tuple[int, int]] = ()) -> dict:
    """Two results against each other: `tubule compare --json`, docs/schemas/compare.json.

    align    first move b rigidly to where it fits best
    shapes   compare the frames' surfaces, too
    frames   pairs of frames to compare whatever their times; then no series are compared
    """
    for result in (a, b):
        if not isinstance(result, Result):
            raise TypeError(f"a result is wanted, not {reprlib.repr(result)}: read() gives that of a file")
    pairs = [f"{operator.index(i)}:{operator.index(j)}" for i, j in frames]
    return json.loads(_core.compare(a._core, b._core, bool(align), bool(shapes), pairs))


class Scan:
    """What became of a case over a grid of its keys. Arrays have one axis a key, in the order of `over`.

    keys, values   of each axis
    outcome        "uniform-tube", "pinched" ... (docs/scans.md)
    others         measures by name, such as energy, time, energy_error; NaN where a run has none
    file           the result file, or None
    """

    def __init__(self, read: dict, file: str | None = None):
        self.file = file
        self.keys = [keys[0] if len(keys) == 1 else tuple(keys) for keys, _ in read["axes"]]
        self.values = [np.array([_number(v[0]) if len(v) == 1 else " ".join(v) for v in values]) for _, values in read["axes"]]
        shape = tuple(len(v) for v in self.values)
        self._measures = {name: np.array(values).reshape(shape) for name, values in read.items() if name != "axes"}

    @property
    def outcome(self) -> np.ndarray:
        return self._measures["outcome"]

    def __getitem__(self, measure: str) -> np.ndarray:
        return self._measures[measure]

    def measures(self) -> list[str]:
        return list(self._measures)

    def __repr__(self) -> str:
        found = ", ".join(f"{n} {name}" for name, n in zip(*np.unique(self.outcome, return_counts=True)))
        return f"<tubule.Scan over {' x '.join(map(str, self.keys))}: {found}>"

    def _repr_html_(self) -> str:
        """In a notebook: a table of the points, at most a hundred."""
        columns = self._columns(["outcome", "energy", "energy_error", "time"])
        rows = [[f"<th>{html.escape(name)}</th>" for name in columns]]
        rows += [[f"<td>{html.escape(f'{x:.6g}' if isinstance(x, float) else str(x))}</td>" for x in row] for row in zip(*(c[:100].tolist() for c in columns.values()))]
        table = "".join(f"<tr>{''.join(row)}</tr>" for row in rows)
        return f"<p>{html.escape(repr(self))}</p><table>{table}</table>"

    def _columns(self, measures: Iterable[str]) -> dict[str, np.ndarray]:
        """One row a point."""
        grid = np.meshgrid(*self.values, indexing="ij")
        names = [k if isinstance(k, str) else ",".join(k) for k in self.keys]
        return {name: g.ravel() for name, g in zip(names, grid)} | {n: self[n].ravel() for n in measures}

    def to_pandas(self):
        """One row a point. Needs the package pandas."""
        import pandas

        return pandas.DataFrame(self._columns(self._measures))


def _number(text: str):
    try:
        return float(text)
    except ValueError:
        return text


def _axis(key: str, values) -> str:
    if isinstance(values, str):
        return f"{key}={values}"
    return f"{key}=" + ",".join(toml_value(v) for v in values)


def scan(case, over: Mapping[str, Any], *, boundary: str | None = None, output: str | os.PathLike | None = None,
         overwrite: bool = False, jobs: int | None = None, to_the_end: bool = False) -> Scan:
    """What becomes of a case over a grid of its keys, on all processors: `tubule scan`.

    over      by key: a sequence of values, or "low:high:count[:log]"
    boundary  only along the lines between outcomes ("outcome"), or around one of them
    output    a result file, which the program can draw, resume and extend
    overwrite replace another scan in that file, which is refused otherwise

    >>> scan(tube, {"energy.k42": [0, 0.06]})["energy"].shape
    (2,)
    """
    axes = [_axis(key, values) for key, values in as_mapping("over", over).items()]
    with tempfile.TemporaryDirectory() as folder:
        file = file_name(output) if output is not None else str(Path(folder) / "scan.hdf")
        return Scan(_core.scan(as_case(case)._core, axes, "" if boundary is None else _text("boundary", boundary), file, bool(overwrite), _integer("jobs", jobs), bool(to_the_end)),
                    None if output is None else file)


def export(what: Result | Frame, output: str | os.PathLike, *, frame: int = -1, subdivide: int | None = None) -> None:
    """Writes a shape as flat triangles, .stl, .ply or .obj: `tubule export`, Frame.triangles().

    what   a Frame, or a Result of which frame is taken

    Raises ValueError for what cannot be written.
    """
    from .drawing import command_line, formats

    if not isinstance(what, (Frame, Result)):
        raise TypeError(f"a result or a frame is wanted, not {reprlib.repr(what)}")
    try:
        formats.write(file_name(output), *(what.frames[frame] if isinstance(what, Result) else what).triangles(subdivide))
    except command_line.BadInput as error:
        raise ValueError(str(error)) from None


def energy_density(H, K, **moduli):
    """f(H, K) for moduli by name, such as k20=1, k42=0.06, H0=-1; numbers or arrays that broadcast."""
    return Case({"tier": "axisym", "energy": moduli, "shape": {"kind": "tube", "radius": 1.0, "length": 1.0},
                 "time": {"end": 1.0}}).energy_density(H, K)


def curvatures(r, dr, d2r, dz=1.0, d2z=0.0):
    """(H, K) of the surface of revolution of a profile (r(s), z(s)) from its first and second derivatives.

    Of a graph r(z) the last two stay as they are. The normal points outwards: a tube has H = -1/r, a sphere H = -2/R.
    """
    return _core.profile_curvatures(r, dr, d2r, dz, d2z)


__all__ = ["run", "run_many", "equilibrium", "stability", "compare", "scan", "Scan", "export", "energy_density", "curvatures", "read"]
