#!/usr/bin/python3
"""Rough meshes become starts in one command: contours of noisy images and decimated scans made by VTK, noise, holes; what is
refused, with its place. Argument: the program."""
import re
import struct
import time
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D, vtkQuadricDecimation
from vtkmodules.vtkFiltersSources import vtkSphereSource

from program import ProgramTest, about, series

CASE = """tier = "surface3d"
[energy]
k20 = 1.0
[shape]
kind = "file"
path = "{}"
{}
[accuracy]
energy = 0.1
"""
MOVES = """estimate = false
[model]
kind = "overdamped"
[discretisation]
order = 2
[time]
end = 0.3
limit = 60
"""


def arrays(mesh):
    """Points and triangles of a vtkPolyData."""
    return (
        vtk_to_numpy(mesh.GetPoints().GetData()).astype(float),
        vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3),
    )


def poly_data(points, triangles):
    import vtkmodules.vtkCommonCore as core
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    mesh, cells, places = vtkPolyData(), vtkCellArray(), core.vtkPoints()
    places.SetData(numpy_to_vtk(points, deep=True))
    for triangle in triangles:
        cells.InsertNextCell(3, [int(v) for v in triangle])
    mesh.SetPoints(places)
    mesh.SetPolys(cells)
    return mesh


def contour(values, a):
    """The surface where values[x, y, z] on [-a, a]^3 are zero, by marching cubes."""
    n = values.shape[0]
    image = vtkImageData()
    image.SetDimensions(n, n, n)
    image.SetOrigin(-a, -a, -a)
    image.SetSpacing(*3 * (2 * a / (n - 1),))
    image.GetPointData().SetScalars(numpy_to_vtk(values.transpose(2, 1, 0).ravel(), deep=True))
    cut = vtkFlyingEdges3D()
    cut.SetInputData(image)
    cut.SetValue(0, 0.0)
    cut.ComputeNormalsOff()
    cut.Update()
    return arrays(cut.GetOutput())


def sphere(n):
    source = vtkSphereSource()
    source.SetRadius(1.0)
    source.SetThetaResolution(2 * n)
    source.SetPhiResolution(n)
    source.Update()
    return arrays(source.GetOutput())


def volume(points, triangles):
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


