"""Surfaces of revolution at rest and their growth rates by Fourier series; shares nothing with the program.

E + tension A - pressure V is an integral of a function of the derivatives of the point (r cos phi, r sin phi, z), whose
first and second derivatives SymPy finds. With them for displacements w(t) cos(m phi) along the normal, Newton's method
finds equilibrium shapes (m = 0), and an eigenproblem the rates of gradient flow for each m.
"""

import functools

import numpy as np
import scipy.linalg
import sympy
from numpy.polynomial import legendre

MODULI = ("k20", "H0", "k40", "k42")
MODES = 5  # rates for m = 0 ... 4


@functools.lru_cache
def densities():
    """Function of r, r', r'', z', z'', tension, pressure, MODULI: area, volume, energy; their derivatives by r ... z'';
    second ones of E + tension A - pressure V by these and two derivatives by phi (7 x 7), by mixed ones (4 x 4)."""
    along = r, r1, r2, z1, z2 = sympy.symbols("r r1 r2 z1 z2")
    rpp, zpp, *mixed = around = sympy.symbols("rpp zpp rp r1p zp z1p")  # p: a derivative by phi
    rp, r1p, zp, z1p = mixed
    tension, pressure, k20, H0, k40, k42 = parameters = sympy.symbols(("tension", "pressure", *MODULI))
    by_t, by_phi = sympy.Matrix([r1, 0, z1]), sympy.Matrix([rp, r, zp])
    twice = [[r2, 0, z2], [r1p, r1, z1p], [rpp - r, 2 * rp, zpp]]
    E, F, G = by_t.dot(by_t), by_t.dot(by_phi), by_phi.dot(by_phi)
    L, M, N = (sympy.Matrix(X).dot(by_phi.cross(by_t)) for X in twice)
    J = sympy.sqrt(E * G - F**2)
    H, K = (L * G - 2 * M * F + N * E) / J**3, (L * N - M**2) / J**4
    parts = J, r**2 * z1 / 2, J * (k20 * (H - H0) ** 2 + k40 * (H - H0) ** 4 + k42 * K**2)
    total = parts[2] + tension * parts[0] - pressure * parts[1]
    flat, even = dict.fromkeys(around, 0), (*along, rpp, zpp)
    values = [part.subs(flat) for part in parts]
    first = [part.diff(y) for part in values for y in along]
    second = [total.diff(a).diff(b).subs(flat) for group in (even, mixed) for a in group for b in group]
    return sympy.lambdify((*along, *parameters), [*values, *first, *second], cse=True, modules="numpy")


def variation(r, z, loads, moduli, m):
    """r, z: values and three derivatives. The densities (3), their derivatives by w, w', w'' (3 x 3) where (r, z)
    moves by w cos(m phi) (z', -r'), and the second ones of E + tension A - pressure V (3 x 3)."""
    values = densities()(*r[:3], *z[1:3], *loads, *(moduli.get(name, 0.0) for name in MODULI))
    values, zero = np.stack([np.broadcast_to(value, r[0].shape) for value in values]), 0 * r[0]
    u, v = ([[x[1], zero, zero], [x[2], x[1], zero], [x[3], 2 * x[2], x[1]]] for x in (z, -r))
    even = np.array([*u, *v[1:], *(-(m**2) * np.array([u[0], v[0]]))])
    mixed = -m * np.array([*u[:2], *v[:2]])
    first = np.einsum("pat,ait->pit", values[3:18].reshape(3, 5, -1), even[:5])
    second = np.einsum("ait,abt,bjt->ijt", even, values[18:67].reshape(7, 7, -1), even)
    return values[:3], first, second + np.einsum("ait,abt,bjt->ijt", mixed, values[67:].reshape(4, 4, -1), mixed)


def tube_stiffness(radius, tension, moduli, m):
    """Coefficients of 1, q^2, q^4: the second variation of a tube at rest per INT w^2 dS, w = cos(q z) cos(m phi)."""
    r, z = (np.array([[one], [slope], [0.0], [0.0]]) for one, slope in ((radius, 0.0), (0.0, 1.0)))
    _, first, _ = variation(r, z, (0, 0), moduli, 0)
    pressure = (first[2, 0, 0] + tension * first[0, 0, 0]) / first[1, 0, 0]
    C = variation(r, z, (tension, pressure), moduli, m)[2][:, :, 0]
    return np.array([C[0, 0], C[1, 1] - 2 * C[0, 2], C[2, 2]]) / radius


