"""Command lines that nobody would write: any subcommand with any of its options and values, as --help lists them, on files
that are what they should be, or not; with streams that are closed, and signals at random times, twice.

No crash, no hang, no words from the inside; what is refused (2) changes no file."""

import functools
import os
import re
import signal
import subprocess
import time

from samples import SLOW, TUBE, samples
from sandbox import Finding

STUDY = 40
VALUES = ("0", "1", "-1", "2", "3.5", "1e300", "nan", "-inf", "99999999999999999999", "", " ", "x", "-", "--", "=", ",", ":", "0,1", "1:2", "0:1:3", "0:1:99999999")
WORDS = (
    "energy.k42=0.1", "energy.k42=0,0.1", "energy.k42=0:0.1:2", "energy.k42=1:2:3:log", "energy=1", "=", "time.end=1e-3", "time.end=nan", "outcome",
    "pinched", "all", "energy", "energy=1e-3", "shape=1", "1,1", "2", "-1", "-1:-1", "x=0", "picture.svg", "picture.png", "picture.pdf", "profiles", "elements=40,80",
)  # fmt: skip
STREAMS = ("closed", "/dev/full", "/dev/null", "pipe")
HEAVY = ("plot", "chart", "confirm", "scan")  # several seconds


@functools.cache
def options(program):
    """The options of each subcommand with whether they take a value, as --help has them."""

    def asked(*arguments):
        return subprocess.run([program, *arguments, "--help"], capture_output=True, text=True, check=True).stdout

    names = re.findall(r"^  ([a-z]+) ", asked().split("Subcommands:")[1], re.M)
    listed = {}
    for name in names:
        listed[name] = [(option.split(",")[-1], takes) for option, takes in re.findall(r"^  (-\S+) ?([A-Z]+)?", asked(name), re.M)]
    return listed


def files(box):
    """A folder with one of everything; the names."""
    for sample in samples(box.program):
        box.write(f"{sample.kind}.hdf", sample.result)
        box.write(f"{sample.kind}.toml", sample.case)
    box.write("slow.toml", SLOW)
    box.write("half.hdf", samples(box.program)[0].result[:5000])
    box.write("empty.toml", "")
    box.write("text.hdf", TUBE)
    box.write("points.csv", "energy.k42\n0.1\n0.2\n")
    (box.folder / "folder.toml").mkdir()
    os.mkfifo(box.folder / "fifo")
    (box.folder / "round.toml").symlink_to("round.toml")
    return sorted(path.name for path in box.folder.iterdir() if path.name != "commands") + ["none.toml", "/dev/null", "/dev/zero", "../none/x.hdf", "a\nb.toml", "\udcff.toml"]


def value(rng, names):
    return rng.choice(rng.choice((VALUES, WORDS, WORDS, names)))


def line(rng, program, names):
    """A subcommand with some of its options: (name, arguments)."""
    listed = options(program)
    name = rng.choice([n for n in listed if n not in HEAVY] * 3 + list(listed))
    suited = [n for n in names if n.endswith(".toml" if name in ("run", "check", "equilibrium", "scan", "chart") else ".hdf")]
    arguments = [rng.choice(suited if rng.random() < 0.8 else names) for _ in range(2 if name == "compare" else 1)]
    for _ in range(rng.choice((0, 1, 1, 2, 3))):
        option, takes = rng.choice(listed[name])
        arguments += [option, value(rng, names)] if takes or rng.random() < 0.02 else [option]
    if rng.random() < 0.05:
        rng.shuffle(arguments)
    return name, arguments


def prepared(rng):
    """What the child does to its streams, and what it is called."""
    streams = {fd: rng.choice(STREAMS) for fd in (0, 1, 2) if rng.random() < 0.5}

    def prepare():
        for fd, what in streams.items():
            if what == "closed":
                os.close(fd)
            elif what != "pipe":
                os.dup2(os.open(what, os.O_RDWR), fd)

    return streams, prepare


def contents(box):
    return {path.name: path.stat().st_size for path in box.folder.iterdir() if path.name not in ("commands", "round.toml")}


def disturbed(rng, box, process):
    time.sleep(rng.choice((0, 0.01, 0.1, 0.5)) * rng.random())
    numbers = [rng.choice((signal.SIGINT, signal.SIGTERM)) for _ in range(rng.choice((1, 2, 2, 5)))]
    for number in numbers:
        process.send_signal(number)
        time.sleep(rng.choice((0, 0.001, 0.02, 0.2)))
    box.note(f"# {', '.join(n.name for n in numbers)}")
    return (130, *(-n for n in numbers))


def one(rng, box):
    names = files(box)
    name, arguments = line(rng, box.program, names)
    streams, prepare = prepared(rng) if rng.random() < 0.3 else ({}, lambda: None)
    box.note(f"# streams: {streams}")
    before = contents(box)
    try:
        process = box.start(name, *arguments, prepare=prepare)
    except ValueError:  # no such command line can be: a zero byte
        return "no such line"
    statuses = (0, 1, 2, 3, 4, 5)
    # Python shows where it was when it is interrupted while it starts.
    signals = rng.random() < 0.3 and name not in ("plot", "view", "export", "chart") and "--plot" not in arguments
    if signals:
        statuses += disturbed(rng, box, process)
    done = box.judged(process, (name, *arguments), statuses=statuses, limit=10 if signals else 60)
    if done.status == 2 and not streams:
        if contents(box) != before:
            raise Finding("written", f"{name} {arguments}: refused, yet files changed: {set(contents(box).items()) ^ set(before.items())}")
        if not done.err and not ("--json" in arguments and done.out):  # which says what is wrong
            raise Finding("silent", f"{name} {arguments}: refused without a word")
    for result in box.folder.glob("*.hdf"):
        if before.get(result.name) != result.stat().st_size and result.is_file():
            box.run("show", result.name, statuses=(0,))
    return f"exit {done.status}"
