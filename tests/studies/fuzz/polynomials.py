#!/usr/bin/python3
"""Random polynomial energies of both tiers, and whether the error that a run states is the error that it has.

    polynomials.py TUBULE [--tier surface3d] [--first N] [--count N] [--save FILE]
    polynomials.py TUBULE [--tier surface3d] --print N        the case of scene N

A scene of scenes.py or motion_error_study.py gets k20 and one to three terms of powers: all positive and of even powers
(definite); with a Hessian in (H, K) that has both signs (indefinite); with odd powers, which have no lower bound (odd).
Runs are judged as in the atlas (judging.py), but a warning that the energy changed by little does not count: it says
nothing about the stated error. In three dimensions the truth is a run on 2.25 times the triangles with a tenth of the time
tolerance. The exit status is 1 if a scene is silent.
"""

import argparse
import collections
import json
import math
import random
import sys
import tempfile
import tomllib
from pathlib import Path

import scenes
import toml
from sandbox import Sandbox

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS / "atlas"), str(TESTS / "surface3d")]
import motion_error_study  # noqa: E402
from judging import KINDS, PHYSICS, FinerTruth, judge  # noqa: E402

# Powers of H - H0 and K, and whether the modulus may be negative.
SORTS = {
    "definite": ([(4, 0), (6, 0), (0, 2), (0, 4), (2, 2), (4, 2)], False),
    "indefinite": ([(1, 1), (2, 1), (4, 1), (2, 3)], True),
    "odd": ([(3, 0), (5, 0), (1, 2), (3, 2), (0, 3), (1, 1)], True),
}
LARGEST = 0.3  # of a term, in parts of k20: with more, most of the starts are ill-posed
SECONDS = {"axisym": 10 * scenes.LIMIT, "surface3d": 300}  # of a run; in three dimensions of its reference 4 times as many
SMALL_CHANGE = "the energy changed by only"


def draw_polynomial(draw, sort, size, k20):
    """k20, H0 and terms that change f and its second derivatives by up to about LARGEST where H = -2/size."""
    powers, signed = SORTS[sort]
    H0 = draw.choice((0.0, draw.uniform(-3, 1.5))) / size
    bend = max(1.0, abs(-2 - H0 * size))
    terms = []
    for H, K in draw.sample(powers, draw.randint(1, 3)):
        part = math.exp(draw.uniform(math.log(0.01), math.log(LARGEST))) / max(1, H * (H - 1) / 2, K * (K - 1) / 2, H * K)
        modulus = part * k20 * bend ** (2 - H) * size ** (H + 2 * K - 2)
        terms.append({"modulus": scenes.number(-modulus if signed and draw.random() < 0.5 else modulus), "H": H, "K": K})
    return {"k20": scenes.number(k20), "H0": scenes.number(H0), "term": terms}


def sort_of(n):
    return tuple(SORTS)[n % len(SORTS)]


def profile_scene(n):
    draw = random.Random(f"polynomial {n}")
    case = scenes.scene(draw, ensembles=0)
    _, size = scenes.draw_shape(random.Random(f"polynomial {n}"))
    k20 = math.exp(draw.uniform(math.log(0.05), math.log(1)))
    end = size**4 / k20 * math.exp(draw.uniform(math.log(0.03), math.log(1)))
    asked = math.exp(draw.uniform(math.log(2e-5), math.log(3e-3)))
    energy = draw_polynomial(draw, sort_of(n), size, k20)
    return case | {"energy": energy, "accuracy": {"energy": scenes.number(asked)}, "time": times(end, 12)}


def surface_scene(n):
    """About 80 triangles of order 4, in short motion."""
    draw = random.Random(f"polynomial surface {n}")
    kind, model = draw.choice(motion_error_study.SHAPES), draw.choice(motion_error_study.MODELS)
    table = {"kind": model}
    if model in ("stokes", "fluid"):
        table |= {"Re": scenes.number(10 ** draw.uniform(-0.5, 0.7)), "gamma": draw.choice((0.0, 0.5))}
    case = {"tier": "surface3d", "energy": draw_polynomial(draw, sort_of(n), 1.0, 1.0), "model": table}
    case |= tomllib.loads(motion_error_study.shape(draw, kind, rough=False))
    case |= {"accuracy": {"energy": scenes.number(10 ** draw.uniform(-2.3, -1.5))}}
    case |= {"discretisation": {"elements": 80, "order": 4}}
    return case | {"time": times(10 ** (draw.uniform(-3.5, -2.2) if model == "gradient-flow" else draw.uniform(-2.8, -1.7)), 4)}


