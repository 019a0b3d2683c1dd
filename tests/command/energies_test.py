#!/usr/bin/python3
"""Energy terms that a case adds: runs of both tiers with powers and formulas of H and K, against integrals, closed forms
and the same energy written in another way; what is refused, warned of, and stops. Argument: the program."""
import json
import unittest

import h5py
import numpy as np

from program import ProgramTest, about, series

K20, H0, RADIUS, LENGTH, AMPLITUDE, ACCURACY = 0.2, -0.5, 0.8, 2.0, 0.2, 1e-6
SHAPE = f'[shape]\nkind = "tube"\nradius = {RADIUS}\nlength = {LENGTH}\n'
MODE = f"[[shape.mode]]\namplitude = {AMPLITUDE}\nn = 1\n"
REST = f"[accuracy]\nenergy = {ACCURACY}\n[time]\nend = 1e-3\n"
QUICK_SPHERE = """[shape]
kind = "sphere"
radius = 1.0
[[shape.mode]]
amplitude = 0.1
l = 2
"""


def term(modulus, H=0, K=0, formula=None):
    keys = f'formula = "{formula}"' if formula else f"H = {H}\nK = {K}"
    return f"[[energy.term]]\nmodulus = {modulus}\n{keys}\n"


def case(*terms, tier="axisym", more=SHAPE + MODE + REST, listed=f"k20 = {K20}\n", spontaneous=H0):
    return f'tier = "{tier}"\n[energy]\n{listed}H0 = {spontaneous}\n' + "".join(terms) + more


def integrals(*functions):
    """INT f(H, K) dS over the wavy tube at the start.

    Geometry of a graph r(z), theory.md (4.1), (4.2). The trapezoidal rule is exact to rounding for smooth periodic
    integrands."""
    n, q = 4096, 2 * np.pi / LENGTH
    z = np.arange(n) * LENGTH / n
    r, rz, rzz = RADIUS + AMPLITUDE * np.cos(q * z), -AMPLITUDE * q * np.sin(q * z), -AMPLITUDE * q**2 * np.cos(q * z)
    g = np.sqrt(1 + rz**2)
    H, K = (rzz / g**2 - 1 / r) / g, -rzz / (r * g**4)
    return [np.sum(f(H, K) * 2 * np.pi * r * g) * LENGTH / n for f in functions]


