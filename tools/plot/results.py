"""Reads result files into plain data. Layout: docs/results.md."""

import os
import re
from dataclasses import dataclass

import h5py
import numpy as np

from labels import BadCase, effective_case, flatten


class BadInput(Exception):
    """One line for the user: what is wrong with which file or argument."""


@dataclass
class Frame:
    time: float
    z: np.ndarray  # along the axis, one period, both ends included
    r: np.ndarray
    H: np.ndarray
    K: np.ndarray

    @property
    def length(self):
        return float(np.ptp(self.z))


@dataclass
class Result:
    path: str
    case: dict  # with overrides applied
    about: dict
    series: dict  # name -> 1-D array, times strictly increasing
    frames: list  # of Frame, times strictly increasing

    @property
    def title(self):
        return self.case.get("about", {}).get("title") or os.path.splitext(os.path.basename(self.path))[0]

    @property
    def H0(self):
        return float(flatten(self.case).get("energy.H0", 0.0))

    @property
    def end_time(self):
        """Time of the last frame or row; 0 without any."""
        ends = [frame.time for frame in self.frames[-1:]] + list(self.series.get("time", [])[-1:])
        return float(max(ends, default=0.0))

    @property
    def stopped_early(self):
        """The reason ("pinch-off", ...) when the run did not get to its end, else None."""
        reason = self.about.get("stop", "unfinished")
        return None if reason in ("finished", "stationary") else str(reason)

    def terms(self, known):
        """Names of the energy terms in the series, "20" for energy_20: the known ones first, in their order."""
        others = [name[7:] for name in self.series if re.fullmatch(r"energy_\d+", name)]
        return list(dict.fromkeys([*(name for name in known if f"energy_{name}" in self.series), *others]))


def read_result(path):
    """Raises BadInput naming the file when it is no result or a record in it is damaged."""
    if not os.path.exists(path):
        raise BadInput(f"{path}: no such file")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise BadInput(f"{path}: cannot be read as HDF5") from error
    with file:
        if "case" not in file:
            raise BadInput(f"{path}: is not a result of tubule (it has no /case)")
        try:
            case = effective_case(file["case"].asstr()[()], _strings(file["case"].attrs.get("set")))
            about = {key: _plain(value) for key, value in file["about"].attrs.items()} if "about" in file else {}
            return Result(path, case, about, _series(file.get("series", {})), _frames(path, file.get("frames", {})))
        except BadCase as error:
            raise BadInput(f"{path}: {error}") from error
        except (OSError, KeyError, TypeError, ValueError, AttributeError) as error:
            raise BadInput(f"{path}: damaged or not a result of tubule ({error})") from error


def _plain(value):
    return value.decode() if isinstance(value, bytes) else value


def _strings(attribute):
    if attribute is None or isinstance(attribute, h5py.Empty):
        return []
    return [_plain(entry) for entry in np.atleast_1d(attribute)]


def _series(group):
    series = {name: np.asarray(data, float) for name, data in group.items()}
    if "time" not in series or series["time"].size == 0:
        return {}
    if any(values.shape != series["time"].shape for values in series.values()):
        raise ValueError("series of different lengths")
    keep = _increasing(series["time"])
    return {name: values[keep] for name, values in series.items()}


def _increasing(times):
    """Indices of a strictly increasing subsequence: of rows at the same time the first is kept."""
    before = np.maximum.accumulate(np.concatenate([[-np.inf], times[:-1]]))
    return np.flatnonzero(times > before)


def _frames(path, group):
    frames = []
    for name in sorted(group):
        record = group[name]
        missing = [key for key in ("z", "r", "H", "K") if key not in record]
        if missing or "time" not in record.attrs:
            raise BadInput(f"{path}: frame {name} lacks {', '.join(missing) or 'its time'}")
        arrays = [np.asarray(record[key], float) for key in ("z", "r", "H", "K")]
        if any(array.ndim != 1 or array.shape != arrays[0].shape or array.size < 2 for array in arrays):
            raise BadInput(f"{path}: frame {name}: z, r, H, K must be lists of one length, 2 or more")
        if not all(np.isfinite(array).all() for array in arrays):
            raise BadInput(f"{path}: frame {name} holds numbers that are not finite")
        frames.append(Frame(float(record.attrs["time"]), *arrays))
    if not frames:
        return []
    return [frames[i] for i in _increasing(np.array([frame.time for frame in frames]))]
