"""Runs that go on after the file that they began from (a profile, a mesh, a result) was changed, replaced, damaged, lost, or written
again with the same contents.

What changed is refused by its name, and the result stays as it is; the same contents go on. Whatever goes on keeps its first row."""

import csv
import io
import math

import meshes
import starts
import toml
from samples import samples
from sandbox import Finding

STUDY = 8
CHANGES = ("same", "same", "other", "other", "a little", "broken", "gone", "folder")
END = 1e-3


def profile(rng, box):
    points, length = rng.choice((starts.spheroid, starts.ring, starts.tube))(rng)
    keys = {"kind": "profile", "path": "start.csv"} | ({"length": length} if length else {})
    return keys, "".join(f"{r!r}, {z!r}\n" for r, z in points).encode()


def mesh(rng, box):
    points, faces = meshes.sphere(4)
    stretch = [rng.uniform(0.8, 1.3) for _ in range(3)]
    return {"kind": "file", "path": "start.obj"}, meshes.obj([[x * s for x, s in zip(p, stretch)] for p in points], faces).encode()


def frame(rng, box):
    found = {sample.kind: sample.result for sample in samples(box.program)}
    return {"kind": "result", "path": "start.hdf"}, found[rng.choice(("tube", "curve"))]


def changed(rng, box, kind, before):
    """Other contents for the file; of results "a little" is none, since their numbers have checksums."""
    made = {"profile": profile, "file": mesh, "result": frame}[kind]
    if kind == "result":
        return next(other for _, other in iter(lambda: made(rng, box), None) if other != before)
    return made(rng, box)[1]


def a_little(rng, before):
    """One coordinate, changed by less than the tolerance of a fit."""
    lines = before.split(b"\n")
    at = rng.randrange(1, len(lines) // 3)
    words = lines[at].replace(b",", b"").split()
    words[-1] = repr(float(words[-1]) * (1 + 1e-5) + 1e-7).encode()
    lines[at] = (b" " if b"v" in lines[at] else b", ").join(words)
    return b"\n".join(lines)


def first_row(box):
    return next(csv.DictReader(io.StringIO(box.run("show", "case.hdf", "--csv", statuses=(0,)).out)))


def one(rng, box):
    shape, before = rng.choice((profile, profile, mesh, frame))(rng, box)
    path = box.write(shape["path"], before)
    tier = "surface3d" if shape["kind"] == "file" or (before.startswith(b"0.0,") and rng.random() < 0.4) else "axisym"  # a closed cell
    case = {"tier": tier, "energy": {"k20": 0.5}, "model": {"kind": rng.choice(("gradient-flow", "overdamped"))}, "shape": shape}
    case |= {"accuracy": {"energy": 0.05}, "time": {"end": END, "limit": 20}}
    if tier == "surface3d" and shape["kind"] != "file":
        case["discretisation"] = {"elements": 80, "order": 3}
    box.write("case.toml", toml.dump(case))
    began = box.run("run", "case.toml", "--quiet", limit=60)
    if began.status != 0:
        return f"exit {began.status} at first"
    row, result = first_row(box), (box.folder / "case.hdf").read_bytes()
    change = rng.choice(CHANGES)
    if change == "a little" and shape["kind"] == "result":
        change = "other"
    path.unlink()
    match change:
        case "same":
            box.write(path.name, before)
        case "other":
            box.write(path.name, changed(rng, box, shape["kind"], before))
        case "a little":
            box.write(path.name, a_little(rng, before))
        case "broken":
            box.write(path.name, before[: rng.randrange(len(before) // 2)] + bytes(rng.randrange(256) for _ in range(9)))
        case "folder":
            path.mkdir()
    box.note(f"# {path.name}: {change}")
    source = rng.choice((("case.hdf",), ("case.toml", "--set=time.end=2e-3"))) if tier == "axisym" else ("case.hdf",)
    until = () if len(source) > 1 else ("--until", str(2 * END))
    done = box.run("run", *source, "--resume", *until, "--quiet", limit=60)
    return judged(box, change, path.name, done, row, result)


def judged(box, change, name, done, row, result):
    if done.status == 2:
        if change == "same":
            raise Finding("refused", f"the same {name} is refused: {done.err}")
        if name not in done.err:
            raise Finding("no-place", f"{change}: refused without its name: {done.err}")
        if (box.folder / "case.hdf").read_bytes() != result:
            raise Finding("written", f"{change}: refused, yet the result has changed")
        return f"{change}: refused"
    if change in ("other", "a little", "broken"):
        raise Finding("mixed", f"{name} has changed ({change}), yet the run goes on: exit {done.status}")
    after = first_row(box)
    if not math.isclose(float(after["energy"]), float(row["energy"]), rel_tol=0.1):
        raise Finding("mixed", f"{change}: the first row is now {after}, it was {row}")
    return f"{change}: exit {done.status}"
