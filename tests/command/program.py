"""What the tests of the command share: running it, in a folder of its own, and reading its results."""
import contextlib
import csv
import io
import os
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import h5py

PROGRAM = sys.argv[1]
# Seconds long, and like another test: `tools/check --study` runs it.
study = unittest.skipUnless(os.environ.get("TUBULE_STUDY"), "a study")
ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/support"))

# A wavy tube without symmetry that is solved in a moment: 0.02 s.
QUICK = """tier = "axisym"
[about]
title = "A quick one"
[energy]
k20 = 0.5
H0 = -1.0
k42 = 0.1
[shape]
kind = "tube"
radius = 1.0
length = 3.0
[[shape.mode]]
amplitude = 0.12
n = 1
phase = 0.3
[[shape.mode]]
amplitude = 0.05
n = 2
phase = 1.1
[accuracy]
energy = 1e-6
[time]
end = 0.2
output = [0.01, 0.05]
"""

# The same with thousands of steps, half a second or so, and 400 frames. Explicit settings: it never begins again.
SLOW = QUICK.replace("[0.01, 0.05]", str([i / 2000 for i in range(1, 400)]) + "\nmax_order = 2") + """
[discretisation]
elements = 40
time_tolerance = 1e-11
"""

# A tube that pearls, pinches or relaxes, as its amplitude and k42 have it: the case of scans.
UNDULATED_TUBE = """tier = "axisym"
[energy]
k20 = 0.2
H0 = -2.0
[shape]
kind = "tube"
radius = 1.0
length = 2.0
[[shape.mode]]
amplitude = 0.3
n = 1
[accuracy]
r_min = 0.05
[discretisation]
parametrisation = "graph"
[time]
end = 20.0
stationary = 1e-6
"""

# A tubular cell at rest; to be completed by what is asked of it.
CAPSULE = """tier = "axisym"
[energy]
k20 = 0.125
H0 = -2.0
k42 = 0.12
[shape]
kind = "capsule"
radius = 0.5
length = 2.0
[accuracy]
energy = 1e-8
[equilibrium]
"""

ACCURACY, E_REF = 1e-6, 24.5  # E_ref is printed by the program; tests/axisym checks it against its definition

# Its energy falls by 1.6 % of E_ref. docs/model_differences.csv, Re = 2, gamma = 300: overdamped, it differs by 5.2e-4 from
# the fluid, which is expected to be 8e-4; Stokes likewise. At gamma = 30 they differ by 6e-3, expected to be 1.3e-2.
OBLATE = """tier = "axisym"
[energy]
k20 = 1.0
k42 = 0.05
[model]
kind = "fluid"
Re = 2.0
gamma = 300.0
[shape]
kind = "ellipsoid"
a = 1.0
b = 1.0
c = 0.6
[accuracy]
energy = 2e-3
[time]
end = 45.0
"""


def series(result):
    with h5py.File(result) as file:
        return {name: data[:] for name, data in file["series"].items()}


def rows_of(result):
    """How many rows a result has so far."""
    if not result.exists():
        return 0
    with h5py.File(result) as file:
        return len(file["series/time"]) if "series/time" in file else 0


def finished_points(result):
    """How many points of a scan are known so far."""
    if not result.exists():
        return 0
    with h5py.File(result) as file:
        return int((file["points/outcome"][()] != 0).sum())


def about(result):
    with h5py.File(result) as file:
        return dict(file["about"].attrs)


class ProgramTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.case = self.write("case.toml", QUICK)
        self.result = self.folder / "case.hdf"

    def write(self, name, text):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        return path

    def files(self):
        return {path.name for path in self.folder.iterdir()}

    def start(self, *arguments, **options):
        return subprocess.Popen([PROGRAM, *map(str, arguments)], cwd=self.folder, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, **options)  # fmt: skip

    def tubule(self, *arguments, status=0):
        """Runs the program to its end; what it printed on stdout, on stderr."""
        with self.start(*arguments) as process:
            out, err = process.communicate()
        self.assertEqual(process.returncode, status, f"tubule {arguments}\n{out}{err}")
        return out, err

    def plot(self, *arguments, status=0, command="plot"):
        """What `tubule plot` does, in a fork that need not import its libraries; what it printed on stdout, on stderr."""
        import scripts

        with contextlib.chdir(self.folder):
            done = scripts.run_script(ROOT / "tools/python/tubule/drawing", command, *arguments)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout, done.stderr

    def wait(self, process, ready):
        """Until ready(), which only reads files: a process started at each look takes more time than the run."""
        self.addCleanup(process.kill)
        while not ready():
            self.assertIsNone(process.poll(), "it ended before it could be disturbed")
            time.sleep(0.01)

    def refused(self, *arguments):
        """The message with which the program refuses the arguments; no file may change."""
        before = self.files()
        out, err = self.tubule(*arguments, status=2)
        self.assertEqual(out, "")
        self.assertEqual(self.files(), before)
        return err

    def shown(self, result):
        """The series as `tubule show --csv` gives them: header, rows of strings."""
        rows = list(csv.reader(io.StringIO(self.tubule("show", result, "--csv")[0])))
        return rows[0], rows[1:]
