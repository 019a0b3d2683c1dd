"""The model that the program chooses (`model.kind = "auto"`) and the tier that it chooses, for shapes that move and equilibria,
by viscosities and friction of any size: a case ends soon after its time limit, `check` soon, too, and rows are possible."""

import re

import rows
import toml
from sandbox import Finding

STUDY = 3
LIMIT = 1  # seconds that a run is given, in the case
SLACK = 5  # of a processor, beyond it: a step or a factorisation under way, and reading


def number(rng, middle, far):
    """Around 1, or of any size."""
    return float(f"{10 ** (rng.uniform(-middle, middle) if rng.random() < 0.7 else rng.uniform(-far, far)):.4g}")


def modes(rng, degree, tier):
    amplitude = rng.choice((1e-300, 1e-16, 1e-8, 1e-3, 0.05, 0.2))
    wave = {"amplitude": amplitude * rng.choice((1, -1)), degree: rng.randint(1, 4)}
    return [wave | ({"m": 1} if tier != "axisym" and rng.random() < 0.3 else {})]


def shape(rng, tier):
    kind = rng.choice(("sphere", "sphere", "tube", "tube", "ellipsoid", "torus", "capsule"))
    keys = {"kind": kind} | ({"radius": number(rng, 0.3, 3)} if kind != "ellipsoid" else {})
    size = keys.get("radius", 1.0)
    match kind:
        case "tube":
            keys["length"] = size * rng.choice((1.0, 3.0, 6.0, 9.0, 40.0))
        case "ellipsoid":
            keys |= {"a": 1.0, "b": 1.0 if tier == "axisym" else rng.choice((1.0, 1.1)), "c": rng.choice((1.0, 1.0 + 1e-9, 1.2, 0.6, 2.5))}
        case "torus":
            keys["tube_radius"] = size * rng.choice((0.5**0.5, 0.5))  # the first is at rest
        case "capsule":
            keys["length"] = size * rng.choice((1e-6, 0.1, 2.0))
    if kind in ("sphere", "tube") and rng.random() < 0.5:
        wave = modes(rng, "l" if kind == "sphere" else "n", tier)
        keys["mode"] = [wave[0] | {"amplitude": wave[0]["amplitude"] * (size if kind == "tube" else 1)}]
    return keys


def case(rng):
    tier = rng.choice(("axisym", "axisym", "axisym", "surface3d", "auto"))
    model = {"kind": rng.choice(("auto", "auto", "fluid") if tier == "auto" else ("auto",)), "Re": number(rng, 1, 300)}
    if rng.random() < 0.6:
        model["gamma"] = rng.choice((0.0, number(rng, 1, 300)))
    if rng.random() < 0.3:
        model["volume"] = rng.choice(("free", "fixed"))
    energy = {"k20": rng.choice((1.0, 1.0, number(rng, 1, 30))), "H0": rng.choice((0.0, -1.0, -2.0, 1.0))}
    made = {"tier": tier, "energy": energy, "model": model, "shape": shape(rng, tier), "accuracy": {"energy": 10 ** rng.uniform(-4, -1)}}
    if tier != "axisym":
        made["accuracy"]["energy"] = rng.choice((0.1, 0.03))
    return made | {"time": {"end": number(rng, 2, 12), "limit": LIMIT}}


def one(rng, box):
    made = case(rng)
    box.write("case.toml", toml.dump(made))
    if rng.random() < 0.25:
        return f"check: exit {box.run('check', 'case.toml', statuses=(0, 2), limit=2 * LIMIT + SLACK).status}"
    done = box.run("run", "case.toml", "--quiet", limit=LIMIT + SLACK)
    if done.status == 2:
        if not re.search(r"case\.toml:\d+", done.err):
            raise Finding("no-place", f"refused without a line: {done.err[:300]!r}")
        return "refused"
    if not (box.folder / "case.hdf").exists():
        return "no state in time"
    return rows.judge(made, box.folder / "case.hdf")
