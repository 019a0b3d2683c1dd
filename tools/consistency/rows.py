"""Rows of the table: a quantity from tier 1, or its exact value, and from 3D on a sequence of finer meshes."""

import math
from dataclasses import dataclass, field


ENOUGH = 0.1  # of the bound: for smaller differences the order is not checked


@dataclass
class Row:
    """Numbers are lists with one entry per time. Differences are the largest over all times, relative to `scale`."""

    quantity: str
    reference: list
    scale: float
    bound: float | None  # of the difference on the finest mesh, or of `error` without meshes; None: not checked
    error: float = 0.0  # of the reference, relative to scale
    times: list = field(default_factory=lambda: [0.0])
    found: dict = field(default_factory=dict)  # triangles -> list
    must_fall: bool = True

    def difference(self, triangles):
        return max(abs(a - b) for a, b in zip(self.found[triangles], self.reference)) / self.scale

    @property
    def meshes(self):
        return sorted(self.found)

    @property
    def order(self):
        """Order in the mesh width, from the mesh with the largest difference (the coarsest, unless its difference is
        accidentally small) to the finest; None where the error of the reference or rounding would determine it."""
        if len(self.found) < 2:
            return None
        last = self.meshes[-1]
        first = max(self.meshes[:-1], key=self.difference)
        coarse, fine = self.difference(first), self.difference(last)
        if fine <= max(3 * self.error, 1e-9):
            return None
        return math.log(coarse / fine) / (0.5 * math.log(last / first)) if coarse > 0 else -math.inf

    def complaints(self):
        """Violated bounds, in words."""
        if self.bound is None:
            return []
        out, finest = [], self.difference(self.meshes[-1]) if self.found else self.error
        if not finest <= self.bound:
            out.append(f"differs by {finest:.2g}, more than {self.bound:.2g}")
        if self.must_fall and self.order is not None and self.order < 1 and finest > ENOUGH * self.bound:
            out.append(f"falls with order {self.order:.2g} only")
        return out


@dataclass
class Cost:
    """CPU seconds of the runs of a scene."""

    axisym: float = 0.0
    surface: dict = field(default_factory=dict)  # triangles -> seconds

    @property
    def total(self):
        return self.axisym + sum(self.surface.values())


@dataclass
class Table:
    """One scene."""

    name: str
    title: str
    words: str
    rows: list
    cost: Cost

    def complaints(self):
        return [f"{self.title}: {row.quantity} {complaint}" for row in self.rows for complaint in row.complaints()]
