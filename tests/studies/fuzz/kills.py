"""Runs that are disturbed: killed, interrupted (twice), out of disk space, without streams; then resumed until they end.

After each disturbance the result opens, has every row up to the frame that resuming begins from, and nothing else is left
behind but its lock; at last the run ends as the undisturbed one does."""

import csv
import io
import os
import resource
import signal
import subprocess
import time

import samples
from sandbox import Finding

STUDY = 2
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGKILL, signal.SIGKILL, signal.SIGHUP)
END = None
os.environ["TUBULE_WRITE_SECONDS"] = "0.1"  # so that there is something to lose


def rows(box):
    """The rows as `show` prints them, none before there is a result."""
    if not (box.folder / "case.hdf").exists():
        return []
    shown = box.run("show", "case.hdf", "--csv", statuses=(0,))
    return list(csv.DictReader(io.StringIO(shown.out)))


def kept(box, before):
    """How many of these rows a resumed run has at least: those up to the newest frame, shown with 8 digits."""
    frames = box.run("show", "case.hdf", statuses=(0,)).out.rsplit("\n\n", 1)[-1].splitlines()[1:]
    times = [float(line.split()[1]) for line in frames if len(line.split()) > 1 and line.split()[0].isdigit()]
    newest = max(times, default=-1)
    return sum(float(row["time"]) <= newest * (1 - 1e-6) for row in before)


def prefixed(after, before, n, what):
    if after[:n] != before[:n]:
        raise Finding("rows-lost", f"{what}: of {n} rows that were saved, {len(after)} rows are left or differ")


def signalled(rng, box):
    """Signals at random moments, perhaps a second one at once; the run may also have ended by then."""
    process = box.start("run", "case.toml", "--resume", "--quiet")
    numbers = [rng.choice(SIGNALS)]
    if numbers[0] in (signal.SIGINT, signal.SIGTERM):
        numbers += [rng.choice(SIGNALS[:3])] * rng.choice((0, 1, 5))
    time.sleep(rng.choice((0, 0.02, 0.1, 0.5)) * rng.random())
    for number in numbers:
        process.send_signal(number)
        time.sleep(rng.choice((0, 0.001, 0.02)))
    box.note(f"# {', '.join(n.name for n in numbers)}")
    statuses = (0, 130, *(-n for n in numbers))
    box.judged(process, ("run", *(n.name for n in numbers)), statuses=statuses, limit=30)


def out_of_space(rng, box):
    """No file may grow beyond a random size."""
    size = int(10 ** rng.uniform(0, 6.3))
    box.note(f"# files of at most {size} bytes")

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    box.run("run", "case.toml", "--resume", "--quiet", prepare=limit, statuses=(0, 2, 4), limit=30)


def without_streams(rng, box):
    """Streams that are closed, full, or that nobody reads; the run goes on. Half of the runs are killed."""
    closed = [fd for fd in (0, 1, 2) if rng.random() < 0.4]
    full = [fd for fd in (1, 2) if fd not in closed and rng.random() < 0.5]
    box.note(f"# closed: {closed}, full: {full}")

    def close():
        for fd in full:
            os.dup2(os.open("/dev/full", os.O_WRONLY), fd)
        for fd in closed:
            os.close(fd)

    options = ("--quiet",) if rng.random() < 0.2 else ()
    streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = box.start("run", "case.toml", "--resume", *options, prepare=close, **streams)
    if rng.random() < 0.5:
        time.sleep(rng.random())
        process.kill()
    box.judged(process, ("run without streams",), statuses=(0, 2, 4, -signal.SIGKILL), limit=30)


def unread(rng, box):
    """Pipes whose reader goes away."""
    process = box.start("run", "case.toml", "--resume")
    time.sleep(rng.random() * 0.2)
    process.stdout.close()
    process.stderr.close()
    process.stdout = process.stderr = None
    box.judged(process, ("run into closed pipes",), statuses=(0, 2, 4), limit=30)


def undisturbed(box):
    """The last row of a run that nobody disturbs, to compare with."""
    global END
    with samples.LOCK:
        if END is None:
            box.run("run", "case.toml", "--quiet", statuses=(0,))
            END = rows(box)[-1]
            (box.folder / "case.hdf").unlink()
    return END


def ends_like(box, whole):
    last = rows(box)[-1]
    for name in ("time", "energy", "energy_20", "energy_42", "area", "volume", "r_min", "r_max"):
        if abs(float(last[name]) - float(whole[name])) > samples.SLOW_ERROR * abs(float(whole["energy"])):
            raise Finding("differs", f"{name} ends at {last[name]}, undisturbed at {whole[name]}")
    left = {path.name for path in box.folder.iterdir()} - {"case.toml", "case.hdf", "commands"}
    if left:
        raise Finding("left-behind", f"files left behind: {', '.join(sorted(left))}")


def one(rng, box):
    box.write("case.toml", samples.SLOW)
    whole = undisturbed(box)
    saved, n, disturbances = [], 0, rng.randint(1, 6)
    for _ in range(disturbances):
        disturb = rng.choice((signalled, signalled, signalled, out_of_space, without_streams, unread))
        disturb(rng, box)
        after = rows(box)
        prefixed(after, saved, n, disturb.__name__)
        if after:
            saved, n = after, kept(box, after)
    box.run("run", "case.toml", "--resume", "--quiet", statuses=(0,))
    prefixed(rows(box), saved, n, "the end")
    ends_like(box, whole)
    return f"{disturbances} disturbances"
