#!/usr/bin/python3
"""Tethers from flat patches in rings and from a vesicle, against the equations of a point force and their own balance.

tethers_study.py TUBULE. kappa = 2 k20 = 1. On patches the tension is 1/2: a tether has the radius 1 and the force 2 pi.
In arc length s from the axis, with the tangent angle psi, its slope U and a momentum g, a membrane under the force
2 pi p at its pole, where it begins with U = -p (2 log s + 3)/4 + 2 c, obeys

    U' = -U cos psi/r + sin psi cos psi/r^2 + (g sin psi - p cos psi)/r,   g' = (U^2 - sin^2 psi/r^2)/2 + 1/2.
"""
import math
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
from scipy.integrate import solve_bvp
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "command"))
from program import PROGRAM, series  # noqa: E402

TENSION = 0.5
WIDTHS = 0.1, 0.05, 0.025
NEAR = 1e-4  # of the pole: where the expansion there ends

PATCH = """tier = "axisym"
[energy]
k20 = 0.5
[model]
tension = 0.5
bead_width = {width}
{load}
[shape]
kind = "patch"
radius = {ring}
[accuracy]
energy = 1e-8
[equilibrium]
held = "nothing"
[equilibrium.branch]
{branch}
"""
VESICLE = """tier = "{tier}"
[energy]
k20 = 0.5
[model]
area = "free"
volume = "fixed"
tension = 20.0
bead_width = 0.15
extension = 0.0
[shape]
{shape}
[accuracy]
energy = {asked}
[equilibrium]
volume = 4.18879020479
"""


def slopes(_, y, p):
    r, _, psi, U, g = y
    length, _, force = p
    cos, sin = np.cos(psi), np.sin(psi)
    bend = -U * cos / r + cos * sin / r**2 + (g * sin - force * cos) / r
    return length * np.array([cos, sin, U, bend, (U**2 - (sin / r) ** 2) / 2 + TENSION])


def at_pole(c, force):
    """psi, U, g"""
    psi, U = (-force / 4 * a + 2 * c * b for a, b in (((2 * math.log(NEAR) + 1) * NEAR, NEAR), (2 * math.log(NEAR) + 3, 1)))
    sin = math.sin(psi)
    return psi, U, ((TENSION - U**2 / 2) * NEAR + sin**2 / (2 * NEAR) - force * sin) / math.cos(psi)


def point_forces(ring, extensions):
    """Forces that draw the pole of a patch that is clamped in the ring as far."""
    x = np.linspace(0, 1, 400) ** 2
    r = NEAR + (ring - NEAR) * x
    psi = -0.1 * extensions[0] * r * np.exp(-r)
    y, p, out = np.array([r, 0 * r, psi, np.gradient(psi, r), TENSION * r]), [ring, 0.1, 0.1], []
    for extension in extensions:

        def ends(a, b, p, extension=extension):
            return np.array([a[0] - NEAR, a[1], *(a[2:] - at_pole(*p[1:])), b[0] - ring, b[2], b[1] + extension])

        found = solve_bvp(slopes, ends, x, y, p=p, tol=1e-9, max_nodes=100000)
        assert found.status == 0, found.message
        x, y, p = found.x, found.y, found.p
        out.append(-2 * math.pi * p[2])
    return out


def point(wide, half, narrow):
    """Without a w^2 log w + b w^2."""
    first, second = (4 * half - wide) / 3, (4 * narrow - half) / 3
    return (4 * second - first) / 3


class Tethers(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def found(self, name, text):
        case = self.folder / f"{name}.toml"
        case.write_text(text)
        subprocess.run([PROGRAM, "run", "--quiet", "--overwrite", case], check=True, cwd=self.folder)
        return series(case.with_suffix(".hdf"))

    def test_the_curve_of_a_point_force(self):
        for ring, last in (10.0, 8), (20.0, 8), (40.0, 10):
            extensions = np.arange(0.25, last + 0.01, 0.25)
            exact = point_forces(ring, extensions)
            curve = CubicSpline(extensions, exact)
            top = -minimize_scalar(lambda x: -curve(x), bounds=(4, last), method="bounded").fun  # noqa: B023
            curves, tops = [], []
            for width in WIDTHS:
                branch = f'vary = "model.extension"\nto = {last}.0\nstep = 2.0'
                by_length = self.found("length", PATCH.format(width=width, load="extension = 0.0", ring=ring, branch=branch))
                at = dict(zip(by_length["parameter"], by_length["force"]))
                curves.append(np.array([at[x] for x in range(2, last + 1, 2)]))
                branch = 'vary = "model.force"\nto = 8.0\nstep = 0.25'
                by_force = self.found("force", PATCH.format(width=width, load="force = 6.5", ring=ring, branch=branch))
                tops.append(by_force["parameter"][by_force["special"] == 1][0])
            off = point(*curves) / exact[7::8] - 1
            print(f"ring {ring}: off by {np.abs(off).max():.1e}; overshoot {top / (2 * math.pi):.5f}, fold {point(*tops) / (2 * math.pi):.5f}")
            self.assertLess(np.abs(off).max(), 1e-4)
            self.assertAlmostEqual(point(*tops) / top, 1, delta=1e-4)

    def test_tethers_of_a_vesicle_balance_in_both_tiers(self):
        """f = 2 pi R (k20/R^2 + sigma) - pi R^2 P; each tether is 20 radii long."""
        branch = '[equilibrium.branch]\nvary = "model.extension"\nto = 8.0\nstep = 1.0\n'
        shape = 'kind = "sphere"\nradius = 1.0'
        flat = self.found("flat", VESICLE.format(tier="axisym", shape=shape, asked=1e-7) + branch)
        shape = 'kind = "result"\npath = "flat.hdf"'
        deep = self.found("deep", VESICLE.format(tier="surface3d", shape=shape, asked=1e-2))
        with h5py.File(self.folder / "deep.hdf") as file:
            x = file["frames"][sorted(file["frames"])[-1]]["Points"][()]
        height = np.abs(x[:, 2])
        R = np.hypot(x[:, 0], x[:, 1])[(height > 2.5) & (height < 3.5)].mean()
        exact = 2 * math.pi * R * (0.5 / R**2 + 20) - math.pi * R**2 * deep["pressure"][-1]
        force, other = deep["force"][-1], flat["force"][-1]
        print(f"vesicle: {(height.max() - 1) / R:.1f} radii, force {force:.5f}, {exact:.5f}, tier axisym {other:.5f}")
        self.assertGreater((height.max() - 1) / R, 20)
        self.assertAlmostEqual(force / exact, 1, delta=1e-3)
        self.assertAlmostEqual(force / other, 1, delta=1e-3)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
