"""Maps of tier axisym: motions by parametrisation, elements and tolerance, random scenes, vesicles at rest."""

import itertools
import random

import h5py
import numpy as np
from judging import NUMERICS, PHYSICS, Judgement, judged_run
from lattice import Axis, Map
from scenes import MODELS, Run, scene

SECONDS = 60  # of a processor, for a run; mostly a second or two
PARAMETRISATIONS = ("graph", "even", "material")
PEARLING = {"k20": 0.2, "H0": -1.0, "k42": 0.002}


def tube(amplitude, length, energy, end, accuracy=1e-4):
    shape = {"kind": "tube", "radius": 1.0, "length": float(length), "mode": [{"amplitude": float(amplitude), "n": 1}]}
    case = {"tier": "axisym", "energy": energy, "shape": shape, "accuracy": {"energy": accuracy}}
    return case | {"time": {"end": float(end), "output": [end / 100, end / 10, end / 3]}}


def judged_motion(box, case, variant, **keys):
    """In gradient flow, or where the parameter goes with the membrane: overdamped."""
    model = {"kind": "overdamped" if variant == "material" else "gradient-flow"}
    case = case | {"model": model, "discretisation": {"parametrisation": variant} | keys}
    return judged_run(box, case, limit=SECONDS)


def parametrisation(box, variant, amplitude, length):
    return judged_motion(box, tube(amplitude, length, PEARLING, 0.3), variant)


def neck(box, variant, radius, elements):
    case = tube(1 - radius, 2.0, PEARLING, 0.3, accuracy=1e-2)
    return judged_motion(box, case, variant, elements=elements)


def tolerance(box, variant, time_tolerance, elements):
    case = tube(0.25, 2.0, {"k20": 0.2, "H0": -2.0, "k42": 0.06}, 0.2, accuracy=1e-1)
    return judged_motion(box, case, variant, elements=elements, time_tolerance=time_tolerance)


def scenes(box, model, number, asked):
    """Random shapes, energies, rules and loads of a model (tests/studies/fuzz/scenes.py), each at several accuracies."""
    drawn = (scene(random.Random(f"atlas {number} {k}")) for k in itertools.count())
    case = next(c for c in drawn if c["model"]["kind"] == model)
    return judged_run(box, case | {"accuracy": {"energy": asked}}, limit=60)


def vesicle(box, family, reduced_volume, H0):
    """Truth: the same search with a thousandth of the accuracy; another branch is another energy."""
    case = {"tier": "axisym", "energy": {"k20": 1.0, "H0": H0}, "shape": {"kind": "sphere", "radius": 1.0}}
    case["equilibrium"] = {"held": "area-and-volume", "family": family, "area": 12.566370614359172, "reduced_volume": reduced_volume}
    first, branch = search(box, case, 1e-5)
    if first.stop == "time-limit":
        return Judgement("undecided", first.stop)
    finer, _ = search(box, case, 1e-8)
    if not first.finished:
        alarm = finer.finished and first.stop in (*PHYSICS, *NUMERICS)
        agreed = first.stop in PHYSICS and first.stop == finer.stop
        return Judgement("false alarm" if alarm else "right" if agreed else "told", first.stop)
    if first.warned:
        return Judgement("told", branch)
    if not finer.finished:
        return Judgement("undecided", branch)
    error = first.apart(finer, first.energy)
    silent = error > min(2 * first.stated, 1e-5) + finer.stated
    return Judgement("silent" if silent else "right", branch, error, first.stated)


def search(box, case, asked):
    run = Run(box, case | {"accuracy": {"energy": asked}, "time": {}}, command="equilibrium", quantity="energy", limit=30)
    return run, branch_of(box.folder / "case.hdf") if run.finished else None


def branch_of(result):
    """The branch of a vesicle, as scans name it: by its symmetry, its length and a dent at a pole."""
    with h5py.File(result) as file:
        frame = file["frames"][max(file["frames"])]
        r, z = frame["r"][:], frame["z"][:]
    along = np.concatenate(([0], np.cumsum(np.hypot(np.diff(r), np.diff(z)))))
    r, z = (np.interp(np.linspace(0, along[-1], 201), along, x) for x in (r, z))
    low, high, width = z.min(), z.max(), r.max()
    if max(np.abs(r - r[::-1]).max(), np.abs(z + z[::-1] - z[0] - z[-1]).max()) < 0.02 * width:
        return "prolate" if high - low > 2 * width else "oblate"
    dent = max(min(z[0], z[-1]) - low, high - max(z[0], z[-1]))
    return "stomatocyte" if dent > 0.02 * width else "pear"


AMPLITUDE, LENGTH = Axis("amplitude", 0.02, 0.96), Axis("length", 0.5, 16, log=True)
NECK, ELEMENTS = Axis("neck radius", 0.005, 0.8, log=True), Axis("elements", 6, 400, log=True, whole=True)
TOLERANCE, FEW = Axis("time tolerance", 1e-10, 1e-1, log=True), Axis("elements", 4, 200, log=True, whole=True)
VOLUME, H0 = Axis("reduced volume", 0.2, 0.99), Axis("H0", -6.0, 4.0)
SCENE, ASKED = Axis("scene", 0, 4, whole=True), Axis("requested accuracy", 1e-6, 1e-1, log=True)
MAPS = {
    "parametrisation": Map("Tubes by parametrisation", AMPLITUDE, LENGTH, parametrisation, PARAMETRISATIONS, across=5, levels=0),
    "neck": Map("Necks by elements", NECK, ELEMENTS, neck, PARAMETRISATIONS, across=5, levels=0),
    "tolerance": Map("Time tolerance by elements", TOLERANCE, FEW, tolerance, PARAMETRISATIONS, levels=0),
    "scenes": Map("Random scenes", SCENE, ASKED, scenes, MODELS, across=4, levels=0),
    "vesicles": Map("Vesicles at rest", VOLUME, H0, vesicle, ("prolate", "oblate", "stomatocyte"), across=6, levels=0),
}
