#!/usr/bin/python3
"""`tubule stability`: its tables against closed forms, spectra of other shapes, fits of results, pictures, what it
refuses. Arguments: the program, the program that writes results with surfaces."""
import csv
import io
import json
import math
import subprocess
import sys
import unittest

from program import CAPSULE, ProgramTest, series

WRITER = sys.argv[2]

TUBE = """tier = "axisym"
[energy]
k20 = 0.2
H0 = -1.0
k42 = -0.04
[shape]
kind = "tube"
radius = 1.0
length = 7.0
[[shape.mode]]
amplitude = 1e-4
n = 1
[accuracy]
energy = 1e-8
[time]
end = 4.0
output = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5]
"""
FLUID = TUBE.replace("[shape]", '[model]\nkind = "fluid"\nRe = 2.0\ngamma = 0.3\n[shape]')
# At rest but for a pearling, a buckling and a ring wave, too small to meet each other.
SURFACE = """tier = "surface3d"
[energy]
k20 = 0.5
H0 = -1.0
k42 = 0.05
[shape]
kind = "tube"
radius = 1.0
length = 3.6275987284684357
[[shape.mode]]
amplitude = 1e-3
n = 1
[[shape.mode]]
amplitude = 1e-3
n = 1
m = 1
[[shape.mode]]
amplitude = 1e-3
n = 0
m = 2
[accuracy]
energy = 1e-2
[discretisation]
order = 3
step = 0.0025
[time]
end = 0.15
output = [0.015, 0.03, 0.045, 0.06, 0.075, 0.09, 0.105, 0.12, 0.135]
"""


def rate_at_rest(q, k20=0.2, beta=-0.2):
    """theory.md (5.27) at R = 1: s = -2 k20 [(1 + beta) x^2 - 2 x + 1], x = q^2."""
    return -2 * k20 * ((1 + beta) * q**4 - 2 * q**2 + 1)


