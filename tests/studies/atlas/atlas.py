#!/usr/bin/python3
"""Maps of where each method is right, and where it stops being right.

    atlas.py TUBULE FOLDER [MAP...] [--jobs N] [--levels N] [--across N] [--again] [--known FOLDER]

A point of a map is a case that the program runs; it is judged against the truth (judging.py). A coarse lattice comes first,
then the lines between regions are followed. FOLDER/MAP.csv gets a row a point as soon as it is judged: what is there
is not run again, but with --again. --levels and --across make other lattices than the maps have. At the end: the counts, and exit status 1 if anything is silent that the tables
of --known do not have as silent.
"""

import argparse
import collections
import concurrent.futures
import csv
import dataclasses
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fuzz"))
from judging import KINDS, Judgement  # noqa: E402
from lattice import follow, fraction, read_table  # noqa: E402
from maps import MAPS  # noqa: E402
from sandbox import Finding, Sandbox  # noqa: E402

COLUMNS = ("variant", "i", "j", "x", "y", "kind", "stop", "error", "stated")


def silent(rows):
    return {(r["variant"], r["i"], r["j"]) for r in rows if r["kind"] == "silent"}


class Table:
    """The points of one map that are judged, in a file."""

    def __init__(self, path, chart):
        self.path, self.chart = path, chart
        self.rows = read_table(path)
        if not path.exists():
            path.write_text(",".join(COLUMNS) + "\n")

    def known(self, variant):
        return {(int(r["i"]), int(r["j"])): f"{r['kind']}: {r['stop']}" for r in self.rows if r["variant"] == variant}

    def add(self, variant, point, judgement):
        x, y = self.place(point)
        shown = ("" if v is None else f"{v:.3g}" for v in (judgement.error, judgement.stated))
        values = (variant, *point, x, y, judgement.kind, judgement.stop, *shown)
        self.rows.append(dict(zip(COLUMNS, map(str, values))))
        with open(self.path, "a", newline="") as file:
            csv.writer(file, lineterminator="\n").writerow(values)

    def place(self, point):
        return [axis.value(fraction(k, self.chart.across)) for axis, k in zip((self.chart.x, self.chart.y), point)]


def judge(program, chart, variant, place):
    with tempfile.TemporaryDirectory() as top:
        try:
            return chart.judge(Sandbox(program, Path(top) / "point"), variant, *place)
        except Finding as finding:
            return Judgement("silent", finding.kind)


def make(program, table, chart, pool):
    for variant in chart.variants:
        def judged(points):
            waiting = [pool.submit(judge, program, chart, variant, table.place(p)) for p in points]
            sorts = []
            for point, future in zip(points, waiting):
                table.add(variant, point, future.result())
                sorts.append(future.result().sort)
            return sorts

        follow(table.known(variant), judged, chart.across, chart.levels)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("maps", nargs="*", choices=[[], *MAPS], default=[])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--levels", type=int)
    parser.add_argument("--across", type=int)
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--known", type=Path)
    a = parser.parse_args()
    a.folder.mkdir(parents=True, exist_ok=True)
    total, news = collections.Counter(), 0
    with concurrent.futures.ThreadPoolExecutor(a.jobs) as pool:
        for name in a.maps or MAPS:
            chart = dataclasses.replace(MAPS[name], **{k: v for k in ("across", "levels") if (v := getattr(a, k)) is not None})
            path = a.folder / f"{name}.csv"
            if a.again:
                path.unlink(missing_ok=True)
            table = Table(path, chart)
            make(a.program.resolve(), table, chart, pool)
            counts = collections.Counter(row["kind"] for row in table.rows)
            total += counts
            news += len(silent(table.rows) - silent(read_table(a.known / f"{name}.csv") if a.known else []))
            print(f"{name}: {len(table.rows)} judged, " + ", ".join(f"{counts[k]} {k}" for k in KINDS if counts[k]), flush=True)
    print(f"all: {sum(total.values())} judged, " + ", ".join(f"{total[k]} {k}" for k in KINDS))
    return 1 if news else 0


if __name__ == "__main__":
    sys.exit(main())
