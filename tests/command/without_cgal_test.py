#!/usr/bin/python3
"""A build without CGAL says which key needs it, and how to get it. Argument: the program."""
import unittest

from program import ProgramTest

TETRAHEDRON = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"
CASE = """tier = "surface3d"
energy = {k20 = 1.0}
shape = {kind = "file", path = "body.off", remesh = 100}
"""


class WithoutCgalTest(ProgramTest):
    def test_new_triangles_are_refused(self):
        self.write("body.off", TETRAHEDRON)
        case = self.write("case.toml", CASE)
        for command in ("check", "run"):
            self.assertRegex(self.refused(command, case),
                             r"case\.toml:7:\d+: shape\.remesh needs a build with CGAL: install libcgal-dev")


if __name__ == "__main__":
    unittest.main(argv=["without_cgal_test.py"])
