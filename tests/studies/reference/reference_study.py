#!/usr/bin/python3
"""Reference data, docs/reference/*.csv: values by curves.py, which shares nothing with the program, and how far the
program is from them.

reference_study.py TUBULE [--update]. Exit status 1 if a file is not what is computed, or the program differs by more
than TOLERANCES; --update writes the files.
"""

import csv
import io
import itertools
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import mpmath
import numpy as np
from numpy.polynomial import Polynomial

sys.path.append(str(Path(__file__).resolve().parents[1] / "axisym"))
from cells_study import cells as cells_of_length  # noqa: E402
from curves import MODES, Profiles, at_rest, tube_stiffness  # noqa: E402
from shape_equations import capsule  # noqa: E402

PROGRAM, FOLDER = sys.argv[1], Path(__file__).resolve().parents[3] / "docs/reference"
# Relative differences of the program. Those of tori are errors of meshes.
TOLERANCES = {"tubes": 1e-12, "thresholds": 1e-9, "cells": 1e-8, "vesicles": 2e-8, "tori": 5e-4}
AREA = 4 * np.pi
V = [round(v / 100, 2) for v in range(95, 44, -5)]
FAMILIES = {  # (reduced volume, H0) and the first resolution
    "prolate": ([*((v, 0.0) for v in V[:10]), (0.8, -1.0), (0.8, 1.0)], 84),
    "oblate": ([*((v, 0.0) for v in V[:9]), (0.8, -1.0), (0.8, 1.0)], 84),
    "stomatocyte": ([(v, 0.0) for v in V[6:]], 228),
    "pear": ([(0.76, -2.45), (0.74, -2.35), (0.72, -2.3)], 400),
}
TUBES = [{"k20": k20, "H0": H0, "k40": k40, "k42": k42}
         for k20, H0, k40, k42 in ((1.0, 0.0, 0.0, 0.1), (0.5, -1.0, 0.0, 0.05), (0.2, -2.0, 0.02, 0.06))]  # fmt: skip
RE, GAMMA = 2.0, 0.3


def program(moduli, shape, rest, *command, tier="axisym", asked=1e-11):
    """JSON of the command; without one the last values of all series, for closed profiles also what at_rest() needs."""
    energy = "".join(f"{name} = {value}\n" for name, value in moduli.items())
    text = f'tier = "{tier}"\naccuracy.energy = {asked}\n[energy]\n{energy}[shape]\n{shape}\n{rest}\n'
    with tempfile.TemporaryDirectory() as folder:
        case, result = Path(folder, "case.toml"), Path(folder, "case.hdf")
        case.write_text(text)
        if command:
            return json.loads(subprocess.check_output([PROGRAM, command[0], case, *command[1:]]))
        subprocess.run([PROGRAM, "run", "--quiet", case, "-o", result], check=True)
        with h5py.File(result) as file:
            found = {name: values[-1] for name, values in file["series"].items()}
            frame = next(iter(file["frames"].values()))
            start = [frame[name][()] for name in ("r", "z") if name in frame]
        return found, (*start, found.get("tension"), found.get("pressure"))


def vesicle(family, v, H0):
    rest = f'[equilibrium]\narea = {AREA!r}\nreduced_volume = {v!r}\nfamily = "{family}"\nmodes = {MODES - 1}'
    return program({"k20": 1.0, "H0": H0}, 'kind = "sphere"\nradius = 1.0', rest)


def columns(known, found):
    """Values, their changes and the program's values; the m that grows most or decays least, and those that grow."""
    rates = [known[f"growth_{m}"][0] for m in range(MODES)]
    unstable = " ".join(str(m) for m, rate in enumerate(rates) if rate > 0)
    assert (rates[0] > 0) == (found["negative_directions"] > 0)
    critical = {"critical_m": int(np.argmax(rates)), "unstable_m": unstable or "none"}
    return {name: (*value, found[name]) for name, value in known.items()} | critical


def vesicles():
    for family, (points, n) in FAMILIES.items():
        for v, H0 in points:
            found, start = vesicle(family, v, H0)
            known = at_rest(n, {"k20": 1.0, "H0": H0}, AREA, AREA / 3 * v, start)
            assert (np.ptp(start[0] - start[0][::-1]) > 0.1) == (family in ("stomatocyte", "pear")), "wrong family"
            assert (known["height"][0] > 2 * known["r_max"][0]) == (family in ("prolate", "pear")), "wrong family"
            head = {"family": family, "v": v, "H0": H0, "area": AREA, "volume": AREA / 3 * v}
            yield head | {"energy_over_8_pi_kappa": known["energy"][0] / (16 * np.pi)} | columns(known, found)


