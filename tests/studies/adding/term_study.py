#!/usr/bin/python3
"""A fourth energy term, k22 H^2 K, added first in the list of common/energy/bending.hpp, is known everywhere.

term_study.py TUBULE TUBULE_FOUR_TERMS: the ordinary program and the one built with that entry (adding_study.py).
"""
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np

PROGRAM, FOUR_TERMS = sys.argv[1], sys.argv[2]

# Moduli for which the flow is well posed: f_HH + 2 f_HK x + f_KK x^2 = 2 k20 + 2 k22 (K + 2 H x) > 0.
K20, H0, K22, RADIUS, LENGTH, AMPLITUDE, ACCURACY = 0.2, -0.5, 0.02, 0.8, 2.0, 0.2, 1e-6

CASE = f"""
tier = "axisym"
[energy]
k20 = {K20}
H0 = {H0}
k22 = {K22}
[shape]
kind = "tube"
radius = {RADIUS}
length = {LENGTH}
"""
MODE = f"""
[[shape.mode]]
amplitude = {AMPLITUDE}
n = 1
"""
REST = f"""
[accuracy]
energy = {ACCURACY}
[time]
end = 1e-3
"""


def expected_start():
    """Energies k20 INT (H-H0)^2 dS, k22 INT H^2 K dS of the perturbed tube, and E_ref of the requested accuracy.

    Geometry of a graph r(z), theory.md (4.1), (4.2): H = (r''/g^2 - 1/r)/g, K = -r''/(r g^4), dS = 2 pi r g dz.
    The trapezoidal rule is exact to rounding for a smooth periodic integrand.
    """
    n = 2048
    q = 2 * np.pi / LENGTH
    z = np.arange(n) * LENGTH / n
    r = RADIUS + AMPLITUDE * np.cos(q * z)
    rz = -AMPLITUDE * q * np.sin(q * z)
    rzz = -AMPLITUDE * q**2 * np.cos(q * z)
    g = np.sqrt(1 + rz**2)
    H = (rzz / g**2 - 1 / r) / g
    K = -rzz / (r * g**4)
    weight = 2 * np.pi * r * g * LENGTH / n
    magnitudes = K20 * (H**2 + H0**2) + K22 * (H**4 + K**2)
    e20, e22 = np.sum(K20 * (H - H0) ** 2 * weight), np.sum(K22 * H**2 * K * weight)
    return e20, e22, max(abs(e20 + e22), np.sum(magnitudes * weight))


def run(program, *arguments):
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, timeout=100)


