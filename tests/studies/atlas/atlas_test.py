#!/usr/bin/python3
"""A tiny map is made, continued, drawn and counted; runs are judged by their errors.

    atlas_test.py TUBULE
"""

import csv
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace

HERE = Path(__file__).resolve().parent
TUBULE = Path(sys.argv[1]).resolve()
sys.path.insert(0, str(HERE.parent / "fuzz"))
import numpy as np  # noqa: E402
from judging import ExactTruth, judge, kind_of_error  # noqa: E402
from sandbox import Sandbox  # noqa: E402
from tool_maps import VALUES, alignment, fits, judged_lines, lines  # noqa: E402


class Corners(unittest.TestCase):
    """The map of k40: f_HH = 0.4 + 12 k40 (H - H0)^2 at H = -1 is negative for k40 = -0.1, H0 = -4 and 2."""

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.said = cls.make()

    @classmethod
    def make(cls):
        done = subprocess.run([HERE / "atlas.py", TUBULE, cls.folder, "k40", "--across", "1", "--levels", "0"], capture_output=True, text=True)
        assert done.returncode == 0, done
        return done.stdout

    def test_each_corner_is_judged(self):
        with open(self.folder / "k40.csv", newline="") as file:
            found = {(float(r["x"]), float(r["y"])): (r["kind"], r["stop"]) for r in csv.DictReader(file)}
        self.assertEqual(found, {(x, y): ("right", "ill-posed" if x < 0 else "finished") for x in (-0.1, 0.1) for y in (-4.0, 2.0)})
        self.assertIn("k40: 4 judged, 4 right", self.said)

    def test_what_is_judged_is_not_run_again(self):
        before = (self.folder / "k40.csv").read_text()
        self.assertEqual(self.make(), self.said)
        self.assertEqual((self.folder / "k40.csv").read_text(), before)

    def test_points_are_judged_again(self):
        """A row that says otherwise is listed."""
        rows = (self.folder / "k40.csv").read_text().splitlines()
        other = self.folder / "other"
        other.mkdir()
        (other / "k40.csv").write_text("\n".join(rows).replace(",right,ill-posed", ",told,ill-posed") + "\n")
        done = subprocess.run([HERE / "again.py", TUBULE, other, "--count", "4", "--seed", "3"], capture_output=True, text=True)
        self.assertEqual(done.stdout.count("told, ill-posed -> right, ill-posed"), 2, done)
        self.assertIn("4 judged again, seed 3: 2 verdicts changed, 0 of them silent now", done.stdout)

    def test_picture_and_page(self):
        picture, page = self.folder / "k40.png", self.folder / "page.md"
        subprocess.run([HERE / "draw.py", self.folder / "k40.csv", "-o", picture], check=True)
        self.assertGreater(picture.stat().st_size, 5000)
        page.write_text("# Page\n\n<!-- counts -->\nearlier\n<!-- end -->\n\n<!-- silent -->\n<!-- end -->\nlast\n")
        subprocess.run([HERE / "page.py", self.folder, page], check=True)
        text = page.read_text()
        self.assertIn("\n| `k40` | axisym | 169 | 4 |  |  |  | 165 |\n", text)  # all but four points of its lattice are missing
        self.assertNotIn("earlier", text)
        self.assertTrue(text.endswith("last\n"))
        page.write_text("# Page\n")
        self.assertIn("has no <!-- counts -->", subprocess.run([HERE / "page.py", self.folder, page], capture_output=True, text=True).stderr)


def run(stated=1e-3, warned=False, stop="finished", energy=1.0):
    return SimpleNamespace(stated=stated, warned=warned, stop=stop, finished=stop == "finished", energy={1.0: energy}, scale=1.0)


class Judging(unittest.TestCase):
    def test_errors(self):
        for value, doubt, kind in ((1e-3, 1e-4, "right"), (1.9e-3, 0, "right"), (3e-3, 1e-4, "silent"), (2.1e-3, 1e-3, "undecided"), (1e-3, 5e-3, "undecided")):
            self.assertEqual(kind_of_error(run(), 1e-2, value, doubt), kind, value)
        self.assertEqual(kind_of_error(run(), 5e-4, 1e-3, 0), "silent")  # above what was asked for

    def test_ends(self):
        goes_on, ends = ExactTruth({1.0: 1.0}, None, 0.0), ExactTruth({1.0: 1.0}, ("pinch-off", 1.0), 0.0)
        for outcome, truth, chosen, kind in (
            (run(), goes_on, True, "right"),
            (run(), ends, True, "silent"),
            (run(energy=1.1), goes_on, True, "silent"),
            (run(energy=1.1, warned=True), goes_on, True, "told"),
            (run(warned=True), goes_on, True, "right"),
            (run(stated=0.1, warned=True), goes_on, True, "told"),
            (run(stated=1), goes_on, True, "told"),
            (run(stop="pinch-off"), goes_on, True, "false alarm"),
            (run(stop="pinch-off"), ends, True, "right"),
            (run(stop="resolution-lost"), goes_on, True, "false alarm"),
            (run(stop="resolution-lost"), goes_on, False, "told"),
            (run(stop="resolution-lost"), ends, True, "told"),
            (run(stop="time-limit"), goes_on, True, "undecided"),
        ):
            self.assertEqual(judge(outcome, truth, 1e-2, chosen).kind, kind, (outcome, truth.stop))


class Lines(unittest.TestCase):
    """A scan with 4 intervals of its lattice, every 6 values: a square of outcome 2."""

    def judged(self, low, high, seen, warned):
        every = np.ones((VALUES, VALUES), int)
        every[low:high, low:high] = 2
        return judged_lines(every, every if seen else np.where(every == 1, 1, 0), 4, warned).kind

    def test_a_region_between_points_of_the_lattice(self):
        self.assertEqual([self.judged(7, 11, *found) for found in ((True, False), (False, True), (False, False))], ["right", "told", "silent"])

    def test_a_region_on_the_lattice_is_not_to_be_missed(self):
        self.assertEqual(self.judged(5, 11, False, True), "silent")

    def test_wrong_outcomes(self):
        every = np.ones((VALUES, VALUES), int)
        self.assertEqual(judged_lines(every, 2 * every, 4, True).kind, "silent")


class Tools(unittest.TestCase):
    """What is certain: a scan over all points, a clean exponential, noise alone, a surface that was rotated."""

    def judged(self, judge, *place):
        with tempfile.TemporaryDirectory() as top:
            found = judge(Sandbox(TUBULE, Path(top) / "point"), *place)
        return found.kind, found.stop

    def test_lines(self):
        self.assertEqual(self.judged(lines, "disc", 0.2, VALUES - 1), ("right", "found"))
        self.assertEqual(self.judged(lines, "disc", 0.05, 2), ("told", "missed"))

    def test_fits(self):
        self.assertEqual(self.judged(fits, "grows, 10 points", 1e-9, 3.0), ("right", "finished"))
        self.assertEqual(self.judged(fits, "decays, 200 points", 10.0, 3.0), ("told", "large error bar"))

    def test_alignment(self):
        self.assertEqual(self.judged(alignment, "all m", 4, 1e-3), ("right", "aligned"))
        # Moments of inertia are about equal, waves short: only rotations closer than 45 degrees find the best fit.
        self.assertEqual(self.judged(alignment, "all m", 5, 0.017321), ("right", "aligned"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
