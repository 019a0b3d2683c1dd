"""Rows of the table: a quantity by tier 1, or exactly, and by tier 3D on meshes of more and more triangles."""

import math
from dataclasses import dataclass, field


ENOUGH = 0.1  # of the bound: nearer than that, nothing is asked of the order


@dataclass
class Row:
    """Numbers are lists, one for each time. Differences are relative to `scale`, of all times the largest."""

    quantity: str
    reference: list
    scale: float
    bound: float | None  # of the difference on the finest mesh, or of `error` without any; None: it is only told
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
        """In the mesh width, from the mesh with the largest difference (the coarsest, unless it is right by accident)
        to the finest; None where the reference's error is in the way, or nothing is left but rounding."""
        if len(self.found) < 2:
            return None
        last = self.meshes[-1]
        first = max(self.meshes[:-1], key=self.difference)
        coarse, fine = self.difference(first), self.difference(last)
        if fine <= max(3 * self.error, 1e-9):
            return None
        return math.log(coarse / fine) / (0.5 * math.log(last / first)) if coarse > 0 else -math.inf

    def complaints(self):
        """What is not as it should be, in words."""
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
