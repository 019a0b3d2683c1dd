"""Runs of both programs: functions of a folder that give CPU seconds, energy, eigenvalues, size, stated error."""

import json
import os
import resource
import subprocess
from math import pi

import evolver
import h5py

NAMES = AREA, PERP, NORMAL, PLAIN = [f"star_{name}sq_mean_curvature" for name in ("eff_area_", "perp_", "normal_", "")]
SURFACE, EXTRAPOLATED, PROFILE = "Evolver, surface", "Evolver, extrapolated", "Evolver, profile"
TIER1, TIER2, FREE = "Tubule, tier 1", "Tubule, tier 2", "Evolver, not groomed"
GIVEN, ASKED = "elements given", "accuracy asked for"


def timed(command, folder, text=""):
    """CPU seconds, user and system, and what it printed; at most ten minutes."""
    (folder / "in").write_text(text)
    with open(folder / "in") as source, open(folder / "out", "w+") as target:
        limit = lambda: resource.setrlimit(resource.RLIMIT_CPU, (600, 600))  # noqa: E731
        process = subprocess.Popen(command, stdin=source, stdout=target, stderr=subprocess.STDOUT, preexec_fn=limit)
        _, process.returncode, usage = os.wait4(process.pid, 0)
        target.seek(0)
        return usage.ru_utime + usage.ru_stime, target.read()


def of_evolver(make, *arguments, kind="facet", **options):
    def run(folder):
        text, commands = make(*arguments, **options)
        (folder / "shape.fe").write_text(text)
        seconds, output = timed([evolver.PROGRAM, folder / "shape.fe"], folder, commands + evolver.finish(kind))
        return seconds, *evolver.results(output), ""

    return run


def of_tubule(program, tier, text, key):
    def run(folder):
        case, result = folder / "case.toml", folder / "case.hdf"
        case.write_text(f'tier = "{tier}"\nenergy.k20 = 0.25\n{text}')
        result.unlink(missing_ok=True)
        command = [program, "run", "--quiet", case, "--set", key, "-o", result]
        seconds, output = timed(command, folder)
        with h5py.File(result) as file:
            about, last = dict(file["about"].attrs), {name: data[-1] for name, data in file["series"].items()}
        assert about["stop"] == "finished", output
        rates = [-last[f"rate_{k}"] for k in range(1, 8)] if "rate_7" in last else []
        stated = about["estimated_error"]
        return seconds, last["energy"], rates, int(about["elements"]), stated if stated < 1 else ""

    return run


def spectrum(program, text):
    """The seven lowest eigenvalues in tier axisym, those of m > 0 twice."""

    def run(folder):
        (folder / "case.toml").write_text(f'tier = "axisym"\nenergy.k20 = 0.25\n{text}')
        options = ["--numerical", "--modes", "2", "--rates", "4", "--json"]
        seconds, output = timed([program, "stability", folder / "case.toml", *options], folder)
        model = json.loads(output)["models"][0]
        rates = sorted(-r for mode in model["modes"] for r in mode["rates"] * (1 + (mode["m"] > 0)))
        return seconds, 3 * pi, [r for r in rates if r > 1e-6][:7], model["elements"], model["estimated_error"]

    return run


def vesicles(tubule, v):
    for method, sizes in ((AREA, (4, 6, 8, 11, 16, 20, 24, 32, 40)), (PERP, (8, 16, 24)), (NORMAL, (8, 16, 24))):
        yield from ((SURFACE, method, of_evolver(evolver.vesicle, v, method, n)) for n in sizes)
    for n in (6, 8, 11, 16, 20, 24, 32):  # 0.06 by the known errors of v = 0.9
        yield SURFACE, "graded", of_evolver(evolver.vesicle, v, AREA, n, grade=0.06)
    for n in (16, 32, 64, 128, 256, 512, 1024, 2048):
        yield PROFILE, "sq_mean_curv_cyl", of_evolver(evolver.vesicle_profile, v, n, kind="edge")
    a, c = evolver.spheroid(v)
    text = f'[shape]\nkind = "ellipsoid"\na = {a}\nb = {a}\nc = {c}\n'
    text += f"[equilibrium]\narea = {4 * pi}\nreduced_volume = {v}\n"
    for n in (80, 120, 320, 500, 720, 1280):
        yield TIER2, GIVEN, of_tubule(tubule, "surface3d", text, f"discretisation.elements={n}")
    for asked in (1e-4, 1e-5):
        yield TIER2, ASKED, of_tubule(tubule, "surface3d", text, f"accuracy.energy={asked}")
    for asked in (1e-4, 1e-9):
        yield TIER1, ASKED, of_tubule(tubule, "axisym", text, f"accuracy.energy={asked}")
    yield TIER1, "truth", of_tubule(tubule, "axisym", text, "accuracy.energy=1e-10")


def tori(tubule):
    """In Evolver the area is held: otherwise the energy keeps falling by growth."""
    for method, levels in ((AREA, 4), (PERP, 3)):
        yield from ((SURFACE, method, of_evolver(evolver.torus, method, 12, k)) for k in range(levels))
    for n in (12, 24, 48):
        yield SURFACE, "not refined", of_evolver(evolver.torus, AREA, n)
        yield FREE, AREA, of_evolver(evolver.torus, AREA, n, groomed=False)
    for n in (32, 64, 128, 256, 512, 1024):
        yield PROFILE, "sq_mean_curv_cyl", of_evolver(evolver.torus_profile, n, kind="edge")
    text = '[shape]\nkind = "torus"\nradius = 2.0\ntube_radius = 1.0\n[equilibrium]\nheld = "nothing"\n'
    for n in (300, 420, 600, 1200, 2400):
        yield TIER2, GIVEN, of_tubule(tubule, "surface3d", text, f"discretisation.elements={n}")


def tubes(tubule):
    for method in (AREA, PERP, PLAIN):
        yield from ((SURFACE, method, of_evolver(evolver.tube, method, n)) for n in (12, 16, 24, 32, 48, 72, 96))
    text = f'[model]\ntension = 0.25\n[shape]\nkind = "tube"\nradius = 1.0\nlength = {evolver.TUBE_LENGTH}\n'
    rest = text + '[equilibrium]\nheld = "nothing"\ndescend = false\nrates = 7\n'
    for n in (80, 200, 400, 800, 1600):
        yield TIER2, GIVEN, of_tubule(tubule, "surface3d", rest, f"discretisation.elements={n}")
    yield TIER1, "spectrum", spectrum(tubule, text + "[time]\nend = 1\n")
