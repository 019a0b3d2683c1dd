"""Differences against triangles: shapes at rest, rates, and the energies of what moves."""

from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter
from tubule.drawing import style  # on the path since runs.Program

HEIGHT = 3.6  # inches
COLOURS = ("#000000", "#e69f00", "#56b4e9", "#009e73", "#0072b2", "#d55e00", "#cc79a7")  # of Okabe and Ito; then dashed
PANELS = (
    ("energy at rest", "-at-rest", lambda row: row.quantity == "energy"),
    ("rates of small waves", "rates-", lambda row: bool(row.found)),
    ("energy in motion, largest", "", lambda row: row.quantity == "energy" and len(row.times) > 1),
)


def draw(tables, path):
    style.apply()
    plt = style.plt
    figure, panels = plt.subplots(1, len(PANELS), figsize=(style.WIDTH, HEIGHT), sharey=True, layout="constrained")
    for axes, (title, part, wanted) in zip(panels, PANELS):
        lines = []
        for scene in tables:
            for row in scene.rows:
                if part in scene.name and wanted(row):
                    name = scene.name.removesuffix("-at-rest").removeprefix("rates-")
                    lines.append((f"{name} {row.quantity}" if part == "rates-" else name, row))
        for i, (label, row) in enumerate(lines):
            colour, dashes = COLOURS[i % len(COLOURS)], ("-", "--")[i // len(COLOURS) % 2]
            axes.loglog(row.meshes, [row.difference(t) for t in row.meshes], color=colour, label=label, ls=dashes,
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
