#!/usr/bin/python3
"""Runs that go on by their result alone: interrupted, extended, with other outputs and limits, but not with other physics.

continue_test.py TUBULE. Expected ends are those of a run that was neither interrupted nor extended, within the accuracy
asked of both (docs/results.md, "Runs that go on").
"""
import shutil
import signal
import sys
import time
import unittest

import h5py
import numpy as np

from kill_test import CURVE, OFTEN, SURFACE
from program import ACCURACY, E_REF, QUICK, SLOW, ProgramTest, about, rows_of, series

# A tube that comes to rest as a straight one.
RESTING = QUICK[: QUICK.index("[[shape.mode]]\namplitude = 0.05")] + """[accuracy]
energy = 1e-6
[time]
end = 20.0
stationary = 1e-5
"""


class Continued(ProgramTest):
    def sets(self, file=None):
        with h5py.File(file or self.result) as opened:
            return list(opened["case"].attrs["set"])

    def frame_times(self):
        with h5py.File(self.result) as file:
            return [file["frames"][name].attrs["time"] for name in sorted(file["frames"])]

    def interrupted(self, rows, *arguments):
        """Goes on with the result, or begins it, until it has so many more rows; then a signal."""
        what = ["case.hdf", "--resume"] if self.result.exists() else ["case.toml"]
        before = rows_of(self.result)
        process = self.start("run", *what, "--quiet", *arguments, **OFTEN)
        self.addCleanup(process.kill)
        while True:  # inspected while it is stopped, or it would be at its end before that
            time.sleep(0.005)
            self.assertIsNone(process.poll(), "the run ended before it could be interrupted")
            process.send_signal(signal.SIGSTOP)
            if rows_of(self.result) >= before + rows:
                break
            process.send_signal(signal.SIGCONT)
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGCONT)
        process.communicate()
        self.assertEqual(process.returncode, 130)


