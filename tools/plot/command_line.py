"""The command line of the scripts that draw one figure."""

import argparse
import os
import sys


def run(draw, outputs, name=None):
    """Draws and prints the pictures by name(path), if given, or says why not. The exit status."""
    from results import BadInput

    try:
        draw(outputs)
    except BadInput as error:
        print(error, file=sys.stderr)
        return 2
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
