"""What became of a run, judged against the truth: exact, or a run far finer.

    right        finished, and its error is at most twice what it states and at most what was asked for; or ended by the
                 physics, at the time and for the reason that the truth has
    told         refused, stopped by the numerics, warned of, or its error is stated as unknown
    false alarm  ended as if by the physics where the truth goes on; or by the numerics, though the program chose the
                 discretisation and a finer run finishes
    silent       finished without a warning, and the error is above twice the stated one or above what was asked for; or
                 went on where the truth ends
    undecided    the truth is not known well enough
"""

import math
from dataclasses import dataclass

import toml
from scenes import LIMIT, Reference, Run

KINDS = ("right", "told", "false alarm", "silent", "undecided")
PHYSICS = ("pinch-off", "overhang", "self-intersection", "ill-posed")
LATE = 0.05  # how far the time of a stop may be off, relative to it, or to what the truth ran on


@dataclass
class Judgement:
    kind: str
    stop: str = ""  # how it ended
    error: float | None = None  # relative to E_ref
    stated: float | None = None

    @property
    def sort(self):
        """What points of one region have in common."""
        return f"{self.kind}: {self.stop}"


class ExactTruth:
    """The energies at some times, and the physical stop: (reason, time) or None. `known`: how well, relative to E_ref."""

    def __init__(self, energy, stop, known):
        self.energy, self.stop, self.known = energy, stop, known

    def error(self, run):
        apart = max((abs(run.energy[t] - e) for t, e in self.energy.items() if t in run.energy), default=math.inf)
        return apart / run.scale, self.known

    def ending(self, run):
        return self.stop


class FinerTruth:
    """Runs of the same case far finer, on a discretisation of their own."""

    def __init__(self, box, case):
        case = {key: value for key, value in case.items() if key != "discretisation"}
        self.reference = Reference(box, case)

    def error(self, run):
        return self.reference.error(run)

    def ending(self, run):
        """The physical stop, False if the finer runs end otherwise before the run did, None if they finish."""
        for level in (0, 1):
            finer = self.reference.run(level)
            if finer.finished:
                return None
            if finer.stop in PHYSICS:
                return finer.stop, max(finer.energy, default=0.0)
        return False


def ended_by_physics(run, ending):
    at = max(run.energy, default=0.0)
    if ending is None:
        return "false alarm"
    if ending is False:
        return "undecided"
    return "right" if abs(at - ending[1]) <= LATE * max(at, ending[1]) else "undecided"


def judge(run, truth, asked, chosen):
    """`chosen`: the discretisation is the program's own choice."""
    if run.stop in PHYSICS:
        return Judgement(ended_by_physics(run, truth.ending(run)), run.stop)
    if not run.finished:
        alarm = chosen and run.stop not in ("no result", "time-limit") and truth.ending(run) is None
        return Judgement("false alarm" if alarm else "told", run.stop)
    if run.stated >= 1 or run.warned:
        return Judgement("told", "warned" if run.warned else "unknown")
    error = truth.error(run)
    if error is None:
        ending = truth.ending(run)
        return Judgement("silent" if ending else "undecided", run.stop, None, run.stated)
    if ending := isinstance(truth, ExactTruth) and truth.ending(run):
        return Judgement("silent", f"went on beyond {ending[0]}", None, run.stated)
    value, doubt = error
    if doubt > 0.1 * max(value, 2 * run.stated, asked):
        return Judgement("undecided", run.stop, value, run.stated)
    return Judgement("silent" if value > 2 * run.stated or value > asked else "right", run.stop, value, run.stated)


def judged_run(box, case, truth=None):
    """Runs a case, and judges it."""
    asked = case["accuracy"]["energy"]
    run = Run(box, case, limit=LIMIT)
    return judge(run, truth or FinerTruth(box, case), asked, "discretisation" not in case)
