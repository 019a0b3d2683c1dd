#!/usr/bin/python3
"""`tubule confirm`: points of a scan again in three dimensions, few triangles, short.

confirm_test.py TUBULE CASES
"""
import csv
import io
import json
import math
import sys
import unittest
from pathlib import Path

from program import ProgramTest

CASES = Path(sys.argv[2])

# A short tube that stays straight, and a longer one that buckles: overdamped, free volume, c = H0 R = -2, k42 = 3.2.
CASE = """tier = "axisym"
[energy]
k20 = 1.0
k42 = 3.2
H0 = -2.0
[model]
kind = "overdamped"
volume = "free"
[shape]
kind = "tube"
radius = 1.0
length = 12.0
[[shape.mode]]
amplitude = 1e-3
n = 1
[accuracy]
energy = 1e-2
[time]
end = 3.0
stationary = 1e-4
"""
FEW = ("--elements", "60", "--noise", "5e-3")


def buckling_rate(length, k42):
    """maths 5 (b), m = n = 1, P = 0, c = -2, k20 = 1: F2 = F1 = 2, Q = q^2 + 1, Z = q^2."""
    q2 = (2 * math.pi / length) ** 2
    return -(q2 + 1) / (q2 + 2) * (2 * q2 * q2 - 4 * q2 + 2 * k42 * q2 * q2)


class Confirm(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("case.toml", CASE)
        self.scan = self.folder / "scan.hdf"
        self.tubule("scan", "case.toml", "--over", "shape.length=6,12", "-o", self.scan)

    def rows(self, *arguments, status):
        out, _ = self.tubule("confirm", self.scan, *FEW, "--csv", "--quiet", *arguments, status=status)
        return list(csv.DictReader(io.StringIO(out)))

    def test_buckling(self):
        rows = self.rows("--end", "10", status=1)
        self.assertEqual(len(rows), 2)  # all there are
        by_length = {row["set"]: row for row in rows}
        short, long = by_length["shape.length=6"], by_length["shape.length=12"]
        for row in rows:
            self.assertEqual(row["axisym_outcome"], "uniform-tube")
        self.assertEqual(short["verdict"], "agrees")
        self.assertEqual(short["outcome"], "uniform-tube")
        self.assertEqual(long["verdict"], "symmetry-broken")
        self.assertEqual((int(float(long["n"])), int(float(long["m"]))), (1, 1))
        self.assertLess(buckling_rate(6, 3.2), 0)
        self.assertGreater(buckling_rate(12, 3.2), 0)

        # Once more: nothing is run again, and the words tell the rate.
        before = {path: path.stat().st_mtime_ns for path in (self.folder / "scan_confirm").glob("*.hdf")}
        self.assertEqual(len(before), 2)
        out, _ = self.tubule("confirm", self.scan, *FEW, "--end", "10", "--quiet", status=1)
        self.assertEqual({path: path.stat().st_mtime_ns for path in before}, before)
        self.assertIn("1 of 2 points agree", out)
        self.assertIn("grows, and tier 1 cannot see it", out)
        out, _ = self.tubule("confirm", self.scan, *FEW, "--end", "10", "--json", "--quiet", status=1)
        point = next(p for p in json.loads(out)["points"] if p["rates"])
        rate = next(r for r in point["rates"] if r["m"] == 1)
        self.assertAlmostEqual(rate["rate"], buckling_rate(12, 3.2), places=10)
        self.assertEqual(rate["n"], 1)

    def test_refusals(self):
        for words, *arguments in (
            ("--points must be 1 or more, not 0", "--points", "0"),
            ("--elements must be 1 or more, not 0", "--elements", "0"),
            ("--noise must be above 0 and below 0.01", "--noise", "0.5"),
            ("--end must be above 0", "--end", "-1"),
        ):
            self.assertIn(words, self.tubule("confirm", self.scan, *arguments, status=2)[1])
        self.assertIn("no result of tubule scan", self.tubule("confirm", "case.toml", status=2)[1])
        self.assertFalse((self.folder / "scan_confirm").exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
