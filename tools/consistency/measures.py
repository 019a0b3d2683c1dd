"""Comparisons of both tiers: the runs of each and the resulting rows. A measure is a function (Tools, Cost) -> list of
Row. Bounds apply to relative differences on the finest mesh."""

import math
from dataclasses import dataclass

from cases import changed
from rows import Row

MODELS = ("gradient-flow", "overdamped", "stokes", "fluid")
ORDER = 4  # of triangles
STEPS = 6  # for the first moments; a fit of a wave needs as many frames
# Errors in time should decrease like those in space, with the fourth power of the mesh width. They follow the tolerance
# to the power 2/3, so the tolerance decreases with the third power of the number of triangles. Fixed steps are short
# enough for all meshes.
FALL = {"time_tolerance": 3, "step": 0}
LOOSER = 10  # accuracy of the second run of tier 1; the difference is the error of the first, except for energies
AMPLITUDE = 1e-3  # of small waves: nonlinear terms are of relative size 1e-6
SHAPES = ("shape, Hausdorff", "shape, L2")
BENDING = ("energy", "energy_20", "energy_40", "energy_42", "kinetic_energy", "dissipated")  # relative to E_ref


@dataclass
class Tools:
    """The program and the numbers of triangles for a scene."""

    program: object  # Program
    elements: tuple


def axisym(tools, cost, start, accuracy=None):
    made = changed(start, accuracy={"energy": accuracy}) if accuracy else start
    run = tools.program.run(made, "tier 1" + (f", asked for {accuracy:g}" if accuracy else ""))
    cost.axisym += run.cpu_s
    return run


def surface(tools, cost, start, elements, **in_time):
    """`in_time`: time_tolerance or step for the first of the meshes."""
    less = tools.elements[0] / elements
    discretisation = {key: value * less ** FALL[key] for key, value in in_time.items()}
    discretisation |= {"elements": elements, "order": ORDER}
    # The requested accuracy only decides which increase of the energy rejects a step; smaller increases are noise.
    accuracy = {"energy": 1e-3, **({"r_min": 1e-2} if "time" in start else {})}
    run = tools.program.run(
        changed(start, tier="surface3d", accuracy=accuracy, discretisation=discretisation), f"3D, {elements} triangles"
    )
    cost.surface[run.elements] = cost.surface.get(run.elements, 0.0) + run.cpu_s
    return run


def at_rest(start, exact, bounds, accuracy=1e-9, mesh="uniform", must_fall=True):
    """Geometry and energies of a start. `exact`: values in closed form; all others are from the first row and frame of
    tier 1. In 3D the surface is at rest, so curvatures are those of the patch recovery."""

    def measure(tools, cost):
        still = changed(start, time={"end": 1e-6, "output": []})
        fine, loose = (axisym(tools, cost, still, asked) for asked in (accuracy, accuracy * LOOSER))
        values, other = beginning(fine), beginning(loose)
        rows = []
        for name, bound in bounds.items():
            value = exact.get(name, values.get(name))
            scale = fine.E_ref if name in BENDING else 4 * math.pi if name == "integral_K" else abs(value)
            error = 0.0 if name in exact else abs(value - other[name]) / scale
            rows.append(Row(name, [value], scale, bound, error, must_fall=must_fall and name[:4] not in ("min ", "max ")))
        resting = changed(start, time=None, model=None, velocity=None, discretisation={"mesh": mesh})
        for elements in tools.elements:
            run = surface(tools, cost, resting, elements)
            found = beginning(run)
            for row in rows:
                row.found[run.elements] = [found[row.quantity]]
        return rows

    return measure


def beginning(run):
    """Values of the first row and frame."""
    out = {name: float(values[0]) for name, values in run.series.items()}
    for name in ("H", "K"):
        out[f"min {name}"], out[f"max {name}"] = run.extremes(name)
    return out


def beginnings(start, waves, at_once, with_inertia, bounds):
    """First moments of each model, before anything has moved noticeably: dissipation, the force that keeps the volume, the
    rates of waves and, for a fluid from rest, the acceleration. `at_once`, `with_inertia`: the time of the comparison. It
    is longer for a fluid: volumes are kept to 1e-12, and this over the square of a step is the error of lambda."""

    def measure(tools, cost):
        rows = []
        for kind in MODELS:
            # From rest, the first step is of first order and leaves errors in the positions as large as the displacements.
            names = ["acceleration squared"] if kind == "fluid" else ["dissipation", *(f"wave {wave}" for wave in waves)]
            if kind != "gradient-flow":
                names.append("lambda")
            viscous = {"Re": 2.0, "gamma": 0.3} if kind in ("stokes", "fluid") else {}
            end = with_inertia if kind == "fluid" else at_once
            # From rest E_kinetic = t^2/2 INT (du/dt)^2.
            per = end**2 / 2 if kind == "fluid" else end
            time = {"end": end, "output": [end * i / STEPS for i in range(1, STEPS)]}
            begun = changed(changed(start, model=None), model={"kind": kind, **viscous}, time=time)
            fine, loose = (drives(tools, axisym(tools, cost, begun, asked), names, end, per) for asked in (1e-8, 1e-7))
            of_model = {}
            for name in names:
                error = abs(loose[name] / fine[name] - 1)
                of_model[name] = Row(f"{kind}, {name}", [fine[name]], abs(fine[name]), bounds[name], error, [end])
            for elements in tools.elements:
                run = surface(tools, cost, begun, elements, step=end / STEPS)
                found = drives(tools, run, names, end, per)
                for name, row in of_model.items():
                    row.found[run.elements] = [found[name]]
            rows += of_model.values()
        return rows

    return measure


