"""Reads result files into plain data. Layout: docs/results.md."""

import json
import os
import re
import subprocess
import tomllib
from contextlib import contextmanager
from dataclasses import dataclass, field

import h5py
import numpy as np

from .command_line import BadInput, check_file
from .labels import as_label, flatten, pretty_unit, symbol
from .triangles import join_periods


NORMAL_ONLY = 1e-3  # part of the speed below which a tangential velocity is only rounding of normals


def tangential(velocity, normal):
    """The part of a velocity [..., 3] along the surface; `normal` of any length but zero."""
    along = (velocity * normal).sum(axis=-1, keepdims=True) / (normal * normal).sum(axis=-1, keepdims=True)
    return velocity - along * normal


@dataclass
class Frame:
    time: float
    z: np.ndarray  # along the axis, from pole to pole or over one period, both ends included
    r: np.ndarray
    H: np.ndarray
    K: np.ndarray
    u_n: np.ndarray | None = None  # velocity: outward,
    u_t: np.ndarray | None = None  # along the profile in the order of the points,
    u_theta: np.ndarray | None = None  # and around the axis
    H0: np.ndarray | None = None  # where it varies
    energy_density: np.ndarray | None = None
    parameter: float | None = None  # on a branch of equilibria
    period: float = 0.0  # of a tube

    def quantity(self, name):
        """Values of H, K, u_n, H0 or energy_density; None where there are none."""
        return getattr(self, name, None)

    @property
    def length(self):
        return float(np.ptp(self.z))

    @property
    def is_graph(self):
        """Whether it is a tube r(z): no poles, and z never decreases."""
        return min(self.r[0], self.r[-1]) > 1e-9 * self.r.max() and bool((np.diff(self.z) >= 0).all())

    @property
    def size(self):
        return float(np.hypot(self.length, self.r.max()))

    def largest(self, name):
        """Largest |u_n|, |u_t| or |u_theta|; 0 if there is none."""
        values = getattr(self, name)
        return 0.0 if values is None else float(np.abs(values).max())

    @property
    def speed(self):
        """The larger one of |u_n| and |u_t|."""
        return max(self.largest("u_n"), self.largest("u_t"))


