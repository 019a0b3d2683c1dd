"""Error against CPU time of many runs of a case, or a map of its largest stable steps. See `tubule chart --help`."""

import csv
import os
import signal
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

from . import chart_draw, style
from .chart_file import Reference, Series, assignment, chart_of_case, check, map_option, plain, read_chart, toml_of
from .chart_runs import Program, Ranks, Runner, Table
from .command_line import BadInput, Unavailable, say
from .results import read_result

TARGETS = (1e-3, 1e-4, 1e-6)


@dataclass
class Truth:
    """The reference for errors."""

    values: dict  # time -> value
    scale: float  # errors are relative to it
    known_to: float  # relative, too
    source: str
    key: str = ""  # of its run


def found(file):
    """The name of a case; of cases/NAME.toml, where there is none here, that beside the installed program or in its sources."""
    places = Path(os.environ["TUBULE_PROGRAM"]).parents[1] / "share/tubule", Path(__file__).resolve().parents[4]
    if not file.startswith("cases/") or os.path.exists(file):
        return Path(file)
    return next((place / file for place in places if (place / file).exists()), Path(file))


def chart_of(options):
    """The chart that the file and the options describe, validated. Raises BadInput."""
    file = found(options.file)
    if "series" in toml_of(file):
        for name in ("vary", "also", "map"):
            if getattr(options, name):
                raise BadInput(f"{file}: is a chart file; --{name} applies only to a case")
        chart = read_chart(file, options.study)
    else:
        if not options.vary:
            raise BadInput(f"{file}: is a case: it needs --vary, such as --vary discretisation.elements=20,40")
        chart = chart_of_case(file, options.vary, options.also)
        chart.map = map_option(options.map) if options.map else None
    chart.set |= {key: plain(value) for key, value in (assignment(text, "--set") for text in options.set)}
    if options.reference:
        chart.reference = Reference(result=Path(options.reference))
    if options.times:
        chart.times = options.times
    chart.quantity = options.quantity or chart.quantity
    chart.limit = chart.limit if options.limit is None else options.limit
    if not chart.limit > 0:
        raise BadInput(f"--limit {chart.limit:g}: must be above 0 seconds")
    if options.jobs < 1:
        raise BadInput(f"--jobs {options.jobs}: must be 1 or more")
    check(chart)
    return chart


def outputs_of(options):
    """Pictures to write. Raises BadInput, before any run, for a picture that cannot be written."""
    outputs = [Path(text) for text in options.output] or [Path(Path(options.file).stem + ".svg")]
    style.check_outputs(map(str, outputs))
    for path in outputs:
        if not os.access(path.parent, os.W_OK):
            raise BadInput(f"{path}: the folder {path.parent} cannot be written to")
    return outputs


def checked(program, jobs):
    """Validates all cases and the quantity before any run; returns the first case. Raises BadInput."""
    first = None
    if jobs and (error := program.check_quantity(jobs[0])):
        raise BadInput(error)
    for job in jobs:
        text, error = program.check(job)
        if error:
            raise BadInput(f"{error}\n    in series {job.series!r}: {' '.join(job.sets)}")
        first = first or tomllib.loads(text)
    return first


class Work:
    """What error charts and maps share: the runs of a chart, and their table."""

    def __init__(self, chart, options, outputs, program, times=()):
        self.chart, self.options, self.outputs, self.program = chart, options, outputs, program
        path = outputs[0].with_suffix(".csv")
        if path.exists() and not path.is_file():
            raise BadInput(f"{path}: is no file, so the data of the chart cannot be written there; choose another -o")
        try:
            self.table = Table(path, chart.quantity, times, options.again)
        except OSError as error:
            raise BadInput(f"{path}: cannot be read: {error.strerror}") from error
        except (ValueError, csv.Error) as error:
            raise BadInput(f"{path}: is no table of a chart ({error}); move it or choose another -o") from error
        self.ranks = Ranks(self.table, {} if options.draw else os.environ, options.again)
        if self.ranks and not options.again:  # what a killed launch has found
            self.table.runs = self.ranks.found() | self.table.runs
        self.quiet = options.quiet or self.ranks.rank > 0

    def tell(self, words):
        if not self.quiet:
            say(words)

    def run(self, jobs, rows):
        """The jobs whose runs are known now; nothing is run where the data are only to be drawn."""
        if self.options.draw:
            return [job for job in jobs if job.key in self.table.runs]
        repeats = 1 if self.chart.map else self.chart.repeats
        Runner(self.program, self.table, self.options.jobs, repeats, self.tell, self.ranks).run(jobs, rows)
        return jobs

    def draws(self):
        """Whether this process draws, now that all runs are known."""
        self.ranks.leave()
        return self.ranks.rank == 0


