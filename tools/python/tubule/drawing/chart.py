"""Error against CPU time of many runs of a case, or a map of its largest stable steps. See `tubule chart --help`."""

import csv
import os
import signal
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

from .chart_file import Reference, Series, assignment, chart_of_case, check, map_option, plain, read_chart, split
from .chart_file import toml_of
from .chart_ranks import ranks_of
from .chart_runs import Program, Runner, Table
from .command_line import BadInput, Unavailable, say

TARGETS = (1e-3, 1e-4, 1e-6)
FORMATS = (".png", ".svg", ".pdf")


@dataclass
class Truth:
    values: dict  # time -> value
    scale: float  # errors are relative to it
    known_to: float  # relative, too
    source: str
    key: str = ""  # of its run


def found(file):
    """The name of a case; of cases/NAME.toml, where there is none here, that beside the installed program or in its sources."""
    places = Path(os.environ["TUBULE_PROGRAM"]).parents[1] / "share/tubule", Path(__file__).resolve().parents[4]
    if not file.startswith("cases/") or os.path.exists(file):
        return file
    return next((str(place / file) for place in places if (place / file).exists()), file)


def chart_of(options):
    """The chart that the file and the options describe, validated. Raises BadInput."""
    if "series" in toml_of(Path(options.file)):
        for name in ("vary", "also", "map"):
            if getattr(options, name):
                raise BadInput(f"{options.file}: is a chart file; --{name} applies only to a case")
        chart = read_chart(options.file, options.study)
    else:
        if not options.vary:
            raise BadInput(f"{options.file}: is a case: it needs --vary, such as --vary discretisation.elements=20,40")
        chart = chart_of_case(options.file, options.vary, options.also)
        chart.map = map_option(options.map) if options.map else None
    chart.sets |= {key: plain(value) for key, value in (assignment(text, "--set") for text in options.set)}
    if options.reference:
        chart.reference = Reference(result=Path(options.reference))
    if options.times:
        chart.times = [plain(text) for text in split(options.times)]
        if not all(type(time) in (int, float) for time in chart.times):
            raise BadInput(f"--times {options.times}: must be numbers, such as 0.05,0.1")
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
    for path in outputs:
        if path.suffix.lower() not in FORMATS:
            raise BadInput(f"{path}: a picture is written as one of {', '.join(FORMATS)}")
        if not path.parent.is_dir():
            raise BadInput(f"{path}: the folder {path.parent} does not exist")
        if not os.access(path.parent, os.W_OK):
            raise BadInput(f"{path}: the folder {path.parent} cannot be written to")
    return outputs


def checked(program, jobs):
    """Validates all cases and the quantity before any run; returns the first case as TOML. Raises BadInput."""
    first = None
    if jobs and (error := program.check_quantity(jobs[0])):
        raise BadInput(error)
    for job in jobs:
        text, error = program.check(job)
        if error:
            raise BadInput(f"{error}\n    in series {job.series!r}: {' '.join(job.sets)}")
        first = first or tomllib.loads(text)
    return first


def times_of(case):
    if "time" not in case:
        raise BadInput("the case has no [time]; a chart needs runs in time")
    output, end = case["time"].get("output", []), case["time"]["end"]
    return sorted({float(t) for t in [*output, end] if t > 0})


# ---- error against CPU time


def truth_of(chart, times, runs, own, program):
    """The reference for errors. Raises BadInput if there is none."""
    reference = chart.reference
    if reference.values:
        return Truth(dict(zip(times, reference.values)), reference.scale, reference.known_to, reference.source)
    if reference.result:
        return truth_of_result(reference.result, chart.quantity, times, program)
    whole = [run for run in runs if run.finished and all(time in run.values for time in times)]
    if reference.sets is not None:
        whole = [run for run in whole if run.key == own.key]
    if not whole and any(run.finished and not run.values for run in runs):
        raise BadInput(f"no run has a series {chart.quantity} at the times of the chart")
    if not whole:
        raise BadInput("no run reached the end of the chart, so errors have no reference")
    best = min(whole, key=lambda run: (run.stated_error or float("inf"), -run.cpu_s))
    scale = best.E_ref if "energy" in chart.quantity else max(map(abs, best.values.values()))
    return Truth({time: best.values[time] for time in times}, scale or 1.0, best.stated_error, "own finest run", best.key)


