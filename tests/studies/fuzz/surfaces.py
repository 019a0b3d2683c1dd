"""Scenes of tier surface3d: random surfaces of few triangles and random moduli, all models, shapes and schemes, in short motion.

What ends says why; area and volume are kept as the model says, or the run says that they are not; no row has an energy that
rose by more than the error in that row; no start that is free of intersections is taken for one that intersects itself; no
stated error is zero. Some of the runs that finish without a warning are compared with one of more triangles and shorter steps."""

import math
import re

import numpy as np
import rows
import toml
from sandbox import Finding

STUDY = 4
MODELS = ("gradient-flow", "overdamped", "stokes", "fluid")
LIMIT = 15  # seconds that a run is given, in the case
KEPT = 1e-8  # area and volume, relative; the program itself stops steps that are further off
DRIFT = 1e-2  # of the accuracy asked for: of the volume, where it is one condition with the area
COMPARED = 0.3  # part of the runs that are compared with a finer one
NOISE = 1e-12  # of E_ref: rounding of sums


def number(x):
    return float(f"{x:.4g}")


def modes(rng, most, tube):
    out = []
    for _ in range(rng.randint(0, 3)):
        amplitude = rng.uniform(-most, most)
        most -= abs(amplitude)
        if tube:
            out.append({"amplitude": number(amplitude), "n": rng.randint(1, 2), "m": rng.randint(0, 2)})
        else:
            l = rng.randint(1, 5)
            out.append({"amplitude": number(amplitude), "l": l, "m": rng.randint(0, l)})
    return {"mode": out} if out else {}


def shape(rng):
    kind = rng.choice(("sphere", "sphere", "capsule", "capsule", "ellipsoid", "torus", "tube", "tube"))
    size = math.exp(rng.uniform(math.log(0.5), math.log(2)))
    wave = rng.choice((1e-4, 0.01, 0.1, 0.2))
    keys = {"kind": kind}
    match kind:
        case "sphere":
            keys |= {"radius": number(size)} | modes(rng, wave, False)
        case "capsule":
            keys |= {"radius": number(size), "length": number(size * 10 ** rng.uniform(-2, 0.7))}
        case "ellipsoid":
            keys |= {axis: number(size * math.exp(rng.choice((0.02, 0.2, 0.5)) * rng.uniform(-1, 1))) for axis in "abc"}
        case "torus":
            keys |= {"radius": number(size), "tube_radius": number(size * rng.uniform(0.3, 0.7))}
        case "tube":
            keys |= {"radius": number(size), "length": number(size * rng.uniform(2, 6))} | modes(rng, wave * size, True)
    return keys, size


def case(rng):
    keys, size = shape(rng)
    kind = rng.choice(MODELS)
    model = {"kind": kind}
    if kind in ("stokes", "fluid"):
        model |= {"Re": number(10 ** rng.uniform(-1, 1)), "gamma": rng.choice((0.0, 0.5, 2.0))}
    elif kind == "gradient-flow" and rng.random() < 0.5:
        model["volume"] = "fixed"
    scale = {"k20": 1, "k40": 0.02 * size * size, "k42": 0.1 * size * size}
    energy = {key: number(part * rng.uniform(0.1, 1)) for key, part in scale.items() if key == "k20" or rng.random() < 0.4}
    energy["H0"] = number(rng.uniform(-2, 1) / size)
    choices = {"elements": rng.randint(80, 180), "order": rng.randint(2, 4)}
    choices["mesh"] = rng.choice(("uniform", "uniform", "irregular", "graded" if keys["kind"] != "torus" else "uniform"))
    if rng.random() < 0.6:
        choices["scheme"] = rng.choice(("bdf2", "alpha", "euler") if kind == "fluid" else ("bdf", "bdf2", "alpha", "euler"))
    # A sphere of size R changes in about R^4/k20 (friction), R^3 sqrt(rho/k20) (inertia): a small part of that.
    time = {"end": number(size**4 * 10 ** rng.uniform(-5, -2)), "limit": LIMIT}
    scene = {"tier": "surface3d", "energy": energy, "model": model, "shape": keys}
    return scene | {"accuracy": {"energy": number(10 ** rng.uniform(-2.5, -1))}, "discretisation": choices, "time": time}


