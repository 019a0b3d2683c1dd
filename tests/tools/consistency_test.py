#!/usr/bin/python3
"""The suite behind docs/consistency.md: what it detects, and what it writes. Test consistency_study runs its scenes.

    consistency_test.py TUBULE
"""

import contextlib
import csv
import io
import sys
import tempfile
import unittest
from pathlib import Path

SUITE = Path(__file__).resolve().parents[2] / "tools/consistency"
sys.path.insert(0, str(SUITE))
import consistency  # noqa: E402
from measures import Row, case, changed  # noqa: E402
from scenes import SCENES, Scene  # noqa: E402

PROGRAM = sys.argv[1]
sys.path.insert(0, str(Path(PROGRAM).resolve().parent / "python"))


def row(differences, bound=1e-2, error=0.0, **more):
    """A value of 2, and differences relative to a scale of 4 by triangles."""
    found = {triangles: [2.0 + 4 * d, 2.0] for triangles, d in differences.items()}
    return Row("energy", [2.0, 2.0], 4.0, bound, error, [0.0, 1.0], found, **more)


class Rows(unittest.TestCase):
    def test_differences_and_order(self):
        """Triangles 4 times as many are half as wide: from 1.6e-3 to 1e-4, 16 times less, is order 4."""
        one = row({100: 1.6e-3, 200: -9e-4, 400: 1e-4})
        self.assertAlmostEqual(one.difference(100), 1.6e-3, delta=1e-12)
        self.assertAlmostEqual(one.difference(200), 9e-4, delta=1e-12)
        self.assertAlmostEqual(one.order, 4, delta=1e-6)
        self.assertEqual(one.complaints(), [])

    def test_complaints(self):
        slow = {100: 1.5e-3, 400: 1e-3}  # order log2(1.5) = .585
        for differences, more, expected in (
            ({100: 1e-4, 200: -1e-3, 400: 2e-3}, {}, ["falls with order -2 only"]),
            ({100: 1e-1, 400: 1.1e-2}, {}, ["differs by 0.011, more than 0.01"]),
            ({100: 1e-1, 400: 1.1e-2}, {"bound": None}, []),
            ({100: 1e-1, 400: float("nan")}, {"must_fall": False}, ["differs by nan, more than 0.01"]),
            (slow, {}, ["falls with order 0.58 only"]),
            (slow, {"must_fall": False}, []),
            (slow, {"error": 4e-4}, []),  # the reference is not more accurate
            (slow, {"error": 3e-4}, ["falls with order 0.58 only"]),
        ):
            self.assertEqual(row(differences, **more).complaints(), expected)

    def test_a_coarse_mesh_right_by_accident(self):
        """The order is counted from the worst of the coarser meshes: 8 times less on a mesh half as wide is 3."""
        one = row({100: 1e-4, 200: -8e-3, 800: 1e-3})
        self.assertAlmostEqual(one.order, 3, delta=1e-6)
        self.assertEqual(one.complaints(), [])

    def test_tier_1_alone(self):
        alone = Row("a rate", [1.0], 1.0, 1e-5, 2e-5)
        self.assertEqual(alone.complaints(), ["differs by 2e-05, more than 1e-05"])
        self.assertIsNone(alone.order)


class Page(unittest.TestCase):
    def test_changes_leave_the_original(self):
        original = case("three_modes")
        changed(original, shape={"mode": [{"amplitude": 1.0}]}, time=None)
        self.assertEqual(original, case("three_modes"))

    def test_files(self):
        scenes = []
        for name, words in (("figure", "Words."), ("sphere-shape", ""), ("rates-fluid", "")):
            scenes.append(Scene(name, f"The {name}", words, None))
            scenes[-1].rows, scenes[-1].cost = [row({100: 1.6e-3, 400: 1e-4})], {None: 0.5, 100: 1, 400: 20}
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "page.md"
            consistency.write(path, scenes)
            text = path.read_text()
            self.assertIn("energies in motion by 0.0001 of E_ref", text)
            self.assertIn("## The figure\n\nWords.\n", text)
            self.assertIn("| energy, largest of 2 times | 2 | exact | 1.6e-03 | 1.0e-04 | 4.0 | 1e-02 |\n", text)
            self.assertIn("| *CPU s* | 0.5 |  | 1 | 20 |  |  |", text)
            rows = list(csv.DictReader(io.StringIO(path.with_suffix(".csv").read_text())))
            self.assertEqual([float(r["difference"]) for r in rows][:4], [1.6e-3, 0, 1e-4, 0])
            self.assertIn("<svg", path.with_suffix(".svg").read_text())


class Suite(unittest.TestCase):
    SCENE = next(scene for scene in SCENES if scene.name == "spheroid-shape")  # the cheapest

    def called(self, measure):
        scene = Scene(self.SCENE.name, self.SCENE.title, "", measure)
        out, err = io.StringIO(), io.StringIO()
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = consistency.main([PROGRAM, folder, "--only", scene.name], [scene])
        return status, out.getvalue(), err.getvalue()

    def test_a_scene(self):
        status, out, err = self.called(self.SCENE.measure)
        self.assertEqual((status, err), (0, ""))
        self.assertIn("| energy_42 |", out)

    def test_bounds_that_it_violates(self):
        def stricter(program):
            rows = self.SCENE.measure(program)
            for row in rows:
                row.bound = 1e-12 if row.quantity == "volume" else row.bound
            return rows

        status, _, err = self.called(stricter)
        self.assertEqual(status, 1)
        self.assertRegex(err, r"^consistency: Initial shape: a spheroid: volume differs by .*, more than 1e-12\n$")

    def test_a_run_that_fails(self):
        status, _, err = self.called(lambda program: program.run({"tier": "axisym"}, "a bad case"))
        self.assertEqual(status, 2)
        self.assertRegex(err, "consistency: a bad case: .*energy")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
