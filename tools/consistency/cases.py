"""Cases as nested dicts: reads, changes and writes them as text for the program. Standard library only."""

import copy
import json
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


def text(node, path=()):
    """As TOML."""
    plain = {key: value for key, value in node.items() if not _is_table(value)}
    lines = [f"{key} = {json.dumps(value)}" for key, value in plain.items()]
    for key, value in node.items():
        name = ".".join((*path, key))
        if isinstance(value, dict):
            lines += ["", f"[{name}]", text(value, (*path, key))]
        elif _is_table(value):
            for entry in value:
                lines += ["", f"[[{name}]]", text(entry, (*path, key))]
    return "\n".join(lines)


def _is_table(value):
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))
