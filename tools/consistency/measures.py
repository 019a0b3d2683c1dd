"""What the scenes compare: runs of both tiers by the Python package `tubule`, each on one thread, and the rows that result.

A measure is a function (Program, ...) -> list of Row. Bounds apply to relative differences on the finest mesh. Results that
the same program made of the same case are reused, so that a suite that was stopped continues.
"""

import copy
import hashlib
import json
import math
import os
import sys
import time
import tomllib
import warnings
from dataclasses import dataclass, field
from pathlib import Path

CASES = Path(__file__).resolve().parents[2] / "cases"
MODELS = ("gradient-flow", "overdamped", "stokes", "fluid")
ORDER = 4  # of triangles
PIECES = 8  # subdivision of a triangle side in the search for extremes
STEPS = 6  # for the first moments; a fit of a wave needs as many frames
# Errors in time should decrease like those in space, with the fourth power of the mesh width. They follow the tolerance
# to the power 2/3, so the tolerance decreases with the third power of the number of triangles. Fixed steps are short
# enough for all meshes.
FALL = {"time_tolerance": 3, "step": 0}
LOOSER = 10  # accuracy of the second run of tier 1; the difference is the error of the first, except for energies
AMPLITUDE = 1e-3  # of small waves: nonlinear terms are of relative size 1e-6
ENOUGH = 0.1  # of the bound: for smaller differences the order is not checked
SHAPES = ("shape, Hausdorff", "shape, L2")
BENDING = ("energy", "energy_20", "energy_40", "energy_42", "kinetic_energy", "dissipated")  # relative to E_ref


def case(name, **changes):
    """cases/NAME.toml as nested dicts, without its expectations, with changes as of changed()."""
    out = tomllib.loads((CASES / f"{name}.toml").read_text())
    out.pop("expect", None)
    return changed(out, **changes)


def changed(original, **changes):
    """A copy: a dict is merged, a list (modes) replaces, None removes."""
    out = copy.deepcopy(original)
    for key, value in changes.items():
        out[key] = changed(out.get(key, {}), **value) if isinstance(value, dict) else value
    return {key: value for key, value in out.items() if value is not None}


@dataclass
class Row:
    """A quantity from tier 1, or its exact value, and from 3D on a sequence of finer meshes. Numbers are lists with one
    entry per time. Differences are the largest over all times, relative to `scale`."""

    quantity: str
    reference: list
    scale: float
    bound: float | None  # of the difference on the finest mesh, or of `error` without meshes; None: not checked
    error: float = 0.0  # of the reference, relative to scale
    times: list = field(default_factory=lambda: [0.0])
    found: dict = field(default_factory=dict)  # triangles -> list
    must_fall: bool = True

    def difference(self, triangles):
        return max(abs(a - b) for a, b in zip(self.found[triangles], self.reference)) / self.scale

    @property
    def meshes(self):
        return sorted(self.found)

    @property
    def order(self):
        """Order in the mesh width, from the mesh with the largest difference (the coarsest, unless its difference is
        accidentally small) to the finest; None where the error of the reference or rounding would determine it."""
        if len(self.found) < 2:
            return None
        last = self.meshes[-1]
        first = max(self.meshes[:-1], key=self.difference)
        coarse, fine = self.difference(first), self.difference(last)
        if fine <= max(3 * self.error, 1e-9):
            return None
        return math.log(coarse / fine) / (0.5 * math.log(last / first)) if coarse > 0 else -math.inf

    def complaints(self):
        """Violated bounds, in words."""
        if self.bound is None:
            return []
        out, finest = [], self.difference(self.meshes[-1]) if self.found else self.error
        if not finest <= self.bound:
            out.append(f"differs by {finest:.2g}, more than {self.bound:.2g}")
        if self.must_fall and self.order is not None and self.order < 1 and finest > ENOUGH * self.bound:
            out.append(f"falls with order {self.order:.2g} only")
        return out


class Failed(Exception):
    """A run or another call failed."""


