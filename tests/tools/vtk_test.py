#!/usr/bin/python3
"""Curved surfaces as VTK's own reader sees them.

    vtk_test.py SURFACE_RESULTS

SURFACE_RESULTS (surface_results.cpp) writes flat triangulations moved by a polynomial map of the elements' degree,
which is written again here: cells of VTK must meet it everywhere, not only at their nodes. A wrong order of nodes
cannot.
"""

import json
import sys
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import reference, vtkVersion
from vtkmodules.vtkCommonDataModel import VTK_LAGRANGE_TRIANGLE
from vtkmodules.vtkIOHDF import vtkHDFReader

from made_surfaces import MadeSurfaces

ORDERS = (2, 3, 4)
PLACES = [(0.2, 0.3), (0.6, 0.1), (0.05, 0.9), (0.45, 0.45), (0.5, 0.0)]  # (r, s) in a cell
TEMPORAL = (vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()) >= (9, 3)


def polynomial_map(p, k):
    x, y, z = p.T
    return np.stack([x + 0.3 * y**k, y - 0.2 * x * y ** (k - 1), z + 0.1 * x**k], axis=1)


def polynomial_value(p, k):
    x, y = p[:, 0], p[:, 1]
    return x**k - 2 * x * y ** (k - 1) + y


def read(path, time=None):
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    if time is None:
        reader.Update()
    else:
        reader.UpdateTimeStep(time)
    return reader.GetOutput()


def array(grid, name):
    return vtk_to_numpy(grid.GetPointData().GetArray(name))


