#!/usr/bin/python3
"""`tubule equilibrium`: its table, its result, results as starts, refusals. Argument: the program."""
import json
import re
import unittest
from pathlib import Path

import h5py
import numpy as np

from program import CAPSULE, ProgramTest, about, series, study
import scripts

CASE = CAPSULE + "modes = 2\n"
BRANCH = """[equilibrium.branch]
vary = "energy.k42"
to = 0.0
step = 0.06
"""
# Independent spectral reference (tests/axisym/equilibrium_test.cpp), k42 = 0.12, 0.06, 0.
ENERGIES = (6.3849499091967346, 3.831523408595685, 1.2568365089070843)


PLOT = Path(__file__).resolve().parents[2] / "tools/python/tubule/drawing"
FIGURES = Path(__file__).resolve().parents[2] / "docs/figures"


class Equilibrium(ProgramTest):
    def test_a_sphere_leads_nowhere_and_a_family_does(self):
        vesicle = CASE.replace('kind = "capsule"', 'kind = "sphere"').replace("radius = 0.5", "radius = 1.0")
        lines = [line for line in vesicle.splitlines() if not line.startswith(("length", "[equilibrium]", "modes"))]
        case = self.write("cell.toml", "\n".join([*lines, "[equilibrium]", "reduced_volume = 0.9"]))
        out, _ = self.tubule("run", case, status=4)
        self.assertIn("a sphere leads to no other area and volume", out)
        self.assertIn("or by equilibrium.family", out)
        self.assertEqual(about(self.folder / "cell.hdf")["estimated_error"], 1)  # nothing is known
        out, _ = self.tubule("run", case, "--set", 'equilibrium.family="prolate"', "--overwrite")
        self.assertNotIn("family", out)
        # No stomatocyte has this reduced volume: Seifert, Berndl, Lipowsky, Phys. Rev. A 44, 1182 (1991).
        out, _ = self.tubule("run", case, "--set", 'equilibrium.family="stomatocyte"', "--overwrite")
        self.assertIn("began at the family stomatocyte and found a shape of the family oblate", out)

    def test_one_shape(self):
        case = self.write("cell.toml", CASE)
        out, _ = self.tubule("equilibrium", case)
        self.assertIn("cell.toml: finished: ", out)  # at no time: nothing moves
        header, row = out.splitlines()[-2:]
        self.assertEqual(header.split(), ["energy", "tension", "pressure", "height", "r_max", "neg", "growth", "of", "m"])
        self.assertAlmostEqual(float(row.split()[0]), ENERGIES[0], delta=1e-6)
        result = self.folder / "cell.hdf"
        self.assertEqual(about(result)["stop"], "finished")
        self.assertAlmostEqual(series(result)["energy"][0], ENERGIES[0], delta=1e-6)
        shown, _ = self.tubule("show", result)
        self.assertIn("distance_to_start", shown)
        self.tubule("equilibrium", case, "--quiet", "-o", "other.hdf")
        self.assertIn("other.hdf", self.files())

    @study
    def test_a_surface_from_a_profile(self):
        """The energy and the slowest rates of tier axisym, which tests/axisym compares with a spectral reference."""
        cell = self.write("cell.toml", CASE)
        self.tubule("equilibrium", cell)
        lines = [line for line in CASE.splitlines() if not line.startswith(("length", "radius", "modes", "tier"))]
        text = "\n".join(['tier = "surface3d"', *lines, "rates = 3"]).replace('"capsule"', '"result"\npath = "cell.hdf"')
        text = text.replace("energy = 1e-8", "energy = 1e-3")
        case = self.write("surface.toml", text)
        out, _ = self.tubule("equilibrium", case)
        header, row = out.splitlines()[-2:]
        self.assertEqual(header.split(), ["energy", "tension", "pressure", "height", "r_max", "neg", "growth", "of", "m"])
        self.assertEqual(row.split()[-1], "2")
        result, profile = series(self.folder / "surface.hdf"), series(self.folder / "cell.hdf")
        self.assertAlmostEqual(result["energy"][0], profile["energy"][0], delta=2 * result["energy_error"][0])
        for name, m in (("rate_1", 2), ("rate_2", 2), ("rate_3", 1)):
            self.assertAlmostEqual(result[name][0] / profile[f"growth_{m}"][0], 1, delta=1e-2)
            self.assertEqual(result[name.replace("rate", "wave_number")][0], m)
        self.assertEqual(result["negative_directions"][0], 0)
        with h5py.File(self.folder / "surface.hdf") as file:
            frame = file["frames/000000"]
            self.assertEqual(frame.attrs["kind"], "surface")
            for i in (1, 2, 3):
                self.assertAlmostEqual(abs(frame[f"PointData/mode_{i}"][()]).max(), 1)
        self.assertIn("complete", self.tubule("run", case, "--resume")[0])
        self.stability_of_the_surface(case, cell, result)
        self.begins_along_its_modes(cell, text)
        sphere = self.write("sphere.toml", text.replace('"result"\npath = "cell.hdf"', '"sphere"\nradius = 1.0') + "\nreduced_volume = 0.9\n")
        out, _ = self.tubule("equilibrium", sphere, "--set", "discretisation.elements=80", status=4)
        self.assertIn("start at an ellipsoid or a sphere with waves", out)

    def stability_of_the_surface(self, case, cell, result):
        answer = json.loads(self.tubule("stability", case, "--json", "--rates", "3")[0])
        self.assertEqual((answer["shape"], answer["negative_directions"]), ("surface", 0))
        table, _ = self.tubule("stability", self.folder / "surface.hdf", "--rates", "3")
        self.assertRegex(table, r"gradient-flow(?s:.*)\n +0 directions lower the energy")
        rows = re.findall(r"(?m)^ +\d +(\d+) +(-\S+) ", table)
        for found in [(mode["m"], mode["rate"]) for mode in answer["modes"]], rows:
            self.assertEqual([int(m) for m, _ in found], [2, 2, 1])
            for i, (_, rate) in enumerate(found):
                self.assertAlmostEqual(float(rate) / result[f"rate_{i + 1}"][0], 1, delta=1e-3)
        model = ("--model", "overdamped", "--gamma", "2", "--json", "--rates", "3")
        (profile,) = json.loads(self.tubule("stability", cell, *model)[0])["models"]
        modes = json.loads(self.tubule("stability", case, *model)[0])["modes"]
        self.assertEqual([mode["model"] for mode in modes], 3 * ["overdamped"])
        for mode in modes:
            exact = [one["rate"] for one in profile["slowest"] if one["m"] == mode["m"]]
            self.assertLess(min(abs(mode["rate"] / rate - 1) for rate in exact), 1e-2)
        fluid = json.loads(self.tubule("stability", case, "--model", "fluid", "--Re", "10", "--json", "--rates", "2")[0])["modes"]
        for mode in fluid:
            self.assertEqual(mode["model"], "fluid")
            self.assertLess(mode["rate"], 0)
            self.assertGreater(mode["frequency"], mode["frequency_error"])
        self.assertIn("--kT does not apply", self.tubule("stability", case, "--kT", "1", status=2)[1])

    def begins_along_its_modes(self, cell, text):
        """Displaced by the amplitude times the mode, along the normal; m = 2 of a profile in both directions."""

        def points(name):
            with h5py.File(self.folder / f"{name}.hdf") as file:
                frame = file["frames/000000"]
                return frame["Points"][()], {key: value[()] for key, value in frame.get("PointData", {}).items()}

        begin = text[: text.index("[equilibrium]")].replace("cell.hdf", "{}").replace("[accuracy]", "[[shape.eigenmode]]\nof = '{}'\namplitude = {}\n[accuracy]")
        case = self.write("along.toml", begin.format("surface.hdf", "mode_2", 0.05))
        self.tubule("run", case, "--quiet")
        (before, data), (after, _) = points("surface"), points("along")
        expected = before + 0.05 * data["mode_2"][:, None] * data["normal"]
        nearest = after[[abs(after - point).sum(axis=1).argmin() for point in expected]]
        apart = abs(((nearest - expected) * data["normal"]).sum(axis=1))  # another mesh: its points lie in between
        self.assertLess(apart.max(), 0.02)
        self.assertLess(apart.mean(), 0.003)
        refused = self.tubule("run", case, "-o", "no.hdf", "--set", "shape.eigenmode.0.of='mode_4'", status=2)[1]
        self.assertIn('shape.eigenmode.0.of must be a mode of the frame, mode_1 or mode_2 or mode_3, not "mode_4"', refused)
        self.assertIn('needs tier "surface3d"', self.tubule("run", case, "-o", "no.hdf", "--set", "tier='axisym'", "--set", "time.end=1", status=2)[1])
        self.tubule("equilibrium", "--quiet", "--overwrite", cell, "--set", "equilibrium.modes=2")
        self.write("along.toml", begin.format("cell.hdf", "displacement_2", 0.03))
        self.tubule("run", case, "--quiet", "--overwrite")
        x, y, z = points("along")[0].T
        middle = abs(z - z.mean()) < 0.05
        turns = 2 * np.arctan2(y, x)[middle]
        columns = np.stack([np.ones_like(turns), np.cos(turns), np.sin(turns)], axis=1)
        _, *wave = np.linalg.lstsq(columns, np.hypot(x, y)[middle], rcond=None)[0]
        self.assertAlmostEqual(np.hypot(*wave), 0.03, delta=0.002)

    def test_spheres_joined_by_points_are_named(self):
        """Closed form, theory.md (8.11): spheres of the radii cos a and sin a."""
        case = Path(__file__).parents[2] / "cases/vesicle.toml"
        sets = ["--set", "energy.H0=-3.0", "--set", "equilibrium.reduced_volume=0.8", "--overwrite", "-o", self.result]
        out, _ = self.tubule("equilibrium", case, *sets, "--set", 'equilibrium.family="prolate"')
        self.assertIn("a vesiculated limit has less energy, 10.6916 for 12.9073: spheres of the radii", out)
        out, _ = self.tubule("equilibrium", case, *sets, "--set", 'equilibrium.family="pear"')
        self.assertNotIn("vesiculated", out)
        out, _ = self.tubule("equilibrium", case, *sets, "--set", 'equilibrium.family="prolate"', "--set", "energy.k42=0.01")
        self.assertNotIn("vesiculated", out)  # K^2 keeps necks open

    def test_minus_zero_is_zero(self):
        # The volume is free, so no pressure acts; the file has it as -0.
        case = Path(__file__).parents[2] / "cases/equilibrium_two_domains.toml"
        out, _ = self.tubule("equilibrium", case, "-o", self.result)
        self.assertEqual(out.splitlines()[-1].split()[2], "0")
        for words in (out, self.tubule("show", self.result)[0], self.tubule("show", self.result, "--csv")[0],
                      self.tubule("show", self.result, "--json")[0]):  # fmt: skip
            self.assertNotRegex(words, r"(?<![\w.])-0(\.0)?(?![\w.])")

    def test_branch_and_shapes_as_starts(self):
        case = self.write("branch.toml", CASE + BRANCH)
        out, _ = self.tubule("equilibrium", case)
        rows = [line.split() for line in out.splitlines()[-3:]]
        for row, k42, energy in zip(rows, (0.12, 0.06, 0), ENERGIES):
            self.assertAlmostEqual(float(row[0]), k42, delta=1e-9)
            self.assertAlmostEqual(float(row[1]), energy, delta=1e-6)
        # The shape at k42 = 0.06 is at rest already, with the area and volume it has.
        again = CASE.replace('kind = "capsule"\nradius = 0.5\nlength = 2.0', 'kind = "result"\npath = "branch.hdf"\nframe = 1')
        self.tubule("equilibrium", "--quiet", self.write("again.toml", again), "--set", "energy.k42=0.06")
        found = series(self.folder / "again.hdf")
        self.assertAlmostEqual(found["energy"][0], ENERGIES[1], delta=1e-6)
        self.assertLess(found["distance_to_start"][0], 1e-5)

    def test_the_surface_meets_itself(self):
        text = CASE.replace("k42 = 0.12", "").replace("H0 = -2.0", "").replace("modes = 2", "reduced_volume = 0.55")
        text = text.replace('kind = "capsule"\nradius = 0.5\nlength = 2.0', 'kind = "ellipsoid"\na = 1.0\nb = 1.0\nc = 0.5')
        case = self.write(
            "oblate.toml", text + '[equilibrium.branch]\nvary = "equilibrium.reduced_volume"\nto = 0.4\nstep = 0.02\n'
        )
        out, _ = self.tubule("equilibrium", case, status=3)
        self.assertIn("bifurcation", out)
        self.assertEqual(about(self.folder / "oblate.hdf")["stop"], "self-intersection")

    def test_pictures(self):
        case = self.write("branch_cell.toml", CASE + BRANCH)
        under_k40 = ("energy.k42=0.0", "energy.k40=0.12", "equilibrium.branch.vary=energy.k40")
        for key, changes in (("k42", ()), ("k40", under_k40)):
            for length in (2, 3, 4):
                sets = [word for change in (f"shape.length={length}.0", *changes) for word in ("--set", change)]
                self.tubule("equilibrium", "--quiet", case, *sets, "-o", f"{key}_l{length}.hdf")
        single = self.write("single.toml", CASE)
        for k42, k40 in ((0, 0), (0.06, 0), (0.12, 0), (0, 0.02), (0, 0.06)):
            for i, length in enumerate((2.0, 2.5)):
                sets = ("--set", f"energy.k42={k42}", "--set", f"energy.k40={k40}", "--set", f"shape.length={length}")
                self.tubule("equilibrium", "--quiet", single, *sets, "-o", f"length_{k42:g}_{k40:g}_{i:02}.hdf")
        for script, inputs, words in (
            ("tubular", [self.folder], ("l = 4", "distance to the capsule")),
            ("vesicles", [self.folder / "k42_l2.hdf", self.folder / "k42_l3.hdf"], ("reduced volume", "bifurcation")),
        ):
            picture = self.folder / f"{script}.svg"
            done = scripts.run_script(PLOT, FIGURES / f"{script}.py", *inputs, "-o", picture)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            for word in words:
                self.assertIn(word, picture.read_text())
            done = scripts.run_script(PLOT, FIGURES / f"{script}.py", *inputs, "-o", "picture.txt")
            self.assertEqual(done.returncode, 2)

    def test_refusals(self):
        _, err = self.tubule("equilibrium", self.case, status=2)
        self.assertEqual(err, f"{self.case}: is a time-dependent case: an equilibrium needs a table [equilibrium]\n")
        cell = self.write("cell.toml", CASE)
        _, err = self.tubule("equilibrium", cell, "--set", "equilibrium.area=1.0", status=2)
        self.assertEqual(err, f"{cell}: equilibrium.area: a reduced volume of 22.2733 is impossible: the largest is 1, that of a sphere\n")
        self.assertEqual(self.files(), {"case.toml", "cell.toml"})


if __name__ == "__main__":
    unittest.main(argv=["equilibrium_test.py"])
