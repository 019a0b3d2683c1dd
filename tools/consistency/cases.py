"""Cases as nested dicts."""

import copy
import tomllib
from pathlib import Path

CASES = Path(__file__).resolve().parents[2] / "cases"


def case(name, **changes):
    """cases/NAME.toml without its expectations. `changes` are tables: a dict is merged, a list (modes) replaces, None removes."""
    out = tomllib.loads((CASES / f"{name}.toml").read_text())
    out.pop("expect", None)
    return changed(out, **changes)


def changed(original, **changes):
    out = copy.deepcopy(original)
    for key, value in changes.items():
        if value is None:
            out.pop(key, None)
        elif isinstance(value, dict):
            out[key] = changed(out.get(key, {}), **value)
        else:
            out[key] = value
    return out
