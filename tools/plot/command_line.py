"""The command line of the scripts that draw."""

import argparse
import os
import sys

EXIT_BAD_INPUT, EXIT_UNAVAILABLE = 2, 4
DEBIAN_PACKAGES = {"numpy": "python3-numpy", "matplotlib": "python3-matplotlib", "h5py": "python3-h5py"}


def require_libraries(program):
    """Exits, naming the package, if a library is missing. To be called before the imports that need them."""
    # A result file never changes in place, so it needs no lock; on some disks locks fail.
    os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")
    for module, package in DEBIAN_PACKAGES.items():
        try:
            __import__(module)
        except ImportError:
            print(f"{program}: {sys.executable} has no {module}; install the package {package}", file=sys.stderr)
            sys.exit(EXIT_UNAVAILABLE)


def run(draw, outputs, name=None):
    """Calls draw(outputs) and prints the pictures by name(path), if given, or the reason for a failure. The exit status."""
    import style

    try:
        style.check_outputs(outputs)
        draw(outputs)
    except style.BadInput as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    for path in outputs if name else ():
        print(name(path))
    return 0


def main(description, draw, argument="table", nargs=None):
    """Calls draw(argument, outputs) with what the command line gives."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(argument, nargs=nargs)
    parser.add_argument("-o", "--output", action="append", required=True)
    options = parser.parse_args()
    return run(lambda outputs: draw(getattr(options, argument), outputs), options.output, os.path.relpath)
