#!/usr/bin/python3
"""Scans that grow: by values, ranges and axes, by another scan; pictures of any quantity and of slices.

grow_test.py TUBULE [MPIRUN]. Expected is a scan made at once: its points, bit for bit, but for the times they took.
"""
import os
import signal
import subprocess
import sys
import unittest

import h5py
import numpy as np
from matplotlib.image import imread

MPIRUN = sys.argv[2] if len(sys.argv) > 2 else None

from program import PROGRAM, UNDULATED_TUBE, ProgramTest, about, finished_points

AMPLITUDE, K42, RADIUS = "shape.mode.0.amplitude", "energy.k42", "shape.radius"

CASE = UNDULATED_TUBE.replace("H0 = -2.0\n", "H0 = -2.0\nk42 = 1e-3\n")


def contents(result):
    """All that a scan says of its points, but for times."""
    with h5py.File(result) as file:
        found = {f"points/{n}": d[()] for n, d in file["points"].items() if not n.endswith("_seconds")}
        for axis, group in file["axes"].items():
            found[f"axes/{axis}"] = group["values"][()]
            found[f"keys/{axis}"] = np.array(list(group.attrs["keys"]))
        for name in ("boundary", "crossing", "between/point", "between/outcome"):
            if name in file:
                found[name] = file[name][()]
    return found

os.environ["TUBULE_WRITE_SECONDS"] = "0.02"  # points are to be seen before a kill


class GrowTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("case.toml", CASE)
        self.result = self.folder / "scan.hdf"
        self.whole = self.folder / "whole.hdf"

    def scan(self, *arguments, status=0):
        return self.tubule("scan", *arguments, status=status)

    def assert_as_made_at_once(self, *over, more=()):
        self.scan("case.toml", *(f"--over={o}" for o in over), *more, "-o", "whole.hdf")
        one, other = contents(self.result), contents(self.whole)
        self.assertEqual(one.keys(), other.keys())
        for name, data in other.items():
            self.assertEqual(one[name].shape, data.shape, name)
            equal = np.array_equal(one[name], data, equal_nan=data.dtype.kind == "f")
            self.assertTrue(equal, name)


class Extended(GrowTest):
    def test_are_as_made_at_once(self):
        """A scan, what extends it, how many points are run then, and the same at once."""
        known = f"{AMPLITUDE}=0.3,0.5"
        for first, more, run, whole in (
            ([known], [f"{AMPLITUDE}=0.3:0.5:3"], 1, [f"{AMPLITUDE}=0.3,0.4,0.5"]),  # the others were known
            ([known], [f"{AMPLITUDE}=0.2,0.45"], 2, [f"{AMPLITUDE}=0.2,0.3,0.45,0.5"]),
            # Those that are known had the values of the case: 1e-3, and a radius of 1.
            ([known], [f"{K42}=1e-5,1e-2", f"{RADIUS}=1,1.1"], 10, [known, f"{K42}=1e-5,1e-3,1e-2", f"{RADIUS}=1,1.1"]),
            ([known, f"--set={K42}=1e-2"], [f"{K42}=1e-5"], 2, [known, f"{K42}=1e-5,1e-2"]),
        ):
            with self.subTest(more=more):
                self.scan("case.toml", f"--over={first[0]}", *first[1:], "-o", "scan.hdf", "--overwrite")
                out = self.scan("scan.hdf", "--extend", *(f"--over={o}" for o in more))[0]
                self.assertIn(f"{run} run now", out)
                self.assert_as_made_at_once(*whole, more=["--overwrite"])

    def test_into_another_file(self):
        self.scan("case.toml", f"--over={AMPLITUDE}=0.3,0.5", "-o", "small.hdf")
        before = (self.folder / "small.hdf").read_bytes()
        self.scan("small.hdf", "--extend", f"--over={AMPLITUDE}=0.4", "-o", "scan.hdf")
        self.assertEqual((self.folder / "small.hdf").read_bytes(), before)
        self.assert_as_made_at_once(f"{AMPLITUDE}=0.3,0.4,0.5")

    def test_a_boundary(self):
        """Points that are known but away from the boundary are left out: the scan made at once does not have them."""
        boundary = ("--boundary", "pinched", "--seeds", "2", "--refine", "3")
        self.scan("case.toml", f"--over={AMPLITUDE}=0.3:0.5:3", f"--over={K42}=1e-5,1e-3,1e-2", *boundary, "-o", "scan.hdf")
        self.scan("scan.hdf", "--extend", f"--over={AMPLITUDE}=0.3:0.5:5", f"--over={K42}=1e-4")
        self.assert_as_made_at_once(f"{AMPLITUDE}=0.3:0.5:5", f"{K42}=1e-5,1e-4,1e-3,1e-2", more=boundary)

    def test_killed_it_goes_on_by_its_result(self):
        slow = ("--set=time.end=0.05", "--set=discretisation.elements=20", "--set=discretisation.time_tolerance=1e-12",
                "--set=time.max_order=2", "--to-the-end")  # fmt: skip
        self.scan("case.toml", f"--over={AMPLITUDE}=0.1,0.12", *slow, "-o", "scan.hdf")
        known = contents(self.result)["points/energy"]
        for number in (signal.SIGKILL, signal.SIGINT):
            grow = ("--extend", f"--over={AMPLITUDE}=0.1:0.12:9") if number == signal.SIGKILL else ("--resume",)
            process = self.start("scan", "scan.hdf", *grow, "--jobs", "1", "--quiet")
            before = finished_points(self.result)
            self.wait(process, lambda: finished_points(self.result) > before)
            process.send_signal(number)
            process.communicate()
        csv = self.tubule("show", "scan.hdf", "--csv")[0].splitlines()
        self.assertGreaterEqual(len(csv), 1 + 4)
        self.scan("scan.hdf", "--resume")
        self.assertEqual(about(self.result)["stop"], "finished")
        self.assertEqual(list(contents(self.result)["points/energy"][[0, -1]]), list(known))
        self.assert_as_made_at_once(f"{AMPLITUDE}=0.1:0.12:9", more=slow)

    @unittest.skipUnless(MPIRUN, "built without MPI")
    def test_on_two_axes_on_any_number_of_ranks(self):
        """More values of one axis and another axis, at once."""
        self.scan("case.toml", f"--over={AMPLITUDE}=0.3,0.5", "-o", "small.hdf")
        for ranks in (2, 3):
            command = [MPIRUN, "--allow-run-as-root", "--oversubscribe", "-n", str(ranks), PROGRAM, "scan", "small.hdf",
                       "--extend", f"--over={AMPLITUDE}=0.4", f"--over={K42}=1e-5,1e-2", "-o", "scan.hdf"]  # fmt: skip
            done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertEqual(about(self.result)["workers"], ranks)
            self.assert_as_made_at_once(f"{AMPLITUDE}=0.3,0.4,0.5", f"{K42}=1e-5,1e-3,1e-2")
            self.result.unlink()
            self.whole.unlink()


