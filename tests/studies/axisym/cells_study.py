#!/usr/bin/python3
"""The paper's tubular cells at rest under K^2, (H - H0)^4 and both, against the shape equations solved independently.

cells_study.py TUBULE. Prints, for docs/paper.md, the energies of 27 cells, how far the program is from them, and the error that two
discretisations of shape_equations.py tell.
"""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "command"))
from program import PROGRAM, series  # noqa: E402
from shape_equations import Cell, Energy, capsule  # noqa: E402

CASE = Path(__file__).resolve().parents[3] / "cases/equilibrium_capsule.toml"
RADIUS, K20, H0 = 0.5, 0.125, -2.0
K40, K42 = (0.0, 0.02, 0.06), (0.12, 0.06, 0.0)
COMPARED = {"energy": 1e-10, "tension": 1e-8, "pressure": 1e-8}  # tolerances


def cells(length, n):
    """Energy, tension, pressure by (k40, k42), each from its neighbour, beginning where the cell is nearly a capsule."""
    cell, found, first = Cell(*capsule(RADIUS, length), n), {}, None
    for k42 in K42:
        x = first if first is not None else cell.start(RADIUS, length)
        for k40 in K40:
            energy = Energy(K20, H0, k40, k42)
            x = cell.newton(energy, x)
            first = x if k40 == 0 else first
            found[k40, k42] = {"energy": cell.integrals(energy, x)[2], "tension": x[-2], "pressure": x[-1]}
    return found


class Cells(unittest.TestCase):
    def test_both_find_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            for length in (2.0, 3.0, 4.0):
                coarse, fine = cells(length, 90), cells(length, 110)
                for (k40, k42), known in fine.items():
                    result = Path(folder) / "cell.hdf"
                    keys = {"shape.length": length, "energy.k40": k40, "energy.k42": k42, "accuracy.energy": 1e-11, "equilibrium.modes": 0}
                    sets = [word for key, value in keys.items() for word in ("--set", f"{key}={value}")]
                    subprocess.run([PROGRAM, "run", "--quiet", "--overwrite", CASE, *sets, "-o", result], check=True)
                    found = {name: series(result)[name][-1] for name in COMPARED}
                    own = abs(coarse[k40, k42]["energy"] - known["energy"])
                    print(f"l = {length:g}  k40 = {k40:4}  k42 = {k42:4}  E = {known['energy']:.12f}  own error {own:.0e}  "
                          f"program's {found['energy'] - known['energy']:+.0e}")  # fmt: skip
                    for name, tolerance in COMPARED.items():
                        with self.subTest(f"{name}, l = {length:g}, k40 = {k40}, k42 = {k42}"):
                            self.assertAlmostEqual(found[name], known[name], delta=tolerance)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
