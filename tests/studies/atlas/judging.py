"""What became of a run, judged against the truth: exact, or a run far finer.

    right        finished, and its error is at most twice what it states and at most what was asked for; or ended by the
                 physics, at the time and for the reason that the truth has
    told         refused, stopped by the numerics, or its error is stated as unknown or as above what was asked for; or what
                 is wrong goes with a warning
    false alarm  ended as if by the physics where the truth goes on; or by the numerics, though the program chose the
                 discretisation and a finer run finishes
    silent       finished without a warning, and the error is above twice the stated one or above what was asked for; or
                 went on where the truth ends
    undecided    the truth is not known well enough, or the run did not end within the limit of this judging
"""

import math
from dataclasses import dataclass

import toml
from scenes import LIMIT, Reference, Run

KINDS = ("right", "told", "false alarm", "silent", "undecided")
PHYSICS = ("pinch-off", "self-intersection", "ill-posed")  # a graph that overhangs goes on as a curve: told
NUMERICS = ("resolution-lost", "mesh-lost", "solver-failed")
NONE = 1e-9  # errors below are not looked at
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


class ProfileTruth:
    """A run of tier axisym, asked for far more accuracy: of surfaces in three dimensions that keep their axis."""

    def __init__(self, box, case):
        case = {key: value for key, value in case.items() if key != "discretisation"} | {"tier": "axisym"}
        asked = max(1e-4 * case["accuracy"]["energy"], 1e-7)
        self.run = Run(box, case | {"accuracy": case["accuracy"] | {"energy": asked}}, limit=5 * LIMIT)

    def error(self, run):
        if not self.run.finished:
            return None
        return run.apart(self.run, self.run.energy.keys() & run.energy.keys()), self.run.stated

    def ending(self, run):
        if self.run.finished:
            return None
        return (self.run.stop, max(self.run.energy, default=0.0)) if self.run.stop in PHYSICS else False


class FinerTruth:
    """Runs of the same case far finer, on a discretisation of their own."""

    def __init__(self, box, case, run):
        case = {key: value for key, value in case.items() if key != "discretisation"}
        asked = max(min(case["accuracy"]["energy"], run.stated), NONE)
        self.reference = Reference(box, case | {"accuracy": case["accuracy"] | {"energy": asked}})

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
    if run.stop == "time-limit":
        return Judgement("undecided", run.stop)
    if run.stop in PHYSICS:
        return Judgement(ended_by_physics(run, truth.ending(run)), run.stop)
    if not run.finished:
        alarm = chosen and run.stop != "no result" and truth.ending(run) is None
        return Judgement("false alarm" if alarm else "told", run.stop)
    if run.stated >= 1:
        return Judgement("told", "unknown")
    if run.warned and run.stated > asked:
        return Judgement("told", "less accurate", None, run.stated)
    error = truth.error(run)
    ending = truth.ending(run) if error is None or isinstance(truth, ExactTruth) else None
    if ending:
        kind, stop = "silent", f"went on beyond {ending[0]}"
    else:
        kind, stop = kind_of_error(run, asked, *error) if error else "undecided", run.stop
    if kind == "silent" and run.warned:
        kind, stop = "told", "warned"
    return Judgement(kind, stop, error and error[0], run.stated)


def kind_of_error(run, asked, value, doubt):
    allowed = max(min(2 * run.stated, asked), NONE)
    if value > allowed + doubt:
        return "silent"
    return "right" if value <= allowed and doubt <= allowed / 2 else "undecided"


def judged_run(box, case, truth=None, **options):
    """Runs a case, and judges it."""
    asked = case["accuracy"]["energy"]
    run = Run(box, case, **options)
    chosen = "discretisation" not in case and case["shape"]["kind"] != "file"
    return judge(run, truth or FinerTruth(box, case, run), asked, chosen)