class Stability(ProgramTest):
    def setUp(self):
        super().setUp()
        self.tube = self.write("tube.toml", TUBE)

    def table(self, *arguments):
        return list(csv.DictReader(io.StringIO(self.tubule("stability", *arguments, "--csv")[0])))

    def json(self, *arguments):
        return json.loads(self.tubule("stability", *arguments, "--json")[0])

    def refuses(self, message, *arguments):
        self.assertIn(message, self.refused("stability", *arguments))

    def test_table_of_a_tube(self):
        rows = {(row["m"], row["n"]): row for row in self.table(self.tube)}
        self.assertEqual({m for m, _ in rows}, {"0", "1", "2"})
        for n in (1, 2, 3, 4):
            self.assertAlmostEqual(float(rows["0", str(n)]["rate"]), rate_at_rest(2 * math.pi * n / 7), delta=1e-12)
        # The radius is at rest, so the factor until the end is that of the rate.
        row = rows["0", "1"]
        self.assertAlmostEqual(float(row["factor"]), math.exp(4 * float(row["rate"])), delta=1e-9)
        self.assertNotIn(("1", "0"), rows)  # the place of the tube

    def test_words(self):
        out, _ = self.tubule("stability", self.tube)
        # theory.md (5.27): fastest at x = 1/(1 + beta): q = 1.118034, rate 2 k20 (1/(1 + beta) - 1) = 0.1.
        self.assertIn("fastest of all with m = 0: q = 1.118034 (length 5.61985), rate 0.1\n", out)
        self.assertIn("beyond the threshold of: pearling\n", out)
        self.assertIn("no wave with m = 0 grows for k42 >= 0\n", out)
        # theory.md (5.23), (5.24) at c = -1: buckling below the reduced tension 0, rings below -3; the tension is 2 k20
        # times that.
        lines = [line.split() for line in out.splitlines()]
        buckling = next(line for line in lines if line[:2] == ["buckling", "1"])
        self.assertAlmostEqual(float(buckling[4]), 0, delta=1e-12)
        rings = next(line for line in lines if line[:2] == ["rings", "2"])
        self.assertAlmostEqual(float(rings[4]), -3 * 0.4, delta=1e-9)

    def test_a_frozen_wave_is_neutral(self):
        # Area, volume and length are fixed, which freezes the only wave: docs/theory.md, section 5.
        out, _ = self.tubule("stability", self.tube, "--model", "overdamped")
        row = next(line.split() for line in out.splitlines() if line.split()[:2] == ["0", "1"])
        self.assertEqual(row[3:], ["0", "-", "neutral"])
        self.assertIn("beyond the threshold of: pearling, buckling (by other waves than these)\n", out)

    def test_known_threshold(self):
        # H0 = 0: pearling of long waves beyond sigma0 R^2/(2 k20) = 3/2.
        found = self.json(self.tube, "--set", "energy.H0=0.0", "--set", "energy.k42=0.0")
        above = next(t for t in found["thresholds"] if t["grows"] == "above")
        self.assertEqual((above["m"], above["q"]), (0, 0))
        self.assertAlmostEqual(above["tension"] / 0.4, 1.5, delta=1e-12)
        for tension, grows in ((0.599, False), (0.601, True)):
            sets = ("--set", "energy.H0=0.0", "--set", "energy.k42=0.0", "--set", "shape.length=300.0")
            rows = self.table(self.tube, *sets, "--model", "overdamped", "--tension", tension)
            self.assertEqual(any(float(row["rate"]) > 0 for row in rows), grows)

    def test_models(self):
        fluid = self.write("fluid.toml", FLUID)
        one = self.json(fluid)["models"][0]
        # Area and volume fix the amplitude of a single wave, which determines the tension: theory.md (5.15).
        frozen = next(w for w in one["waves"] if (w["m"], w["n"]) == (0, 1))
        self.assertAlmostEqual(frozen["rate"], 0, delta=1e-9)
        self.assertEqual(len(next(w for w in one["waves"] if (w["m"], w["n"]) == (1, 1))["roots"]), 3)
        every = self.json(fluid, "--model", "all", "--tension", "-2")["models"]
        self.assertEqual([m["model"] for m in every], ["gradient-flow", "overdamped", "stokes", "fluid"])
        for waves in zip(*(m["waves"][1:] for m in every[1:])):
            self.assertEqual(len({w["rate"] > 0 for w in waves}), 1)  # they grow in all models or in none
        # With the volume free the tension is R b0 = -(f + F1/R) = 0 at H0 = -1/R.
        self.assertAlmostEqual(self.json(fluid, "--set", 'model.volume="free"')["models"][0]["tension"], 0, delta=1e-12)
        viscous = self.json(self.tube, "--model", "stokes", "--Re", "4", "--gamma", "0.5", "--tension", "1")["models"][0]
        self.assertEqual((viscous["Re"], viscous["gamma"]), (4, 0.5))
        # Overdamped, all rates are those of friction 1 divided by the friction.
        once, slowed = (
            self.json(self.tube, "--model", "overdamped", "--gamma", gamma, "--tension", "1")["models"][0]
            for gamma in ("1", "4")
        )
        self.assertEqual(slowed["gamma"], 4)
        for slow, fast in zip(slowed["waves"], once["waves"], strict=True):
            self.assertAlmostEqual(slow["rate"], fast["rate"] / 4, delta=1e-12 * (1 + abs(fast["rate"])))

    def test_ensembles(self):
        """The tension of the case, or that of its axial force, theory.md (3.22) with f + 1/R f_H = 0 at H0 = -1/R."""
        fluid = self.write("fluid.toml", FLUID)
        fed = ("--set", "model.area=reservoir", "--set", "model.tension=-2")
        given, asked = self.json(fluid, *fed)["models"][0], self.json(fluid, "--tension", "-2")["models"][0]
        self.assertEqual((given["tension"], given["tension_source"]), (-2, "of the case"))
        self.assertEqual([w["roots"] for w in given["waves"]], [w["roots"] for w in asked["waves"]])
        self.assertEqual(self.json(fluid, *fed, "--tension", "3")["models"][0]["tension"], 3)
        pulled = self.json(fluid, "--set", "model.period=free", "--set", "model.force=6.283185307179586")["models"][0]
        self.assertAlmostEqual(pulled["tension"], 2, delta=1e-12)
        self.assertEqual(pulled["tension_source"], "by the axial force")
        self.refuses("with the period free", fluid, "--set", "model.period=free", "--tension", "1")
        # The numerical spectrum has the same rates, and needs no --tension.
        stokes = ("--set", "model.kind=stokes", "--set", "shape.mode=[]", "--modes", "1")
        closed = max(float(row["rate"]) for row in self.table(fluid, *fed, *stokes) if row["m"] == "1")
        rows = self.table(fluid, *fed, *stokes, "--numerical")
        self.assertAlmostEqual(max(float(row["rate"]) for row in rows if row["m"] == "1") / closed, 1, delta=1e-6)

    def test_wave_numbers(self):
        rows = self.table(self.tube, "--q", "0.5,1", "--modes", "0")
        self.assertEqual([(row["n"], float(row["q"])) for row in rows], [("", 0.5), ("", 1.0)])
        self.assertAlmostEqual(float(rows[1]["rate"]), rate_at_rest(1), delta=1e-13)
        self.assertEqual(len(self.table(self.tube, "--q", "0.1:2:20", "--modes", "1")), 40)
        self.assertEqual(len(self.table(self.tube, "--waves", "2", "--modes", "0")), 3)

    def test_spheres(self):
        case = self.write("sphere.toml", '[energy]\nk20 = 1.0\n[shape]\nkind = "sphere"\nradius = 1.0\n[time]\nend = 1.0\n')
        case.write_text('tier = "axisym"\n' + case.read_text())
        # theory.md (6.3), H0 = 0: s = -L (2 L + 4).
        rows = {row["l"]: float(row["rate"]) for row in self.table(case)}
        for l in (2, 3, 4):
            L = l * (l + 1) - 2
            self.assertAlmostEqual(rows[str(l)], -L * (2 * L + 4), delta=1e-9)
        spectrum = self.table(case, "--numerical", "--modes", "3")
        fastest = {row["m"]: float(row["rate"]) for row in spectrum if row["number"] == "0"}
        self.assertAlmostEqual(fastest["2"] / rows["2"], 1, delta=1e-5)
        self.assertAlmostEqual(fastest["3"] / rows["3"], 1, delta=1e-5)
        # With a tension, G = (L/R^2)(F2 L/R^2 + f + sigma0), overdamped: Lam/(Lam + 4) of -G, Lam = 6, L = 4.
        tense = ("--tension", "-3", "--model", "overdamped")
        exact = -0.6 * 4 * (2 * 4 + 4 - 3)
        self.assertAlmostEqual(float(self.table(case, *tense)[0]["rate"]), exact, delta=1e-9)
        self.assertAlmostEqual(float(self.table(case, *tense, "--numerical")[0]["rate"]) / exact, 1, delta=1e-5)

    def test_spectra(self):
        case = self.write("cell.toml", CAPSULE)
        out, _ = self.tubule("stability", case)
        self.assertIn("at rest", out)
        # As in `tubule equilibrium`.
        self.tubule("equilibrium", "--quiet", case, "--set", "equilibrium.modes=2")
        known = series(self.folder / "cell.hdf")
        for source in (case, self.folder / "cell.hdf"):
            for row in self.table(source):
                if row["number"] == "0":
                    self.assertAlmostEqual(float(row["rate"]) / known[f"growth_{row['m']}"][0], 1, delta=1e-4)
        # A shape without a size of its own, with the reduced volume held.
        held = CAPSULE.replace("[equilibrium]", "[equilibrium]\nheld = 'reduced-volume'").replace("k42 = 0.12", "")
        vesicle = self.write("vesicle.toml", held.replace("H0 = -2.0", ""))
        self.assertIn("at rest", self.tubule("stability", vesicle)[0])
        # The tube as it is: the closed form, for a wave of 1e-4.
        numerical = [row for row in self.table(self.tube, "--numerical") if row["m"] == "0"]
        self.assertAlmostEqual(float(numerical[0]["rate"]), rate_at_rest(2 * math.pi / 7), delta=1e-5)
        wavy = ("--set", "shape.mode.0.amplitude=0.2", "--numerical")
        self.refuses("not at rest", self.tube, *wavy, "--model", "overdamped")
        self.tubule("stability", self.tube, *wavy)
        self.refuses("inertia", self.write("fluid.toml", FLUID), "--numerical")

    def test_a_free_period_begins_at_m_1(self):
        # The rates of a pearled tube at rest, as the equilibrium has them and from points on its profile.
        case = self.write("unduloid.toml", """tier = "axisym"
energy = {k20 = 1.0, H0 = -1.0}
model = {period = "free", area = "fixed", volume = "free"}
shape = {kind = "tube", radius = 1.0, length = 6.0, mode = [{amplitude = -0.35, n = 1}]}
accuracy = {energy = 1e-9}
equilibrium = {modes = 2, area = 41.074}
""")  # fmt: skip
        self.tubule("equilibrium", case, "--quiet", "-o", self.result)
        found = series(self.result)
        self.assertEqual([name for name in found if name.startswith("growth")], ["growth_1", "growth_2"])
        rows = list(csv.DictReader(io.StringIO(self.tubule("stability", self.result, "--csv")[0])))
        self.assertEqual({row["m"] for row in rows}, {"1", "2"})
        for m in (1, 2):
            largest = max(float(row["rate"]) for row in rows if row["m"] == str(m))
            self.assertAlmostEqual(largest / found[f"growth_{m}"][0], 1, delta=1e-5)
        self.assertIn("0   left out: such waves change the free period", self.tubule("stability", self.result)[0])

    def test_fits_of_tier_1(self):
        self.tubule("run", "--quiet", self.tube)
        result = self.folder / "tube.hdf"
        out, _ = self.tubule("stability", result, "--fit", "1")
        self.assertIn("rows (mode_1)", out)
        fit = self.json(result, "--fit", "1")
        exact = rate_at_rest(2 * math.pi / 7)
        self.assertAlmostEqual(fit["rate"] / exact, 1, delta=1e-3)
        self.assertAlmostEqual(fit["linear_rate"], exact, delta=1e-9)
        self.assertLess(fit["error"], 1e-4 * exact)
        self.assertEqual(len(self.table(result, "--fit", "1")), len(fit["time"]))
        # Mode 2 is made by mode 1 alone, as its square, and is known from the frames.
        squared = self.json(result, "--fit", "2")
        self.assertEqual(squared["source"], "frames")
        self.assertLess(max(squared["amplitude"]), 1e-7)
        # A straight frame has the closed form; a frame that is not, a spectrum.
        self.assertEqual(self.json(result)["shape"], "tube")
        self.assertEqual(self.json(result, "--frame", "0", "--numerical")["shape"], "profile")

    def test_fits_of_surfaces(self):
        subprocess.run([WRITER, self.folder], check=True)
        for name, wave in (("growing_tube", "1,2"), ("growing_sphere", "3,1")):
            fit = self.json(self.folder / f"{name}.hdf", "--fit", wave)
            self.assertAlmostEqual(fit["rate"], 0.5, delta=1e-3)
            self.assertLess(fit["error"], 5e-3)
            self.assertAlmostEqual(fit["amplitude"][0], 1e-3, delta=2e-6)

    def test_fits_of_moving_surfaces(self):
        case = self.write("moving.toml", SURFACE)
        # theory.md (5.6) at H0 = -1/R, k20 = 1/2, beta = 0.1: s = -Z^2 - beta x^2, x = q^2 = 3 (ring:
        # 0), Z = x + m^2 - 1.
        # Asked: the error with about 200 cubic triangles (found: 4.9e-4, 6.6e-4, 2.5e-3), and that it falls by 2.2 from
        # 100 to 200 (found: by 3.4, 3.7, 3.0; fourth order in the mesh width would be 4).
        waves = {"1,0": (-4.9, 1e-3), "1,1": (-9.9, 1.5e-3), "0,2": (-9.0, 4e-3)}
        errors = {}
        for elements in (100, 200):
            sets = (f"discretisation.elements={elements}", "accuracy.estimate=false")
            self.tubule("run", "--quiet", "--overwrite", case, *(word for one in sets for word in ("--set", one)))
            for wave, (exact, _) in waves.items():
                fit = self.json(self.folder / "moving.hdf", "--fit", wave)
                self.assertAlmostEqual(fit["linear_rate"], exact, delta=1e-9)
                errors[wave, elements] = abs(fit["rate"] / exact - 1)
        for wave, (_, most) in waves.items():
            self.assertLess(errors[wave, 200], most)
            self.assertLess(errors[wave, 200], errors[wave, 100] / 2.2)

    def test_pictures(self):
        for more in ((), ("--model", "all", "--tension", "-1"), ("--q", "0.1:3:5",)):
            self.tubule("stability", self.tube, *more, "--plot", "waves.svg")
            picture = self.folder / "waves.svg"
            text = picture.read_text()
            for word in ("wave number q", "growth rate", "buckling", "tension"):
                self.assertIn(word, text)
            picture.unlink()

    def test_a_tube_that_vanishes_has_rates_at_this_instant(self):
        """Radius 1 shrinks at a rate of 1e9; the case ends long after."""
        out, _ = self.tubule("stability", self.tube, "--tension", "1e9")
        self.assertRegex(out, "the radius changes at the rate -1e.09 and cannot be followed to t = ")
        self.assertNotIn("factor", out)

    def test_bad_input_is_refused(self):
        result = self.folder / "tube.hdf"
        self.tubule("run", "--quiet", self.tube)
        self.refuses("--fit needs a result", self.tube, "--fit", "1")
        self.refuses("--frame needs a result", self.tube, "--frame", "1")
        self.refuses("--set needs a case", result, "--set", "energy.k20=1.0")
        self.refuses("there are 0 to", result, "--frame", "99")
        for wave in ("x", "1,", "-1", "0", "1,2,3"):
            self.refuses("--fit must be n or n,m", result, f"--fit={wave}")
        self.refuses("no modes m > 0", result, "--fit", "1,2")
        self.refuses("--fit can only be combined with", result, "--fit", "1", "--tension", "1")
        self.refuses("exclude each other", self.tube, "--q", "1", "--waves", "3")
        self.refuses("from:to:count", self.tube, "--q", "1:2")
        self.refuses("2 to 100000", self.tube, "--q", "2:1:5")
        self.refuses("'x' is not a number", self.tube, "--q", "1,x")
        self.refuses("are >= 0", self.tube, "--q=-1")
        self.refuses('--Re is only valid with --model "stokes"', self.tube, "--Re", "3")
        self.refuses('--gamma is only valid with --model "overdamped"', self.tube, "--gamma", "3")
        self.refuses("--gamma must be > 0", self.tube, "--model", "overdamped", "--gamma", "0")
        self.refuses("with the volume free", self.write("fluid.toml", FLUID), "--set", 'model.volume="free"', "--tension", "1")
        self.refuses("a picture is written as", self.tube, "--plot", "waves.txt")
        self.refuses("apply only to straight tubes", self.write("cell.toml", CAPSULE), "--plot", "cell.svg")
        self.refuses("missing.hdf", self.folder / "missing.hdf")
        for option in ("--tension", "--Re", "--gamma"):
            for number in ("nan", "inf", "1e999"):
                model = () if option == "--tension" else ("--model", "stokes")
                self.refuses(f"{option} must be from", self.tube, option, number, *model)
        self.refuses("--tension must be from -1e+100 to 1e+100, not -1e+308", self.tube, "--tension", "-1e308")
        self.refuses('not "stokse"; did you mean "stokes"?', self.tube, "--model", "stokse")
        self.refuses("--modes must be from 0 to 100, not -1", self.tube, "--modes", "-1")
        self.refuses("--rates must be from 1 to 100, not 0", self.tube, "--numerical", "--rates", "0")
        self.refuses("--waves must be from 1 to 10000, not 10001", self.tube, "--waves", "10001")
        self.refuses("--fit needs a result", self.tube, "--fit", "1")
        self.refuses("--frame needs a result", self.tube, "--frame", "0")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