class Merged(GrowTest):
    def test_are_as_made_at_once(self):
        """Two scans, how many points are run when they are merged, and the same at once."""
        known, both = f"{AMPLITUDE}=0.3,0.5", f"{K42}=1e-5,1e-2"
        for one, other, run, whole in (
            ([f"{AMPLITUDE}=0.3,0.35", both], [f"{AMPLITUDE}=0.35,0.5", both], 0, [f"{AMPLITUDE}=0.3,0.35,0.5", both]),
            ([known], [known, f"--set={K42}=1e-2"], 0, [known, f"{K42}=1e-3,1e-2"]),  # it becomes an axis
            ([f"{AMPLITUDE}=0.3", f"{K42}=1e-5"], [f"{AMPLITUDE}=0.5", f"{K42}=1e-2"], 2, [known, both]),
        ):
            with self.subTest(one=one, other=other):
                for file, axes in (("scan.hdf", one), ("other.hdf", other)):
                    options = [axis if axis.startswith("--") else f"--over={axis}" for axis in axes]
                    self.scan("case.toml", *options, "-o", file, "--overwrite")
                self.assertIn(f"{run} run now", self.scan("scan.hdf", "--merge", "other.hdf")[0])
                self.assert_as_made_at_once(*whole, more=["--overwrite"])

    def test_other_cases_are_refused(self):
        self.write("other.toml", CASE.replace("20.0", "19.0"))
        self.scan("case.toml", f"--over={AMPLITUDE}=0.3", "-o", "scan.hdf")
        self.scan("other.toml", f"--over={AMPLITUDE}=0.5", "-o", "other.hdf")
        self.assertRegex(self.refused("scan", "scan.hdf", "--merge", "other.hdf"),
                         "scans of different cases: line [0-9]+ is '.*20.0' in one, '.*19.0' in the other")  # fmt: skip
        self.scan("case.toml", f"--over={AMPLITUDE}=0.3", "--to-the-end", "-o", "end.hdf")
        self.assertIn("--to-the-end", self.refused("scan", "scan.hdf", "--merge", "end.hdf"))
        self.assertIn("nowhere.hdf", self.refused("scan", "scan.hdf", "--merge", "nowhere.hdf"))


