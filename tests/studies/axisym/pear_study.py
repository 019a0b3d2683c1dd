#!/usr/bin/python3
"""Pears with narrow necks against the shape equations, solved as a boundary value problem by SciPy's solve_bvp.

pear_study.py TUBULE. k20 = 1, area 4 pi; in arc length s, with the tangent angle psi, its slope U, the radius r, a momentum
g, area, volume and energy. The unknowns S (length), P and sigma are halved, for kappa = 2 k20. Poles are cut off at r = 2e-5.
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
from scipy.integrate import solve_bvp

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "command"))
from program import PROGRAM, series  # noqa: E402

CASE = Path(__file__).resolve().parents[3] / "cases/vesicle.toml"
POLE = 2e-5


def solved(points, v, H0, tension, pressure):
    """Energy, tension, pressure, the narrowest radius; from points of a profile nearby."""
    r, z = points
    step = np.hypot(np.diff(r), np.diff(z))
    s = np.concatenate([[0], np.cumsum(step)])
    psi = np.unwrap(np.arctan2(np.gradient(z, s), np.gradient(r, s)))
    psi -= 2 * np.pi * round(psi[1] / (2 * np.pi))
    area = np.concatenate([[0], np.cumsum(np.pi * (r[1:] + r[:-1]) * step)])
    volume = np.concatenate([[0], np.cumsum(np.pi / 2 * (r[1:] ** 2 + r[:-1] ** 2) * np.diff(z))])
    U, c0 = np.gradient(psi, s), -H0

    def momentum_slope(psi, U, r, P, sigma):
        return (U - c0) ** 2 / 2 - np.sin(psi) ** 2 / (2 * r**2) + P * r * np.sin(psi) + sigma

    def slopes(_, y, p):
        psi, U, r, g, *_ = y
        S, P, sigma = p
        cos, sin = np.cos(psi), np.sin(psi)
        bend = -U * cos / r + cos * sin / r**2 + g * sin / r + P / 2 * r * cos
        return S * np.array([U, bend, cos, momentum_slope(psi, U, r, P, sigma), 2 * np.pi * r, np.pi * r**2 * sin,
                             2 * np.pi * r * (U + sin / r - c0) ** 2])  # fmt: skip

    def ends(a, b, p):
        at_pole = POLE * ((a[1] - c0) ** 2 / 2 - a[1] ** 2 / 2 + p[2])
        return np.array([a[2] - POLE, a[0] - a[1] * POLE, a[3] - at_pole, a[4], a[5], a[6], b[2] - POLE,
                         np.pi - b[0] - b[1] * POLE, b[4] - 4 * np.pi, b[5] - v * 4 * np.pi / 3])  # fmt: skip

    first = [s[-1], -pressure / 2, tension / 2]
    inner = r > 3e-3
    y = np.array([psi, U, r, 0 * r, area, volume, 0 * r])[:, inner]
    x = s[inner] - s[inner][0]
    slope = momentum_slope(*y[:3], *first[1:])
    y[3, 1:] = np.cumsum((slope[1:] + slope[:-1]) / 2 * np.diff(x))
    found = solve_bvp(slopes, ends, x / x[-1], y, p=first, tol=1e-4, max_nodes=200000)
    assert found.status == 0, found.message
    _, P, sigma = found.p
    inside = found.y[2][(found.x > 0.3) & (found.x < 0.9)]
    return found.y[6, -1], 2 * sigma, -2 * P, inside.min()


class Pears(unittest.TestCase):
    def test_both_find_the_same(self):
        for v, H0 in ((0.77, -2.8), (0.8, -3.0), (0.72, -2.5)):
            with tempfile.TemporaryDirectory() as folder:
                result = Path(folder) / "pear.hdf"
                sets = ['equilibrium.family="pear"', f"equilibrium.reduced_volume={v}", f"energy.H0={H0}", "accuracy.energy=1e-7"]
                subprocess.run([PROGRAM, "run", "--quiet", CASE, *(f"--set={one}" for one in sets), "-o", result], check=True)
                energy, tension, pressure = (series(result)[name][-1] for name in ("energy", "tension", "pressure"))
                with h5py.File(result) as file:
                    frame = file["frames"][sorted(file["frames"])[-1]]
                    points = frame["r"][()], frame["z"][()]
            known = solved(points, v, H0, tension, pressure)
            print(f"v = {v}, H0 = {H0}: E = {known[0]:.9f}, the program's {energy - known[0]:+.1e}; neck {known[3]:.4f}")
            self.assertAlmostEqual(energy, known[0], delta=1e-6)
            self.assertAlmostEqual(tension, known[1], delta=1e-5)
            self.assertAlmostEqual(pressure, known[2], delta=1e-5)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
