"""What the fuzzers share: a folder for one case, in which the program runs within bounds and is looked at."""

import os
import re
import resource
import shlex
import signal
import subprocess
import time
from dataclasses import dataclass

MEMORY = 8 << 30  # bytes that the program may ask for
EXIT_STATUSES = (0, 2, 3, 4, 5)  # docs/command.md; 1 and 130 have to be asked for
# What only the inside of the program would say: no user can do anything with it.
INTERNALS = re.compile(
    rb"Traceback \(most recent|terminate called|Assertion|AddressSanitizer|runtime error:|bad_alloc|std::|vector::|map::at"
    rb"|basic_string|filesystem error|HDF5 error|H5[A-Z][a-z]\w+\("
)


class Finding(Exception):
    """A fault of the program: its kind in a word, as the counts list it, and what happened."""

    def __init__(self, kind, text):
        super().__init__(f"{kind}: {text}")
        self.kind = kind


@dataclass
class Done:
    """A process that has ended: exit status (-N: by signal N), stdout, stderr, seconds."""

    status: int
    out: str
    err: str
    seconds: float


class Sandbox:
    """The folder of one case, kept when there is a finding. Every command is written to `commands`, to be run again by hand."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        self.sanitized = is_sanitized(program)
        folder.mkdir(parents=True)

    def write(self, name, contents):
        """A file of the sandbox, of text or bytes; its path."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(contents if isinstance(contents, bytes) else contents.encode("utf-8", "surrogateescape"))
        return path

    def note(self, line):
        with open(self.folder / "commands", "a", encoding="utf-8", errors="surrogateescape") as file:
            file.write(line + "\n")

    def start(self, *arguments, program=None, prepare=lambda: None, **options):
        """The program, or another one, in this folder, not waited for. `prepare` runs in the child, before the program."""

        def begin():
            if not self.sanitized:
                resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            prepare()

        command = [str(program or self.program), *map(str, arguments)]
        self.note(shlex.join(command))
        options = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        return subprocess.Popen(command, cwd=self.folder, preexec_fn=begin, env=environment, **options)

    def run(self, *arguments, statuses=EXIT_STATUSES, limit=60.0, **options):
        """Runs the program to its end. A crash, a hang (see ended()), an exit status that is not among `statuses`, and
        words from the inside of the program are findings."""
        return self.judged(self.start(*arguments, **options), arguments, statuses, limit)

    def judged(self, process, what, statuses=EXIT_STATUSES, limit=60.0):
        began = time.monotonic()
        what = shlex.join(map(str, what))[:300]
        ending = ended(process, limit * (10 if self.sanitized else 1))
        if ending is None:
            process.kill()
            process.communicate()
            raise Finding("hang", f"{what} runs for more than {limit} s")
        out, err = (stream or b"" for stream in ending)
        done = Done(process.returncode, text(out), text(err), time.monotonic() - began)
        said = done.out[-500:] + done.err[-2000:]
        if done.status < 0 and done.status not in statuses:
            raise Finding("crash", f"{what}: {signal.Signals(-done.status).name}\n{said}")
        if found := INTERNALS.search(err) or INTERNALS.search(out):
            raise Finding("internals", f"{what} says {text(found[0])!r}, exit status {done.status}\n{said}")
        if done.status not in statuses:
            raise Finding("exit-status", f"{what}: exit status {done.status}\n{said}")
        return done


def ended(process, limit):
    """What the process wrote, or None if it hangs: it has used more than `limit` seconds of a processor, or none of it
    for so long. Other work on the machine then makes no finding."""
    used, used_at = 0, time.monotonic()
    while True:
        try:
            return process.communicate(timeout=1)
        except subprocess.TimeoutExpired:
            now = processor_seconds(process.pid)
            if now > used:
                used, used_at = now, time.monotonic()
            if used > limit or time.monotonic() - used_at > limit:
                return None


def processor_seconds(pid):
    """CPU seconds of a process and of its children that have ended."""
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
            fields = file.read().rpartition(")")[2].split()
    except FileNotFoundError:
        return 0
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def text(raw):
    return raw.decode("utf-8", "surrogateescape")


def is_sanitized(program, known={}):
    """A sanitized program reserves more addresses than any limit of memory, and is slower."""
    if program not in known:
        known[program] = b"__asan_init" in program.read_bytes()
    return known[program]
