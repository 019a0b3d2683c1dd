#!/usr/bin/python3
"""Equilibria under kg INT |grad H|^2 dS: the program against a spectral solver that shares nothing with it.

Tubes r(z) are cosine series of the period, integrated by the trapezoidal rule. Closed cells rho(x), x the cosine of
the polar angle, are series of even Legendre polynomials, integrated at Gauss nodes. Newton's method, with exact first
and second derivatives by SymPy, finds where E + tension A - pressure V is stationary; two resolutions have to agree.
The moduli are those of CASES, each changed at random by up to 4 percent. For tubes with an amplitude kg is found, too:
where the tube with that first coefficient is at rest.

At last the wave on the tube of radius 1 and period 4 with f = -(H + 1)^2 + (H + 1)^4, area held, which begins at kg =
kg_c = 1/q^2, q = pi/2: the limit of (kg - kg_c)/a^2 as its amplitude a, the coefficient of cos q z in r, vanishes.

    gradient_study.py TUBULE [SEED]

Exit status 1 if energies or their terms differ by more than 1e-8 of the sum of the absolute terms.
"""

import functools
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
import sympy
from numpy.polynomial import legendre

NAMES = ("k20", "k40", "k42", "H0", "kg")
TERMS = ("energy_20", "energy_40", "energy_42", "energy_kg")
COLUMNS = ["8.4f"] * 4 + "9.6f 15.10f 15.10f 7.0e 7.0e 7.0e 15.10f 15.10f 7.0e".split()
MODES = 36, 54
TENSION, PRESSURE, KG = -3, -2, -1  # the last three unknowns, after the coefficients

# (k20, k40, k42, H0), kg (with an amplitude, the first guess). Of tubes period, amplitude or None, area and volume over
# those of radius 1 or None where they are free. Of cells the reduced volume and half axes of the initial ellipsoid.
CASES = (
    ("tube, area held", (-0.83, 1.27, 0.0, -0.91), 0.47, (4.3, 0.12, 1.0, None)),
    ("tube, volume held", (0.62, 0.15, -0.91, -0.7), 0.25, (3.3, 0.08, None, 1.0)),
    ("tube, both held", (0.61, 0.0, 0.23, -0.4), 0.17, (5.0, None, 1.02, 0.93)),
    ("prolate cell", (0.47, 0.08, 0.19, -1.7), 0.11, (0.86, 0.8, 1.4)),
    ("oblate cell", (-0.38, 0.21, 0.0, -1.4), 0.1, (0.83, 1.2, 0.7)),
)


@functools.lru_cache
def integrands(kind):
    """Four terms of the energy, area, volume; first and second derivatives of E + tension A - pressure V."""
    x, q, q1, q2, q3, tension, pressure, kg = jets = sympy.symbols("x q q1 q2 q3 tension pressure kg")
    k20, k40, k42, H0 = moduli = sympy.symbols("k20 k40 k42 H0")
    if kind == "tube":  # q = r, x = z
        sine, g = 1, sympy.sqrt(1 + q1**2)
        along, around = q2 / g**3, -1 / (q * g)
        area, volume = 2 * sympy.pi * q * g, sympy.pi * q**2
    else:  # q = rho; derivatives with respect to the polar angle t are -sin t d/dx
        sine = sympy.sqrt(1 - x**2)
        g = sympy.sqrt(q**2 + sine**2 * q1**2)
        along = -(q**2 + 2 * sine**2 * q1**2 - q * (sine**2 * q2 - x * q1)) / g**3
        around = -(q + x * q1) / (g * q)
        area, volume = 2 * sympy.pi * q * g, 2 * sympy.pi / 3 * q**3
    H, K = along + around, along * around
    slope = sine / g * (H.diff(x) + H.diff(q) * q1 + H.diff(q1) * q2 + H.diff(q2) * q3)
    terms = [area * term for term in (k20 * (H - H0) ** 2, k40 * (H - H0) ** 4, k42 * K**2, kg * slope**2)]
    first = [(sum(terms) + tension * area - pressure * volume).diff(variable) for variable in jets[1:]]
    second = [row.diff(variable) for i, row in enumerate(first) for variable in jets[1 : i + 2]]
    return sympy.lambdify((*jets, *moduli), [*terms, area, volume, *first, *second], cse=True, modules="numpy")


