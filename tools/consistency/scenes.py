"""The test cases of docs/consistency.md. A bound is three times what was found, or so, or what is asked of the program: it
is there to notice when the tiers part, not to measure them."""

import math

from measures import SHAPES, at_equilibrium, beginnings, case, changed, initial_shape, motion, rates


class Scene:
    def __init__(self, name, title, words, measure, *arguments, **options):
        self.name, self.title, self.words = name, title, words
        self.measure = lambda program: measure(program, *arguments, **options)
        self.rows, self.cost = [], {}

    def run(self, program):
        """Its rows, and CPU seconds: None for tier 1, and by triangles in 3D."""
        program.cost = {}
        self.rows = self.measure(program)
        self.cost = program.cost

    def complaints(self):
        return [f"{self.title}: {row.quantity} {complaint}" for row in self.rows for complaint in row.complaints()]


SPHEROID = {"kind": "ellipsoid", "a": 0.5, "b": 0.5, "c": 1.0}
CELL = changed(case("capsule_fluid"), shape=None)
WAVY = {"length": 4.0, "mode": [{"amplitude": 0.1, "n": 1}, {"amplitude": 0.05, "n": 2}]}


def spheroid(**changes):
    return changed(CELL, shape=SPHEROID, **changes)


def waves(model, **changes):
    return changed(case(f"tube_waves_{model}"), shape=WAVY, **changes)


def equilibrium_tube(kind, end, square=3.0, **energy):
    """A tube in equilibrium (H0 = -1/R), for small waves; `square`: q^2 R^2 of n = 1."""
    viscous = {"Re": 2.0, "gamma": 0.3} if kind == "stokes" else {}
    return {
        "tier": "axisym",
        "energy": {"k20": 0.5, "H0": -1.0, "k42": 0.05, **energy},
        "model": {"kind": kind, "volume": "free", **viscous},
        "shape": {"kind": "tube", "radius": 1.0, "length": 2 * math.pi / math.sqrt(square)},
        "time": {"end": end},
    }


def within(bound, *quantities):
    return {quantity: bound for quantity in quantities}


THREE = [(1, 0), (1, 1), (0, 2)]
EXTREMES = ("min H", "max H", "min K", "max K")
ENERGIES = ("energy", "energy_20", "energy_42")
INTEGRALS = ("area", "volume", *ENERGIES, "integral_K")
RADII = ("r_min", "r_max")

INITIAL_SHAPES = [
    Scene("tube-shape", "Initial shape: a tube with three waves",
          "`cases/three_modes.toml` at t = 0: k20, k40 and k42, no symmetry. INT K is 0.",
          initial_shape, case("three_modes"), {"integral_K": 0.0},
          within(2e-5, "area", "volume", "energy", "energy_20", "energy_40", "energy_42", "integral_K") | within(3e-2, *EXTREMES)),
    Scene("spheroid-shape", "Initial shape: a spheroid",
          "Half axes 0.5, 0.5, 1; energy of `cases/capsule_fluid.toml`. INT K is 4 pi.",
          initial_shape, spheroid(), {"integral_K": 4 * math.pi}, within(1e-5, *INTEGRALS) | within(1e-2, *EXTREMES)),
    Scene("capsule-shape", "Initial shape: a capsule, whose curvature jumps",
          "`cases/capsule_fluid.toml` at t = 0, graded triangles. All values are closed forms: H is -4 on the caps and -2 on the cylinder, "
          "K 4 and 0.",
          initial_shape, case("capsule_fluid"),
          {"integral_K": 4 * math.pi, "area": 3 * math.pi, "volume": 2 / 3 * math.pi, "energy": 4 * math.pi * 0.365,
           "min H": -4.0, "max H": -2.0, "max K": 4.0},
          within(2e-5, "area", "volume") | within(1e-2, "energy") | within(1e-3, "integral_K") | within(None, "min H", "max H", "max K"),
          accuracy=1e-3, mesh="graded", must_fall=False),
]  # fmt: skip

BEGINNINGS = [
    Scene("tube-begins", "First moments of a tube",
          "Two waves of 0.1 and 0.05 on a tube of radius 1 and length 4 (energy of `cases/tube_waves_overdamped.toml`; Re = 2, gamma = 0.3), "
          "at t = 1e-6, for the fluid 1e-3. Waves: d/dt of their amplitudes; acceleration squared: INT (du/dt)^2.",
          beginnings, waves("overdamped"), ("1", "2"), 1e-6, 1e-3,
          within(0.4, "dissipation") | within(0.02, "wave 1", "wave 2") | within(2e-3, "lambda") | within(0.6, "acceleration squared")),
    Scene("spheroid-begins", "First moments of a spheroid",
          "The spheroid above; Re = 2, gamma = 0.3; at t = 1e-7, for the fluid 3e-4. Waves: Y_2 and Y_4.",
          beginnings, spheroid(), ("2", "4"), 1e-7, 3e-4,
          within(2e-2, "dissipation") | within(2e-3, "wave 2", "wave 4") | within(1e-3, "lambda") | within(0.05, "acceleration squared")),
]  # fmt: skip