@dataclass
class Run:
    """One result; times are those of its rows."""

    result: object  # tubule.Result
    cpu_s: float

    def __getattr__(self, name):  # about, series, frames
        return getattr(self.result, name)

    def at(self, name, time):
        """The row of an output time."""
        times = self.series["time"]
        i = int(abs(times - time).argmin())
        if abs(times[i] - time) > 1e-12 * max(time, times[-1]):
            raise Failed(f"{self.result}: has no row at t = {time}")
        return float(self.series[name][i])

    def dissipated(self, time):
        """Energy dissipated until then: identity_defect = E + E_kinetic - that of the initial shape + this."""
        def total(t):
            return self.at("energy", t) + (self.at("kinetic_energy", t) if "kinetic_energy" in self.series else 0)

        return self.at("identity_defect", time) + total(0) - total(time)

    def first(self):
        """Values of the first row, and the extremes of H and K of the first frame, on a surface also inside the triangles."""
        from tubule.drawing.raster import division, lagrange

        out, frame = {name: float(values[0]) for name, values in self.series.items()}, self.frames[0]
        for name in ("H", "K"):
            if frame.kind == "surface":
                values = frame[name][frame.cells] @ lagrange(frame.order, division(PIECES)[0]).T
                out[f"min {name}"], out[f"max {name}"] = float(values.min()), float(values.max())
            else:
                out[f"min {name}"], out[f"max {name}"] = -_largest(-frame[name]), _largest(frame[name])
        return out

    @property
    def E_ref(self):
        return float(self.about["E_ref"])


def _largest(values):
    """Maximum along a profile: that of the parabola through the largest sample and its neighbours."""
    i = int(values.argmax())
    if i in (0, len(values) - 1):
        return float(values[i])
    before, here, after = values[i - 1 : i + 2]
    bend = before - 2 * here + after
    return float(here - (after - before) ** 2 / (8 * bend)) if bend < 0 else float(here)


class Program:
    """Runs cases, and sums the CPU seconds of a scene: cost[None] of tier 1, cost[triangles] in 3D."""

    def __init__(self, path, folder, elements):
        os.environ["OPENBLAS_NUM_THREADS"] = "1"  # CPU times are then comparable
        sys.path.insert(0, str(path.resolve().parent / "python"))
        import tubule

        self.tubule, self.folder, self.elements, self.cost = tubule, Path(folder), elements, {}
        self.folder.mkdir(parents=True, exist_ok=True)
        self.made_by = hashlib.sha256(Path(tubule._core.__file__).read_bytes()).hexdigest()

    def run(self, case, label, triangles=None):
        """Runs a case, or finds its equilibria; raises Failed unless it finishes."""
        name = hashlib.sha256((self.made_by + json.dumps(case)).encode()).hexdigest()[:16]
        path, note = self.folder / f"{name}.hdf", self.folder / f"{name}.json"
        if not note.exists():
            print(f"  {label} ...", end="", flush=True)
            begun = time.process_time()
            try:
                with warnings.catch_warnings(action="ignore"):  # of errors that are not asked for
                    result = self.tubule.run(case, output=path, overwrite=True, threads=1)
            except (ValueError, RuntimeError) as error:
                raise Failed(f"{label}: {error}") from error
            if result.stop not in ("finished", "stationary"):
                raise Failed(f"{label}: {path} ended: {result.stop}: {result.about.get('stop_message', '')}")
            note.write_text(json.dumps({"label": label, "cpu_s": time.process_time() - begun}))
            print(f" {time.process_time() - begun:.2f} s", flush=True)
        run = Run(self.tubule.read(path), json.loads(note.read_text())["cpu_s"])
        triangles = triangles and int(run.about["elements"])
        self.cost[triangles] = self.cost.get(triangles, 0.0) + run.cpu_s
        return run

    def axisym(self, start, accuracy=None):
        made = changed(start, accuracy={"energy": accuracy}) if accuracy else start
        return self.run(made, "tier 1" + (f", asked for {accuracy:g}" if accuracy else ""))

    def fine_and_loose(self, start, accuracy):
        return self.axisym(start, accuracy), self.axisym(start, accuracy * LOOSER)

    def on_meshes(self, rows, start, read, more=(), **in_time):
        """Fills the rows from runs in 3D: read(run, quantity of the row). `in_time`: time_tolerance or step for the first of
        the meshes; `more` are further meshes. Returns the rows."""
        for elements in (*self.elements, *more):
            less = self.elements[0] / elements
            discretisation = {key: value * less ** FALL[key] for key, value in in_time.items()}
            # The requested accuracy only decides which increase of the energy rejects a step; smaller increases are noise.
            accuracy = {"energy": 1e-3, **({"r_min": 1e-2} if "time" in start else {})}
            made = changed(start, tier="surface3d", accuracy=accuracy,
                           discretisation=discretisation | {"elements": elements, "order": ORDER})  # fmt: skip
            run = self.run(made, f"3D, {elements} triangles", elements)
            for row in rows:
                row.found[int(run.about["elements"])] = read(run, row)
        return rows


