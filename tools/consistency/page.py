"""The page docs/consistency.md, its table and its picture."""

import csv
import io
from pathlib import Path

from runs import keep


def table(scene):
    """A scene in Markdown."""
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
    """Everything at every time, as CSV."""
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

READING = """**In short.** Where a start is smooth both tiers say the same, and what they differ by vanishes as the mesh is
refined. On the finest meshes here integrals at rest differ by {at_rest} at most, rates of small waves by {rates},
energies in motion by {motion} of E_ref at all output times ({figure} for the figure's tube, {equilibrium} where the cell
comes to rest), what was dissipated by {dissipated}, shapes in motion by {shapes} of their size.

**What limits it.** *At rest* the recovery of curvature: integrals are of order 5 and more; values at single points, such
as the extremes of H and K ({extremes}), are far less accurate than integrals. *In motion* the time steps of 3D: of waves
at rest the fixed step leaves (rate x step)^2/3, the rest follows the tolerance. *At the first moment* the force: it
takes four derivatives of the surface, so that of an interpolated start a part of it is noise of the size of triangles.
By it the overdamped tube dissipates {noise_coarse} times too much on the coarsest mesh and {noise_fine} times on the
finest, where its smooth waves begin right to {waves}. Without inertia the noise is gone in a moment.
A fluid seems to keep it as waves of little energy that show in what is taken at a point or an instant: its largest speed and lambda differ by up to {pointwise}.

**Where they part.** *Where curvature jumps*, at the seams of the capsule: its energy at rest is off by {seams} and falls
with the first order at best, extremes of H and K not at all; as a fluid it sends out waves that no mesh resolves, and
energies differ by {capsule}, where tier 1 itself is known to {capsule_known} only.
*Least and largest radius* are those of nodes in 3D, hence without an order; of closed surfaces they are something else
(distances from the centre, in tier 1 from the axis), so not compared."""

HEAD = """# Do both tiers say the same?

Every quantity that tier 1 (`axisym`) and tier 3D (`surface3d`) can both compute, on the same starts. This page, [all
numbers](consistency.csv) and the picture are made by

    tools/figures consistency        # {minutes:.0f} minutes of one core

which ends with status 1 if a difference exceeds its bound. Do not edit them: the texts are in `tools/consistency/`.

{reading}

![Differences between the tiers against the number of triangles; dotted: fourth order in the mesh width](consistency.svg)

## How to read the tables

- *Tier 1* is asked for an accuracy far beyond that of 3D; the last value is shown if there are several times.
- *Its error* is what it states for the energy; for all else, how far a run asked for ten times less is from it. Where an
  exact value is named, that is the reference and the error is zero.
- *T* triangles of order 4. *Differences* are the largest of all output times (in `consistency.csv` each by itself),
  relative to E_ref for energies and for what was dissipated, to the size of the shape for distances (radius of the
  sphere of the same area, or of the tube), to 4 pi for INT K, else to the largest value of tier 1.
- *Order* is that of the difference in the mesh width, to the finest mesh from the one with the largest difference (the coarsest, unless it is
  right by accident); empty where tier 1's error or rounding would decide it. The tolerance of the time steps falls with T^-3, so that errors in time fall as those in
  space should, with the fourth power of the mesh width; fixed steps (rates) are the same on all meshes.
- *Bound*: more than that on the finest mesh fails the command, and so does an order below 1 if more than a tenth of the
  bound is left (but for extremes, and where curvature jumps). Empty: only told.
- *CPU seconds* of one thread, in 3D with the coarser run that it makes for its own error; the machine was busy.
"""


INTEGRALS = ("area", "volume", "energy", "energy_20", "energy_40", "energy_42", "integral_K")
AT_REST = ("tube-at-rest", "spheroid-at-rest")
INERTIAL = ("waves-fluid", "rotation", "spheroid-fluid")
MOVING = ("figure", "waves-overdamped", "waves-stokes", *INERTIAL)
RATES = ("rates-gradient-flow", "rates-overdamped", "rates-stokes", "rates-pearling", "rates-buckling")


def reading(tables):
    """What the tables say, in words."""

    def largest(scenes, *quantities, what=lambda row: row.difference(row.meshes[-1])):
        """Of such rows, all if none are named; differences on the finest meshes."""
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
    """PATH, and beside it the same name with .csv and .svg."""
    path = Path(path)
    parts = [HEAD.format(reading=reading(tables), minutes=sum(scene.cost.total for scene in tables) / 60)]
    for scene in tables:
        parts.append(f"## {scene.title}\n\n{scene.words}\n\n{table(scene)}\n")
    keep(path, "\n".join(parts))
    keep(path.with_suffix(".csv"), numbers(tables))
    import picture  # needs matplotlib, which tables do not

    picture.draw(tables, path.with_suffix(".svg"))