RATES = [
    *(Scene(f"rates-{kind}", f"Rates of small waves (n, m), {kind}",
            "A tube in equilibrium, k20 = 0.5, k42 = 0.05, H0 = -1/R, volume free, q^2 R^2 = 3 for n = 1"
            + ("; Re = 2, gamma = 0.3." if kind == "stokes" else "."),
            rates, equilibrium_tube(kind, 0.1), THREE, within(1e-3, *THREE) | within(3e-5, "tier 1"), 0.0015, more)
      for kind, more in (("gradient-flow", [1000]), ("overdamped", []), ("stokes", []))),
    Scene("rates-pearling", "Rate of a growing wave: pearling, gradient flow",
          "The same with k20 = 2.5, k42 = -0.5 and q^2 R^2 = 1.25.",
          rates, equilibrium_tube("gradient-flow", 0.5, 1.25, k20=2.5, k42=-0.5), [(1, 0)], within(1e-3, (1, 0)) | within(3e-5, "tier 1"), 0.01),
    Scene("rates-buckling", "Rate of a growing wave: buckling, overdamped",
          "The same with H0 = -3/R: m = 1 grows, which tier 1 only shows in its spectrum.",
          rates, equilibrium_tube("overdamped", 0.1, H0=-3.0), [(1, 1)], within(1e-3, (1, 1)), 0.0015),
]  # fmt: skip

MOVING_TUBES = [
    Scene("figure", "The figure's tube, gradient flow", "`cases/figure_k42_006.toml`.",
          motion, case("figure_k42_006"), 1e-8, 8e-5,
          within(1e-4, *ENERGIES) | within(1e-3, "dissipated") | within(2e-4, "area", "volume", *RADII, *SHAPES)),
    *(Scene(f"waves-{kind}", f"Two waves on a tube, {name}", f"The initial shape of `cases/surface_tube_waves_{kind}.toml`.",
            motion, waves(kind, time={"end": 0.1, "output": [0.01, 0.03]}), 1e-7, 8e-5,
            within(5e-4, *ENERGIES) | within(1e-3, "dissipated", *RADII, *SHAPES) | within(2e-2, "speed") | within(5e-3, "lambda"))
      for kind, name in (("overdamped", "overdamped"), ("stokes", "Stokes flow"))),
    Scene("waves-fluid", "Two waves on a tube, fluid", "The initial shape of `cases/surface_tube_waves_fluid.toml`.",
          motion, waves("fluid", time={"end": 0.2, "output": [0.05, 0.1]}), 1e-7, 8e-5,
          within(1e-4, *ENERGIES, "kinetic_energy", "dissipated") | within(1e-3, *RADII, *SHAPES)
          | within(2e-2, "speed") | within(5e-3, "lambda")),
    Scene("rotation", "The same tube as a fluid in rotation", "Initially omega = 0.7.",
          motion, waves("fluid", velocity={"initial": "rotation", "omega": 0.7}, time={"end": 0.1, "output": [0.02, 0.05]}), 1e-7, 8e-5,
          within(1e-4, "energy", "kinetic_energy", "dissipated", "angular_momentum_z") | within(1e-3, "shape, Hausdorff")
          | within(2e-3, "speed") | within(5e-3, "lambda")),
]  # fmt: skip

MOVING_CELLS = [
    Scene("spheroid-fluid", "The spheroid as a fluid", "Re = 1.",
          motion, spheroid(time={"end": 0.1, "output": [0.02, 0.05]}), 1e-6, 8e-5,
          within(2e-4, *ENERGIES, "kinetic_energy", "dissipated") | within(2e-3, *SHAPES) | within(0.3, "speed", "lambda")),
    Scene("capsule-fluid", "The capsule as a fluid: initial curvature with jumps", "`cases/capsule_fluid.toml`.",
          motion, case("capsule_fluid", time={"end": 0.05, "output": [0.01, 0.02]}), 5e-3, 8e-5,
          within(1e-2, "energy", "kinetic_energy", "dissipated", *SHAPES), must_fall=False),
    Scene("capsule-equilibrium", "The capsule's equilibrium",
          "The cell l = 2, k42 = 0.06, by Newton's method, compared with overdamped motion in 3D to t = 3. "
          "Its error: how far the same motion in tier 1 is from equilibrium at that time.",
          at_equilibrium, case("equilibrium_capsule", shape={"length": 2.0}, equilibrium={"modes": 0}),
          case("capsule_overdamped", time={"end": 3.0, "output": [], "stationary": None}), within(2e-5, *ENERGIES), 2e-4),
]  # fmt: skip

SCENES = [*INITIAL_SHAPES, *BEGINNINGS, *RATES, *MOVING_TUBES, *MOVING_CELLS]
