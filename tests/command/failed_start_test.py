#!/usr/bin/python3
"""Runs that fail before their first row, and runs that are paused: what is in the file then.

failed_start_test.py TUBULE. What must be there afterwards are the bytes that were there before; the reasons are those
that the program gives, by the keys of the case.
"""
import sys
import unittest

import h5py

from program import CAPSULE, QUICK, ProgramTest, about, series

# Numbers with which nothing can be computed, whatever the discretisation.
EXTREME = ("shape.radius=1e+200", "energy.k20=1e+300", "energy.H0=1e+200")

SURFACE = """tier = "surface3d"
energy = {k20 = 1.0}
shape = {kind = "sphere", radius = 1.0, mode = [{amplitude = 0.1, l = 2}]}
discretisation = {elements = 80, order = 2}
accuracy = {energy = 1e-1}
time = {end = 1e-3}
"""

CURVE = """tier = "axisym"
energy = {k20 = 0.5, k42 = 0.1}
model = {kind = "stokes"}
shape = {kind = "sphere", radius = 1.0, mode = [{amplitude = 0.2, l = 2}]}
accuracy = {energy = 1e-4}
time = {end = 0.5, output = [0.1, 0.3]}
"""


class FailedStart(ProgramTest):
    def failing(self, *arguments):
        """The run fails; what it says."""
        out, err = self.tubule(*arguments, status=4)
        self.assertEqual([line for line in err.splitlines() if ": note: " not in line], [])
        return out

    def test_an_earlier_result_stays(self):
        self.tubule("run", self.case)
        before = self.result.read_bytes()
        for key in EXTREME:
            out = self.failing("run", self.case, "--overwrite", "--set", key)
            self.assertIn("solver-failed at t = 0: the numbers of the case are too large or too small", out)
            self.assertIn("to compute with: " + key.replace("=", " = "), out)
            self.assertIn("case.hdf is left as it was", out)
            self.assertEqual(self.result.read_bytes(), before)
            self.assertEqual(self.files(), {"case.toml", "case.hdf"})

    def test_without_an_earlier_result_the_file_has_the_reason(self):
        cases = [(QUICK, "run", "energy.k20=1e+300"), (CAPSULE + "area = 7.0\nvolume = 1.5\n", "equilibrium", "energy.k20=1e+300"),
                 (SURFACE, "run", "energy.H0=1e+200"),
                 (QUICK.replace("axisym", "auto"), "run", "shape.radius=1e+200")]
        for text, command, key in cases:
            with self.subTest(command=command, key=key, tier=text.split("\n")[0]):
                self.result.unlink(missing_ok=True)
                self.write("case.toml", text)
                self.failing(command, self.case, "--set", key)
                self.assertNotIn("case.hdf.lock", self.files())
                self.assertEqual(about(self.result)["stop"], "solver-failed")
                self.assertIn(key.replace("=", " = "), about(self.result)["stop_message"])
                # The start itself may have an energy, 1e300 or so, and then a row.
                if len(series(self.result)["time"]) > 0:
                    continue
                # A result without rows may be replaced.
                self.failing(command, self.case, "--set", key, "--set", "energy.k40=1e+300")
                self.assertIn("energy.k40 = 1e+300", about(self.result)["stop_message"])
                self.result.unlink()

    def test_points_of_a_scan_say_so(self):
        self.tubule("scan", self.case, "--over", "shape.radius=1,1e200", "-o", "scan.hdf", "--quiet")
        points = self.tubule("show", "scan.hdf", "--csv")[0].splitlines()
        self.assertIn("solver-failed", points[2])
        self.assertIn("shape.radius = 1e+200", points[2])

    def test_bad_input_leaves_an_earlier_result(self):
        self.tubule("run", self.case)
        before = self.result.read_bytes()
        self.refused("run", self.case, "--set", "shape.kind=none")
        self.assertEqual(self.result.read_bytes(), before)


class Limits(ProgramTest):
    def test_the_time_limit_may_change_when_a_run_is_resumed(self):
        many = ["--set", "discretisation.elements=400"]
        self.tubule("run", self.case, *many, "--set", "time.limit=1e-9", status=5)
        self.assertIn("another case or other --set", self.refused("run", self.case, "--resume"))
        self.assertIn("another case or other --set",
                      self.refused("run", self.case, *many, "--resume", "--set", "energy.k20=0.6"))
        self.tubule("run", self.case, *many, "--resume", "--set", "time.limit=100")
        self.assertEqual(about(self.result)["stop"], "finished")

    def test_a_result_of_the_same_case_with_other_comments_is_resumed(self):
        self.tubule("run", self.case, "--set", "time.limit=1e-9", status=5)
        self.write("case.toml", "# later\n" + QUICK)
        self.tubule("run", self.case, "--resume")
        self.assertEqual(about(self.result)["stop"], "finished")

    def test_a_run_of_a_curve_that_is_paused_has_no_other_frames(self):
        self.write("case.toml", CURVE)
        for _ in range(200):
            with self.start("run", self.case, "--resume", "--set", "time.limit=0.03") as process:
                process.communicate()
            self.assertIn(process.returncode, (0, 5))
            if process.returncode == 0:
                break
        self.assertEqual(process.returncode, 0)
        with h5py.File(self.result) as file:
            self.assertEqual([frame.attrs["time"] for frame in file["frames"].values()], [0, 0.1, 0.3, 0.5])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
