"""The runs of a chart, each in its own process, and the table that stores them (CSV). Standard library only.

A run that crashes or hangs is an outcome like others. The table is written anew after every run, so a chart that was
stopped goes on where it was.
"""

import csv
import ctypes
import hashlib
import json
import math
import os
import re
import signal
import subprocess
import time
from dataclasses import dataclass, field, fields
from pathlib import Path

LARGEST_GROWTH = 1.1  # of the total energy over that of the start; more counts as unstable
STATUS = {2: "refused", 130: "interrupted"}
PR_SET_PDEATHSIG = 1
INTERRUPTS = {signal.SIGINT, signal.SIGTERM}


@dataclass(frozen=True)
class Job:
    """What to run. `sets` are all overrides, in order; `told` those that distinguish it within its series."""

    series: str
    case: Path
    sets: tuple  # of "key=value"
    told: tuple = ()

    @property
    def key(self):
        """Identifies a computation: from the text of the case and the overrides."""
        text = self.case.read_text() + "\n".join(self.sets)
        return hashlib.sha256(text.encode(errors="surrogateescape")).hexdigest()[:16]


@dataclass
class Run:
    """The outcome of a job. `values` at the times of the chart that it reached."""

    key: str
    outcome: str  # a stop reason; crashed, too slow, refused
    message: str = ""
    stop_time: float = 0.0
    cpu_s: float = 0.0
    values: dict = field(default_factory=dict)  # time -> value
    E_ref: float = 0.0
    stated_error: float = 0.0
    elements: int = 0
    steps: int = 0
    width: float = 0.0  # edge of an equilateral triangle of the mean area; 0: of a profile
    growth: float = 0.0  # largest total energy over that of the start

    @property
    def finished(self):
        return self.outcome in ("finished", "stationary")

    @property
    def stable(self):
        return self.finished and self.growth <= LARGEST_GROWTH


