"""Calls of the Python package with arguments that nobody would pass, each in an interpreter of its own, and Ctrl-C during long ones.

No crash, no hang; a call returns, or raises one of the documented exceptions, with words. Without a changed argument it returns."""

import signal
import time

from samples import CASES, samples
from sandbox import Finding

STUDY = range(4, 9)
PYTHON = "/usr/bin/python3"
SETUP = """import copy, os, pathlib, pickle, signal, sys, warnings
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts jobs of the background without it
sys.path.insert(0, {package!r})
import numpy as np, tubule
warnings.simplefilter("ignore")
case, at_rest, surface = (tubule.Case(name + ".toml") for name in ("tube", "equilibrium", "surface"))
result, curve, cells = (tubule.read(name + ".hdf") for name in ("tube", "curve", "surface"))
long = case.with_(set={{"discretisation.elements": 8000, "discretisation.time_tolerance": 1e-12, "time.max_order": 1}})
loop = {{}}
loop["energy"] = loop
pathlib.Path("ready").touch()
try:
    {call}
    print("returned")
except KeyboardInterrupt:
    print("interrupted")
except BaseException as error:
    good = (ValueError, TypeError, OSError, RuntimeError) + ({more})
    print("raised" if isinstance(error, good) and not isinstance(error, RecursionError) and str(error) else "unexpected", repr(error)[:300])
finally:
    sys.stdout.flush()
    os._exit(0)
"""
# What is called, by its arguments.
CALLS = {
    "tubule.Case": {"source": "'tube.toml'", "set": "None"},
    "case.with_": {"set": "{'energy.k42': 0.2}"},
    "case.growth_rate": {"q": "[0.5, 1.0]", "m": "0", "tension": "None"},
    "case.energy_derivatives": {"H": "-1.0", "K": "0.0"},
    "tubule.run": {"case": "case", "output": "'new.hdf'", "overwrite": "False", "progress": "None", "threads": "0"},
    "tubule.run_many": {"cases": "[case, case]", "jobs": "2"},
    "tubule.equilibrium": {"case": "at_rest"},
    "tubule.compare": {"a": "result", "b": "result", "align": "False", "shapes": "True", "frames": "[(0, 1)]"},
    "tubule.scan": {"case": "case", "over": "{'energy.k42': [0, 0.1]}", "boundary": "None", "output": "'new.hdf'", "overwrite": "False", "jobs": "1", "to_the_end": "False"},
    "tubule.energy_density": {"H": "np.zeros(3)", "K": "1.0", "k20": "1", "H0": "0.5"},
    "tubule.curvatures": {"r": "1.0", "dr": "0.0", "d2r": "0.0", "dz": "1.0", "d2z": "0.0"},
    "tubule.read": {"file": "'tube.hdf'"},
    "result.frames.__getitem__": {"number": "0"},
    "result.series.__getitem__": {"name": "'energy'"},
    "result.frames[0].profile": {"points": "11"},
    "curve.frames[0].triangles": {"subdivide": "2"},
    "tubule.export": {"what": "curve", "output": "'new.stl'", "frame": "0", "subdivide": "1"},
    "tubule.draw": {"what": "result", "output": "None", "kind": "'energy'", "times": "()", "labels": "()", "series": "()", "x": "'time'", "dpi": "50"},
    "copy.deepcopy": {"x": "case"},
    "pickle.dumps": {"obj": "result"},
}  # fmt: skip
STABILITY = {"model": "''", "Re": "None", "gamma": "None", "tension": "None", "modes": "2", "waves": "None", "q": "None", "rates": "3", "frame": "None", "numerical": "False", "fit": "None"}
SUBJECTS = ("case", "at_rest", "surface", "result", "curve", "cells")
VALUES = (
    "None", "True", "0", "1", "-1", "-5", "2", "3", "1000", "10**6", "10**8", "10**9", "2**31", "2**63", "10**400", "0.5", "-1.0", "1e300", "-1e-300", "float('nan')", "float('inf')",
    "''", "'x'", "'all'", "'stokes'", "'stokse'", "'H'", "'1:2:3'", "'\\0'", "'\\udcff'", "b'x'", "'.'", "'/dev/full'", "'none/x.hdf'", "'energy.k42'", "()", "(1,)", "(1, 2)", "(1, 2, 3)", "[float('nan')]",
    "[[]]", "{}", "{'a': 1}", "{'energy.k42': [0, 0.1]}", "{'energy.k42': '0:1:3'}", "loop", "object()", "np.float64(1)", "np.longdouble(1)", "np.int64(2)", "np.zeros(0)", "np.arange(4.0)", "np.array('x')", "1j",
    "pathlib.Path('x.hdf')", "print", "lambda *a: 1", *SUBJECTS,
)  # fmt: skip
# Minutes, or endless, without Ctrl-C.
LONG = (
    "tubule.run(long)", "tubule.run(long, output='new.hdf')", "tubule.run_many([long] * 4, jobs=2)", "tubule.scan(long, {'energy.k42': '0:1:50'}, jobs=2)",
    "tubule.equilibrium(at_rest.with_(accuracy__energy=1e-11))", "tubule.run_many([case, long], jobs=1)", "tubule.run(surface.with_(discretisation__elements=20000))",
    "tubule.stability(curve, numerical=True, modes=100, rates=100)", "long.with_(model__kind='auto').forecast()", "tubule.run(long.with_(model__kind='auto'))",
)  # fmt: skip


