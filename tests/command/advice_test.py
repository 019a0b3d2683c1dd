#!/usr/bin/python3
"""What `tubule check` advises: tier, model, and why.

advice_test.py TUBULE CASES
"""
import re
import sys
import unittest
from pathlib import Path

from program import OBLATE, QUICK, ProgramTest

CASES = Path(sys.argv[2])


class Advice(ProgramTest):
    def advice(self, path, *sets):
        words = self.tubule("check", path, *[word for one in sets for word in ("--set", one)])[1]
        found = re.findall(r"advice: (.*)\n", words)
        self.assertLessEqual(len(found), 1)
        return found[0] if found else None

    def test_an_axisymmetric_start_does_not_need_three_dimensions(self):
        told = self.advice("case.toml", "tier=surface3d", "accuracy.energy=1e-2", "discretisation.order=2")
        self.assertRegex(told, r"^tier axisym, model gradient-flow, accuracy 0.01: some 0\.\d+ s; the initial shape and the model are axisymmetric")

    def test_a_start_without_symmetry_does(self):
        self.write("case.toml", QUICK.replace('"axisym"', '"surface3d"').replace("1e-6", "1e-2").replace("n = 1\n", "n = 1\nm = 1\n"))
        told = self.advice("case.toml", "accuracy.energy=1e-3", "discretisation.order=2")
        self.assertRegex(told, r"^tier surface3d, model gradient-flow, accuracy 0.001: .* shape.mode.0.m breaks the symmetry$")
        smooth = ("shape.mode.0.amplitude=0.05", "shape.mode.1.amplitude=0.01")
        self.assertRegex(self.advice("case.toml", *smooth), r"^tier surface3d, model gradient-flow, 80 elements, .*, and is smooth$")
        # docs/both_tiers/rough_fluid.csv: waves like these are lost on 80 triangles.
        rough = [f"shape.mode.{i}.{key}" for i, key in ((0, "amplitude=0.3"), (0, "n=3"), (1, "amplitude=0.2"), (1, "n=4"))]
        self.assertRegex(self.advice("case.toml", *rough), r"^tier surface3d, model gradient-flow, accuracy .* breaks the symmetry$")

    def test_a_simpler_model_that_is_accurate_enough(self):
        self.write("case.toml", OBLATE)
        self.assertRegex(self.advice("case.toml"), r"model overdamped, .* \"overdamped\" differs by about 0.000[78]\d* of E_ref")

    def test_a_simpler_model_that_is_not(self):
        self.write("case.toml", OBLATE)
        told = self.advice("case.toml", "accuracy.energy=1e-4")
        self.assertRegex(told, r"model fluid, .*; model \"stokes\" would differ by about 0.000[78]\d* of E_ref on the way, by ")

    def test_a_velocity_says_what_the_model_is(self):
        self.write("case.toml", OBLATE + '[velocity]\ninitial = "rotation"\nomega = 0.1\n')
        told = self.advice("case.toml", "time.end=1.0")
        self.assertRegex(told, "model fluid")
        self.assertNotIn("E_ref", told)

    def test_nothing_moves(self):
        self.write("case.toml", QUICK[: QUICK.index("[time]")].replace("axisym", "surface3d").replace("1e-6", "1e-2"))
        self.assertIsNone(self.advice("case.toml"))
        self.assertIsNone(self.advice(CASES / "vesicle.toml"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
