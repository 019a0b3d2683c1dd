"""The description of a chart, from a chart file (TOML, docs/charts.md) or from options. Standard library only."""

import difflib
import itertools
import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

from .chart_runs import Job, value_text
from .command_line import BadInput
from .labels import flatten

MOST_RUNS = 2000
LARGEST_FILE = 2**20  # bytes


@dataclass
class Series:
    """Runs with every combination of values of the keys in `vary`; of several with one name, a line has all runs."""

    name: str
    sets: dict = field(default_factory=dict)
    vary: dict = field(default_factory=dict)  # key -> list of values


@dataclass
class Reference:
    """One of: a result, a run of its own, numbers (with what the errors are relative to, and how well they are known);
    nothing: the run of the chart with the smallest estimated error."""

    result: Path | None = None
    set: dict | None = None
    values: list | None = None
    E_ref: float = 0.0
    known_to: float = 0.0
    source: str = ""


@dataclass
class Map:
    """The largest stable value of `key`, by bisection between values on a logarithmic grid."""

    key: str
    low: float
    high: float
    per_decade: int = 6
    steps: int | None = None  # of each run; else to the end of the case

    @property
    def values(self):
        """The values, rounded to three digits."""
        count = math.ceil(self.per_decade * math.log10(self.high / self.low) - 1e-9) + 1
        return [float(f"{self.low * 10 ** (i / self.per_decade):.3g}") for i in range(count)]


@dataclass
class Chart:
    path: Path
    case: Path
    title: str = ""
    quantity: str = "energy"
    times: list | None = None  # else those of the case
    limit: float = 600.0
    repeats: int = 1
    set: dict = field(default_factory=dict)
    series: list = field(default_factory=list)
    reference: Reference = field(default_factory=Reference)
    map: Map | None = None

    @property
    def against(self):
        """The key on the horizontal axis of a map."""
        return list(self.series[0].vary)[-1]

    def job(self, series, varied=(), more=()):
        """`varied`: (key, value) that distinguish this run from others of its series."""
        sets = dict(self.set)
        if self.times and not self.map:
            sets |= {"time.end": float(self.times[-1]), "time.output": [float(t) for t in self.times[:-1]]}
        sets |= series.sets | dict(varied) | dict(more)
        words = " ".join(f"{key.rpartition('.')[2]}={value_text(value)}" for key, value in varied)
        return Job(series.name, self.case, tuple(f"{key}={value_text(value)}" for key, value in sets.items()), words)

    def jobs(self):
        """Jobs of a chart of error against time; maps choose theirs as they proceed."""
        return [self.job(series, list(zip(series.vary, values))) for series in self.series
                for values in itertools.product(*series.vary.values())]  # fmt: skip

    def map_job(self, series, varied, value):
        more = {"time.end": float(f"{self.map.steps * value:.6g}"), "time.output": []} if self.map.steps else {}
        return self.job(series, [*varied, (self.map.key, value)], more.items())


# ---- a chart file: what each key may be, and the words for it


def is_number(value):
    return type(value) in (int, float) and math.isfinite(value)


TEXT = lambda value: isinstance(value, str), "must be text"
POSITIVE = lambda value: is_number(value) and value > 0, "must be a number above 0"
COUNT = lambda value: type(value) is int and value > 0, "must be an integer above 0"
NUMBERS = lambda value: isinstance(value, list) and value and all(map(is_number, value)), "must be a list of numbers"
SETS = lambda value: isinstance(value, dict), "must be a table of case keys, such as { discretisation.order = 3 }"
FLAG = lambda value: type(value) is bool, "must be true or false"
TABLE = lambda value: isinstance(value, dict), "must be a table"
TABLES = lambda value: isinstance(value, list) and value, "must be tables [[series]]"
CHART = {"title": TEXT, "case": TEXT, "quantity": TEXT, "times": NUMBERS, "limit": POSITIVE, "repeats": COUNT, "set": SETS,
         "reference": TABLE, "map": TABLE, "series": TABLES}  # fmt: skip
SERIES = {"name": TEXT, "set": SETS, "vary": SETS, "study": FLAG}
REFERENCE = {"result": TEXT, "set": SETS, "values": NUMBERS, "E_ref": POSITIVE, "known_to": POSITIVE, "source": TEXT}
MAP = {"key": TEXT, "from": POSITIVE, "to": POSITIVE, "per_decade": COUNT, "steps": COUNT}


def checked(path, table, where, kinds, required=()):
    """A table of the file, sets and vary with dotted keys. Raises BadInput with the place of what is wrong."""
    place = f"{path}: {where}." if where else f"{path}: "
    if not isinstance(table, dict):
        raise BadInput(f"{path}: {where}: must be a table")
    for key in required:
        if key not in table:
            raise BadInput(f"{place}{key}: is missing")
    for key, value in table.items():
        if key not in kinds:
            near = difflib.get_close_matches(key, kinds, 1)
            meant = f"; did you mean {near[0]!r}?" if near else ""
            raise BadInput(f"{place}{key}: unknown key; allowed: {', '.join(kinds)}{meant}")
        is_one, words = kinds[key]
        if not is_one(value):
            raise BadInput(f"{place}{key}: {words}, not {value!r}")
    return {key: flatten(value) if kinds[key] is SETS else value for key, value in table.items()}