@dataclass
class Surface:
    """A frame on a mesh; arrays [cell, node of the cell], nodes in VTK's order."""

    time: float
    order: int
    closed: bool  # or one period of a tube
    points: np.ndarray  # and three coordinates
    normal: np.ndarray
    H: np.ndarray
    K: np.ndarray
    u: np.ndarray | None = None  # of a surface that moves: velocity, three components,
    u_n: np.ndarray | None = None  # outward,
    p: np.ndarray | None = None  # and pressure, where there is one
    H0: np.ndarray | None = None  # where it varies
    energy_density: np.ndarray | None = None
    modes: dict = field(default_factory=dict)  # of an equilibrium: normal displacements mode_1, ...
    # As the file has them:
    period: float = 0.0
    mesh: int = 0  # its number
    cells: np.ndarray | None = None
    nodes: dict = field(default_factory=dict)  # arrays of points, by name; `node` has numbers, the same a period away
    parameter = None

    def quantity(self, name):
        """Values of H, K, u_n, p, H0, energy_density or a mode; None where there are none."""
        return self.modes.get(name) if name.startswith("mode_") else getattr(self, name)

    @property
    def size(self):
        """Diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.points.reshape(-1, 3), axis=0)))

    @property
    def speed(self):
        """The largest |u|; 0 where nothing moves."""
        return 0.0 if self.u is None else float(np.linalg.norm(self.u, axis=-1).max())

    def largest(self, name):
        """Largest |u_n|, or tangential speed for u_t: 0 where that is only rounding of normals."""
        if self.u is None or name == "u_theta":
            return 0.0
        if name == "u_n":
            return float(np.abs(self.u_n).max())
        largest = float(np.linalg.norm(tangential(self.u, self.normal), axis=-1).max())
        return largest if largest > NORMAL_ONLY * self.speed else 0.0


@dataclass
class Result:
    path: str
    case: dict  # with overrides applied
    about: dict
    series: dict  # name -> 1-D array, times strictly increasing
    frames: list  # of Frame, times strictly increasing
    surfaces: list  # of Surface, likewise
    meanings: dict = field(default_factory=dict)  # name -> what the series is
    term_labels: dict = field(default_factory=dict)  # "20" -> the formula of an energy term; missing in older files
    dimensions: dict = field(default_factory=dict)  # name -> of the series, as in docs/results.md
    units: dict = field(default_factory=dict)  # of these numbers, by their dimensions: units.py; none: as in the file

    def scale(self, of):
        """A number of the file times this is one of the result; `of`: its dimensions."""
        return self.units[of]["scale"] if of in self.units else 1.0

    def unit(self, of):
        """The unit of numbers with these dimensions; "" where there is none."""
        return pretty_unit(self.units[of]["unit"]) if of in self.units else ""

    @property
    def shapes(self):
        """Its surfaces, else its profiles."""
        return self.surfaces or self.frames

    @property
    def vary(self):
        """The key that varies along its branch of equilibria, or an empty text."""
        return self.case.get("equilibrium", {}).get("branch", {}).get("vary", "")

    @property
    def parameter_name(self):
        return symbol(self.vary.split(".")[-1]).replace("_", " ") or "parameter"

    @property
    def parameter_unit(self):
        """That of the parameter of its branch."""
        return self.unit(self.dimensions.get("parameter", ""))

    @property
    def title(self):
        return as_label(self.case.get("about", {}).get("title") or os.path.splitext(os.path.basename(self.path))[0])

    @property
    def H0(self):
        """Spontaneous curvature; none where it varies over the membrane."""
        given = flatten(self.case).get("energy.H0", 0.0)
        return None if isinstance(given, str) else float(given) * self.scale("1/length")

    @property
    def moves(self):
        """Whether it is a moving surface."""
        return any(surface.u is not None for surface in self.surfaces)

    @property
    def is_equilibrium(self):
        """Whether it has stationary shapes, with indices as times."""
        return "equilibrium" in self.case

    @property
    def has_inertia(self):
        return flatten(self.case).get("model.kind") == "fluid" and "kinetic_energy" in self.series

    @property
    def end_time(self):
        """Time of the last frame or row; 0 without any."""
        return float(max(self.last_shape_time, *self.series.get("time", [])[-1:], 0.0))

    @property
    def last_shape_time(self):
        """The time of the last frame, which may be a profile or a surface."""
        return max((frame.time for frame in [*self.frames[-1:], *self.surfaces[-1:]]), default=0.0)

    @property
    def stopped_early(self):
        """The stop reason ("pinch-off", ...) if the run ended early, else None."""
        reason = self.about.get("stop", "unfinished")
        return None if reason in ("finished", "stationary") else str(reason)

    def has_energy(self, least):
        return "energy" in self.series and self.series["energy"].size >= least

    @property
    def terms(self):
        """Names of the energy terms in the series, "20" for energy_20."""
        return [name[7:] for name in self.series if re.fullmatch(r"energy_(\d+(_\d+)?|formula|kg)", name)]


SCHEMA = 2  # common/result/hdf5_objects.hpp
BEST_COMPRESSION = 1032  # of deflate


@contextmanager
def opened(path):
    """The HDF5 file, or one in memory. BadInput names it for all that is wrong with it, and for links to other files: what
    lies there may be anything, and anybody's."""
    if isinstance(path, str):
        check_file(path)
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise BadInput(f"{path}: cannot be read as HDF5: give a file NAME.hdf that run, equilibrium or scan wrote") from error
    with file:
        elsewhere = file.id.links.visit(lambda name, link: name if link.type >= h5py.h5l.TYPE_EXTERNAL else None, info=True)
        if file.attrs.get("schema", 1) > SCHEMA:
            raise BadInput(f"{path}: was written by a later version of tubule, with schema {file.attrs['schema']}; this version reads 1 to {SCHEMA}")
        if elsewhere:
            raise BadInput(f"{path}: /{elsewhere.decode(errors='replace')} is a link to another file: not followed")
        try:
            yield file
        except (OSError, KeyError, TypeError, ValueError, AttributeError, MemoryError) as error:
            raise BadInput(f"{path}: damaged or not a result of tubule ({error})") from error


def values(data):
    """The values of a dataset. Raises ValueError where they are not in the file, or not all of them."""
    how = data.id.get_create_plist()
    if how.get_external_count() or how.get_layout() == h5py.h5d.VIRTUAL:
        raise ValueError(f"the values of {data.name} are in another file: not read")
    if data.nbytes > data.id.get_storage_size() * (BEST_COMPRESSION if how.get_nfilters() else 1):
        raise ValueError(f"{data.name} has {data.size} values, and not all are in the file")
    return data[()]


def finite_values(data):
    """As values(), of a result, whose numbers are never NaN or infinite."""
    array = np.asarray(values(data))
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"{data.name} contains numbers that are not finite")
    return array


def read_result(path, name=""):
    """The result in a file, or in one in memory with this name. Raises BadInput naming it if it is none or a record is
    damaged."""
    with opened(path) as file:
        if "case" not in file:
            raise BadInput(f"{path}: is not a result of tubule (it has no /case)")
        about = {key: _plain(value) for key, value in file["about"].attrs.items()} if "about" in file else {}
        group = file.get("series", {})
        names = [_plain(name) for name in group.attrs.get("order", group)] if group else []
        series = {name: finite_values(group[name]) for name in names}
        texts = {key: {name: str(_plain(group[name].attrs[key])) for name in names if key in group[name].attrs} for key in ("meaning", "label", "unit")}
        labels = {name.removeprefix("energy_"): label for name, label in texts["label"].items()}
        return Result(name or path, _case(path, file), about, series_in_time(series), *_frames(path, file), texts["meaning"], labels, texts["unit"])


def read_case(path):
    """The case of a result, as of Result."""
    with opened(path) as file:
        return _case(path, file)


