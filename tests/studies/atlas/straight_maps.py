"""Maps of straight tubes in gradient flow: their motion is an ordinary differential equation, what waves along them do and
where their equations end are formulas. Both tiers."""

import numpy as np
from judging import ExactTruth, judged_run
from lattice import Axis, Map
from scipy.integrate import solve_ivp

SECONDS = 120  # of a processor, for a run; mostly a second or two, in tier axisym a twentieth of one
KNOWN = 1e-10  # how well the equation is solved
LENGTH = 2.0
VISIBLE = 18.0  # a wave that grows by exp of this comes from rounding to where it is seen
MESH_VISIBLE = 5.0  # the same from the errors of a mesh of a few triangles
WAVES = np.arange(1, 41) * 2 * np.pi / LENGTH  # as short as meshes of straight tubes resolve


def density(terms, H0):
    """f and its derivatives at (H, K), for terms (modulus, power of H - H0, power of K)."""

    def f(H, K, i=0, j=0):
        """The derivative d^i/dH^i d^j/dK^j."""
        total = 0.0
        for modulus, a, b in terms:
            if a < i or b < j:
                continue
            factor = modulus
            for k in range(i):
                factor *= a - k
            for k in range(j):
                factor *= b - k
            total += factor * (H - H0) ** (a - i) * K ** (b - j)
        return total

    return f


def energy_table(terms, H0):
    """The energy as a table of a case."""
    short = {(2, 0): "k20", (4, 0): "k40", (0, 2): "k42"}
    table = {"H0": H0} | {short[a, b]: k for k, a, b in terms if (a, b) in short}
    further = [{"modulus": k, "H": a, "K": b} for k, a, b in terms if (a, b) not in short]
    return table | ({"term": further} if further else {})


class Tube:
    """A straight tube: radius R, H = -1/R, K = 0."""

    def __init__(self, terms, H0, tension, pressure):
        self.f, self.tension, self.pressure = density(terms, H0), tension, pressure

    def rate(self, R):
        """dR/dt: the force (theory.md (2.8)) with |B|^2 = H^2, and the loads."""
        H = -1 / R
        return -(H * H * self.f(H, 0, 1) - H * self.f(H, 0)) - self.tension / R + self.pressure

    def symbol(self, R):
        """(2.14) with x = -1/R."""
        x, f = -1 / R, self.f
        return f(x, 0, 2) + 2 * f(x, 0, 1, 1) * x + f(x, 0, 0, 2) * x * x

    def free_energy(self, R):
        return 2 * np.pi * R * LENGTH * (self.f(-1 / R, 0) + self.tension) - self.pressure * np.pi * R * R * LENGTH

    def growth(self, R, q):
        """d(log a)/dt of r = R + a cos(q z): -4 e/R, F = F(R) + 2 pi length e a^2, from H, K and dS to order a^2."""
        f, H = self.f, -1 / R
        h, k = 1 / R**2 - q**2, q**2 / R  # H and K to first order, by a cos(q z)
        mean = f(H, 0, 1) * (-1 / R**3 + q**2 / (2 * R)) - f(H, 0, 0, 1) * q**2 / R**2
        square = f(H, 0, 2) * h * h / 2 + f(H, 0, 1, 1) * h * k + f(H, 0, 0, 2) * k * k / 2
        shift = f(H, 0, 1) * h + f(H, 0, 0, 1) * k
        e = R * (mean + square) / 2 + shift / 2 + (f(H, 0) + self.tension) * R * q**2 / 4 - self.pressure / 4
        return -4 * e / R

    def path(self, radius, end, r_min):
        """The radius in time, and why it ends early: (reason, time) or None."""
        events = {
            "ill-posed": lambda _, R: self.symbol(R[0]) - 1e-3 * self.symbol(radius),
            "pinch-off": lambda _, R: R[0] - r_min,
            "too wide": lambda _, R: 1e3 - R[0],
        }
        for event in events.values():
            event.terminal = True
        path = solve_ivp(lambda _, R: [self.rate(R[0])], (0, end), [radius], method="DOP853", rtol=1e-11, atol=1e-13,
                         events=tuple(events.values()), dense_output=True)  # fmt: skip
        stops = [(reason, float(at[0])) for reason, at in zip(events, path.t_events) if at.size]
        return path, stops[0] if stops else None

    def waves_grow(self, path, visible):
        """Whether what the start has of waves grows until it is seen: a stop by the numerics is then no fault."""
        times = np.linspace(0, path.t[-1], 200)
        rates = np.maximum([self.growth(R, WAVES) for R in path.sol(times)[0]], 0)
        return np.max(np.trapz(rates, times, axis=0)) > visible