class EnergiesTest(ProgramTest):
    def run_case(self, text, *options, status=0):
        path = self.write("case.toml", text)
        out, err = self.tubule("run", path, "-o", self.result, "--overwrite", *options, status=status)
        return series(self.result), out + err

    def test_terms_at_the_start(self):
        rows, _ = self.run_case(case(term(0.02, 1, 1), term(0.01, 3, 0), term(0.03, formula="log(1 + H^2*K^2)")))
        e31, e30, formula = integrals(
            lambda H, K: 0.02 * (H - H0) * K, lambda H, K: 0.01 * (H - H0) ** 3, lambda H, K: 0.03 * np.log(1 + H**2 * K**2)
        )
        reference = about(self.result)["E_ref"]
        for name, expected in (("31", e31), ("30", e30), ("formula", formula)):
            self.assertAlmostEqual(rows[f"energy_{name}"][0], expected, delta=ACCURACY * reference, msg=name)
            self.assertGreater(abs(expected), 1e-4 * reference)  # so that the comparison means something
        parts = sum(rows[f"energy_{name}"] for name in ("20", "40", "42", "31", "30", "formula"))
        np.testing.assert_allclose(parts, rows["energy"], rtol=0, atol=1e-12 * reference)

    def test_force_is_that_of_the_energy(self):
        # dE/dt = -dissipation holds only if force and energy know the same terms.
        for terms in ((term(0.02, 2, 1), term(-0.01, 3, 0)), (term(0.02, formula="(H - H0)^2*K - 0.5*(H - H0)^3"),)):
            rows, _ = self.run_case(case(*terms))
            reference = about(self.result)["E_ref"]
            self.assertGreater(rows["energy"][0] - rows["energy"][-1], 1e-3 * reference)
            self.assertLess(np.max(np.abs(rows["identity_defect"])), ACCURACY * reference)

    def test_derivatives_are_consistent(self):
        path = self.write("case.toml", case(term(0.02, 2, 1), term(1e-3, 5, 3), term(0.1, formula="sqrt(1 + H^2 + K^2)"), listed="k20 = 5.0\nk42 = 1.0\n"))
        out, _ = self.tubule("run", "--check-derivatives", path, "-o", self.result)
        slope = r"right, Taylor slope (2\.0|1\.9)"
        for name in ("k41", "k11_3", "formula"):
            self.assertRegex(out, f"{name}\ngradient: {slope}.*\nHessian : {slope}")

    def test_the_listed_terms_may_be_written_as_powers(self):
        # The same run to the last bit: they become the listed ones.
        listed, _ = self.run_case(case(listed="k20 = 0.2\nk40 = 0.01\nk42 = 0.05\n"))
        powers, _ = self.run_case(case(term(0.2, 2, 0), term(0.01, 4, 0), term(0.05, 0, 2), listed=""))
        for name in listed.keys() - {"wall_seconds"}:
            np.testing.assert_array_equal(listed[name], powers[name], err_msg=name)

    def test_powers_and_formulas_agree(self):
        powers, _ = self.run_case(case(term(0.02, 2, 1), term(0.01, 3, 0)))
        reference = about(self.result)["E_ref"]
        formula, _ = self.run_case(case(term(1.0, formula="0.02*(H - H0)^2*K + 0.01*(H - H0)^3")))
        self.assertAlmostEqual(powers["energy"][-1], formula["energy"][-1], delta=ACCURACY * reference)
        self.assertAlmostEqual(powers["r_min"][-1], formula["r_min"][-1], delta=1e-5)

    def test_gaussian_curvature_alone_exerts_no_force(self):
        # INT K dS is 0 on a period, 4 pi on a closed surface, whatever their shape.
        with_K, _ = self.run_case(case(term(0.7, 0, 1)))
        without, _ = self.run_case(case())
        self.assertAlmostEqual(with_K["energy_21"][0], 0, delta=1e-6)
        self.assertAlmostEqual(with_K["r_min"][-1], without["r_min"][-1], delta=1e-6)
        self.assertAlmostEqual(with_K["energy"][-1], without["energy"][-1], delta=2e-6 * about(self.result)["E_ref"])
        profile = "[accuracy]\nenergy = 1e-6\n"
        surface = "[accuracy]\nenergy = 1e-2\nestimate = false\n[discretisation]\nelements = 80\n"
        for tier, more, known in (("axisym", profile, 1e-12), ("surface3d", surface, 1e-4)):
            for model in ("gradient-flow", "overdamped"):
                sphere = QUICK_SPHERE + f"[model]\nkind = '{model}'\n[time]\nend = 0.02\n" + more
                closed, _ = self.run_case(case(term(0.7, 0, 1), tier=tier, more=sphere))
                without, _ = self.run_case(case(tier=tier, more=sphere))
                np.testing.assert_allclose(closed["energy_21"], 0.7 * 4 * np.pi, rtol=known)
                change = without["energy_20"][-1] - without["energy_20"][0]
                self.assertAlmostEqual((closed["energy_20"][-1] - closed["energy_20"][0]) / change, 1, delta=1e-2, msg=(tier, model))
                self.assertLess(change, 0)

    def test_growth_rates_are_those_of_theory(self):
        # Waves on a tube, amplitude 1e-5, against the closed form that `tubule stability` evaluates with the same density.
        # The radius drifts, and so does the rate: both start at the same state, over a short time.
        for name, terms in {
            "definite": (term(0.02, 6, 0), term(0.03, 4, 2)),
            "indefinite": (term(0.05, 2, 1),),
            "odd": (term(0.03, 3, 0), term(0.02, 1, 1)),
            "formula": (term(0.1, formula="sqrt(1 + (H - H0)^2 + K^2)"),),
        }.items():
            waves = SHAPE + "[[shape.mode]]\namplitude = 1e-5\nn = 1\n[accuracy]\nenergy = 1e-9\n[time]\nend = 1e-4\n"
            path = self.write("case.toml", case(*terms, more=waves))
            out, _ = self.tubule("stability", path, "--json")
            wave = next(w for w in json.loads(out)["models"][0]["waves"] if w["n"] == 1 and w["m"] == 0)
            rows, _ = self.run_case(path.read_text())
            measured = np.log(rows["mode_1"][-1] / rows["mode_1"][0]) / rows["time"][-1]
            self.assertAlmostEqual(measured / wave["rate"], 1, delta=3e-3, msg=name)

    def test_three_dimensions(self):
        # On the unit sphere H = -2, K = 1.
        sphere = "[shape]\nkind = 'sphere'\nradius = 1.0\n[discretisation]\nelements = 180\n"
        rows, _ = self.run_case(case(term(0.1, 2, 1), term(0.3, formula="exp(-K)*H"), tier="surface3d", more=sphere))
        self.assertAlmostEqual(rows["energy_41"][0] / (4 * np.pi * 0.1 * (-2 - H0) ** 2), 1, delta=1e-3)
        self.assertAlmostEqual(rows["energy_formula"][0] / (4 * np.pi * 0.3 * np.exp(-1) * -2), 1, delta=1e-3)

    def test_both_tiers_agree_in_motion(self):
        # The same sphere, gradient flow of a definite polynomial, by two discretisations.
        terms = (term(0.02, 4, 1), term(0.05, 4, 0), term(0.05, 0, 2))
        flow = QUICK_SPHERE + "[time]\nend = 0.005\n[accuracy]\nenergy = {}\n"
        profile, _ = self.run_case(case(*terms, more=flow.format(1e-6)))
        surface, _ = self.run_case(
            case(*terms, tier="surface3d", more=flow.format(1e-3) + "estimate = false\n[discretisation]\nelements = 80\n")
        )
        reference = about(self.result)["E_ref"]
        self.assertGreater(profile["energy"][0] - profile["energy"][-1], 1e-2 * reference)
        self.assertAlmostEqual(profile["energy"][-1], surface["energy"][-1], delta=1e-3 * reference)
        self.assertAlmostEqual(profile["energy_61"][-1], surface["energy_61"][-1], delta=1e-3 * reference)

    def test_formula_that_is_not_defined(self):
        tube = SHAPE + REST
        err = self.refused("run", self.write("case.toml", case(term(1.0, formula="log(-1 - H)"), more=tube.replace("0.8", "1.2"))))
        self.assertRegex(err, r"case\.toml:7:11: energy\.term\.0\.formula must be defined on the initial shape, but at r = 1\.2, z = .*")
        self.assertIn("the argument of log at character 1 of the formula is -0.1667", err)
        # The tube widens, H rises to -1, where the logarithm ends: with little weight it does not keep it from that.
        wide = tube.replace("0.8", "0.95").replace("1e-3", "100.0")
        path = self.write("case.toml", case(term(1e-6, formula="log(-1 - H)"), more=wide))
        self.tubule("run", path, "-o", self.result, status=3)
        self.assertEqual(about(self.result)["stop"], "undefined")
        self.assertLess(series(self.result)["r_min"][-1], 1)
        self.assertGreater(series(self.result)["r_min"][-1], 0.99)

    def test_formulas_that_have_no_value_are_named(self):
        # K = 0 on the straight tube, and both signs on the wavy one; H = -3 at the poles of the ellipsoid: 2 a/c^2 there.
        ellipsoid = "[shape]\nkind = 'ellipsoid'\na = 1.0\nb = 1.0\nc = 1.5\n" + REST
        overflow = "must be finite on the initial shape, but at r = .*, where H = .* and K = .*, it or a derivative of it overflows"
        for formula, shape, words in (
            ("K/K", SHAPE + REST, "must be defined .* the divisor at character 2 of the formula is .* it vanishes"),
            ("1/K", SHAPE + MODE + REST, "the divisor at character 2 .*, and has the other sign elsewhere: it vanishes in between"),
            ("1/(H + 3)", ellipsoid, "must be defined .* the divisor at character 2 of the formula is .*: it vanishes"),
            ("exp(exp(exp(H^2)))", ellipsoid, overflow),
            ("cosh(1000*H)", SHAPE + REST, overflow),
        ):
            path = self.write("case.toml", case(term(1.0, formula=formula), more=shape))
            for command in ("run", "check"):
                self.assertRegex(self.refused(command, path), r"case\.toml:7:11: energy\.term\.0\.formula .*" + words)

    def test_endless_energies_are_warned_of(self):
        path = self.write("case.toml", case(term(0.01, 3, 0)))
        self.assertIn("has no lower bound", self.tubule("check", "--quick", path)[1])
        _, words = self.run_case(path.read_text())
        self.assertIn("has no lower bound", words)
        self.write("case.toml", case(term(0.1, 2, 1), listed="k20 = 0.2\nk40 = 0.1\nk42 = 0.1\n"))
        self.assertNotIn("bound", self.tubule("check", "--quick", path)[1])

    def test_ill_posed_at_once_and_later(self):
        # f_HH = 2 k20 + 6 k30 (H - H0) vanishes at H - H0 = -k20/(3 k30): H = -1/R.
        at_once = case(term(0.5, 3, 0), more=SHAPE.replace("0.8", "1.0") + REST)  # .4 + 3 (-.5) < 0
        said = self.refused("run", self.write("case.toml", at_once), "-o", self.result)
        self.assertIn("energy.term.0.modulus makes the problem ill-posed at the initial shape, and nothing is run: ", said)
        self.assertFalse(self.result.exists())
        # A case that expects it has it recorded.
        self.run_case(at_once + '[expect]\nstop = "ill-posed"\n', status=3)
        self.assertEqual(about(self.result)["stop"], "ill-posed")
        self.assertEqual(series(self.result)["time"][-1], 0)
        # On a tube that shrinks towards R = 1/2 the symbol for waves along it is 2 k20 - 4 k41 u (2 - u), u = 1/R. It counts as
        # lost at a thousandth of that at the start.
        k41, symbol = 0.11, lambda R: 2 * K20 - 4 * 0.11 * (2 - 1 / R) / R
        later = case(term(k41, 2, 1), more=SHAPE.replace("0.8", "1.6") + REST.replace("1e-3", "50.0"), spontaneous=-2.0)
        rows, _ = self.run_case(later, status=3)
        self.assertEqual(about(self.result)["stop"], "ill-posed")
        u = 1 - np.sqrt(1 - (2 * K20 - 1e-3 * symbol(1.6)) / (4 * k41))
        self.assertAlmostEqual(rows["r_min"][-1] * u, 1, delta=1e-5)

    def test_check_names_what_makes_a_start_ill_posed(self):
        sphere = "[shape]\nkind = 'sphere'\nradius = 1.0\n[discretisation]\nelements = 80\n[time]\nend = 1.0\n"
        tube = SHAPE.replace("0.8", "1.0") + REST
        for text, blamed in (
            # f_HH = 2 k20 + 6 k30 (H - H0) < 0 at H = -1; 2 k20 + 2 k42 < 0 on the unit sphere; either of two
            (case(term(0.5, 3, 0), more=tube), "6:11: energy.term.0.modulus"),
            (case(tier="surface3d", listed="k20 = 1.0\nk42 = -1.05\n", more=sphere), "4:7: energy.k42"),
            (case(term(-0.5, 4, 0), more=tube), "6:11: energy.term.0.modulus"),  # that of k40
            (case(term(0.5, 3, 0), term(0.1, 1, 1), more=tube), "2:1: energy"),
        ):
            path = self.write("case.toml", text)
            for words in (self.refused("check", path), self.refused("check", "--quick", path), self.refused("run", path)):
                self.assertIn(f"case.toml:{blamed} makes the problem ill-posed at the initial shape, and nothing is run: ", words)
        found = json.loads(self.tubule("check", "--json", path, status=2)[0])["cases"][0]
        self.assertFalse(found["valid"])
        self.assertIn("ill-posed", found["errors"][0]["message"])
        self.assertNotIn("ill-posed", self.tubule("check", self.write("case.toml", case(term(0.01, 3, 0), more=tube)))[1])

    def test_only_a_certain_start_is_refused_as_ill_posed(self):
        # 2 k20 + 2 k42 x^2 = -0.1 for x = 1: certain of a sphere, but neither of its triangles nor of an H0 that varies.
        sphere = "[shape]\nkind = 'sphere'\nradius = 1.0\n"
        few, moves = "[discretisation]\nelements = 80\n", "[time]\nend = 1e-3\n"
        listed = "k20 = 1.0\nk42 = -1.05\n"
        by_mesh = case(tier="surface3d", listed="k20 = 1.0\n", more=sphere + few + moves)
        self.run_case(by_mesh)
        self.result.rename(self.folder / "sphere.hdf")
        frame = "[shape]\nkind = 'result'\npath = 'sphere.hdf'\nframe = 0\n"
        varies = case(tier="surface3d", listed=listed, more=sphere + few + moves, spontaneous='"0*x"')
        for text in (case(tier="surface3d", listed=listed, more=frame + moves), varies):
            path = self.write("case.toml", text)
            self.assertIn("makes the problem ill-posed at the initial shape, and a run ends at once: ", self.tubule("check", path)[1])
            self.tubule("run", path, "-o", self.result, "--overwrite", status=3)
            self.assertEqual(about(self.result)["stop"], "ill-posed")
            self.result.unlink()
        # On the tube of radius 1 with f = -0.1 (H - H0)^2 - 0.5 (H - H0) K the symbol is -0.2 - x: 0.8 for waves along it
        # (x = -1), -0.2 for those around it (x = 0), which only tier surface3d has.
        tube = SHAPE.replace("0.8", "1.0")
        for tier, more, status in (("axisym", REST, 0), ("surface3d", few + moves, 2)):
            text = case(term(-0.5, 1, 1), tier=tier, listed="k20 = -0.1\n", more=tube + more)
            self.tubule("check", "--quick", self.write("case.toml", text), status=status)
        # The sphere near 2 k20 + 2 k42 = 0: only below -1e-3 of 2 k20 + 2 |k42| is it certain.
        for k42, status in ((-0.9999, 0), (-1.0001, 0), (-1.01, 2)):
            text = case(tier="surface3d", listed=f"k20 = 1.0\nk42 = {k42}\n", more=sphere + few + moves)
            self.tubule("check", "--quick", self.write("case.toml", text), status=status)

    def test_sets_and_scans_reach_terms(self):
        path = self.write("case.toml", case(term(0.0, 2, 1)))
        rows, _ = self.run_case(path.read_text(), "--set", "energy.term.0.modulus=0.01")
        (expected,) = integrals(lambda H, K: 0.01 * (H - H0) ** 2 * K)
        self.assertAlmostEqual(rows["energy_41"][0], expected, delta=1e-5)
        scan = self.folder / "scan.hdf"
        self.tubule("scan", path, "--over", "energy.term.0.modulus=0,0.005,0.01", "-o", scan, "--quiet")
        with h5py.File(scan) as file:
            self.assertEqual(len(set(np.round(file["points/energy"][:], 6))), 3)

    def test_branches_follow_terms(self):
        cell = '[shape]\nkind = "capsule"\nradius = 0.5\nlength = 2.0\n[accuracy]\nenergy = 1e-6\n'
        branch = '[equilibrium]\n[equilibrium.branch]\nvary = "energy.term.0.modulus"\nto = 0.02\nstep = 0.01\n'
        rows, _ = self.run_case(case(term(0.0, 4, 1), more=cell + branch, listed="k20 = 0.125\nk42 = 0.06\n", spontaneous=-2.0))
        np.testing.assert_allclose(rows["parameter"], [0, 0.01, 0.02], atol=1e-12)
        self.assertGreater(np.ptp(rows["energy_61"]), 0)

    def test_pictures_have_their_labels(self):
        self.run_case(case(term(0.01, 2, 1), term(0.3, formula="H^2")), "--set", "time.end=0.1")
        picture = self.folder / "picture.svg"
        self.tubule("plot", self.result, "--kind=energy", "-o", picture)
        self.assertIn("k\u2084\u2081(H\u2212H\u2080)\u00b2K", picture.read_text())

    def test_stability_names_them(self):
        path = self.write("case.toml", case(term(0.02, 2, 1), term(0.5, formula="H^2")))
        out, _ = self.tubule("stability", path)
        self.assertIn("k41 = 0.02", out)
        self.assertIn("0.5 (H^2)", out)


if __name__ == "__main__":
    unittest.main(argv=["energies_test.py"])
