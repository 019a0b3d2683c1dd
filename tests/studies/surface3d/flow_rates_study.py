#!/usr/bin/python3
"""Rates of surfaces that flow: those of tier axisym with beads, at a wall, fed by a reservoir; a fluid's as its run has them.

    flow_rates_study.py TUBULE
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
from scipy.optimize import curve_fit

TUBULE = Path(sys.argv[1]).resolve()

VESICLE = """tier = "{tier}"
[energy]
k20 = 0.5
[model]
kind = "{kind}"
{model}
[shape]
kind = "ellipsoid"
{shape}
[accuracy]
energy = {accuracy}
[equilibrium]
{held}
"""
PROLATE = {"model": "", "shape": "a = 0.88\nb = 0.88\nc = 1.5", "held": "area = 12.566370614359172\nreduced_volume = 0.8"}
CASES = {
    "prolate": PROLATE,
    "beads": {"model": 'area = "reservoir"\ntension = 10.0\nbead_width = 0.3\nforce = 15.0',
              "shape": "a = 0.9\nb = 0.9\nc = 1.25", "held": "volume = 4.18879020479"},
    "wall": {"model": "gamma = 0.5\n[[energy.potential]]\nkind = \"plane\"\nz = -1.35\nstrength = 3.0\nrange = 0.15",
             "shape": "a = 1.0\nb = 1.0\nc = 1.1", "held": "area = 13.4120538702\nvolume = 4.60766922527"},
}  # fmt: skip


class FlowRates(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def tubule(self, *arguments):
        done = subprocess.run([TUBULE, *map(str, arguments)], capture_output=True, text=True, cwd=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr + done.stdout)
        return done.stdout

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def shape(self, text):
        self.write("case.toml", text)
        self.tubule("equilibrium", "case.toml", "--overwrite")
        with h5py.File(self.folder / "case.hdf") as file:
            return {name: values[-1] for name, values in file["series"].items()}

    def test_as_tier_axisym(self):
        for name, case in CASES.items():
            for kind in ("overdamped", "stokes"):
                with self.subTest(case=name, kind=kind):
                    profile, surface = (self.shape(VESICLE.format(tier=tier, kind=kind, accuracy=accuracy, **case) + key)
                                        for tier, accuracy, key in (("axisym", 1e-8, "modes = 4\n"), ("surface3d", 1e-4, "rates = 6\n")))  # fmt: skip
                    known = set()
                    for i in range(1, 7):
                        m, rate, error = (surface[f"{series}_{i}"] for series in ("wave_number", "rate", "rate_error"))
                        if m in known:  # tier axisym has the slowest of each m
                            continue
                        known.add(m)
                        exact = profile[f"growth_{m:.0f}"]
                        print(name, kind, f"m = {m:.0f}", rate, "+-", error, "exact", exact, flush=True)
                        self.assertLess(abs(rate - exact), max(error, 3e-3 * abs(exact)))
                    self.assertIn(max(range(5), key=lambda m: profile[f"growth_{m}"]), known)

    def test_a_fluid_as_it_runs(self):
        """Released at rest, along its first mode: the energy is E0 + A a^2, a = exp(-d t) (cos w t + d/w sin w t).

        The frequency falls with the square of the amplitude: 4.656 at 0.03, 4.747 at 0.016, so 4.783 at 0.
        """
        text = VESICLE.format(tier="surface3d", kind="fluid", accuracy=1e-4, **PROLATE | {"model": "Re = 4.0"})
        self.write("fluid.toml", text + "rates = 4\n")
        self.tubule("equilibrium", "fluid.toml")
        with h5py.File(self.folder / "fluid.hdf") as file:
            rate, frequency = (file[f"series/{name}_1"][0] for name in ("rate", "frequency"))
        run = text[: text.index("[shape]")] + '[shape]\nkind = "result"\npath = "fluid.hdf"\n'
        run += '[[shape.eigenmode]]\nof = "mode_1"\namplitude = 0.016\n[accuracy]\nenergy = 4e-5\n'
        self.write("run.toml", run + "[time]\nend = 2.0\n")
        self.tubule("run", "run.toml")
        with h5py.File(self.folder / "run.hdf") as file:
            t, energy = (file[f"series/{name}"][()] for name in ("time", "energy"))

        def model(t, E0, A, d, w):
            return E0 + A * (np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t))) ** 2

        A = energy[0] - energy.min()
        (_, _, d, w), _ = curve_fit(model, t, energy, (energy[0] - A, A, -rate, frequency))
        print("rate", rate, "in the run", -d, "frequency", frequency, "in the run", w)
        self.assertLess(abs(complex(rate + d, frequency - w)), 1.5e-2 * abs(complex(rate, frequency)))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
