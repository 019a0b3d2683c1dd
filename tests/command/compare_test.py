#!/usr/bin/python3
"""`tubule compare`: exit statuses, tables, refusals, pictures.

compare_test.py TUBULE
"""
import csv
import io
import json
import shutil
import sys
import unittest

import h5py
import numpy as np

from program import QUICK, ProgramTest

SPHERE = """tier = "surface3d"
[energy]
k20 = 1.0
[shape]
kind = "sphere"
radius = {radius}
[discretisation]
elements = 320
order = 3
"""

# A tube that stays what it is: no bending energy there (H0 = -1/radius), so its series are constant.
STRAIGHT = """tier = "axisym"
[energy]
k20 = 1.0
H0 = {H0}
[shape]
kind = "tube"
radius = {radius}
length = 2.0
[time]
end = 1.0
output = [0.5]
"""

UNITS = """[units]
length = "50 nm"
bending_rigidity = "20 kT"
friction = "2e4 Pa s/m"
"""


class Compare(ProgramTest):
    def made(self, name, text, *options):
        self.tubule("run", "--quiet", self.write(f"{name}.toml", text), "-o", f"{name}.hdf", *options)
        return f"{name}.hdf"

    def compared(self, *arguments, status=0):
        return json.loads(self.tubule("compare", "--json", *arguments, status=status)[0])

    def edited(self, original, name, edit):
        shutil.copy(self.folder / original, self.folder / name)
        with h5py.File(self.folder / name, "r+") as file:
            edit(file)
        return name


