"""Reads result files into plain data. Layout: docs/results.md."""

import os
import re
from contextlib import contextmanager
from dataclasses import dataclass, field

import h5py
import numpy as np

from .labels import BadCase, as_label, effective_case, flatten


class BadInput(Exception):
    """One line for the user: which file or argument is wrong, and why."""


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
    parameter: float | None = None  # on a branch of equilibria

    @property
    def length(self):
        return float(np.ptp(self.z))

    @property
    def is_graph(self):
        """Whether it is a tube r(z): no poles, and z never decreases."""
        return min(self.r[0], self.r[-1]) > 1e-9 * self.r.max() and bool((np.diff(self.z) >= 0).all())

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

    @property
    def size(self):
        """Diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.points.reshape(-1, 3), axis=0)))

    @property
    def speed(self):
        """The largest value; 0 at rest."""
        return 0.0 if self.u is None else float(np.linalg.norm(self.u, axis=-1).max())


@dataclass
class Result:
    path: str
    case: dict  # with overrides applied
    about: dict
    series: dict  # name -> 1-D array, times strictly increasing
    frames: list  # of Frame, times strictly increasing
    surfaces: list  # of Surface, likewise
    meanings: dict = field(default_factory=dict)  # name -> what the series is; missing in older files

    @property
    def title(self):
        return as_label(self.case.get("about", {}).get("title") or os.path.splitext(os.path.basename(self.path))[0])

    @property
    def H0(self):
        """Spontaneous curvature; none where it varies over the membrane."""
        given = flatten(self.case).get("energy.H0", 0.0)
        return None if isinstance(given, str) else float(given)

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
        ends = [frame.time for frame in [*self.frames[-1:], *self.surfaces[-1:]]] + list(self.series.get("time", [])[-1:])
        return float(max(ends, default=0.0))

    @property
    def last_shape_time(self):
        """Of the last frame, which may be a profile or a surface."""
        return max((frame.time for frame in [*self.frames[-1:], *self.surfaces[-1:]]), default=0.0)

    @property
    def stopped_early(self):
        """The stop reason ("pinch-off", ...) if the run ended early, else None."""
        reason = self.about.get("stop", "unfinished")
        return None if reason in ("finished", "stationary") else str(reason)

    def has_energy(self, least):
        return "energy" in self.series and self.series["energy"].size >= least

    def terms(self, known):
        """Names of the energy terms in the series, "20" for energy_20: the known ones first, in their order."""
        others = [name[7:] for name in self.series if re.fullmatch(r"energy_(\d+(_\d+)?|formula)", name)]
        return list(dict.fromkeys([*(name for name in known if f"energy_{name}" in self.series), *others]))


BEST_COMPRESSION = 1032  # of deflate


@contextmanager
def opened(path):
    """The HDF5 file. BadInput names it for all that is wrong with it, and for links to other files: what lies there may be
    anything, and anybody's."""
    if not os.path.exists(path):
        raise BadInput(f"{path}: no such file")
    if not os.path.isfile(path):
        raise BadInput(f"{path}: is a directory, a pipe or a device, not a file")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise BadInput(f"{path}: cannot be read as HDF5") from error
    with file:
        elsewhere = file.id.links.visit(lambda name, link: name if link.type >= h5py.h5l.TYPE_EXTERNAL else None, info=True)
        if elsewhere:
            raise BadInput(f"{path}: /{elsewhere.decode(errors='replace')} is a link to another file: not followed")
        try:
            yield file
        except BadCase as error:
            raise BadInput(f"{path}: {error}") from error
        except (OSError, KeyError, TypeError, ValueError, AttributeError, MemoryError) as error:
            raise BadInput(f"{path}: damaged or not a result of tubule ({error})") from error


def values(data):
    """Of a dataset. Raises ValueError where they are not in the file, or not all of them."""
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


def read_result(path):
    """Raises BadInput naming the file if it is not a result or a record is damaged."""
    with opened(path) as file:
        if "case" not in file:
            raise BadInput(f"{path}: is not a result of tubule (it has no /case)")
        case = effective_case(_plain(values(file["case"])), _strings(file["case"].attrs.get("set")))
        about = {key: _plain(value) for key, value in file["about"].attrs.items()} if "about" in file else {}
        group = file.get("series", {})
        series = {name: finite_values(data) for name, data in group.items()}
        meanings = {name: str(_plain(data.attrs.get("meaning", name))) for name, data in group.items()}
        return Result(path, case, about, series_in_time(series), *_frames(path, file), meanings)


def _plain(value):
    return value.decode() if isinstance(value, bytes) else value


def _strings(attribute):
    if attribute is None or isinstance(attribute, h5py.Empty):
        return []
    return [_plain(entry) for entry in np.atleast_1d(attribute)]


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
    frames, surfaces = [], []
    for name, record in sorted(file.get("frames", {}).items()):
        if "time" not in record.attrs:
            raise BadInput(f"{path}: frame {name} lacks its time")
        if not np.isfinite(record.attrs["time"]):
            raise BadInput(f"{path}: frame {name}: its time is not finite")
        if "mesh" in record.attrs:
            surfaces.append(_surface(path, name, record, file[f"meshes/{record.attrs['mesh']:06d}"]))
        else:
            frames.append(_profile(path, name, record))
    return in_time(frames), in_time(surfaces)


def in_time(frames):
    return [frames[i] for i in _increasing(np.array([frame.time for frame in frames]))] if frames else []


def _arrays(path, name, group, keys):
    missing = [key for key in keys if key not in group]
    if missing:
        raise BadInput(f"{path}: frame {name} lacks {', '.join(missing)}")
    return [np.asarray(finite_values(group[key]), float) for key in keys]


def _profile(path, name, record):
    keys = ["z", "r", "H", "K", *(key for key in ("u_n", "u_t", "u_theta") if key in record)]
    arrays = dict(zip(keys, _arrays(path, name, record, keys)))
    if any(array.ndim != 1 or array.shape != arrays["z"].shape or array.size < 2 for array in arrays.values()):
        raise BadInput(f"{path}: frame {name}: {', '.join(keys)} must be lists of one length, 2 or more")
    parameter = float(record.attrs["parameter"]) if "parameter" in record.attrs else None
    return Frame(float(record.attrs["time"]), **arrays, parameter=parameter)


def _surface(path, name, record, mesh):
    order = int(mesh.attrs["order"])
    cells = values(record["Connectivity"]).reshape(-1, (order + 1) * (order + 2) // 2)
    (points,) = _arrays(path, name, record, ("Points",))
    data = record["PointData"]
    keys = ["H", "K", "normal", *(key for key in ("u", "u_n", "p") if key in data)]
    arrays = dict(zip(keys, _arrays(path, name, data, keys)))
    vectors = [array for key, array in arrays.items() if key in ("normal", "u")]
    numbers = [array for key, array in arrays.items() if key not in ("normal", "u")]
    if any(a.shape != points.shape for a in vectors) or any(a.shape != points.shape[:1] for a in numbers):
        names = ", ".join(["Points", "normal", "H", "K", *keys[3:]])
        raise BadInput(f"{path}: frame {name}: {names} must have one row per point")
    if ("u" in arrays) != ("u_n" in arrays):
        raise BadInput(f"{path}: frame {name}: has only one of u and u_n")
    of_cells = {key: array[cells] for key, array in arrays.items()}
    return Surface(float(record.attrs["time"]), order, mesh.attrs["period"] == 0, points[cells], **of_cells)
