"""Runs of both tiers, each in its own process, and access to their results. Results that the same program made from the
same case are reused, so that a suite that was stopped continues."""

import hashlib
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import cases

sys.path.append(str(Path(__file__).resolve().parents[1] / "python/tubule"))  # last: it has other modules of our names
from drawing.raster import division, lagrange  # noqa: E402
from drawing.results import read_result  # noqa: E402

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}  # CPU times are then comparable
PIECES = 8  # subdivision of a triangle side in the search for extremes


class Failed(Exception):
    """A run or another call of the program failed."""


@dataclass
class Run:
    """One result. Times are those of its rows."""

    path: Path
    cpu_s: float
    about: dict
    series: dict

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
        drawn = read_result(self.path)
        if drawn.surfaces:
            places, _ = division(PIECES)
            values = getattr(drawn.surfaces[0], name) @ lagrange(drawn.surfaces[0].order, places).T
            return float(values.min()), float(values.max())
        values = getattr(drawn.frames[0], name)
        return -_largest(-values), _largest(values)


def _largest(values):
    """Maximum along a profile: that of the parabola through the largest sample and its neighbours."""
    i = int(values.argmax())
    if i in (0, len(values) - 1):
        return float(values[i])
    before, here, after = values[i - 1 : i + 2]
    bend = before - 2 * here + after
    return float(here - (after - before) ** 2 / (8 * bend)) if bend < 0 else float(here)


def keep(path, text):
    """Writes the file completely or not at all."""
    aside = path.with_name(path.name + ".part")
    aside.write_text(text)
    os.replace(aside, path)


class Program:
    def __init__(self, path, folder, say=print):
        self.path, self.folder, self.say = Path(path).resolve(), Path(folder), say
        self.folder.mkdir(parents=True, exist_ok=True)
        self.made_by = hashlib.sha256(self.path.read_bytes()).hexdigest()

    def ask(self, *arguments):
        """JSON output of the program. File names identify the contents, so answers can be cached."""
        words = [Path(word).name if isinstance(word, Path) else str(word) for word in arguments]
        answer = self.folder / f"{hashlib.sha256(' '.join([self.made_by, *words]).encode()).hexdigest()[:16]}.answer"
        if answer.exists():
            return json.loads(answer.read_text())
        done = subprocess.run([self.path, *map(str, arguments)], capture_output=True, text=True, env={**os.environ, **ONE_THREAD})
        if done.returncode != 0:
            raise Failed(f"tubule {' '.join(map(str, arguments))}: status {done.returncode}: {done.stderr.strip()}")
        keep(answer, done.stdout)
        return json.loads(done.stdout)

    def case_file(self, case):
        content = cases.text(case)
        path = self.folder / f"{hashlib.sha256((self.made_by + content).encode()).hexdigest()[:16]}.toml"
        path.write_text(content)
        return path

    def run(self, case, label, command="run"):
        """Runs a case; raises Failed unless it finishes."""
        path = self.case_file(case)
        result, note = path.with_suffix(".hdf"), path.with_suffix(".json")
        if not (result.exists() and note.exists()):
            self.say(f"  {label} ...", end="", flush=True)
            words = [self.path, command, "--quiet", path, "-o", result]
            with open(path.with_suffix(".log"), "w") as log:
                process = subprocess.Popen(words, stdout=log, stderr=log, env={**os.environ, **ONE_THREAD})
                _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            if process.returncode != 0:
                said = path.with_suffix(".log").read_text().strip()
                raise Failed(f"{label}: {path} ended with status {process.returncode}: {said}")
            cpu_s = usage.ru_utime + usage.ru_stime
            keep(note, json.dumps({"label": label, "cpu_s": cpu_s}))
            self.say(f" {cpu_s:.2f} s")
        cpu_s = json.loads(note.read_text())["cpu_s"]
        said = read_result(result)
        return Run(result, cpu_s, said.about, said.series)

    def frames(self, a, b):
        """Distances of two results at their common output times: (time, Hausdorff, L2, size)."""
        found = self.ask("compare", a.path, b.path, "--json")["frames"]
        return [(frame["time"], frame["hausdorff"], frame["l2"], frame["size"]) for frame in found]

    def fitted(self, run, wave):
        """Rate of a wave "n,m" in a run."""
        return self.ask("stability", run.path, "--fit", wave, "--json")["rate"]

    def amplitudes(self, run, wave):
        """Of its frames, in time."""
        return self.ask("stability", run.path, "--fit", wave, "--json")["amplitude"]

    def stability(self, case, *options):
        return self.ask("stability", self.case_file(case), *options, "--json")