def truth_of_result(path, quantity, times, program):
    """Raises BadInput."""
    from .results import read_result

    result = read_result(str(path))
    if quantity not in result.series:
        raise BadInput(f"{path}: has no series {quantity}")
    at = dict(zip(result.series["time"], result.series[quantity]))
    missing = [time for time in times if time not in at]
    if missing:
        listed = ", ".join(f"{time:g}" for time in missing)
        raise BadInput(f"{path}: has no row at t = {listed}: compute it with these output times")
    values = {time: float(at[time]) for time in times}
    about = result.about
    scale = float(about.get("E_ref", 0)) if "energy" in quantity else max(map(abs, values.values()))
    return Truth(values, scale or 1.0, float(about.get("estimated_error", 1)), str(path))


def error_of(run, truth):
    """The largest error at the times that the run reached; None if it reached none."""
    errors = [abs(run.values[time] - value) / truth.scale for time, value in truth.values.items() if time in run.values]
    return max(errors, default=None)


def known_error(run, truth):
    """Error of a finished run: at least the error of the reference."""
    return max(error_of(run, truth), truth.known_to)


def front_of(runs, truth):
    """Runs for which no other is better in both error and time, cheapest first."""
    front = []
    for run in sorted(runs, key=lambda run: (run.cpu_s, known_error(run, truth))):
        if not front or known_error(run, truth) < known_error(front[-1], truth):
            front.append(run)
    return front


def judge(jobs, runs, truth):
    """For the table and the picture: {key: {error, front, chosen_for}}, the front, {target: run or None}."""
    whole = [run for run in runs if run.finished and all(time in run.values for time in truth.values)]
    compared = [run for run in whole if run.key != truth.key]
    front = front_of(compared, truth)
    chosen = {}
    for target in TARGETS:
        enough = [run for run in front if known_error(run, truth) <= target]
        chosen[target] = min(enough, key=lambda run: run.cpu_s) if enough else None
    judged = {}
    for run in runs:
        error = error_of(run, truth)
        judged[run.key] = {
            "error": "" if error is None else f"{error:.4e}",
            "front": "reference" if run.key == truth.key else front.index(run) + 1 if run in front else "",
            "chosen_for": " ".join(f"{target:.0e}" for target, one in chosen.items() if one is run),
        }
    return judged, front, chosen


def report(jobs, front, chosen, truth):
    """The front by name, and the settings to choose."""
    named = {}
    for job in jobs:
        named.setdefault(job.key, f"{job.series}: {' '.join(job.told)}".rstrip(": "))
    lines = [f"reference: {truth.source}, known to {truth.known_to:.1e}", "the front, cheapest first:"]
    for number, run in enumerate(front, 1):
        lines.append(f"  {number:2}  {known_error(run, truth):.2e}  {run.cpu_s:9.3f} s  {named[run.key]}")
    for target, run in chosen.items():
        lines.append(f"for {target:.0e}: " + (f"{named[run.key]} ({run.cpu_s:.3g} s)" if run else "none reaches it"))
    return lines, named


def work_precision(chart, options, outputs, program, tell):
    jobs = chart.jobs()
    own = None
    if chart.reference.sets is not None:
        own = chart.job(Series("reference", chart.reference.sets), [])
        jobs.insert(0, own)
    first = checked(program, jobs)
    times = chart.times or times_of(first)
    if chart.reference.result:
        truth_of(chart, times, [], own, program)  # fails before any run
    table = open_table(chart, options, outputs, times)
    ranks = join_ranks(options, table)
    if options.draw:
        every = len(jobs)
        jobs = [job for job in jobs if job.key in table.runs]
        tell(f"{len(jobs)} of {every} runs are in {table.path}")
    else:
        Runner(program, table, jobs, options.jobs, chart.repeats, tell, ranks).run(jobs)
    if not draws(ranks):
        return None
    runs = list({job.key: table.runs[job.key] for job in jobs}.values())
    try:
        truth = truth_of(chart, times, runs, own, program)
    except BadInput as error:
        raise Unavailable(f"tubule chart: {error}") from error
    judged, front, chosen = judge(jobs, runs, truth)
    table.write(jobs, judged)
    lines, named = report(jobs, front, chosen, truth)
    say("\n".join(lines), sys.stdout)
    from . import chart_draw

    chart_draw.style.apply()
    chart_draw.work_precision(chart, jobs, table.runs, truth, front, named, outputs, error_of)
    return 0


