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

READING = """**In short.** Where a start is smooth both tiers say the same, and what they differ by vanishes as the mesh is refined. On the finest
meshes here integrals at rest differ by {at_rest} at most, rates of small waves by {rates}, energies in motion by
{motion} of E_ref at all output times ({figure} for the figure's tube), shapes in motion by {shapes} of their size.

**What limits it.** At rest the recovery of curvature: integrals are of order 5 and more; values at single points, such as the extremes of
H and K ({extremes}), are far less accurate than integrals and say so only slowly. In motion the time steps of 3D. In the first moments the force: it takes four derivatives of
the surface, so of an interpolated start a part of it is noise of the size of a triangle. That part dissipates several times what the smooth force does on 80 triangles of the
tube and percents of it on 300, at order 6 to 8; smooth waves begin right from the start. Without inertia the noise is gone in a moment, a fluid keeps it as waves of little energy.

**Where they part.** Where curvature jumps, at the seams of the capsule: its energy at rest is off by {seams} and falls with the first order at best, extremes of H and K not
at all; as a fluid it sends out waves that neither tier resolves, and energies differ by {capsule}. Where it comes to rest they agree again, to {equilibrium}.
Of a model without inertia the first row in 3D has neither velocity nor dissipation, as none is known before the first step, so what was dissipated lacks half of that step: {dissipated} at most, and hardly less on finer meshes.
Least and largest radius are those of nodes in 3D, and of closed surfaces something else (distances from the centre, not from the axis), so not compared there."""

HEAD = """# Do both tiers say the same?

Every quantity that tier 1 (`axisym`) and tier 3D (`surface3d`) can both compute, on the same starts. This page, [all
numbers](consistency.csv) and the picture are made by

    tools/figures consistency        # about ten minutes of one core

which ends with status 1 if a difference exceeds its bound. Do not edit them: the texts are in `tools/consistency/`.

{reading}

![Differences between the tiers against the number of triangles](consistency.svg)

## How to read the tables

- *Tier 1* is asked for an accuracy far beyond that of 3D; the last value is shown if there are several times.
- *Its error* is what it states for the energy; for all else, how far a run asked for ten times less is from it. Where an
  exact value is named, that is the reference and the error is zero.
- *T* triangles of order 4. *Differences* are the largest of all output times (in `consistency.csv` each by itself), relative to
  E_ref for energies and for what was dissipated, to the size of the shape for distances (radius of the sphere of the same area, or of the
  tube), to 4 pi for INT K, else to the largest value of tier 1.
- *Order* is that of the difference in the mesh width, from the coarsest to the finest mesh; empty where tier 1's error or rounding would decide
  it. The tolerance of the time steps falls with T^-3, so that errors in time fall as those in space should, with the fourth power of the
  mesh width; of fixed steps the length falls with the mesh width.
- *Bound*: more than that on the finest mesh, or an order below 1 (but for extremes, and where curvature jumps), fails the command. Empty: only told.
- *CPU seconds* of one thread, tier 3D with the coarser run that it makes for its own error; the machine was busy.
"""


INTEGRALS = ("area", "volume", "energy", "energy_20", "energy_40", "energy_42", "integral_K")
SMOOTH = ("figure", "waves-overdamped", "waves-stokes", "waves-fluid", "rotation", "spheroid-fluid")


def reading(tables):
    """What the tables say, in words."""
    return READING.format(
        at_rest=_worst(tables, lambda scene, row: scene.endswith("-at-rest") and "capsule" not in scene and row.quantity in INTEGRALS),
        extremes=_worst(tables, lambda scene, row: scene.endswith("-at-rest") and "capsule" not in scene and row.quantity[:3] in ("min", "max")),
        rates=_worst(tables, lambda scene, row: scene.startswith("rates-")),
        figure=_worst(tables, lambda scene, row: scene == "figure" and row.quantity == "energy"),
        motion=_worst(tables, lambda scene, row: scene in SMOOTH and row.quantity == "energy"),
        shapes=_worst(tables, lambda scene, row: scene in SMOOTH and row.quantity == "shape, Hausdorff"),
        dissipated=_worst(tables, lambda scene, row: scene in SMOOTH and row.quantity == "dissipated"),
        capsule=_worst(tables, lambda scene, row: scene == "capsule-fluid" and row.quantity == "energy"),
        seams=_worst(tables, lambda scene, row: scene == "capsule-at-rest" and row.quantity == "energy"),
        equilibrium=_worst(tables, lambda scene, row: scene == "capsule-equilibrium" and row.quantity == "energy"),
    )


def _worst(tables, wanted):
    """The largest difference on the finest meshes of such rows."""
    found = [row.difference(row.meshes[-1]) for scene in tables for row in scene.rows if row.found and wanted(scene.name, row)]
    return f"{max(found):.1e}" if found else "(not run)"


def write(path, tables):
    """PATH, and beside it the same name with .csv and .svg."""
    path = Path(path)
    parts = [HEAD.format(reading=reading(tables))]
    for scene in tables:
        parts.append(f"## {scene.title}\n\n{scene.words}\n\n{table(scene)}\n")
    keep(path, "\n".join(parts))
    keep(path.with_suffix(".csv"), numbers(tables))
    import picture  # needs matplotlib, which tables do not

    picture.draw(tables, path.with_suffix(".svg"))
