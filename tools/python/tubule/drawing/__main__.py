"""The scripts of this folder, or of another one: python3 drawing NAME ARGUMENT..., python3 drawing docs/figures/NAME.py ARGUMENT...

The package tubule around this folder is not imported, for it needs its compiled part, and pictures do not.
"""

import functools
import importlib
import os
import signal
import sys
import types
from pathlib import Path

EXIT_INTERRUPTED = 130


class EndedByInterrupts:
    """Ctrl-C ends the process at once, without a word: for imports, where an exception may be swallowed. The program holds
    the signal back until here."""

    def __enter__(self):
        self.before = signal.getsignal(signal.SIGINT)
        if self.before is signal.default_int_handler:  # else who calls us ignores it, and so do we
            signal.signal(signal.SIGINT, lambda *_: os._exit(EXIT_INTERRUPTED))
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})

    def __exit__(self, *_):
        signal.signal(signal.SIGINT, self.before)


def prepared(script, lines):
    """The script's main(), with its arguments read and its modules imported."""
    with EndedByInterrupts():
        options = [lines.COMMANDS[script](sys.argv[1:])] if script in lines.COMMANDS else []
        for one in options:  # before imports, which take a second
            for path in getattr(one, "results", [one.result] if "result" in one else []):
                lines.check_file(path)
        program = "tubule stability --plot" if script == "stability" else f"tubule {script}"
        lines.require_libraries(program)
        importlib.import_module("tubule_drawing.style").apply()
        return functools.partial(importlib.import_module(f"tubule_drawing.{script}").main, *options)


def main():
    with EndedByInterrupts():
        sys.path.pop(0)  # this folder, whose modules are not to be found under their bare names
        path = Path(sys.argv.pop(1))
        places = [str(Path(__file__).resolve().parent), *([str(path.parent)] if path.suffix == ".py" else [])]
        sys.modules["tubule_drawing"] = package = types.ModuleType("tubule_drawing")
        package.__path__ = places
        lines = importlib.import_module("tubule_drawing.command_line")
    return lines.status_of(lambda: prepared(path.stem, lines)())


if __name__ == "__main__":
    sys.exit(main())