# ---- maps


class Bisection:
    """The largest stable value of a map, assuming that all values below it are stable."""

    def __init__(self, chart, series, against):
        self.chart, self.series, self.against = chart, series, against
        self.values = chart.map.values
        self.low, self.high = -1, len(self.values)  # stable, unstable

    def next(self):
        """The job to run, or None."""
        if self.high - self.low == 1:
            return None
        self.middle = (self.low + self.high) // 2
        return self.job(self.middle)

    def job(self, i):
        return self.chart.map_job(self.series, [(self.chart.against, self.against)], self.values[i])

    def take(self, run):
        if run.stable:
            self.low = self.middle
        else:
            self.high = self.middle

    @property
    def limits(self):
        """Largest stable and smallest unstable value, or None."""
        return (
            self.values[self.low] if self.low >= 0 else None,
            self.values[self.high] if self.high < len(self.values) else None,
        )


def stability_map(chart, options, outputs, program, tell):
    lines = [Bisection(chart, series, value) for series in chart.series for value in series.vary[chart.against]]
    checked(program, [line.job(i) for line in lines for i in (0, len(line.values) - 1)])
    table = open_table(chart, options, outputs, [])
    ranks = join_ranks(options, table)
    asked = []
    while going := [(line, job) for line in lines if (job := line.next())]:
        if options.draw:
            going = [(line, job) for line, job in going if job.key in table.runs]
            if not going:
                break
        asked += [job for _, job in going]
        Runner(program, table, asked, options.jobs, 1, tell, ranks).run([job for _, job in going])
        for line, job in going:
            line.take(table.runs[job.key])
    if not draws(ranks):
        return None
    table.write(asked)
    for line in lines:
        low, high = line.limits
        say(f"{line.series.name}: {chart.against} = {line.against:g}: "
            f"stable up to {'none' if low is None else f'{low:g}'}, "
            f"unstable from {'none' if high is None else f'{high:g}'}", sys.stdout)  # fmt: skip
    from . import chart_draw

    chart_draw.style.apply()
    chart_draw.stability_map(chart, lines, asked, table.runs, outputs)
    return 0


def open_table(chart, options, outputs, times):
    path = outputs[0].with_suffix(".csv")
    if path.exists() and not path.is_file():
        raise BadInput(f"{path}: is no file, so the data of the chart cannot be written there; choose another -o")
    try:
        return Table(path, chart.quantity, times, options.again)
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, csv.Error) as error:
        raise BadInput(f"{path}: is no table of a chart ({error}); move it or choose another -o") from error


def join_ranks(options, table):
    """The Ranks of this process, or None. What a killed launch has found is in the table then."""
    ranks = None if options.draw else ranks_of(os.environ, table.path, table.read)
    if ranks:
        if not options.again:
            table.runs = ranks.found_before() | table.runs
        options.quiet = options.quiet or ranks.rank > 0
    return ranks


def draws(ranks):
    """Whether this process draws, now that all runs are known."""
    if ranks:
        ranks.leave()
    return not ranks or ranks.rank == 0


def draw_chart(options):
    """The exit status. Raises BadInput."""

    def tell(words):
        if not options.quiet:
            say(words)

    chart, outputs = chart_of(options), outputs_of(options)
    with tempfile.TemporaryDirectory(prefix="tubule-chart-") as folder:
        program = Program(os.environ["TUBULE_PROGRAM"], Path(folder), chart.limit, chart.quantity)
        draw = stability_map if chart.map else work_precision
        status = draw(chart, options, outputs, program, tell)  # None: another rank draws
    if status == 0:
        say("\n".join(map(str, [*outputs, outputs[0].with_suffix(".csv")])), sys.stdout)
    return status or 0


def main(options):
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends it as Ctrl-C does
    sys.stdout.reconfigure(errors="backslashreplace")  # names of files may be no text
    options.file = found(options.file)
    try:
        return draw_chart(options)
    except OSError as error:  # a full disk, no more processes
        raise Unavailable(f"tubule chart: {error}") from error
    except KeyboardInterrupt:
        say("tubule chart: interrupted; run the same command to continue")
        raise