class Extended(Continued):
    def test_ten_interruptions_and_two_extensions_change_nothing(self):
        self.write("case.toml", SLOW)
        self.tubule("run", "case.toml", "-o", "whole.hdf")
        whole = series(self.folder / "whole.hdf")
        for end, pauses in (("0.12", 5), ("0.16", 3), ("0.2", 2)):
            for _ in range(pauses):
                what = ["case.hdf"] if self.result.exists() else ["case.toml", "--set", "time.output=[0.01,0.05]"]
                out = self.tubule("run", *what, "--resume", "--until", end, "--set", "time.limit=1e-9", status=5)[0]  # a single step
                self.assertRegex(out, "time-limit at t = .*\n +continue with --resume")
            self.tubule("run", "case.hdf", "--resume", "--set", "time.limit=1000")
            self.assertEqual(series(self.result)["time"][-1], float(end))
        ends = series(self.result)
        self.assertEqual(about(self.result)["stop"], "finished")
        self.assertEqual(ends["time"][-1], 0.2)
        self.assertTrue((np.diff(ends["time"]) >= 0).all())
        for name in ("energy", "energy_20", "energy_42", "identity_defect"):
            self.assertAlmostEqual(ends[name][-1], whole[name][-1], delta=ACCURACY * E_REF)
        for name in ("r_min", "r_max", "area", "volume", "mode_1"):
            self.assertAlmostEqual(ends[name][-1], whole[name][-1], delta=10 * ACCURACY)
        self.assertEqual(self.frame_times(), [0, 0.01, 0.05, 0.12, 0.16, 0.2])
        self.assertEqual(self.sets(), ["time.output=[0.01,0.05]", "time.end=0.2", "time.limit=1000"])
        self.assertEqual(self.files(), {"case.toml", "case.hdf", "whole.hdf"})

    def test_what_was_there_stays_to_the_last_bit(self):
        self.tubule("run", "case.toml")
        with h5py.File(self.result) as file:
            last = {name: data[()] for name, data in file["frames/000003"].items()}
        before = series(self.result)
        self.tubule("run", "case.hdf", "--resume", "--until", "0.25", "--set", "time.output=[0.22]")
        after = series(self.result)
        for name in before:
            if name != "wall_seconds":
                np.testing.assert_array_equal(after[name][: len(before[name])], before[name], name)
        with h5py.File(self.result) as file:
            for name, data in last.items():
                np.testing.assert_array_equal(file["frames/000003"][name][()], data)
        self.assertEqual(self.frame_times(), [0, 0.01, 0.05, 0.2, 0.22, 0.25])

    def test_of_a_curve_both_runs_of_the_pair_go_on(self):
        self.write("case.toml", CURVE)
        self.tubule("run", "case.toml", "-o", "whole.hdf")
        self.tubule("run", "case.toml", "--until", "0.03")
        first = series(self.result)
        self.tubule("run", "case.hdf", "--resume", "--until", "0.05", "--set", "time.limit=1e-9", status=5)
        self.tubule("run", "case.hdf", "--resume", "--set", "time.limit=1000")
        whole, ends = about(self.folder / "whole.hdf"), about(self.result)
        self.assertEqual(ends["stop"], "finished")
        self.assertEqual(ends["warnings"], whole["warnings"])
        self.assertLess(ends["estimated_error"], 1e-4)
        energy = series(self.result)["energy"]
        self.assertAlmostEqual(energy[-1], series(self.folder / "whole.hdf")["energy"][-1], delta=1e-4 * whole["E_ref"])
        np.testing.assert_array_equal(energy[: len(first["energy"])], first["energy"])

    def test_a_surface(self):
        self.write("case.toml", SURFACE.replace(SURFACE.split("output = ")[1], "[0.02]\n"))
        self.tubule("run", "case.toml", "-o", "whole.hdf")
        whole = series(self.folder / "whole.hdf")
        self.interrupted(8, "--until", "0.03")
        self.tubule("run", "case.hdf", "--resume")
        self.assertEqual(series(self.result)["time"][-1], 0.03)
        self.interrupted(5, "--until", "0.045")
        self.tubule("run", "case.hdf", "--resume")
        self.tubule("run", "case.hdf", "--resume", "--until", "0.06")
        ends = series(self.result)
        end, other = about(self.result), about(self.folder / "whole.hdf")
        self.assertEqual(end["stop"], "finished")
        self.assertEqual(end["warnings"], other["warnings"])  # none of a coarser run that has ended
        asked = 1e-1 * other["E_ref"]
        self.assertEqual(ends["time"][-1], whole["time"][-1])
        # The same steps of 1e-3, since all ends are multiples of it.
        for name in ("energy", "kinetic_energy", "identity_defect"):
            self.assertAlmostEqual(ends[name][-1], whole[name][-1], delta=1e-6 * asked)
        self.assertEqual(self.frame_times(), [0, 0.02, 0.03, 0.045, 0.06])

    def test_area_differences(self):
        for case, first, end in ((CURVE, "0.03", "0.05"), (SURFACE[: SURFACE.index("output")], "0.01", "0.02")):
            self.write("case.toml", case.replace("[energy]\n", "[energy]\nalpha = 0.4\nM0 = -30.0\n"))
            self.tubule("run", "case.toml", "--until", end, "-o", "whole.hdf", "--overwrite")
            self.tubule("run", "case.toml", "--until", first, "--overwrite")
            self.tubule("run", "case.hdf", "--resume", "--until", end, "--set", "time.limit=1e-9", status=5)
            self.tubule("run", "case.hdf", "--resume", "--set", "time.limit=1000")
            ends, whole = series(self.result), series(self.folder / "whole.hdf")
            self.assertEqual((ends["time"][-1], about(self.result)["stop"]), (float(end), "finished"))
            self.assertGreater(abs(whole["M"][-1] - whole["M"][0]), 1e-2)
            for name in ("energy", "energy_alpha", "M", "identity_defect"):
                self.assertAlmostEqual(ends[name][-1], whole[name][-1], delta=1e-5 * whole["energy"][0], msg=name)

    def test_tier_auto(self):
        self.write("case.toml", QUICK.replace("axisym", "auto").replace("1e-6", "1e-4"))
        self.tubule("run", "case.toml", "--until", "0.4", "-o", "whole.hdf")
        self.tubule("run", "case.toml")
        self.tubule("run", "case.hdf", "--resume", "--until", "0.4")
        ends, whole = series(self.result), series(self.folder / "whole.hdf")
        self.assertEqual(about(self.result)["choice"], "axisym")
        self.assertEqual(ends["time"][-1], 0.4)
        self.assertAlmostEqual(ends["energy"][-1], whole["energy"][-1], delta=1e-4 * E_REF)

    def test_a_stationary_result(self):
        self.write("case.toml", RESTING)
        self.tubule("run", "case.toml")
        self.assertEqual(about(self.result)["stop"], "stationary")
        reached = about(self.result)["stop_time"]
        self.assertIn("complete", self.tubule("run", "case.hdf", "--resume")[0])
        self.tubule("run", "case.hdf", "--resume", "--set", "time.stationary=1e-9")
        self.assertGreater(about(self.result)["stop_time"], reached)
        # Until then more could change: it waits for longer.
        reached = about(self.result)["stop_time"]
        self.tubule("run", "case.hdf", "--resume", "--until", "2e4")
        self.assertEqual(about(self.result)["stop"], "stationary")
        self.assertGreater(about(self.result)["stop_time"], reached)


