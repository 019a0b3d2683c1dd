"""The runs of a chart, each in its own process, the table that stores them (CSV), and how the ranks of an mpirun share them.

A run that crashes or hangs is an outcome like others. The table is written anew after every run, so a chart that was
stopped continues where it was.
"""

import csv
import ctypes
import hashlib
import json
import math
import os
import re
import shutil
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field, fields
from pathlib import Path

LARGEST_GROWTH = 1.1  # of the total energy over that of the initial shape; more counts as unstable
STATUS = {2: "refused", 130: "interrupted"}
PR_SET_PDEATHSIG = 1
LIBC = ctypes.CDLL(None)
LAUNCHERS = (  # rank, number of ranks, and what distinguishes this launch from others
    ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", ("PMIX_NAMESPACE", "OMPI_MCA_ess_base_jobid")),
    ("SLURM_PROCID", "SLURM_STEP_NUM_TASKS", ("SLURM_JOB_ID", "SLURM_STEP_ID")),
    ("PMI_RANK", "PMI_SIZE", ("PMI_JOBID", "HYDI_CONTROL_FD")),
)
POLL = 0.1  # seconds between looks at the tables of other ranks


@dataclass(frozen=True)
class Job:
    """What to run. `sets` are all overrides, in order; `varied` those that distinguish it within its series."""

    series: str
    case: Path
    sets: tuple  # of "key=value"
    varied: str = ""

    @property
    def key(self):
        """Identifies a computation: from the text of the case and the overrides."""
        text = self.case.read_text() + "\n".join(self.sets)
        return hashlib.sha256(text.encode(errors="surrogateescape")).hexdigest()[:16]

    @property
    def arguments(self):
        return [str(self.case), *(part for override in self.sets for part in ("--set", override))]


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
    growth: float = 0.0  # largest total energy over that of the initial shape

    @property
    def finished(self):
        return self.outcome in ("finished", "stationary")

    @property
    def stable(self):
        return self.finished and self.growth <= LARGEST_GROWTH

    def reached(self, times):
        return self.finished and all(time in self.values for time in times)


