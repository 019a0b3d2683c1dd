#!/usr/bin/python3
"""Writes the counts of judged points into a page: page.py FOLDER PAGE. What stands between `<!-- counts -->` or
`<!-- silent -->` and the next `<!-- end -->` of the page is replaced by a table made of FOLDER/MAP.csv."""

import argparse
import collections
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fuzz"))
from judging import KINDS  # noqa: E402
from lattice import FINEST, read_table  # noqa: E402
from maps import MAPS  # noqa: E402


def counts(tables):
    yield "| map | tier | points | " + " | ".join(KINDS) + " |"
    yield "|---" * (3 + len(KINDS)) + "|"
    for tier in sorted({MAPS[name].tier for name in tables}):
        total = collections.Counter()
        for name, rows in tables.items():
            if MAPS[name].tier == tier:
                found = collections.Counter(row["kind"] for row in rows)
                found["undecided"] += missing(MAPS[name], rows)
                total += found
                yield line(f"`{name}`", tier, found)
        yield line("**all**", tier, total)


def missing(chart, rows):
    """The points of the coarse lattice without a row: they exceeded the time."""
    judged = {(row["variant"], int(row["i"]), int(row["j"])) for row in rows}
    places = range(0, FINEST * chart.across + 1, FINEST)
    return sum((variant, i, j) not in judged for variant in chart.variants for i in places for j in places)


def line(name, tier, found):
    return f"| {name} | {tier} | {found.total()} | " + " | ".join(str(found[k] or "") for k in KINDS) + " |"


def silent(tables):
    yield "| map | variant | point | error | stated |"
    yield "|---|---|---|---|---|"
    for name, rows in tables.items():
        chart = MAPS[name]
        for r in rows:
            if r["kind"] == "silent":
                yield f"| `{name}` | {r['variant']} | {chart.x.key} {r['x']}, {chart.y.key} {r['y']} | {r['error']} | {r['stated']} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("page", type=Path)
    a = parser.parse_args()
    tables = {name: rows for name in MAPS if (rows := read_table(a.folder / f"{name}.csv"))}
    text = a.page.read_text()
    for name, lines in (("counts", counts(tables)), ("silent", silent(tables))):
        new = f"<!-- {name} -->\n\n" + "\n".join(lines) + "\n\n<!-- end -->"
        text, found = re.subn(f"<!-- {name} -->.*?<!-- end -->", lambda _: new, text, flags=re.S)
        if found != 1:
            sys.exit(f"{a.page}: has no <!-- {name} --> ... <!-- end -->")
    a.page.write_text(text)


if __name__ == "__main__":
    main()