def straight_tube(box, terms, H0, end, tension=0.0, pressure=0.0, radius=1.0, surface=False):
    visible = MESH_VISIBLE if surface else VISIBLE
    r_min, times = 0.02, [end / 100, end / 10, end / 3, end]
    tube = Tube(terms, H0, tension, pressure)
    if tube.symbol(radius) <= 0:
        truth = ExactTruth({}, ("ill-posed", 0.0), KNOWN)
    else:
        path, stop = tube.path(radius, end, r_min)
        energies = {t: tube.free_energy(path.sol(t)[0]) for t in [0.0, *times] if t <= path.t[-1]}
        truth = ExactTruth(energies, False if tube.waves_grow(path, visible) and not stop else stop, KNOWN)
    loads = {name: load for name, load in (("tension", tension), ("pressure", pressure)) if load}
    case = {"tier": "axisym", "energy": energy_table(terms, H0), "model": {"kind": "gradient-flow"} | loads}
    case["shape"] = {"kind": "tube", "radius": radius, "length": LENGTH}
    case["accuracy"] = {"energy": 1e-5, "r_min": r_min}
    case["time"] = {"end": float(end), "output": times[:-1]}
    if surface:
        case["tier"], case["accuracy"]["energy"] = "surface3d", 2e-2
        case["discretisation"] = {"elements": 60, "order": 3}
    return judged_run(box, case, truth, limit=SECONDS)


def k40(box, _, modulus, H0):
    return straight_tube(box, [(0.2, 2, 0), (modulus, 4, 0)], H0, 2.0)


def k42(box, _, modulus, radius):
    return straight_tube(box, [(0.2, 2, 0), (modulus, 0, 2)], -2.0, 2.0, radius=radius)


def k41(box, _, modulus, H0):
    """(H - H0)^2 K: indefinite, but well-posed where the symbol is positive."""
    return straight_tube(box, [(0.2, 2, 0), (modulus, 2, 1), (0.02, 0, 2)], H0, 2.0)


def k30(box, _, modulus, H0):
    return straight_tube(box, [(0.2, 2, 0), (modulus, 3, 0)], H0, 2.0)


def k60(box, _, modulus, H0):
    return straight_tube(box, [(0.2, 2, 0), (modulus, 6, 0)], H0, 1.0)


def k22(box, _, modulus, radius):
    """(H - H0)^2 K^2 vanishes on tubes: their waves alone feel it."""
    return straight_tube(box, [(0.2, 2, 0), (modulus, 2, 2)], -2.0, 2.0, radius=radius)


def tension(box, _, value, radius):
    """Tubes get thin under tension, or swell where it is negative."""
    return straight_tube(box, [(0.2, 2, 0)], -0.5, 3.0, tension=value, radius=radius)


def pressure(box, _, value, radius):
    return straight_tube(box, [(0.2, 2, 0), (0.002, 4, 0)], 0.0, 1.0, pressure=value, radius=radius)


def loads(box, _, tension, pressure):
    """Beyond their limits no tube is at rest: it closes, or swells without end."""
    return straight_tube(box, [(0.2, 2, 0)], -1.0, 5.0, tension=tension, pressure=pressure)


def k42_surface(box, _, modulus, radius):
    return straight_tube(box, [(0.2, 2, 0), (modulus, 0, 2)], -2.0, 0.2, radius=radius, surface=True)


def loads_surface(box, _, tension, pressure):
    return straight_tube(box, [(0.2, 2, 0)], -1.0, 2.0, tension=tension, pressure=pressure, surface=True)


TENSION, PRESSURE = Axis("tension", -1.0, 2.0), Axis("pressure", -1.0, 1.0)
NEGATIVE_K42, RADIUS = Axis("k42", -0.5, 0.1), Axis("radius", 0.2, 2.0, log=True)
MAPS = {
    "k40": Map("Negative k40", Axis("k40", -0.1, 0.1), Axis("H0", -4.0, 2.0), k40, across=12, levels=3),
    "k42": Map("Negative k42", NEGATIVE_K42, RADIUS, k42, across=12, levels=3),
    "k41": Map("The term (H - H0)^2 K", Axis("modulus", -0.5, 0.5), Axis("H0", -4.0, 2.0), k41, across=12, levels=3),
    "k30": Map("The term (H - H0)^3", Axis("modulus", -0.2, 0.2), Axis("H0", -4.0, 2.0), k30, across=12, levels=3),
    "k60": Map("The term (H - H0)^6", Axis("modulus", -0.02, 0.02), Axis("H0", -4.0, 2.0), k60, across=12),
    "k22": Map("The term (H - H0)^2 K^2", Axis("modulus", -0.5, 0.5), RADIUS, k22, across=12, levels=3),
    "tension": Map("Tubes under tension", Axis("tension", -0.5, 4.0), RADIUS, tension, across=12),
    "pressure": Map("Tubes under pressure", Axis("pressure", -4.0, 4.0), RADIUS, pressure, across=12),
    "loads": Map("Tubes under loads", TENSION, PRESSURE, loads, across=12, levels=3),
    "k42_surface": Map("Negative k42, 3D", NEGATIVE_K42, RADIUS, k42_surface, across=6, levels=0, tier="surface3d"),
    "loads_surface": Map("Tubes under loads, 3D", TENSION, PRESSURE, loads_surface, across=6, levels=0, tier="surface3d"),
}