class Refused(GrowTest):
    def setUp(self):
        super().setUp()
        self.scan("case.toml", f"--over={AMPLITUDE}=0.3", "-o", "scan.hdf")
        self.before = self.result.read_bytes()

    def tearDown(self):
        self.assertEqual(self.result.read_bytes(), self.before)

    def test_options(self):
        over = f"--over={AMPLITUDE}=0.4"
        for words, arguments in (
            ("--resume goes on with it", ("scan.hdf",)),
            ("--over needs --extend", ("scan.hdf", "--merge", "scan.hdf", over)),
            ("--extend needs --over", ("scan.hdf", "--extend")),
            ("--set must be absent", ("scan.hdf", "--extend", over, "--set", "energy.k20=1")),
            ("--to-the-end must be absent", ("scan.hdf", "--extend", over, "--to-the-end")),
            ("--resume goes on with it as it is", ("scan.hdf", "--extend", over, "--resume")),
            ("need the result of a scan", ("case.toml", "--extend", over)),
        ):
            self.assertIn(words, self.refused("scan", *arguments), arguments)

    def test_values(self):
        self.assertIn("unknown key energy.k43", self.refused("scan", "scan.hdf", "--extend", "--over=energy.k43=1"))
        self.assertIn("shape.radius", self.refused("scan", "scan.hdf", "--extend", "--over=shape.radius=-1"))
        # The case chooses no number of elements, so it is not known which one its points belong to.
        err = self.refused("scan", "scan.hdf", "--extend", "--over=discretisation.elements=40")
        self.assertIn("its points have no value of discretisation.elements", err)


class Pictures(GrowTest):
    made = None  # the scan that all of them draw

    def setUp(self):
        super().setUp()
        if Pictures.made is None:
            self.scan("case.toml", f"--over={AMPLITUDE}=0.3,0.5", f"--over={K42}=1e-5,1e-3,1e-2", f"--over={RADIUS}=1,1.1",
                      "-o", "scan.hdf")  # fmt: skip
            Pictures.made = self.result.read_bytes()
        self.result.write_bytes(self.made)

    def pixels(self, *arguments):
        self.plot("scan.hdf", "-o", "map.png", "--dpi=100", *arguments)
        return imread(self.folder / "map.png")

    def test_slices(self):
        err = self.plot("scan.hdf", "-o", "map.png", status=2)[1]
        self.assertIn("3 axes", err)
        self.assertIn(f"--slice {RADIUS}=1", err)
        one, other = self.pixels("--slice", f"{RADIUS}=1"), self.pixels("--slice", f"{RADIUS}=1.1")
        self.assertEqual(one.shape, other.shape)
        self.assertGreater(abs(one - other).max(), 0.1)
        line = self.pixels("--slice", f"{RADIUS}=1", "--slice", f"{K42}=1e-3")
        self.assertGreater(abs(line - one).max(), 0.1)

    def test_a_slice_is_as_a_scan_of_its_own(self):
        self.scan("case.toml", f"--over={AMPLITUDE}=0.3,0.5", f"--over={K42}=1e-5,1e-3,1e-2", "-o", "whole.hdf")
        of_slice = self.pixels("--slice", f"{RADIUS}=1")
        self.plot("whole.hdf", "-o", "own.png", "--dpi=100")
        own = imread(self.folder / "own.png")
        rows = slice(own.shape[0] // 8, None)  # below the title, which names the slice
        np.testing.assert_array_equal(of_slice[rows], own[rows])

    def test_any_quantity(self):
        energy = self.pixels("--slice", f"{RADIUS}=1", "--quantity", "energy")
        volume = self.pixels("--slice", f"{RADIUS}=1", "--quantity", "volume")
        self.assertGreater(abs(energy - volume).max(), 0.1)
        self.pixels("--slice", f"{RADIUS}=1", "--slice", f"{K42}=1e-3", "--quantity", "r_min")

    def test_refusals(self):
        self.assertIn("r_min", self.plot("scan.hdf", "--slice", f"{RADIUS}=1", "--quantity", "rmin", status=2)[1])
        self.assertIn("1, 1.1", self.plot("scan.hdf", "--slice", f"{RADIUS}=2", status=2)[1])
        self.assertIn(AMPLITUDE, self.plot("scan.hdf", "--slice", "energy.k20=1", status=2)[1])
        self.assertIn("key=value", self.plot("scan.hdf", "--slice", "energy.k20", status=2)[1])
        self.tubule("run", "case.toml", "--set", "time.end=0.01")
        self.assertIn("--quantity", self.plot("case.hdf", "--quantity", "energy", status=2)[1])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
