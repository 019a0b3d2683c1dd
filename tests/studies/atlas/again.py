#!/usr/bin/python3
"""Judges points of known tables again, drawn at random, and lists those whose verdict has changed.

    again.py TUBULE FOLDER --tier axisym --count 300 --seed 1

Exit status 1 if a point is silent that was not.
"""

import argparse
import random
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from atlas import judge
from lattice import read_table
from maps import MAPS


def place(chart, row):
    return [int(row[k]) if axis.whole else float(row[k]) for axis, k in ((chart.x, "x"), (chart.y, "y"))]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--tier", default="axisym", choices=sorted({chart.tier for chart in MAPS.values()}))
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    a = parser.parse_args()
    known = [(name, row) for name, chart in MAPS.items() if chart.tier == a.tier for row in read_table(a.folder / f"{name}.csv")]
    drawn = random.Random(a.seed).sample(known, min(a.count, len(known)))
    program, changed, silent = a.program.resolve(), 0, 0
    with ThreadPoolExecutor(a.jobs) as pool:
        now = pool.map(lambda n: judge(program, MAPS[n[0]], n[1]["variant"], place(MAPS[n[0]], n[1])), drawn)
        for (name, row), found in zip(drawn, now):
            if (found.kind, found.stop) != (row["kind"], row["stop"]):
                changed += found.kind != row["kind"]
                silent += found.kind == "silent" != row["kind"]
                print(f"{name} {row['variant']} {row['x']} {row['y']}: {row['kind']}, {row['stop']} -> {found.kind}, {found.stop}", flush=True)
    print(f"{len(drawn)} judged again, seed {a.seed}: {changed} verdicts changed, {silent} of them silent now")
    return 1 if silent else 0


if __name__ == "__main__":
    sys.exit(main())