def waves(odd, n, t, d):
    """The d-th derivatives of sin kt (odd; k = 1 ... n) or cos kt (k = 0 ... n - 1)."""
    k = np.arange(n) + odd
    return k**d * np.cos(np.outer(t, k) + (d - odd) * np.pi / 2)


class Profiles:
    """y: n coefficients each of r and z, tension, pressure. Period 2 pi in t.

    Closed cells: r is a sine, z a cosine series, with poles at 0 and pi, integrated at Gauss nodes of cos t. Tori,
    up-down symmetric: r is a cosine, z a sine series, integrated by the trapezoidal rule."""

    def __init__(self, n, moduli, area, volume, torus=False):
        self.n, self.moduli, self.held, self.odd = n, moduli, (area, volume), (not torus, torus)
        if torus:
            self.t, self.weights = np.pi / (2 * n) * np.arange(4 * n), np.full(4 * n, np.pi**2 / n)
        else:
            x, weights = legendre.leggauss(2 * n)
            self.t, self.weights = np.arccos(-x), 2 * np.pi * weights / np.sqrt(1 - x**2)
        self.at_nodes = [[waves(odd, n, self.t, d) for d in range(4)] for odd in self.odd]
        self.even = [waves(False, n, self.t, d) for d in range(3)]
        self.inverses = [np.linalg.pinv(basis[0]) for basis in self.at_nodes]

    def start(self, r, z, tension, pressure):
        """From points in order: from pole to pole, or around a torus from its outer equator to it again."""
        s = np.concatenate([[0], np.cumsum(np.hypot(np.diff(r), np.diff(z)))])
        t, few, y = (1 + self.odd[1]) * np.pi * s / s[-1], min(self.n, s.size // 3), np.zeros(2 * self.n + 2)
        for i, x in enumerate((r, z)):
            y[i * self.n : i * self.n + few] = np.linalg.lstsq(waves(self.odd[i], few, t, 0), x, rcond=None)[0]
        y[-2:] = tension, pressure
        return self.spread(y)

    def coefficients(self, r, z, loads):
        return np.concatenate([self.inverses[0] @ r, self.inverses[1] @ z, loads])

    def at(self, y, t):
        return [waves(odd, self.n, t, 0) @ c for odd, c in zip(self.odd, (y[: self.n], y[self.n : -2]))]

    def derivatives(self, y):
        """r and z at the nodes, with three derivatives."""
        return [np.stack([B @ c for B in basis]) for basis, c in zip(self.at_nodes, (y[: self.n], y[self.n : -2]))]

    def spread(self, y):
        """The same curve, with more of t where it is strongly curved (on an average over 0.1 of t)."""
        r, z = self.derivatives(y)
        speed = np.hypot(r[1], z[1])
        squares = ((r[1] * z[2] - z[1] * r[2]) / speed**3) ** 2 + (z[1] / (r[0] * speed)) ** 2
        density = self.inverses[self.odd.index(False)] @ (speed * (1 + squares) ** 0.25)
        k, t, off = np.arange(1, self.n), self.t.copy(), 1.0
        wave = density[1:] / density[0] * np.exp(-((0.1 * k) ** 2) / 2)
        while np.max(abs(off)) > 1e-12:
            off = t - self.t + np.sin(np.outer(t, k)) @ (wave / k)
            t -= off / (1 + np.cos(np.outer(t, k)) @ wave)
        return self.coefficients(*self.at(y, t), y[-2:])

    def basis(self, m):
        """w, w', w'' at the nodes, as r^m at poles (m < 4), scaled by the root of the second variation."""
        p, scale = (m if m < 2 else 2 + m % 2), 1 / (1 + np.arange(self.n) ** 2)
        sin, cos = np.sin(self.t)[:, None], np.cos(self.t)[:, None]
        f = [sin**p, p * sin ** max(p - 1, 0) * cos, p * (p - 1) * sin ** max(p - 2, 0) * cos**2 - p * sin**p]
        w, w1, w2 = (column * scale for column in self.even)
        return [f[0] * w, f[1] * w + f[0] * w1, f[2] * w + 2 * f[1] * w1 + f[0] * w2]

    def variations(self, y, m):
        """Area, volume, energy; their gradients; the second variation; INT w^2 dS; products with rigid motions."""
        r, z = self.derivatives(y)
        values, first, second = variation(r, z, y[-2:], self.moduli, m)
        B, area = self.basis(m), (self.weights * values[0])[:, None]
        gradients = [sum(B[i].T @ (self.weights * part[i]) for i in range(3)) for part in first]
        hessian = sum(B[i].T @ ((self.weights * second[i, j])[:, None] * B[j]) for i in range(3) for j in range(3))
        rigid = {0: [-r[1]], 1: [z[1], r[1] * r[0] + z[1] * z[0]]}.get(m, [])
        mass = B[0].T @ (area * (r[1] ** 2 + z[1] ** 2)[:, None] * B[0])
        rigid = [B[0].T @ (area[:, 0] * w) for w in rigid]
        return values @ self.weights, gradients, (hessian + hessian.T) / 2, mass, rigid

    def newton(self, y):
        """At rest, with the area and the volume held."""
        last = np.inf
        for _ in range(40):
            (area, volume, _), (of_area, of_volume, of_energy), hessian, mass, rigid = self.variations(y, 0)
            sides = np.stack([of_area, -of_volume, *(rigid if self.odd[0] else [])], axis=1)
            right = np.zeros(self.n + sides.shape[1])
            right[: self.n] = of_energy + y[-2] * of_area - y[-1] * of_volume
            right[self.n : self.n + 2] = area - self.held[0], self.held[1] - volume
            step = np.linalg.solve(np.block([[hessian, sides], [sides.T, np.zeros((sides.shape[1],) * 2)]]), -right)
            size, (r, z) = np.sqrt(step[: self.n] @ mass @ step[: self.n]), self.derivatives(y)
            damping = min(1.0, 0.2 / size)
            w, loads = damping * (self.basis(0)[0] @ step[: self.n]), y[-2:] + damping * step[self.n : self.n + 2]
            y = self.spread(self.coefficients(r[0] + w * z[1], z[0] - w * r[1], loads))
            if last / 4 < size < 1e-8:  # nothing but rounding
                return y
            last = size
        raise ArithmeticError(f"the last step is {size:.1e}")

    def rate(self, y, m):
        """The largest in gradient flow, area and volume held, rigid motions left out."""
        _, gradients, hessian, mass, rigid = self.variations(y, m)
        sides = [*gradients[: 0 if m else 2], *rigid]
        free = scipy.linalg.null_space(np.stack(sides)) if sides else np.eye(self.n)
        A, M, shift = free.T @ hessian @ free, free.T @ mass @ free, 1000.0  # more than any rate
        return shift - 1 / scipy.linalg.eigh(M, A + shift * M, eigvals_only=True)[-1]

    def known(self, y):
        known = {"energy": self.variations(y, 0)[0][2], "tension": y[-2], "pressure": y[-1]}
        if self.odd[0]:
            t = self.t[np.argmax(self.at(y, self.t)[0])]
            for _ in range(20):
                slope, bend = (waves(True, self.n, [t], d)[0] @ y[: self.n] for d in (1, 2))
                t -= slope / bend
            known["height"] = abs(np.diff(self.at(y, np.array([0, np.pi]))[1])[0])
            known["r_max"] = self.at(y, [t])[0][0]
            known |= {f"growth_{m}": self.rate(y, m) for m in range(MODES)}
        return known


def at_rest(n, moduli, area, volume, start, torus=False):
    """What is known, each with its relative change from the resolution before; n grows until none is above 1e-9."""
    known = found = None
    while n < 600:
        before, known = known, None
        try:
            profiles = Profiles(n, moduli, area, volume, torus)
            known = profiles.known(profiles.newton(profiles.start(*start)))
        except ArithmeticError:  # too coarse
            pass
        if before and known:
            found = {name: (value, abs(value / before[name] - 1)) for name, value in known.items()}
            if max(change for _, change in found.values()) < 1e-9:
                break
        n = int(1.4 * n)
    if not found:
        raise ArithmeticError("no two resolutions were solved")
    return found
