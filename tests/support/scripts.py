"""Runs scripts as their users do, without the second that Python needs to import matplotlib each time."""

import os
import runpy
import subprocess
import sys
import tempfile
import traceback

import h5py  # noqa: F401
import matplotlib.backends.backend_agg  # noqa: F401
import matplotlib.backends.backend_svg  # noqa: F401
import matplotlib.pyplot  # noqa: F401

# What one fork has compiled the next ones load: the modules of the package are imported anew in each.
compiled = tempfile.TemporaryDirectory()


def run_script(script, *arguments):
    """What `python3 script arguments` does, in a fork of this process; as subprocess.run with its output as text."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        child = os.fork()
        if child == 0:
            os.dup2(out.fileno(), 1)
            os.dup2(err.fileno(), 2)
            os._exit(_run_here(str(script), [str(argument) for argument in arguments]))
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        out.seek(0)
        err.seek(0)
        return subprocess.CompletedProcess([script, *arguments], status, out.read(), err.read())


def _run_here(script, arguments):
    sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)
    sys.argv = [script, *arguments]
    sys.pycache_prefix, sys.dont_write_bytecode = compiled.name, False
    status = 0
    try:
        runpy.run_path(script, run_name="__main__")
    except SystemExit as stop:
        status = stop.code if isinstance(stop.code, int) else int(stop.code is not None)
        if isinstance(stop.code, str):
            print(stop.code, file=sys.stderr)
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    return status
