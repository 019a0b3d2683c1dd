"""The page docs/consistency.md, its table and its picture."""

import csv
import io
import textwrap
from pathlib import Path

from runs import keep


def table(scene):
    """The table of a scene in Markdown."""
    meshes = sorted({triangles for row in scene.rows for triangles in row.found})
    head = ["quantity", "tier 1", "its error", *(f"T = {triangles}" for triangles in meshes), "order", "bound"]
    lines = [_line(head), "|" + "---|" * len(head)]
    for row in scene.rows:
        found = [f"{row.difference(triangles):.1e}" if triangles in row.found else "" for triangles in meshes]
        order = "" if row.order is None else f"{row.order:.1f}"
        bound = "" if row.bound is None else f"{row.bound:.0e}"
        lines.append(_line([_name(row), f"{row.reference[-1]:.9g}", f"{row.error:.0e}" if row.error else "exact", *found, order, bound]))
    cost = [f"{scene.cost.surface.get(triangles, 0):.3g}" for triangles in meshes]
    lines.append(_line(["*CPU s*", f"{scene.cost.axisym:.2g}", "", *cost, "", ""]))
    return "\n".join(lines)


def _line(cells):
    return "| " + " | ".join(cells) + " |"


def _name(row):
    return f"{row.quantity}, largest of {len(row.times)} times" if len(row.times) > 1 else row.quantity


def numbers(tables):
    """All values at all times, as CSV."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("scene", "quantity", "time", "triangles", "tier_1", "error_of_tier_1", "tier_3d", "difference", "bound"))
    for scene in tables:
        for row in scene.rows:
            for triangles in row.meshes or [None]:
                for i, time in enumerate(row.times):
                    value = row.found[triangles][i] if triangles else None
                    apart = f"{abs(value - row.reference[i]) / row.scale:.4e}" if triangles else ""
                    writer.writerow((scene.name, row.quantity, f"{time:g}", triangles or "", f"{row.reference[i]:.12g}",
                                     f"{row.error:.1e}", f"{value:.12g}" if triangles else "", apart,
                                     "" if row.bound is None else row.bound))  # fmt: skip
    return out.getvalue()

READING = """**Summary.** For smooth starts both tiers agree, and their differences vanish as the mesh is refined. On the finest
meshes here, integrals at rest differ by at most {at_rest}, growth rates of small waves by {rates}, and
energies in motion by {motion} of E_ref at all output times ({figure} for the figure's tube, {equilibrium} where the cell comes to
rest). The dissipated energy differs by {dissipated}, and shapes in motion differ by {shapes} of their size.

**Limits of the accuracy.** *At rest* the recovery of curvature limits the accuracy. Integrals are of order 5 and
higher; values at single points, such as the extremes of H and K ({extremes}), are far less accurate. *In motion* the
time steps of 3D limit it: for growth rates the fixed step leaves (rate x step)^2/3, all other errors follow the
tolerance. *At the start* the force limits it: it takes four derivatives of the surface, so on an interpolated start a
part of it is noise at the scale of the triangles. This noise adds {noise_coarse} times
the true dissipation of the overdamped tube on the coarsest mesh and {noise_fine} times on the finest, where the rates
of its smooth waves have an error of {waves}. Without inertia the noise disappears at once. A fluid seems to keep
it as waves of little energy, which affect values at a point or an instant: the largest speed and lambda differ by up to {pointwise}.

**Where the tiers differ.** *Where curvature jumps*, at the seams of the capsule: the energy at rest is off by {seams}
and converges with first order at best; extremes of H and K do not converge. As a fluid, the capsule emits waves that
no mesh resolves; the energies differ by {capsule}, and the energy of tier 1 itself is only known to {capsule_known}.
*Smallest and largest radius* in 3D are those of nodes, so they have no order of convergence. For closed surfaces the
tiers define them differently (distances from the centre in 3D, from the axis in tier 1), so they are not compared."""

HEAD = """# Consistency of the two tiers

This page compares every quantity that both tier 1 (`axisym`) and tier 2 (`surface3d`, "3D" below) compute, on the
same starts. This page, [all numbers](consistency.csv) and the picture are made by

    tools/figures consistency        # {minutes:.0f} minutes of one core

