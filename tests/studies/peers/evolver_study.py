#!/usr/bin/python3
"""Head to head with Surface Evolver: error of the energy against CPU time.

    evolver_study.py TUBULE [WORK]

Installs evolver-nox if it is missing (as root, or by sudo). Prints the table of docs/other_programs.md, and writes
docs/peers.csv and docs/peers.svg. Problems: prolate vesicles with area and volume held, H0 = 0; a torus that relaxes to
Clifford's; the seven lowest eigenvalues of a tube, beside its translations. Truth: tier axisym to 1e-10 (for v = 0.8
an independent code, too), 2 pi^2, closed forms. All energies are 1/4 INT H^2. Every run is made three times (if it
takes more than 5 s, once), in random order; CPU seconds, user and system, are medians.
Exit status 1 if a claim of the page does not hold.
"""

import csv
import random
import shutil
import subprocess
import sys
import tempfile
from collections import defaultdict
from math import inf, log, pi
from pathlib import Path
from statistics import median

import evolver
import peers_chart
import runs

ROOT = Path(__file__).resolve().parents[3]
INDEPENDENT = {"vesicle v = 0.8": 1.3874404324438243 * 4 * pi}
PROGRAMS = (runs.SURFACE, runs.EXTRAPOLATED, runs.TIER2, runs.PROFILE, runs.TIER1)
TARGETS = (1e-3, 1e-4, 1e-5, 1e-6)
COLUMNS = "problem program series size error stated cpu_s runs".split()
# Closed form (theory.md, section 5): m, n = 0, 0; 0, 1; 1, 1; q = 2 pi/6, tension k20.
EIGENVALUES = [0.5] + 2 * [1.1012906853950766] + 4 * [1.6979133966272275]


def measured(jobs, folder):
    """For each job the CPU seconds of its runs, and what the last of them found."""
    seconds, found, draw = defaultdict(list), {}, random.Random(1)
    for repetition in range(3):
        order = [job for job in range(len(jobs)) if not (repetition and seconds[job][0] > 5)]
        draw.shuffle(order)
        for job in order:
            spent, *found[job] = jobs[job][2](folder)
            seconds[job].append(spent)
    return [(*job, seconds[k], *found[k]) for k, job in enumerate(jobs)]


def problem_rows(problem, jobs, truth, folder):
    done = measured(list(jobs), folder)
    truth = truth or next(energy for _, series, _, _, energy, *_ in done if series == "truth")
    assert abs(INDEPENDENT.get(problem, truth) / truth - 1) < 1e-9, (problem, truth)
    for program, series, _, seconds, energy, rates, size, stated in done:
        error = max((r / t - 1 for r, t in zip(rates, EIGENVALUES)), key=abs) if rates else energy / truth - 1
        if series != "truth":
            stated = "" if rates else stated  # of the energy
            yield dict(zip(COLUMNS, (problem, program, series, size, error, stated, median(seconds), len(seconds))))


def by_series(rows):
    """Lists of rows by (problem, program, series), coarse ones first."""
    found = defaultdict(list)
    for row in sorted(rows, key=lambda row: row["size"]):
        found[row["problem"], row["program"], row["series"]].append(row)
    return found


def extrapolated(rows):
    """Two runs of one series of surfaces: their errors are taken as proportional to 1/size."""
    for (problem, program, series), run in by_series(rows).items():
        for fine in run:
            coarse = [row for row in run if 1.8 * row["size"] < fine["size"]]
            if program == runs.SURFACE and coarse:
                ratio, cpu = fine["size"] / coarse[-1]["size"], coarse[-1]["cpu_s"] + fine["cpu_s"]
                error = (ratio * fine["error"] - coarse[-1]["error"]) / (ratio - 1)
                yield {**fine, "program": runs.EXTRAPOLATED, "error": error, "cpu_s": cpu}