def _case(path, file):
    """As the program has resolved it: overrides applied, defaults written out. Of an older result the program is asked."""
    program, text = os.environ.get("TUBULE_PROGRAM"), ""
    if "resolved_case" in file:
        text = _plain(values(file["resolved_case"]))
    elif program:
        done = subprocess.run([program, "show", path, "--json"], capture_output=True, text=True)
        text = json.loads(done.stdout)["case"]["resolved"] if done.returncode == 0 else ""
    try:
        return tomllib.loads(text or _plain(values(file["case"])))
    except tomllib.TOMLDecodeError as error:
        raise BadInput(f"{path}: its case is not valid TOML: {error}") from error


def _plain(value):
    return value.decode() if isinstance(value, bytes) else value


def series_in_time(group):
    """Arrays by name, without rows at the time of an earlier one."""
    series = {name: np.asarray(data, float) for name, data in group.items()}
    if "time" not in series or series["time"].size == 0:
        return {}
    if any(values.shape != series["time"].shape for values in series.values()):
        raise ValueError("series of different lengths")
    keep = _increasing(series["time"])
    return {name: values[keep] for name, values in series.items()}


def _increasing(times):
    """Indices of a strictly increasing subsequence: of rows at equal times the first is kept."""
    before = np.maximum.accumulate(np.concatenate([[-np.inf], times[:-1]]))
    return np.flatnonzero(times > before)


def _frames(path, file):
    """Profiles and surfaces."""
    frames = [_frame(path, name, record, file) for name, record in sorted(file.get("frames", {}).items())]
    return (_in_time([frame for frame in frames if isinstance(frame, kind)]) for kind in (Frame, Surface))


def _frame(path, name, record, file):
    if "time" not in record.attrs:
        raise BadInput(f"{path}: frame {name} lacks its time")
    if not np.isfinite(record.attrs["time"]):
        raise BadInput(f"{path}: frame {name}: its time is not finite")
    return _surface(path, name, record, file["meshes"]) if "mesh" in record.attrs else _profile(path, name, record)


def read_frame(path, number):
    """A Frame or a Surface of a result, counted from 0, or from -1 backwards."""
    with opened(path) as file:
        names = sorted(file.get("frames", {}))
        if not -len(names) <= number < len(names):
            raise BadInput(f"{path}: no frame {number}: there are {f'0 to {len(names) - 1}' if names else 'none'}")
        return _frame(path, names[number], file["frames"][names[number]], file)


def _in_time(frames):
    return [frames[i] for i in _increasing(np.array([frame.time for frame in frames]))] if frames else []


def _arrays(path, name, group, needed, others=()):
    """By name: what is needed, and the others as far as they are there."""
    missing = [key for key in needed if key not in group]
    if missing:
        raise BadInput(f"{path}: frame {name} lacks {', '.join(missing)}")
    return {key: np.asarray(finite_values(group[key]), float) for key in (*needed, *others) if key in group}


def _profile(path, name, record):
    arrays = _arrays(path, name, record, ("z", "r", "H", "K"), ("u_n", "u_t", "u_theta", "H0", "energy_density"))
    if any(array.ndim != 1 or array.shape != arrays["z"].shape or array.size < 2 for array in arrays.values()):
        raise BadInput(f"{path}: frame {name}: {', '.join(arrays)} must be lists of one length, 2 or more")
    parameter = float(record.attrs["parameter"]) if "parameter" in record.attrs else None
    return Frame(float(record.attrs["time"]), **arrays, parameter=parameter, period=float(record.attrs.get("length", 0)))


def _surface(path, name, record, meshes):
    number = int(record.attrs["mesh"])
    mesh = meshes[f"{number:06d}"]
    order, period = int(mesh.attrs["order"]), float(mesh.attrs["period"])
    cells = values(record["Connectivity"]).reshape(-1, (order + 1) * (order + 2) // 2)
    points = _arrays(path, name, record, ("Points",))["Points"]
    modes = sorted(key for key in record["PointData"] if key.startswith("mode_"))
    others = ("u", "u_n", "p", "H0", "energy_density", *modes)
    nodes = _arrays(path, name, record["PointData"], ("H", "K", "normal"), others)
    if any(a.shape != (points.shape if key in ("normal", "u") else points.shape[:1]) for key, a in nodes.items()):
        names = ", ".join(["Points", "normal", *(key for key in nodes if key != "normal")])
        raise BadInput(f"{path}: frame {name}: {names} must have one row per point")
    if ("u" in nodes) != ("u_n" in nodes):
        raise BadInput(f"{path}: frame {name}: has only one of u and u_n")
    of_cells = {key: array[cells] for key, array in {"points": points, **nodes}.items()}
    modes = {key: of_cells.pop(key) for key in modes}
    if period > 0:
        join_periods(of_cells["points"], period)
    nodes |= {"points": points, "node": values(mesh["point_node"]) if period > 0 else np.arange(len(points))}
    return Surface(float(record.attrs["time"]), order, period == 0, **of_cells, modes=modes, period=period, mesh=number, cells=cells,
                   nodes=nodes)  # fmt: skip
