#!/usr/bin/python3
"""Both tiers on the same test cases: their differences, the convergence with the mesh width, and the cost.

    consistency.py TUBULE FOLDER [-o docs/consistency.md]     minutes; results are kept in FOLDER
    consistency.py TUBULE FOLDER --only figure --only rotation

Exits with status 0 if all differences are within their bounds, 1 if not, 2 if a run fails. With -o it writes the page,
its table (.csv) and its picture (.svg). `tools/figures consistency` calls it.
"""

import argparse
import csv
import sys
import textwrap
from pathlib import Path

from measures import Failed, Program
from scenes import EXTREMES, SCENES

ELEMENTS = (80, 180, 320)  # of spheres: icosahedra whose edges are cut in 2, 3, 4
INITIAL_SHAPES = ("tube-shape", "spheroid-shape")
INERTIAL = ("waves-fluid", "rotation", "spheroid-fluid")
MOVING = ("figure", "waves-overdamped", "waves-stokes", *INERTIAL)
COLOURS = ("#000000", "#e69f00", "#56b4e9", "#009e73", "#0072b2", "#d55e00", "#cc79a7")  # of Okabe and Ito; then dashed
PANELS = (
    ("energy of initial shapes", "-shape", lambda row: row.quantity == "energy"),
    ("rates of small waves", "rates-", lambda row: bool(row.found)),
    ("energy in motion, largest", "", lambda row: row.quantity == "energy" and len(row.times) > 1),
)


def table(scene):
    """The table of a scene in Markdown."""
    meshes = sorted({triangles for row in scene.rows for triangles in row.found})
    rows = [["quantity", "tier 1", "its error", *(f"T = {triangles}" for triangles in meshes), "order", "bound"]]
    for row in scene.rows:
        name = f"{row.quantity}, largest of {len(row.times)} times" if len(row.times) > 1 else row.quantity
        found = [f"{row.difference(triangles):.1e}" if triangles in row.found else "" for triangles in meshes]
        order, bound = "" if row.order is None else f"{row.order:.1f}", "" if row.bound is None else f"{row.bound:.0e}"
        rows.append([name, f"{row.reference[-1]:.9g}", f"{row.error:.0e}" if row.error else "exact", *found, order, bound])
    cost = [f"{scene.cost.get(triangles, 0):.3g}" for triangles in meshes]
    rows.append(["*CPU s*", f"{scene.cost.get(None, 0):.2g}", "", *cost, "", ""])
    lines = ["| " + " | ".join(cells) + " |" for cells in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])


def numbers(scenes):
    """All values at all times, as rows of a CSV."""
    yield "scene", "quantity", "time", "triangles", "tier_1", "error_of_tier_1", "tier_3d", "difference", "bound"
    for scene, row in ((scene, row) for scene in scenes for row in scene.rows):
        for triangles in row.meshes or [None]:
            for i, time in enumerate(row.times):
                reference, value = row.reference[i], row.found[triangles][i] if triangles else None
                found = [f"{value:.12g}", f"{abs(value - reference) / row.scale:.4e}"] if triangles else ["", ""]
                yield (scene.name, row.quantity, f"{time:g}", triangles or "", f"{reference:.12g}", f"{row.error:.1e}", *found,
                       "" if row.bound is None else row.bound)  # fmt: skip


def head(scenes):
    """The head of the page: the text of page.txt with the numbers of the scenes."""

    def largest(names, *quantities, what=lambda row: row.difference(row.meshes[-1])):
        """Largest value over these rows (all if none are named), by default of the difference on the finest mesh."""
        rows = [row for scene in scenes for row in scene.rows if scene.name in names]
        found = [what(row) for row in rows if row.found and (row.quantity in quantities or not quantities)]
        return f"{max(found):.2g}" if found else "(not run)"

    return (Path(__file__).parent / "page.txt").read_text().format(
        minutes=sum(sum(scene.cost.values()) for scene in scenes) / 60,
        initial=largest(INITIAL_SHAPES, "area", "volume", "energy", "energy_20", "energy_40", "energy_42", "integral_K"),
        extremes=largest(INITIAL_SHAPES, *EXTREMES),
        rates=largest([scene.name for scene in scenes if scene.name.startswith("rates-")]),
        motion=largest(MOVING, "energy"),
        figure=largest(("figure",), "energy"),
        equilibrium=largest(("capsule-equilibrium",), "energy"),
        shapes=largest(MOVING, "shape, Hausdorff"),
        noise_coarse=largest(("tube-begins",), "overdamped, dissipation", what=lambda row: row.difference(row.meshes[0])),
        noise_fine=largest(("tube-begins",), "overdamped, dissipation"),
        waves=largest(("tube-begins",), "overdamped, wave 1", "overdamped, wave 2"),
        pointwise=largest(INERTIAL, "speed", "lambda"),
        seams=largest(("capsule-shape",), "energy"),
        capsule=largest(("capsule-fluid",), "energy"),
        capsule_known=largest(("capsule-fluid",), "energy", what=lambda row: row.error),
        dissipated=largest(MOVING, "dissipated"),
    )