def judge(scene, out):
    """What must hold of every run that has rows, wherever it stopped."""
    model, asked = scene["model"], scene["accuracy"]["energy"]
    kind = model["kind"]
    said = out.stop == "resolution-lost" and "drift" in out.about["stop_message"]
    if kind != "gradient-flow" and out.drift("area") > KEPT:
        raise Finding("area", f"the area drifts by {out.drift('area'):.3g}")
    if model.get("volume", "free" if kind == "gradient-flow" else "fixed") == "fixed" and not said:
        drift = out.drift("volume")
        if drift > DRIFT * asked:
            raise Finding("volume", f"the volume drifts by {drift:.3g}, {asked} asked")
        if drift > KEPT and "drift" not in str(out.about["warnings"]):
            raise Finding("volume-unsaid", f"the volume drifts by {drift:.3g}, without a warning")
    total = out.series["energy"] + out.series["kinetic_energy"]
    rise = total - np.minimum.accumulate(total) - out.series["energy_error"]
    if rise.max() > NOISE * out.E_ref:
        row = int(rise.argmax())
        raise Finding("rise", f"at t = {out.series['time'][row]:.6g} the energy is {rise[row] / out.E_ref:.3g} of E_ref above its lowest, beyond its error")
    if out.error == 0 or (out.series["energy_error"][1:] <= 0).any():
        raise Finding("no-error", f"a stated error of 0, stop {out.stop}")
    if out.stop == "self-intersection" and out.about["stop_time"] == 0:
        raise Finding("intersects", f"a start that is free of intersections: {out.about['stop_message']}")


def compare(box, scene, out):
    """With a finer run, where both have got to."""
    finer = scene | {"discretisation": scene["discretisation"] | {"elements": 2 * scene["discretisation"]["elements"], "order": 4}}
    finer["discretisation"]["time_tolerance"] = 0.1 * float(out.about["time_tolerance"])
    finer["time"] = scene["time"] | {"limit": 4 * LIMIT}
    box.write("finer.toml", toml.dump(finer))
    box.run("run", "finer.toml", "--quiet", "-o", "finer.hdf", limit=8 * LIMIT)
    reference = rows.Outcome(box.folder / "finer.hdf")
    if reference.stop != "finished":
        return "reference " + reference.stop
    apart = abs(out.series["energy"][-1] - reference.series["energy"][-1]) / out.E_ref
    stated = 2 * (out.error + reference.error)
    if apart > max(stated, NOISE) and apart > 2 * scene["accuracy"]["energy"]:
        raise Finding("silent", f"true error {apart:.3g}, stated {out.error:.3g}, {scene['accuracy']['energy']} asked")
    return "compared"


def one(rng, box):
    scene = case(rng)
    compares = rng.random() < COMPARED
    box.write("case.toml", toml.dump(scene))
    done = box.run("run", "case.toml", "--quiet", "-o", "result.hdf", limit=4 * LIMIT)
    if done.status == 2:
        if re.search(r"case\.toml:\d+", done.err):
            return "refused"
        raise Finding("no-place", f"refused without a line: {done.err[:300]!r}")
    rows.judge(scene, box.folder / "result.hdf")
    out = rows.Outcome(box.folder / "result.hdf")
    if not out.about["stop_message"]:
        raise Finding("no-reason", f"{out.stop} without a message")
    if len(out.series["time"]):
        judge(scene, out)
    if compares and out.stop == "finished" and not out.about["warnings"]:
        return compare(box, scene, out)
    return out.stop
