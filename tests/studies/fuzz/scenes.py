#!/usr/bin/python3
"""Random physics of tier axisym, and whether the error that a run states is the error that it has.

A scene is a shape, an energy, a model, what that keeps, the loads on the rest, an accuracy and an end time. Its run is compared, at 14 times, with one that is
asked for a thirtieth of the accuracy; where they differ by more than the run states, a second reference decides, with
splines of another degree and a thirtieth of that. A finished run without a warning is *silent* if its error is above
twice the stated one or above what was asked.

    scenes.py TUBULE [--first N] [--count N] [--save FILE] [--ensembles] [--places | --beads | --patches]

prints how true and stated errors compare over many scenes. With --ensembles, every scene has random rules and loads;
otherwise every other one. With --places, all are closed surfaces at a wall, a particle or in a field; where
their volume is free, most are under osmosis. With --beads, two beads draw a closed surface apart, by a force or by an extension. With --patches,
all are patches in rings, some with a bead.

    scenes.py TUBULE --print N                       the case of scene N

As a fuzzer it also draws scenes that are wild: large waves, an accuracy of any size. These are not compared; of all, the rows are
judged (rows.py).
"""

import argparse
import json
import math
import random
import resource
import signal
import sys
import tempfile
from pathlib import Path

import h5py
import rows
import toml
from sandbox import EXIT_STATUSES, Finding, Sandbox

STUDY = (0, 1, 2, 5, 7, 8)
MODELS = ("gradient-flow", "overdamped", "stokes", "fluid")
SHAPES = ("tube", "tube", "sphere", "sphere", "ellipsoid", "torus", "capsule", "dumbbell")
LIMIT = 6  # seconds of a processor for a run; of a reference 3 times as many
KNOWN = 0.1  # how well a reference must know the error of a run, relative to it


def number(x):
    return float(f"{x:.5g}")


def draw_shape(draw):
    """The shape, and a radius typical of it."""
    kind = draw.choice(SHAPES)
    size = math.exp(draw.uniform(math.log(0.5), math.log(2)))
    modes = []
    left = draw.choice((0.05, 0.15, 0.3)) * (size if kind == "tube" else 1)
    for _ in range(draw.randint(0 if kind == "tube" else 1, 3)):
        amplitude = draw.uniform(-left, left)
        left -= abs(amplitude)
        if kind == "tube":
            modes.append({"amplitude": number(amplitude), "n": draw.randint(1, 4), "phase": draw.choice((0.0, 0.0, -1.5708, number(draw.uniform(0, 6))))})
        else:
            modes.append({"amplitude": number(amplitude), "l": draw.randint(2, 6)})
    keys = {"kind": kind}
    if kind != "dumbbell" and kind != "ellipsoid":
        keys["radius"] = number(size)
    if kind == "tube":
        keys["length"] = number(size * draw.uniform(1.5, 8))
    elif kind == "capsule":
        keys["length"] = number(size * draw.uniform(0.3, 4))
    elif kind == "ellipsoid":
        keys["a"] = keys["b"] = number(size)
        keys["c"] = number(size * math.exp(draw.uniform(math.log(0.35), math.log(2.8))))
    elif kind == "torus":
        ratio = draw.uniform(0.2, 0.75)
        keys["tube_radius"] = number(size * ratio)
        size *= ratio
    if kind in ("tube", "sphere"):
        keys["mode"] = modes
    return keys, 0.6 if kind == "dumbbell" else size


def draw_energy(draw, size):
    """Moduli that make the motion well-posed more often than not, and their scale."""
    k20 = 0 if draw.random() < 0.15 else math.exp(draw.uniform(math.log(0.05), math.log(1)))
    scale = (k20 or 0.3) * size**2
    energy = {"k20": number(k20)}
    if k20 == 0 or draw.random() < 0.35:
        energy["k40"] = number(scale * math.exp(draw.uniform(math.log(0.005), math.log(0.2))))
    if draw.random() < 0.6:
        k42 = scale * math.exp(draw.uniform(math.log(0.01), math.log(0.8)))
        energy["k42"] = number(-k42 if draw.random() < 0.35 else k42)
    if draw.random() < 0.6:
        energy["H0"] = number(draw.uniform(-4, 1.5) / size)
    return energy, scale / size**2