def draw(scenes, path):
    """Differences against triangles: fixed shapes, rates, and the energies of what moves."""
    from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter
    from tubule.drawing import style  # on the path since measures.Program

    style.apply()
    plt = style.plt
    figure, panels = plt.subplots(1, len(PANELS), figsize=(style.WIDTH, 3.6), sharey=True, layout="constrained")
    for axes, (title, part, wanted) in zip(panels, PANELS):
        rows = [(scene, row) for scene in scenes for row in scene.rows if part in scene.name and wanted(row)]
        for i, (scene, row) in enumerate(rows):
            name = scene.name.removesuffix("-shape").removeprefix("rates-")
            axes.loglog(row.meshes, [row.difference(t) for t in row.meshes], color=COLOURS[i % len(COLOURS)],
                        label=f"{name} {row.quantity}" if part == "rates-" else name, ls=("-", "--")[i // len(COLOURS) % 2],
                        marker=style.MARKERS[i % len(style.MARKERS)])  # fmt: skip
        axes.loglog([100, 400], [1e-3, 1e-3 / 16], color="0.6", lw=0.6, ls=":")  # fourth order in the mesh width
        axes.set(title=title, xlabel="triangles")
        axes.xaxis.set_major_locator(FixedLocator([100, 200, 400, 1000]))
        axes.xaxis.set_major_formatter(ScalarFormatter())
        axes.xaxis.set_minor_locator(NullLocator())
        axes.legend(fontsize=5.5, labelspacing=0.2, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=2)
    panels[0].set_ylabel("relative difference of the tiers")
    style.save(figure, [path])
    plt.close(figure)


def write(path, scenes):
    """Writes the page and, beside it, the same name with .csv and .svg."""
    parts = (f"## {scene.title}\n\n{textwrap.fill(scene.words, 118)}\n\n<!-- numbers -->\n\n{table(scene)}\n\n<!-- end -->\n"
             for scene in scenes)  # fmt: skip
    path.write_text("\n".join([head(scenes), *parts]))
    with open(path.with_suffix(".csv"), "w") as file:
        csv.writer(file, lineterminator="\n").writerows(numbers(scenes))
    draw(scenes, path.with_suffix(".svg"))


def main(arguments, scenes):
    """The exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tubule", type=Path, help="the program")
    parser.add_argument("folder", type=Path, help="for results; existing ones of this program are reused")
    parser.add_argument("-o", "--output", type=Path, help="the page; needs all test cases")
    parser.add_argument("--only", action="append", choices=[scene.name for scene in scenes], metavar="CASE")
    options = parser.parse_args(arguments)
    if options.only and options.output:
        parser.error("a page needs all test cases: -o and --only exclude each other")
    program, failed, complaints = Program(options.tubule, options.folder, ELEMENTS), False, []
    for scene in scenes:
        if options.only and scene.name not in options.only:
            continue
        print(f"{scene.name}: {scene.title}", flush=True)
        try:
            scene.run(program)
            print(table(scene), flush=True)
            complaints += scene.complaints()
        except Failed as failure:
            print(f"\nconsistency: {failure}", file=sys.stderr, flush=True)
            failed = True
    if options.output and not failed:
        write(options.output, scenes)
    for complaint in complaints:
        print(f"consistency: {complaint}", file=sys.stderr)
    return 2 if failed else 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], SCENES))