class Space:
    """Shapes with `modes` coefficients. The unknowns y: these, tension, pressure, kg."""

    def __init__(self, kind, modes, length=0.0):
        if kind == "tube":
            self.weights = np.full(4 * modes, length / (4 * modes))
            self.x = self.weights[0] * np.arange(4 * modes)
            k = 2 * np.pi / length * np.arange(modes)
            cos, sin = (function(np.outer(self.x, k)) for function in (np.cos, np.sin))
            self.basis = [cos, -k * sin, -(k**2) * cos, k**3 * sin]
        else:
            self.x, self.weights = legendre.leggauss(4 * modes)
            even = np.eye(2 * modes)[:, ::2]
            self.basis = [legendre.legval(self.x, legendre.legder(even, d) if d else even).T for d in range(4)]
        self.integrands, self.modes = integrands(kind), modes
        self.blocks = [(B, slice(0, modes)) for B in self.basis]
        self.blocks += [(np.ones((self.x.size, 1)), slice(modes + i, modes + i + 1)) for i in range(3)]

    def start(self, coefficients, kg):
        return np.concatenate([coefficients, np.zeros(self.modes + 2 - len(coefficients)), [kg]])

    def values(self, moduli, y):
        found = self.integrands(self.x, *[B @ y[at] for B, at in self.blocks], *moduli)
        return [np.broadcast_to(value, self.x.shape) for value in found]

    def derivatives(self, moduli, y, area, volume):
        """First and second derivatives of E + tension (A - area) - pressure (V - volume) by all unknowns."""
        values = self.values(moduli, y)[6:]
        gradient, hessian, second = np.zeros(y.size), np.zeros((y.size, y.size)), iter(values[7:])
        for i, (B, at) in enumerate(self.blocks):
            gradient[at] += B.T @ (self.weights * values[i])
            for j, (C, to) in enumerate(self.blocks[: i + 1]):
                hessian[at, to] += B.T @ ((self.weights * next(second))[:, None] * C) / (2 if i == j else 1)
        gradient[[TENSION, PRESSURE]] += -(area or 0), volume or 0
        return gradient, hessian + hessian.T

    def at_rest(self, moduli, y, area, volume, amplitude=None):
        """The stationary shape near y, its four terms. With an amplitude, kg is unknown instead of that coefficient."""
        y, last = y.copy(), np.inf
        equations = [*range(self.modes)] + [self.modes] * (area is not None) + [self.modes + 1] * (volume is not None)
        unknowns = equations if amplitude is None else [0, *equations[2:], self.modes + 2]
        y[1] = y[1] if amplitude is None else amplitude
        for _ in range(100):
            gradient, hessian = self.derivatives(moduli, y, area, volume)
            step = np.zeros(y.size)
            step[unknowns] = np.linalg.solve(hessian[np.ix_(equations, unknowns)], -gradient[equations])
            moved = abs(self.basis[0] @ step[: self.modes]).max()
            y += min(1.0, 0.1 * y[0] / moved) * step
            if last / 2 < moved < 1e-9:  # nothing but rounding
                return y, np.array([self.weights @ value for value in self.values(moduli, y)[:4]])
            last = moved
        raise RuntimeError("Newton's method does not converge")


def program(command, moduli, kg, shape, equilibrium, asked=1e-11):
    """Last values of all series."""
    text = "".join(f"{name} = {float(value)!r}\n" for name, value in zip(NAMES, (*moduli, kg)))
    text = f'tier = "axisym"\naccuracy.energy = {asked}\n[energy]\n{text}[shape]\n{shape}[equilibrium]\n{equilibrium}'
    with tempfile.TemporaryDirectory() as folder:
        case, result = Path(folder, "case.toml"), Path(folder, "case.hdf")
        case.write_text(text)
        subprocess.run([command, "run", "--quiet", case, "-o", result], check=True)
        with h5py.File(result) as file:
            return {name: values[-1] for name, values in file["series"].items()}


def wavy(length, radius, *amplitudes):
    modes = (f"[[shape.mode]]\namplitude = {a:.5f}\nn = {n}\n" for n, a in enumerate(amplitudes, 1))
    return f'kind = "tube"\nradius = {radius:.5f}\nlength = {length}\n' + "".join(modes)