def draw_load(draw, size, end):
    """A number, or a ramp within the run."""
    value = number(size * draw.uniform(-1, 3))
    if draw.random() < 0.6:
        return value
    times = sorted({0.0, number(end * draw.uniform(0, 0.5)), number(end * draw.uniform(0.5, 1))})
    return {"time": times, "value": [number(value * draw.uniform(0, 1)) for _ in times]}


def draw_ensemble(draw, model, tube, size, modulus, end):
    """What is kept, and what acts where something is free; as the program allows it."""
    flows = model["kind"] != "gradient-flow"
    model["volume"] = draw.choice(("fixed", "free"))
    model["area"] = draw.choice(("fixed", "reservoir") if flows else ("free", "fixed"))
    if model["volume"] == "free" and draw.random() < 0.7:
        model["pressure"] = draw_load(draw, modulus / size, end)
    if model["area"] != "fixed" and draw.random() < 0.8:
        model["tension"] = draw_load(draw, modulus, end)
    if tube and "fixed" in (model["volume"], model["area"]) and draw.random() < 0.5:
        model["period"] = "free"
        model["force"] = draw_load(draw, 6 * modulus * size, end)


def draw_place(draw, shape, size, modulus):
    """A potential in front of which the shape stands, if its extent along the axis is known."""
    extent = {"ellipsoid": shape.get("c"), "torus": shape.get("tube_radius"), "capsule": shape.get("length", 0) / 2 + size,
              "sphere": size + sum(abs(mode["amplitude"]) for mode in shape.get("mode", []))}.get(shape["kind"], 1.2)  # fmt: skip
    kind = draw.choice(("plane", "plane", "sphere", "formula"))
    if kind == "formula":
        a, b, c = (number(modulus * size**-i * draw.uniform(-0.5, 1)) for i in (1, 2, 2))
        return {"kind": kind, "formula": f"{a}*z + {b}*r^2 + {c}*z^2"}
    reach = size * math.exp(draw.uniform(math.log(0.05), math.log(0.3)))
    away = extent + reach * draw.uniform(1, 3)
    strength = modulus * draw.uniform(0.3, 6)
    wall = {"kind": kind, "law": draw.choice(("morse", "9-3")), "strength": number(strength), "range": number(reach)}
    if kind == "plane":
        return wall | draw.choice(({"z": number(-away)}, {"z": number(away), "side": "below"}))
    radius = size * draw.uniform(0.3, 3)
    return wall | {"radius": number(radius), "z": number(-away - radius)}


def place(draw, case, size, modulus):
    """Puts a closed surface at a place, and under osmosis."""
    shape, model = case["shape"], case["model"]
    case["energy"]["potential"] = [draw_place(draw, shape, size, modulus)]
    if model["kind"] == "stokes":
        model["gamma"] = 0.5
    if model.get("volume", "free" if model["kind"] == "gradient-flow" else "fixed") == "free" and draw.random() < 0.7:
        pressure = modulus / size * draw.uniform(0.3, 5)
        model["pressure"] = f"{number(pressure)}*({number(4.2 * size**3 * draw.uniform(0.3, 1.5))}/V - 1)"


def pull(draw, case, size, modulus):
    """Draws a closed surface apart by beads at its poles."""
    model, end = case["model"], case["time"]["end"]
    model["bead_width"] = number(size * math.exp(draw.uniform(math.log(0.08), math.log(0.25))))
    if draw.random() < 0.4:
        model["force"] = draw_load(draw, 8 * modulus * size, end)
    else:
        until = number(end * draw.uniform(0.2, 1))
        model["extension"] = {"time": [0.0, until], "value": [0.0, number(size * draw.uniform(-0.3, 1))]}


def hang(draw, case, size, modulus):
    """Replaces the shape by a patch in a ring or between two; a bead draws at some."""
    model, shape = case["model"], {"kind": "patch", "radius": number(size)}
    shape["height"] = number(size * draw.choice((draw.uniform(-0.8, 1.2), draw.uniform(0.05, 0.3))))
    if draw.random() < 0.4:
        shape |= {"second_radius": number(size * draw.uniform(0.4, 1.6)), "height": number(size * draw.uniform(0.2, 2))}
    elif draw.random() < 0.4:
        pull(draw, case, size, modulus)
    model["rim"] = draw.choice(("clamped", "hinged"))
    case["shape"] = shape


