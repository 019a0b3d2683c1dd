#!/usr/bin/python3
"""Random closed surfaces at walls and particles, and drawn apart by beads, in tier surface3d, judged by tier axisym.

Scenes are those of tests/studies/fuzz/scenes.py (--places, --beads) without formulas and tori. Each is run in tier surface3d asked for 2e-3 of E_ref and
in tier axisym asked for 1e-5. Where both finish, free energies at the end differ by no more than twice what tier surface3d states, plus what tier
axisym does, or the surface has left the axis: then its energy is lower.

    places_study.py TUBULE [COUNT]      scenes 0 to COUNT - 1 of both kinds, by default 12
"""

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
    case = case | {"tier": tier, "accuracy": {"energy": asked}, "time": case["time"] | {"limit": LIMIT}}
    case.pop("discretisation", None)
    case["time"].pop("integrator", None)
    path, result = folder / "case.toml", folder / f"{tier}.hdf"
    path.write_text(toml.dump(case))
    done = subprocess.run([program, "run", path, "-o", result, "--overwrite", "--quiet"], capture_output=True, text=True, timeout=3 * LIMIT)
    if not result.exists():
        return "refused: " + (done.stdout + done.stderr).strip()[:120], None, None, None
    with h5py.File(result) as file:
        about, series = file["about"].attrs, file["series"]
        error = max(float(about["estimated_error"]) * float(about["E_ref"]), float(series["energy_error"][-1]))
        stop = about["stop"]
        return stop if isinstance(stop, str) else stop.decode(), float(series["free_energy"][-1]), error, float(about["E_ref"])


def main():
    program, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 12
    silent = finished = 0
    for kind in (scenes.place, scenes.pull):
        for n in range(count):
            case = scenes.scene_number(n, 0.5, kind)
            formula = any(W["kind"] == "formula" for W in case["energy"].get("potential", []))
            if formula or case["shape"]["kind"] == "torus":
                continue
            with tempfile.TemporaryDirectory() as top:
                a, b = (run(program, Path(top), case, *how) for how in (("axisym", 1e-5), ("surface3d", 2e-3)))
            line = f"{kind.__name__} {n:3}: axisym {a[0]}, surface3d {b[0]}"
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