class Runs(Compare):
    def setUp(self):
        super().setUp()
        self.coarse = self.made("coarse", QUICK + UNITS, "--set", "accuracy.energy=1e-3")
        self.fine = self.made("fine", QUICK + UNITS)

    def test_two_accuracies(self):
        """Each run meets its stated error: beyond interpolation the two differ by no more than the sum of both."""
        found = self.compared(self.coarse, self.fine)
        energy = {entry["name"]: entry for entry in found["series"]}["energy"]
        stated = found["a"]["stated_error"] + found["b"]["stated_error"]
        self.assertLess((energy["largest"] - energy["interpolation"]) / energy["scale"], stated)
        self.assertGreater(energy["largest"] / energy["scale"], 1e-9)  # the runs are not identical
        self.assertEqual([frame["time"] for frame in found["frames"]], [0, 0.01, 0.05, 0.2])
        for frame in found["frames"]:
            self.assertLess(frame["l2"], frame["hausdorff"])
            # r varies by 0.2 and the energy by E_ref = 24.5: shapes agree about as well as energies.
            self.assertLess(frame["hausdorff"], 10 * stated)

    def test_at_common_rows_nothing_is_interpolated(self):
        found = self.compared(self.coarse, self.fine)
        energy = {entry["name"]: entry for entry in found["series"]}["energy"]
        with h5py.File(self.folder / self.coarse) as a, h5py.File(self.folder / self.fine) as b:
            times = sorted(set(a["series/time"][:]) & set(b["series/time"][:]))
            at = [[file["series/energy"][list(file["series/time"][:]).index(t)] for t in times] for file in (a, b)]
        self.assertLessEqual({0, 0.01, 0.05, 0.2}, set(times))
        self.assertEqual(energy["rows_in_both"], len(times))
        self.assertEqual(energy["both_rows"], np.abs(np.subtract(*at)).max())
        self.assertEqual(energy["at_end"], abs(at[0][-1] - at[1][-1]))

    def test_a_result_agrees_with_itself(self):
        options = [f"--tolerance={name}=0" for name in ("energy", "rate", "r_min", "outcome")]
        found = self.compared(self.fine, self.fine, *options, "--tolerance=shape=1e-12")
        self.assertTrue(all(check["within"] for check in found["checks"]))
        self.assertEqual(len(found["checks"]), 5)

    def test_status_tells_what_is_beyond_its_tolerance(self):
        out, _ = self.tubule(
            "compare", self.coarse, self.fine, "--tolerance", "energy=1e-9", "--tolerance", "shape=1", status=1
        )
        self.assertRegex(out, r"(?m)^energy .* > +1e-09 +BEYOND$")
        self.assertRegex(out, r"(?m)^shape .* <= 1 +within$")
        self.tubule("compare", self.coarse, self.fine)  # without tolerances nothing is beyond

    def test_known_changes_of_a_series(self):
        def raise_volume(file):
            file["series/volume"][1:] *= 1.01

        other = self.edited(self.fine, "other.hdf", raise_volume)
        found = self.compared(self.fine, other, "--no-shapes")
        volume = {entry["name"]: entry for entry in found["series"]}["volume"]
        with h5py.File(self.folder / self.fine) as file:
            values = file["series/volume"][:]
        self.assertAlmostEqual(volume["largest"], 0.01 * values[1:].max(), delta=1e-12)
        self.assertAlmostEqual(volume["scale"], values.max(), delta=1e-12)
        self.assertAlmostEqual(found["a"]["volume_drift"], np.abs(values / values[0] - 1).max(), delta=1e-12)
        self.assertAlmostEqual(found["b"]["volume_drift"], np.abs(1.01 * values[1:] / values[0] - 1).max(), delta=1e-12)
        self.tubule("compare", self.fine, other, "--tolerance", "volume=0.009", status=1)
        self.tubule("compare", self.fine, other, "--tolerance", "volume=0.011")

    def test_outcomes(self):
        pinched = self.made_to_stop()
        found = self.compared(self.fine, pinched, "--tolerance=outcome=10", status=1)
        self.assertEqual([found["a"]["stop"], found["b"]["stop"]], ["finished", "pinch-off"])
        self.assertIsNone(found["checks"][0]["value"])
        self.assertIn("the outcomes differ: finished and pinch-off", self.tubule("compare", self.fine, pinched)[0])
        shorter = self.made("shorter", QUICK, "--set", "time.end=0.18")
        self.tubule("compare", self.fine, shorter, "--tolerance", "outcome=0.11")  # 0.18 of 0.2
        self.tubule("compare", self.fine, shorter, "--tolerance", "outcome=0.09", status=1)

    def made_to_stop(self):
        # It shrinks, and 0.8 counts as a pinch-off.
        options = ("--set", "accuracy.r_min=0.8", "--set", "energy.H0=-2.0")
        self.tubule("run", "--quiet", self.case, "-o", "pinched.hdf", *options, status=3)
        return "pinched.hdf"

    def test_csv(self):
        rows = list(csv.DictReader(io.StringIO(self.tubule("compare", self.coarse, self.fine, "--csv")[0])))
        found = self.compared(self.coarse, self.fine)
        self.assertEqual([row["quantity"] for row in rows if row["kind"] == "series"], [s["name"] for s in found["series"]])
        shapes = [float(row["difference"]) for row in rows if row["quantity"] == "shape"]
        self.assertEqual(shapes, [frame["hausdorff"] for frame in found["frames"]])

    def test_picture(self):
        self.tubule("compare", self.coarse, self.fine, "--plot", "picture.svg", "--tolerance", "energy=1e-3")
        picture = (self.folder / "picture.svg").read_text()
        for words in ("A: coarse.hdf", "B: fine.hdf", "rate dE/dt", "shape, Hausdorff", "tolerance", "time t [\u00b5s]", "energy E [kT]"):
            self.assertIn(words, picture)
        self.assertIn("picture.jpg", self.tubule("compare", self.coarse, self.fine, "--plot", "picture.jpg", status=2)[1])

    def test_refusals(self):
        self.assertIn("nowhere.hdf", self.refused("compare", "nowhere.hdf", self.fine))
        self.assertIn("case.toml", self.refused("compare", self.fine, self.case))
        self.tubule("scan", self.case, "--over", "energy.k42=0.1,0.2", "--quiet", "-o", "scan.hdf")
        self.assertIn("scan.hdf: is the result of a scan: this needs the result of a run",
                      self.refused("compare", self.fine, "scan.hdf"))  # fmt: skip
        self.assertIn("are needed", self.refused("compare", self.fine))
        self.assertIn("did you mean 'energy'?", self.refused("compare", self.fine, self.fine, "--tolerance=enregy=1"))
        for bad in ("energy", "energy=", "energy=-1", "energy=much", "energy=nan"):
            self.assertIn("must be NAME=VALUE", self.refused("compare", self.fine, self.fine, f"--tolerance={bad}"))
        for bad in ("1", "1:", "a:0", "1:2:3"):
            self.assertIn("must be I:J", self.refused("compare", self.fine, self.fine, f"--frames={bad}"))
        self.assertIn("no frame 4: there are 0 to 3", self.refused("compare", self.fine, self.fine, "--frames=0:4"))
        self.assertIn("--no-shapes must be absent", self.refused("compare", self.fine, self.fine, "--align", "--no-shapes"))

        def later(file):
            for frame in file["frames"].values():
                frame.attrs["time"] += 7

        other = self.edited(self.fine, "later.hdf", later)
        err = self.refused("compare", self.fine, other)
        self.assertIn("no frames in common: A has t = 0, 0.01, 0.05, 0.2; B has t = 7, 7.01, 7.05, 7.2", err)
        self.assertIn("--frames", err)
        self.tubule("compare", self.fine, other, "--no-shapes")
        self.assertIn("must be one of", self.refused("compare", self.fine, other, "--no-shapes", "--tolerance=shape=1"))