class Unfinished(Continued):
    def test_a_run_that_can_go_on_is_not_begun_again_unasked(self):
        for limit, status in (([], 130), (["--set", "time.limit=1e-9"], 5)):
            self.write("case.toml", SLOW)
            if limit:
                self.tubule("run", "case.toml", *limit, "--overwrite", status=status)
            else:
                self.interrupted(3)
            before = self.result.read_bytes()
            said = self.tubule("run", "case.toml", *limit, status=2)[1]
            self.assertEqual(said, "case.hdf: holds an unfinished run of case.toml\n"
                                   "--resume goes on with it, --overwrite begins again\n")  # fmt: skip
            self.assertEqual(self.result.read_bytes(), before)
        self.tubule("run", "case.toml", "--overwrite")
        self.assertEqual(about(self.result)["stop"], "finished")


class Refused(Continued):
    def setUp(self):
        super().setUp()
        self.tubule("run", "case.toml")
        self.before = self.result.read_bytes()

    def tearDown(self):
        self.assertEqual(self.result.read_bytes(), self.before)

    def test_other_physics(self):
        err = self.refused("run", "case.hdf", "--resume", "--until", "0.3", "--set", "energy.k42=0.2")
        self.assertIn("energy.k42 is 0.1 there, 0.2 here", err)
        self.assertIn("only time.end, time.output, time.stationary and time.limit may change", err)
        err = self.refused("run", "case.hdf", "--resume", "--set", "shape.mode.1.n=3")
        self.assertIn("shape.mode.1.n is 2 there, 3 here", err)
        for set_ in ("accuracy.energy=1e-5", "discretisation.elements=40"):
            self.assertIn(set_.split("=")[0] + " is", self.refused("run", "case.hdf", "--resume", "--set", set_))

    def test_a_key_that_does_not_exist(self):
        self.assertIn("--set time.edn=1: unknown key", self.refused("run", "case.hdf", "--resume", "--set", "time.edn=1"))

    def test_an_earlier_end(self):
        err = self.refused("run", "case.hdf", "--resume", "--until", "0.15")
        self.assertIn("time.end must be later than t = 0.2, which the result has reached, not 0.15", err)
        self.assertIn("--until", self.refused("run", "case.hdf", "--resume", "--until", "never"))

    def test_without_resume_or_with_another_output(self):
        self.assertIn("case.hdf: is a result: --resume goes on", self.refused("run", "case.hdf"))
        self.assertIn("-o must be absent", self.refused("run", "case.hdf", "--resume", "-o", "other.hdf"))

    def test_nothing_follows_a_pinch_off(self):
        shrinks = ["--set", "energy.H0=-2", "--set", "accuracy.r_min=0.8"]
        self.tubule("run", "case.toml", "-o", "pinched.hdf", *shrinks, status=3)
        err = self.refused("run", "pinched.hdf", "--resume", "--until", "9")
        self.assertIn("with pinch-off: a later time.end changes nothing", err)
        self.assertIn("complete", self.tubule("run", "pinched.hdf", "--resume")[0])

    def test_a_case_of_another_version(self):
        with h5py.File(self.result, "r+") as file:
            file["case"][()] = QUICK.replace("k42", "k43")
        self.before = self.result.read_bytes()
        words = "its case cannot be read by this version: "
        self.assertRegex(self.refused("run", "case.toml", "--resume"), words + ".*unknown key energy.k43")
        self.assertRegex(self.refused("run", "case.toml"), "another case than case.toml: " + words)
        self.assertIn("unknown key energy.k43", self.refused("run", "case.hdf", "--resume"))

    def test_nothing_moves(self):
        surface = SURFACE.split("[time]")[0].replace("[model]\nkind = \"fluid\"\n", "").replace("step = 1e-3\n", "")
        self.write("rest.toml", surface)
        self.tubule("run", "rest.toml")
        self.assertIn("nothing moves", self.refused("run", "rest.hdf", "--resume", "--until", "1"))