def initial_shape(program, start, exact, bounds, accuracy=1e-9, mesh="uniform", must_fall=True):
    """Geometry and energies of an initial shape. `exact`: values in closed form; all others are from the first row and frame
    of tier 1. In 3D the surface does not move, so curvatures are those of the patch recovery."""
    fine, loose = program.fine_and_loose(changed(start, time={"end": 1e-6, "output": []}), accuracy)
    values, other, rows = fine.first() | exact, loose.first(), []
    for name, bound in bounds.items():
        scale = fine.E_ref if name in BENDING else 4 * math.pi if name == "integral_K" else abs(values[name])
        error = 0.0 if name in exact else abs(values[name] - other[name]) / scale
        falls = must_fall and name[:4] not in ("min ", "max ")
        rows.append(Row(name, [values[name]], scale, bound, error, must_fall=falls))
    resting = changed(start, time=None, model=None, velocity=None, discretisation={"mesh": mesh})
    return program.on_meshes(rows, resting, lambda run, row: [run.first()[row.quantity]])


def beginnings(program, start, waves, at_once, with_inertia, bounds):
    """First moments of each model, before anything has moved noticeably: dissipation, the force that keeps the volume, the
    rates of waves and, for a fluid from rest, the acceleration. `at_once`, `with_inertia`: the time of the comparison. It
    is longer for a fluid: volumes are kept to 1e-12, and this over the square of a step is the error of lambda."""
    out = []
    for kind in MODELS:
        # From rest, the first step is of first order and leaves errors in the positions as large as the displacements.
        names = ["acceleration squared"] if kind == "fluid" else ["dissipation", *(f"wave {wave}" for wave in waves)]
        names += [] if kind == "gradient-flow" else ["lambda"]
        viscous = {"Re": 2.0, "gamma": 0.3} if kind in ("stokes", "fluid") else {}
        end = with_inertia if kind == "fluid" else at_once
        time = {"end": end, "output": [end * i / STEPS for i in range(1, STEPS)]}
        begun = changed(changed(start, model=None), model={"kind": kind, **viscous}, time=time)

        def value(run, name):
            if name.startswith("wave "):
                amplitude = program.tubule.stability(run.result, fit=(int(name.removeprefix("wave ")),))["amplitude"]
                return (amplitude[-1] - amplitude[0]) / end
            if name == "acceleration squared":  # from rest E_kinetic = t^2/2 INT (du/dt)^2
                return run.at("kinetic_energy", end) / (end**2 / 2)
            return run.at(name, end)

        fine, loose = program.fine_and_loose(begun, 1e-8)
        rows = [Row(f"{kind}, {name}", [value(fine, name)], abs(value(fine, name)), bounds[name],
                    abs(value(loose, name) / value(fine, name) - 1), [end]) for name in names]  # fmt: skip
        out += program.on_meshes(rows, begun, lambda run, row: [value(run, row.quantity.split(", ")[1])], step=end / STEPS)
    return out