class Shapes(Compare):
    def test_tubes_of_known_radii(self):
        """Stationary cylinders: 1 and 1.25, one 0.25 from the other at all times."""
        one = self.made("one", STRAIGHT.format(radius=1.0, H0=-1.0))
        other = self.made("other", STRAIGHT.format(radius=1.25, H0=-0.8))
        found = self.compared(one, other)
        self.assertEqual([frame["time"] for frame in found["frames"]], [0, 0.5, 1])
        for frame in found["frames"]:
            for key, expected in (("hausdorff", 0.25), ("l2", 0.25), ("size", 1)):
                self.assertAlmostEqual(frame[key], expected, delta=1e-7)
        self.tubule("compare", one, other, "--tolerance", "shape=0.2501")
        self.tubule("compare", one, other, "--tolerance", "shape=0.2499", status=1)

    def test_spheres_of_the_other_tier(self):
        """Concentric, 0.1 apart; the meshes are off by 1e-4 at most (tests/compare)."""
        one, other = (self.made(f"r{radius}", SPHERE.format(radius=radius)) for radius in (1.0, 1.1))
        (frame,) = self.compared(one, other)["frames"]
        self.assertAlmostEqual(frame["hausdorff"], 0.1, delta=2e-4)
        self.assertAlmostEqual(frame["l2"], 0.1, delta=1e-4)

        def move(file):
            """Half a turn about x, and 3 along it."""
            points = file["frames/000000/Points"]
            points[:] = points[:] * [1, -1, -1] + [3, 0, 0]

        moved = self.edited(other, "moved.hdf", move)
        self.assertGreater(self.compared(one, moved)["frames"][0]["hausdorff"], 2)
        (aligned,) = self.compared(one, moved, "--align")["frames"]
        self.assertAlmostEqual(aligned["hausdorff"], 0.1, delta=2e-4)
        # Only the motion of the centre is determined: a sphere fits in any orientation.
        np.testing.assert_allclose(aligned["moved"], [-3, 0, 0], atol=1e-4)

    def test_a_frame_of_tier_1_and_its_mesh(self):
        self.tubule("run", "--quiet", self.case)
        case = SPHERE.split("[shape]")[0] + '[shape]\nkind = "result"\npath = "case.hdf"\nframe = 2\n'
        mesh = self.made("mesh", case + "[accuracy]\nenergy = 1e-3\n")
        (frame,) = self.compared("case.hdf", mesh, "--frames", "2:0", "--tolerance=shape=1e-3")["frames"]
        self.assertLess(frame["l2"], 2e-4)
        self.assertGreater(frame["l2"], 1e-9)
        out, _ = self.tubule("compare", "case.hdf", mesh, "--frames=0:-1", "--tolerance=shape=1e-3", status=1)
        self.assertRegex(out, r"(?m)^shape .* BEYOND$")

    def test_a_tube_is_no_sphere(self):
        one = self.made("one", STRAIGHT.format(radius=1.0, H0=-1.0))
        err = self.refused("compare", one, self.made("sphere", SPHERE.format(radius=1.0)))
        self.assertIn("one is a tube of period 2.000000, the other is a closed surface", err)
        damaged = self.edited(one, "damaged.hdf", lambda file: [frame.pop("knots") for frame in file["frames"].values()])
        self.edited(damaged, "damaged.hdf2", lambda file: [frame.pop("r") for frame in file["frames"].values()])
        self.assertIn("frame 0 of B, t = 0: it is damaged: knots is missing", self.refused("compare", one, "damaged.hdf2"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
