"""Looks for the compiled part of the package, and says what to do where it is missing."""

import sys
from pathlib import Path

try:
    from ._core import CaseError  # noqa: F401
except ModuleNotFoundError as error:
    made = [file.name for file in Path(__file__).parent.glob("_core.*.so")]
    if made:
        raise ImportError(f"tubule is compiled for another Python ({made[0]}) than {sys.executable}: run /usr/bin/python3") from error
    raise ImportError("tubule lacks its compiled part: run tools/start; or install the Debian packages python3-dev and pybind11-dev, "
                      "then run cmake --preset release && cmake --build --preset release") from error  # fmt: skip
