#!/usr/bin/python3
"""The line on which vesicles with area-difference elasticity lose their mirror symmetry, against boundary-value problems.

budding_study.py TUBULE. With k20 = 1/2 (kappa = 1), H0 = 0, area 4 pi and a reduced volume v, the prolate shapes of lowest
energy become pears where an odd displacement costs no energy. There the shape equations of a half, in arc length s, and
their linearisation about it,

    psi' = u,  r' = cos psi,  r u' = -cos psi (u - sin psi/r) + (lambda r^2 cos psi/2 + gamma sin psi)/(2 k),
    gamma' = k ((u - c)^2 - sin^2 psi/r^2) + sigma + lambda r sin psi,

have a solution that is even, and one of the linear ones that is odd; c = -H0_eff is found with it (solve_bvp of SciPy). As
the area-difference term adds nothing for odd displacements, theory.md (2.21), that is so at M0 = M + 2 k (H0_eff - H0)/alpha,
where Tubule finds a bifurcation along a branch in M0.
"""

import sys
import unittest
from pathlib import Path

import h5py
import numpy as np
from scipy.integrate import simpson, solve_bvp, solve_ivp
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "command"))
from program import ProgramTest  # noqa: E402

K = 0.5
ALPHA = 2.0
FROM_POLE = 2e-3  # where the series at the pole ends
TINY = 1e-30  # complex step


def slopes(psi, u, r, gamma, c, sigma, volume):
    """Right-hand sides of the shape equations in arc length."""
    sin, cos = np.sin(psi), np.cos(psi)
    around = sin / r
    return np.array(
        [
            u,
            (-cos * (u - around) + (volume * r * r * cos / 2 + gamma * sin) / (2 * K)) / r,
            cos,
            K * ((u - c) ** 2 - around**2) + sigma + volume * r * sin,
        ]
    )


def at_pole(u0, c, sigma, volume, s=FROM_POLE):
    """The regular solution with the curvature u0 at the pole, at a small arc length."""
    g = K * ((u0 - c) ** 2 - u0**2) + sigma
    a = 3 / (16 * K) * (volume / 2 + g * u0)
    return np.array([u0 * s + a * s**3 / 3, u0 + a * s**2, s - u0**2 * s**3 / 6, g * s])


def half_of(v, c, guess, find_c):
    """The half of a mirror-symmetric shape; with find_c also an odd displacement, and c."""
    area, volume = 4 * np.pi, v * 4 * np.pi / 3

    def fun(t, y, p):
        curvature = p[4] if find_c else c
        rows = list(slopes(*y[:4], curvature, p[1], p[2])) + [2 * np.pi * y[2], np.pi * y[2] ** 2 * np.sin(y[0])]
        if find_c:
            rows += list(slopes(*(y[:4] + 1j * TINY * y[6:10]), curvature, p[1], p[2]).imag / TINY)
        return (p[3] - FROM_POLE) * np.array(rows)

    def bc(a, b, p):
        curvature = p[4] if find_c else c
        rows = list(a[:4] - at_pole(p[0], curvature, p[1], p[2]))
        rows += [a[4] - np.pi * FROM_POLE**2, a[5] - np.pi * p[0] * FROM_POLE**4 / 4]
        rows += [b[0] - np.pi / 2, b[3], b[4] - area / 2, b[5] - volume / 2]
        if find_c:
            rows += list(a[6:10] - at_pole(p[0] + 1j * TINY, curvature, p[1], p[2]).imag / TINY) + [b[8]]
        return np.array(rows)

    found = solve_bvp(fun, bc, guess[0], guess[1], p=guess[2], tol=1e-9, max_nodes=20000)
    if not found.success:
        raise RuntimeError(f"v = {v}, c = {c}: {found.message}")
    return found


