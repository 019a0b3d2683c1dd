"""Results in the units of their case, which the program knows."""

import json
import os
import subprocess

from .results import BadInput, read_case, read_result

OF_FRAMES = {
    "time": "time", "period": "length", "z": "length", "r": "length", "points": "length", "H": "1/length", "K": "1/length^2",
    "u": "length/time", "u_n": "length/time", "u_t": "length/time", "u_theta": "length/time", "p": "energy/length^2",
    "energy_density": "energy/length^2", "H0": "1/length",
}  # fmt: skip
# Keys of a case, as far as branches and scans vary them.
OF_KEYS = {
    "energy.k20": "energy", "energy.H0": "1/length", "energy.alpha": "energy/length^2", "energy.M0": "length",
    "energy.potential.0.strength": "energy/length^2", "equilibrium.area": "length^2", "equilibrium.volume": "length^3",
    "model.tension": "energy/length^2", "model.pressure": "energy/length^3", "model.force": "energy/length",
    "model.extension": "length", "shape.height": "length", "shape.length": "length", "shape.radius": "length",
    "shape.tube_radius": "length", "shape.a": "length", "shape.b": "length", "shape.c": "length", "time.end": "time",
}  # fmt: skip
OF_RUNS = {"stop_time": "time", "E_ref": "energy"}


def asked(path, option="", sets=()):
    """The units of a result or scan by their dimensions, {"time": {"scale": 91, "unit": "us"}, ...}, as `tubule units
    --json` has them. `option` as --units; `sets` override its case."""
    program = os.environ.get("TUBULE_PROGRAM")
    if not program:
        raise BadInput("--units: TUBULE_PROGRAM must name the program tubule")
    every = [*sets, *(f"units.{part}" for part in option.split(",") if part)]
    command = [program, "units", path, "--json", *(f"--set={one}" for one in every)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise BadInput(done.stderr.strip())
    return json.loads(done.stdout)["units"]


def convert(result, units):
    """Changes all numbers of a result from those of its case to these units. Stationary shapes keep their numbers."""
    result.units = {key: value for key, value in units.items() if key != "time" or not result.is_equilibrium}
    result.dimensions["parameter"] = OF_KEYS.get(result.vary, "")
    result.series = {name: values * result.scale(result.dimensions.get(name, "")) for name, values in result.series.items()}
    result.about |= {name: result.about[name] * result.scale(of) for name, of in OF_RUNS.items() if name in result.about}
    for frame in [*result.frames, *result.surfaces]:
        for name, of in {**OF_FRAMES, "parameter": result.dimensions["parameter"]}.items():
            if getattr(frame, name, None) is not None:
                setattr(frame, name, getattr(frame, name) * result.scale(of))
    for surface in result.surfaces:
        for name in OF_FRAMES.keys() & surface.nodes:
            surface.nodes[name] = surface.nodes[name] * result.scale(OF_FRAMES[name])
    return result


def are_wanted(option, of_case):
    """Whether numbers are shown in units; `of_case`: whether the case has any."""
    return option != "none" and bool(option or of_case)


def read(path, option=""):
    """The result in a file, in the units of its case if it has any; `option` as --units."""
    result = read_result(path)
    return convert(result, asked(path, option)) if are_wanted(option, "units" in result.case) else result


def of_files(paths):
    """The units of runs, where all have the same ones."""
    cases = [read_case(path) for path in paths]
    if any("units" not in case or "equilibrium" in case for case in cases):
        return {}
    found = [asked(path) for path in paths]
    return found[0] if found.count(found[0]) == len(found) else {}


def in_common(results):
    """Raises BadInput unless the results have the same units."""
    for other in results[1:]:
        if other.units != results[0].units:
            raise BadInput(f"{results[0].path} and {other.path} have different units; --units none draws them without, as their files have them")