# ---- error against CPU time


def times_of(case):
    if "time" not in case:
        raise BadInput("the case has no [time]; a chart needs runs in time")
    output, end = case["time"].get("output", []), case["time"]["end"]
    return sorted({float(t) for t in [*output, end] if t > 0})


def truth_of(chart, times, runs, own):
    """The reference for errors. Raises BadInput if there is none."""
    reference = chart.reference
    if reference.values:
        return Truth(dict(zip(times, reference.values)), reference.E_ref, reference.known_to, reference.source)
    if reference.result:
        return truth_of_result(reference.result, chart.quantity, times)
    whole = [run for run in runs if run.reached(times) and (own is None or run.key == own.key)]
    if not whole and any(run.finished and not run.values for run in runs):
        raise BadInput(f"no run has a series {chart.quantity} at the times of the chart")
    if not whole:
        raise BadInput("no run reached the end of the chart, so errors have no reference")
    best = min(whole, key=lambda run: (run.stated_error or float("inf"), -run.cpu_s))
    scale = best.E_ref if "energy" in chart.quantity else max(map(abs, best.values.values()))
    return Truth({time: best.values[time] for time in times}, scale or 1.0, best.stated_error, "own finest run", best.key)


def truth_of_result(path, quantity, times):
    """Raises BadInput."""
    result = read_result(str(path))
    if quantity not in result.series:
        raise BadInput(f"{path}: has no series {quantity}")
    at = dict(zip(result.series["time"], result.series[quantity]))
    missing = [time for time in times if time not in at]
    if missing:
        listed = ", ".join(f"{time:g}" for time in missing)
        raise BadInput(f"{path}: has no row at t = {listed}: compute it with these output times")
    values = {time: float(at[time]) for time in times}
    scale = float(result.about.get("E_ref", 0)) if "energy" in quantity else max(map(abs, values.values()))
    return Truth(values, scale or 1.0, float(result.about.get("estimated_error", 1)), str(path))


def error_of(run, truth):
    """The largest error at the times that the run reached; None if it reached none."""
    errors = [abs(run.values[time] - value) / truth.scale for time, value in truth.values.items() if time in run.values]
    return max(errors, default=None)


def known_error(run, truth):
    """Error of a finished run: at least the error of the reference."""
    return max(error_of(run, truth), truth.known_to)


def judge(runs, truth):
    """For the table and the picture: {key: {error, front, chosen_for}}, the front, {target: run or None}. The front are the
    runs for which no other is better in both error and time, cheapest first."""
    compared = [run for run in runs if run.reached(truth.values) and run.key != truth.key]
    front = []
    for run in sorted(compared, key=lambda run: (run.cpu_s, known_error(run, truth))):
        if not front or known_error(run, truth) < known_error(front[-1], truth):
            front.append(run)
    chosen = {target: next((run for run in front if known_error(run, truth) <= target), None) for target in TARGETS}
    judged = {}
    for run in runs:
        error = error_of(run, truth)
        judged[run.key] = {
            "error": "" if error is None else f"{error:.4e}",
            "front": "reference" if run.key == truth.key else front.index(run) + 1 if run in front else "",
            "chosen_for": " ".join(f"{target:.0e}" for target, one in chosen.items() if one is run),
        }
    return judged, front, chosen


