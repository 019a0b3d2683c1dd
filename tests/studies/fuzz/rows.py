"""What holds of every result of a motion, whatever became of the run: its rows are those of a flow that can only lose
energy, and the first one is the given shape.

The energy of the given shape is computed here, by quadrature in NumPy, from the formulas of docs/case_files.md alone."""

import math

import h5py
import numpy as np
from sandbox import Finding

POINTS = 400  # along a meridian; the integrals of smooth shapes are exact to rounding well before
AROUND = 48
KNOWN = 1e-8  # of an integral: less is no quadrature
ROUNDING = 1e-9  # of E_ref: of sums, and of numbers in the case


class Outcome:
    """A result: its attributes and its series."""

    def __init__(self, path):
        with h5py.File(path) as file:
            self.about = {key: value for key, value in file["about"].attrs.items()}
            self.series = {name: data[:] for name, data in file["series"].items()}
        self.stop, self.E_ref = self.about.get("stop", "killed"), self.about.get("E_ref")
        self.error = self.about.get("estimated_error", 1.0)

    def drift(self, name):
        values = self.series[name]
        return float(np.abs(values / values[0] - 1).max()) if len(values) else 0.0


def judge(case, path):
    """The rows of the result of a case (a dictionary), each against those before it and the first against the shape; how the run ended."""
    out = Outcome(path)
    if not out.E_ref:  # killed before the first row, or numbers too large for a scale
        return out.stop
    times = out.series["time"]
    for name, values in out.series.items():
        if not np.isfinite(values).all():
            raise Finding("nan", f"{name} has a number that is none")
    if len(times) == 0:
        if out.stop in ("finished", "stationary"):
            raise Finding("no-rows", out.stop)
        return out.stop
    if (np.diff(times) < 0).any() or out.series["r_min"].min() < 0 or out.series["area"].min() <= 0:
        raise Finding("impossible", f"times that go back, or a radius or an area below 0; {out.about['stop_message']}")
    asked = case.get("accuracy", {}).get("energy", 1e-4 if case["tier"] == "axisym" else 1e-3)
    allowed = max(asked, out.error) + ROUNDING
    for tier in np.unique(out.series.get("tier", np.ones(1))):  # noise is added between the tiers
        rows = out.series["tier"] == tier if "tier" in out.series else slice(None)
        no_energy_from_nowhere(out, rows, allowed)
    exact = given_energy(case)
    if exact is not None and times[0] == 0:
        first = out.series["energy"][0] - out.series.get("potential_energy", [0])[0]  # of bending
        off = abs(first - exact) / out.E_ref
        # As long as the error is unknown, it is the asked one that a row has to have, if the mesh is not the case's own.
        if off > (2 * allowed if out.error < 1 or "elements" in case.get("discretisation", {}) else asked + ROUNDING):
            raise Finding("first-row", f"energy {first:.9g} at t = 0, {exact:.9g} of the given shape: {off:.2g} of E_ref, {asked} asked, {out.error:.2g} stated")
    return out.stop


def no_energy_from_nowhere(out, rows, allowed):
    s = {name: values[rows] for name, values in out.series.items()}
    total = s.get("free_energy", s["energy"]) + s.get("kinetic_energy", 0) - s.get("work", 0)
    rise = (total - np.minimum.accumulate(total)) / out.E_ref
    if rise.max() > allowed:
        row = int(rise.argmax())
        raise Finding("rise", f"at t = {s['time'][row]:.6g} free energy less work is {rise[row]:.3g} of E_ref above its lowest; {out.error:.2g} stated; {out.stop}: {out.about['stop_message']}")


# ------------------------------------------------------------------------------------------------ the given shape