def scene(draw, ensembles=0.5, at=None):
    """The case of a scene; `ensembles` is the probability of random rules and loads; `at`: what acts at places, place(), pull() or hang()."""
    shape, size = draw_shape(draw)
    while (at and shape["kind"] == "tube") or (at is pull and shape["kind"] == "torus"):
        shape, size = draw_shape(draw)
    energy, modulus = draw_energy(draw, size)
    kind = draw.choice(MODELS)
    model = {"kind": kind}
    if kind in ("stokes", "fluid"):
        model["Re"] = number(math.exp(draw.uniform(math.log(0.1), math.log(10))))
        model["gamma"] = draw.choice((0.0, 0.5))
    if draw.random() < 0.25:
        model["volume"] = draw.choice(("fixed", "free"))
    end = size**4 / modulus * math.exp(draw.uniform(math.log(1e-3), math.log(1)))
    asked = math.exp(draw.uniform(math.log(5e-5), math.log(2e-2)))
    if draw.random() < ensembles:
        draw_ensemble(draw, model, shape["kind"] == "tube", size, modulus, end)
    case = {
        "tier": "axisym",
        "energy": energy,
        "model": model,
        "shape": shape,
        "accuracy": {"energy": number(asked)},
        "time": {"end": number(end), "output": [number(end * 10 ** (-i / 2)) for i in range(12, 0, -1)]},
    }
    if at:
        at(draw, case, size, modulus)
    return case


class Run:
    """A case run to its end: how it ended, what it states, and its free energies by time."""

    def __init__(self, box, case, *sets, limit=LIMIT, command="run", quantity="free_energy"):
        box.write("case.toml", toml.dump(case))
        result = box.folder / "case.hdf"
        result.unlink(missing_ok=True)
        used = processor_seconds()
        # A start that is ill-posed is an outcome, too.
        expected = ("expect.stop=ill-posed",) if "time" in case else ()
        words = box.run(command, "case.toml", "--quiet", "--overwrite", *(f"--set={x}" for x in (*expected, *sets)),
                        statuses=(*EXIT_STATUSES, -signal.SIGXCPU), limit=20 * limit, prepare=lambda: bound(limit))  # fmt: skip
        self.seconds = processor_seconds() - used
        self.warned, self.stop, self.stated, self.energy = bool(words.err.strip()), "no result", math.inf, {}
        self.time_tolerance, self.warnings = None, ""
        if words.status == -signal.SIGXCPU:
            self.stop = "time-limit"
            return
        if not result.exists():
            return
        with h5py.File(result) as file:
            about, series = file["about"].attrs, file["series"]
            self.stop, self.scale, self.stated = about.get("stop", "none"), float(about.get("E_ref", math.nan)), float(about.get("estimated_error", math.inf))
            self.warnings, self.time_tolerance = about["warnings"], about.get("time_tolerance")
            self.warned = bool(self.warnings)
            self.energy = dict(zip(series["time"][:], series[quantity][:]))

    @property
    def finished(self):
        return self.stop in ("finished", "stationary")

    def apart(self, other, times):
        """The largest difference of the energies at these times, as far as both runs have them, relative to E_ref."""
        common = [t for t in times if t in self.energy and t in other.energy]
        return max((abs(self.energy[t] - other.energy[t]) for t in common), default=math.inf) / self.scale


def bound(seconds):
    """Limits CPU seconds, so that other work on the machine changes no outcome."""
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))


def processor_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Reference:
    """More accurate runs of a case, made when they are needed."""

    def __init__(self, box, case):
        self.box, self.case, self.runs = box, case, {}

    def run(self, level):
        if level not in self.runs:
            asked = max(self.case["accuracy"]["energy"] / 30 ** (1 + level), 3e-11)
            sets = [f"accuracy.energy={asked}"] + (["discretisation.order=7"] if level else [])
            self.runs[level] = Run(self.box, self.case, *sets, limit=3 * LIMIT)
        return self.runs[level]

    def error(self, run):
        """The error of a run over E_ref, and how far that may be off; None where the references know nothing."""
        times = [0.0, *self.case["time"]["output"], self.case["time"]["end"]]
        first = self.run(0)
        if first.finished:
            error = run.apart(first, times)
            if error <= run.stated and first.stated <= run.stated:
                return error, 0.0
        second = self.run(1)
        if not second.finished:
            return None
        error = run.apart(second, times)
        return error, min(second.stated, second.apart(first, times)) if first.finished else second.stated


