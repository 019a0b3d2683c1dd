#!/usr/bin/python3
"""How much the path of a fluid differs from those of Stokes flow and of the overdamped model, over Re and gamma, in tier
axisym, and what the paths of the simpler models alone let expect: prints a table.

    model_differences.py TUBULE FOLDER

A path is the energy over time, that of the overdamped model in time/gamma. Differences are relative to E_ref."""

import csv
import io
import itertools
import json
import math
import os
import resource
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np

VISCOUS, SLOWER = 2.0, 4.5  # as in tools/run/model_choice.cpp
RE, GAMMA = (0.05, 0.3, 2), (0, 3, 30, 300)
COLUMNS = ("scene", "Re", "gamma", "length", "fall", "stokes", "stokes_expected", "stokes_end", "overdamped",
           "overdamped_expected", "overdamped_end", "fluid_cpu_s", "stokes_cpu_s", "overdamped_cpu_s")  # fmt: skip
# Energy, shape, modes; half of them determined VISCOUS and SLOWER, the others test them.
SCENES = {
    "vesicle": ("k20 = 1.0", 'kind = "sphere"\nradius = 1.0', "l", {2: 0.3, 3: 0.1, 4: 0.1}),
    "oblate": ("k20 = 1.0\nk42 = 0.05", 'kind = "ellipsoid"\na = 1.0\nb = 1.0\nc = 0.6', "l", {}),
    "tube": ("k20 = 1.0\nk42 = 0.1", 'kind = "tube"\nradius = 1.0\nlength = 6.0', "n", {1: 0.2, 2: 0.1}),
    "thin tube": ("k20 = 0.2\nH0 = -3.0", 'kind = "tube"\nradius = 0.3\nlength = 1.5', "n", {1: 0.06}),
    "cell": ("k20 = 0.125\nH0 = -2.0\nk42 = 0.06", 'kind = "ellipsoid"\na = 0.5\nb = 0.5\nc = 1.0', "l", {}),
}


def case(energy, shape, degree, modes):
    waves = "".join(f"[[shape.mode]]\namplitude = {a}\n{degree} = {k}\n" for k, a in modes.items())
    return f'tier = "axisym"\n[energy]\n{energy}\n[shape]\n{shape}\n{waves}'


class Runs:
    def __init__(self, tubule, folder):
        self.tubule, self.folder = tubule, folder
        self.environment = {**os.environ, "OMP_NUM_THREADS": "1"}

    def call(self, *words):
        return subprocess.run([self.tubule, *words], capture_output=True, text=True, env=self.environment)

    def run(self, text, end, accuracy, model):
        """Its path and CPU time, or None if it does not reach the end."""
        path, result = self.folder / "case.toml", self.folder / "case.hdf"
        path.write_text(f"{text}[model]\n{model}\n[accuracy]\nenergy = {accuracy}\n[time]\nend = {end!r}\nlimit = 600.0\n")
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        status = self.call("run", "--quiet", "--overwrite", path, "-o", result).returncode
        cpu = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        if status:
            return None
        rows = list(csv.DictReader(io.StringIO(self.call("show", result, "--csv").stdout)))
        column = {name: np.array([float(row[name]) for row in rows]) for name in ("time", "energy", "area", "r_max")}
        E_ref = json.loads(self.call("show", result, "--json").stdout)["about"]["E_ref"]
        return SimpleNamespace(t=column["time"], E=column["energy"] / E_ref, cpu=cpu, area=column["area"][0], r_max=column["r_max"][0])


def at(run, t):
    return np.interp(t, run.t, run.E)


def lag(run, tau):
    """The largest fall of the energy within a time tau: of that, what is set in motion is behind what is not."""
    return np.max(run.E - at(run, run.t + tau))


def expected(run, scale, Re, gamma, length):
    """From the path of a model without inertia, whose time is `scale` of that of the fluid."""
    viscosity = 1 / (Re * length**2)
    slower = SLOWER * viscosity / gamma if scale != 1 else 0  # without viscosity it is ahead
    return lag(run, scale / (gamma + VISCOUS * viscosity)) + np.max(at(run, run.t / (1 + slower)) - run.E)


def compared(runs, name, Re, gamma):
    text = case(*SCENES[name])
    viscous = f"Re = {Re}\ngamma = {gamma}"
    end = 0.15 * gamma + 0.5 / Re + 10 / (gamma + 4 / Re)
    fluid = runs.run(text, end, 1e-5, f'kind = "fluid"\n{viscous}')
    stokes = runs.run(text, end, 1e-7, f'kind = "stokes"\n{viscous}')
    if fluid is None or stokes is None:
        return None
    length = fluid.r_max if "tube" in name else math.sqrt(fluid.area / (4 * math.pi))
    row = [name, Re, gamma, length, np.max(fluid.E[0] - fluid.E)]
    overdamped = runs.run(text, end / gamma, 1e-7, 'kind = "overdamped"') if gamma else None
    for other, scale in ((stokes, 1), (overdamped, 1 / gamma if gamma else 1)):
        if other is None:
            row += [math.nan] * 3
        else:
            difference = np.abs(at(other, fluid.t * scale) - fluid.E)
            row += [np.max(difference), expected(other, scale, Re, gamma, length), difference[-1]]
    return row + [run.cpu if run else math.nan for run in (fluid, stokes, overdamped)]


def main():
    runs = Runs(sys.argv[1], Path(sys.argv[2]))
    runs.folder.mkdir(parents=True, exist_ok=True)
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(COLUMNS)
    for name, Re, gamma in itertools.product(SCENES, RE, GAMMA):
        if row := compared(runs, name, Re, gamma):
            table.writerow([value if isinstance(value, str) else "" if math.isnan(value) else f"{value:.3g}" for value in row])
            sys.stdout.flush()


if __name__ == "__main__":
    main()