def given_energy(case):
    """The bending energy of the shape of a case, to KNOWN; None for a shape or an energy without a closed form here."""
    shape, energy = case["shape"], case["energy"]
    if isinstance(energy.get("H0", 0), str) or any("formula" in term for term in energy.get("term", [])) or "noise" in shape:
        return None
    if shape["kind"] == "capsule":  # a cylinder and two half spheres
        R, length = shape["radius"], shape["length"]
        return float(2 * math.pi * R * length * density(energy, -1 / R, 0) + 4 * math.pi * R * R * density(energy, -2 / R, 1 / R**2))
    found = [integral(shape, energy, n) for n in (POINTS // 2, POINTS)]
    if None in found or not abs(found[0] - found[1]) < KNOWN * abs(found[1]):
        return None
    return found[1]


def density(energy, H, K):
    powers = {"k20": (2, 0), "k40": (4, 0), "k42": (0, 2)}
    terms = [(energy.get(name, 0), *power) for name, power in powers.items()]
    terms += [(term["modulus"], term.get("H", 0), term.get("K", 0)) for term in energy.get("term", [])]
    return sum(modulus * (H - energy.get("H0", 0)) ** i * K**j for modulus, i, j in terms)


def harmonic(l, m, u, v):
    """Re Y_l^m, orthonormal, without the sign of Condon and Shortley."""
    scale = math.sqrt((2 * l + 1) / (4 * math.pi) * math.factorial(l - m) / math.factorial(l + m))
    return scale * np.sin(u) ** m * np.polynomial.legendre.Legendre.basis(l).deriv(m)(np.cos(u)) * np.cos(m * v)


def surface(shape, u, v):
    """Points over (u, v) in [0, 2 pi), and how much of z is linear in u. X_u x X_v points outwards; closed cells are covered twice, for
    u > pi inside out."""
    match shape["kind"]:
        case "torus":
            r, z, lifted = shape["radius"] + shape["tube_radius"] * np.cos(u), -shape["tube_radius"] * np.sin(u), 0
        case "tube":
            lifted, z = -shape["length"] / (2 * math.pi), 0  # upside down
            r = shape["radius"] + sum(a["amplitude"] * np.cos(a["n"] * u + a.get("m", 0) * v + a.get("phase", 0)) for a in shape.get("mode", []))
        case "sphere":
            radius = shape["radius"] * (1 + sum(a["amplitude"] * harmonic(a["l"], a.get("m", 0), u, v) for a in shape.get("mode", [])))
            r, z, lifted = radius * np.sin(u), radius * np.cos(u), 0
        case "ellipsoid":
            return np.stack(np.broadcast_arrays(shape["a"] * np.sin(u) * np.cos(v), shape["b"] * np.sin(u) * np.sin(v), shape["c"] * np.cos(u))), 0
        case "dumbbell":  # theory.md (7.9)
            r, z, lifted = (0.75 * np.cos(u) ** 2 + 0.25) * np.sin(u), np.cos(u), 0
        case _:
            return None, 0
    return np.stack(np.broadcast_arrays(r * np.cos(v), r * np.sin(v), z + 0 * v)), lifted


def integral(shape, energy, n):
    """By derivatives of Fourier series, and the trapezoidal rule; from pole to pole by Fejer's."""
    u, v = 2 * math.pi * (np.arange(2 * n) + 0.5) / (2 * n), 2 * math.pi * np.arange(AROUND) / AROUND
    X, lifted = surface(shape, u[:, None], v[None, :])
    if X is None:
        return None

    def derived(X, axis):
        waves = np.fft.fftfreq(X.shape[axis], 1 / X.shape[axis])
        return np.fft.ifft(1j * waves.reshape(-1, *[1] * (2 - axis)) * np.fft.fft(X, axis=axis), axis=axis).real

    X_u, X_v = derived(X, 1), derived(X, 2)
    X_uu, X_uv, X_vv = derived(X_u, 1), derived(X_u, 2), derived(X_v, 2)
    X_u[2] += lifted
    across = np.cross(X_u, X_v, axis=0)
    size = np.sqrt((across**2).sum(0))
    normal = across / size
    E, F, G = (X_u**2).sum(0), (X_u * X_v).sum(0), (X_v**2).sum(0)
    L, M, N = ((D * normal).sum(0) for D in (X_uu, X_uv, X_vv))
    H, K = (E * N - 2 * F * M + G * L) / size**2, (L * N - M * M) / size**2
    parts = density(energy, H, K) * size
    if shape["kind"] in ("torus", "tube"):
        return float(parts.mean() * 4 * math.pi**2)
    j = np.arange(1, n // 2 + 1)
    weights = (2 / n) * (1 - 2 * (np.cos(2 * np.outer(u[:n], j)) / (4 * j**2 - 1)).sum(1))  # of an integral over cos u
    return float((weights[:, None] * (parts / np.abs(np.sin(u))[:, None])[:n]).sum() * 2 * math.pi / AROUND)