def call(rng):
    """A call, whether an argument of it was changed, and which other exceptions it may raise."""
    name = "tubule.stability" if rng.random() < 0.3 else rng.choice([n for n in CALLS if n != "tubule.draw" or rng.random() < 0.3])
    arguments = dict(CALLS.get(name) or STABILITY | {"subject": rng.choice(SUBJECTS[:2] + SUBJECTS[3:5])})
    changed = rng.sample(list(arguments), min(rng.choice((0, 1, 1, 1, 2, 3)), len(arguments)))
    if name == "tubule.stability" and rng.random() < 0.2:
        arguments["numerical"] = "True"
    for argument in changed:
        arguments[argument] = rng.choice(VALUES)
    more = {"frames.__getitem__": "IndexError,", "series.__getitem__": "KeyError,", "frames[0]": "MemoryError,"}
    passed = ", ".join(f"{argument}={value}" for argument, value in arguments.items())
    return f"{name}({passed})", bool(changed), next((kind for part, kind in more.items() if part in name), "")


def started(box, words, more=""):
    package = str(box.program.parent / "python")
    script = box.write("call.py", SETUP.format(package=package, call=words, more=more))
    process = box.start("-B", script, program=PYTHON)
    while not (box.folder / "ready").exists() and process.poll() is None:
        time.sleep(0.01)
    return process


def one(rng, box):
    if not (box.program.parent / "python/tubule").exists() or box.sanitized:
        return "not built"
    for sample in samples(box.program):
        if sample.kind in CASES:
            box.write(f"{sample.kind}.toml", sample.case)
            box.write(f"{sample.kind}.hdf", sample.result)
    if rng.random() < 0.25:
        words = rng.choice(LONG)
        process = started(box, words)
        time.sleep(rng.choice((0.01, 0.3, 1.0)))
        process.send_signal(signal.SIGINT)
        box.judged(process, (words, "Ctrl-C"), statuses=(0,), limit=8)
        return "Ctrl-C"
    words, changed, more = call(rng)
    done = box.judged(started(box, words, more), (words,), statuses=(0,), limit=20)
    how = done.out.split(" ", 1)[0].strip()
    if how not in ("returned", "raised") or (how == "raised" and not changed):
        raise Finding("exception", f"{words}: {done.out}{done.err[-500:]}")
    return how
