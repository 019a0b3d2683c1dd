"""Membranes as fluid deformable surfaces, axisymmetric and three-dimensional.

    import tubule

    case = tubule.Case({"tier": "axisym", "energy": {"k20": 1, "k42": 0.06},
                        "shape": {"kind": "tube", "radius": 1, "length": 9, "mode": [{"amplitude": 0.1, "n": 1}]},
                        "time": {"end": 0.1}})
    result = tubule.run(case)
    result.stop, result.energy, result.energy_error
    result.series["time"], result.series["energy"]

Keys of cases: docs/case_files.md. Series: docs/results.md. All numbers are dimensionless: docs/theory.md.
"""

from . import compiled  # noqa: F401  first: it says what to do where the compiled part is missing
from ._core import CaseError, SolveError, build_info as _build_info
from .cases import Case
from .commands import Scan, compare, curvatures, energy_density, equilibrium, export, run, run_many, scan, stability
from .pictures import draw, film
from .results import Frame, Result, read

__version__ = dict(_build_info())["version"]
__all__ = ["Case", "CaseError", "Frame", "Result", "Scan", "SolveError", "compare", "curvatures", "draw",
           "energy_density", "equilibrium", "export", "film", "read", "run", "run_many", "scan", "stability"]
