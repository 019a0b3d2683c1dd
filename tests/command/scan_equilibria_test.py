#!/usr/bin/python3
"""Scans of equilibria: kinds of vesicles, where their energies are equal; grown, killed, across ranks; pictures.

scan_equilibria_test.py TUBULE CASES [MPIRUN]
"""
import os
import csv
import io
import json
import math
import signal
import subprocess
import sys
import unittest
from pathlib import Path

import h5py
import numpy as np
import schema

CASES = Path(sys.argv[2])
MPIRUN = sys.argv[3] if len(sys.argv) > 3 else None

from program import PROGRAM, ProgramTest, about, finished_points, study

FAMILY, VOLUME, H0 = "equilibrium.family", "equilibrium.reduced_volume", "energy.H0"
ALL = f'{FAMILY}="prolate","oblate","stomatocyte"'
# Independent spectral references: E/(16 pi) at reduced volume 0.7 and 0.8, H0 = 0.
REFERENCE = {("prolate", 0.7): 1.643270425349494, ("prolate", 0.8): 1.3874404324438243,
             ("oblate", 0.7): 1.6991110499676725, ("oblate", 0.8): 1.452538628564585}  # fmt: skip

ROUGH = "--set=accuracy.energy=1e-3"  # an error in a scan, in what is known of it or in its order shows as well


def contents(result):
    """All that a scan says of its points, but for times."""
    with h5py.File(result) as file:
        found = {f"points/{n}": d[()] for n, d in file["points"].items() if not n.endswith("_seconds")}
        found |= {f"equal_energies/{n}": d[()] for n, d in file["equal_energies"].items()}
        found |= {f"axes/{axis}": group["texts"][()] for axis, group in file["axes"].items()}
        found["boundary"] = file["boundary"][()]
        for name, group in file["thresholds"].items():
            found[f"thresholds/{name}"] = group["values"][()]
    return found


def crossings(result):
    """(kind, kind): the values between which their energies are equal, at the first place of the other axis."""
    with h5py.File(result) as file:
        group = file["equal_energies"]
        names = list(group["kinds"].attrs["names"])
        return [((names[a], names[b]), value, bool(lowest))
                for (a, b), value, lowest in zip(group["kinds"], group["value"], group["lowest"])]  # fmt: skip

os.environ["TUBULE_WRITE_SECONDS"] = "0.02"  # points are to be seen before a kill


class EquilibriaTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("vesicle.toml", (CASES / "vesicle.toml").read_text())
        self.result = self.folder / "scan.hdf"

    def scan(self, *arguments, status=0):
        return self.tubule("scan", *arguments, status=status)

    def assert_same(self, one, other):
        one, other = contents(self.folder / one), contents(self.folder / other)
        self.assertEqual(one.keys(), other.keys())
        for name, data in other.items():
            self.assertTrue(np.array_equal(one[name], data, equal_nan=data.dtype.kind == "f"), name)


