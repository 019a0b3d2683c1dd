#!/usr/bin/python3
"""Both tiers on the same scenes: their differences, the convergence with the mesh width, and the cost.

    consistency.py TUBULE FOLDER [-o docs/consistency.md]     minutes; results are kept in FOLDER
    consistency.py TUBULE FOLDER --only figure --only rotation

Exits with status 0 if all differences are within their bounds, 1 if not, 2 if a run fails. With -o it writes the page,
its table (.csv) and its picture (.svg). `tools/figures consistency` calls it.
"""

import argparse
import sys
from pathlib import Path

import page
from measures import Tools
from runs import Failed, Program
from scenes import SCENES

ELEMENTS = (80, 180, 320)  # of spheres: icosahedra whose edges are cut in 2, 3, 4


def main(arguments, scenes):
    """The exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tubule", type=Path, help="the program")
    parser.add_argument("folder", type=Path, help="for results; existing ones of this program are reused")
    parser.add_argument("-o", "--output", type=Path, help="the page; needs all scenes")
    parser.add_argument("--only", action="append", choices=[scene.name for scene in scenes], metavar="SCENE")
    options = parser.parse_args(arguments)
    if options.only and options.output:
        parser.error("a page needs all scenes: -o and --only exclude each other")
    tools = Tools(Program(options.tubule, options.folder), ELEMENTS)
    tables, failures = [], []
    for scene in scenes:
        if options.only and scene.name not in options.only:
            continue
        print(f"{scene.name}: {scene.title}", flush=True)
        try:
            tables.append(scene.table(tools))
        except Failed as failure:
            print(f"\nconsistency: {failure}", file=sys.stderr, flush=True)
            failures.append(failure)
            continue
        print(page.table(tables[-1]), flush=True)
    complaints = [complaint for table in tables for complaint in table.complaints()]
    if options.output and not failures:
        page.write(options.output, tables)
    for complaint in complaints:
        print(f"consistency: {complaint}", file=sys.stderr)
    return 2 if failures else 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], SCENES))