def cells():
    """Energy, tension and pressure by shape_equations.py; their changes are the differences from curves.py."""
    for length in (2.0, 3.0, 4.0):
        area, volume = capsule(0.5, length)
        for (k40, k42), other in sorted(cells_of_length(length, 80).items()):
            moduli = {"k20": 0.125, "H0": -2.0, "k40": k40, "k42": k42}
            shape = f'kind = "capsule"\nradius = 0.5\nlength = {length}'
            found, start = program(moduli, shape, f"[equilibrium]\nmodes = {MODES - 1}")
            known = at_rest(84, moduli, area, volume, start)
            known |= {name: (value, abs(known[name][0] / value - 1)) for name, value in other.items()}
            yield {"length": length, "k40": k40, "k42": k42, "area": area, "volume": volume} | columns(known, found)


def tori():
    """Tori of area 4 pi: round ones in closed form, theory.md (7.1), and those at rest that have their volume."""
    for ratio in (2**0.5, 2.0, 3.0):
        a = 1 / np.sqrt(np.pi * ratio)  # radius of the tube
        R, volume, t = ratio * a, 2 * np.pi**2 * ratio * a**3, np.linspace(0, 2 * np.pi, 400)
        head = {"ratio": ratio, "v": 3 * volume / AREA, "area": AREA, "volume": volume}
        start, shape = (R + a * np.cos(t), a * np.sin(t), 0, 0), f'kind = "torus"\nradius = {R}\ntube_radius = {a}'
        rest = "[discretisation]\nelements = 1200\n[time]\nend = 1e-12"
        found, _ = program({"k20": 1.0, "k42": 1.0}, shape, rest, tier="surface3d", asked=1e-4)
        root, of_round = np.sqrt(R**2 - a**2), {"torus": "round", **head}
        closed = {"energy_20": 4 * np.pi**2 * R**2 / (a * root), "energy_42": 4 * np.pi**2 * R / a**3 * (R / root - 1)}
        for name, value in closed.items():
            profiles = Profiles(60, {"k" + name[-2:]: 1.0}, AREA, volume, torus=True)
            change = abs(profiles.variations(profiles.start(*start), 0)[0][2] / value - 1)
            of_round[name] = value, change, found[name]
        yield of_round
        if ratio > 1.5:
            known = at_rest(42, {"k20": 1.0}, AREA, volume, start, torus=True)
            rest = f"[equilibrium]\narea = {AREA!r}\nvolume = {volume!r}"
            found, _ = program({"k20": 1.0}, shape, rest, tier="surface3d", asked=1e-4)
            known = {name.replace("energy", "energy_20"): value for name, value in known.items()}
            yield {"torus": "at rest", **head} | {name: (*value, found[name]) for name, value in known.items()}


def stability(moduli, tension):
    shape, rest = 'kind = "tube"\nradius = 1.0\nlength = 20.0', '[model]\nkind = "gradient-flow"\n[time]\nend = 1.0'
    options = ["--model=all", f"--Re={RE}", f"--gamma={GAMMA}", f"--tension={tension}", "--q=0.5,1.5", "--modes=2"]
    return program(moduli, shape, rest, "stability", *options, "--json")


def growth(model, G, q, m):
    """theory.md (5.6) and (5.9) to (5.12), R = 1: the root with the largest real part."""
    G, Q, mu = mpmath.mpf(G), mpmath.mpf(q) ** 2 + m**2, 1 / mpmath.mpf(RE)
    drag, swirl = [Q + 1, GAMMA * (Q + 1) + 4 * mu * q**2], 4 * mu**2 * q**2 * m**2
    if model == "gradient-flow":
        return -G
    if model == "overdamped":
        return -Q * G / (GAMMA * (Q + 1))
    if model == "stokes":
        return -Q * G / (drag[1] - swirl / (GAMMA + mu * Q))
    slip = GAMMA + mu * Q
    cubic = [drag[0], drag[1] + drag[0] * slip, Q * G + drag[1] * slip - swirl, Q * G * slip]
    return max(mpmath.polyroots(cubic if m else [*drag, Q * G], extraprec=200), key=lambda root: root.real)


def tubes():
    for moduli, tension in itertools.product(TUBES, (-4.0, 4.0)):
        for model in stability(moduli, tension)["models"]:
            for wave in model["waves"]:
                m, q = wave["m"], wave["q"]
                root = growth(model["model"], float(tube_stiffness(1.0, tension, moduli, m) @ [1, q**2, q**4]), q, m)
                head = {**moduli, "tension": tension, "model": model["model"], "m": m, "q": q}
                rate, frequency = float(root.real), float(abs(root.imag))
                yield head | {"rate": (rate, 0, wave["rate"]), "frequency": (frequency, 0, wave["frequency"])}


