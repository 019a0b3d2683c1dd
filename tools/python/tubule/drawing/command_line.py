"""The command line of the scripts that draw."""

import argparse
import os
import sys

EXIT_BAD_INPUT, EXIT_UNAVAILABLE = 2, 4
DEBIAN_PACKAGES = {"numpy": "python3-numpy", "matplotlib": "python3-matplotlib", "h5py": "python3-h5py"}


class Unavailable(Exception):
    """What is missing on this machine, and what to install."""


def say(words, out=None):
    """Prints words, by default to stderr. Nothing depends on them: where they cannot be written, it goes on without."""
    out = out or sys.stderr
    try:
        print(words, file=out, flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), out.fileno())  # else what is left in its buffer fails again at exit


def require_libraries(program):
    """Exits, naming the package, if a library is missing. To be called before the imports that need them."""
    # A result file never changes in place, so it needs no lock; on some disks locks fail.
    os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")
    for module, package in DEBIAN_PACKAGES.items():
        try:
            __import__(module)
        except ImportError:
            say(f"{program}: {sys.executable} has no {module}; install the package {package}")
            sys.exit(EXIT_UNAVAILABLE)


def run(draw, outputs, name=None):
    """Calls draw(outputs) and prints the pictures by name(path), if given, or the reason for a failure. The exit status."""
    from . import style

    try:
        style.check_outputs(outputs)
        draw(outputs)
    except style.BadInput as error:
        say(error)
        return EXIT_BAD_INPUT
    for path in outputs if name else ():
        say(name(path), sys.stdout)
    return 0


def main(description, draw, argument="table", nargs=None):
    """Calls draw(argument, outputs) with what the command line gives."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(argument, nargs=nargs)
    parser.add_argument("-o", "--output", action="append", required=True)
    options = parser.parse_args()
    return run(lambda outputs: draw(getattr(options, argument), outputs), options.output, os.path.relpath)
