#!/usr/bin/python3
"""`tubule confirm`: points of a scan again in three dimensions, few triangles, short.

confirm_test.py TUBULE [MPIRUN]
"""
import csv
import io
import json
import math
import os
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

MPIRUN = sys.argv[2] if len(sys.argv) > 2 else None

from program import PROGRAM, ProgramTest, study

# A tube with the area of a short wave too many, at fixed area and volume: with c = H0 R = -1 it keeps that wave, with
# H0 = 0 it stores the area better by flattening, m = 2, which tier 1 cannot see.
LENGTH, AMPLITUDE = 4.0, 0.1
CASE = f"""tier = "axisym"
energy = {{k20 = 1.0}}
model = {{kind = "overdamped"}}
shape = {{kind = "tube", radius = 1.0, length = {LENGTH}, mode = [{{amplitude = {AMPLITUDE}, n = 1}}]}}
accuracy = {{energy = 1e-4}}
time = {{end = 0.7, stationary = 1e-6}}
"""
FEW, COARSE = ("--elements", "40"), ("--elements", "180")
X = (2 * math.pi / LENGTH) ** 2  # q^2 of the wave


def flattening_rate(c):
    """theory.md (5.9), q = 0, m = 2, R = k20 = 1: G = 18 + 6 Sigma; Sigma makes G = 0 for the wave of m = 0."""
    return -0.8 * (18 + 6 * -(X * X + 2 * c * X + 1) / (X - 1))


