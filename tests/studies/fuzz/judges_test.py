#!/usr/bin/python3
"""What judges the results of the fuzzers sees what is spoilt, and its energies are those of closed forms.

    judges_test.py TUBULE
"""

import math
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

import h5py
import rows
from samples import TUBE
from sandbox import Finding

TUBULE = Path(sys.argv.pop(1)).resolve()


class Rows(unittest.TestCase):
    def test_spoilt_rows_are_findings(self):
        case = tomllib.loads(TUBE)
        with tempfile.TemporaryDirectory() as folder:
            result = Path(folder, "tube.hdf")
            Path(folder, "tube.toml").write_text(TUBE)
            subprocess.run([TUBULE, "run", "tube.toml", "--quiet"], cwd=folder, check=True)
            self.assertEqual(rows.judge(case, result), "finished")
            sound = result.read_bytes()
            for name, row, kind, change in (
                ("r_min", 3, "impossible", lambda x: -x),
                ("free_energy", 3, "rise", lambda x: 2 * x),
                ("energy", 0, "first-row", lambda x: 1.01 * x),
                ("area", -1, "nan", lambda x: math.nan),
            ):
                result.write_bytes(sound)
                with h5py.File(result, "r+") as file:
                    file["series"][name][row] = change(file["series"][name][row])
                with self.assertRaises(Finding) as found:
                    rows.judge(case, result)
                self.assertEqual(found.exception.kind, kind)

    def test_energies_of_closed_forms(self):
        energy = {"k20": 0.7, "k42": 0.2, "H0": -0.5, "term": [{"modulus": 0.1, "H": 3}]}
        sphere = 4 * math.pi * 1.69 * rows.density(energy, -2 / 1.3, 1 / 1.69)
        tube = 2 * math.pi * 1.3 * 2 * rows.density(energy, -1 / 1.3, 0)
        for shape, expected in (
            ({"kind": "sphere", "radius": 1.3}, sphere),
            ({"kind": "ellipsoid", "a": 1.3, "b": 1.3, "c": 1.3}, sphere),
            ({"kind": "tube", "radius": 1.3, "length": 2.0}, tube),
            ({"kind": "capsule", "radius": 1.3, "length": 2.0}, sphere + tube),
        ):
            self.assertAlmostEqual(rows.given_energy({"shape": shape, "energy": energy}), expected, places=9)
        clifford = {"kind": "torus", "radius": math.sqrt(2), "tube_radius": 1.0}
        self.assertAlmostEqual(rows.given_energy({"shape": clifford, "energy": {"k20": 1}}), 8 * math.pi**2, places=9)
        # Whatever the axes are called, and wherever the poles.
        axes = ({"a": 1, "b": 1, "c": 1.5}, {"a": 1.5, "b": 1, "c": 1})
        turned = [rows.given_energy({"shape": {"kind": "ellipsoid"} | a, "energy": energy}) for a in axes]
        self.assertAlmostEqual(*turned, places=9)


if __name__ == "__main__":
    unittest.main()
