"""What the pictures of docs/ are made of: are they still what their commands make?

A figure is a function that calls programs. Tracing it without running anything gives its inputs: the words of its commands,
the case files, tables and scripts among them, what these name or import in turn, and its pictures. docs/figures.json has
hashes of them from when the pictures were drawn. What the program computed is kept as numbers, since these are compared
within their errors.
"""

import ast
import hashlib
import json
import tomllib
from pathlib import Path

DRAWERS = {"plot": "plot.py", "chart": "chart.py", "compare": "compare.py", "stability": "stability.py", "view": "view.py"}
OTHER_PURPOSES = {"movie"}  # modules that no picture needs
SAME = 1e-3  # relative difference of numbers that a picture does not show


def digest(text):
    return hashlib.sha256(text if isinstance(text, bytes) else text.encode()).hexdigest()[:12]


def code_of(path):
    """What a Python script does: without comments, layout and docstrings."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
            body[0].value.value = ""
    return ast.dump(tree)


def content(path):
    if path.suffix == ".py" or path.read_bytes()[:20].startswith(b"#!/usr/bin/python3"):
        return digest(code_of(path))
    if path.suffix == ".toml":
        return digest(json.dumps(tomllib.loads(path.read_text()), sort_keys=True, default=str))
    return digest(path.read_bytes())


def named_by(path):
    """Files that this one needs: modules beside it, the case of a chart or scan."""
    if path.suffix == ".py":
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names += [node.module] if node.module else [alias.name for alias in node.names]
            yield from (path.parent / f"{name}.py" for name in names if name not in OTHER_PURPOSES)
    elif path.suffix == ".toml":
        case = tomllib.loads(path.read_text()).get("case")
        if isinstance(case, str):
            yield path.parent / case


def with_all_they_name(paths):
    found, left = set(), [path.resolve() for path in paths]
    while left:
        path = left.pop()
        if path not in found and path.is_file():
            found.add(path)
            left += [other.resolve() for other in named_by(path)]
    return found


class Trace:
    """Commands of a figure. Its inputs and pictures are paths below `top`; what lies in `build` and `work` is made on the way."""

    def __init__(self, top, build, work):
        self.top, self.made = top, (build, work)
        self.commands, self.inputs, self.pictures, self.results = [], set(), set(), []

    def command(self, words):
        """Takes note of a command."""
        self.commands.append(" ".join(self._placed(str(word)) for word in words))
        before = ""
        for word in words:
            path = Path(str(word))
            if before in ("-o", "--plot"):
                self.makes(path)
            elif path.is_absolute() and self._is_source(path):
                self.inputs.add(path)
            before = str(word)
        if Path(words[0]).name == "tubule" and (drawer := DRAWERS.get(str(words[1]))):
            self.inputs.add(self.top / "tools/python/tubule/drawing" / drawer)

    def makes(self, path):
        if path.suffix == ".hdf":
            self.results.append(path)
        elif self._is_source(path):
            self.pictures.add(path)

    def _placed(self, word):
        for path, name in zip((*self.made, self.top), ("BUILD", "WORK", "TOP")):
            word = word.replace(str(path), name)
        return word

    def _is_source(self, path):
        return path.is_relative_to(self.top) and not any(path.is_relative_to(folder) for folder in self.made)

    def hashes(self):
        """Of the commands, of each input and each picture, by name."""
        files = sorted(with_all_they_name(self.inputs - self.pictures) | {p for p in self.pictures if p.is_file()})
        return {"commands": digest("\n".join(self.commands))} | {
            str(path.relative_to(self.top)): content(path) for path in files
        }


def changes(recorded, now):
    """Names of what is not as it was."""
    return [name for name in {**recorded, **now} if recorded.get(name) != now.get(name)]


def numbers_of(path):
    """Of a result: its last row; of a scan: how many points have which outcome."""
    import h5py

    with h5py.File(path) as file:
        if "points" in file:
            outcome = file["points/outcome"]
            names = [name.decode() if isinstance(name, bytes) else str(name) for name in outcome.attrs["names"]]
            return {name: int((outcome[()] == index).sum()) for index, name in enumerate(names)}
        series = file["series"]
        names = ("time", "energy", "area", "volume", "energy_error")
        return {name: float(f"{series[name][-1]:.7g}") for name in names if len(series[name])}


def differing(recorded, now):
    """Names of numbers that differ by more than a picture hides."""
    error = abs(recorded.get("energy_error", 0)) + abs(now.get("energy_error", 0))
    for name, value in recorded.items():
        if name != "energy_error" and abs(now.get(name, float("inf")) - value) > SAME * abs(value) + error + 1e-9:
            yield f"{name} was {value:g}, is {now.get(name):g}" if name in now else f"{name} is missing"
