#!/usr/bin/python3
"""What `tubule check` expects of a case, and what its run takes: within a factor 2 for 80 percent of thirty random cases
in motion, of all models and shapes. Prints both. Argument: the program.

On one thread, whose CPU time is the time of a quiet machine, so that others may be busy."""
import json
import os
import random
import re
import resource
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "command"))
from program import ProgramTest  # noqa: E402

SEED, CASES, ENOUGH = 1807, 30, 0.8


def number(rng, low, high):
    return round(rng.uniform(low, high), 3)


def shape(rng):
    kind = rng.choice(("ellipsoid", "sphere", "tube", "capsule"))
    if kind == "ellipsoid":
        return f'kind = "ellipsoid"\na = 1.0\nb = {number(rng, 0.6, 1)}\nc = {number(rng, 0.6, 1)}\n'
    if kind == "capsule":
        return f'kind = "capsule"\nradius = 0.5\nlength = {number(rng, 0.5, 2)}\n'
    wave = f"[[shape.mode]]\namplitude = {number(rng, 0.05, 0.2)}\n"
    if kind == "sphere":
        return 'kind = "sphere"\nradius = 1.0\n' + wave + f"l = {rng.choice((2, 3, 4))}\nm = {rng.choice((0, 1, 2))}\n"
    return 'kind = "tube"\nradius = 1.0\nlength = 6.0\n' + wave + f"n = 1\nm = {rng.choice((0, 1, 2))}\n"


def case(rng):
    model = rng.choice(("gradient-flow", "overdamped", "stokes", "fluid"))
    return f"""tier = "surface3d"
[energy]
k20 = 1.0
k42 = {number(rng, 0, 0.1)}
[model]
kind = "{model}"
[shape]
{shape(rng)}
[accuracy]
energy = {rng.choice((1e-2, 3e-3, 1e-3))}
[time]
end = {number(rng, 0.05, 0.3)}
"""


def seconds(words):
    """What "12 s", "4:05", "1:02:03" and "less than a second" mean."""
    told = re.search(r"about ((?:\d+:)*\d+)(?: s)?, [^,]* MB", words)
    if "less than a second" in words:
        return 1.0
    if not told:
        return None
    total = 0
    for part in told[1].split(":"):
        total = 60 * total + int(part)
    return max(total, 1.0)


class ForecastStudy(ProgramTest):
    def test_times_are_foreseen(self):
        os.environ["OMP_NUM_THREADS"] = "1"
        rng, close = random.Random(SEED), 0
        print(f"seed {SEED}\n{'expected':>9} {'actual s':>9} {'ratio':>6}  of steps")
        for i in range(CASES):
            path = self.write("case.toml", case(rng))
            words = self.tubule("check", path)[1]
            expected = seconds(words)
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            with self.start("run", path, "--quiet", "--overwrite", "-o", "case.hdf") as process:
                process.communicate()
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            about = json.loads(self.tubule("show", "case.hdf", "--json")[0])["about"]
            actual, steps = max(used, 1.0), re.search(r"about ([\d.e+]+) steps", words)
            ratio = actual / expected if expected else float("inf")
            close += 0.5 <= ratio <= 2
            told = f"{about.get('steps')} of {steps[1] if steps else '?'}"
            print(f"{expected or 0:9.1f} {actual:9.1f} {ratio:6.2f}  {told}  {about['stop']}", flush=True)
        print(f"within a factor 2: {close} of {CASES}")
        self.assertGreaterEqual(close, ENOUGH * CASES)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
