#!/usr/bin/python3
"""Prints a table for the chart docs/work_precision_fluid.svg: error of the energy against CPU time of whole runs.

The paper's capsule as a fluid, and without inertia: elements, order, time tolerance and parametrisation given, and
chosen by the program for an accuracy asked of it. Error: the largest at the output times, relative to E_ref, against
the finest run. `tools/figures work-precision-fluid`.
"""

import argparse
import csv
import io
import itertools
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

CASE = Path(__file__).resolve().parents[3] / "cases/capsule_fluid.toml"
TIMES = (0.02, 0.05, 0.1, 0.2)
PARAMETRISATIONS, ORDERS = ("material", "even"), (3, 5, 7)
# Elements of the whole profile, before those at the seams are divided. Waves make steps as many as elements squared.
GIVEN = {
    "fluid": list(itertools.product(PARAMETRISATIONS, ORDERS, (16, 24, 36, 54, 80), (1e-2, 1e-3))),
    "stokes": list(itertools.product(PARAMETRISATIONS, ORDERS, (16, 32, 64), (1e-3, 1e-4, 1e-5, 1e-6, 1e-7))),
}
ASKED = {"fluid": (1e-2, 5e-3, 2e-3), "stokes": (1e-3, 1e-4, 1e-5)}
REFERENCE = {"fluid": ("material", 7, 120, 1e-3), "stokes": ("material", 7, 96, 1e-9)}
SECOND_FINEST = {"fluid": ("material", 7, 80, 1e-3), "stokes": ("material", 7, 64, 1e-7)}  # of GIVEN
# How an accuracy divides elements at seams; the same for all runs with given settings.
SEAM_ACCURACY = 1e-2
COLUMNS = ("model", "series", "asked", "elements", "time_tolerance", "steps", "error", "estimate", "balance", "cpu_s")


def given_sets(parametrisation, order, elements, tolerance):
    keys = {"parametrisation": parametrisation, "order": order, "elements": elements, "time_tolerance": tolerance}
    return [f"accuracy.energy={SEAM_ACCURACY}", *(f"discretisation.{key}={value}" for key, value in keys.items())]


class Runs:
    def __init__(self, tubule, folder):
        self.tubule, self.folder, self.numbers = tubule, folder, itertools.count()

    def __call__(self, model, sets):
        """Energies at TIMES, E_ref, and the row without its error; None for a run that does not get to its end."""
        result = self.folder / f"work_precision_{next(self.numbers):03}.hdf"
        result.unlink(missing_ok=True)
        times = f"time.output=[{','.join(map(str, TIMES))}]"
        sets = [f"model.kind={model}", f"time.end={TIMES[-1]}", times, *sets]
        options = [part for value in sets for part in ("--set", value)]
        process = subprocess.Popen([self.tubule, "run", "--quiet", "--overwrite", CASE, *options, "-o", result], stdout=sys.stderr)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            result.unlink(missing_ok=True)
            print(f"left out, exit status {process.returncode}: {' '.join(sets)}", file=sys.stderr)
            return None
        about = json.loads(self.show(result, "--json"))["about"]
        series = csv.DictReader(io.StringIO(self.show(result, "--csv")))
        rows = [{key: float(value) for key, value in row.items()} for row in series]
        at = {row["time"]: row["energy"] for row in rows}
        result.unlink()
        return [at[time] for time in TIMES], about["E_ref"], {
            "model": model,
            "elements": about["elements"],
            "time_tolerance": f"{about['time_tolerance']:.1e}",
            "steps": about["steps"],
            "estimate": f"{about['estimated_error']:.2e}",
            "balance": f"{max(abs(row['identity_defect']) for row in rows) / about['E_ref']:.2e}",
            "cpu_s": f"{usage.ru_utime + usage.ru_stime:.3f}",
        }

    def show(self, result, form):
        return subprocess.run([self.tubule, "show", result, form], check=True, capture_output=True, text=True).stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tubule", type=Path, help="the program")
    parser.add_argument("folder", type=Path, help="for results, which are removed again")
    options = parser.parse_args()
    run = Runs(options.tubule, options.folder)
    writer = csv.DictWriter(sys.stdout, COLUMNS, lineterminator="\n")
    writer.writeheader()
    with ThreadPoolExecutor(2) as pool:
        for model in GIVEN:
            jobs = [("reference", 0, given_sets(*REFERENCE[model]))]
            jobs += [("accuracy asked for", asked, [f"accuracy.energy={asked}"]) for asked in reversed(ASKED[model])]
            first_given = len(jobs)
            jobs += [(f"{given[0]}, order {given[1]}", 0, given_sets(*given)) for given in GIVEN[model]]
            done = list(pool.map(lambda job: run(model, job[2]), jobs))
            finest, second = done[0], done[first_given + GIVEN[model].index(SECOND_FINEST[model])]
            if finest is None or second is None:
                sys.exit(f"{model}: no reference to compare with")
            for (series, asked, _), outcome in zip(jobs, done):
                if outcome is None:
                    continue
                # The reference is as far off, presumably, as the next finest run is from it.
                truth, E_ref = (second if outcome is finest else finest)[:2]
                error = max(abs(a - b) for a, b in zip(outcome[0], truth)) / E_ref
                writer.writerow({**outcome[2], "series": series, "asked": asked, "error": f"{error:.3e}"})


if __name__ == "__main__":
    main()