class Surfaces(MadeSurfaces):
    def view(self, name, frame):
        return read(self.folder / f"view/{name}_{frame:06d}.hdf")

    def check_exact(self, grid, k, time):
        """Position and point data of the grid inside its cells against the polynomials, to rounding."""
        points = vtk_to_numpy(grid.GetPoints().GetData()).reshape(-1, 3)
        flat = array(grid, "flat").copy()
        # Point data are those of the node; what period a point is moved by, its position tells.
        flat[:, 2] = points[:, 2] / (1 + time) - 0.1 * flat[:, 0] ** k
        value, tensor = array(grid, "value"), array(grid, "tensor")
        self.assertEqual(tensor.shape, (len(points), 6))
        x, weights = [0.0] * 3, [0.0] * ((k + 1) * (k + 2) // 2)
        found, at, values, tensors = [], [], [], []
        for c in range(grid.GetNumberOfCells()):
            self.assertEqual(grid.GetCellType(c), VTK_LAGRANGE_TRIANGLE)
            cell = grid.GetCell(c)
            ids = [cell.GetPointId(i) for i in range(cell.GetNumberOfPoints())]
            self.assertEqual(len(ids), len(weights))
            for r, s in PLACES:
                cell.EvaluateLocation(reference(0), [r, s, 0], x, weights)
                found.append(list(x))
                at.append((1 - r - s) * flat[ids[0]] + r * flat[ids[1]] + s * flat[ids[2]])
                values.append(np.dot(weights, value[ids]))
                tensors.append(np.dot(weights, tensor[ids]))
        at = np.array(at)
        exact = polynomial_value(at, k) + time
        np.testing.assert_allclose(found, (1 + time) * polynomial_map(at, k), rtol=0, atol=1e-13)
        np.testing.assert_allclose(values, exact, rtol=0, atol=1e-13)
        np.testing.assert_allclose(tensors, np.outer(exact, np.arange(1, 7)), rtol=0, atol=1e-12)

    def check_size(self, grid, k, triangles, euler, extra):
        """`extra`: points that are there twice, once for each side of the seam of a tube."""
        self.assertEqual(grid.GetNumberOfCells(), triangles)
        # k^2 triangles with straight sides would have the same nodes: V = F/2 + chi.
        self.assertEqual(grid.GetNumberOfPoints(), k * k * triangles // 2 + euler + extra)

    def test_closed(self):
        for k in ORDERS:
            for frame in (0, 1):
                with self.subTest(k=k, frame=frame):
                    grid = self.view(f"closed_{k}", frame)
                    self.check_size(grid, k, 80, 2, 0)  # an icosahedron, edges halved
                    self.check_exact(grid, k, frame)

    def test_periodic(self):
        for k in ORDERS:
            for frame in (0, 1):
                with self.subTest(k=k, frame=frame):
                    grid = self.view(f"tube_{k}", frame)
                    # 4 rings of 6 points; the seam runs through the first ring's 6 edges, k nodes each.
                    self.check_size(grid, k, 48, 0, 6 * k)
                    self.check_exact(grid, k, frame)
                    bent = 0.1 * (1 + frame) * array(grid, "flat")[:, 0] ** k
                    z = vtk_to_numpy(grid.GetPoints().GetData())[:, 2] - bent
                    self.assertAlmostEqual(np.ptp(z), 2 * (1 + frame), delta=0.5)  # jittered ends of one period

    def test_several_meshes(self):
        for frame, (triangles, time) in enumerate([(48, 0), (48, 1), (80, 0), (80, 1)]):
            grid = self.view("mixed", frame)
            self.assertEqual(grid.GetNumberOfCells(), triangles)
            self.check_exact(grid, 3, time)

    def test_curvatures_arrive(self):
        grid = self.view("shapes_torus", 0)
        points, normal = vtk_to_numpy(grid.GetPoints().GetData()), array(grid, "normal")
        # A torus of radii 2 and 1: K = cos/(2 + cos), H = -(2 + 2 cos)/(2 + cos) at the angle around the tube;
        # recovered on 32 x 16 quadrangles.
        cosine = np.hypot(points[:, 0], points[:, 1]) - 2
        np.testing.assert_allclose(array(grid, "K"), cosine / (2 + cosine), atol=0.05)
        np.testing.assert_allclose(array(grid, "H"), -(2 + 2 * cosine) / (2 + cosine), atol=0.05)
        np.testing.assert_allclose(normal[:, 2], points[:, 2], atol=0.02)

    def test_series(self):
        series = json.loads((self.folder / "view/tube_3.hdf.series").read_text())
        self.assertEqual(series["file-series-version"], "1.0")
        self.assertEqual(
            series["files"],
            [{"name": "tube_3_000000.hdf", "time": 0}, {"name": "tube_3_000001.hdf", "time": 1}],
        )

    def test_moved_together(self):
        """The view names its result by a relative path."""
        moved = self.folder / "moved"
        (moved / "view").mkdir(parents=True)
        (moved / "closed_3.hdf").write_bytes((self.folder / "closed_3.hdf").read_bytes())
        view = moved / "view/closed_3_000000.hdf"
        view.write_bytes((self.folder / "view/closed_3_000000.hdf").read_bytes())
        self.assertEqual(read(view).GetNumberOfCells(), 80)

    @unittest.skipUnless(TEMPORAL, "VTK before 9.3 (ParaView 5.12) reads no temporal files")
    def test_temporal(self):
        for name, steps in (
            ("closed_3", [(80, 0), (80, 1)]),
            ("tube_4", [(48, 0), (48, 1)]),
            ("mixed", [(48, 0), (48, 1), (80, 0), (80, 1)]),
        ):
            reader = vtkHDFReader()
            reader.SetFileName(str(self.folder / f"{name}.hdf"))
            reader.UpdateInformation()
            self.assertEqual(reader.GetNumberOfSteps(), len(steps))
            for step, (triangles, time) in enumerate(steps):
                with self.subTest(name=name, step=step):
                    reader.SetStep(step)
                    reader.Update()
                    grid = reader.GetOutputDataObject(0)
                    if grid.IsA("vtkPartitionedDataSet"):
                        grid = grid.GetPartition(0)
                    self.assertEqual(grid.GetNumberOfCells(), triangles)
                    self.check_exact(grid, 4 if name == "tube_4" else 3, time)


if __name__ == "__main__":
    MadeSurfaces.program = sys.argv.pop(1)
    unittest.main()
