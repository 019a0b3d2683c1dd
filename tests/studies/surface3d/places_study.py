#!/usr/bin/python3
"""Random closed surfaces at walls, particles and in fields, drawn apart by beads, and tubes in periodic fields, in tier surface3d, judged by tier axisym.

Scenes are those of tests/studies/fuzz/scenes.py (--places, --beads, and its tubes) without tori. Each is run in tier surface3d asked for 2e-3 of E_ref and
in tier axisym asked for 1e-5. Where both finish, free energies at the end differ by no more than twice what tier surface3d states, plus what tier
axisym does, or the surface has left the axis: then its energy is lower.

    places_study.py TUBULE [COUNT [FIRST]]    scenes FIRST to FIRST + COUNT - 1 of each kind, by default 12 from 0
"""

import copy
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py

sys.path.insert(0, str(Path(__file__).parents[1] / "fuzz"))
import scenes
import toml

LIMIT = 120  # seconds of a run
OFF_AXIS = 1e-4  # of E_ref: lower by more than the error, the surface is no longer axisymmetric


def run(program, folder, case, tier, asked):
    """(stop, end of F, its error, E_ref)"""
    case = copy.deepcopy(case) | {"tier": tier, "accuracy": {"energy": asked}, "time": case["time"] | {"limit": LIMIT}}
    for W in case["energy"].get("potential", []):
        if tier == "surface3d" and W["kind"] == "formula":
            W["formula"] = W["formula"].replace("r^2", "(x^2 + y^2)")
    case.pop("discretisation", None)
    case["time"].pop("integrator", None)
    path, result = folder / "case.toml", folder / f"{tier}.hdf"
    path.write_text(toml.dump(case))
    done = subprocess.run([program, "run", path, "-o", result, "--overwrite", "--quiet"], capture_output=True, text=True, timeout=3 * LIMIT)
    if not result.exists():
        return "refused: " + (done.stdout + done.stderr).strip()[:120], None, None, None
    with h5py.File(result) as file:
        about, series = file["about"].attrs, file["series"]
        if "estimated_error" not in about:  # it did not begin
            return str(about["stop"]), None, None, None
        error = max(float(about["estimated_error"]) * float(about["E_ref"]), float(series["energy_error"][-1]))
        stop = about["stop"]
        return stop if isinstance(stop, str) else stop.decode(), float(series["free_energy"][-1]), error, float(about["E_ref"])


def field(n):
    """A tube in a field of its period, if scene n is one."""
    case, draw = scenes.scene_number(n, 0.5, None), random.Random(n)
    if case["shape"]["kind"] != "tube":
        return None
    radius, model = case["shape"]["radius"], case["model"]
    for key in ("period", "force"):
        model.pop(key, None)
    if model["kind"] == "stokes":
        model["gamma"] = 0.5
    a, b, phase = (scenes.number(draw.uniform(*ends)) for ends in ((-0.3, 1), (-1, 1), (0, 6)))
    wave = f"2*pi*{draw.randint(1, 2)}*z/{case['shape']['length']} + {phase}"
    modulus = (case["energy"].get("k20") or 0.3) / radius**2
    case["energy"]["potential"] = [{"kind": "formula", "formula": f"{modulus}*({a}*r^2/{radius**2} + {b}*cos({wave}))"}]
    return case


def main():
    numbers = [int(text) for text in sys.argv[2:]]
    program, (count, first) = Path(sys.argv[1]).resolve(), numbers + [12, 0][len(numbers) :]
    kinds = {"place": lambda n: scenes.scene_number(n, 0.5, scenes.place), "pull": lambda n: scenes.scene_number(n, 0.5, scenes.pull), "field": field}
    silent = finished = 0
    for n in range(first, first + count):
        for kind, scene in kinds.items():
            case = scene(n)
            if not case or case["shape"]["kind"] == "torus":
                continue
            with tempfile.TemporaryDirectory() as top:
                a, b = (run(program, Path(top), case, *how) for how in (("axisym", 1e-5), ("surface3d", 2e-3)))
            line = f"{kind} {n:3}: axisym {a[0]}, surface3d {b[0]}"
            if a[0] == b[0] == "finished":
                finished += 1
                off = b[1] - a[1]
                bad = off > 2 * b[2] + a[2] or (off < -2 * b[2] - a[2] and off > -OFF_AXIS * b[3])
                silent += bad
                line += f"; differ by {off:.2e}, stated {b[2]:.2e} and {a[2]:.2e}{'  SILENT' if bad else ''}"
            print(line, flush=True)
    print(f"finished in both tiers: {finished}, silent: {silent}")
    return 1 if silent or not finished else 0


if __name__ == "__main__":
    sys.exit(main())