def spheroid(v):
    """A first guess."""
    angle = np.linspace(0, np.pi / 2, 2001)

    def profile(c):
        r, z = np.sin(angle), -c * np.cos(angle)
        ds = np.hypot(np.diff(r), np.diff(z))
        return r, z, np.concatenate([[0], np.cumsum(ds)])

    def area(c):
        r, _, s = profile(c)
        return 2 * np.trapz(2 * np.pi * r, s)

    c = brentq(lambda c: 6 * np.sqrt(np.pi) * 4 * np.pi / 3 * c / area(c) ** 1.5 - v, 1.001, 6)
    r, z, s = (x * np.sqrt(4 * np.pi / area(c)) for x in profile(c))
    psi = np.arctan2(np.gradient(z, angle), np.gradient(r, angle))
    t = np.linspace(0, 1, 201)
    sums = [np.concatenate([[0], np.cumsum((f[1:] + f[:-1]) / 2 * np.diff(s))])
            for f in (2 * np.pi * r, np.pi * r**2 * np.sin(psi))]  # fmt: skip
    at = FROM_POLE + (s[-1] - FROM_POLE) * t
    values = [psi, np.gradient(psi, s), r, 0 * s, *sums]
    return t, np.array([np.interp(at, s, y) for y in values]), np.array([values[1][1], 0, 0, s[-1]])


def odd_displacement(half, c):
    """That which begins with one at the pole, and is odd where its r vanishes at the end."""
    u0, sigma, volume, length = half.p
    start = at_pole(u0 + 1j * TINY, c, sigma, volume).imag / TINY

    def fun(s, d):
        y = half.sol((s - FROM_POLE) / (length - FROM_POLE))[:4]
        return slopes(*(y + 1j * TINY * d), c, sigma, volume).imag / TINY

    return solve_ivp(fun, (FROM_POLE, length), start, rtol=1e-9, atol=1e-11, method="DOP853", dense_output=True)


def where_pears_begin(v):
    """c and M there."""
    guess, before = spheroid(v), None
    for c in np.arange(0, 8, 0.2):
        half = half_of(v, c, guess, False)
        guess = half.x, half.y, half.p
        odd = odd_displacement(half, c)
        if before is not None and odd.y[2, -1] * before < 0:
            break
        before = odd.y[2, -1]
    t = np.linspace(0, 1, 401)
    displaced = odd.sol(FROM_POLE + (half.p[3] - FROM_POLE) * t)
    half = half_of(v, c, (t, np.vstack([half.sol(t), displaced]), np.append(half.p, c)), True)
    t = np.linspace(0, 1, 20001)
    psi, u, r = half.sol(t)[:3]
    curvature = simpson(2 * np.pi * (r * u + np.sin(psi)), x=t) * (half.p[3] - FROM_POLE)
    return half.p[4], -2 * (curvature + 2 * np.pi * FROM_POLE**2 * half.p[0])


class Budding(ProgramTest):
    def bifurcation(self, v, start, end):
        """M0 and M where Tubule finds it."""
        path = self.write(
            "branch.toml",
            f"""tier = "axisym"
energy = {{k20 = {K}, alpha = {ALPHA}, M0 = {start}}}
shape = {{kind = "ellipsoid", a = 1.0, b = 1.0, c = 1.5}}
accuracy = {{energy = 1e-9}}
[equilibrium]
area = {4 * np.pi!r}
reduced_volume = {v}
family = "prolate"
branch = {{vary = "energy.M0", to = {end}, step = 1.0}}
""",
        )
        self.tubule("run", path, "--quiet", "--overwrite", "-o", self.result)
        with h5py.File(self.result) as file:
            series = {name: file["series"][name][:] for name in ("parameter", "special", "M")}
        at = np.flatnonzero(series["special"] == 2)
        self.assertGreaterEqual(len(at), 1)
        return series["parameter"][at[0]], series["M"][at[0]]

    def test_line(self):
        for v in (0.78, 0.80, 0.82):
            c, M = where_pears_begin(v)
            M0 = M - 2 * K * c / ALPHA
            found_M0, found_M = self.bifurcation(v, round(M0 + 1.5, 1), round(M0 - 0.6, 1))
            print(f"v = {v}: H0_eff = {-c:.7f}, M = {M:.7f}, M0 = {M0:.7f}; Tubule M0 = {found_M0:.7f}, M = {found_M:.7f}")
            self.assertAlmostEqual(found_M0 / M0, 1, delta=1e-6)
            self.assertAlmostEqual(found_M / M, 1, delta=1e-7)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
