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

import h5py
import numpy as np

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
energy = {k20 = 0.5, H0 = -1.0, k42 = 0.05}
accuracy = {energy = 1e-2}
discretisation = {order = 3, step = 0.005}
time = {end = 0.15, output = [0.015, 0.03, 0.045, 0.06, 0.075, 0.09, 0.105, 0.12, 0.135]}
[shape]
kind = "tube"
radius = 1.0
length = 3.6275987284684357
mode = [{amplitude = 1e-3, n = 1}, {amplitude = 1e-3, n = 1, m = 1}, {amplitude = 1e-3, n = 0, m = 2}]
"""


def rate_at_rest(q, k20=0.2, beta=-0.2):
    """theory.md (5.27) at R = 1: s = -2 k20 [(1 + beta) x^2 - 2 x + 1], x = q^2."""
    return -2 * k20 * ((1 + beta) * q**4 - 2 * q**2 + 1)


def free_energy(X, edges, periodic, f, tension, pressure):
    """INT f(H, K) + tension dS - pressure V of a surface X(a, b) of 3 x n x m points, by FFT: b goes around the axis. The
    first direction is a period, with `edges` its step in z, or twice a meridian, on half of which the integral is taken."""
    n, m = X.shape[1:]
    wave = [np.fft.fftfreq(k, 1 / k)[(slice(None), None) if i == 0 else (None, slice(None))] for i, k in enumerate((n, m))]

    def slope(Y, i):
        return np.fft.ifft(1j * wave[i] * np.fft.fft(Y, axis=i + 1), axis=i + 1).real

    rise = np.zeros((3, 1, 1))
    rise[2] = edges / (2 * np.pi)  # of z, which is not periodic
    flat = X - rise * (2 * np.pi * np.arange(n) / n)[None, :, None]
    a, b = slope(flat, 0) + rise, slope(flat, 1)
    aa, ab, bb = slope(a - rise, 0), slope(b, 0), slope(b, 1)
    normal = np.cross(b, a, axis=0)  # outward
    g = np.sqrt((normal**2).sum(0))
    nu = normal / g
    E, F, G = (a * a).sum(0), (a * b).sum(0), (b * b).sum(0)
    L, M, N = (aa * nu).sum(0), (ab * nu).sum(0), (bb * nu).sum(0)
    H, K = (L * G - 2 * M * F + N * E) / g**2, (L * N - M * M) / g**2
    density = (f(H, K) + tension) * g - pressure * (X * normal)[:2].sum(0) / 2
    if periodic:
        return density.mean() * (2 * np.pi) ** 2
    half = (np.arange(n // 2) + 0.5) * 2 * np.pi / n  # Fejer's rule: the density, with the sign of the angle, is a sine series
    odd = np.arange(1, n // 2, 2)
    weights = 8 / n * (np.sin(np.outer(half, odd)) / odd).sum(1)
    return (weights[:, None] * density[: n // 2]).sum() * 2 * np.pi / m


def second_difference(F, h):
    return (-F(2 * h) + 16 * F(h) - 30 * F(0) + 16 * F(-h) - F(-2 * h)) / (12 * h * h)


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
        # theory.md (5.23), (5.24) at c = -1: buckling below the reduced tension 0, ovalisation below -3; the tension is 2 k20
        # times that.
        lines = [line.split() for line in out.splitlines()]
        buckling = next(line for line in lines if line[:2] == ["buckling", "1"])
        self.assertAlmostEqual(float(buckling[4]), 0, delta=1e-12)
        ovalisation = next(line for line in lines if line[:2] == ["ovalisation", "2"])
        self.assertAlmostEqual(float(ovalisation[4]), -3 * 0.4, delta=1e-9)

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
        # In one list: l = 0, which is neutral (E has no size), those of l = 2 with m = 0, 1, 2, of l = 3 with m = 0 ... 3.
        slowest = self.json(case, "--numerical", "--modes", "3", "--rates", "8")["models"][0]["slowest"]
        self.assertEqual([sorted(mode["m"] for mode in some) for some in (slowest[:1], slowest[1:4], slowest[4:])],
                         [[0], [0, 1, 2], [0, 1, 2, 3]])  # fmt: skip
        self.assertAlmostEqual(slowest[0]["rate"], 0, delta=1e-4)
        for i, mode in enumerate(slowest[1:]):
            self.assertAlmostEqual(mode["rate"] / rows["2" if i < 3 else "3"], 1, delta=1e-5)
        out = self.tubule("stability", case, "--numerical", "--modes", "3")[0]
        self.assertRegex(out, r"slowest of m = 0 \.\.\. 3\n.*number.*rate.*\n +1 +0 .*\n +2 +[012] +-48(\.0+\d*)? ")
        # With a tension, G = (L/R^2)(F2 L/R^2 + f + sigma0), overdamped: Lam/(Lam + 4) of -G, Lam = 6, L = 4.
        tense = ("--tension", "-3", "--model", "overdamped")
        exact = -0.6 * 4 * (2 * 4 + 4 - 3)
        self.assertAlmostEqual(float(self.table(case, *tense)[0]["rate"]), exact, delta=1e-9)
        self.assertAlmostEqual(float(self.table(case, *tense, "--numerical")[0]["rate"]) / exact, 1, delta=1e-5)

    def test_spectra(self):
        case = self.write("cell.toml", CAPSULE)
        out, _ = self.tubule("stability", case)
        self.assertIn("stationary", out)
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
        self.assertIn("stationary", self.tubule("stability", vesicle)[0])
        # The tube as it is: the closed form, for a wave of 1e-4.
        numerical = [row for row in self.table(self.tube, "--numerical") if row["m"] == "0"]
        self.assertAlmostEqual(float(numerical[0]["rate"]), rate_at_rest(2 * math.pi / 7), delta=1e-5)
        wavy = ("--set", "shape.mode.0.amplitude=0.2", "--numerical")
        self.refuses("not stationary", self.tube, *wavy, "--model", "overdamped")
        self.tubule("stability", self.tube, *wavy)
        self.refuses("inertia", self.write("fluid.toml", FLUID), "--numerical")

    def test_beads_draw_a_vesicle_apart(self):
        """Rates from points on the profile are those of the equilibrium, under a force and at a distance of the beads."""
        for load in ("force = 8.0", "extension = 0.4"):
            case = self.write("pulled.toml", f"""tier = "axisym"
