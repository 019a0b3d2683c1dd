#!/usr/bin/python3
"""The paper's perturbed sphere, k42 = 0.06, as a fluid: it becomes oblate whatever its mesh, steps, and small perturbation.

fate_study.py TUBULE [FOLDER]. At k42 = 0.06 the prolate and the oblate cell are both stable, so the way decides. Prints the
table of docs/paper.md. Results are kept in FOLDER, and not computed again.
"""

import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "command"))
from program import PROGRAM  # noqa: E402

CASE = Path(__file__).resolve().parents[3] / "cases/long/surface_sphere_k42_006.toml"
OBLATE = {"energy": 9.54237827669, "r_min": 0.4958489922, "r_max": 1.2710197886}  # by an independent spectral method: CASE
TRIANGLES, STEPS, WAVE = "discretisation.elements", "discretisation.time_tolerance", "shape.mode.1.amplitude"
NOISE = '[[shape.noise]]\namplitude = {}\nl = 4\nm = 4\nseed = {}\n\n'

# What differs, and the case's small wave or the noise in its place: amplitude, seed.
RUNS = {
    "the case": ({}, None),
    "500 triangles": ({TRIANGLES: 500}, None),
    "steps for 3e-5": ({STEPS: 3e-5}, None),
    "small wave 0.003": ({WAVE: 0.003}, None),
    "small wave 0.03": ({WAVE: 0.03}, None),
    "noise 0.01, seed 1": ({}, (0.01, 1)),
    "noise 0.01, seed 2": ({}, (0.01, 2)),
    "noise 0.002, seed 3": ({}, (0.002, 3)),
}


def text_of(noise):
    text = CASE.read_text()
    if noise is None:
        return text
    without = re.sub(r"\[\[shape\.mode\]\]  .*?(?=\[discretisation\])", NOISE.format(*noise), text, flags=re.DOTALL)
    assert without.count("[[shape.mode]]") == 1
    return without


class Fate(unittest.TestCase):
    def setUp(self):
        if len(sys.argv) > 2:
            self.folder = Path(sys.argv[2])
            self.folder.mkdir(exist_ok=True, parents=True)
        else:
            folder = tempfile.TemporaryDirectory()
            self.addCleanup(folder.cleanup)
            self.folder = Path(folder.name)

    def result(self, name):
        sets, noise = RUNS[name]
        stem = re.sub(r"[^a-z0-9]+", "_", name)
        case, result = self.folder / f"{stem}.toml", self.folder / f"{stem}.hdf"
        if not result.exists():
            case.write_text(text_of(noise))
            words = ["--set", "accuracy.estimate=false"]
            words += [word for key, value in sets.items() for word in ("--set", f"{key}={value}")]
            subprocess.run([PROGRAM, "run", "--quiet", case, *words, "-o", result], check=True)
        return result

    def test_it_becomes_oblate(self):
        for name in RUNS:
            with self.subTest(name), h5py.File(self.result(name)) as file:
                series = {key: values[:] for key, values in file["series"].items()}
                stop = file["about"].attrs["stop"]
                last = {key: series[key][-1] for key in OBLATE}
                print(f"| {name} | {series['time'].size} | {series['time'][-1]:.1f} | {last['energy']:.5f} | {last['r_min']:.4f} | {last['r_max']:.4f} |")
                self.assertEqual(stop.decode() if isinstance(stop, bytes) else stop, "stationary")
                self.assertAlmostEqual(last["energy"] / OBLATE["energy"], 1, delta=1e-3)
                for key in ("r_min", "r_max"):
                    self.assertAlmostEqual(last[key] / OBLATE[key], 1, delta=1e-2)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