def value_text(value):
    """A value in the syntax of --set and case files."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return "[" + ",".join(value_text(entry) for entry in value) + "]"
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


def rounded(value):
    """A number as the table stores it, so that a chart drawn from the table is the same."""
    return float(f"{value:.5g}")


def die_with_parent():
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


class Program:
    """`tubule` as it is called for charts."""

    def __init__(self, path, folder, limit, quantity):
        self.path, self.folder, self.limit, self.quantity = path, folder, limit, quantity
        # One thread: CPU time then excludes the waiting of idle threads.
        self.environment = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **os.environ}
        self.over = False  # where all runs are to end

    def printed(self, *arguments):
        return subprocess.run([self.path, *arguments], capture_output=True, encoding="utf-8", errors="replace")

    def check(self, job):
        """The case with all overrides as TOML text, or its error."""
        done = self.printed("check", "--quick", *job.arguments)
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
        error = self.printed("check", "--quick", *job.arguments, "--set", expected).stderr
        found = re.search(f"unknown key expect.{self.quantity}(; did you mean .*?\\?)?", error)
        return f"quantity {self.quantity}: no series has this name{found[1] or ''}" if found else None

    def run(self, job):
        """The Run of a job, killed if it exceeds its limit, or once `over` is true."""
        result, log = self.folder / f"{job.key}.hdf", self.folder / f"{job.key}.log"
        command = [self.path, "run", "--quiet", "--overwrite", *job.arguments, "-o", result]
        with open(log, "wb") as output:
            process = subprocess.Popen(command, stdout=output, stderr=output, env=self.environment, preexec_fn=die_with_parent)
        deadline, ended = time.monotonic() + self.limit, 0
        while not ended:
            time.sleep(0.002)
            ended, status, usage = os.wait4(process.pid, os.WNOHANG)
            late = time.monotonic() > deadline
            if not ended and (late or self.over):
                process.kill()
                ended, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        run = Run(job.key, "", cpu_s=round(usage.ru_utime + usage.ru_stime, 3))
        self.read(result, run)
        if late and process.returncode == -signal.SIGKILL:
            run.outcome, run.message = "too slow", f"not done after {self.limit:g} s"
        elif process.returncode < 0:
            run.outcome, run.message = "crashed", f"ended by {signal.Signals(-process.returncode).name}"
        elif not run.outcome:
            words = log.read_text(errors="replace").strip().splitlines()
            run.outcome = STATUS.get(process.returncode, "crashed")
            run.message = words[-1] if words else f"exit status {process.returncode}"
        for path in self.folder.glob(job.key + ".*"):
            path.unlink()
        return run

    def read(self, path, run):
        """Content of the result; empty if there is none."""
        shown = self.printed("show", path, "--json")
        if not path.exists() or shown.returncode != 0:
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


class Table:
    """Finished runs, by key, in a file."""

    COLUMNS = ("series", "settings", "outcome", "stop_time", "error", "front", "chosen_for", "cpu_s", "stated_error",
               "elements", "steps", "width", "growth", "E_ref")  # fmt: skip
    STORED = {each.name: each.type for each in fields(Run) if each.name != "values"}

    def __init__(self, path, quantity, times, again=False):
        self.path, self.times = path, times
        self.columns = {time: f"{quantity}@{time:g}" for time in times}
        self.runs, self.names = {}, {}  # by key; names: series and settings of an earlier call
        if not again and path.exists():
            self.runs = self.read(path)

    def read(self, path):
        """Runs of an earlier call, or of another rank. Raises ValueError or csv.Error if the file is something else."""
        runs = {}
        with open(path, newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                try:
                    values = {time: float(row[name]) for time, name in self.columns.items() if row.get(name)}
                    self.names[row["key"]] = {"series": row["series"], "settings": row["settings"]}
                    runs[row["key"]] = Run(**{name: kind(row[name]) for name, kind in self.STORED.items()}, values=values)
                except (KeyError, TypeError, AttributeError) as error:
                    raise ValueError(error) from error
        return runs

    def write(self, jobs, judged=None, path=None):
        """Rows in the order of the jobs; `judged` gives error, front and chosen_for of a key. Runs that no job asks
        for any more are kept at the end."""
        path = path or self.path
        names = {job.key: {"series": job.series, "settings": job.varied} for job in reversed(jobs)}
        order = dict.fromkeys([job.key for job in jobs if job.key in self.runs] + list(self.runs))
        aside = path.with_name(path.name + ".part")
        with open(aside, "w", newline="", encoding="utf-8", errors="backslashreplace") as file:
            writer = csv.DictWriter(file, [*self.COLUMNS, *self.columns.values(), "message", "key"], lineterminator="\n")
            writer.writeheader()
            for key in order:
                run = self.runs[key]
                values = {column: run.values[at] for at, column in self.columns.items() if at in run.values}
                writer.writerow((names.get(key) or self.names.get(key, {})) | {name: getattr(run, name) for name in self.STORED}
                                | (judged or {}).get(key, {}) | values)  # fmt: skip
        os.replace(aside, path)


class Ranks:
    """A chart across the processes of an mpirun or srun: each runs this script, takes runs that no other one has taken, and
    waits for what the others find. In NAME.ranks/LAUNCH beside the chart, a file named like a run says that it is taken,
    and each rank has a table of its runs. What a killed launch left there is used by the next one."""

    def __init__(self, table, environment, again=False):
        self.rank, self.count = 0, 1
        for rank, count, names in LAUNCHERS:
            if rank in environment and int(environment.get(count, "1")) > 1:
                self.rank, self.count = int(environment[rank]), int(environment[count])
                launch = "-".join(environment[name] for name in names if name in environment) or "launch"
                break
        if not self:
            return
        self.root, self.read = table.path.with_suffix(".ranks"), table.read
        self.folder = self.root / re.sub(r"\W", "_", launch)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.table = self.folder / f"rank_{self.rank}.csv"  # of this rank's own runs
        self.tables = f"{self.folder.name if again else '*'}/rank_*.csv"

    def __bool__(self):
        return self.count > 1

    def found(self):
        """Runs of the other ranks and, unless they are done again, of launches that were killed."""
        runs = {}
        for path in self.root.glob(self.tables):
            try:
                runs |= self.read(path)
            except (OSError, ValueError, csv.Error):  # gone by now
                pass
        return runs

    def take(self, job):
        """Whether this rank is to run the job: the first one that asks is."""
        try:
            os.close(os.open(self.folder / job.key, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        except FileExistsError:
            return False
        return True

    def leave(self):
        """When all is known. Rank 0 waits for the others and removes the folder."""
        if self.rank > 0:
            (self.folder / f"left_{self.rank}").touch()
            return
        while self and len(list(self.folder.glob("left_*"))) < self.count - 1:
            time.sleep(POLL)
        if self:
            shutil.rmtree(self.root, ignore_errors=True)


class Runner:
    """Runs jobs, several at a time, and maintains the table."""

    def __init__(self, program, table, at_once, repeats=1, say=print, ranks=None):
        self.program, self.table, self.at_once, self.repeats, self.say = program, table, at_once, repeats, say
        self.ranks = ranks or Ranks(table, {})

    def run(self, jobs, rows=None):
        """Jobs that are not in the table yet; it has rows of these, or of more jobs."""
        done, ended = self.table.runs, 0
        left = list({job.key: job for job in jobs if job.key not in done}.values())
        if len(jobs) > len(left) and left:
            self.say(f"{len(jobs) - len(left)} runs are in {self.table.path} already")
        with ThreadPoolExecutor(self.at_once) as pool:
            try:
                futures = {pool.submit(self.run_one, job): job for job in left}
                for future in as_completed(futures):
                    if run := future.result():
                        job, ended = futures[future], ended + 1
                        done[run.key] = run
                        self.write(rows or jobs)
                        words = run.outcome if run.finished else f"{run.outcome} at t = {run.stop_time:.4g}"
                        self.say(f"[{ended}/{len(left)}] {job.series}: {job.varied}: {words}, {run.cpu_s:.3g} s")
            except BaseException:
                self.program.over = True
                pool.shutdown(cancel_futures=True)
                raise
        while any(job.key not in done for job in left):  # other ranks run them
            time.sleep(POLL)
            self.table.runs = done = self.ranks.found() | done

    def run_one(self, job):
        """The least disturbed of its repeats; None if another rank runs it."""
        if self.ranks and (job.key in self.ranks.found() or not self.ranks.take(job)):
            return None
        runs = [run for _ in range(self.repeats) if (run := self.program.run(job))]
        for run in runs:
            run.values = {at: run.values[at] for at in self.table.times if at in run.values}
        return min(runs, key=lambda run: run.cpu_s, default=None)

    def write(self, jobs):
        if self.ranks:
            self.table.write(jobs, path=self.ranks.table)
        if self.ranks.rank == 0:
            self.table.write(jobs)
