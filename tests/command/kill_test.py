#!/usr/bin/python3
"""Runs that are interrupted or out of time lose nothing, killed ones little, and --resume ends where they would have ended.

kill_test.py TUBULE. Expected end states are those of an undisturbed run, within the accuracy asked of both.
"""
import os
import random
import shutil
import signal
import sys
import time
import unittest

import h5py

from program import ACCURACY, E_REF, QUICK, SLOW, ProgramTest, about, rows_of, series

OFTEN = {"env": os.environ | {"TUBULE_WRITE_SECONDS": "0.1"}}  # rows are to be seen before a kill


class Kill(ProgramTest):
    whole = None  # series of the uninterrupted run

    def setUp(self):
        super().setUp()
        self.write("case.toml", SLOW)
        if Kill.whole is None:
            self.tubule("run", self.case)
            Kill.whole, Kill.frame_times = series(self.result), self.times_of_frames()
            self.result.unlink()

    def times_of_frames(self):
        with h5py.File(self.result) as file:
            return [file["frames"][name].attrs["time"] for name in sorted(file["frames"])]

    def assert_ends_like_the_undisturbed_run(self):
        ends = series(self.result)
        self.assertEqual(about(self.result)["stop"], "finished")
        self.assertEqual(ends["time"][-1], self.whole["time"][-1])
        for name in ("energy", "energy_20", "energy_42", "identity_defect"):
            self.assertAlmostEqual(ends[name][-1], self.whole[name][-1], delta=ACCURACY * E_REF)
        for name in ("r_min", "r_max", "area", "volume", "mode_1"):
            self.assertAlmostEqual(ends[name][-1], self.whole[name][-1], delta=10 * ACCURACY)
        self.assertTrue((ends["time"][1:] >= ends["time"][:-1]).all())
        self.assertEqual(self.times_of_frames(), self.frame_times)
        self.assertEqual(self.files(), {"case.toml", "case.hdf"})

    def started(self, *arguments):
        """A run that has written its first rows."""
        process = self.start("run", self.case, *arguments, **OFTEN)
        self.wait(process, lambda: rows_of(self.result))
        return process

    def interrupted(self, signal_number, *arguments):
        with self.started(*arguments) as process:
            process.send_signal(signal_number)
            out, err = process.communicate()
        self.assertEqual(process.returncode, 130, out + err)
        return out

    def test_signals_save_the_state(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(signal=number):
                out = self.interrupted(number)
                self.assertRegex(out, "case.toml: interrupted at t = .*\n +continue with --resume")
                with h5py.File(self.result) as file:
                    checkpoint = file["checkpoint"].attrs["time"]
                    self.assertEqual(file["series/time"][-1], checkpoint)
                self.assertLess(checkpoint, self.whole["time"][-1])
                self.assertEqual(about(self.result)["stop"], "interrupted")
                self.assertEqual(self.files(), {"case.toml", "case.hdf"})
                before = series(self.result)["energy"]
                self.tubule("run", self.case, "--resume")
                after = series(self.result)["energy"]
                self.assertEqual(list(after[: len(before)]), list(before))
                self.assert_ends_like_the_undisturbed_run()
                self.result.unlink()

    def test_an_interrupt_ends_the_whole_command(self):
        second = self.write("second.toml", SLOW)
        self.interrupted(signal.SIGINT, second)
        self.assertFalse((self.folder / "second.hdf").exists())

    def test_a_second_run_of_the_same_result_is_refused(self):
        process = self.started()
        self.assertIn("case.hdf", self.tubule("run", self.case, status=2)[1])
        self.assertIn("case.hdf", self.tubule("run", self.case, "--resume", status=2)[1])
        process.communicate()
        self.assertEqual(process.returncode, 0)
        self.assert_ends_like_the_undisturbed_run()

    def test_three_kills_lose_nothing(self):
        pause = random.Random(20)
        known = []  # rows that must stay
        for _ in range(3):
            process = self.start("run", self.case, "--resume", "--quiet", **OFTEN)
            self.wait(process, lambda: rows_of(self.result) > len(known) + 20)  # beyond the previous run
            time.sleep(pause.uniform(0, 0.02))
            process.kill()
            process.communicate()
            header, after = self.shown(self.result)
            self.assertIn("none yet", self.tubule("show", self.result)[0])
            known = self.rows_that_resume_keeps(header, after)
        self.tubule("run", self.case, "--resume", "--quiet")
        header, rows = self.shown(self.result)
        self.assertEqual(rows[: len(known)], known)
        self.assert_ends_like_the_undisturbed_run()

    def rows_that_resume_keeps(self, header, rows):
        """Those up to the newest frame: docs/results.md."""
        frames = self.tubule("show", self.result)[0].rsplit("\n\n", 1)[1].splitlines()[1:]
        newest = float(frames[-1].split()[1])
        kept = [row for row in rows if float(row[header.index("time")]) <= newest * (1 + 1e-6)]
        return kept[: len(kept) - 1]  # frames are shown with 8 digits

    def test_killed_before_its_first_frame(self):
        # What the program leaves then: the result without rows.
        self.tubule("run", self.case, "--set", "time.end=1e-6", "--set", "time.output=[]")
        with h5py.File(self.result, "r+") as file:
            file["case"].attrs.pop("set")
            file["case"].attrs["set"] = []
            for name in list(file["frames"]):
                del file["frames"][name]
            del file["about"].attrs["stop"]
        self.tubule("run", self.case, "--resume", "--quiet")
        self.assert_ends_like_the_undisturbed_run()


# A surface that moves, half a second or so, in steps as given: 60 of them and a frame at every fifth.
SURFACE = """tier = "surface3d"
[energy]
k20 = 0.2
k42 = 0.05
[model]
kind = "fluid"
[shape]
kind = "sphere"
radius = 1.0
mode = [{amplitude = 0.2, l = 2, m = 1}]
[discretisation]
elements = 80
order = 2
step = 1e-3
[accuracy]
energy = 1e-1
[time]
end = 0.06
output = %s
""" % [i / 200 for i in range(1, 12)]


class Surface(ProgramTest):
    """The same of tier surface3d. All steps are given, so that a resumed run takes the same ones."""

    def setUp(self):
        super().setUp()
        self.write("case.toml", SURFACE)

    def assert_ends_like_the_undisturbed_run(self):
        ends = series(self.result)
        self.assertEqual(about(self.result)["stop"], "finished")
        self.assertEqual(list(ends["time"]), list(self.whole["time"]))
        for name in ("energy", "kinetic_energy", "identity_defect", "area", "volume", "r_min", "r_max"):
            # What a step leaves of its system: rounding, and GMRES to 1e-11.
            self.assertLess(abs(ends[name] - self.whole[name]).max(), 1e-7, name)

    def disturbed(self, number, rows):
        """Killed by a signal after so many rows; the rows it had written."""
        process = self.start("run", self.case, "--resume", "--quiet", **OFTEN)
        self.wait(process, lambda: rows_of(self.result) >= rows)
        process.send_signal(number)
        process.communicate()
        self.assertNotEqual(process.returncode, 0)
        return self.shown(self.result)[1]

    def test_a_state_of_another_version_is_refused(self):
        self.disturbed(signal.SIGTERM, 5)
        kept = self.result.read_bytes()
        for name in ("restart_lag", "restart_supplied"):
            self.result.write_bytes(kept)
            with h5py.File(self.result, "r+") as file:
                del file["checkpoint"].attrs[name]
            before = self.result.read_bytes()
            err = self.tubule("run", self.case, "--resume", status=2)[1]
            self.assertIn(f"{name} is missing; results of other versions may not have it", err)
            self.assertEqual(self.result.read_bytes(), before)

    def test_kills_and_signals_lose_nothing(self):
        self.tubule("run", self.case, "-o", "whole.hdf")
        self.whole = series(self.folder / "whole.hdf")
        for number, rows in ((signal.SIGKILL, 5), (signal.SIGTERM, 15), (signal.SIGKILL, 30)):
            written = self.disturbed(number, rows)
            self.assertLess(len(written), len(self.whole["time"]))
            energy = list(self.shown(self.result)[0]).index("energy")
            for mine, its in zip(written, self.whole["energy"]):
                self.assertAlmostEqual(float(mine[energy]), its, delta=1e-7)
        self.tubule("run", self.case, "--resume", "--quiet")
        self.assert_ends_like_the_undisturbed_run()
        with h5py.File(self.result) as file:
            self.assertEqual(len(file["frames"]), 13)  # the start, 11 outputs, the end
            self.assertEqual(len(file["meshes"]), 1)


# A closed cell in Stokes flow, as a curve: a second or so, and two pairs of runs at least.
CURVE = """tier = "axisym"
[energy]
k20 = 1.0
k42 = 0.05
H0 = -0.5
[model]
kind = "stokes"
[shape]
kind = "ellipsoid"
a = 0.35
b = 0.35
c = 1.2
[accuracy]
energy = 1e-4
[time]
end = 0.05
output = [0.02]
"""


class Curve(ProgramTest):
    """The same of curves, whose runs come in pairs."""

    def setUp(self):
        super().setUp()
        self.write("case.toml", CURVE)
        self.tubule("run", self.case, "-o", "whole.hdf")
        self.whole = about(self.folder / "whole.hdf")

    def assert_ends_like_the_undisturbed_run(self):
        end = about(self.result)
        self.assertEqual(end["stop"], "finished")
        self.assertEqual(end["attempts"], self.whole["attempts"])
        self.assertAlmostEqual(end["elements"], self.whole["elements"], delta=0.1 * self.whole["elements"])
        self.assertLess(end["estimated_error"], 1e-4)
        whole, mine = series(self.folder / "whole.hdf"), series(self.result)
        self.assertAlmostEqual(mine["energy"][-1], whole["energy"][-1], delta=1e-4 * self.whole["E_ref"])
        with h5py.File(self.result) as file:
            times = [file["frames"][name].attrs["time"] for name in sorted(file["frames"])]
        self.assertEqual(times, [0, 0.02, 0.05])

    def test_signals_and_kills_lose_nothing(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGINT):
            process = self.start("run", self.case, "--resume", "--quiet", **OFTEN)
            self.addCleanup(process.kill)
            time.sleep(0.2)
            process.send_signal(number)
            process.communicate()
        self.tubule("run", self.case, "--resume", "--quiet")
        self.assert_ends_like_the_undisturbed_run()


class Resume(ProgramTest):
    def test_a_complete_result_is_left_alone(self):
        self.tubule("run", self.case)
        before = self.result.read_bytes()
        out, _ = self.tubule("run", self.case, "--resume")
        self.assertIn("case.hdf is complete, nothing to resume", out)
        self.assertEqual(self.result.read_bytes(), before)

    def test_another_case_is_refused(self):
        self.tubule("run", self.case, "--set", "time.limit=1e-9", "--set", "energy.k20=2", status=5)
        before = self.result.read_bytes()
        self.assertIn("another case or other --set", self.tubule("run", self.case, "--resume", status=2)[1])
        other = self.write("other.toml", QUICK.replace("0.12", "0.13"))
        self.assertIn("another case", self.tubule("run", other, "--resume", "-o", "case.hdf", status=2)[1])
        self.assertEqual(self.result.read_bytes(), before)

    def test_without_a_result_it_begins(self):
        self.tubule("run", self.case, "--resume")
        self.assertEqual(about(self.result)["stop"], "finished")

    def test_what_is_no_result_is_refused(self):
        shutil.copy(self.case, self.result)
        self.assertIn("case.hdf", self.tubule("run", self.case, "--resume", status=2)[1])
        self.assertEqual(self.result.read_text(), QUICK)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