energy.k20 = 0.5
model = {{area = "free", tension = 10.0, volume = "fixed", bead_width = 0.3, {load}}}
shape = {{kind = "sphere", radius = 1.0}}
accuracy = {{energy = 1e-8}}
equilibrium = {{modes = 2}}
""")  # fmt: skip
            self.tubule("equilibrium", case, "--quiet", "--overwrite", "-o", self.result)
            found = series(self.result)
            for row in self.table(self.result):
                if row["number"] == "0":
                    self.assertAlmostEqual(float(row["rate"]) / found[f"growth_{row['m']}"][0], 1, delta=1e-3)

    def test_mean_squares_of_a_sphere(self):
        """Milner and Safran, doi:10.1103/PhysRevA.36.4371, for kappa/2 (H - H0)^2: theory.md (8.13)."""
        kT, kappa, R, H0, tension = 0.05, 2.4, 1.5, -0.4, 0.7
        case = self.write("sphere.toml", f"""tier = "axisym"
energy = {{k20 = {kappa / 2}, H0 = {H0}}}
model = {{volume = "fixed"}}
shape = {{kind = "sphere", radius = {R}}}
time = {{end = 1.0}}
""")  # fmt: skip

        def exact(l):
            reduced = tension * R**2 / kappa + 2 * H0 * R + (H0 * R) ** 2 / 2
            u2 = kT / (kappa * (l - 1) * (l + 2) * (l * (l + 1) + reduced))
            return R**2 * u2 / (4 * math.pi)

        given = ("--tension", tension, "--kT", kT)
        closed = self.json(case, *given)["waves"]
        self.assertEqual([wave["l"] for wave in closed], [2, 3, 4, 5, 6])
        for wave in closed:
            self.assertAlmostEqual(wave["mean_square"] / exact(wave["l"]), 1, delta=1e-12)
        for row in self.table(case, *given):
            self.assertAlmostEqual(float(row["mean_square"]) / exact(int(row["l"])), 1, delta=1e-12)
        self.assertIn("mean square\n", self.tubule("stability", case, *given)[0])
        self.assertIsNone(self.json(case)["waves"][0]["mean_square"])
        # The numerical spectrum, in every model that holds the volume.
        for model in ("gradient-flow", "overdamped"):
            of = self.json(case, *given, "--numerical", "--modes", "3", "--model", model)["models"][0]["fluctuations"]
            self.assertEqual([one["m"] for one in of], [0, 1, 2, 3])
            for one in of:
                first = max(one["m"], 2)
                for i, mode in enumerate(one["eigenmodes"]):
                    self.assertAlmostEqual(mode["mean_square"] / exact(first + i), 1, delta=1e-6)
                all_l = (2 if one["m"] else 1) * sum(exact(l) for l in range(first, 2000))
                self.assertAlmostEqual(one["mean_square_of_all"] / all_l, 1, delta=1e-4)  # of those that the mesh has
        rows = self.table(case, *given, "--numerical")
        self.assertEqual(set(rows[0]), {"model", "m", "number", "eigenvalue", "mean_square"})
        self.assertAlmostEqual(float(rows[0]["mean_square"]) / exact(2), 1, delta=1e-6)
        self.assertIn("of each phi", self.tubule("stability", case, *given, "--numerical")[0])

    def test_mean_squares_of_a_tube(self):
        """kT over the second difference of the free energy of waves, by quadrature in NumPy, in equilibrium at a tension."""
        k20, k42, H0, R, length, tension, kT = 0.5, 0.1, -0.6, 0.9, 5.0, 0.3, 0.02
        case = self.write("tube.toml", f"""tier = "axisym"
