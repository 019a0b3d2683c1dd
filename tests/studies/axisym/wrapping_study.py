#!/usr/bin/python3
"""Membranes on a particle and on a wall as the range of the potential falls: contact conditions, shape equations.

wrapping_study.py TUBULE. k20 = 1/2. The potential is lowest at the distance 1 from the centre of the particle, or at
the wall. Quantities are polynomials in sqrt(range), the width of the edge of contact, and are extrapolated to 0. A
contact potential makes the curvature jump by sqrt(w/k20) at the edge. From there a free membrane obeys, in arc length
s from the axis, with the tangent angle psi, its slope U, tension, pressure and axial force divided by 2 k20 (and
2 pi), and a momentum g,

    U' = -U cos psi/r + sin psi cos psi/r^2 + (g sin psi - force cos psi)/r - pressure r cos psi/2
    g' = (U^2 - sin^2 psi/r^2)/2 + tension - pressure r sin psi.
"""
import math
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline
from scipy.optimize import fsolve

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "command"))
from program import PROGRAM, series  # noqa: E402

RANGES = 0.04, 0.02, 0.01, 0.005
RING = 3.0  # radius; hinged, at z = 0
FULL = 2.0  # 4 k20/R^2: a particle is wrapped

CASE = """tier = "axisym"
[energy]
k20 = 0.5
[[energy.potential]]
{potential}
strength = {w!r}
range = {range!r}
[accuracy]
energy = 1e-8
[shape]
{shape}
{rest}
"""


class Free:
    """A free membrane under these loads."""

    def __init__(self, tension, pressure=0.0, force=0.0):
        self.tension, self.pressure, self.force = tension, pressure, force / (2 * math.pi)

    def slopes(self, _, y):
        r, _, psi, U, g, *_ = y
        cos, sin = math.cos(psi), math.sin(psi)
        bend = -U * cos / r + cos * sin / r**2 + (g * sin - self.force * cos) / r - self.pressure * r * cos / 2
        momentum = (U**2 - (sin / r) ** 2) / 2 + self.tension - self.pressure * r * sin
        return [cos, sin, U, bend, momentum, 2 * math.pi * r, math.pi * r * (U + sin / r) ** 2]

    def followed(self, r, z, psi, U, until, length):
        """r, z, psi, U, g, area and bending energy where until(r, z, psi) is 0; a negative length goes to the axis."""
        sin = math.sin(psi)
        g = (self.tension - U**2 / 2) * r + sin**2 / (2 * r) - (self.pressure * r**2 / 2 + self.force) * sin
        ends = lambda _, y: until(*y[:3])  # noqa: E731
        ends.terminal = True
        first = [r, z, psi, U, g / math.cos(psi), 0, 0]
        found = solve_ivp(self.slopes, (0, length), first, events=ends, rtol=1e-10, atol=1e-11)
        assert found.status == 1, "the end is not reached"
        return found.y[:, -1]


def wrapped(w, tension, z, guess):
    """Force and free energy of a membrane in the ring that touches a particle at the height z: a contact potential."""

    def end(x):
        angle, force = x
        at = math.sin(angle), -z - math.cos(angle), angle, 1 - math.sqrt(2 * w)
        return Free(tension, force=force).followed(*at, lambda r, *_: r - RING, 50)

    def misses(x):
        r, z, psi, U, *_ = end(x)
        return z, U + math.sin(psi) / r  # at the hinged ring H = 0

    x = fsolve(misses, guess, xtol=1e-11)
    *_, area, bending = end(x)
    cap = 2 * math.pi * (1 - math.cos(x[0]))
    return x[1], bending + tension * area + cap * (FULL + tension - w)


def height_of_catenoid(angle):
    """Height of a membrane without tension and force around a particle that is wrapped up to this angle."""
    a, side = math.sin(angle) ** 2, math.copysign(1, angle - math.pi / 2)
    return a * (math.acosh(RING / a) + side * math.acosh(1 / math.sin(angle))) - math.cos(angle)


def limit(values):
    """At the range 0 of values at all RANGES."""
    return np.linalg.solve(np.vander(np.sqrt(RANGES)), values)[-1]


def foreseen(values, at):
    """At the next range, from the values at the first RANGES and that of the limit."""
    x, last = np.sqrt([*RANGES[max(0, len(values) - 2) : len(values)], 0]), [*values[-2:], FULL]
    return np.polyval(np.polyfit(x, last, len(last) - 1), math.sqrt(at))


