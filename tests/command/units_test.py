#!/usr/bin/python3
"""Physical units: the worked example of docs/theory.md, section 12, digit for digit; tables and pictures in them.

units_test.py TUBULE
"""
import json
import os
import re
import unittest

import h5py
import numpy as np
import schema
from program import CAPSULE, PROGRAM, QUICK, ROOT, ProgramTest, series

CASE = ROOT / "cases/units_tube.toml"
EXAMPLE = (ROOT / "docs/theory.md").read_text().split("## 12.")[1].split("## 13.")[0]
UNITS = ("--set", "units.length=50 nm", "--set", "units.bending_rigidity=20 kT")
GRADIENT_FLOW = (*UNITS, "--set", "units.friction=2e4 Pa s/m")


class Units(ProgramTest):
    def expect_printed(self, form, value):
        """The example prints the value with as many digits as it gives; `form` finds them."""
        found = re.search(form, EXAMPLE)
        self.assertIsNotNone(found, form)
        mantissa, power = found[1], int(found[2] or 0) if found.re.groups > 1 else 0
        digits = len(mantissa.replace(".", "").lstrip("0"))
        self.assertEqual(float(f"{value:.{digits}g}"), float(f"{mantissa}e{power}"), form)

    def units(self, *arguments):
        out, _ = self.tubule("units", *arguments, "--json")
        self.assertEqual(schema.against("units", out), [])
        return json.loads(out)

    def test_the_example_of_the_theory(self):
        stokes = self.units(CASE)
        number = r"([\d.]+)\\cdot10\^\{(-\d+)\}"
        self.expect_printed(rf"k_BT = {number}\$ J", stokes["kT"])
        self.expect_printed(rf"E_{{\\ast}} = \\kappa = {number}\$ J", stokes["energy"])
        shown = {of: (unit["scale"], unit["unit"]) for of, unit in stokes["units"].items()}
        for of, name, form in (
            ("energy/length^2", "uN/m", r"E_{\\ast}/R\^2 = ([\d.]+)\\thinspace\\mu\\mathrm{N/m}"),
            ("energy/length^3", "Pa", r"E_{\\ast}/R\^3 = ([\d.]+)\$ Pa"),
            ("energy/length", "pN", r"E_{\\ast}/R = ([\d.]+)\$ pN"),
            ("time", "us", r"T = \\eta_s R\^2/E_{\\ast} = ([\d.]+)\\thinspace\\mu\\mathrm{s}"),
        ):
            self.assertEqual(shown[of][1], name)
            self.expect_printed(form, shown[of][0])
        self.expect_printed(r"the tension \$\\kappa/\(2R\^2\) =\s+([\d.]+)\\thinspace\\mu\\mathrm{N/m}", shown["energy/length^2"][0] / 2)
        self.assertEqual(shown["energy"], (20.0, "kT"))
        # What the physical quantities make of the numbers of the model
        water = 0.89e-3 / 50e-9
        err = self.refused("units", CASE, "--set", f"units.friction={water} Pa s/m", "--set", "model.gamma=1")
        self.expect_printed(r"\\gamma = \\eta_w R/\\eta_s = ([\d.]+)", float(re.search(r"makes model.gamma (\S+) with", err)[1]))
        fluid = ("--set", "model.kind=fluid", "--set", "units.density=5e-6 kg/m^2")
        err = self.refused("units", CASE, *fluid)
        self.expect_printed(rf"Re = {number}\$: inertia", float(re.search(r"makes model.Re (\S+) with", err)[1]))
        time = self.units(CASE, *fluid, "--set", "model.Re=2.1e-4")["units"]["time"]
        self.assertEqual(time["unit"], "ns")
        self.expect_printed(r"T = ([\d.]+)\$ ns", time["scale"])
        # The mode, by tubule stability: the rate of the example is in units of 1/T.
        words, _ = self.tubule("stability", CASE, "--tension", "0", "--q", "2", "--modes", "0")
        q, rate, e_fold = re.search(r"^ +0 +(\S+) +(\S+) +(\S+)$", words, re.M).groups()
        self.assertIn("            1/nm           1/us           us", words)
        self.assertEqual(float(q), 2 / 50)
        self.expect_printed(r"decays within \$T/([\d.]+)", -float(rate) * shown["time"][0])
        self.expect_printed(r"T/2.319 =\s+([\d.]+)\\thinspace", float(e_fold))

    def test_table(self):
        out, _ = self.tubule("units", CASE)
        rows = {line.split()[0]: " ".join(line.split()[1:]) for line in out.splitlines()[1:]}
        self.assertEqual(rows["length"], "50 nm units.length")
        self.assertEqual(rows["energy"], "20 kT 8.233e-20 J; kT = 4.116e-21 J at 298.15 K")
        self.assertEqual(rows["time"], "91.1 us units.viscosity")
        self.assertEqual(rows["velocity"], "548.9 um/s length/time")
        self.assertEqual(rows["curvature"], "0.02 1/nm c0 = -H0/length")
        self.assertEqual(rows["viscosity"], "3e-09 Pa s m model.Re = 1")
        self.assertEqual(rows["friction"], "1.776e+04 Pa s/m model.gamma = 0.0148")
        out, _ = self.tubule("units", "case.toml", *UNITS)
        self.assertIn("time         not known: it takes units.friction\n", out)
        self.assertIn("time         not known: it takes units.density, units.viscosity or units.friction\n",
                      self.tubule("units", "case.toml", *UNITS, "--set", "model.kind=fluid")[0])  # fmt: skip
        self.assertIsNone(self.units("case.toml", *UNITS)["time"])
        self.assertIn("case.toml: has no table [units]", self.refused("units", "case.toml"))

    def last_row(self, *options):
        words, _ = self.tubule("show", "case.hdf", *options)
        return words, dict(re.findall(r"^  (\w+) +(.*)$", words.split("last row\n")[1], re.M))

    def test_results_keep_their_numbers_and_show_units(self):
        out, err = self.tubule("run", "case.toml", *GRADIENT_FLOW)
        found, time = series(self.result), 2e4 * 50e-9**4 / (20 * 1.380649e-23 * 298.15) * 1e6
        self.assertEqual(found["time"][-1], 0.2)
        self.assertIn(f"at t = {0.2 * time:.6g} us", out)
        self.assertIn(f"energy {found['energy'][-1] * 20:.9g} kT, estimated error", out)
        words, row = self.last_row()
        self.assertRegex(words, r"(?m)^units +1 of length is 50 nm, of energy 20 kT; of time 1\.518 us$")
        self.assertEqual(row["energy"], f"{found['energy'][-1] * 20:.12g} kT")
        self.assertEqual(row["r_min"], f"{found['r_min'][-1] * 50:.12g} nm")
        self.assertEqual(float(row["order"]), found["order"][-1])
        self.assertRegex(words, rf"(?m)^stop_time +{0.2 * time:.12g} us$")
        self.assertRegex(words, r"\n +frame +time +degree +length +energy .*\n +us +nm +kT")
        # Other units and none; another viscosity or none is not another case.
        self.assertEqual(self.last_row("--units", "length=1 um")[1]["r_min"], f"{found['r_min'][-1]:.12g} um")
        words, row = self.last_row("--units", "none")
        self.assertEqual(row["energy"], f"{found['energy'][-1]:.12g}")
        self.assertNotIn("\nunits ", words)
        self.assertIn("nothing to resume", self.tubule("run", "case.toml", "--resume")[0])
        self.assertIn("units.length must be a number with a unit", self.refused("show", "case.hdf", "--units", "length=1 mile"))
        self.assertIn("--units must be none, or key=value", self.refused("show", "case.hdf", "--units", "nm"))
        self.assertIn("CSV, JSON and scans are dimensionless", self.refused("show", "case.hdf", "--csv", "--units", "none"))

    def test_equilibria(self):
        self.write("case.toml", CAPSULE + "modes = 1\n")
        plain, _ = self.tubule("equilibrium", "case.toml")
        lab, _ = self.tubule("equilibrium", "case.toml", *GRADIENT_FLOW)
        header, numbers = (text.splitlines() for text in (plain, lab))
        self.assertEqual(numbers[-2].split(), ["kT", "uN/m", "kPa", "nm", "nm", "1/ns"])
        # k20 = 1/8: one unit of energy is 80 kT
        E = 80 * 1.380649e-23 * 298.15
        scales = [80, E / 50e-9**2 * 1e6, E / 50e-9**3 / 1e3, 50, 50, 1, E / (2e4 * 50e-9**4) * 1e-9, 1]
        for one, other, scale in zip(header[-1].split(), numbers[-1].split(), scales, strict=True):
            self.assertAlmostEqual(float(one) * scale, float(other), delta=2e-4 * abs(float(other)) + 1e-9)
        self.assertRegex(self.tubule("show", "case.hdf")[0], r"(?m)^  time +0$")  # its number, not a time

    def test_pictures(self):
        os.environ["TUBULE_PROGRAM"] = PROGRAM
        self.addCleanup(os.environ.pop, "TUBULE_PROGRAM")
        self.tubule("run", "case.toml", *GRADIENT_FLOW)
        for options, words, never in (
            ((), ("time t (whole run) [\u00b5s]", "bending energy E [kT]", "80 nm", "Gaussian curvature K [1/nm\u00b2] (right halves)",
                  "t\u2082 = 0.07592 \u00b5s"), "time t"),
            (("--units", "none"), ("time t (whole run)", "bending energy E"), "[kT]"),
            (("--series", "r_max", "--units", "length=2 um", "--to", "0.1"), ("largest radius [\u00b5m]", "time t [s]"), "time t"),
        ):  # fmt: skip
            self.plot("case.hdf", "-o", "p.svg", *options)
            texts = re.findall(r"<text[^>]*>([^<]*)</text>", (self.folder / "p.svg").read_text())
            for word in words:
                self.assertIn(word, [text.strip() for text in texts])
            self.assertNotIn(never, texts)
        self.plot("case.hdf", "-o", "p.html", command="view")
        page = json.loads(re.search(r'application/json">(.*?)</script>', (self.folder / "p.html").read_text())[1])
        found = series(self.result)
        np.testing.assert_allclose(page["series"]["energy"], 20 * found["energy"])
        self.assertAlmostEqual(page["high"][1] - page["low"][1], 150)  # the length of the tube is 3
        self.assertEqual([page["units"][name] for name in ("time", "energy", "area")], ["\u00b5s", "kT", "nm\u00b2"])
        self.assertEqual((page["length_unit"], page["fields"][0]["unit"]), ("nm", "1/nm"))
        self.write("other.toml", QUICK)
        self.tubule("run", "other.toml")
        self.assertIn("have different units; --units none", self.plot("case.hdf", "other.hdf", "-o", "q.svg", status=2)[1])

    def test_scans(self):
        """Numbers of axes and points; energies have no unit where the bending rigidity varies, which is their unit."""
        os.environ["TUBULE_PROGRAM"] = PROGRAM
        self.addCleanup(os.environ.pop, "TUBULE_PROGRAM")
        for name, over, words, never in (
            ("a", ("model.tension=0,0.1", "shape.mode.0.amplitude=0.1,0.2"),
             ("amplitude A [nm]", "tension \u03c3 [\u00b5N/m]", "energy where the run stopped [kT]"), "energy where the run stopped"),
            ("b", ("energy.k20=0.5,0.6", "shape.length=2,2.5"),
             ("length L [nm]", "k\u2082\u2080", "energy where the run stopped"), "energy where the run stopped [kT]"),
        ):  # fmt: skip
            self.tubule("scan", "case.toml", "--quiet", *GRADIENT_FLOW, *(word for one in over for word in ("--over", one)), "-o", f"{name}.hdf")
            self.plot(f"{name}.hdf", "--quantity", "energy", "-o", "p.svg")
            texts = [text.strip() for text in re.findall(r"<text[^>]*>([^<]*)</text>", (self.folder / "p.svg").read_text())]
            self.assertLessEqual(set(words), set(texts))
            self.assertNotIn(never, texts)
        self.plot("a.hdf", "-o", "p.html", command="view")
        page = json.loads(re.search(r'application/json">(.*?)</script>', (self.folder / "p.html").read_text())[1])
        np.testing.assert_allclose(page["axes"][1]["values"], [5, 10])
        self.assertEqual((page["axes"][1]["texts"], page["units"]["r_min"]), (["0.1", "0.2"], "nm"))
        with h5py.File(self.folder / "a.hdf") as file:
            np.testing.assert_allclose(page["slices"][""]["points"]["energy"], 20 * file["points/energy"][()].ravel())
        self.assertAlmostEqual(self.units("a.hdf")["units"]["length"]["scale"], 50)
        self.plot("a.hdf", "--units", "none", "-o", "p.svg")
        self.assertIn(">amplitude A<", (self.folder / "p.svg").read_text())


if __name__ == "__main__":
    unittest.main(argv=[__file__])