def times(end, outputs):
    return {"end": scenes.number(end), "output": [scenes.number(end * 10 ** (-i / 2)) for i in range(outputs, 0, -1)]}


class FinerSurface:
    """The truth of a surface: errors are seven to ten times smaller there."""

    def __init__(self, box, case):
        self.box, self.case, self.finer = box, case, None

    def run(self, run):
        if not self.finer:
            sets = [f"discretisation.elements={int(2.25 * self.case['discretisation']['elements'])}", "accuracy.estimate=false"]
            if run.time_tolerance:
                sets.append(f"discretisation.time_tolerance={run.time_tolerance / 10}")
            self.finer = scenes.Run(self.box, self.case, *sets, limit=4 * SECONDS["surface3d"])
        return self.finer

    def error(self, run):
        finer = self.run(run)
        return (run.apart(finer, run.energy), 0.0) if finer.finished else None

    def ending(self, run):
        finer = self.run(run)
        if finer.finished:
            return None
        return (finer.stop, max(finer.energy, default=0.0)) if finer.stop in PHYSICS else False


def judged(n, program, tier):
    with tempfile.TemporaryDirectory() as top:
        box = Sandbox(program, Path(top) / "scene")
        case = surface_scene(n) if tier == "surface3d" else profile_scene(n)
        run = scenes.Run(box, case, limit=SECONDS[tier])
        truth = FinerSurface(box, case) if tier == "surface3d" else FinerTruth(box, case, run)
        run.warned = any(SMALL_CHANGE not in words for words in run.warnings.splitlines())
        judgement = judge(run, truth, case["accuracy"]["energy"], "discretisation" not in case)
    line = {"scene": n, "sort": sort_of(n), "model": case["model"]["kind"], "shape": case["shape"]["kind"]}
    line |= {"kind": judgement.kind, "stop": judgement.stop, "asked": case["accuracy"]["energy"]}
    return line | {"error": judgement.error, "stated": judgement.stated, "seconds": run.seconds}


def report(lines):
    for sort in (*SORTS, "all"):
        of = [x for x in lines if sort in (x["sort"], "all")]
        kinds = collections.Counter(x["kind"] for x in of)
        ratios = sorted(x["error"] / x["stated"] for x in of if x["error"] is not None and x["stated"] and x["kind"] in ("right", "silent"))
        shown = f"median {ratios[len(ratios) // 2]:.2g}, above 1: {sum(r > 1 for r in ratios)}, largest {ratios[-1]:.3g}" if ratios else "none"
        print(f"{sort}: {len(of)} scenes, " + ", ".join(f"{kinds[k]} {k}" for k in KINDS) + f"; true/stated of {len(ratios)}: {shown}")
    told = collections.Counter(x["stop"] for x in lines if x["kind"] == "told")
    print("told: " + ", ".join(f"{count} {stop}" for stop, count in told.most_common()))
    for x in lines:
        if x["kind"] in ("silent", "false alarm"):
            print(x)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--tier", choices=("axisym", "surface3d"), default="axisym")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--save", type=Path, help="a line of JSON for each scene")
    parser.add_argument("--print", type=int)
    a = parser.parse_args()
    if a.print is not None:
        print(toml.dump((surface_scene if a.tier == "surface3d" else profile_scene)(a.print)), end="")
        return 0
    lines = []
    for n in range(a.first, a.first + a.count):
        lines.append(judged(n, a.program.resolve(), a.tier))
        if a.save:
            a.save.write_text("".join(json.dumps(x) + "\n" for x in lines))
    report(lines)
    return any(x["kind"] == "silent" for x in lines)


if __name__ == "__main__":
    sys.exit(main())
