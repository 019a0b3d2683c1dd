"""Loads that change in time, over all choices of what is kept, in both tiers: kinks close together, at the ends and beyond them,
many, steep, huge.

A run ends in time and has possible rows (rows.py). A run that claims that its energy rose is compared with one whose kinks are
spread over the run: where that one finishes, the claim was wrong, for it was the load that worked."""

import math
import re

import rows
import scenes
import surfaces
import toml
from sandbox import Finding

STUDY = (1, 2, 4, 5, 7, 12)
LIMIT = 3  # seconds that a run is given, in the case


def kinks(rng, size, end):
    """A load with kinks whose distances are anything from neighbouring numbers to parts of the run."""
    n, at = rng.choice((1, 2, 2, 3, 5, 30, 400)), rng.choice((0, end, 1.5 * end, *(end * rng.random() for _ in range(5))))
    gap = end * 10 ** rng.uniform(-17, -0.5) / n
    times = [at]
    while len(times) < n:
        times.append(max(times[-1] + gap * rng.uniform(0.5, 1.5), math.nextafter(times[-1], math.inf)))
    size *= rng.choice((1, 1, 1, 1, 1e-9, 30, 1e12, 1e300))
    return {"time": times, "value": [size * rng.uniform(-1, 3) for _ in times]}


def case(rng):
    if rng.random() < 0.2:
        made = surfaces.case(rng)
        made["discretisation"] |= {"elements": 80, "order": 3}
        size, modulus, end = made["shape"].get("radius", 1.0), 1.0, made["time"]["end"]
    else:
        made = scenes.scene(rng, ensembles=0)
        size, modulus, end = made["shape"].get("radius", 1.0), max(made["energy"].values()), made["time"]["end"]
    model, scale = {"kind": made["model"]["kind"]}, {"tension": modulus, "pressure": modulus / size, "force": 6 * modulus * size}
    while not scale.keys() & model.keys():
        scenes.draw_ensemble(rng, model, made["shape"]["kind"] == "tube", size, modulus, end)
    for name in scale.keys() & model.keys():
        model[name] = kinks(rng, scale[name], end)
    made["model"] |= model
    made["time"]["limit"] = LIMIT
    return made


def spread(case):
    """The case with the same values of its loads, at times that divide the run evenly."""
    model = dict(case["model"])
    for name, load in model.items():
        if isinstance(load, dict):
            n = len(load["time"])
            model[name] = load | {"time": [case["time"]["end"] * i / n for i in range(n)]}
    return case | {"model": model}


def run(box, case):
    """How it ended, and in which words."""
    box.write("case.toml", toml.dump(case))
    done = box.run("run", "case.toml", "--quiet", "--overwrite", limit=2 * LIMIT + 10)
    if done.status == 2:
        if not re.search(r"case\.toml:\d+", done.err):
            raise Finding("no-place", f"refused without a line: {done.err[:300]!r}")
        return "refused", ""
    if done.status == 5 and "before the first state was computed" in done.err:
        return "no state in time", ""
    return rows.judge(case, box.folder / "case.hdf"), done.out


def one(rng, box):
    made = case(rng)
    stop, words = run(box, made)
    if "can only lose energy" in words and run(box, spread(made))[0] == "finished":
        raise Finding("false-alarm", f"finishes when the kinks are spread, but here: {words}")
    return stop
