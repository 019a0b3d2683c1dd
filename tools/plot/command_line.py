"""The command line of the scripts that draw one figure."""

import argparse
import os
import sys


def run(draw, outputs):
    """Draws, or says why not. The exit status."""
    from results import BadInput

    try:
        draw(outputs)
    except BadInput as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def main(description, draw, argument="table", nargs=None):
    """Calls draw(argument, outputs) with what the command line gives, and prints the names of the pictures."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(argument, nargs=nargs)
    parser.add_argument("-o", "--output", action="append", required=True)
    options = parser.parse_args()
    status = run(lambda outputs: draw(getattr(options, argument), outputs), options.output)
    for path in options.output if status == 0 else ():
        print(os.path.relpath(path))
    return status
