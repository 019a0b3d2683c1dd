"""One result of every kind, small, with the case that it is of: made once, then damaged, resumed and handed to all commands."""

import functools
import os
import subprocess
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

TUBE = """tier = "axisym"
energy = {k20 = 0.5, H0 = -1.0, k42 = 0.1}
shape = {kind = "tube", radius = 1.0, length = 3.0, mode = [{amplitude = 0.12, n = 1, phase = 0.3}]}
accuracy = {energy = 1e-4}
time = {end = 0.2, output = [0.01, 0.05]}
"""
CURVE = TUBE.replace('kind = "tube", radius = 1.0, length = 3.0', 'kind = "sphere", radius = 1.0').replace("n = 1, phase = 0.3", "l = 2").replace("1e-4", "1e-2")
EQUILIBRIUM = """tier = "axisym"
energy = {k20 = 0.125, H0 = -2.0, k42 = 0.06}
shape = {kind = "capsule", radius = 0.5, length = 3.0}
accuracy = {energy = 1e-4}
[equilibrium]
"""
SURFACE = """tier = "surface3d"
energy = {k20 = 0.2, k42 = 0.05}
model = {kind = "fluid"}
shape = {kind = "sphere", radius = 1.0, mode = [{amplitude = 0.2, l = 2, m = 1}]}
discretisation = {elements = 80, order = 2, step = 1e-2}
accuracy = {energy = 1e-1}
time = {end = 0.05, output = [0.02]}
"""
AUTO = """tier = "auto"
energy = {k20 = 1.0, H0 = -0.5}
model = {kind = "overdamped", volume = "free"}
shape = {kind = "tube", radius = 1.0, length = 4.0}
auto = {noise = 1e-4}
accuracy = {energy = 1e-2}
time = {end = 0.1, output = [0.05]}
"""
CASES = {"tube": TUBE, "curve": CURVE, "equilibrium": EQUILIBRIUM, "surface": SURFACE, "auto": AUTO}
SCAN = ("scan", "tube.toml", "--over=energy.k42=0,0.1,0.2", "--jobs=1", "--quiet", "-o", "scan.hdf")

# The tube with 400 frames, for a second or so: time to be disturbed. Explicit settings: it never begins again.
SLOW = TUBE.replace("[0.01, 0.05]", str([i / 2000 for i in range(1, 400)]) + ", max_order = 2") + "discretisation = {elements = 40, time_tolerance = 1e-12}\n"


@dataclass
class Sample:
    kind: str
    case: bytes  # of a scan, its base
    result: bytes

    def put(self, box):
        """case.toml and case.hdf in a sandbox."""
        box.write("case.toml", self.case)
        box.write("case.hdf", self.result)


LOCK = threading.Lock()


def samples(program):
    with LOCK:
        return made(program)


@functools.cache
def made(program):
    with tempfile.TemporaryDirectory() as folder:
        run = functools.partial(subprocess.run, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        for name, text in CASES.items():
            Path(folder, f"{name}.toml").write_text(text)
            run([program, "run", f"{name}.toml", "--quiet"])
        run([program, *SCAN])
        kinds = [*CASES, "scan"]
        finished = [Sample(kind, CASES.get(kind, TUBE).encode(), Path(folder, f"{kind}.hdf").read_bytes()) for kind in kinds]
        return [*finished, killed(program, Path(folder))]


def killed(program, folder):
    """A run that was killed when it had some rows."""
    (folder / "slow.toml").write_text(SLOW)
    result = folder / "slow.hdf"
    environment = os.environ | {"TUBULE_WRITE_SECONDS": "0.05"}
    with subprocess.Popen([program, "run", "slow.toml", "--quiet"], cwd=folder, env=environment) as process:
        while process.poll() is None and not (result.exists() and result.stat().st_size > 100_000):
            time.sleep(0.001)
        process.kill()
    return Sample("killed", SLOW.encode(), result.read_bytes())
