#!/usr/bin/python3
"""Functions of the package with arguments at random: each call answers or says what is wrong with it, soon, or hears Ctrl-C.

    arguments_test.py PACKAGES [CALLS [SEED]]

Each call is made by a process of its own: one that crashes is a failure here, and not the end of the test.
"""
import os
import random
import select
import signal
import sys
import tempfile
import traceback
import unittest
from pathlib import Path

sys.path.insert(0, sys.argv[1])
CALLS = int(sys.argv[2]) if len(sys.argv) > 2 else 150
SEED = int(sys.argv[3]) if len(sys.argv) > 3 else 36

import matplotlib.figure  # noqa: F401  once, rather than in each process
import numpy as np
import tubule
from tubule.drawing import plot  # noqa: F401

ITSELF = {"tier": "axisym"}
ITSELF["energy"] = ITSELF
TUBE = {
    "tier": "axisym",
    "energy": {"k20": 0.5, "H0": -1, "k42": 0.1},
    "shape": {"kind": "tube", "radius": 1, "length": 3, "mode": [{"amplitude": 0.12, "n": 1}]},
    "accuracy": {"energy": 1e-3},
    "time": {"end": 0.02},
}
CELL = TUBE | {"shape": {"kind": "ellipsoid", "a": 1, "b": 1, "c": 1.5}}
NONSENSE = [None, True, -1, 0, 1, 2, 3, 77, -5, 10**4, 10**6, 10**9, 2**31, 2**40, -2**70, 0.5, -2.5, 1e-300, 1e308, -1e200, float("nan"),
            float("inf"), -float("inf"), 1j, "", "x", "all", "-1", "a\0b", "\ud800", "z" * 300, "\n", b"x", b"\xff", [], [0], [1, 2, 3], ["x"], [None],
            [float("nan")], [[1]], (), (1,), (2, 1), (1, 2, 3), (10**9, 5), range(4), {}, {"a": 1}, {1: 2}, ITSELF, {"x": [0]}, object(), print, Path("x"),
            np.float64(0.1), np.int64(3), np.longdouble(1), np.array([1.0, 2.0]), np.array([]), np.zeros((2, 2)), np.array("x")]  # fmt: skip
SAID = (ValueError, TypeError, IndexError, KeyError)
PATIENCE, HEARS = 2.0, 1.5  # seconds


class Calls:
    """Functions with arguments that they take; made once, as results take a moment."""

    def __init__(self):
        self.case, self.cell = tubule.Case(TUBE), tubule.Case(CELL)
        self.result = tubule.run(TUBE, threads=1)
        frame, stability = self.result.frames[0], dict(Re=None, gamma=None, tension=None, waves=3, q=None, frame=None, fit=None, model="", rates=2,
                                                       modes=1, numerical=False)  # fmt: skip
        self.all = [
            (tubule.Case, dict(source=TUBE, set={"energy.k42": 0.2})),
            (self.case.with_, dict(set={"energy.k42": 0.2})),
            (self.case.energy_density, dict(H=-1.0, K=0.5)),
            (self.case.growth_rate, dict(q=[0.5, 1.0], m=1, tension=0.2)),
            (tubule.energy_density, dict(H=-1.0, K=0.5, k20=1, H0=0.1)),
            (tubule.curvatures, dict(r=[1.0, 2.0], dr=0.0, d2r=0.0, dz=1.0, d2z=0.0)),
            (tubule.run, dict(case=TUBE, output="out.hdf", overwrite=False, progress=None, threads=1)),
            (tubule.run_many, dict(cases=[TUBE, TUBE], jobs=2)),
            (tubule.equilibrium, dict(case={k: v for k, v in CELL.items() if k != "time"} | {"equilibrium": {"area": 12.5, "reduced_volume": 0.95}})),
            (tubule.stability, dict(subject=self.case) | stability),
            (tubule.stability, dict(subject=self.cell) | stability | dict(waves=None)),
            (tubule.stability, dict(subject=self.result) | stability | dict(waves=None, fit=(1,), rates=3, modes=2)),
            (tubule.compare, dict(a=self.result, b=self.result, align=False, shapes=True, frames=[(0, 0)])),
            (tubule.scan, dict(case=TUBE, over={"energy.k42": [0, 0.1]}, boundary=None, output="scan.hdf", overwrite=False, jobs=1, to_the_end=False)),
            (tubule.read, dict(file="missing.hdf")),
            (tubule.draw, dict(what=self.result, output=None, kind="energy", times=[0.0], colour=["H"], labels=["a"], plane=("z", 0.0), scale="run",
                               series=(), x="time", logx=False, logy=False, quantity="", slices=(), camera=(0, 90), width=3.4, dpi=100)),  # fmt: skip
            (self.result.frames.__getitem__, dict(number=0)),
            (self.result.series.__getitem__, dict(name="energy")),
            (frame.profile, dict(points=5)),
            (frame.triangles, dict(subdivide=2)),
            (tubule.export, dict(what=self.result, output="new.stl", frame=0, subdivide=1)),
        ]

    def random(self, rng):
        """A function, and arguments of which one or two are at random."""
        function, arguments = rng.choice(self.all)
        changed = {name: rng.choice(NONSENSE) for name in rng.sample(list(arguments), min(len(arguments), rng.choice((1, 1, 2))))}
        return function, arguments | changed, changed


def outcome(function, arguments, refusals):
    """"" if all is as it should be."""
    try:
        function(**arguments)
    except KeyboardInterrupt:
        return "" if refusals else "takes long"
    except BaseException as error:
        is_said = type(error) in (RuntimeError, tubule.SolveError) or isinstance(error, refusals)  # Python's RecursionError is not
        return "" if refusals and is_said and str(error) else traceback.format_exc()
    return ""


def outcome_in_a_process(*call):
    """The same, or how the process ended."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(write, outcome(*call).encode(errors="replace")[-4000:])
        os._exit(0)
    os.close(write)
    if not select.select([read], [], [], PATIENCE)[0]:  # neither words nor the end of the process
        os.kill(child, signal.SIGINT)
        if not select.select([read], [], [], HEARS)[0]:
            os.kill(child, signal.SIGKILL)
    words = os.read(read, 4000).decode()
    os.close(read)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return f"did not hear Ctrl-C after {PATIENCE} s" if status == -signal.SIGKILL else f"ended by signal {-status}" if status else words


class Arguments(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        before = os.getcwd()
        os.chdir(folder)
        cls.addClassCleanup(os.chdir, before)
        cls.calls = Calls()

    def test_the_arguments_that_are_not_changed_are_good(self):
        for function, arguments in self.calls.all:
            if function is not tubule.read:
                with self.subTest(function=function.__name__):
                    self.assertEqual(outcome_in_a_process(function, arguments, ()), "")

    def test_at_random(self):
        rng = random.Random(SEED)
        for _ in range(CALLS):
            function, arguments, changed = self.calls.random(rng)
            with self.subTest(function=function.__name__, changed=f"{changed!r:.300}"):
                self.assertEqual(outcome_in_a_process(function, arguments, SAID), "")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