class Found(EquilibriaTest):
    def test_energies_and_crossings(self):
        """Crossings by Seifert, Berndl and Lipowsky 1991: 0.652 and 0.591. Beyond 0.66 there are no stomatocytes."""
        self.scan("vesicle.toml", f"--over={ALL}", f"--over={VOLUME}=0.55,0.62,0.7,0.8", "--set=accuracy.energy=1e-8",
                  "-o", "scan.hdf")  # fmt: skip
        rows = list(csv.DictReader(io.StringIO(self.tubule("show", "scan.hdf", "--csv")[0])))
        self.assertEqual(len(rows), 12)
        kinds = {(row[FAMILY].strip('"'), float(row[VOLUME])): row for row in rows}
        for (family, volume), row in kinds.items():
            none = family == "stomatocyte" and volume > 0.66
            self.assertEqual(row["outcome"], "oblate" if none else family)
            if (family, volume) in REFERENCE:
                self.assertAlmostEqual(float(row["energy"]) / (16 * math.pi), REFERENCE[family, volume], delta=2e-8)
            self.assertEqual(row["free_energy"], row["energy"])  # no loads
            # Virial theorem: without H0 the energy is the same at all sizes, theory.md, section 8.
            self.assertAlmostEqual(2 * float(row["tension"]) * float(row["area"]),
                                   3 * float(row["pressure"]) * float(row["volume"]), delta=1e-4)  # fmt: skip
        found = {(pair, lowest): value for pair, value, lowest in crossings(self.result)}
        self.assertEqual(set(found), {(("prolate", "oblate"), True), (("oblate", "stomatocyte"), True),
                                      (("prolate", "stomatocyte"), False)})  # fmt: skip
        self.assertAlmostEqual(found[("prolate", "oblate"), True], 0.652, delta=2e-3)
        self.assertAlmostEqual(found[("oblate", "stomatocyte"), True], 0.591, delta=2e-3)
        self.assertAlmostEqual(found[("prolate", "oblate"), True], 0.65108, delta=1e-5)  # Newton: equilibrium_test.cpp
        self.assertAlmostEqual(found[("oblate", "stomatocyte"), True], 0.59119, delta=1e-5)
        text = self.tubule("show", "scan.hdf", "--json")[0]
        self.assertEqual(schema.against("show_scan", text), [])
        document = json.loads(text)
        self.assertEqual({entry["value"] for entry in document["equal_energies"]}, set(found.values()))
        self.assertEqual({entry["key"] for entry in document["equal_energies"]}, {VOLUME})

    def test_forces_of_tubes(self):
        """A tube at the tension s has the radius sqrt(k20/s) and the force 4 pi sqrt(k20 s): theory.md (3.16)."""
        self.write("tube.toml", 'tier = "axisym"\n[energy]\nk20 = 0.5\n[shape]\nkind = "tube"\nradius = 1.0\nlength = 2.0\n'
                   '[equilibrium]\nheld = "nothing"\n[model]\ntension = 0.5\n')  # fmt: skip
        self.scan("tube.toml", "--over=model.tension=0.5,2", "-o", "scan.hdf")
        rows = list(csv.DictReader(io.StringIO(self.tubule("show", "scan.hdf", "--csv")[0])))
        for row in rows:
            s = float(row["model.tension"])
            self.assertAlmostEqual(float(row["force"]), 4 * math.pi * math.sqrt(0.5 * s), delta=1e-3)
            self.assertAlmostEqual(float(row["r_max"]), math.sqrt(0.5 / s), delta=1e-3)
        self.assertEqual(len(rows), 2)

    @study
    def test_pears_and_vesiculated_limits(self):
        """Energies of limits: scipy.optimize.brentq for R^2 + r^2 = 1, R^3 + r^3 = v."""
        self.scan("vesicle.toml", f'--over={FAMILY}="prolate","pear"', f"--over={VOLUME}=0.77,0.9",
                  f"--over={H0}=-2.8,-3.4", ROUGH, "-o", "scan.hdf")  # fmt: skip
        rows = list(csv.DictReader(io.StringIO(self.tubule("show", "scan.hdf", "--csv")[0])))
        row = {(r[FAMILY].strip('"'), float(r[VOLUME]), float(r[H0])): r for r in rows}
        self.assertEqual(row["pear", 0.77, -2.8]["outcome"], "pear")
        self.assertAlmostEqual(float(row["pear", 0.77, -2.8]["limit_energy"]), 6.305364038013985, delta=1e-9)
        above = row["pear", 0.77, -3.4]
        self.assertEqual(above["outcome"], "failed")
        self.assertGreater(float(above["free_energy"]), float(above["limit_energy"]))
        lines = self.tubule("show", "scan.hdf")[0].splitlines()
        self.assertEqual([line.strip() for line in lines[-2:]], ["vl", "pl"])  # the upper line is that of H0 = -3.4
        self.plot("scan.hdf", "-o", "map.svg")
        self.assertIn("vesiculated limit is lower (1)", (self.folder / "map.svg").read_text())

    def test_spheres_with_a_neck(self):
        """Spheres of the radii cos a and sin a have the area of one of radius 1. Seifert's limits: -H0 = 1/R1 +- 1/R2."""
        a = 0.5
        inside, beside = math.cos(a) ** 3 - math.sin(a) ** 3, math.cos(a) ** 3 + math.sin(a) ** 3
        neck = {inside: 1 / math.sin(a) - 1 / math.cos(a), beside: -1 / math.sin(a) - 1 / math.cos(a)}
        # theory.md (2.20): with area differences for H0 - alpha (M - M0)/(2 k20), k20 = 1, M = -8 pi (R1 +- R2).
        alpha, M0 = 0.1, -28
        for name, volume, M in (("sphere_in_sphere", inside, -8 * math.pi * (math.cos(a) - math.sin(a))),
                                ("two_spheres", beside, -8 * math.pi * (math.cos(a) + math.sin(a)))):  # fmt: skip
            for sets, shift in ((), 0), ((f"--set=energy.alpha={alpha}", f"--set=energy.M0={M0}"), alpha * (M - M0) / 2):
                at = neck[volume] + shift
                self.scan("vesicle.toml", f"--over={VOLUME}={volume},{volume + 0.01}", f"--over={H0}={at - 0.01},{at + 0.01}",
                          "--set=accuracy.energy=1e-2", f'--set={FAMILY}="prolate"', *sets, "-o", f"{name}.hdf", "--overwrite")  # fmt: skip
                with h5py.File(self.folder / f"{name}.hdf") as file:
                    values = file[f"thresholds/{name}/values"][()]
                self.assertAlmostEqual(abs(values[0, 0]), 0.01, delta=1e-9)
                self.assertAlmostEqual(values[0, 0], -values[0, -1], delta=1e-9)

    @study
    def test_along_a_line_only(self):
        """The points along the lines alone, and the crossings that the whole map has there."""
        over = (f"--over={ALL}", f"--over={VOLUME}=0.55:0.7:11", f"--over={H0}=-0.2,-0.1,0", ROUGH)
        self.scan("vesicle.toml", *over, "-o", "map.hdf")
        self.scan("vesicle.toml", *over, "--boundary", "outcome", "--seeds", "3", "-o", "line.hdf")
        whole, line = contents(self.folder / "map.hdf"), contents(self.folder / "line.hdf")
        self.assertLess(np.count_nonzero(line["points/outcome"]), 0.8 * whole["points/outcome"].size)
        lowest = {number: value for number, value, is_lowest in zip(
            whole["equal_energies/number"], whole["equal_energies/value"], whole["equal_energies/lowest"]) if is_lowest}  # fmt: skip
        found = dict(zip(line["equal_energies/number"], line["equal_energies/value"]))
        self.assertEqual(lowest, {number: found[number] for number in lowest})


