#!/usr/bin/python3
"""The wave that a long noisy tube selects under tension: that of the fastest growth.

selected_wave_study.py TUBULE. A tube of 40 fastest waves, fed from a reservoir at three times the threshold tension of
pearling, begins with white noise of 120 waves, of amplitude 2e-4 each, which the fastest has multiplied by 150 at the end. Mean
power of 20 such tubes.
"""

import math
import random
import sys
import unittest
from pathlib import Path

import h5py
import numpy as np
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "command"))
from program import ProgramTest  # noqa: E402

TENSION, GAMMA, RE = 9.6, 1.0, 1.0
WAVES, NOISE, MODES, SEEDS, E_FOLDS = 40, 2e-4, 120, 20, 5


def rate(q):
    """theory.md (5.10), m = 0, R = k20 = 1, H0 = 0."""
    reduced = (TENSION - 1) / 2  # (5.20)
    stiffness = 2 * (q**4 + reduced * q * q + 1 - reduced)  # (5.8), (5.21)
    return -q * q * stiffness / (GAMMA * (q * q + 1) + 4 * q * q / RE)


def fastest():
    """By golden section."""
    low, high, part = 0.1, 1.0, (math.sqrt(5) - 1) / 2
    for _ in range(60):
        a, b = high - part * (high - low), low + part * (high - low)
        low, high = (low, b) if rate(a) > rate(b) else (a, high)
    return (low + high) / 2


def power(frame):
    """Squared amplitudes of the waves n = 1 ... MODES of a profile."""
    z, r = frame["z"][:], frame["r"][:]
    at = np.linspace(z[0], z[0] + frame.attrs["length"], 16 * MODES, endpoint=False)
    return np.abs(np.fft.rfft(np.interp(at, z, r))[1 : MODES + 1]) ** 2


def centroid(spectrum):
    return (np.arange(1, MODES + 1) * spectrum).sum() / spectrum.sum()


class SelectedWave(ProgramTest):
    def spectra(self, seed):
        """First and last, and the last neck."""
        draw = random.Random(seed)
        modes = "".join(
            f"[[shape.mode]]\namplitude = {draw.gauss(0, NOISE)}\nn = {n}\nphase = {draw.uniform(0, 2 * math.pi)}\n"
            for n in range(1, MODES + 1)
        )
        q = fastest()
        path = self.write(
            "case.toml",
            f"""tier = "axisym"
energy = {{k20 = 1}}
model = {{kind = "stokes", Re = {RE}, gamma = {GAMMA}, area = "reservoir", tension = {TENSION}}}
accuracy = {{energy = 1e-3}}
discretisation = {{elements = {8 * WAVES}}}
time = {{end = {E_FOLDS / rate(q)}}}
[shape]
kind = "tube"
radius = 1
length = {2 * math.pi / q * WAVES}
{modes}""",
        )
        self.tubule("run", path, "--quiet", "--overwrite", "-o", self.result)
        with h5py.File(self.result) as file:
            frames = [file["frames"][name] for name in sorted(file["frames"])]
            return power(frames[0]), power(frames[-1]), frames[-1]["r"][:].min()

    def test_the_fastest(self):
        first, last, necks = zip(*(self.spectra(seed) for seed in range(SEEDS)))
        begins, ends = centroid(sum(first)), centroid(sum(last))
        print(f"waves on the tube: {begins:.2f} at the start, {ends:.2f} at the end, of theory {WAVES}; "
              f"necks {min(necks):.2f} to {max(necks):.2f}")  # fmt: skip
        self.assertGreater(begins, 1.3 * WAVES)  # of white noise 60.5
        self.assertLess(np.mean(necks), 0.85)
        self.assertLess(abs(ends / WAVES - 1), 0.02)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
