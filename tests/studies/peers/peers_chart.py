"""The chart docs/peers.svg: error against CPU time, a panel for each problem."""

import matplotlib.pyplot as plt

STYLES = {
    "Evolver, surface": ("tab:orange", "o", "-"),
    "Evolver, extrapolated": ("tab:orange", "x", ":"),
    "Evolver, not groomed": ("tab:red", "v", "-"),
    "Evolver, profile": ("tab:brown", "s", "-"),
    "Tubule, tier 2": ("tab:blue", "o", "-"),
    "Tubule, tier 1": ("tab:green", "s", "-"),
}


def draw(series, path):
    """Series: lists of rows by (problem, program, series), in the order of their lines."""
    plt.switch_backend("agg")
    plt.rcParams.update({"svg.hashsalt": "peers", "font.size": 9})
    figure, axes = plt.subplots(2, 2, figsize=(9, 7), layout="constrained")
    axis_of = dict(zip(dict.fromkeys(problem for problem, *_ in series), axes.flat))
    labels = {}
    for (problem, program, _), run in series.items():
        colour, marker, line = STYLES[program]
        x, y = [row["cpu_s"] for row in run], [abs(row["error"]) for row in run]
        (labels[program],) = axis_of[problem].loglog(x, y, color=colour, marker=marker, linestyle=line, ms=4, lw=1)
    for problem, axis in axis_of.items():
        of = "largest relative error of seven eigenvalues" if problem == "tube" else "relative error of the energy"
        axis.set(title=problem, xlabel="CPU seconds", ylabel=of, xlim=(5e-3, 100), ylim=(1e-13, 0.3))
        axis.grid(alpha=0.3)
    figure.legend(labels.values(), labels.keys(), loc="upper center", bbox_to_anchor=(0.5, 0), ncols=3)
    figure.savefig(path, metadata={"Date": None}, bbox_inches="tight")
