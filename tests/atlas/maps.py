"""The maps of the atlas: for each point of two axes, and each variant, a case and what is true of it."""

from dataclasses import dataclass

import numpy as np
from judging import ExactTruth, Judgement, judged_run
from lattice import Axis
from scipy.integrate import solve_ivp

FAR = 0.05  # of the symbol at the start


@dataclass
class Map:
    title: str
    x: Axis
    y: Axis
    variants: tuple
    judge: object  # (box, variant, x, y) -> Judgement
    across: int = 8
    levels: int = 2


def tube(amplitude, length, energy, end, accuracy=1e-4, **tables):
    shape = {"kind": "tube", "radius": 1.0, "length": float(length)}
    if amplitude:
        shape["mode"] = [{"amplitude": float(amplitude), "n": 1}]
    case = {"tier": "axisym", "energy": energy, "shape": shape, "accuracy": {"energy": accuracy}}
    return case | {"time": {"end": float(end), "output": [end / 100, end / 10, end / 3]}} | tables


# ---- profiles: how they are parametrised, how many elements, which tolerance

PARAMETRISATIONS = ("graph", "even", "material")
PEARLING = {"k20": 0.2, "H0": -1.0, "k42": 0.002}


def with_discretisation(case, **keys):
    return case | {"discretisation": keys}


def parametrisation(box, variant, amplitude, length):
    """Chosen resolution: the keys beside `parametrisation` stay out of the case, so a failure counts."""
    case = with_discretisation(tube(amplitude, length, PEARLING, 0.3), parametrisation=variant)
    return judged_run(box, case)


def neck(box, variant, radius, elements):
    case = tube(1 - radius, 2.0, PEARLING, 0.3, accuracy=1e-2)
    return judged_run(box, with_discretisation(case, parametrisation=variant, elements=elements))


def tolerance(box, variant, time_tolerance, elements):
    case = tube(0.25, 2.0, {"k20": 0.2, "H0": -2.0, "k42": 0.06}, 0.2, accuracy=1e-1)
    return judged_run(box, with_discretisation(case, parametrisation=variant, elements=elements, time_tolerance=time_tolerance))


# ---- vesicles at rest


def vesicle(box, family, reduced_volume, H0):
    """Truth: the same search with a thousandth of the accuracy; another branch is another energy."""
    case = {"tier": "axisym", "energy": {"k20": 1.0, "H0": H0}, "equilibrium": {"held": "area-and-volume", "family": family}}
    case["shape"] = {"kind": "sphere", "radius": 1.0}
    case["equilibrium"] |= {"area": 12.566370614359172, "reduced_volume": reduced_volume}
    case["accuracy"] = {"energy": 1e-5}
    return equilibrium_judgement(box, case)


def equilibrium_judgement(box, case):
    first, finer = (rest(box, case, accuracy) for accuracy in (case["accuracy"]["energy"], 1e-8))
    if not first.finished or first.warned:
        return Judgement("told", first.stop)
    if not finer.finished:
        return Judgement("undecided", first.stop)
    error = first.apart(finer, first.energy)
    asked = case["accuracy"]["energy"]
    return Judgement("silent" if error > min(2 * first.stated, asked) + finer.stated else "right", first.stop, error, first.stated)


def rest(box, case, accuracy):
    from scenes import Run

    return Run(box, case | {"accuracy": {"energy": accuracy}}, command="equilibrium", quantity="energy")


# ---- straight tubes and spheres: their motion is an ordinary differential equation, their symbol a formula


def density(terms, H0):
    """f, f_H, f_HH, f_HK, f_KK, f_K of (H, K) for terms (modulus, power of H - H0, power of K)."""

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