class Outputs(Continued):
    def test_those_that_lie_behind_are_named(self):
        self.tubule("run", "case.toml")
        _, err = self.tubule("run", "case.hdf", "--resume", "--until", "0.3", "--set", "time.output=[0.01,0.03,0.25]")
        self.assertIn("time.output 0.03 is not written: the run goes on from t = 0.2", err)
        self.assertEqual(self.frame_times(), [0, 0.01, 0.05, 0.2, 0.25, 0.3])

    def test_the_case_extends_its_result_as_well(self):
        self.tubule("run", "case.toml")
        self.tubule("run", "case.toml", "--resume", "--until", "0.25")
        self.assertEqual(series(self.result)["time"][-1], 0.25)
        err = self.tubule("run", "case.toml", "--resume", status=2)[1]
        self.assertIn("t = 0.25, which the result has reached, not 0.2", err)

    def test_the_result_in_another_folder(self):
        # What the case names by a path is looked for beside the case.
        self.write("start.toml", QUICK)
        self.tubule("run", "start.toml")
        shape = QUICK[QUICK.index("[shape]"):QUICK.index("[accuracy]")]
        self.write("deep/next.toml", QUICK.replace(shape, '[shape]\nkind = "result"\npath = "../start.hdf"\n'))
        self.tubule("run", "deep/next.toml", "-o", "deep/next.hdf")
        shutil.move(self.folder / "deep/next.hdf", self.folder / "moved.hdf")
        self.tubule("run", "moved.hdf", "--resume", "--until", "0.25")
        self.assertEqual(series(self.folder / "moved.hdf")["time"][-1], 0.25)


class Overwrite(Continued):
    def test_a_result_of_another_case_is_kept(self):
        self.tubule("run", "case.toml")
        before = self.result.read_bytes()
        err = self.refused("run", "case.toml", "--set", "energy.k42=0.2")
        self.assertIn("case.hdf: holds the result of another case", err)
        self.assertIn("energy.k42 is 0.1 there, 0.2 here", err)
        self.assertIn("--overwrite replaces it, -o FILE keeps both", err)
        self.assertEqual(self.result.read_bytes(), before)
        self.tubule("run", "case.toml", "--set", "energy.k42=0.2", "--overwrite")
        self.assertEqual(self.sets(), ["energy.k42=0.2"])

    def test_the_same_case_is_run_again(self):
        self.tubule("run", "case.toml")
        self.write("case.toml", "# the same\n" + QUICK.replace("[time]", "[time]\nlimit = 100"))
        self.tubule("run", "case.toml")
        with h5py.File(self.result) as file:
            self.assertIn("# the same", file["case"].asstr()[()])

    def test_an_extended_result_is_another_one(self):
        self.tubule("run", "case.toml")
        self.tubule("run", "case.hdf", "--resume", "--until", "0.25")
        self.assertIn("time.end is 0.25 there, 0.2 here", self.refused("run", "case.toml"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
