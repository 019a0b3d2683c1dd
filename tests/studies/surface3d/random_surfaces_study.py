#!/usr/bin/python3
"""Random closed surfaces and tubes of random moduli, unattended to t = 1: each run finishes or stops with a named reason, none hangs, and where it
finished, one on 2.25 times the triangles and an eighth of the tolerance agrees within what both state, or within the accuracy asked for, at the last
time that both have reached.

    random_surfaces_study.py TUBULE [FIRST LAST]      seeds FIRST to LAST, by default 0 to 19
"""

import random
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np

TUBULE = Path(sys.argv[1]) if len(sys.argv) > 1 else None
SEEDS = range(int(sys.argv[2]), int(sys.argv[3]) + 1) if len(sys.argv) > 3 else range(20)
ASKED = 5e-2
LIMIT = 240  # seconds of a run
MODELS = ("gradient-flow", "overdamped", "stokes", "fluid")


def shape(draw):
    kind = draw.choice(("sphere", "sphere", "capsule", "tube"))
    if kind == "capsule":
        return f'kind = "capsule"\nradius = 0.5\nlength = {draw.uniform(0.5, 3):.3f}\n'
    modes = ""
    left = 0.3
    for _ in range(draw.randint(1, 3)):
        amplitude = draw.uniform(0, left)
        left -= amplitude
        if kind == "tube":
            modes += f"[[shape.mode]]\namplitude = {amplitude:.4f}\nn = {draw.randint(1, 2)}\nm = {draw.randint(0, 2)}\n"
        else:
            l = draw.randint(2, 6)
            modes += f"[[shape.mode]]\namplitude = {amplitude:.4f}\nl = {l}\nm = {draw.randint(0, l)}\n"
    length = f"length = {draw.uniform(2, 6):.3f}\n" if kind == "tube" else ""
    return f'kind = "{kind}"\nradius = 1.0\n{length}{modes}'


def case(seed):
    draw = random.Random(seed)
    kind = draw.choice(MODELS)
    viscous = f"Re = {10 ** draw.uniform(-1, 1):.3f}\ngamma = {draw.choice((0.0, 0.5))}\n" if kind in MODELS[2:] else ""
    energy = f"k20 = {draw.uniform(0.05, 1):.3f}\nk40 = {draw.choice((0, 0.02))}\nk42 = {draw.uniform(0, 0.15):.3f}\nH0 = {draw.uniform(-2, 1):.3f}\n"
    return (
        f'tier = "surface3d"\n[energy]\n{energy}[model]\nkind = "{kind}"\n{viscous}[shape]\n{shape(draw)}'
        f"[accuracy]\nenergy = {ASKED}\n[discretisation]\norder = 4\n[time]\nend = 1.0\nlimit = {LIMIT}\n"
    )


def run(folder, seed, elements, tolerance):
    path, result = folder / f"{seed}.toml", folder / f"{seed}_{elements}.hdf"
    path.write_text(case(seed))
    sets = [f"--set=discretisation.elements={elements}", f"--set=discretisation.time_tolerance={tolerance}"]
    done = subprocess.run([TUBULE, "run", path, "--quiet", "-o", result, *sets], capture_output=True, text=True, timeout=2 * LIMIT)
    with h5py.File(result) as file:
        about = dict(file["about"].attrs)
        return done.returncode, about, file["series/time"][:], file["series/energy"][:]


class Random(unittest.TestCase):
    def test_unattended(self):
        with tempfile.TemporaryDirectory() as folder:
            for seed in SEEDS:
                with self.subTest(seed=seed):
                    code, about, times, energies = run(Path(folder), seed, 320, 2e-5)
                    print(f"seed {seed}: {about['stop']} at {about['stop_time']:.4g}, error {about['estimated_error']:.2g}", end="", flush=True)
                    self.assertIn(code, (0, 3, 4, 5), case(seed))
                    self.assertNotEqual(about["stop_message"], "")
                    if about["stop"] != "finished":
                        print(f": {about['stop_message']}")
                        continue
                    _, finer, finer_times, finer_energies = run(Path(folder), seed, 720, 2.5e-6)
                    common = min(times[-1], finer_times[-1])
                    apart = abs(np.interp(common, times, energies) - np.interp(common, finer_times, finer_energies)) / about["E_ref"]
                    print(f"; finer: {finer['stop']}, apart {apart:.2g} at {common:.4g}")
                    self.assertGreater(common, 0)
                    stated = about["estimated_error"] + (finer["estimated_error"] if finer["stop"] == "finished" else 0)
                    self.assertLessEqual(apart, max(stated, ASKED), case(seed))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
