"""Draws what the gradient term selects on tubes of radius 1 with H0 = -1: growing waves in two planes, and textures."""

import numpy as np
from matplotlib.figure import Figure

from . import command_line, style
from .results import read_result

LENGTH = 4.0  # the period of the textures
Q = (2 * np.pi / LENGTH) ** 2


def law(k40):
    """(kg - kg_c)/a^2 as the amplitude a vanishes, k20 = -1: docs/fourth_order.md."""
    at_1 = -np.polyval([48, -248, 468, -473, 231, -47, 3], Q) / (2 * (np.sqrt(Q) * (Q - 1) * (4 * Q - 1)) ** 2)
    return at_1 + 1.5 * (Q - 1) ** 2 / Q * (1 - k40)


def draw_unstable_curvature(axes):
    """k20 < 0: waves grow where q^2 + m^2 < |k20|/kg, R = 1: theory.md (5.28)."""
    length, kg = np.linspace(2, 12, 300), np.linspace(0.02, 2, 300)
    q2 = (2 * np.pi / length) ** 2
    for m, colour in zip((0, 1, 2), style.line_colours(3)):
        axes.plot(length, 1 / (q2 + m * m), color=colour, label=f"m = {m}")
        if m != 1:
            axes.fill_between(length, 0, 1 / (q2 + m * m), color=colour, alpha=0.08, linewidth=0)
    axes.set(xlim=(2, 12), ylim=(0, kg[-1]), xlabel="period $L/R$", ylabel=r"$k_g/(|k_{20}| R^2)$",
             title=r"$k_{20} < 0$: waves of this period grow below")
    axes.legend()


def draw_unstable_K(axes):
    """k20 > 0 > k42, m = 0: G = 2 k20 (x - 1)^2 + 2 k42 x^2 + 2 kg x (x - 1)^2, x = (q R)^2."""
    kg, k42 = np.meshgrid(np.geomspace(1e-3, 1, 240), np.linspace(-4, 0, 240))
    x = np.geomspace(1e-2, 1e4, 1500)
    G = [(x - 1) ** 2 * (1 + g * x) + k * x**2 for g, k in zip(kg.ravel(), k42.ravel())]
    least = np.array([x[np.argmin(row)] if row.min() < 0 else np.nan for row in G]).reshape(kg.shape)
    filled = axes.contourf(kg, k42, 2 * np.pi / np.sqrt(least), levels=np.arange(1, 6.6, 0.5), cmap="viridis", extend="both")
    axes.figure.colorbar(filled, ax=axes, label="length of the fastest wave $/R$")
    axes.set(xscale="log", xlabel=r"$k_g/(k_{20} R^2)$", ylabel=r"$k_{42}/(k_{20} R^2)$",
             title=r"$k_{20} > 0$, $k_{42} < 0$: the wave that grows fastest, $m = 0$")


def draw_textures(axes, results):
    for result, colour in zip(results, style.line_colours(len(results))):
        series, k40 = result.series, result.case["energy"]["k40"]
        on = (series["branch"] == 1) & (abs(series["r_middle"] - 1) > 1e-3)
        axes.plot(np.append(1 / Q, series["parameter"][on]), np.append(0, abs(series["r_middle"][on] - 1)), color=colour,
                  marker=".", label=f"$k_{{40}} = {k40:g}\\,|k_{{20}}| R^2$")
        a = np.linspace(0, 0.12, 50)
        axes.plot(1 / Q + law(k40) * a**2, a, color=colour, linestyle=":")
    axes.axvline(1 / Q, color="0.7", linewidth=0.8)
    axes.set(xlim=(1 / Q - 0.02, 1 / Q + 0.02), ylim=(0, 0.2), xlabel=r"$k_g/(|k_{20}| R^2)$", ylabel=r"$|r(0) - R|/R$",
             title=f"Textures of period {LENGTH:g} R; dotted: weakly nonlinear")
    axes.legend()


def draw(paths, outputs):
    figure = Figure(figsize=(style.WIDTH, 9.5), layout="constrained")
    above, middle, below = figure.subplots(3, 1)
    draw_unstable_curvature(above)
    draw_unstable_K(middle)
    draw_textures(below, [read_result(path) for path in paths])
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, draw, "results", "+")