def rates(program, start, waves, bounds, step, more=()):
    """Growth or decay of small waves (n, m), all in one run in 3D, with the spectrum and a run of tier 1; the error of
    both is their distance from the closed form."""
    stability, end = program.tubule.stability, start["time"]["end"]
    begun = changed(start, time={"output": [round(end * i / 10, 12) for i in range(1, 10)]})
    (model,) = stability(waved(begun, []), waves=1, modes=2)["models"]
    linear, spectrum = {(wave["n"], wave["m"]): wave["rate"] for wave in model["waves"]}, spectra(program, begun)

    def row(name, found, exact, bound):
        return Row(name, [found], abs(exact), bound, abs(found / exact - 1))

    rows = [row(f"({n}, {m})", min(spectrum[m], key=lambda rate: abs(rate - linear[n, m])), linear[n, m], bounds[n, m])
            for n, m in waves]  # fmt: skip
    wave_of = dict(zip((one.quantity for one in rows), waves))
    program.on_meshes(rows, waved(begun, waves), lambda run, row: [stability(run.result, fit=wave_of[row.quantity])["rate"]], more, step=step)
    if (1, 0) in waves:
        alone = program.axisym(waved(begun, [(1, 0)]), 1e-10)
        rows.append(row("(1, 0), run of tier 1", stability(alone.result, fit=(1, 0))["rate"], linear[1, 0], bounds["tier 1"]))
    return rows


def waved(start, waves):
    return changed(start, shape={"mode": [{"amplitude": AMPLITUDE, "n": n, "m": m} for n, m in waves]})


def spectra(program, start):
    """Rates of tier 1 by m. With fixed area and volume the tension of a tube is undetermined; this uses that with free volume."""
    stability, volume = program.tubule.stability, "free" if start["model"]["kind"] == "gradient-flow" else "fixed"
    straight = waved(changed(start, model={"volume": volume}, accuracy={"energy": 1e-9}), [])
    tension = stability(waved(start, []), waves=1)["models"][0]["tension"]
    (model,) = stability(straight, numerical=True, modes=2, rates=8, tension=tension)["models"]
    return {entry["m"]: entry["rates"] for entry in model["modes"]}


def motion(program, start, accuracy, tolerance, bounds, must_fall=True):
    """Series at the output times, and distances of the shapes there, relative to their size."""
    fine, loose = program.fine_and_loose(start, accuracy)
    later = [*start["time"].get("output", []), start["time"]["end"]]

    def along(run, name, times):
        if name in SHAPES:
            frames = program.tubule.compare(fine.result, run.result)["frames"]
            nearest = [min(frames, key=lambda frame: abs(frame["time"] - time)) for time in times]
            return [frame[("hausdorff", "l2")[SHAPES.index(name)]] / frame["size"] for frame in nearest]
        return [run.dissipated(time) if name == "dissipated" else run.at(name, time) for time in times]

    rows = []
    for name, bound in bounds.items():
        times = [0.0, *later] if name in BENDING and name != "dissipated" else later
        values = [0.0] * len(times) if name in SHAPES else along(fine, name, times)
        scale = fine.E_ref if name in BENDING else 1.0 if name in SHAPES else max(map(abs, values))
        error = max(abs(a - b) for a, b in zip(values, along(loose, name, times))) / scale
        falls = must_fall and name not in ("r_min", "r_max")  # extremes over nodes, which miss the true extreme
        error = float(fine.about["estimated_error"]) if name == "energy" else error
        rows.append(Row(name, values, scale, bound, error, times, {}, falls))
    return program.on_meshes(rows, start, lambda run, row: along(run, row.quantity, row.times), time_tolerance=tolerance)


def at_equilibrium(program, resting, moving, bounds, tolerance):
    """An equilibrium of tier 1 by Newton's method, and the final shape of a run in 3D. The error is the distance of a run of
    tier 1 from the equilibrium at that time."""
    rest = program.run(resting, "tier 1, in equilibrium")
    end, moved = moving["time"]["end"], program.axisym(moving)
    rows = []
    for name, bound in bounds.items():
        value = rest.series[name][-1]
        rows.append(Row(name, [value], rest.E_ref, bound, abs(moved.at(name, end) - value) / rest.E_ref, [end], {}, False))
    return program.on_meshes(rows, moving, lambda run, row: [run.at(row.quantity, end)], time_tolerance=tolerance)
