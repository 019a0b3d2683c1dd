"""Commands that may have no more than 100 to 300 MB (`ulimit -v`): they do what they do with more, or say that memory ran out. No
crash, no hang; what was written opens, and goes on with more memory."""

import resource

from samples import SCAN, samples
from sandbox import Finding

STUDY = 4
CELL = b"""tier = "surface3d"
energy = {k20 = 1.0}
model = {kind = "stokes"}
shape = {kind = "ellipsoid", a = 1.0, b = 0.9, c = 1.3}
discretisation = {elements = 80, order = 3}
accuracy = {energy = 0.1}
time = {end = 0.01}
"""


def command(rng, box):
    kind, case, result = rng.choice([(s.kind, s.case, s.result) for s in samples(box.program)] + 4 * [("cell", CELL, None)])
    box.write("tube.toml" if kind == "scan" else "case.toml", case)
    if kind == "scan":
        return kind, SCAN
    if result and rng.random() < 0.3:
        box.write("case.hdf", result)
        return kind, rng.choice((("show", "case.hdf", "--csv"), ("stability", "case.hdf"), ("compare", "case.hdf", "case.hdf")))
    return kind, rng.choice((("run", "case.toml", "--quiet"),) * 4 + (("check", "case.toml"),))


def one(rng, box):
    if box.sanitized:
        return "sanitized"
    kind, arguments = command(rng, box)
    size = int(10 ** rng.uniform(5.0, 5.477)) << 10
    box.note(f"# ulimit -v {size >> 10}")
    done = box.run(*arguments, limit=15, statuses=(0, 2, 4, 127), prepare=lambda: resource.setrlimit(resource.RLIMIT_AS, (size, size)))
    if done.status == 127 and "shared libraries" not in done.err:  # the program itself does not fit
        raise Finding("exit-status", f"127: {done.err}")
    if done.status in (2, 4) and "memory" not in done.out + done.err and not (arguments[0] == "stability" and kind not in ("tube", "curve")):
        raise Finding("no-reason", f"{kind}, {size >> 10} KiB: exit {done.status}, but no word of memory: {(done.out + done.err)[:300]!r}")
    if arguments[0] == "run" and (box.folder / "case.hdf").exists():
        box.run("show", "case.hdf", statuses=(0,))
        if done.status == 4 and kind != "equilibrium":
            box.run("run", "case.toml", "--resume", "--quiet", statuses=(0,))
    return f"{kind}: exit {done.status}"