def report(named, front, chosen, truth):
    """The front by name, and the settings to choose."""
    yield f"reference: {truth.source}, known to {truth.known_to:.1e}"
    yield "the front, cheapest first:"
    for number, run in enumerate(front, 1):
        yield f"  {number:2}  {known_error(run, truth):.2e}  {run.cpu_s:9.3f} s  {named[run.key]}"
    for target, run in chosen.items():
        yield f"for {target:.0e}: " + (f"{named[run.key]} ({run.cpu_s:.3g} s)" if run else "none reaches it")


def work_precision(chart, options, outputs, program):
    """Runs and draws; False where another rank draws."""
    own = None if chart.reference.set is None else chart.job(Series("reference", chart.reference.set))
    jobs = [own] * bool(own) + chart.jobs()
    first = checked(program, jobs)
    times = chart.times or times_of(first)
    if chart.reference.result:
        truth_of(chart, times, [], own)  # fails before any run
    work = Work(chart, options, outputs, program, times)
    table, every = work.table, len(jobs)
    jobs = work.run(jobs, jobs)
    if options.draw:
        work.tell(f"{len(jobs)} of {every} runs are in {table.path}")
    if not work.draws():
        return False
    runs = list({job.key: table.runs[job.key] for job in jobs}.values())
    try:
        truth = truth_of(chart, times, runs, own)
    except BadInput as error:
        raise Unavailable(f"tubule chart: {error}") from error
    judged, front, chosen = judge(runs, truth)
    table.write(jobs, judged)
    named = {job.key: f"{job.series}: {job.varied}".rstrip(": ") for job in reversed(jobs)}
    say("\n".join(report(named, front, chosen, truth)), sys.stdout)
    chart_draw.work_precision(chart, jobs, table.runs, truth, front, named, outputs, error_of)
    return True


# ---- maps


class Bisection:
    """The largest stable value of a map, assuming that all values below it are stable."""

    def __init__(self, chart, series, against):
        self.chart, self.series, self.against = chart, series, against
        self.values = chart.map.values
        self.low, self.high = -1, len(self.values)  # stable, unstable

    def next(self):
        """The job to run, or None."""
        self.middle = (self.low + self.high) // 2
        return None if self.high - self.low == 1 else self.job(self.middle)

    def job(self, i):
        return self.chart.map_job(self.series, [(self.chart.against, self.against)], self.values[i])

    def take(self, run):
        if run.stable:
            self.low = self.middle
        else:
            self.high = self.middle

    def __str__(self):
        low, high = (f"{self.values[i]:g}" if 0 <= i < len(self.values) else "none" for i in (self.low, self.high))
        return f"{self.series.name}: {self.chart.against} = {self.against:g}: stable up to {low}, unstable from {high}"


def stability_map(chart, options, outputs, program):
    """Runs and draws; False where another rank draws."""
    lines = [Bisection(chart, series, value) for series in chart.series for value in series.vary[chart.against]]
    checked(program, [line.job(i) for line in lines for i in (0, len(line.values) - 1)])
    work, asked = Work(chart, options, outputs, program), []
    while jobs := {job: line for line in lines if (job := line.next())}:
        known = work.run(list(jobs), [*asked, *jobs])
        if not known:
            break
        asked += known
        for job in known:
            jobs[job].take(work.table.runs[job.key])
    if not work.draws():
        return False
    work.table.write(asked)
    say("\n".join(map(str, lines)), sys.stdout)
    chart_draw.stability_map(chart, lines, work.table.runs, outputs)
    return True


def main(options):
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends it as Ctrl-C does
    sys.stdout.reconfigure(errors="backslashreplace")  # names of files may be no text
    try:
        chart, outputs = chart_of(options), outputs_of(options)
        with tempfile.TemporaryDirectory(prefix="tubule-chart-") as folder:
            program = Program(os.environ["TUBULE_PROGRAM"], Path(folder), chart.limit, chart.quantity)
            if (stability_map if chart.map else work_precision)(chart, options, outputs, program):
                say("\n".join(map(str, [*outputs, outputs[0].with_suffix(".csv")])), sys.stdout)
        return 0
    except OSError as error:  # a full disk, no more processes
        raise Unavailable(f"tubule chart: {error}") from error
    except KeyboardInterrupt:
        say("tubule chart: interrupted; run the same command to continue")
        raise
