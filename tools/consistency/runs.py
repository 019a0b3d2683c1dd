"""Runs of both tiers by the Python package `tubule`, each on one thread, and their results. Those that the same program made
of the same case are reused, so that a suite that was stopped continues."""

import hashlib
import json
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

PIECES = 8  # subdivision of a triangle side in the search for extremes


class Failed(Exception):
    """A run or another call failed."""


@dataclass
class Run:
    """One result. Times are those of its rows."""

    result: object  # tubule.Result
    cpu_s: float
    path: Path

    def __getattr__(self, name):  # about, series
        return getattr(self.result, name)

    def at(self, name, time):
        """The row of an output time."""
        times = self.series["time"]
        i = int(np.abs(times - time).argmin())
        if abs(times[i] - time) > 1e-12 * max(time, times[-1]):
            raise Failed(f"{self.path}: has no row at t = {time}")
        return float(self.series[name][i])

    def dissipated(self, time):
        """Energy dissipated until then: identity_defect = E + E_kinetic - that of the start + this."""
        def total(t):
            return self.at("energy", t) + (self.at("kinetic_energy", t) if "kinetic_energy" in self.series else 0)

        return self.at("identity_defect", time) + total(0) - total(time)

    @property
    def E_ref(self):
        return float(self.about["E_ref"])

    @property
    def stated_error(self):
        return float(self.about["estimated_error"])

    @property
    def elements(self):
        return int(self.about["elements"])

    def extremes(self, name):
        """Smallest and largest H or K of the first frame; on a surface also inside the triangles."""
        from tubule.drawing.raster import division, lagrange

        frame = self.result.frames[0]
        if frame.kind == "surface":
            values = frame[name][frame.cells] @ lagrange(frame.order, division(PIECES)[0]).T
            return float(values.min()), float(values.max())
        return -_largest(-frame[name]), _largest(frame[name])


def _largest(values):
    """Maximum along a profile: that of the parabola through the largest sample and its neighbours."""
    i = int(values.argmax())
    if i in (0, len(values) - 1):
        return float(values[i])
    before, here, after = values[i - 1 : i + 2]
    bend = before - 2 * here + after
    return float(here - (after - before) ** 2 / (8 * bend)) if bend < 0 else float(here)


class Program:
    def __init__(self, path, folder, say=print):
        os.environ["OPENBLAS_NUM_THREADS"] = "1"  # CPU times are then comparable
        sys.path.insert(0, str(path.resolve().parent / "python"))
        import tubule

        self.tubule, self.folder, self.say = tubule, Path(folder), say
        self.folder.mkdir(parents=True, exist_ok=True)
        self.made_by = hashlib.sha256(Path(tubule._core.__file__).read_bytes()).hexdigest()

    def run(self, case, label):
        """Runs a case, or finds its equilibria; raises Failed unless it finishes."""
        name = hashlib.sha256((self.made_by + json.dumps(case)).encode()).hexdigest()[:16]
        path, note = self.folder / f"{name}.hdf", self.folder / f"{name}.json"
        if not note.exists():
            self.say(f"  {label} ...", end="", flush=True)
            begun = time.process_time()
            try:
                result = self.tubule.run(case, output=path, overwrite=True, threads=1)
            except (ValueError, RuntimeError) as error:
                raise Failed(f"{label}: {error}") from error
            if result.stop not in ("finished", "stationary"):
                raise Failed(f"{label}: {path} ended: {result.stop}: {result.about.get('stop_message', '')}")
            note.write_text(json.dumps({"label": label, "cpu_s": time.process_time() - begun}))
            self.say(f" {time.process_time() - begun:.2f} s")
        return Run(self.tubule.read(path), json.loads(note.read_text())["cpu_s"], path)

    def frames(self, a, b):
        """Distances of two results at their common output times: (time, Hausdorff, L2, size)."""
        found = self.tubule.compare(a.result, b.result)["frames"]
        return [(frame["time"], frame["hausdorff"], frame["l2"], frame["size"]) for frame in found]

    def fitted(self, run, wave):
        """Rate of a wave (n, m) in a run."""
        return self.tubule.stability(run.result, fit=wave)["rate"]

    def amplitudes(self, run, wave):
        """Of its frames, in time."""
        return self.tubule.stability(run.result, fit=wave)["amplitude"]

    def stability(self, case, **options):
        return self.tubule.stability(case, **options)