def tube_threshold(moduli, m, above):
    """The extreme of -G/Z at tension 0 over x = q^2, where Z = x + m^2 - 1 < 0 (waves grow above it) or Z > 0; q."""
    N, Z = Polynomial(tube_stiffness(1.0, 0.0, moduli, m)), Polynomial([m**2 - 1, 1])
    if m == 1:
        N, Z = N // Z, Polynomial([1])
    roots = (N.deriv() * Z - N * Z.deriv()).roots()
    points = [x for x in (0.0, *roots[np.isreal(roots)].real) if x >= 0 and (Z(x) < 0) == above]
    tension, x = (min if above else max)((-N(x) / Z(x), x) for x in points)
    return tension, np.sqrt(x)


def vesicle_threshold(families, near, m=None):
    """Where two families have the same energy, or one the rate 0 for this m, H0 = 0; the change, the program's."""
    starts = [vesicle(family, near, 0.0)[1] for family in families]

    def difference(v):
        values = []
        for start in starts:
            profiles = Profiles(228 if "stomatocyte" in families else 117, {"k20": 1.0}, AREA, AREA / 3 * v)
            y = profiles.newton(profiles.start(*start))
            values.append(profiles.rate(y, m) if m else profiles.variations(y, 0)[0][2])
        return values[0] - sum(values[1:])

    a, b = near, near + 1e-4
    at_a = difference(a)
    for _ in range(4):  # secants
        at_b = difference(b)
        slope = (at_b - at_a) / (b - a)
        a, at_a, b = b, at_b, b - at_b / slope
    found = [vesicle(family, b, 0.0)[0][f"growth_{m}" if m else "energy"] for family in families]
    return b, abs(b - a), b - (found[0] - sum(found[1:])) / slope


def thresholds():
    pairs = (("prolate", "oblate"), 0.651, None), (("oblate", "stomatocyte"), 0.591, None), (("oblate",), 0.7497, 2)
    for families, near, m in pairs:
        words = "oblate grows above" if m else " = ".join(families)
        yield {"surface": "vesicle", **TUBES[0], "k42": 0.0, "threshold": words, "m": m or "none", "q": "none",
               "of": "v", "value": vesicle_threshold(families, near, m)}  # fmt: skip
    for moduli in TUBES:
        for one in stability(moduli, 0.0)["thresholds"]:
            tension, q = tube_threshold(moduli, one["m"], one["grows"] == "above")
            value = tension, abs(q - one["q"]), one["tension"]
            yield {"surface": "tube", **moduli, "threshold": f"grows {one['grows']}", "m": one["m"], "q": q,
                   "of": "tension", "value": value}  # fmt: skip


def table(rows):
    """As CSV: of (value, change, the program's) the value and the program's difference."""
    lines = [{} for _ in rows]
    for line, (name, value) in ((line, item) for line, row in zip(lines, rows) for item in row.items()):
        if isinstance(value, tuple):
            line |= {name: f"{value[0] + 0.0:.10g}", f"{name}_difference": f"{value[2] - value[0]:.1e}"}
        else:
            line[name] = value if isinstance(value, (str, int)) else f"{value:.10g}"
    text = io.StringIO()
    writer = csv.DictWriter(text, dict.fromkeys(name for line in lines for name in line), lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return text.getvalue()


def close(name, old, new):
    """Whether they are the same, or the same number to 10 digits (rates: 8)."""
    if old == new or name.endswith("_difference"):
        return True
    try:
        return abs(float(old) - float(new)) <= (1e-8 if name.startswith("growth") else 1e-9) * abs(float(new)) + 1e-12
    except ValueError:
        return False


def main():
    bad, begun = 0, time.time()
    for compute in (tubes, thresholds, cells, vesicles, tori):
        name, rows = compute.__name__, list(compute())
        path, text = FOLDER / f"{name}.csv", table(rows)
        if "--update" in sys.argv:
            FOLDER.mkdir(exist_ok=True)
            path.write_text(text)
        old, new = (list(csv.reader(io.StringIO(text))) for text in (path.read_text(), text))
        differ = sum(not close(*cell) for a, b in itertools.zip_longest(old, new, fillvalue=[]) for cell in
                     itertools.zip_longest(new[0], a, b))  # fmt: skip
        print(f"{name}: {len(rows)} rows, {differ} entries not as in the file, {time.time() - begun:.0f} s")
        for rates in (False, True):
            entries = [item for row in rows for item in row.items() if isinstance(item[1], tuple)]
            values = [value for key, value in entries if key.startswith("growth") == rates]
            off = max((abs(other - value) / max(abs(value), 1e-3) for value, _, other in values), default=0.0)
            own = max((change for _, change, _ in values), default=0.0)
            kind = "growth" if rates else "others"
            print(f"  {kind}: change with the resolution {own:.0e}, program's difference {off:.0e}", flush=True)
            differ += off > TOLERANCES[name]
        bad += differ
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
