"""Case files that somebody got wrong: those of cases/ with changed text and changed values.

`check` and a short `run` must neither crash nor hang, `check` refuses with file, line and column, what it accepts comes out
of its own output unchanged, `run` does not refuse it, and no number of the result is nan or inf."""

import copy
import functools
import json
import re
import tomllib
from pathlib import Path

import toml
from sandbox import Finding

STUDY = 30
CASES = Path(__file__).resolve().parents[3] / "cases"
LIMIT = 0.5  # seconds that a run is given, in the case
PLACED = re.compile(r"(case\.toml:(\d+):(\d+): |--set )")
PIECES = ("[", "]", "[[", "{", "}", "=", '"', "'", '"""', ",", ".", "\n", "\r", "\t", "#", "\\", "\0", "e", "-", "+", "_", "nan", "inf", "1e999", "0x", "\ufeff", "\u00e9", "true")


@functools.cache
def sources():
    texts = [path.read_text() for path in sorted(CASES.glob("*.toml"))]
    return [(text, tomllib.loads(text)) for text in texts]


def broken_text(rng, text, encoding="utf-8"):
    """A few changes of characters: as typing, copying and broken disks make them."""
    raw = bytearray(text.encode(encoding))
    for _ in range(rng.choice((1, 1, 2, 5))):
        at = rng.randrange(len(raw) + 1)
        span = rng.choice((1, 1, 5, 40))
        match rng.choice(("piece", "byte", "cut", "again", "deep", "end")):
            case "piece":
                raw[at:at] = rng.choice(PIECES).encode()
            case "byte":
                raw[at:at + 1] = bytes([rng.randrange(256)])
            case "cut":
                del raw[at:at + span]
            case "again":
                raw[at:at] = raw[at:at + span] * rng.choice((1, 3, 50))
            case "deep":
                raw[at:at] = rng.choice((b"[", b"{a=", b"a.", b"'''", b"#")) * rng.choice((10, 300, 3000))
            case "end":
                del raw[at:]
    return bytes(raw)


def changed_values(rng, table):
    """Most often a case that still means something, with other numbers."""
    table = copy.deepcopy(table)
    for _ in range(rng.choice((1, 1, 2, 3, 6))):
        if table:
            toml.bend(rng, table) if rng.random() < 0.9 else toml.change(rng, table)
    return toml.dump(table).encode("utf-8", "surrogateescape")


def override(rng, table):
    """--set of a key that is there, or nearly, to a value that fits, or not."""
    path = ".".join(map(str, rng.choice(list(toml.places(table)))))
    if rng.random() < 0.2:
        path = rng.choice((path + ".x", "." + path, path + ".0", path[:-1], "shape..x", path + ".", "a" + ".a" * 300))
    other = rng.choice((*toml.NUMBERS, *toml.NO_NUMBERS))
    return f"--set={path}={rng.choice((toml.value(other), 'x', '=', '', '1e', '[1'))}"


def made(rng):
    """A case as bytes, and what --set adds."""
    text, table = rng.choice(sources())
    contents = broken_text(rng, text) if rng.random() < 0.15 else changed_values(rng, table)
    return contents, [override(rng, table)] if rng.random() < 0.15 else []


def refusal(done, contents):
    """Every refusal says where: a place that is in the file."""
    place = PLACED.match(done.err)
    if not place:
        raise Finding("no-place", f"refused without file, line and column: {done.err[:500]!r}")
    if place[2] and not 1 <= int(place[2]) <= contents.count(b"\n") + 1:
        raise Finding("no-place", f"refused at a line that the file lacks: {done.err[:500]!r}")
    return "refused"


def settled(box, done, sets):
    """What `check` prints is a case, and `check` prints it again."""
    if sets:
        return
    box.write("again/case.toml", done.out)
    for folder in ("meshes", "profiles"):
        (box.folder / "again" / folder).symlink_to(CASES / folder)
    again = box.run("check", "--quick", "again/case.toml", statuses=(0, 2))
    if again.status != 0 or again.out.split("\n", 1)[1] != done.out.split("\n", 1)[1]:
        raise Finding("no-fixed-point", f"check of what check prints differs:\n{again.err[:500]}")


def no_number_is_lost(box, result):
    """`show` reads the result, and every number of it is one."""
    for line in box.run("show", result, "--csv", statuses=(0,)).out.splitlines()[1:]:
        if re.search(r"nan|inf", line):
            raise Finding("nan", f"a row of the result: {line}")
    shown = box.run("show", result, "--json", statuses=(0,)).out

    def refuse(word):
        raise Finding("nan", f"show --json prints {word}")

    json.loads(shown, parse_constant=refuse)


def one(rng, box):
    contents, sets = made(rng)
    case = box.write("case.toml", contents)
    for folder in ("meshes", "profiles"):
        (box.folder / folder).symlink_to(CASES / folder)
    checked = box.run("check", "--quick", case.name, *sets, statuses=(0, 2))
    if checked.status == 2:
        return refusal(checked, contents)
    settled(box, checked, sets)
    sets = [*sets, f"--set=time.limit={LIMIT}"]
    if box.run("check", "--quick", case.name, *sets, statuses=(0, 2)).status == 2:
        return "without time.limit"
    ran = box.run("run", case.name, *sets, "--overwrite", "-o", "case.hdf")
    if "must be defined on the initial shape" in ran.err:
        return "energy undefined"  # `--quick` computes no curvatures
    if ran.status == 2:
        raise Finding("run-refuses", f"check accepts, run does not: {ran.err[:500]}")
    if ran.seconds > 20 + 2 * LIMIT:
        raise Finding("overrun", f"time.limit = {LIMIT}, ended after {ran.seconds:.1f} s")
    if ran.status == 5 and "before the first state was computed" in ran.err:
        return "no state in time"  # and so no result
    no_number_is_lost(box, "case.hdf")
    return f"exit {ran.status}"
