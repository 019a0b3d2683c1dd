"""Cases: from TOML text, files and dictionaries."""

from __future__ import annotations

import json
import math
import os
import re
from typing import Any, Mapping, Union

from . import _core

_BARE = re.compile(r"[A-Za-z0-9_-]+\Z")


def _key(name: str) -> str:
    if not isinstance(name, str):
        raise TypeError(f"a key of a case must be a text, not {name!r}")
    return name if _BARE.match(name) else _text(name)


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML has JSON's texts, but for that character


MOST_LEVELS = 50  # of tables and lists within one another


def toml_value(value: Any, levels: int = MOST_LEVELS) -> str:
    """A Python value as TOML: numbers (also NumPy's), texts, truth values, sequences and mappings.

    Raises TypeError for anything else, and ValueError for numbers that are not finite and for more than `levels` of tables
    and lists within one another.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, os.PathLike):
        return _text(file_name(value))
    if levels < 0:
        raise ValueError(f"a case has at most {MOST_LEVELS} levels of tables and lists: does one contain itself?")
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(k)} = {toml_value(v, levels - 1)}" for k, v in value.items() if v is not None) + "}"
    if hasattr(value, "tolist"):  # NumPy's numbers and arrays
        plain = value.tolist()
        if hasattr(plain, "tolist"):  # as of longdouble, which Python has not
            raise TypeError(f"a case has no values of type {type(value).__name__}: give float(value)")
        return toml_value(plain, levels)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"a case has finite numbers only, not {value}")
        return repr(value)
    if isinstance(value, (list, tuple, range)):
        return "[" + ", ".join(toml_value(v, levels - 1) for v in value) + "]"
    raise TypeError(f"a case has no values of type {type(value).__name__}")


def to_toml(case: Mapping[str, Any]) -> str:
    """A dictionary as a case file: one line for each key."""
    return "".join(f"{_key(k)} = {toml_value(v)}\n" for k, v in case.items() if v is not None)


def file_name(path: str | os.PathLike) -> str:
    """A path as text. Raises TypeError for what is no path, ValueError for what is no name of a file."""
    name = os.fsdecode(path)
    if not name or "\0" in name or name != name.encode(errors="replace").decode():
        raise ValueError(f"{name!r} is no name of a file: it is empty, or has characters that are not Unicode")
    return name


def as_mapping(name: str, value) -> Mapping:
    if not isinstance(value, Mapping):
        raise TypeError(f"{name} must be a dictionary, not of type {type(value).__name__}")
    return value


class Case:
    """A valid case.

    source  a dictionary, a path of a case file, or TOML text (which has a line break)
    set     overrides by dotted key, such as {"energy.k42": 0.06}; each as `--set` of the program

    Raises CaseError, with place, reason and suggestion for everything that is wrong.

    >>> case = Case({"tier": "axisym", "energy": {"k20": 1},
    ...              "shape": {"kind": "tube", "radius": 1, "length": 9, "mode": [{"amplitude": 0.1, "n": 1}]},
    ...              "time": {"end": 0.1}})
    >>> case.with_(energy__k42=0.06).toml.splitlines()[3]
    'k20 = 1'
    """

    def __init__(self, source: Union[Mapping[str, Any], str, os.PathLike], set: Mapping[str, Any] | None = None):
        sets = _sets(set or {})
        if isinstance(source, Mapping):
            self._core = _core.parse_case(to_toml(source).encode(), sets, "case")
        elif isinstance(source, str) and "\n" in source:
            self._core = _core.parse_case(source.encode(), sets, "case")
        else:
            self._core = _core.read_case(file_name(source), sets)

    @classmethod
    def _parsed(cls, text: str, sets: list[str], path: str) -> "Case":
        return cls._of(_core.parse_case(text, sets, path))

    @classmethod
    def _of(cls, core: _core.Case) -> "Case":
        case = cls.__new__(cls)
        case._core = core
        return case

    def __reduce__(self):
        return Case._parsed, (self._core.text, self._core.sets, self._core.path)

    def with_(self, set: Mapping[str, Any] | None = None, **keys: Any) -> "Case":
        """The case with other values: `set` as for Case, or keywords with __ for the dots."""
        more = dict(as_mapping("set", set or {})) | {key.replace("__", "."): value for key, value in keys.items()}
        return Case._parsed(self._core.text, self._core.sets + _sets(more), self._core.path)

    @property
    def toml(self) -> str:
        """The whole case as TOML: overrides applied, defaults written out."""
        return self._core.toml

    @property
    def units(self) -> dict:
        """What a number of the case stands for, by its dimensions: {"energy": {"scale": 20.0, "unit": "kT"}, ...}.

        Empty without a table [units]; as long as the unit of time is not known, without those of rates and the like.
        """
        return json.loads(self._core.units)

    def forecast(self) -> dict:
        """What a run is expected to take: resolution, steps, seconds, bytes (None where that is not known)."""
        return _core.forecast(self._core)

    def energy_density(self, H, K):
        """f(H, K) of the case, for numbers or arrays that broadcast."""
        return _core.density(self._core, H, K)["f"]

    def energy_derivatives(self, H, K) -> dict:
        """f and its derivatives f_H, f_K, f_HH, f_HK, f_KK."""
        return _core.density(self._core, H, K)

    def growth_rate(self, q, m: int = 0, tension: float | None = None):
        """The rate of waves exp(i(q z + m theta)) on the straight tube of the case, in closed form (theory.md, section 5).

        The largest real part; `tension` replaces that of the case.
        """
        return _core.growth_rates(self._core, q, m, tension)

    def __repr__(self) -> str:
        return f"<tubule.Case {self._core.title or self._core.path!r}>"


def _sets(values: Mapping[str, Any]) -> list[bytes]:
    return [f"{key}={toml_value(value)}".encode() for key, value in as_mapping("set", values).items()]


def case_with_units(text: str, sets: list, path: str, units: str) -> Case:
    """A case with changes of its table [units]: "length=50 nm,bending_rigidity=20 kT"."""
    return Case._parsed(text, [*sets, *(f"units.{part}" for part in units.split(",") if part)], path)


def as_case(case) -> Case:
    return case if isinstance(case, Case) else Case(case)
