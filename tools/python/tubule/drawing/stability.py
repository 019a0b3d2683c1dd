"""Draws dispersion relations of a tube, with their thresholds, from the JSON of `tubule stability`."""

import json
import math
import sys

from matplotlib.figure import Figure
from matplotlib.transforms import blended_transform_factory

from . import command_line, style


def curve_label(m):
    return f"m = {m}" + {0: ", pearling", 1: ", buckling"}.get(m, "")


def largest_shown(curves):
    """The largest rate, at least 0. Without friction, m = 2 grows beyond all bounds at long waves; then four times
    the largest rate of shorter waves."""
    of_all = [rate for curve in curves for rate in curve["rate"] if rate is not None]
    of_short = [r for curve in curves for r in curve["rate"][len(curve["rate"]) // 2 :] if r is not None]
    highest, far = max([0.0, *of_all]), max([0.0, *of_short])
    return 4 * far if 0 < 20 * far < highest else highest


def rate_limits(models):
    """The range to show for each model: all growing waves, and about as much below zero."""
    limits = []
    for model in models:
        top = largest_shown(model["curves"])
        # Ovalisation may be infinitely fast without friction, so m = 0 sets the scale.
        lowest = min([rate for rate in model["curves"][0]["rate"] if rate is not None], default=-1.0)
        bottom = max(lowest, -2.0 * top) if top > 0 else lowest / 4
        limits.append((1.06 * bottom, 1.25 * top if top > 0 else -0.12 * bottom))
    return limits


def draw_model(axes, model, length, limits, colours):
    axes.axhline(0, color="0.6", lw=0.6, zorder=0)
    for curve, colour in zip(model["curves"], colours):
        rate = [math.nan if value is None else value for value in curve["rate"]]
        axes.plot(curve["q"], rate, color=colour, label=curve_label(curve["m"]), zorder=2)
        for q in curve["neutral"]:
            axes.plot([q], [0], marker="|", markersize=9, mew=1.2, color=colour, zorder=4)
        fits = [w for w in model["report"]["waves"] if w["m"] == curve["m"] and w["n"] is not None and w["rate"] is not None]
        axes.plot([w["q"] for w in fits], [w["rate"] for w in fits], ls="", marker="o", markersize=3.2, color=colour,
                  mfc="white", mew=0.9, zorder=3)
        fastest = model["report"]["fastest"][curve["m"]]
        if fastest["q"] is not None:
            axes.plot([fastest["q"]], [fastest["rate"]], marker="*", markersize=7, color=colour, zorder=5, clip_on=False)
    axes.set_xlim(0, model["curves"][0]["q"][-1])
    axes.set_ylim(*limits)
    axes.set_title(f"{model['title']}; tension {model['report']['tension']:.4g}")
    axes.set_xlabel("wave number q")


def draw_tensions(axes, data, colours):
    """The axis of tensions: the onset of growth for each m, the stable range, and the tensions of the models."""
    marks = [limit["tension"] for limit in data["thresholds"]] + [m["report"]["tension"] for m in data["models"]]
    low, high = min(marks), max(marks)
    pad = 0.18 * (high - low) or max(abs(high), 1.0)
    axes.set_xlim(low - pad, high + pad)
    axes.set_ylim(0, 1)
    if data["stable_tensions"]:
        # An open end is drawn to the edge of the panel.
        ends = [edge if value is None else value for value, edge in zip(data["stable_tensions"], axes.get_xlim())]
        axes.axvspan(*ends, color="0.9", zorder=0)
        axes.annotate("stable", (sum(ends) / 2, 0.5), ha="center", va="center", fontsize=6.5, color="0.35")
    for limit in data["thresholds"]:
        colour = colours[min(limit["m"], len(colours) - 1)]
        axes.axvline(limit["tension"], color=colour, lw=1)
        side = 1 if limit["grows"] == "above" else -1
        place = blended_transform_factory(axes.transData, axes.transAxes)
        axes.annotate("", (limit["tension"] + side * 0.06 * (high - low + pad), 0.5), (limit["tension"], 0.5),
                      xycoords=place, arrowprops={"arrowstyle": "->", "color": colour, "lw": 0.8})
        text = limit["name"] + (f", q = {limit['q']:.3g}" if limit["q"] > 0 else "")
        axes.annotate(text, (limit["tension"], 1), (0, 2 + 8 * (limit["m"] % 3)), textcoords="offset points",
                      xycoords=place, ha="center", va="bottom", fontsize=6.5, color=colour)
    for model, marker in zip(data["models"], "osD^"):
        axes.plot([model["report"]["tension"]], [0.22], marker=marker, color="k", markersize=4, ls="", clip_on=False,
                  label=model["report"]["model"])
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes.set_yticks([])
    axes.set_xlabel("tension")


def draw(data, outputs):
    """A panel for each model, below them the tensions at the onset of growth."""
    models = data["models"]
    columns = min(len(models), 2)
    rows = (len(models) + columns - 1) // columns
    tall = 2.45 * rows + 1.45
    figure = Figure(figsize=(style.WIDTH if columns > 1 else style.WIDTH * 0.72, tall))
    colours = style.line_colours(max(len(models[0]["curves"]), 2))
    for index, (model, limits) in enumerate(zip(models, rate_limits(models))):
        row, column = divmod(index, columns)
        left = 0.125 if columns == 1 else 0.09 + 0.49 * column
        width = 0.85 if columns == 1 else 0.40
        axes = figure.add_axes([left, (1.45 + 0.38 + 2.45 * (rows - 1 - row)) / tall, width, 1.72 / tall])
        draw_model(axes, model, data["length"], limits, colours)
        if column == 0:
            axes.set_ylabel("growth rate")
        if index == 0:
            axes.legend(loc="best")
    if data["thresholds"]:
        draw_tensions(figure.add_axes([0.125 if columns == 1 else 0.09, 0.42 / tall, 0.66, 0.5 / tall]), data, colours)
    style.save(figure, outputs)


def main():
    return command_line.main(__doc__, lambda _, outputs: draw(json.load(sys.stdin), outputs), None)