def tube(command, moduli, kg, length, amplitude, area, volume):
    held = {"area": area and 2 * np.pi * length * area, "volume": volume and np.pi * length * volume}
    spaces, first = [Space("tube", modes, length) for modes in MODES], [1, amplitude or 0.3]
    if amplitude:
        y, _ = spaces[0].at_rest(moduli, spaces[0].start(first, kg), **held, amplitude=amplitude)
        kg, first = y[KG], y[:3]  # without a descent, the program has to begin nearby: with three coefficients
    found = [space.at_rest(moduli, space.start(first, kg), **held) for space in spaces]
    text = "".join(f"{name} = {value!r}\n" for name, value in held.items() if value)
    text += f'held = "{"-and-".join(name for name in held if held[name])}"\ndescend = {str(not amplitude).lower()}\n'
    return found, program(command, moduli, kg, wavy(length, *first), text)


def cell(command, moduli, kg, v, a, c):
    spaces = [Space("cell", modes) for modes in MODES]
    first, area = [1, np.sign(c - a) * np.sqrt(1 - v)], 4 * np.pi
    found = [space.at_rest(moduli, space.start(first, kg), area, area / 3 * v) for space in spaces]
    text = f'held = "area-and-volume"\narea = {area!r}\nreduced_volume = {v}\n'
    return found, program(command, moduli, kg, f'kind = "ellipsoid"\na = {a}\nb = {a}\nc = {c}\n', text)


def law(command):
    """Prints the limit. Whether an expansion of E in a, up to a^4, has it too, and the program the wave at a = 0.02."""
    moduli, length, q = (-1.0, 1.0, 0.0, -1.0), 4.0, np.pi / 2
    space, area, amplitudes = Space("tube", 16, length), 8 * np.pi, (0.04, 0.02, 0.01)
    waves = [space.at_rest(moduli, space.start([1, 0], q**-2), area, None, a)[0] for a in amplitudes]
    limits = [(wave[KG] - q**-2) / wave[1] ** 2 for wave in waves]
    print("\n(kg - kg_c)/a^2: " + ", ".join(f"{limit:.8f} at a = {a}" for a, limit in zip(amplitudes, limits)))
    for power in (4, 16):  # the error is a series of even powers of a
        limits = [(power * fine - coarse) / (power - 1) for coarse, fine in zip(limits, limits[1:])]
    closed = -np.polyval([48, -248, 468, -473, 231, -47, 3], q**2) / (2 * (q * (q**2 - 1) * (4 * q**2 - 1)) ** 2)
    print(f"extrapolated to a = 0: {limits[0]:.8f}, by expansion {closed:.8f}")
    wave, held = waves[1], f'held = "area"\ndescend = false\narea = {area!r}\n'
    series = program(command, moduli, wave[KG], wavy(length, *wave[:3]), held, 2e-12)
    half, own = (series["r_max"] - series["r_middle"]) / 2, wave[1 : space.modes : 2].sum()
    print(f"kg = {wave[KG]:.10f}: (r(0) - r(L/2))/2 = {half:.9f} by the program, {own:.9f} spectral")
    return abs(limits[0] - closed) < 1e-6 and abs(half - own) < 1e-7


def main():
    command, random = sys.argv[1], np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    print("Relative to the sum of the absolute terms: differences, those of both resolutions (own), stated errors.")
    heads = (*NAMES, "E", "spectral", "differ", "own", "stated", "E_kg", "spectral", "differ")
    print(f"{'':17}" + "".join(f"{head:>{column.split('.')[0]}}" for head, column in zip(heads, COLUMNS)))
    bad = 0
    for name, moduli, kg, rest in CASES:
        *moduli, kg = (round(value * random.uniform(0.96, 1.04), 4) for value in (*moduli, kg))
        found, series = (tube if name.startswith("tube") else cell)(command, moduli, kg, *rest)
        (_, coarse), (y, terms) = found
        energy, scale = terms.sum(), abs(terms).sum()
        by_term = abs(terms - [series[term] for term in TERMS]) / scale
        differ, own = abs(energy - series["energy"]) / scale, abs(coarse.sum() - energy) / scale
        bad += not (max(differ, *by_term) < 1e-8 and own < 1e-10)
        row = (*moduli, y[KG], series["energy"], energy, differ, own, series["energy_error"] / scale)
        row += series["energy_kg"], terms[3], by_term[3]
        print(f"{name:17}" + "".join(f"{value:{column}}" for value, column in zip(row, COLUMNS)), flush=True)
    return 0 if law(command) and not bad else 1


if __name__ == "__main__":
    sys.exit(main())
