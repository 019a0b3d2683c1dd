"""Results: series over time, frames, meshes."""

from __future__ import annotations

import difflib
import html
import io
import operator
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from . import _core
from .cases import Case, case_with_units, file_name
from .drawing import triangles


class Series(Mapping):
    """The series of a result by name, as arrays over the rows; "time" is one of them."""

    def __init__(self, core):
        self._core = core

    def __getitem__(self, name: str) -> np.ndarray:
        names = self._core.series_names
        if name not in names:
            near = difflib.get_close_matches(name, names, 1) if isinstance(name, str) else []
            raise KeyError(f"no series {name!r}" + (f"; did you mean {near[0]!r}?" if near else f": there are {', '.join(names)}"))
        return self._core.series(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._core.series_names)

    def __len__(self) -> int:
        return len(self._core.series_names)


class Frame:
    """A shape at one time.

    time, kind     when, and what it is: "graph", "curve", "equilibrium", "surface"
    numbers        by name, such as energy
    arrays         by name, such as H, K, u: one value a point or node
    """

    def __init__(self, core, number: int):
        self._core, self._number = core, number
        read = core.frame(number)
        self.time: float = read["time"]
        self.kind: str = read["kind"]
        self.numbers: dict[str, float] = read["numbers"]
        self.arrays: dict[str, np.ndarray] = read["arrays"]
        self._mesh = None if read["mesh"] is None else core.mesh(read["mesh"])

    def __getitem__(self, name: str) -> np.ndarray:
        return self.arrays[name]

    def profile(self, points: int = 401) -> tuple[np.ndarray, np.ndarray]:
        """(r, z) of an axisymmetric shape; graphs r(z) at this number of points of a period, others as they were written."""
        r, z, _ = self._core.profile(self._number, points)
        return r, z

    @property
    def points(self) -> np.ndarray:
        """Nodes of a surface, [nodes, 3]."""
        return self.arrays["points"]

    @property
    def cells(self) -> np.ndarray:
        """Node numbers of the curved triangles of a surface, in VTK's order of Lagrange triangles."""
        return self._of_mesh("cells")

    @property
    def order(self) -> int:
        """Polynomial order of the triangles of a surface."""
        return self._of_mesh("order")

    def _of_mesh(self, what: str):
        if self._mesh is None:
            raise ValueError("this frame is a profile, without triangles: triangles() makes a surface of it")
        return self._mesh[what]

    def _whole(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points, cells and the node of each point: a node that cells see a period away is one point more."""
        cells, shifts = self.cells, self._mesh["shifts"]
        if shifts is None:
            return self.points, cells, np.arange(len(self.points))
        seen, inverse = np.unique(np.stack([cells.ravel(), shifts.ravel()], axis=1), axis=0, return_inverse=True)
        points = self.points[seen[:, 0]].copy()
        points[:, 2] += self._mesh["period"] * seen[:, 1]
        return points, inverse.reshape(cells.shape), seen[:, 0]

    def triangles(self, subdivide: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Flat triangles: points [n, 3], and corners [m, 3], counter-clockwise seen from outside.

        A curved triangle becomes subdivide^2 flat ones (default: the square of its order). A profile is revolved with
        24 subdivide points around its widest circle (default: 96). One period of a tube is open at its ends.
        """
        subdivide = None if subdivide is None else operator.index(subdivide)
        if subdivide is not None and not 1 <= subdivide <= 64:
            raise ValueError(f"subdivide must be from 1 to 64, not {subdivide}")
        if self._mesh is None:
            profile = (self[name] for name in "rzHK")
            return triangles.of_profile(*profile, subdivide or 4, self.numbers.get("length", 0.0))
        points, shifts = self.points[self.cells], self._mesh["shifts"]
        if shifts is not None:
            points[..., 2] += self._mesh["period"] * shifts
        return triangles.of_surface(points, self.cells, self.order, subdivide or self.order, self._mesh["period"])

    def _data(self, node: np.ndarray) -> dict[str, np.ndarray]:
        """What there is of the nodes, at these ones."""
        return {name: a[node] for name, a in self.arrays.items() if name != "points" and len(a) == len(self.points)}

    def meshio(self):
        """A meshio.Mesh with all data of the nodes; profiles are revolved. Needs the package meshio."""
        import meshio

        if self._mesh is None:
            points, cells = self.triangles()
            return meshio.Mesh(points, [("triangle", cells)])
        points, cells, node = self._whole()
        kind = {1: "triangle", 2: "triangle6"}.get(self.order, "VTK_LAGRANGE_TRIANGLE")
        return meshio.Mesh(points, [(kind, cells)], point_data=self._data(node))

    def vtk(self):
        """A vtkUnstructuredGrid with all data of the nodes; profiles are revolved. Needs the Python modules of VTK."""
        from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import VTK_LAGRANGE_TRIANGLE, VTK_TRIANGLE, vtkCellArray, vtkUnstructuredGrid

        if self._mesh is None:
            (points, cells), node, kind = self.triangles(), None, VTK_TRIANGLE
        else:
            (points, cells, node), kind = self._whole(), VTK_LAGRANGE_TRIANGLE
        grid, at, list_ = vtkUnstructuredGrid(), vtkPoints(), vtkCellArray()
        at.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
        width = np.full((len(cells), 1), cells.shape[1])
        list_.SetCells(len(cells), numpy_to_vtkIdTypeArray(np.hstack([width, cells]).astype(np.int64).ravel(), deep=True))
        grid.SetPoints(at)
        grid.SetCells(kind, list_)
        for name, values in ({} if node is None else self._data(node)).items():
            array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
            array.SetName(name)
            grid.GetPointData().AddArray(array)
        return grid

    def __repr__(self) -> str:
        return f"<tubule.Frame {self.kind} at t = {self.time:g}>"


class Frames(Sequence):
    """The frames of a result, read when they are asked for."""

    def __init__(self, core):
        self._core = core

    def __len__(self) -> int:
        return self._core.frames

    def __getitem__(self, number):
        if isinstance(number, slice):
            return [self[i] for i in range(*number.indices(len(self)))]
        number = operator.index(number)
        if not -len(self) <= number < len(self):
            raise IndexError(f"there are {len(self)} frames")
        return Frame(self._core, number % len(self))


class Result:
    """What a run has computed.

    series     by name: arrays over the rows (docs/results.md lists them)
    frames     shapes
    about      everything else by name: stop, stop_message, E_ref, estimated_error, steps, ...
    """

    def __init__(self, core, name: str = "result"):
        self._core, self._name = core, name
        self.series = Series(core)
        self.frames = Frames(core)
        self.about: dict[str, Any] = dict(core.about)

    @property
    def stop(self) -> str:
        """Why the run ended: "finished", "pinch-off" ... (docs/results.md); "unfinished" if it has not."""
        return self.about.get("stop", "unfinished")

    @property
    def energy(self) -> float:
        """At the end; of a branch, of its last shape. Dimensionless: in_units("energy") has that of the case."""
        return float(self.series["energy"][-1])

    @property
    def energy_error(self) -> float | None:
        """What the run states as the largest error of its energy, absolute; None where it is unknown."""
        stated = self.about.get("estimated_error", 1)
        return None if stated >= 1 else stated * self.about["E_ref"]

    @property
    def warnings(self) -> list[str]:
        """What the run warned of, such as an error that is unknown: look at them after each run."""
        return [line for line in self.about.get("warnings", "").splitlines() if line]

    @property
    def case(self) -> Case:
        """The case that was run, with its overrides."""
        return Case._of(self._core.case(self._name))

    @property
    def units(self) -> dict:
        """As Case.units. Stationary shapes have numbers for times, without a unit."""
        units = self.case.units
        return {of: unit for of, unit in units.items() if of != "time" or not self.case._core.is_equilibrium}

    def in_units(self, name: str, unit: str | None = None) -> tuple[np.ndarray, str]:
        """A series in the units of the case, and the name of its unit: ([251.3, ...], "kT"); "" where it has none.
        `unit`: the same with another prefix, such as "mN/m" for "nN/m"."""
        of_case = self.units.get(self._core.dimensions(name), {"scale": 1.0, "unit": ""})
        values, own = self.series[name] * of_case["scale"], of_case["unit"]
        if unit is None or unit == own:
            return values, own
        powers = {prefix + own[skip:]: 3 * n - 18 for skip in (0, 1) for n, prefix in enumerate(["a", "f", "p", "n", "u", "m", "", "k", "M", "G"])}
        if not {own, unit} <= set(powers) or "^" in own:
            raise ValueError(f"{name} is in {own or 'no unit'}, which is not {unit} with another prefix")
        return values * 10.0 ** (powers[own] - powers[unit]), unit

    def _shown(self, units: str = ""):
        """As the drawing code reads it, in other units than those of its case where they are given."""
        from .drawing.results import read_result
        from .drawing.units import convert

        found = read_result(io.BytesIO(self._core.image()), self._name)
        if units == "none":
            return found
        case = self.case
        return convert(found, case_with_units(case._core.text, case._core.sets, self._name, units).units)

    def __reduce__(self):
        return _from_image, (self._core.image(), self._name)

    def to_pandas(self):
        """The series as a pandas.DataFrame, one row a time. Needs the package pandas."""
        import pandas

        return pandas.DataFrame({name: self.series[name] for name in self.series})

    def __repr__(self) -> str:
        rows = len(self.series["time"])
        warned = {0: "", 1: ", 1 warning"}.get(len(self.warnings), f", {len(self.warnings)} warnings")
        return f"<tubule.Result {self.stop}, {rows} rows, {len(self.frames)} frames{warned}>"

    def _repr_html_(self) -> str:
        """In a notebook: the page of `tubule view`, or why there is none."""
        from .drawing import command_line

        try:
            command_line.require_libraries("the page of a result")
            from .drawing import view

            page = view.page_of(view.run_page(self._shown()))
            return f'<iframe srcdoc="{html.escape(page)}" width="100%" height="600" style="border: 0"></iframe>'
        except (command_line.Unavailable, command_line.BadInput) as error:
            return f"<p>{html.escape(repr(self))}: {html.escape(str(error))}</p>"


def _from_image(image: bytes, name: str) -> Result:
    """A result that was pickled: the bytes of its file."""
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "result.hdf")
        with open(file, "wb") as out:
            out.write(image)
        return Result(_core.read_result(file), name)


def read(file: str | os.PathLike) -> Result:
    """A result file, also of a run that has not ended or was killed. Raises RuntimeError if it is none."""
    name = file_name(file)
    return Result(_core.read_result(name), name)