def straight_tube(box, terms, H0, end, tension=0.0, pressure=0.0, radius=1.0, r_min=0.02):
    """Gradient flow of a straight tube: dR/dt = b with H = -1/R, K = 0 (theory.md, section 2), under tension and pressure
    b - tension/R + pressure. It ends where the symbol (2.14) with x = -1/R has fallen to a thousandth, or the radius to r_min.
    Where the symbol falls far, but not so far, short waves may grow from rounding: no stop by the numerics is wrong."""
    f = density(terms, H0)

    def rate(_, R):
        H = -1 / R[0]
        b = -(H * H * f(H, 0, 1) - H * f(H, 0))  # (2.7) on a tube: |B|^2 = H^2, K = 0
        return [b - tension / R[0] + pressure]

    def symbol_of(R):
        x = -1 / R
        return f(x, 0, 2) + 2 * f(x, 0, 1, 1) * x + f(x, 0, 0, 2) * x * x

    def symbol(_, R):
        return symbol_of(R[0]) - 1e-3 * symbol_of(radius)

    def thin(_, R):
        return R[0] - r_min

    def wide(_, R):
        return 1e3 - R[0]

    for event in (symbol, thin, wide):
        event.terminal = True
    times = [end / 100, end / 10, end / 3, end]
    free = lambda R: 2 * np.pi * R * 2.0 * (f(-1 / R, 0) + tension) - pressure * np.pi * R * R * 2.0  # noqa: E731
    stop, falls_far = None, False
    if symbol_of(radius) <= 0:
        times, energies, stop = [], {}, ("ill-posed", 0.0)
    else:
        path = solve_ivp(rate, (0, end), [radius], method="DOP853", rtol=1e-11, atol=1e-13, events=(symbol, thin, wide), dense_output=True)
        reached = path.t[-1]
        energies = {0.0: free(radius)} | {t: free(path.sol(t)[0]) for t in times if t <= reached}
        falls_far = symbol_of(path.y[0]).min() < FAR * symbol_of(radius)
        for reason, at in zip(("ill-posed", "pinch-off", "too wide"), path.t_events):
            if at.size:
                stop = (reason, float(at[0]))
    case = tube(0, 2.0, energy_table(terms, H0), end, accuracy=1e-5)
    case["shape"]["radius"] = radius
    case["accuracy"]["r_min"] = r_min
    if tension or pressure:
        case["model"] = {"kind": "gradient-flow"} | ({"tension": tension} if tension else {}) | ({"pressure": pressure} if pressure else {})
    return judged_run(box, case, ExactTruth(energies, False if falls_far and not stop else stop, 1e-9))


def wellposed_k40(box, _, k40, H0):
    return straight_tube(box, [(0.2, 2, 0), (k40, 4, 0)], H0, 2.0)


def wellposed_k42(box, _, k42, radius):
    return straight_tube(box, [(0.2, 2, 0), (k42, 0, 2)], -2.0, 2.0, radius=radius)


def wellposed_k41(box, _, modulus, H0):
    """(H - H0)^2 K: indefinite, but well-posed where the symbol says so."""
    return straight_tube(box, [(0.2, 2, 0), (modulus, 2, 1), (0.02, 0, 2)], H0, 2.0)


def wellposed_k30(box, _, modulus, H0):
    return straight_tube(box, [(0.2, 2, 0), (modulus, 3, 0)], H0, 2.0)


def loads(box, _, tension, pressure):
    """Beyond their limits no tube is at rest: it closes, or swells without end."""
    return straight_tube(box, [(0.2, 2, 0)], -1.0, 5.0, tension=tension, pressure=pressure)


MAPS = {
    "parametrisation": Map("Tubes by parametrisation", Axis("amplitude", 0.02, 0.96), Axis("length", 0.5, 16, log=True), PARAMETRISATIONS, parametrisation),
    "neck": Map("Necks by elements", Axis("neck radius", 0.005, 0.8, log=True), Axis("elements", 6, 400, log=True, whole=True), PARAMETRISATIONS, neck),
    "tolerance": Map("Time tolerance by elements", Axis("time tolerance", 1e-11, 1e-1, log=True), Axis("elements", 4, 200, log=True, whole=True), PARAMETRISATIONS, tolerance),
    "vesicles": Map("Vesicles at rest", Axis("reduced volume", 0.2, 0.99), Axis("H0", -6.0, 4.0), ("prolate", "oblate", "stomatocyte"), vesicle),
    "k40": Map("Negative k40", Axis("k40", -0.1, 0.1), Axis("H0", -4.0, 2.0), ("",), wellposed_k40, across=12),
    "k42": Map("Negative k42", Axis("k42", -0.5, 0.1), Axis("radius", 0.2, 2.0, log=True), ("",), wellposed_k42, across=12),
    "k41": Map("The term (H - H0)^2 K", Axis("modulus", -0.5, 0.5), Axis("H0", -4.0, 2.0), ("",), wellposed_k41, across=12),
    "k30": Map("The term (H - H0)^3", Axis("modulus", -0.2, 0.2), Axis("H0", -4.0, 2.0), ("",), wellposed_k30, across=12),
    "loads": Map("Tubes under loads", Axis("tension", -1.0, 2.0), Axis("pressure", -1.0, 1.0), ("",), loads, across=12),
}
