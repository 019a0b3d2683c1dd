#!/usr/bin/python3
"""The tables of docs/choosing.md say what the measurements do: docs/both_tiers/*.csv, docs/model_differences.csv.

    choosing_test.py SOURCES             compares
    choosing_test.py SOURCES --update    writes the tables again

A table stands between `<!-- NAME -->` and the next `<!-- end -->`."""

import csv
import re
import sys
import unittest
from pathlib import Path

SOURCES = Path(sys.argv[1]).resolve()
PAGE = SOURCES / "docs/choosing.md"
SCENES = ("tube", "neck", "vesicle", "smooth_fluid", "rough_fluid")
MODELS = {"tube": "gradient-flow", "neck": "gradient-flow", "smooth_fluid": "fluid", "rough_fluid": "fluid"}
SCHEMES = {"fluid": "alpha"}  # by default, else bdf2
TARGETS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8)


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def target_name(target):
    return f"{target:.0e}".replace("e-0", "e-")


def seconds(value):
    return f"{value:.2f}" if value < 1 else f"{float(f'{value:.2g}'):g}"


def spread(values):
    low, high = min(values), max(values)
    return f"{low}" if low == high else f"{low} to {high}"


def times():
    """A row for each series: the least CPU time of its runs whose true error is at most so large."""
    yield "| scene | tier | model | scheme | elements | " + " | ".join(map(target_name, TARGETS)) + " |"
    yield "|---" * (5 + len(TARGETS)) + "|"
    for scene in SCENES:
        rows = read(SOURCES / f"docs/both_tiers/{scene}.csv")
        known_to = max([float(r["stated_error"]) for r in rows if r["series"] == "reference"], default=0)
        for series in dict.fromkeys(r["series"] for r in rows if r["series"] != "reference"):
            runs = [r for r in rows if r["series"] == series and r["outcome"] == "finished"]
            cells = [scene.replace("_", " "), *settings(scene, series, runs), spread([int(r["elements"]) for r in runs]) if runs else ""]
            for target in TARGETS:
                enough = [float(r["cpu_s"]) for r in runs if max(float(r["error"]), known_to) <= target]
                cells.append(seconds(min(enough)) if enough else "")
            yield "| " + " | ".join(cells) + " |"


def settings(scene, series, runs):
    """Tier, model, scheme of a series, which is called "tier", "tier, model" or "tier, scheme"."""
    tier, _, kind = series.partition(", ")
    model = MODELS.get(scene, kind)
    scheme = kind if scene in MODELS and kind else SCHEMES.get(model, "bdf2")
    by_default = all(r["settings"].startswith("energy=") for r in runs)
    return tier, model, "" if tier == "axisym" else scheme + ", by default" * by_default


def differences():
    """Stokes and overdamped paths of the vesicle, in percent of the fall of its energy."""
    rows = {(r["Re"], r["gamma"]): r for r in read(SOURCES / "docs/model_differences.csv") if r["scene"] == "vesicle"}
    gammas = list(dict.fromkeys(gamma for _, gamma in rows))
    yield "| Re | " + " | ".join(f"gamma = {gamma}" for gamma in gammas) + " |"
    yield "|---" * (1 + len(gammas)) + "|"
    for Re in dict.fromkeys(Re for Re, _ in rows):
        yield f"| {Re} | " + " | ".join(percents(rows[Re, gamma]) for gamma in gammas) + " |"


def percents(row):
    return ", ".join(f"{100 * float(row[m]) / float(row['fall']):.1f} %" if row[m] else "none" for m in ("stokes", "overdamped"))


def ratios():
    """How far what is expected is from what is measured, over all scenes."""
    yield "| scene | Stokes: expected/measured | overdamped: expected/measured |"
    yield "|---|---|---|"
    rows = read(SOURCES / "docs/model_differences.csv")
    for scene in dict.fromkeys(r["scene"] for r in rows):
        own = [[float(r[f"{m}_expected"]) / float(r[m]) for r in rows if r["scene"] == scene and r[m]] for m in ("stokes", "overdamped")]
        yield f"| {scene} | " + " | ".join(f"{min(one):.1f} to {max(one):.1f}" for one in own) + " |"


def current():
    text = PAGE.read_text()
    for make in (times, differences, ratios):
        new = f"<!-- {make.__name__} -->\n\n" + "\n".join(make()) + "\n\n<!-- end -->"
        text, found = re.subn(f"<!-- {make.__name__} -->.*?<!-- end -->", lambda _: new, text, flags=re.S)
        assert found == 1, f"{PAGE} has no <!-- {make.__name__} --> ... <!-- end -->"
    return text


class Choosing(unittest.TestCase):
    def test_tables_are_those_of_the_measurements(self):
        self.assertEqual(PAGE.read_text(), current(), f"run {Path(__file__).name} SOURCES --update")


if __name__ == "__main__":
    if "--update" in sys.argv:
        PAGE.write_text(current())
    else:
        unittest.main(argv=sys.argv[:1])