which exits with status 1 if a difference exceeds its bound. Do not edit them: the texts are in `tools/consistency/`.

{reading}

![Differences between the tiers against the number of triangles; dotted: fourth order in the mesh width](consistency.svg)

## How to read the tables

- *Tier 1* has a requested accuracy far beyond that of 3D; if there are several times, its last value is shown.
- *Its error* is the stated one for the energy; for other quantities it is the difference from a run with a ten times
  smaller requested error. If an exact value is given, that is the reference and the error is zero.
- *T* triangles of order 4. *Differences* are the largest over all output times (`consistency.csv` has each of them).
  They are relative to E_ref for energies and for dissipated energy, to the size of the shape for distances (radius of
  the sphere of the same area, or of the tube), to 4 pi for INT K, else to the largest value of tier 1.
- *Order* is the order of the difference in the mesh width, between the mesh with the largest difference (the
  coarsest, unless its difference is accidentally small) and the finest. It is empty where the error of tier 1 or
  rounding would determine it. The tolerance of the time steps decreases with T^-3, so that errors in time decrease as
  those in space should, with the fourth power of the mesh width; fixed steps (rates) are the same on all meshes.
- *Bound*: the command fails if the difference on the finest mesh is larger, or if the order is below 1 while the
  difference exceeds a tenth of the bound (except for extremes, and where curvature jumps). Empty: not checked.
- *CPU seconds* are of one thread and, in 3D, include the coarser run for the error estimate; the machine was busy.
"""


INTEGRALS = ("area", "volume", "energy", "energy_20", "energy_40", "energy_42", "integral_K")
AT_REST = ("tube-at-rest", "spheroid-at-rest")
INERTIAL = ("waves-fluid", "rotation", "spheroid-fluid")
MOVING = ("figure", "waves-overdamped", "waves-stokes", *INERTIAL)
RATES = ("rates-gradient-flow", "rates-overdamped", "rates-stokes", "rates-pearling", "rates-buckling")


def reading(tables):
    """The summary of the tables in words."""

    def largest(scenes, *quantities, what=lambda row: row.difference(row.meshes[-1])):
        """Largest value over these rows (all if none are named), by default of the difference on the finest mesh."""
        found = [
            what(row)
            for scene in tables
            for row in scene.rows
            if scene.name in scenes and row.found and (row.quantity in quantities or not quantities)
        ]
        return f"{max(found):.2g}" if found else "(not run)"

    return READING.format(
        at_rest=largest(AT_REST, *INTEGRALS),
        extremes=largest(AT_REST, "min H", "max H", "min K", "max K"),
        rates=largest(RATES),
        motion=largest(MOVING, "energy"),
        figure=largest(("figure",), "energy"),
        equilibrium=largest(("capsule-equilibrium",), "energy"),
        shapes=largest(MOVING, "shape, Hausdorff"),
        noise_coarse=largest(("tube-begins",), "overdamped, dissipation", what=lambda row: row.difference(row.meshes[0])),
        noise_fine=largest(("tube-begins",), "overdamped, dissipation"),
        waves=largest(("tube-begins",), "overdamped, wave 1", "overdamped, wave 2"),
        pointwise=largest(INERTIAL, "speed", "lambda"),
        seams=largest(("capsule-at-rest",), "energy"),
        capsule=largest(("capsule-fluid",), "energy"),
        capsule_known=largest(("capsule-fluid",), "energy", what=lambda row: row.error),
        dissipated=largest(MOVING, "dissipated"),
    )


def write(path, tables):
    """Writes PATH and, beside it, the same name with .csv and .svg."""
    path = Path(path)
    parts = [HEAD.format(reading=reading(tables), minutes=sum(scene.cost.total for scene in tables) / 60)]
    for scene in tables:
        parts.append(f"## {scene.title}\n\n{textwrap.fill(scene.words, 118)}\n\n{table(scene)}\n")
    keep(path, "\n".join(parts))
    keep(path.with_suffix(".csv"), numbers(tables))
    import picture  # needs matplotlib, unlike the tables

    picture.draw(tables, path.with_suffix(".svg"))