energy = {{k20 = {k20}, k42 = {k42}, H0 = {H0}}}
model = {{kind = "stokes", area = "reservoir", tension = {tension}}}
shape = {{kind = "tube", radius = {R}, length = {length}}}
time = {{end = 1.0}}
""")  # fmt: skip

        def f(H, K):
            return k20 * (H - H0) ** 2 + k42 * K**2

        pressure = (f(-1 / R, 0) + 2 * k20 * (-1 / R - H0) / R + tension) / R  # theory.md (3.21)
        waves = {(w["m"], w["n"]): w["mean_square"] for w in self.json(case, "--kT", kT)["models"][0]["waves"]}
        s, theta = (2 * math.pi * np.arange(32) / 32,) * 2
        for m, n in ((0, 1), (0, 2), (1, 1), (2, 0), (2, 1)):
            shape = np.cos(n * s)[:, None] * np.cos(m * theta)

            def energy(amplitude):
                r = R + amplitude * shape
                z = np.broadcast_to((length * s / (2 * math.pi))[:, None], r.shape)
                X = np.array([r * np.cos(theta), r * np.sin(theta), z])
                return free_energy(X, length, True, f, tension, pressure)

            mean = (shape**2).mean()  # phi = shape/sqrt(mean)
            self.assertAlmostEqual(waves[m, n] * second_difference(energy, 0.005) / (kT * mean), 1, delta=1e-6)

    def test_mean_squares_of_a_vesicle(self):
        """kT over the second difference of E + sigma A + lambda V, by Fourier series in NumPy, along the eigenmodes of a
        prolate vesicle as points of its profile give it."""
        kT = 0.1
        case = self.write("prolate.toml", """tier = "axisym"