class Grown(EquilibriaTest):
    OVER = (f"--over={ALL}", f"--over={VOLUME}=0.55,0.6,0.65,0.7", f"--over={H0}=-0.2,-0.1,0", ROUGH)

    @study
    def test_on_two_axes_merged_and_across_ranks(self):
        self.scan("vesicle.toml", *self.OVER, "-o", "whole.hdf")
        self.scan("vesicle.toml", f"--over={ALL}", f"--over={VOLUME}=0.55,0.65", f"--over={H0}=-0.2,0", ROUGH, "-o", "scan.hdf")
        self.scan("scan.hdf", "--extend", f"--over={VOLUME}=0.6,0.7", f"--over={H0}=-0.1", "--jobs", "1", "-o", "grown.hdf")
        self.assert_same("grown.hdf", "whole.hdf")
        self.scan("vesicle.toml", f'--over={FAMILY}="prolate"', *self.OVER[1:], "-o", "one.hdf")
        self.scan("vesicle.toml", f'--over={FAMILY}="oblate","stomatocyte"', *self.OVER[1:], "-o", "two.hdf")
        self.scan("one.hdf", "--merge", "two.hdf")
        self.assert_same("one.hdf", "whole.hdf")
        if MPIRUN:
            command = [MPIRUN, "--allow-run-as-root", "--oversubscribe", "-n", "3", PROGRAM, "scan", "scan.hdf",
                       "--extend", f"--over={VOLUME}=0.6,0.7", f"--over={H0}=-0.1", "-o", "ranks.hdf"]  # fmt: skip
            done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(about(self.folder / "ranks.hdf")["workers"], 3)
            self.assert_same("ranks.hdf", "whole.hdf")

    def test_killed_and_resumed(self):
        self.scan("vesicle.toml", *self.OVER, "-o", "whole.hdf")
        first, again = ("vesicle.toml", *self.OVER, "-o", "scan.hdf"), ("scan.hdf", "--resume")
        for arguments, points in ((first, 8), (again, 36)):  # when all 36 are known, the crossings are being looked for
            with self.start("scan", *arguments, "--jobs", "1", "--quiet") as process:
                self.wait(process, lambda: finished_points(self.result) >= points)
                process.send_signal(signal.SIGKILL)
        self.scan("scan.hdf", "--resume")
        self.assert_same("scan.hdf", "whole.hdf")


class Shown(EquilibriaTest):
    def test_pictures_and_words(self):
        self.scan("vesicle.toml", f"--over={ALL}", f"--over={VOLUME}=0.55:0.7:4", f"--over={H0}=-0.2,-0.1,0", ROUGH,
                  "-o", "scan.hdf")  # fmt: skip
        out, _ = self.tubule("show", "scan.hdf")
        self.assertIn("the shapes of least energy", out)
        self.assertIn("    sool\n    soll\n    ooll\n", out)  # lines cross H0 = 0 at 0.591 and 0.651
        for name, options in (("map", ()), ("energy", ("--quantity", "energy")),
                              ("oblate", ("--slice", f'{FAMILY}="oblate"', "--quantity", "pressure")),
                              ("line", ("--slice", f"{H0}=0"))):  # fmt: skip
            picture = self.folder / f"{name}.svg"
            self.plot("scan.hdf", *options, "-o", picture)
            text = picture.read_text()
            self.assertEqual("equal energies" in text, name in ("map", "energy"), name)

    def test_refusals(self):
        self.scan("vesicle.toml", f"--over={VOLUME}=0.6,0.7", "-o", "scan.hdf")
        self.assertIn("--end is for scans of motions", self.refused("confirm", "scan.hdf", "--end", "1"))
        self.assertIn("refine must be absent", self.refused("scan", "vesicle.toml", f"--over={ALL}", f"--over={VOLUME}=0.6,0.7",
                                                            "--boundary", "outcome", "--refine", "2"))  # fmt: skip
        self.assertIn("is of closed cells", self.refused(
            "run", "vesicle.toml", '--set=shape={kind="tube",radius=1,length=4}'))  # fmt: skip
        self.assertIn("needs area and volume", self.refused(
            "check", "vesicle.toml", '--set=equilibrium={held="area",area=12.0,family="oblate"}'))  # fmt: skip


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