def verdict(run, asked, error):
    """What became of a run whose true error is (error, how far that may be off) or None."""
    if not run.finished:
        return "stopped"
    if run.stated >= 1 or run.warned:
        return "told"
    if error is None or error[1] > KNOWN * max(error[0], 2 * run.stated, asked):
        return "undecided"
    return "silent" if error[0] > 2 * run.stated or error[0] > asked else "right"


def wild(rng, case):
    """Larger waves, another accuracy, a shorter run: a start that is hard to resolve."""
    if rng.random() < 0.4:  # a deeply dented cell that relaxes freely
        case["shape"] = {"kind": "sphere", "radius": 1.0, "mode": [{"amplitude": 0.0, "l": rng.randint(4, 6)} for _ in range(2)]}
        case["model"] = {"kind": "gradient-flow"}
    shape = case["shape"]
    for mode in shape.get("mode", []):
        mode["amplitude"] = number(rng.uniform(-0.45, 0.45) * (shape["radius"] if shape["kind"] == "tube" else 1))
    case["accuracy"]["energy"] = number(10 ** rng.uniform(*rng.choice(((-9, -4), (-4, -1.5)))))
    case["time"] = {"end": number(case["time"]["end"] * 10 ** rng.uniform(-4, 0)), "limit": LIMIT / 2}


def one(rng, box):
    case = scene(rng, at=rng.choice((None, None, place, pull, hang)))
    tame = rng.random() < 0.5
    if not tame:
        wild(rng, case)
    run = Run(box, case)
    result = box.folder / "case.hdf"
    if result.exists() and run.stop != "none":
        rows.judge(case, result)
    if not tame:
        return f"wild: {run.stop}"
    error = Reference(box, case).error(run) if run.finished else None
    kind = verdict(run, case["accuracy"]["energy"], error)
    if kind == "silent":
        raise Finding("silent", f"true error {error[0]:.2g}, stated {run.stated:.2g}, asked {case['accuracy']['energy']:.2g}")
    return kind if run.finished else run.stop


# ------------------------------------------------------------------------------------------------ many scenes


def scene_number(n, ensembles, at):
    return scene(random.Random(f"scene {n}"), ensembles, at)


def judge(n, case, program, top):
    box = Sandbox(program.resolve(), Path(top) / str(n))
    run = Run(box, case)
    error, asked = Reference(box, case).error(run) if run.finished else None, case["accuracy"]["energy"]
    return {"scene": n, "asked": asked, "model": case["model"]["kind"], "shape": case["shape"]["kind"], "stop": run.stop,
            "verdict": verdict(run, asked, error), "stated": run.stated, "error": error and error[0], "seconds": run.seconds}  # fmt: skip


def report(lines):
    counts = {v: sum(x["verdict"] == v for x in lines) for v in ("right", "silent", "told", "stopped", "undecided")}
    ratios = sorted(x["error"] / x["stated"] for x in lines if x["verdict"] in ("right", "silent"))
    print(f"{counts}, {sum(x['seconds'] for x in lines):.1f} s of processor")
    if ratios:
        above = sum(r > 1 for r in ratios)
        print(f"    true/stated: median {ratios[len(ratios) // 2]:.3f}, above 1: {above} of {len(ratios)}, largest {ratios[-1]:.3g}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--save", type=Path, help="a line of JSON for each scene")
    parser.add_argument("--ensembles", action="store_const", const=1, default=0.5, help="in every scene")
    parser.add_argument("--places", dest="at", action="store_const", const=place, help="closed surfaces at walls, particles and in fields")
    parser.add_argument("--beads", dest="at", action="store_const", const=pull, help="closed surfaces that two beads draw apart")
    parser.add_argument("--patches", dest="at", action="store_const", const=hang, help="patches in rings")
    parser.add_argument("--print", type=int)
    a = parser.parse_args()
    if a.print is not None:
        print(toml.dump(scene_number(a.print, a.ensembles, a.at)), end="")
        return 0
    lines = []
    for n in range(a.first, a.first + a.count):
        with tempfile.TemporaryDirectory() as top:
            lines.append(judge(n, scene_number(n, a.ensembles, a.at), a.program, top))
        if a.save:
            a.save.write_text("".join(json.dumps(x) + "\n" for x in lines))
    report(lines)
    silent = [x for x in lines if x["verdict"] == "silent"]
    for x in silent:
        print(f"silent: {x}")
    return 1 if silent else 0


if __name__ == "__main__":
    sys.exit(main())