def drives(tools, run, names, end, per):
    out = {}
    for name in names:
        if name.startswith("wave "):
            amplitude = tools.program.amplitudes(run, (int(name.removeprefix("wave ")),))
            out[name] = (amplitude[-1] - amplitude[0]) / per
        elif name == "acceleration squared":
            out[name] = run.at("kinetic_energy", end) / per
        else:
            out[name] = run.at(name, end)
    return out


def rates(start, waves, bounds, step, finest=None):
    """Growth or decay of small waves (n, m), all in one run in 3D, with the spectrum and a run of tier 1; the error of
    both is their distance from the closed form."""

    def measure(tools, cost):
        end = start["time"]["end"]
        begun = changed(start, time={"output": [round(end * i / 10, 12) for i in range(1, 10)]})
        linear, spectrum = closed_form(tools, begun), spectra(tools, begun)
        rows = []
        for n, m in waves:
            exact = linear[n, m]
            nearest = min(spectrum[m], key=lambda rate: abs(rate - exact))
            rows.append(Row(f"({n}, {m})", [nearest], abs(exact), bounds[n, m], abs(nearest / exact - 1)))
        for elements in (*tools.elements, *([finest] if finest else [])):
            run = surface(tools, cost, waved(begun, waves), elements, step=step)
            for (n, m), row in zip(waves, rows):
                row.found[run.elements] = [tools.program.fitted(run, (n, m))]
        if (1, 0) in waves:
            fitted, exact = tools.program.fitted(axisym(tools, cost, waved(begun, [(1, 0)]), 1e-10), (1, 0)), linear[1, 0]
            rows.append(Row("(1, 0), run of tier 1", [fitted], abs(exact), bounds["tier 1"], abs(fitted / exact - 1)))
        return rows

    return measure


def waved(start, waves):
    return changed(start, shape={"mode": [{"amplitude": AMPLITUDE, "n": n, "m": m} for n, m in waves]})


def closed_form(tools, start):
    (model,) = tools.program.stability(waved(start, []), waves=1, modes=2)["models"]
    return {(wave["n"], wave["m"]): wave["rate"] for wave in model["waves"]}


def spectra(tools, start):
    """Rates of tier 1 by m. With fixed area and volume the tension of a tube is undetermined; this uses that with free volume."""
    volume = "free" if start["model"]["kind"] == "gradient-flow" else "fixed"
    straight = waved(changed(start, model={"volume": volume}, accuracy={"energy": 1e-9}), [])
    tension = tools.program.stability(waved(start, []), waves=1)["models"][0]["tension"]
    (model,) = tools.program.stability(straight, numerical=True, modes=2, rates=8, tension=tension)["models"]
    return {entry["m"]: entry["rates"] for entry in model["modes"]}


def motion(start, accuracy, tolerance, bounds, must_fall=True):
    """Series at the output times, and distances of the shapes there."""

    def measure(tools, cost):
        fine, loose = (axisym(tools, cost, start, asked) for asked in (accuracy, accuracy * LOOSER))
        later = [*start["time"].get("output", []), start["time"]["end"]]
        rows = []
        for name, bound in bounds.items():
            times = [0.0, *later] if name in BENDING and name != "dissipated" else later
            values, other = along(tools, fine, name, times), along(tools, loose, name, times)
            scale = fine.E_ref if name in BENDING else 1.0 if name in SHAPES else max(map(abs, values))
            error = max(abs(a - b) for a, b in zip(values, other)) / scale
            if name in SHAPES:
                error, values = max(distances(tools, fine, loose, name, times)), [0.0] * len(times)
            falls = must_fall and name not in ("r_min", "r_max")  # extremes over nodes, which miss the true extreme
            rows.append(Row(name, values, scale, bound, fine.stated_error if name == "energy" else error, times, {}, falls))
        for elements in tools.elements:
            run = surface(tools, cost, start, elements, time_tolerance=tolerance)
            for row in rows:
                if row.quantity in SHAPES:
                    row.found[run.elements] = distances(tools, fine, run, row.quantity, row.times)
                else:
                    row.found[run.elements] = along(tools, run, row.quantity, row.times)
        return rows

    return measure


def along(tools, run, name, times):
    if name in SHAPES:
        return [0.0] * len(times)
    return [run.dissipated(time) if name == "dissipated" else run.at(name, time) for time in times]


def distances(tools, a, b, name, times):
    """Distances relative to the size of the shape."""
    found = {time: (hausdorff / size, l2 / size) for time, hausdorff, l2, size in tools.program.frames(a, b)}
    return [found[min(found, key=lambda t: abs(t - time))][SHAPES.index(name)] for time in times]


def at_equilibrium(resting, moving, bounds, tolerance):
    """A stationary shape of tier 1 by Newton's method, and the final shape of a run in 3D. The error is the distance of a
    run of tier 1 from the stationary shape at that time."""

    def measure(tools, cost):
        rest = tools.program.run(resting, "tier 1, at rest")
        cost.axisym += rest.cpu_s
        end = moving["time"]["end"]
        moved = axisym(tools, cost, moving)
        rows = []
        for name, bound in bounds.items():
            values, scale = [rest.series[name][-1]], rest.E_ref
            error = abs(moved.at(name, end) - values[0]) / scale
            rows.append(Row(name, values, scale, bound, error, [end], {}, False))
        for elements in tools.elements:
            run = surface(tools, cost, moving, elements, time_tolerance=tolerance)
            for row in rows:
                row.found[run.elements] = [run.at(row.quantity, end)]
        return rows

    return measure