class MeshesTest(ProgramTest):
    def attempt(self, *arguments):
        """Exit status, and what was said."""
        with self.start(*arguments) as process:
            out, err = process.communicate()
        return process.returncode, out + err

    def off(self, name, points, triangles):
        lines = [f"OFF\n{len(points)} {len(triangles)} 0"]
        lines += ["{:.9g} {:.9g} {:.9g}".format(*p) for p in points] + ["3 {} {} {}".format(*t) for t in triangles]
        self.write(name, "\n".join(lines) + "\n")

    def stl(self, name, points, triangles):
        facets = b"".join(struct.pack("<12fH", 0, 0, 0, *points[t].ravel(), 0) for t in triangles)
        (self.folder / name).write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + facets)

    def run_mesh(self, name, keys="remesh = 300", more=""):
        path = self.write("case.toml", CASE.format(name, keys) + more)
        status, words = self.attempt("run", path, "-o", self.result, "--overwrite")
        self.assertIn(status, (0, 5) if more else (0,), words)  # 5: its own time limit
        return series(self.result), about(self.result), words

    def refusal(self, name, keys="remesh = 300"):
        return self.refused("run", self.write("case.toml", CASE.format(name, keys)))

    def test_contour_of_a_noisy_image(self):
        x, y, z = np.meshgrid(*3 * (np.linspace(-1.2, 1.2, 33),), indexing="ij")
        noise = np.random.default_rng(1).normal(0, 0.03, x.shape)
        points, triangles = contour(x**2 + (y / 0.8) ** 2 + (z / 0.6) ** 2 - 1 + noise, 1.2)
        self.stl("contour.stl", points, triangles)
        rows, said, words = self.run_mesh("contour.stl")
        self.assertAlmostEqual(rows["volume"][-1] / abs(volume(points, triangles)), 1, delta=1e-5)  # STL has floats
        # The smooth ellipsoid has 4 pi abc/3 and INT H^2 = 58.98; without smoothing INT H^2 would be hundreds.
        self.assertAlmostEqual(rows["volume"][-1] / (4 / 3 * np.pi * 0.48), 1, delta=0.02)
        self.assertAlmostEqual(rows["energy"][-1] / 58.98, 1, delta=0.1)
        count = int(re.search(r"(\d+) new triangles instead of", words).group(1))
        self.assertAlmostEqual(count, 300, delta=15)
        self.assertIn("The initial shape is at most", said["warnings"])
        stated = float(re.search(r"([\d.]+) percent of its size", words).group(1))
        self.assertLess(stated, 3)

    def test_decimated_scan_relaxes(self):
        points, triangles = sphere(60)
        wavy = 1 + 0.3 * np.sin(3 * points[:, 0] + 1) * np.sin(4 * points[:, 1]) * np.cos(2 * points[:, 2])
        points = points * (wavy + np.random.default_rng(2).normal(0, 0.003, len(points)))[:, None]
        decimation = vtkQuadricDecimation()
        decimation.SetInputData(poly_data(points, triangles))
        decimation.SetTargetReduction(0.9)
        decimation.Update()
        points, triangles = arrays(decimation.GetOutput())
        self.off("scan.off", points, triangles)
        rows, _, words = self.run_mesh("scan.off", more=MOVES)
        self.assertAlmostEqual(rows["volume"][0] / volume(points, triangles), 1, delta=1e-6)
        self.assertLess(rows["energy"].min(), 0.9 * rows["energy"][0], words)

    def test_noise_of_a_fifth_of_an_edge(self):
        points, triangles = sphere(24)
        edges = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2)
        points += np.random.default_rng(3).normal(0, 0.2 * edges.mean(), points.shape)
        self.off("noisy.off", points, triangles)
        rows, _, words = self.run_mesh("noisy.off", f"remesh = 300\nsmoothing_length = {10 * edges.mean()}")
        self.assertAlmostEqual(rows["volume"][-1] / volume(points, triangles), 1, delta=1e-6)
        self.assertAlmostEqual(rows["energy"][-1] / (16 * np.pi), 1, delta=0.1)  # INT H^2 of a sphere

    def test_holes_are_filled_when_asked(self):
        points, triangles = sphere(24)
        self.off("open.off", points, triangles[points[triangles].mean(axis=1)[:, 2] < 0.95])
        self.assertIn("shape.fill_holes = true, with shape.remesh, closes holes", self.refusal("open.off"))
        rows, _, words = self.run_mesh("open.off", "remesh = 300\nfill_holes = true")
        self.assertRegex(words, r"1 holes were filled; the longest border, at \(.*\), measures 1\.")
        self.assertAlmostEqual(rows["volume"][-1] / (4 / 3 * np.pi), 1, delta=0.03)

    def test_a_wrap_that_takes_longer_than_the_limit_is_not_begun(self):
        """0.02 into a sphere's area of 12.5: 31000 squares, some 40 s that nothing can end."""
        self.off("ball.off", *sphere(24))
        path = self.write("case.toml", CASE.format("ball.off", "remesh = 300\nwrap = 0.02") + MOVES)
        begin = time.monotonic()
        status, words = self.attempt("run", path, "-o", self.result, "--set", "time.limit=1")
        self.assertEqual(status, 5, words)
        self.assertIn("reached the time limit of 1 s (time.limit) before the first state was computed", words)
        self.assertLess(time.monotonic() - begin, 15)

    def test_touching_vesicles_are_refused_with_the_place(self):
        points, triangles = sphere(12)
        top, bottom = points[:, 2].argmax(), points[:, 2].argmin()
        second = triangles + len(points)
        second[second == bottom + len(points)] = top
        self.off("touching.off", np.vstack((points, points + [0, 0, 2])), np.vstack((triangles, second)))
        for keys in ("remesh = 300", ""):
            said = self.refusal("touching.off", keys)
            self.assertRegex(said, r"case\.toml:6:8: shape\.path cannot be used: .*touching\.off: non-manifold vertex: "
                                   r"triangle \d+ \(line \d+\) and triangle \d+ \(line \d+\) meet at vertex \d+ \(0, 0, 1\)")

    def test_wrong_keys_are_refused(self):
        for keys, said in (
            ("remesh = 50", r"7:10: shape\.remesh must be an integer >= 100 and <= 20000, not 50"),
            ("remesh = 300\nsmoothing = 2", r"8:13: shape\.smoothing must be absent: with remesh, smoothing_length"),
            ("remesh = 300\nsmoothing_length = 0.0", r"8:20: shape\.smoothing_length must be a number > 0, not 0\.0"),
            ("smoothing_length = 0.1", r"7:20: shape\.smoothing_length must be absent: only valid with remesh"),
            ("remesh = 300\nwrap = 0.1\nfill_holes = true", r"9:14: shape\.fill_holes must be absent: wrap closes all"),
        ):
            self.assertRegex(self.refusal("sound.off", keys), r"case\.toml:" + said)


if __name__ == "__main__":
    unittest.main(argv=["meshes_test.py"])
