"""The page docs/consistency.md, its table and its picture."""

import csv
import io
import textwrap
from pathlib import Path


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


INTEGRALS = ("area", "volume", "energy", "energy_20", "energy_40", "energy_42", "integral_K")
AT_REST = ("tube-at-rest", "spheroid-at-rest")
INERTIAL = ("waves-fluid", "rotation", "spheroid-fluid")
MOVING = ("figure", "waves-overdamped", "waves-stokes", *INERTIAL)
RATES = ("rates-gradient-flow", "rates-overdamped", "rates-stokes", "rates-pearling", "rates-buckling")


def head(tables):
    """The head of the page: the text of page.txt with the numbers of the tables."""

    def largest(scenes, *quantities, what=lambda row: row.difference(row.meshes[-1])):
        """Largest value over these rows (all if none are named), by default of the difference on the finest mesh."""
        found = [
            what(row)
            for scene in tables
            for row in scene.rows
            if scene.name in scenes and row.found and (row.quantity in quantities or not quantities)
        ]
        return f"{max(found):.2g}" if found else "(not run)"

    return (Path(__file__).parent / "page.txt").read_text().format(
        minutes=sum(scene.cost.total for scene in tables) / 60,
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
    parts = [head(tables)]
    for scene in tables:
        parts.append(f"## {scene.title}\n\n{textwrap.fill(scene.words, 118)}\n\n{table(scene)}\n")
    path.write_text("\n".join(parts))
    path.with_suffix(".csv").write_text(numbers(tables))
    import picture  # needs matplotlib, unlike the tables

    picture.draw(tables, path.with_suffix(".svg"))