class FourTerms(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.uniform = self.folder / "uniform.toml"
        self.uniform.write_text(CASE + REST)
        self.perturbed = self.folder / "perturbed.toml"
        self.perturbed.write_text(CASE + MODE + REST)

    def result_of(self, case):
        result = self.folder / "result.hdf"
        done = run(FOUR_TERMS, "run", case, "-o", result, "--quiet", "--overwrite")
        self.assertEqual(done.returncode, 0, done.stderr)
        return h5py.File(result, "r")

    def test_ordinary_program_refuses_the_key(self):
        done = run(PROGRAM, "run", self.perturbed, "-o", self.folder / "result.hdf")
        self.assertEqual(done.returncode, 2)
        self.assertRegex(done.stderr, r"perturbed\.toml:6:1: .*k22")  # line 6 of the case
        for allowed in ("k20", "k40", "k42", "H0"):
            self.assertIn(allowed, done.stderr)
        self.assertFalse((self.folder / "result.hdf").exists())

    def test_misspelt_key_is_told_all_four(self):
        self.perturbed.write_text(self.perturbed.read_text().replace("k22", "k23"))
        done = run(FOUR_TERMS, "check", self.perturbed)
        self.assertEqual(done.returncode, 2)
        for allowed in ("k20", "k40", "k42", "k22", "H0"):
            self.assertIn(allowed, done.stderr)

    def test_vanishes_on_a_uniform_tube(self):
        # H = -1/R, K = 0: the term is 0 at all times, and so is its force. The tube widens as without it:
        # v - ln|v| - 2 k20 H0^4 t is constant for v = 1 - H0^2 R^2.
        with self.result_of(self.uniform) as result:
            e22 = result["series/energy_22"][:]
            time, radius, e20 = (result["series"][name][:] for name in ("time", "r_min", "energy_20"))
        start = K20 * (-1 / RADIUS - H0) ** 2 * 2 * np.pi * RADIUS * LENGTH
        self.assertLess(np.max(np.abs(e22)), ACCURACY * start)
        self.assertAlmostEqual(e20[0], start, delta=ACCURACY * start)
        v = 1 - H0**2 * radius**2
        constant = v - np.log(np.abs(v)) - 2 * K20 * H0**4 * time
        self.assertGreater(radius[-1], RADIUS + 1e-4)
        np.testing.assert_allclose(constant, constant[0], rtol=0, atol=ACCURACY)

    def test_value_on_a_perturbed_tube(self):
        e20, e22, reference = expected_start()
        with self.result_of(self.perturbed) as result:
            series = {name: data[:] for name, data in result["series"].items()}
        self.assertEqual(series["time"][0], 0)
        self.assertAlmostEqual(series["energy_22"][0], e22, delta=ACCURACY * reference)
        self.assertAlmostEqual(series["energy_20"][0], e20, delta=ACCURACY * reference)
        self.assertGreater(abs(e22), 1e-2 * reference)  # so that the comparison above is meaningful
        terms = sum(series[name] for name in ("energy_20", "energy_40", "energy_42", "energy_22"))
        np.testing.assert_allclose(terms, series["energy"], rtol=0, atol=1e-12 * reference)
        self.assertLess(series["energy"][-1], series["energy"][0])

    def test_moves_the_tube_as_its_energy_says(self):
        # dE/dt = -dissipation holds only if force and energy know the same terms.
        _, _, reference = expected_start()
        with self.result_of(self.perturbed) as result:
            defect = result["series/identity_defect"][:]
            energy = result["series/energy"][:]
        self.assertGreater(energy[0] - energy[-1], 1e-3 * reference)
        self.assertLess(np.max(np.abs(defect)), ACCURACY * reference)

    def test_the_papers_scheme_refuses_it(self):
        # Its forces are written for k20, k40 and k42: bad input (status 2), not a failure of the run.
        case = self.folder / "paper.toml"
        case.write_text(
            f'tier = "surface3d"\nenergy = {{k20 = {K20}, k22 = {K22}}}\nshape = {{kind = "sphere", radius = 1}}\n'
            'model.kind = "fluid"\ntime.end = 0.1\ndiscretisation = {scheme = "paper", step = 0.1}\n'
        )
        done = run(FOUR_TERMS, "check", case)
        self.assertEqual(done.returncode, 2, done.stdout)
        self.assertIn('discretisation.scheme must not be "paper" with energy.k22', done.stderr)

    def test_without_its_modulus_nothing_changes(self):
        # A sphere of fixed area and volume is rigid: an overdamped run needs to see that H is the same everywhere.
        # Expected values are those of the ordinary program; the two are compiled differently.
        case = self.folder / "sphere.toml"
        text = f'tier = "axisym"\nenergy = {{k20 = {K20}, k42 = 0.1}}\n'
        case.write_text(text + 'shape = {kind = "sphere", radius = 1}\nmodel.kind = "overdamped"\ntime.end = 0.1\n')
        energies, growth = [], []
        for program in (PROGRAM, FOUR_TERMS):
            result = self.folder / f"{Path(program).name}_{len(energies)}.hdf"
            done = run(program, "run", case, "-o", result, "--quiet")
            self.assertEqual(done.returncode, 0, done.stderr)
            with h5py.File(result, "r") as file:
                energies.append(file["series/energy"][-1])
            case_of_tube = self.folder / "tube.toml"
            case_of_tube.write_text(CASE.replace(f"k22 = {K22}", "k42 = 0.1") + REST)
            done = run(program, "stability", case_of_tube, "--json")
            self.assertEqual(done.returncode, 0, done.stderr)
            growth.append(json.loads(done.stdout)["models"][0])
        self.assertAlmostEqual(energies[1] / energies[0], 1, delta=1e-9)
        self.assertAlmostEqual(growth[1]["least_k42"], growth[0]["least_k42"], delta=1e-9)
        for one, other in zip(growth[0]["waves"], growth[1]["waves"], strict=True):
            self.assertAlmostEqual(other["rate"], one["rate"], delta=1e-9 * max(1, abs(one["rate"])))

    def test_picture_has_its_label(self):
        self.result_of(self.perturbed).close()
        picture = self.folder / "picture.svg"
        done = run(FOUR_TERMS, "plot", self.folder / "result.hdf", "--kind=energy", "-o", picture)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("k\u2082\u2082H\u00b2K", picture.read_text())  # k_{22}H^2K in real sub- and superscripts

    def test_derivatives_are_consistent(self):
        done = run(FOUR_TERMS, "run", "--check-derivatives", "--overwrite", self.perturbed, "-o", self.folder / "result.hdf")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        slope = "right, Taylor slope (2\\.0|1\\.9)"
        self.assertRegex(done.stdout, f"k22\\ngradient: {slope}.*\\nHessian : {slope}")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
