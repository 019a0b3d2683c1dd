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
from judging import ExactTruth, judge, kind_of_error  # noqa: E402


class Corners(unittest.TestCase):
    """Of the map of k40: f_HH = 0.4 + 12 k40 (H - H0)^2 at H = -1 is negative for k40 = -0.1, H0 = -4 and 2."""

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

    def test_picture_and_page(self):
        picture, page = self.folder / "k40.png", self.folder / "page.md"
        subprocess.run([HERE / "draw.py", self.folder / "k40.csv", "-o", picture], check=True)
        self.assertGreater(picture.stat().st_size, 5000)
        page.write_text("# Page\n\n<!-- counts -->\nearlier\n<!-- end -->\n\n<!-- silent -->\n<!-- end -->\nlast\n")
        subprocess.run([HERE / "page.py", self.folder, page], check=True)
        text = page.read_text()
        self.assertIn("\n| `k40` | axisym | 4 | 4 |  |  |  |  |\n", text)
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


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