class Confirm(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("case.toml", CASE)
        self.scan = self.folder / "scan.hdf"
        self.tubule("scan", "case.toml", "--over", "energy.H0=-1,0", "-o", self.scan)

    def test_one_point_agrees_and_one_flattens(self):
        out, _ = self.tubule("confirm", self.scan, *FEW, "--csv", "--quiet", status=1)
        keeps, flattens = csv.DictReader(io.StringIO(out))  # all there are
        self.assertEqual((keeps["set"], flattens["set"]), ("energy.H0=-1", "energy.H0=0"))
        for row in keeps, flattens:
            self.assertEqual((row["axisym_outcome"], row["stop"]), ("unduloid", "finished"))
            self.assertAlmostEqual(float(row["noise"]), 1e-3, delta=1e-4)  # the default

        self.assertEqual((keeps["verdict"], keeps["outcome"]), ("agrees", "unduloid"))
        self.assertLess(abs(float(keeps["energy_difference"])), 1e-3)
        self.assertLess(float(keeps["fastest_rate_m1"]), 0)
        self.assertAlmostEqual(float(keeps["fastest_rate_m2"]), flattening_rate(-1), delta=1e-6)
        self.assertLess(flattening_rate(-1), 0)

        self.assertEqual((flattens["verdict"], flattens["outcome"]), ("symmetry-broken", "asymmetric"))
        self.assertEqual((flattens["n"], flattens["m"]), ("0", "2"))
        self.assertAlmostEqual(float(flattens["fastest_rate_m2"]), flattening_rate(0), delta=1e-6)
        # Linear theory neglects squares of the amplitude 0.1, and its tension falls while the wave decays.
        self.assertAlmostEqual(float(flattens["rate"]) / flattening_rate(0), 1, delta=0.15)
        self.assertAlmostEqual(float(flattens["rate"]) / float(flattens["linear_rate"]), 1, delta=0.15)
        # SUM (Q - 1) a^2 is kept, theory.md (5.14): no more than all of it can go from the wave to the ellipse, where
        # Q - 1 = 3.
        most = AMPLITUDE * math.sqrt((X - 1) / 3)
        self.assertTrue(0.7 * most < float(flattens["amplitude"]) < 1.1 * most, flattens["amplitude"])

        # A second call runs nothing; text and JSON agree.
        before = {path: path.stat().st_mtime_ns for path in (self.folder / "scan_confirm").glob("*.hdf")}
        self.assertEqual(len(before), 2)
        out, _ = self.tubule("confirm", self.scan, *FEW, "--quiet", status=1)
        self.assertIn("1 of 2 points agree", out)
        self.assertEqual(out.count("grows, and tier 1 cannot see it"), 2)  # m = 1 does so, too
        out, _ = self.tubule("confirm", self.scan, *FEW, "--json", "--quiet", status=1)
        self.assertEqual({path: path.stat().st_mtime_ns for path in before}, before)
        point = json.loads(out)["points"][1]
        self.assertEqual(point["set"], ["energy.H0=0"])
        self.assertEqual(point["values"]["rate"], float(flattens["rate"]))

        self.assert_refusals()

    def assert_refusals(self):
        kept = set((self.folder / "scan_confirm").iterdir())
        for words, *arguments in (
            ("--points must be 1 or more, not 0", "--points", "0"),
            ("--elements must be an integer from 20 to 1000000, not 0", "--elements", "0"),
            ("--noise must be above 0 and below 0.1", "--noise", "0.5"),
            ("--end must be above 0", "--end", "-1"),
        ):
            self.assertIn(words, self.tubule("confirm", self.scan, *arguments, status=2)[1])
        self.assertIn("not a result of tubule scan", self.tubule("confirm", "case.toml", status=2)[1])
        self.assertEqual(set((self.folder / "scan_confirm").iterdir()), kept)

    @study
    def test_under_a_force(self):
        # Area and volume are kept, the period is free: theory.md (3.22) gives the tension, (5.9) the rate of the ring.
        self.write("case.toml", CASE.replace('"overdamped"', '"overdamped", period = "free"')
                   .replace(f"amplitude = {AMPLITUDE}", "amplitude = 0.01").replace("0.7", "1.5"))  # fmt: skip
        pushed, pulled = -3 * math.pi, 3 * math.pi
        self.tubule("scan", "case.toml", "--over", f"model.force={pushed},{pulled}", "-o", self.folder / "force.hdf")
        out, _ = self.tubule("confirm", "force.hdf", *FEW, "--noise", 1e-4, "--csv", "--quiet", status=1)
        ring, tube = csv.DictReader(io.StringIO(out))
        for row, force in ((ring, pushed), (tube, pulled)):
            rate = -0.8 * (15 + 3 * (force / math.pi - 3))
            self.assertAlmostEqual(float(row["fastest_rate_m2"]), rate, delta=1e-6)
        self.assertEqual((tube["verdict"], tube["outcome"]), ("agrees", tube["axisym_outcome"]))
        self.assertEqual((ring["verdict"], ring["n"], ring["m"]), ("symmetry-broken", "0", "2"))
        self.assertAlmostEqual(float(ring["linear_rate"]), 2.4, delta=1e-3)
        self.assertAlmostEqual(float(ring["rate"]) / 2.4, 1, delta=0.1)


VESICLE = """tier = "axisym"
energy = {k20 = 0.5}
shape = {kind = "ellipsoid", a = 1.0, b = 1.0, c = 1.5}
accuracy = {energy = 1e-6}
equilibrium = {reduced_volume = 0.9, area = 12.566370614359172}
"""


class Equilibria(ProgramTest):
    def test_a_prolate_is_stable_and_an_oblate_flattens(self):
        # Oblates above v = 0.7497 are unstable against m = 2: cases/surface_branch_triaxial.toml.
        self.write("vesicle.toml", VESICLE)
        self.tubule("scan", "vesicle.toml", "--over", 'equilibrium.family="prolate","oblate"', "-o", "scan.hdf")
        out, _ = self.tubule("confirm", "scan.hdf", *COARSE, "--csv", "--quiet", status=1)
        prolate, oblate = csv.DictReader(io.StringIO(out))
        self.assertEqual(prolate["set"], 'equilibrium.family="prolate"')
        self.assertEqual((prolate["verdict"], prolate["growing"]), ("agrees", "none"))
        self.assertEqual((oblate["verdict"], oblate["growing"], oblate["axisym_growing"]), ("symmetry-broken", "2", "2"))
        for row in prolate, oblate:
            self.assertLess(abs(float(row["energy_difference"])), 1e-3)
            self.assertAlmostEqual(float(row["rate"]) / float(row["axisym_rate"]), 1, delta=0.03)
        before = {path: path.stat().st_mtime_ns for path in (self.folder / "scan_confirm").glob("*.hdf")}
        self.assertEqual(len(before), 4)
        self.assertIn("1 of 2 points agree", self.tubule("confirm", "scan.hdf", *COARSE, "--quiet", status=1)[0])
        self.assertEqual({path: path.stat().st_mtime_ns for path in before}, before)
        self.assertIn("--end is for scans of motions", self.tubule("confirm", "scan.hdf", "--end", "1", status=2)[1])


@unittest.skipUnless(MPIRUN, "built without MPI")
class Ranks(ProgramTest):
    """Across the processes of an mpirun: the same points, and none is lost when a rank dies."""

    def setUp(self):
        super().setUp()
        self.write("case.toml", CASE)
        self.tubule("scan", "case.toml", "--over", "energy.H0=-1,-0.8,0", "--set", "time.end=0.02", "-o", "scan.hdf")

    def command(self, ranks, folder):
        return [MPIRUN, "--allow-run-as-root", "--oversubscribe", "-n", str(ranks), PROGRAM, "confirm", "scan.hdf",
                "--elements", "20", "--points", "3", "--csv", "--quiet", "-o", folder]  # fmt: skip

    def figures(self, text):
        return [{key: value for key, value in row.items() if key != "file"} for row in csv.DictReader(io.StringIO(text))]

    @study
    def test_killed_it_goes_on_and_says_the_same(self):
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        alone, _ = self.tubule("confirm", "scan.hdf", *self.command(1, "alone")[8:])
        with subprocess.Popen(self.command(3, "ranks"), cwd=self.folder, env=environment,
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:  # fmt: skip
            self.addCleanup(process.kill)
            while not list(self.folder.glob("ranks/*.hdf")):
                self.assertIsNone(process.poll(), "it ended before it could be disturbed")
                time.sleep(0.01)
            children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
            os.kill(int(children[-1]), signal.SIGKILL)
        self.assertNotEqual(process.returncode, 0)
        done = subprocess.run(self.command(2, "ranks"), cwd=self.folder, env=environment, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        for row, other in zip(self.figures(done.stdout), self.figures(alone), strict=True):
            for key in ("point", "outcome", "verdict", "stop", "n", "m"):
                self.assertEqual(row[key], other[key], key)
            self.assertAlmostEqual(float(row["energy_difference"]), float(other["energy_difference"]), delta=1e-4)

    def test_bad_input_ends_all_ranks(self):
        command = self.command(2, "ranks")
        command[command.index("scan.hdf")] = "case.toml"
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(done.stderr.count("not a result of tubule scan"), 1)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