def value_text(value):
    """A value in the syntax of --set and case files."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return "[" + ",".join(value_text(entry) for entry in value) + "]"
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


class Program:
    """`tubule` as it is called for charts."""

    def __init__(self, path, folder, limit, quantity):
        self.path, self.folder, self.limit, self.quantity = path, folder, limit, quantity
        # One thread: CPU time then excludes the waiting of idle threads.
        self.environment = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **os.environ}

    def check(self, job):
        """The case with all overrides as TOML text, or its error."""
        done = self.printed("check", "--quick", job.case, *set_options(job))
        if done.returncode:
            return None, done.stderr.strip()
        if '\nkind = "auto"\n' in done.stdout:
            return None, f"{job.case}: model.kind must not be \"auto\" in a chart, whose runs could have different models; name one"
        return done.stdout, None

    def check_quantity(self, job):
        """What is wrong with the name of the quantity, if anything: the program knows what a case can expect."""
        if not re.fullmatch("[A-Za-z0-9_]+", self.quantity):
            return f"quantity {self.quantity!r}: is no name of a series"
        expected = f"expect.{self.quantity}={{value=0.0,abs=1.0}}"
        error = self.printed("check", "--quick", job.case, "--set", expected).stderr
        found = re.search(f"unknown key expect.{self.quantity}(; did you mean .*?\\?)?", error)
        return f"quantity {self.quantity}: no series has this name{found[1] or ''}" if found else None

    def printed(self, *arguments):
        return subprocess.run([self.path, *arguments], capture_output=True, encoding="utf-8", errors="replace")

    def start(self, job, number):
        result = self.folder / f"run_{number}.hdf"
        command = [self.path, "run", "--quiet", "--overwrite", job.case, *set_options(job), "-o", result]
        log = open(result.with_suffix(".log"), "wb")
        process = subprocess.Popen(
            list(map(str, command)),
            stdout=log,
            stderr=subprocess.STDOUT,
            env=self.environment,
            preexec_fn=die_with_parent,
        )
        log.close()
        return Going(job, process, result, time.monotonic() + self.limit)

    def look(self, going):
        """The Run if it has ended, else None. Kills a run that exceeds its limit."""
        pid, status, usage = os.wait4(going.process.pid, os.WNOHANG)
        if pid == 0 and time.monotonic() < going.deadline:
            return None
        late = pid == 0
        if late:
            going.process.kill()
            _, status, usage = os.wait4(going.process.pid, 0)
        going.process.returncode = os.waitstatus_to_exitcode(status)
        run = Run(going.job.key, "", cpu_s=round(usage.ru_utime + usage.ru_stime, 3))
        self.read(going, run)
        if late:
            run.outcome, run.message = "too slow", f"not done after {self.limit:g} s"
        elif going.process.returncode < 0:
            name = signal.Signals(-going.process.returncode).name
            run.outcome, run.message = "crashed", f"ended by {name}"
        elif not run.outcome:
            words = going.result.with_suffix(".log").read_text(errors="replace").strip().splitlines()
            run.outcome = STATUS.get(going.process.returncode, "crashed")
            run.message = words[-1] if words else f"exit status {going.process.returncode}"
        for path in self.folder.glob(going.result.stem + ".*"):
            path.unlink()
        return run

    def read(self, going, run):
        """Content of the result; empty if there is none."""
        shown = self.printed("show", going.result, "--json")
        if not going.result.exists() or shown.returncode != 0:
            return
        result = json.loads(shown.stdout)
        about, series = result["about"], result["series"]
        run.outcome, run.message = about.get("stop", ""), about.get("stop_message", "")
        run.E_ref, run.stated_error = about.get("E_ref", 0.0), rounded(about.get("estimated_error", 1.0))
        run.elements, run.steps = about.get("elements", 0), about.get("steps", 0)
        if not series["time"]:
            return
        run.stop_time = series["time"][-1]
        run.values = dict(zip(series["time"], series.get(self.quantity, [])))
        kinetic = series.get("kinetic_energy", [0.0] * len(series["time"]))
        totals = [sum(row) for row in zip(series.get("free_energy", series["energy"]), kinetic)]
        run.growth = rounded(max(totals) / totals[0]) if totals[0] > 0 else 1.0
        if "integral_K" in series and run.elements:
            run.width = rounded(math.sqrt(4 / math.sqrt(3) * series["area"][0] / run.elements))


def rounded(value):
    """The run as the table stores it, so that a chart drawn from the table is the same."""
    return float(f"{value:.5g}")


@dataclass
class Going:
    job: Job
    process: subprocess.Popen
    result: Path
    deadline: float


def die_with_parent():
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPTS)  # blocked while the run is started


def set_options(job):
    return [part for override in job.sets for part in ("--set", override)]


class Table:
    """Finished runs, by key, in a file."""

    COLUMNS = ("series", "settings", "outcome", "stop_time", "error", "front", "chosen_for", "cpu_s", "stated_error",
               "elements", "steps", "width", "growth", "E_ref")  # fmt: skip
    STORED = {each.name: each.type for each in fields(Run) if each.name != "values"}

    def __init__(self, path, quantity, times, again=False):
        self.path, self.quantity, self.times = path, quantity, times
        self.runs, self.names = {}, {}  # by key; names: series and settings of an earlier call
        if not again and path.exists():
            self.runs = self.read(path)

    def _value_columns(self):
        return {time: f"{self.quantity}@{time:g}" for time in self.times}

    def read(self, path):
        """Runs of an earlier call, or of another rank. Raises ValueError or csv.Error if the file is something else."""
        runs = {}
        with open(path, newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                try:
                    values = {float(name.partition("@")[2]): float(text) for name, text in row.items()
                              if name.startswith(self.quantity + "@") and text}  # fmt: skip
                    self.names[row["key"]] = row["series"], row["settings"]
                    runs[row["key"]] = Run(**{name: kind(row[name]) for name, kind in self.STORED.items()}, values=values)
                except (KeyError, TypeError, AttributeError) as error:
                    raise ValueError(error) from error
        return runs

    def write(self, jobs, judged=None, path=None):
        """Rows in the order of the jobs; `judged` gives error, front and chosen_for of a key. Runs that no job asks
        for any more are kept at the end."""
        judged, path = judged or {}, path or self.path
        rows, seen = [], set()
        for job in jobs:
            run = self.runs.get(job.key)
            if run and job.key not in seen:
                seen.add(job.key)
                rows.append(self._row(job.series, " ".join(job.told), run, judged.get(job.key, {})))
        rows += [self._row(*self.names.get(key, ("", "")), run, {}) for key, run in self.runs.items() if key not in seen]
        aside = path.with_name(path.name + ".part")
        with open(aside, "w", newline="", encoding="utf-8", errors="backslashreplace") as file:
            columns = [*self.COLUMNS, *self._value_columns().values(), "message", "key"]
            writer = csv.DictWriter(file, columns, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        os.replace(aside, path)

    def _row(self, series, settings, run, judged):
        values = {column: run.values[at] for at, column in self._value_columns().items() if at in run.values}
        return {"series": series, "settings": settings, **{name: getattr(run, name) for name in self.STORED}, **judged, **values}


class Runner:
    """Runs jobs, several at a time, and maintains the table; with `ranks`, those that no other rank has taken."""

    def __init__(self, program, table, jobs, at_once, repeats=1, say=print, ranks=None):
        self.program, self.table, self.jobs, self.ranks = program, table, jobs, ranks
        self.at_once, self.repeats, self.say, self.number = at_once, repeats, say, 0

    def run(self, jobs):
        """Jobs that are not in the table yet."""
        done = self.table.runs
        left = list({job.key: job for job in jobs if job.key not in done}.values())
        if len(jobs) > len(left) and left:
            self.say(f"{len(jobs) - len(left)} runs are in {self.table.path} already")
        self.total, self.ended, going = len(left) * self.repeats, 0, []
        waiting, left = (left, []) if self.ranks else ([], [job for job in left for _ in range(self.repeats)])
        try:
            while left or going or waiting:
                if self.ranks:
                    self.share(waiting, left, going)
                self.start_some(left, going)
                time.sleep(0.005)
                for one in list(going):
                    run = self.program.look(one)
                    if run is not None:
                        going.remove(one)
                        self.take(one.job, run)
        finally:  # of an interrupt, say: nothing may write into the folder any more
            for one in going:
                one.process.kill()
                one.process.wait()

    def share(self, waiting, left, going):
        """Jobs that others have run are done; of the others, this rank takes as many as it can start."""
        done = self.table.runs
        for key, run in self.ranks.found().items():
            done.setdefault(key, run)
        waiting[:] = [job for job in waiting if job.key not in done]
        for job in list(waiting):
            if len(left) + len(going) >= self.at_once:
                break
            if self.ranks.take(job):
                left += [job] * self.repeats
                waiting.remove(job)

    def start_some(self, left, going):
        while left and len(going) < self.at_once:
            self.number += 1
            signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)  # between the start and `going` they would lose the run
            try:
                going.append(self.program.start(left[0], self.number))
            except OSError:  # no more processes, or files, are to be had
                if not going:
                    raise
                return
            finally:
                signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPTS)
            left.pop(0)

    def take(self, job, run):
        self.ended += 1
        done = self.table.runs
        run.values = {at: run.values[at] for at in self.table.times if at in run.values}
        earlier = done.get(run.key)
        if earlier is None or run.cpu_s < earlier.cpu_s:  # of repeats, the least disturbed
            done[run.key] = run
        if self.ranks:
            self.table.write(self.jobs, path=self.ranks.table)
        if not self.ranks or self.ranks.rank == 0:
            self.table.write(self.jobs)
        words = run.outcome if run.finished else f"{run.outcome} at t = {run.stop_time:.4g}"
        self.say(f"[{self.ended}/{self.total}] {job.series}: {' '.join(job.told)}: {words}, {run.cpu_s:.3g} s")