class Membranes(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.last, self.count = None, 0

    def found(self, potential, w, range_, shape, rest):
        """Last values of all series; begins with the shape found last."""
        if self.last:
            shape, rest = f'kind = "result"\npath = "{self.last}"', rest + "\ndescend = false"
        self.count += 1
        case = Path(self.folder.name, f"{self.count}.toml")
        case.write_text(CASE.format(potential=potential, w=float(w), range=range_, shape=shape, rest=rest))
        self.last = case.with_suffix(".hdf")
        subprocess.run([PROGRAM, "run", "--quiet", case, "-o", self.last], check=True)
        return {name: values[-1] for name, values in series(self.last).items()}

    def on_particle(self, w, z, range_, tension=0.0):
        return self.found(
            f'kind = "sphere"\nradius = {1 - range_!r}\nz = {z!r}', w, range_,
            f'kind = "patch"\nradius = {RING}\nheight = {z + 1 + range_ / 3!r}',
            f'[model]\ntension = {tension}\nrim = "hinged"\n[equilibrium]\nheld = "nothing"')  # fmt: skip

    def free_part(self, membrane, down, distance, until):
        """U where the free part, from 14 ranges in front of the minimum on, would touch."""
        with h5py.File(self.last) as file:
            frame = file["frames"][sorted(file["frames"])[-1]]
            r, z, H = (frame[name][()] for name in ("r", "z", "H"))
        z = -z if down else z
        order = 1 if z[0] < z[-1] else -1
        r, z, H = r[::order], z[::order], H[::order]
        s = np.concatenate([[0], np.cumsum(np.hypot(np.diff(r), np.diff(z)))])
        i = np.argmax(distance(r, z) > 0)
        slope = [make_interp_spline(s[i - 8 : i + 9], v[i - 8 : i + 9], 7)(s[i], 1) for v in (r, z)]
        psi = math.atan2(slope[1], slope[0])
        return membrane.followed(r[i], z[i], psi, -H[i] - math.sin(psi) / r[i], until, -3)[3]

    def test_partial_degrees_are_neutral_where_wrapping_pays(self):
        """Without tension a free membrane is a catenoid. In the limit a particle at any height, thus of any degree of
        wrapping, is free of force at the strength 4 k20/R^2 and marginally stable, dN/dz = 0: below, it leaves the
        membrane; above, it is drawn in. To wrap it up to an angle a costs 2 pi (1 - cos a) (4 k20 - w R^2), so that the
        flat membrane becomes unstable there, too. No eigenvalue changes its sign at a range > 0: the strength without
        force then rises with the degree, and the stiffness falls to 0 with the range."""
        for degrees in (60, 90):
            z, self.last, strengths, stiffness = height_of_catenoid(math.radians(degrees)), None, [], []
            for range_ in RANGES:
                force = lambda w, z=z: self.on_particle(w, z, range_)["potential_force"]  # noqa: B023, E731
                w, step = foreseen(strengths, range_) if strengths else 1.8, 2e-3
                if strengths:  # on the way to a shape nearby
                    self.on_particle((w + strengths[-1]) / 2, z, 1.4 * range_)
                before, done = force(w), False
                while not done:
                    after = force(w + step)
                    w, before, step = w + step, after, -after * step / (after - before)
                    done, step = abs(step) < 2e-3, max(-0.02, min(0.02, step))
                strengths.append(w + step)
                if degrees == 90:
                    stiffness.append(force(w + step, z + 1e-3) / 1e-3)
            print(f"{degrees} degrees: w R^2/k20 {2 * np.round(strengths, 5)}, {2 * limit(strengths):.5f}")
            self.assertAlmostEqual(limit(strengths) / FULL, 1, delta=1e-3)
            if stiffness:
                print(f"    dN/dz {np.round(stiffness, 4)}, {limit(stiffness):.4f}")
                self.assertLess(abs(limit(stiffness)), 0.1 * stiffness[0])

    def test_partly_wrapped_at_tension(self):
        w, tension, z, forces, energies, curvatures = 2.6, 0.2, 0.6, [], [], []
        for range_ in RANGES:
            found = self.on_particle(w, z, range_, tension)
            forces.append(found["potential_force"]), energies.append(found["free_energy"])
            beyond = lambda r, down: np.hypot(r, down + z) - 1 - 13 * range_  # noqa: B023, E731
            curvatures.append(self.free_part(
                Free(tension, force=forces[-1]), True, beyond,
                lambda r, down, psi: psi - math.atan2(r, -down - z)))  # fmt: skip
        force, energy = wrapped(w, tension, z, (1.2, -0.7))
        print(f"N {limit(forces):.5f}, {force:.5f}; F {limit(energies):.5f}, {energy:.5f}")
        print(f"contact curvature {np.round(curvatures, 5)}, {limit(curvatures):.5f}, {1 - math.sqrt(2 * w):.5f}")
        self.assertAlmostEqual(limit(forces), force, delta=1e-3)
        self.assertAlmostEqual(limit(energies), energy, delta=1e-2)
        self.assertAlmostEqual(limit(curvatures), 1 - math.sqrt(2 * w), delta=1e-3)

    def test_a_vesicle_on_a_wall(self):
        w, curvatures = 3.0, []
        for range_ in RANGES:
            wall = -0.85 - range_
            found = self.found(
                f'kind = "plane"\nz = {wall!r}', w, range_, 'kind = "ellipsoid"\na = 1.0\nb = 1.0\nc = 0.75',
                "[equilibrium]\narea = 12.566370614359172\nreduced_volume = 0.85")  # fmt: skip
            curvatures.append(self.free_part(
                Free(found["tension"], found["pressure"]), False, lambda r, z: z - wall - 14 * range_,  # noqa: B023
                lambda r, z, psi: psi))  # fmt: skip
        print(f"on a wall {np.round(curvatures, 5)}, {limit(curvatures):.5f}, {math.sqrt(2 * w):.5f}")
        self.assertAlmostEqual(limit(curvatures), math.sqrt(2 * w), delta=1e-3 * math.sqrt(2 * w))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