energy = {k20 = 1.0}
shape = {kind = "sphere", radius = 1.0}
accuracy = {energy = 1e-10}
equilibrium = {family = "prolate", reduced_volume = 0.8, held = "area-and-volume"}
""")  # fmt: skip
        self.tubule("equilibrium", case, "--quiet", "-o", self.result)
        model = self.json(self.result, "--kT", kT)["models"][0]
        with h5py.File(self.result) as file:
            frame = file["frames/0"] if "frames/0" in file else file["frames"][sorted(file["frames"])[0]]
            r, z = frame["r"][:], frame["z"][:]
        waves, n, around = np.arange(40), 160, 32
        t = np.concatenate([[0], np.cumsum(np.hypot(np.diff(r), np.diff(z)))])
        t *= math.pi / t[-1]
        of_r = np.linalg.lstsq(np.sin(np.outer(t, waves[1:])), r, rcond=None)[0]
        of_z = np.linalg.lstsq(np.cos(np.outer(t, waves)), z, rcond=None)[0]
        s = (np.arange(n) + 0.5) * 2 * math.pi / n  # twice the meridian
        R, Z = np.sin(np.outer(s, waves[1:])) @ of_r, np.cos(np.outer(s, waves)) @ of_z
        R1, Z1 = np.cos(np.outer(s, waves[1:])) @ (waves[1:] * of_r), -np.sin(np.outer(s, waves)) @ (waves * of_z)
        speed = np.hypot(R1, Z1)
        normal_r, normal_z = Z1 / speed, -R1 / speed
        of_speed = np.linalg.lstsq(np.cos(np.outer(s, waves)), speed, rcond=None)[0]
        arc = s + np.sin(np.outer(s, waves[1:])) @ (of_speed[1:] / waves[1:]) / of_speed[0]  # from 0 to 2 pi
        theta = 2 * math.pi * np.arange(around) / around
        for one in (model["fluctuations"][0], model["fluctuations"][2]):
            for mode in one["eigenmodes"][:2]:
                values = np.array(mode["displacement"])
                places = math.pi * np.arange(len(values)) / (len(values) - 1)
                of_w = np.linalg.lstsq(np.cos(np.outer(places, waves)), values, rcond=None)[0]
                w = (np.cos(np.outer(arc, waves)) @ of_w)[:, None] * np.cos(one["m"] * theta)

                def energy(amplitude):
                    radial = R[:, None] + amplitude * w * normal_r[:, None]
                    X = np.array([radial * np.cos(theta), radial * np.sin(theta), Z[:, None] + amplitude * w * normal_z[:, None]])
                    return free_energy(X, 0, False, lambda H, K: H**2, model["tension"], model["pressure"])

                self.assertAlmostEqual(mode["mean_square"] * second_difference(energy, 0.01) / kT, 1, delta=1e-4)

    def test_mean_squares_are_of_minima_at_rest(self):
        kT = ("--kT", "0.01")
        self.refuses("--kT needs a minimum: n = 1, m = 0 lowers the energy, with the eigenvalue", self.tube, *kT)
        # theory.md (5.21) at c = 0, x = 1/4: Sigma = 1.4 is neutral, though no wave that fits the length grows.
        neutral = ("--set", "energy.H0=0.0", "--model", "overdamped", "--tension", "0.76", "--q", "0.5", *kT)
        self.refuses("--kT needs a minimum: q = 0.5, m = 0 is neutral", self.tube, *neutral)
        self.refuses("--kT needs an equilibrium: the radius changes at the rate", self.tube, *kT, "--set", "shape.radius=1.1")
        self.refuses("short waves lower the energy", self.tube, *kT, "--set", "energy.k42=-0.3", "--model", "overdamped")
        self.refuses("--kT must be from 0 to 1e+100, not -1", self.tube, "--kT", "-1")
        sphere = self.write("sphere.toml", """tier = "axisym"
energy = {k20 = 1.0}
shape = {kind = "sphere", radius = 1.0}
time = {end = 1.0}
""")  # fmt: skip
        held = ("--set", 'model.volume="fixed"')
        self.refuses("--kT needs a minimum: l = 0 is neutral", sphere, *kT)
        self.refuses("--kT needs a minimum: l = 2 lowers the energy", sphere, *kT, *held, "--tension", "-13")
        self.refuses("--kT needs an equilibrium: the pressure of equilibrium is 1", sphere, *kT, "--tension", "0.5")
        self.refuses("--kT needs a minimum: m = 0 lowers the energy", sphere, *kT, *held, "--tension", "-13", "--numerical")
        self.refuses("--kT needs a minimum: ", sphere, *kT, "--numerical")
        wavy = ("--set", "shape.mode.0.amplitude=0.2", "--numerical")
        self.refuses("--kT needs an equilibrium: this one moves", self.tube, *kT, *wavy)
        self.refuses("a free period has no spectrum of m = 0", self.tube, *kT, "--numerical", "--set", "model.period=free",
                     "--set", "model.area=fixed", "--set", "energy.k42=0.0")  # fmt: skip

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
        for more in ((), ("--model", "all", "--tension", "-1", "--q", "0.1:3:5")):
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
        self.refuses("not 'stokse'; did you mean 'stokes'?", self.tube, "--model", "stokse")
        self.refuses("--modes must be from 0 to 100, not -1", self.tube, "--modes", "-1")
        self.refuses("--rates must be from 1 to 100, not 0", self.tube, "--numerical", "--rates", "0")
        self.refuses("--waves must be from 1 to 10000, not 10001", self.tube, "--waves", "10001")
        self.refuses("--fit needs a result", self.tube, "--fit", "1")
        self.refuses("--frame needs a result", self.tube, "--frame", "0")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
