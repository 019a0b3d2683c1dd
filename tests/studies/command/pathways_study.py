#!/usr/bin/python3
"""Does a membrane with K^2 or (H - H0)^4 come to rest sooner, and sooner than one that is only stiffer?

pathways_study.py TUBULE [FOLDER]. The paper's tube in gradient flow, its tubular cells and its perturbed sphere as fluids. Prints the
times of docs/paper.md: the times after which 10 % and 1 % of the excess E + E_kin - E(at rest) are left for good. "stiffer" has k20 +
k42/R^2 instead of k42: on a sphere of radius R small deformations then have the same stiffness. Results are kept in FOLDER, and
not computed again.
"""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "axisym"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "command"))
from program import PROGRAM, about, series  # noqa: E402

CASES = Path(__file__).resolve().parents[3] / "cases"
CELL = ("capsule_fluid", {"accuracy.energy": 5e-3, "time.end": 60.0, "time.stationary": 1e-5})
# Case, its keys, k20, R.
SCENES = {
    "tube": ("figure_k42_0", {"time.end": 5.0}, 0.2, 1.0),
    **{f"cell l = {length}": (CELL[0], CELL[1] | {"shape.length": float(length)}, 0.125, 0.5) for length in (2, 3, 4)},
    "sphere": ("long/surface_sphere_k42_0", {"accuracy.estimate": "false"}, 0.125, np.sqrt(14.401304433294 / (4 * np.pi))),
}
# There the energy varies by the error of the time steps, and the run does not end by itself; it is at rest to 1e-4 by then.
LIMITS = {("sphere", "k40 = 0.06"): {"time.end": 20.0}}
MEMBRANES = {"k20 alone": {}, "k42 = 0.06": {"k42": 0.06}, "stiffer 0.06": {"stiffer": 0.06}, "k42 = 0.12": {"k42": 0.12},
             "stiffer 0.12": {"stiffer": 0.12}, "k40 = 0.02": {"k40": 0.02}, "k40 = 0.06": {"k40": 0.06}}  # fmt: skip


def moduli(membrane, k20, R):
    return {"energy.k20": k20 + membrane.get("stiffer", 0) / R**2, "energy.k42": membrane.get("k42", 0.0), "energy.k40": membrane.get("k40", 0.0)}


def times_left(found, at_rest):
    """After which 10 % and 1 % of the excess are left for good."""
    total = found["energy"] + found.get("kinetic_energy", 0)
    left = (total - at_rest) / (total[0] - at_rest)
    return [found["time"][np.nonzero(left > part)[0][-1]] for part in (0.1, 0.01)]


class Pathways(unittest.TestCase):
    def setUp(self):
        if len(sys.argv) > 2:
            self.folder = Path(sys.argv[2])
            self.folder.mkdir(exist_ok=True, parents=True)
        else:
            folder = tempfile.TemporaryDirectory()
            self.addCleanup(folder.cleanup)
            self.folder = Path(folder.name)

    def result(self, scene, name):
        case, keys, k20, R = SCENES[scene]
        result = self.folder / f"{scene} {name}.hdf".replace(" ", "_")
        if not result.exists():
            keys = keys | moduli(MEMBRANES[name], k20, R) | LIMITS.get((scene, name), {})
            sets = [word for key, value in keys.items() for word in ("--set", f"{key}={value}")]
            subprocess.run([PROGRAM, "run", "--quiet", CASES / f"{case}.toml", *sets, "-o", result], check=True)
        return result

    def test_times_to_rest(self):
        for scene in SCENES:
            for name in MEMBRANES:
                with self.subTest(f"{scene}, {name}"):
                    result = self.result(scene, name)
                    found = series(result)
                    at_rest = 0.0 if scene == "tube" else found["energy"][-1]
                    t10, t1 = times_left(found, at_rest)
                    wave = found["time"][np.nonzero(found["mode_1"] > 0.01 * found["mode_1"][0])[0][-1]] if scene == "tube" else np.nan
                    print(f"| {scene} | {name} | {t10:.3g} | {t1:.3g} | {wave:.3g} | {found['time'][-1]:.3g} | {found['energy'][-1]:.6g} |", flush=True)
                    self.assertIn(about(result)["stop"], ("finished", "stationary"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
