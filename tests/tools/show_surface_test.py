#!/usr/bin/python3
"""`tubule show` of results with curved surfaces.

    show_surface_test.py SURFACE_RESULTS TUBULE

Expected values: what h5py reads from the file itself, and the sizes of the meshes that surface_results.cpp makes.
"""

import csv
import io
import json
import subprocess
import sys
import unittest

import h5py
import numpy as np

from made_surfaces import MadeSurfaces

TUBULE = None


class Show(MadeSurfaces):
    def show(self, name, *arguments):
        command = [TUBULE, "show", self.folder / name, *arguments]
        done = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout

    def test_summary(self):
        lines = [line.split() for line in self.show("mixed.hdf").splitlines()]
        # A tube of 4 rings of 6 points, its period doubled, and an icosahedron with halved edges; cubic nodes, of which
        # there are k^2 F/2 + chi.
        self.assertIn(["0", "48", "216", "3", "in", "z,", "2"], lines)
        self.assertIn(["1", "48", "216", "3", "in", "z,", "4"], lines)
        self.assertIn(["2", "80", "362", "3", "no:", "closed"], lines)
        frames = [["0", "0", "0"], ["1", "1", "1"], ["2", "0", "2"], ["3", "1", "2"]]  # number, time, mesh
        self.assertEqual([line[:3] for line in lines[-4:]], frames)
        self.assertIn("points[362,", lines[-1])
        self.assertNotIn("restart_state", self.show("mixed.hdf"))

    def test_csv_of_a_frame_has_its_nodes(self):
        rows = list(csv.reader(io.StringIO(self.show("shapes_tube.hdf", "--csv", "--frame", "-1"))))
        names = ["x", "y", "z", "H", "K", "normal_x", "normal_y", "normal_z"]
        self.assertEqual(rows[0], names + ["B_xx", "B_xy", "B_xz", "B_yy", "B_yz", "B_zz"])
        with h5py.File(self.folder / "shapes_tube.hdf") as file:
            nodes, frame = file["meshes/000000"].attrs["nodes"], file["frames/000003"]
            data = [frame["PointData"][name][:nodes] for name in ("H", "K", "normal", "B")]
            exact = np.column_stack([frame["Points"][:nodes], *data])
        np.testing.assert_array_equal(np.array(rows[1:], float), exact)  # 17 digits read back exactly

    def test_json(self):
        data = json.loads(self.show("tube_2.hdf", "--json", "--frame", "1"))
        self.assertEqual([frame["mesh"] for frame in data["frames"]], [0, 1])
        self.assertEqual(data["meshes"][0], {"order": 2, "nodes": 96, "triangles": 48, "period": 2.0})
        mesh = data["meshes"][1]
        self.assertEqual((len(mesh["cells"]), len(mesh["shifts"]), mesh["period"]), (48 * 6, 48 * 6, 4.0))
        with h5py.File(self.folder / "tube_2.hdf") as file:
            cells, nodes = file["meshes/000001/Connectivity"][:], file["meshes/000001/point_node"][:]
            points = file["frames/000001/Points"][:96]
        self.assertEqual(mesh["cells"], nodes[cells].tolist())
        self.assertEqual(data["frames"][1]["arrays"]["points"]["data"], points.ravel().tolist())
        self.assertNotIn("data", data["frames"][0]["arrays"]["points"])


if __name__ == "__main__":
    MadeSurfaces.program, TUBULE = sys.argv.pop(1), sys.argv.pop(1)
    unittest.main()
