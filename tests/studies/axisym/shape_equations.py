"""Closed cells at rest by the shape equations, independently of the program: another formulation, another discretisation, NumPy alone.

A mirror-symmetric cell has the half profile r(s), psi(s), s in [0, S], with r' = cos psi, z' = sin psi, H = -(psi' + q) and
K = psi' q, where q = sin psi/r. Stationary points of E + sigma A - Pi V with the side condition r' = cos psi obey Hamilton's
equations with the momenta m (of psi) and p (of r):

    m = r (-f_H + q f_K)    m' = cos psi (-f_H + psi' f_K) - Pi r^2 cos psi/2 + p sin psi
    p' = f + sigma + q (f_H - psi' f_K) - Pi r sin psi,    p = 0 at the pole (S is free) and at the equator (symmetry).

With x = s/S, r, psi and p are x times even polynomials in Chebyshev form; the equations hold at their Gauss nodes. Newton's method
with a Jacobian by complex steps.
"""

import numpy as np
from numpy.polynomial import chebyshev, legendre


def capsule(radius, length):
    """Area and volume."""
    return 2 * np.pi * radius * length + 4 * np.pi * radius**2, np.pi * radius**2 * length + 4 / 3 * np.pi * radius**3


class Energy:
    def __init__(self, k20, H0, k40=0.0, k42=0.0):
        self.k20, self.H0, self.k40, self.k42 = k20, H0, k40, k42

    def density(self, H, K):
        """f, f_H, f_K."""
        h = H - self.H0
        return (self.k20 * h**2 + self.k40 * h**4 + self.k42 * K**2, 2 * self.k20 * h + 4 * self.k40 * h**3, 2 * self.k42 * K)


class Basis:
    """x times an even polynomial with n coefficients on [0, 1]: values and derivatives at nodes."""

    def __init__(self, n, nodes):
        y = 2 * nodes**2 - 1
        even = chebyshev.chebvander(y, n - 1)
        of_y = np.stack([chebyshev.chebval(y, chebyshev.chebder(row)) if i else 0 * y for i, row in enumerate(np.eye(n))], axis=1)
        self.value = nodes[:, None] * even
        self.over_x = even
        self.slope = even + 4 * nodes[:, None] ** 2 * of_y


class Cell:
    """The unknowns are the coefficients of r, psi and p, then S, sigma, Pi."""

    def __init__(self, area, volume, n=60):
        self.n, self.area, self.volume = n, area, volume
        self.at, self.inner = Basis(n, gauss_nodes(n)), Basis(n, gauss_nodes(n - 1))
        self.equator = Basis(n, np.array([1.0])).value[0]
        points, weights = legendre.leggauss(2 * n)
        self.between, self.weights = Basis(n, (points + 1) / 2), weights / 2
        self.slope_of_odd = self.inner.slope @ np.linalg.inv(self.at.value)  # at the inner nodes, from values at the others

    def parts(self, x):
        return x[: self.n], x[self.n : 2 * self.n], x[2 * self.n : -3], *x[-3:]

    def geometry(self, basis, x):
        """r, psi, p, psi', q."""
        r, psi, p, S, _, _ = self.parts(x)
        radius, angle = basis.value @ r, basis.value @ psi
        return radius, angle, basis.value @ p, basis.slope @ psi / S, np.sin(angle) / radius

    def residual(self, energy, x):
        r_, psi_, p_, S, sigma, Pi = self.parts(x)
        r, psi, p, bend, q = self.geometry(self.at, x)
        f, f_H, f_K = energy.density(-(bend + q), bend * q)
        m = r * (-f_H + q * f_K)
        of_r = self.at.slope @ r_ / S - np.cos(psi)
        of_p = self.at.slope @ p_ / S - (f + sigma + q * (f_H - bend * f_K) - Pi * r * np.sin(psi))
        # One node less: at the pole this equation holds by itself.
        r, psi, p, bend, q = self.geometry(self.inner, x)
        _, f_H, f_K = energy.density(-(bend + q), bend * q)
        of_m = self.slope_of_odd @ m / S - np.cos(psi) * (-f_H + bend * f_K - Pi * r**2 / 2) - p * np.sin(psi)
        area, volume, _ = self.integrals(energy, x)
        ends = [self.equator @ psi_ - np.pi / 2, self.equator @ p_, area - self.area, volume - self.volume]
        return np.concatenate([of_r, of_p, of_m, ends])

    def integrals(self, energy, x):
        """Area, volume, energy of the whole cell."""
        r, psi, _, bend, q = self.geometry(self.between, x)
        ds = 4 * np.pi * x[-3] * self.weights
        return ds @ r, ds @ (r**2 * np.sin(psi)) / 2, ds @ (r * energy.density(-(bend + q), bend * q)[0])

    def newton(self, energy, x, steps=60):
        """Ends when the residual no longer falls; raises ArithmeticError if it stays large."""
        size = np.linalg.norm(self.residual(energy, x))
        for _ in range(steps):
            shifted = x[:, None] + 1e-30j * np.eye(x.size)
            jacobian = np.stack([self.residual(energy, column).imag for column in shifted.T], axis=1) / 1e-30
            step, damping = np.linalg.solve(jacobian, self.residual(energy, x)), 1.0
            while damping > 1e-3 and not np.linalg.norm(self.residual(energy, x - damping * step)) < size:
                damping /= 2
            if damping <= 1e-3:
                break
            x = x - damping * step
            size = np.linalg.norm(self.residual(energy, x))
        if size > 1e-8:
            raise ArithmeticError(f"the residual is {size:.1e}")
        return x

    def start(self, radius, length):
        """A smoothed capsule: its angle is fitted by few polynomials, r integrated."""
        n, x = self.n, np.linspace(0, 1, 400)
        S = length / 2 + np.pi * radius / 2
        psi = np.minimum(x * S / radius, np.pi / 2)
        few = Basis(5, x)
        psi_ = np.concatenate([np.linalg.lstsq(few.value, psi, rcond=None)[0], np.zeros(n - 5)])
        psi_[0] += np.pi / 2 - self.equator @ psi_
        r_ = np.linalg.solve(self.at.slope, S * np.cos(self.at.value @ psi_))
        return np.concatenate([r_, psi_, np.zeros(n), [S, 0, 0]])


def gauss_nodes(n):
    """Nodes for even polynomials on [0, 1]."""
    return np.cos(np.pi * (2 * np.arange(n) + 1) / (4 * n))
