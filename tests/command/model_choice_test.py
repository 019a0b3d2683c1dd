#!/usr/bin/python3
"""model.kind = "auto": which model is chosen and what is said of it, that the run is that of this model, refusals.

model_choice_test.py TUBULE CASES
"""
import json
import re
import sys
import time
import unittest
from pathlib import Path
from random import Random

import h5py
import numpy as np

from program import CAPSULE, OBLATE, ProgramTest, about, series, study

CASES = Path(sys.argv[2])

# That of `tubule check`'s advice, with the model left open. At Re = 0.05, gamma = 0 Stokes is expected to differ by 1.2e-2
# from the fluid.
OPEN = OBLATE.replace('"fluid"', '"auto"') + "output = [1.0, 9.0]\n"
SWINGS = ("model.gamma=30.0", "time.end=0.4", "time.output=[0.1]", "accuracy.energy=1e-3")
CREEPS = ("model.Re=0.05", "model.gamma=0.0", "time.end=10.0", "accuracy.energy=2e-2")
OVERDAMPED = OPEN.replace('"auto"\nRe = 2.0', '"overdamped"')


def sets(*given):
    return [word for one in given for word in ("--set", one)]


class ModelChoice(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("case.toml", OPEN)

    def chosen(self, *given):
        """The model that a run says it takes, and why."""
        self.result.unlink(missing_ok=True)
        out, err = self.tubule("run", "case.toml", *sets(*given))
        told = re.findall(r"case.toml: model (\S+): (.*)\n", err)
        self.assertEqual(len(told), 1, err)
        self.assertIn(f"    model {told[0][0]}: {told[0][1]}\n", out)
        self.assertEqual((about(self.result)["model"], about(self.result)["model_reason"]), told[0])
        return told[0]

    def expect_same(self, other, text, *given):
        """The result is that of another case, but for the clock."""
        self.write(other, text)
        self.tubule("run", other, "--overwrite", *sets(*given))
        found, expected = series(self.result), series(self.folder / Path(other).with_suffix(".hdf"))
        self.assertEqual(found.keys(), expected.keys())
        for name in found.keys() - {"wall_seconds"}:
            np.testing.assert_array_equal(found[name], expected[name], name)

    def test_overdamped_where_friction_dominates(self):
        model, why = self.chosen()
        self.assertEqual(model, "overdamped")
        self.assertRegex(why, r'^the path of "overdamped" differs by about 0\.000[78]\d* of E_ref from that of "fluid"$')
        self.expect_same("named.toml", OVERDAMPED)

    def test_stokes_without_friction(self):
        self.assertEqual(self.chosen(*CREEPS)[0], "stokes")
        self.expect_same("named.toml", OPEN.replace('"auto"', '"stokes"'), *CREEPS)

    def test_fluid_where_inertia_shows(self):
        model, why = self.chosen(*SWINGS)
        self.assertEqual(model, "fluid")
        self.assertRegex(why, r'^model "\w+" would differ by about 0\.01\d* of E_ref on the way, by ')
        self.expect_same("named.toml", OPEN.replace('"auto"', '"fluid"'), *SWINGS)

    def test_fluid_where_it_cannot_be_told(self):
        quick = ("time.end=0.02", "time.output=[]")
        loads = "a tension, pressure or force, a reservoir or a free period acts on the membrane"
        for given, why in (
            (("velocity.initial=rotation", "velocity.omega=0.1"), "the case gives a velocity"),
            (("model.volume=free", "model.pressure=0.1"), loads),
            (("model.volume=free", "model.bead_width=0.3", "model.extension={time=[0, 0.02], value=[0, 0.01]}"), loads),
        ):
            self.assertEqual(self.chosen(*quick, *given), ("fluid", f"whether a simpler model does is unknown: {why}"))

    @study
    def test_other_tiers(self):
        short = ("accuracy.energy=1e-2", "time.end=0.05", "time.output=[]")
        for tier, given in (("auto", short), ("surface3d", (
            *short, "discretisation.elements=80", "discretisation.order=2", "accuracy.estimate=false"))):  # fmt: skip
            self.assertEqual(self.chosen(f"tier={tier}", *given)[0], "overdamped")
            self.expect_same("named.toml", OVERDAMPED, f"tier={tier}", *given)

    @study
    def test_waves_around_the_axis_that_grow(self):
        # cases/auto_buckles.toml: by the dispersion relation m = 1 grows.
        self.write("case.toml", (CASES / "auto_buckles.toml").read_text().replace('"overdamped"', '"auto"\ngamma = 2.0'))
        out, advice = self.tubule("check", "case.toml", *sets("time.end=25.0", "discretisation.order=2"))
        self.assertRegex(advice, "advice: tier auto, model fluid, .* the non-axisymmetric mode m = 1 grows")
        self.assertIn('model.kind = "fluid": whether a simpler model does is unknown: trial runs of simpler models do not come '
                      "to the end as axisymmetric ones", out)  # fmt: skip

    @study
    def test_starts_without_symmetry(self):
        # Trial runs on 80 triangles, for Re = 0.05 without friction. Stokes flow of the ellipsoid differs by 1.5e-3 from the
        # fluid, by runs of both; that of the tube, whose small waves grow, by 0.1: docs/decisions/tiers.md.
        ellipsoid = 'kind = "ellipsoid"\na = 1.0\nb = 0.8\nc = 0.6\n'
        tube = 'kind = "tube"\nradius = 1.0\nlength = 4.0\n[[shape.mode]]\namplitude = 0.12\nn = 1\nm = 2\n'
        for shape, told in ((ellipsoid, 'model.kind = "stokes": the path of "stokes" differs by about 0.003'),
                            (tube, 'model.kind = "fluid": whether a simpler model does is unknown: the fall of the energy speeds up')):
            self.write("case.toml", 'tier = "surface3d"\n[energy]\nk20 = 1.0\n[model]\nkind = "auto"\nRe = 0.05\n[shape]\n'
                       f"{shape}[accuracy]\nenergy = 1e-2\n[time]\nend = 2.025\n")  # fmt: skip
            self.assertIn(told, self.tubule("check", "case.toml", "--set", "discretisation.order=2")[0])

    def test_a_result_knows_its_model(self):
        self.chosen()
        with h5py.File(self.result) as file:
            self.assertIn("model.chosen=overdamped", str(dict(file["case"].attrs)) + str(file["case"][()] if hasattr(file["case"], "shape") else ""))
        self.assertRegex(self.tubule("show", "case.hdf")[0], r"\nmodel +overdamped\n")
        # At time.end = 90 the choice might be another one: a result keeps its own.
        err = self.tubule("run", "case.toml", "--resume", *sets("time.end=46.0", "accuracy.energy=2e-3"))[1]
        self.assertIn("model overdamped: that of the result", err)
        self.tubule("run", "case.hdf", "--resume", "--until", "47.0", "--quiet")
        self.assertEqual(series(self.result)["time"][-1], 47.0)

    def test_check(self):
        one = json.loads(self.tubule("check", "case.toml", "--json")[0])["cases"][0]
        self.assertEqual(one["model"]["kind"], "overdamped")
        self.assertRegex(one["model"]["reason"], 'differs by about .* of E_ref from that of "fluid"')
        self.assertIn('kind = "auto"', one["toml"])
        self.assertEqual(one["advice"]["model"], "overdamped")
        self.assertIsNone(json.loads(self.tubule("check", "case.toml", "--json", "--quick")[0])["cases"][0]["model"])
        out, _ = self.tubule("check", "case.toml")
        self.assertIn('\n# chosen: model.kind = "overdamped": the path of ', out)
        again = self.write("again.toml", out)
        self.tubule("check", again, "--quick")

    def test_friction_scales_the_time(self):
        # theory.md (3.5): gamma u are the forces, so what happens at t with gamma = 1 happens at gamma t.
        short = ("time.end=0.3", "time.output=[0.06]", "accuracy.energy=1e-6")
        self.write("case.toml", OVERDAMPED)
        for tier, given in (("axisym", ()), ("surface3d", ("discretisation.elements=80", "discretisation.order=3",
                                                           "discretisation.time_tolerance=1e-5", "accuracy.estimate=false"))):  # fmt: skip
            self.tubule("run", "case.toml", "--overwrite", *sets(f"tier={tier}", *short, *given))
            slow = series(self.result)
            fast = ("model.gamma=1.0", "time.end=0.001", "time.output=[0.0002]", "accuracy.energy=1e-6")
            self.tubule("run", "case.toml", "-o", "fast.hdf", "--overwrite", *sets(f"tier={tier}", *fast, *given))
            quick = series(self.folder / "fast.hdf")
            for at in (0.06, 0.3):
                i, j = np.flatnonzero(slow["time"] == at)[-1], np.flatnonzero(np.isclose(quick["time"], at / 300, rtol=1e-12))[-1]
                self.assertAlmostEqual(slow["energy"][i] / quick["energy"][j], 1, delta=1e-6)
                self.assertAlmostEqual(300 * slow["dissipation"][i] / quick["dissipation"][j], 1, delta=1e-3)
            # What the noise of the coarse mesh loses in the first steps is not counted as dissipation.
            self.assertLess(np.abs(slow["identity_defect"]).max(), 2e-3 * slow["energy"][0])

    def test_refusals(self):
        def refusal(text, *arguments):
            self.write("case.toml", text)
            return self.refused(*arguments)

        kind = f"case.toml:{OPEN[: OPEN.index('kind')].count(chr(10)) + 1}:8: model.kind must not be \"auto\""
        self.assertEqual(refusal(OPEN, "stability", "case.toml").strip(), kind + " for growth rates: name a model with --model")
        self.assertIn(kind + " in a scan, whose points would have different models", refusal(OPEN, "scan", "case.toml", "--over", "energy.k42=0,0.1", "-o", "scan.hdf"))
        self.assertIn(kind + ": only valid with a discretisation.scheme for all models; name a model",
                      refusal(OPEN.replace('"axisym"', '"surface3d"') + '[discretisation]\nscheme = "paper"\nstep = 0.1\n', "run", "case.toml"))  # fmt: skip
        self.assertIn('model.kind must not be "auto" in a chart', self.chart_refusal())
        self.write("case.toml", CAPSULE + '[model]\nkind = "auto"\n')
        self.assertIn('model.kind must not be "auto": only valid with a motion, without [equilibrium]', self.refused("equilibrium", "case.toml"))

    def chart_refusal(self):
        self.write("case.toml", OPEN)
        with self.start("chart", "case.toml", "--vary", "discretisation.elements=8,16") as process:
            out, err = process.communicate()
        self.assertEqual(process.returncode, 2, out + err)
        return out + err


class Ends(ProgramTest):
    RESTS = ('"sphere"\nradius = 1.0', '"tube"\nradius = 1.0\nlength = 6.0', '"ellipsoid"\na = 1.0\nb = 1.0\nc = 1.5',
             '"capsule"\nradius = 1.0\nlength = 3.0', '"tube"\nradius = 1.0\nlength = 6.0\nmode = [{amplitude = 1e-9, n = 1}]')  # fmt: skip
    EXTREMES = ("1e-300", "1e-30", "1.0", "1e30", "1e300")

    def case_of(self, shape, Re="1.0", gamma="0.0", k20="1.0", end="0.05", tier="axisym"):
        return self.write("case.toml", f'tier = "{tier}"\n[energy]\nk20 = {k20}\n[model]\nkind = "auto"\nRe = {Re}\n'
                          f"gamma = {gamma}\n[shape]\nkind = {shape}\n[time]\nend = {end}\nlimit = 0.2\n")  # fmt: skip

    def test_the_simplest_model_where_nothing_moves(self):
        for shape in self.RESTS[:2]:
            for gamma, model in (("1.0", "overdamped"), ("0.0", "stokes")):
                self.case_of(shape, gamma=gamma)
                self.assertIn(f'case.toml: model {model}: nothing moves in a trial run of "{model}"\n',
                              self.tubule("run", "case.toml", "--overwrite", "--set", "time.limit=60")[1])  # fmt: skip

    def test_rest_and_extreme_numbers_end_within_their_limit(self):
        """A seeded table; a machine may be slow, but an endless trial run would take much longer."""
        random = Random(36)
        for _ in range(4):  # fuzz.auto has more
            words = {"shape": random.choice(self.RESTS), "tier": random.choice(("axisym", "axisym", "auto", "surface3d")),
                     **{key: random.choice(self.EXTREMES) for key in ("Re", "gamma", "k20", "end")}}  # fmt: skip
            case = self.case_of(**words)
            for command in (("run", case, "--overwrite", "--quiet"), ("check", case)):
                with self.subTest(command=command[0], **words), self.start(*command) as process:
                    self.addCleanup(process.kill)
                    began = time.monotonic()
                    out, err = process.communicate(timeout=90)
                    self.assertIn(process.returncode, (0, 3, 4, 5) if command[0] == "run" else (0,), out + err)
                    self.assertLess(time.monotonic() - began, 0.2 + 20 if command[0] == "run" else 60)


class OtherKind(ProgramTest):
    def test_a_result_is_not_resumed_with_another_kind(self):
        """The message names the model, not the choice of before, which the user never wrote."""
        self.write("case.toml", OPEN)
        self.tubule("run", "case.toml", "--quiet", "--set", "time.end=1.0", "--set", "time.output=[0.5]")
        words = self.tubule("run", self.result, "--resume", "--set", "model.kind=fluid", "--until", "2", status=2)[1]
        self.assertIn("model.kind", words)
        self.assertNotIn("model.chosen", words)


class Rates(ProgramTest):
    def test_growth_rates_have_the_friction_of_the_case(self):
        """`tubule stability --model overdamped` of a case whose model is "auto" is that of the overdamped case."""
        case = """tier = "axisym"
energy = {k20 = 1.0}
model = {kind = "auto", gamma = 300.0}
shape = {kind = "tube", radius = 1.0, length = 8.0}
time = {end = 1.0}
"""
        chosen = self.tubule("stability", self.write("auto.toml", case), "--model", "overdamped")[0]
        named = self.tubule("stability", self.write("named.toml", case.replace("auto", "overdamped")))[0]
        self.assertIn("overdamped, gamma = 300", chosen)
        self.assertEqual(chosen, named)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
