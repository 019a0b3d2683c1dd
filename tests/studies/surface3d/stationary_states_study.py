#!/usr/bin/python3
"""The stationary states of the paper's perturbed sphere at k42 = 0.06, from random initial shapes of its area and volume.

    stationary_states_study.py TUBULE [COUNT [FIRST]]      by default 200 shapes, seeds from FIRST = 1

Searches descend, so they find minima: without a descent none of 100 converged. States are one if energies and numbers
of directions agree. Tier axisym has two minima, stable also against m = 1 to 4 (docs/paper.md).
"""
import os
import random
import subprocess
import sys
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py

TUBULE = Path(sys.argv[1])
COUNT, FIRST = (int(sys.argv[k]) if len(sys.argv) > k else default for k, default in ((2, 200), (3, 1)))
AREA, VOLUME = 14.401304433294, 4.313790204786
MINIMA = (9.542378278, 9.565375934)  # the oblate and the prolate, by tier axisym to 1e-8
LIMIT = 60  # seconds for each shape


def case(seed):
    draw = random.Random(seed)
    text = (f'tier = "surface3d"\n[energy]\nk20 = 0.125\nk42 = 0.06\n[shape]\nkind = "sphere"\nradius = 1.07\n[accuracy]\nenergy = 1e-3\n'
            f"[equilibrium]\narea = {AREA}\nvolume = {VOLUME}\n[time]\nlimit = {LIMIT}\n")
    for _ in range(3):
        l = draw.randint(2, 5)
        text += f"[[shape.mode]]\namplitude = {draw.choice((-1, 1)) * draw.uniform(0.05, 0.3):.3f}\nl = {l}\nm = {draw.randint(0, l)}\n"
    return text


def state(seed):
    with tempfile.TemporaryDirectory() as name:
        path, result = Path(name) / "case.toml", Path(name) / "case.hdf"
        path.write_text(case(seed))
        subprocess.run([TUBULE, "equilibrium", path, "-o", result], capture_output=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
        if not result.exists():
            return seed, "refused", None
        with h5py.File(result) as file:
            stop = file["about"].attrs["stop"]
            last = {key: data[-1] for key, data in file["series"].items() if len(data)}
    return seed, stop, (last["energy"], last["energy_error"], int(last["negative_directions"])) if stop == "finished" else None


class States(unittest.TestCase):
    def test_random_initial_shapes(self):
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            all_of_them = list(pool.map(state, range(FIRST, FIRST + COUNT)))
        states, stops, newest = [], {}, 0
        for number, (seed, stop, found) in enumerate(all_of_them):
            stops[stop] = stops.get(stop, 0) + 1
            if not found:
                continue
            energy, error, index = found
            near = [s for s in states if s["index"] == index and abs(s["energy"] - energy) <= 2 * (error + s["error"])]
            if near:
                near[0]["often"] += 1
            else:
                states.append({"energy": energy, "error": error, "index": index, "often": 1, "seed": seed})
                newest = number
        print(f"\n{COUNT} shapes: {stops}; the last new state was found from number {newest + 1}")
        for s in sorted(states, key=lambda s: s["energy"]):
            print("E = {energy:.6f} +- {error:.1e}, {index} directions, found {often} times, first from seed {seed}".format(**s))
        minima = sorted((s for s in states if s["index"] == 0), key=lambda s: s["energy"])
        self.assertEqual(len(minima), len(MINIMA))
        for found, energy in zip(minima, MINIMA):
            self.assertLess(abs(found["energy"] - energy), 2 * found["error"])
        self.assertLessEqual(newest, max(COUNT - 50, 20))  # the last 50 found none new


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