def time_to(target, run):
    """CPU seconds at which a series reaches an error and stays below it; between two runs by powers."""
    seconds = inf
    for coarse, fine in zip([None, *run], run):
        if abs(fine["error"]) > target:
            seconds = inf
        elif seconds == inf:
            seconds = fine["cpu_s"]
            if coarse and fine["cpu_s"] > coarse["cpu_s"]:
                part = log(abs(coarse["error"]) / target) / log(abs(coarse["error"] / fine["error"]))
                seconds = coarse["cpu_s"] * (fine["cpu_s"] / coarse["cpu_s"]) ** part
    return seconds


def series_of(rows, problem, program):
    return [run for key, run in by_series(rows).items() if key[:2] == (problem, program)]


def best(rows, problem, program, target):
    return min((time_to(target, run) for run in series_of(rows, problem, program)), default=inf)


def smallest(rows, problem, program):
    """The smallest error of the finest runs of all series: on the way to these, errors pass through zero."""
    return min((abs(run[-1]["error"]) for run in series_of(rows, problem, program)), default=inf)


def print_table(rows, problem):
    print(f"\n{problem:22}CPU s at" + "".join(f"{target:>9.0e}" for target in TARGETS) + "  smallest error", flush=True)
    for program in PROGRAMS:
        if smallest(rows, problem, program) < inf:
            times = "".join(f"{best(rows, problem, program, target):9.2f}" for target in TARGETS)
            print(f"{program:30}{times}{smallest(rows, problem, program):10.1e}", flush=True)


def check_claims(rows):
    """What docs/other_programs.md says. Times are compared where they differ by a factor of two or more."""
    for (problem, program, series), run in by_series(rows).items():
        if series == runs.GIVEN and problem.startswith("vesicle"):
            assert all(abs(row["error"]) < (1e-4 if row["size"] < 600 else 2e-6) for row in run[1:]), run
        if program == runs.FREE:
            assert all(row["error"] < -0.01 for row in run), run
    for problem in ("vesicle v = 0.9", "vesicle v = 0.8", "Clifford torus", "tube"):
        surface, extrapolated, tier2, profile, tier1 = (
            {target: best(rows, problem, program, target) for target in TARGETS} for program in PROGRAMS)  # fmt: skip
        assert surface[1e-5] == inf and tier2[1e-5] < inf, problem
        assert problem == "vesicle v = 0.8" or extrapolated[1e-4] < tier2[1e-4], problem
        assert problem == "Clifford torus" or 3 * tier1[1e-6] < min(tier2[1e-6], profile[1e-6]), problem
    assert 2 * best(rows, "vesicle v = 0.8", runs.TIER2, 1e-4) < best(rows, "vesicle v = 0.8", runs.SURFACE, 1e-4)


def write_table(rows, path):
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for row in rows:
            stated = f"{row['stated']:.1e}" if row["stated"] else ""
            writer.writerow({**row, "error": f"{row['error']:.2e}", "stated": stated, "cpu_s": f"{row['cpu_s']:.3f}"})


def main():
    tubule = Path(sys.argv[1]).resolve()
    if not shutil.which(evolver.PROGRAM):
        with tempfile.NamedTemporaryFile("w", suffix=".txt") as packages:
            print(evolver.PACKAGE, file=packages, flush=True)
            subprocess.run([ROOT / "tools/packages", packages.name], check=True)
    folder = Path(sys.argv[2] if len(sys.argv) > 2 else tempfile.mkdtemp()).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    problems = [(f"vesicle v = {v}", runs.vesicles(tubule, v), None) for v in (0.9, 0.8)]
    problems += [("Clifford torus", runs.tori(tubule), 2 * pi**2), ("tube", runs.tubes(tubule), 3 * pi)]
    rows = []
    for problem in problems:
        found = list(problem_rows(*problem, folder))
        rows += found + list(extrapolated(found))
        print_table(rows, problem[0])
    write_table(rows, ROOT / "docs/peers.csv")
    peers_chart.draw(by_series(rows), ROOT / "docs/peers.svg")
    check_claims(rows)



if __name__ == "__main__":
    sys.exit(main())
