"""Results in the units of their case, which the program knows. Standard library and numpy only."""

import json
import os
import subprocess

from .results import BadInput, read_result

OF_FRAMES = {
    "time": "time", "period": "length", "z": "length", "r": "length", "points": "length", "H": "1/length", "K": "1/length^2",
    "u": "length/time", "u_n": "length/time", "u_t": "length/time", "u_theta": "length/time", "p": "energy/length^2",
    "energy_density": "energy/length^2", "H0": "1/length",
}  # fmt: skip
OF_BRANCHES = {
    "energy.k20": "energy", "energy.H0": "1/length", "energy.alpha": "energy/length^2", "energy.M0": "length",
    "energy.potential.0.strength": "energy/length^2", "equilibrium.area": "length^2", "equilibrium.volume": "length^3",
    "model.tension": "energy/length^2", "model.pressure": "energy/length^3", "model.force": "energy/length",
    "model.extension": "length", "shape.height": "length",
}  # fmt: skip
OF_RUNS = {"stop_time": "time", "E_ref": "energy"}


def asked(path, option):
    """The units of a result by their dimensions, {"time": {"scale": 91, "unit": "us"}, ...}, as `tubule units --json` has them.
    `option` as --units."""
    program = os.environ.get("TUBULE_PROGRAM")
    if not program:
        raise BadInput("--units: TUBULE_PROGRAM must name the program tubule")
    sets = [word for part in option.split(",") if part for word in ("--set", f"units.{part}")]
    done = subprocess.run([program, "units", path, "--json", *sets], capture_output=True, text=True)
    if done.returncode:
        raise BadInput(done.stderr.strip())
    return json.loads(done.stdout)["units"]


def convert(result, units):
    """Changes all numbers of a result from those of its case to these units. Stationary shapes keep their numbers."""
    result.units = {key: value for key, value in units.items() if key != "time" or not result.is_equilibrium}
    vary = result.case.get("equilibrium", {}).get("branch", {}).get("vary", "")
    result.dimensions["parameter"] = OF_BRANCHES.get(vary, "")
    result.series = {name: values * result.scale(result.dimensions.get(name, "")) for name, values in result.series.items()}
    result.about |= {name: result.about[name] * result.scale(of) for name, of in OF_RUNS.items() if name in result.about}
    for frame in [*result.frames, *result.surfaces]:
        for name, of in {**OF_FRAMES, "parameter": result.dimensions["parameter"]}.items():
            if getattr(frame, name, None) is not None:
                setattr(frame, name, getattr(frame, name) * result.scale(of))
    return result


def read(path, option=""):
    """The result in a file, in the units of its case if it has any; `option` as --units."""
    result = read_result(path)
    if option == "none" or not (option or "units" in result.case):
        return result
    return convert(result, asked(path, option))


def in_common(results):
    """The results, whose units must be the same. Raises BadInput."""
    for other in results[1:]:
        if other.units != results[0].units:
            raise BadInput(f"{results[0].path} and {other.path} have different units; --units none draws them without, as their files have them")
    return results
