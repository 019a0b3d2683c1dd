"""A map, and its points: a coarse lattice first, then finer ones along the lines between regions."""

import csv
from dataclasses import dataclass


@dataclass
class Axis:
    key: str  # as users write it
    low: float
    high: float
    log: bool = False
    whole: bool = False

    def value(self, fraction):
        """To five digits, so that a table has the value that was run."""
        if self.log:
            x = self.low * (self.high / self.low) ** fraction
        else:
            x = self.low + (self.high - self.low) * fraction
        return round(x) if self.whole else float(f"{x:.5g}")


@dataclass
class Map:
    title: str
    x: Axis
    y: Axis
    judge: object  # (box, variant, x, y) -> Judgement
    variants: tuple = ("",)
    across: int = 8  # intervals of the coarse lattice
    levels: int = 2
    tier: str = "axisym"


FINEST = 16  # intervals of the finest lattice in one of the coarse one


def follow(known, judged, across, levels):
    """Judges points (i, j) of the finest lattice, of FINEST * across intervals each way: first those of the coarse one,
    then, `levels` times, the corners of the halves of each cell whose corners are of different sorts. `known`: points
    judged before, with their sorts; `judged(points)` gives the sorts of further ones."""
    sorts = dict(known)

    def need(points):
        missing = [p for p in dict.fromkeys(points) if p not in sorts]
        sorts.update(zip(missing, judged(missing)))

    step, last = FINEST, across * FINEST
    cells = [(i, j) for i in range(0, last, step) for j in range(0, last, step)]
    need([(i, j) for i in range(0, last + 1, step) for j in range(0, last + 1, step)])
    for _ in range(levels):
        half = step // 2
        mixed = [c for c in cells if len({sorts[p] for p in corners(c, step)}) > 1]
        need([(i + a, j + b) for i, j in mixed for a in (0, half, step) for b in (0, half, step)])
        cells = [(i + a, j + b) for i, j in mixed for a in (0, half) for b in (0, half)]
        step = half
    return sorts


def corners(cell, step):
    i, j = cell
    return [(i + a, j + b) for a in (0, step) for b in (0, step)]


def fraction(i, across):
    return i / (across * FINEST)


def read_table(path):
    """The rows of a table of judged points."""
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))