def toml_of(path):
    """Raises BadInput."""
    try:
        if path.exists() and not path.is_file():
            raise BadInput(f"{path}: is a directory, a pipe or a device, not a file")
        if path.exists() and path.stat().st_size > LARGEST_FILE:
            raise BadInput(f"{path}: is larger than {LARGEST_FILE // 2**20} MB, the most that is read")
        if path.read_bytes()[:4] == b"\x89HDF":
            raise BadInput(f"{path}: is a result: a chart runs a case, or what a chart file says")
        return tomllib.loads(path.read_text())
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{path}: is not TOML: {error}") from error


def read_chart(path, study):
    """The chart of a file, without the series marked as a study unless requested. Raises BadInput."""
    given = checked(path, toml_of(path), "", CHART, ("case", "series"))
    given["case"] = path.parent / given["case"]
    series = [read_series(path, table, i) for i, table in enumerate(given["series"])]
    given["series"] = [one for one, is_study in series if study or not is_study]
    if "reference" in given:
        given["reference"] = read_reference(path, given["reference"])
    if "map" in given:
        read = checked(path, given["map"], "map", MAP, ("key", "from", "to"))
        given["map"] = Map(read.pop("key"), read.pop("from"), read.pop("to"), **read)
    return Chart(path, **given)


def read_series(path, table, index):
    """And whether it is a study."""
    given = checked(path, table, f"series.{index}", SERIES)
    sets, vary = given.get("set", {}), given.get("vary", {})
    for name, values in vary.items():
        if not isinstance(values, list) or not values:
            raise BadInput(f"{path}: series.{index}.vary.{name}: must be a list of values, not {values!r}")
    return Series(given.get("name") or words(sets), sets, vary), given.get("study", False)


def read_reference(path, table):
    given = checked(path, table, "reference", REFERENCE)
    kinds = [key for key in ("result", "set", "values") if key in given]
    if len(kinds) != 1:
        raise BadInput(f"{path}: reference: needs one of result, set, values, not {' and '.join(kinds) or 'none'}")
    if "values" in given and "E_ref" not in given:
        raise BadInput(f"{path}: reference.E_ref: is missing: what the errors are relative to")
    return Reference(**given | ({"result": path.parent / given["result"]} if "result" in given else {}))


# ---- options


def split(text):
    """Splits at commas outside brackets."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def plain(text):
    """A TOML value; a bare word is a string."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return text


def assignment(text, option):
    key, equals, value = text.partition("=")
    if not (key and equals and value):
        raise BadInput(f"{option} {text}: must be key=value, such as discretisation.order=3")
    return key, value


def words(sets):
    """The name of a series without one."""
    return ", ".join(f"{key.rpartition('.')[2]} = {value_text(value)}" for key, value in sets.items()) or "settings of the case"


def chart_of_case(path, varied, also):
    """Lines: all combinations of the varied keys except the last, and those of --also. Raises BadInput."""
    keys = {}
    for text in varied:
        key, values = assignment(text, "--vary")
        keys[key] = [plain(value) for value in split(values)]
        if "" in keys[key]:
            raise BadInput(f"--vary {text}: a value is empty")
    *outer, last = keys
    lines = [dict(zip(outer, values)) for values in itertools.product(*(keys[key] for key in outer))]
    lines += [{k: plain(v) for k, v in (assignment(one, "--also") for one in split(text))} for text in also]
    return Chart(path, path, series=[Series(words(sets), sets, {last: keys[last]}) for sets in lines])


def map_option(text):
    key, values = assignment(text, "--map")
    numbers = [plain(value) for value in values.split(":")]
    if len(numbers) not in (2, 3) or not all(is_number(n) and n > 0 for n in numbers):
        raise BadInput(f"--map {text}: must be key=from:to or key=from:to:n, n values per decade, all above 0")
    return Map(key, numbers[0], numbers[1], int(numbers[2]) if len(numbers) == 3 else 6, 60)


def check(chart):
    """Checks that involve several keys. Raises BadInput."""
    path, times = chart.path, chart.times
    if not chart.case.is_file():
        raise BadInput(f"{path}: case: {chart.case}: no such file")
    if not chart.series:
        raise BadInput(f"{path}: every series is a study; add --study")
    if times and (times[0] <= 0 or any(a >= b for a, b in zip(times, times[1:]))):
        raise BadInput(f"{path}: times: must be growing numbers above 0, not {times}")
    if chart.reference.values and (not times or len(times) != len(chart.reference.values)):
        raise BadInput(f"{path}: reference.values: needs times, one for each of its {len(chart.reference.values)} values")
    if not chart.map:
        if (count := len(chart.jobs())) > MOST_RUNS:
            raise BadInput(f"{path}: {count} runs are too many for a chart ({MOST_RUNS} at most): vary less at once")
        return
    if not chart.map.low < chart.map.high:
        raise BadInput(f"{path}: map: from = {chart.map.low:g} must be below to = {chart.map.high:g}")
    for series in chart.series:
        if len(series.vary) != 1 or list(series.vary) != [chart.against]:
            raise BadInput(f"{path}: a map needs one key to vary, the same in all series ({series.name})")
        if not all(is_number(value) and value > 0 for value in series.vary[chart.against]):
            raise BadInput(f"{path}: {chart.against}: a map needs numbers above 0, not {series.vary[chart.against]}")
