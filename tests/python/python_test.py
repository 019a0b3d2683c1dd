#!/usr/bin/python3
"""The Python package: against the program, and its documentation.

    python_test.py TUBULE TOP PACKAGES
"""
import contextlib
import doctest
import copy
import html
import io
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import types
import unittest
import warnings
from pathlib import Path

TUBULE, TOP = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
sys.path.insert(0, sys.argv[3])

import h5py
import matplotlib
import numpy as np
import tubule
from tubule import cases, commands, pictures, results

TUBE = {
    "tier": "axisym",
    "energy": {"k20": 0.5, "H0": -1, "k42": 0.1},
    "shape": {"kind": "tube", "radius": 1, "length": 3, "mode": [{"amplitude": 0.12, "n": 1, "phase": 0.3}]},
    "accuracy": {"energy": 1e-6},
    "time": {"end": 0.2, "output": [0.01, 0.05]},
}
# It would take minutes.
LONG = TUBE | {"discretisation": {"elements": 8000, "time_tolerance": 1e-12}, "time": TUBE["time"] | {"max_order": 1}}
SURFACE = {
    "tier": "surface3d",
    "energy": {"k20": 1},
    "shape": {"kind": "ellipsoid", "a": 1, "b": 0.9, "c": 0.8},
    "discretisation": {"elements": 80, "order": 3, "time_tolerance": 1e-3},
    "time": {"end": 0.002},
}
VESICLE = {
    "tier": "axisym",
    "energy": {"k20": 1},
    "shape": {"kind": "ellipsoid", "a": 1, "b": 1, "c": 2},
    "equilibrium": {"area": 12.566370614359172, "reduced_volume": 0.9},
}


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def program(self, *arguments):
        return subprocess.run([TUBULE, *map(str, arguments)], cwd=self.folder, text=True, capture_output=True)

    def written(self, case, name="case.toml"):
        path = self.folder / name
        path.write_text(cases.to_toml(case))
        return path


class Cases(Folder):
    def test_the_same_by_dictionary_text_and_file(self):
        text = cases.to_toml(TUBE)
        ways = [tubule.Case(TUBE), tubule.Case(text), tubule.Case(self.written(TUBE))]
        self.assertEqual({case.toml for case in ways}, {ways[0].toml})

    def test_values_as_toml(self):
        for value, text in ((True, "true"), (3, "3"), (1e-30, "1e-30"), (np.float64(0.5), "0.5"), (np.int64(2), "2"),
                            (np.array([1.0, 2.0]), "[1.0, 2.0]"), ('a"b\\\n\x7f', '"a\\"b\\\\\\n\\u007f"'), (Path("x"), '"x"'),
                            ({"a b": None, "c": {"d": ()}}, "{c = {d = []}}")):
            self.assertEqual(cases.toml_value(value), text)
        with self.assertRaisesRegex(ValueError, "finite"):
            cases.toml_value(float("nan"))
        with self.assertRaisesRegex(TypeError, "complex"):
            cases.toml_value(1j)
        with self.assertRaisesRegex(TypeError, "float128: give float"):
            cases.toml_value(np.longdouble(1))
        itself = {}
        itself["a"] = itself["b"] = itself
        with self.assertRaisesRegex(ValueError, "contain itself"):
            tubule.Case(itself)
        for name in ("\ud800.toml", "a\0b.toml", ""):
            with self.assertRaisesRegex(ValueError, "no name of a file"):
                tubule.Case(name)
        with self.assertRaisesRegex(TypeError, "must be a dictionary"):
            tubule.Case(TUBE, 5)

    def test_overrides(self):
        case = tubule.Case(TUBE, {"energy.k42": 0.2}).with_(energy__k20=0.7)
        self.assertIn("k42 = 0.2", case.toml)
        self.assertIn("k20 = 0.7", case.toml)

    def test_mistakes_have_the_words_of_the_program(self):
        wrong = TUBE | {"energy": {"k02": 1}}
        path = self.written(wrong)
        said = self.program("run", path).stderr.strip()
        with self.assertRaises(tubule.CaseError) as raised:
            tubule.Case(path)
        self.assertEqual(str(raised.exception), said)
        self.assertIsInstance(raised.exception, ValueError)

    def test_copies(self):
        case = tubule.Case(TUBE).with_(energy__k20=0.7)
        for twin in (pickle.loads(pickle.dumps(case)), copy.deepcopy(case)):
            self.assertEqual(twin.toml, case.toml)

    def test_a_forecast(self):
        self.assertGreater(tubule.Case(TUBE).forecast()["steps"], 10)


class Runs(Folder):
    def expect_same(self, case, folder_result):
        """In memory as in the file that the program writes, bit for bit."""
        ours = tubule.run(case, threads=1)
        theirs = tubule.read(folder_result)
        self.assertEqual(list(ours.series), list(theirs.series))
        for name in ours.series:
            if name != "wall_seconds":
                np.testing.assert_array_equal(ours.series[name], theirs.series[name], name)
        self.assertEqual(len(ours.frames), len(theirs.frames))
        for a, b in zip(ours.frames, theirs.frames):
            self.assertEqual((a.time, a.kind, set(a.arrays)), (b.time, b.kind, set(b.arrays)))
            for name in a.arrays:
                np.testing.assert_array_equal(a[name], b[name])
        timings = {"started", "wall_seconds", "case_path", "blas"}  # and the name under which BLAS was found
        self.assertEqual({k: v for k, v in ours.about.items() if k not in timings},
                         {k: v for k, v in theirs.about.items() if k not in timings})
        return ours

    def test_as_the_program(self):
        for case in (TUBE, TUBE | {"model": {"kind": "overdamped"}}, SURFACE, VESICLE):
            with self.subTest(case=case):
                path = self.written(case)
                done = subprocess.run([TUBULE, "run", path, "-o", "r.hdf", "--overwrite"], cwd=self.folder,
                                      env=os.environ | {"OMP_NUM_THREADS": "1"}, capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.expect_same(case, self.folder / "r.hdf")

    def test_output_is_a_result_of_the_program(self):
        file = self.folder / "out.hdf"
        ours = tubule.run(TUBE, output=file)
        self.assertEqual(self.program("show", file, "--verify").returncode, 0)
        np.testing.assert_array_equal(tubule.read(file).series["energy"], ours.series["energy"])
        with self.assertRaisesRegex(tubule.CaseError, "a result is an HDF5 file"):
            tubule.run(TUBE, output=self.folder / "r.csv")

    def test_results_of_other_cases_are_kept(self):
        file = self.folder / "out.hdf"
        tubule.run(TUBE, output=file)
        before, other = file.read_bytes(), tubule.Case(TUBE, {"energy.k42": 0.2})
        with self.assertRaisesRegex(tubule.CaseError, "overwrite"):
            tubule.run(other, output=file)
        self.assertEqual(file.read_bytes(), before)
        tubule.run(TUBE, output=file)  # the same case may be run again
        result = tubule.run(other, output=file, overwrite=True)
        np.testing.assert_array_equal(tubule.read(file).series["energy"], result.series["energy"])

    def test_what_is_worth_knowing_is_a_warning(self):
        """k42 < 0: the energy has no lower bound, which does not end the run."""
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter("always")
            tubule.run(tubule.Case(TUBE, {"energy.k42": -1e-4}))
        self.assertTrue(any("no lower bound" in str(w.message) for w in seen), seen)
        self.assertEqual({Path(w.filename).name for w in seen}, {Path(__file__).name})

    def test_early_stops_are_no_exceptions(self):
        result = tubule.run(TUBE | {"time": {"end": 0.2, "limit": 1e-9}})
        self.assertEqual(result.stop, "time-limit")
        pinched = tubule.run(TOP / "cases/pinch_off.toml")
        self.assertEqual(pinched.stop, "pinch-off")
        self.assertLess(len(pinched.warnings), 3)

    def test_arguments(self):
        for options, words in (({"threads": -1}, "threads must be from 0 to 1000"), ({"threads": 10**6}, "threads must be from 0 to 1000"),
                               ({"threads": 2**40}, "too large"), ({"output": "a\0.hdf"}, "no name of a file")):  # fmt: skip
            with self.assertRaisesRegex(ValueError, words):
                tubule.run(TUBE, **options)
        for options, words in (({"threads": 1.5}, "must be an integer"), ({"progress": 5}, "must be a function")):
            with self.assertRaisesRegex(TypeError, words):
                tubule.run(TUBE, **options)
        self.assertEqual(tubule.run(SURFACE, threads=1000).stop, "finished")  # no more than there are processors

    def test_progress(self):
        seen = []
        tubule.run(TUBE, progress=lambda *values: seen.append(values))
        self.assertTrue(all(len(values) == 3 for values in seen))

        class Enough(Exception):
            pass

        def refuse(*_):
            raise Enough("as the caller wishes")

        began = time.monotonic()
        with self.assertRaisesRegex(Enough, "as the caller wishes"):
            tubule.run(LONG, progress=refuse)
        self.assertLess(time.monotonic() - began, 60)

    def test_interrupts(self):
        script = f"""
import os, signal, sys, threading, time
sys.path.insert(0, {sys.argv[3]!r})
import tubule
began = threading.Event()
def kill():
    began.wait()
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=kill, daemon=True).start()
try:
    tubule.run({LONG!r}, progress=lambda *_: began.set())
except KeyboardInterrupt:
    print("interrupted")
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
print(tubule.run({TUBE!r}).stop)
ends = []  # in another thread, too, and many at once: the interrupt is over
other = threading.Thread(target=lambda: ends.append(tubule.run({TUBE!r}).stop))
other.start(), other.join()
print(*ends, *(r.stop for r in tubule.run_many([{TUBE!r}] * 2)))
"""
        done = subprocess.run(["/usr/bin/python3", "-c", script], text=True, capture_output=True, timeout=200)
        self.assertEqual(done.stdout, "interrupted\nfinished\nfinished finished finished\n", done.stderr)

    def test_handlers_of_signals_are_the_callers(self):
        script = f"""
import os, signal, sys, threading, time
sys.path.insert(0, {sys.argv[3]!r})
import tubule

class Enough(Exception):
    pass

came = []
def count(number, frame):
    came.append(number)
    if len(came) == 3:
        raise Enough

def sends(*numbers):
    def send():
        for number in numbers:
            time.sleep(0.3)
            os.kill(os.getpid(), number)
    threading.Thread(target=send, daemon=True).start()

signal.signal(signal.SIGINT, count)
signal.signal(signal.SIGTERM, signal.SIG_IGN)
signal.signal(signal.SIGALRM, count)
sends(signal.SIGTERM, signal.SIGINT, signal.SIGALRM, signal.SIGALRM)
for work in (lambda: tubule.run({LONG!r}), lambda: tubule.scan({LONG!r}, {{"energy.k20": [1, 2]}}, jobs=2, to_the_end=True)):
    try:
        work()
    except Enough:
        print([signal.Signals(number).name for number in came])
    came.clear()
    sends(signal.SIGINT, signal.SIGINT, signal.SIGINT)
signal.signal(signal.SIGINT, signal.SIG_IGN)
sends(signal.SIGINT)
print(tubule.run({TUBE!r}).stop)
"""
        done = subprocess.run(["/usr/bin/python3", "-c", script], text=True, capture_output=True, timeout=200, cwd=self.folder)
        self.assertEqual(done.stdout, "['SIGINT', 'SIGALRM', 'SIGALRM']\n['SIGINT', 'SIGINT', 'SIGINT']\nfinished\n", done.stderr)

    def test_interrupts_of_many_runs(self):
        """The first Ctrl-C ends those that have begun; they would take minutes."""
        script = f"""
import sys
sys.path.insert(0, {sys.argv[3]!r})
import tubule
print("begun", flush=True)
try:
    tubule.run_many([{LONG!r}] * 6, jobs=3)
except KeyboardInterrupt:
    print("interrupted")
print(*(r.stop for r in tubule.run_many([{TUBE!r}] * 2)))
"""
        with subprocess.Popen(["/usr/bin/python3", "-c", script], stdout=subprocess.PIPE, text=True) as process:
            process.stdout.readline()
            time.sleep(0.5)
            process.send_signal(signal.SIGINT)
            sent = time.monotonic()
            self.assertEqual(process.stdout.readline(), "interrupted\n")
            self.assertLess(time.monotonic() - sent, 5)  # on a busy machine; 0.3 s on another
            self.assertEqual(process.stdout.readline(), "finished finished\n")

    def test_a_run_that_fails_ends_the_others(self):
        began = time.monotonic()
        with self.assertRaisesRegex(tubule.CaseError, "missing.off"):
            tubule.run_many([LONG, LONG, SURFACE | {"shape": {"kind": "file", "path": "missing.off"}, "discretisation": {}}], jobs=3)
        self.assertLess(time.monotonic() - began, 30)

    def test_without_the_lock_of_the_interpreter(self):
        ticks, over = [], threading.Event()

        def tick():
            while not over.wait(0.005):
                ticks.append(1)

        thread = threading.Thread(target=tick, daemon=True)
        thread.start()
        tubule.run(TUBE | {"time": {"end": 0.2, "limit": 1.0}} | {"discretisation": LONG["discretisation"]})
        over.set()
        thread.join()
        self.assertGreater(len(ticks), 20)

    def test_many_at_once_are_as_one_after_the_other(self):
        several = [tubule.Case(TUBE, {"energy.k42": k}) for k in np.linspace(0, 0.2, 12)]
        for one, case in zip(tubule.run_many(several, jobs=4), several):
            np.testing.assert_array_equal(one.series["energy"], tubule.run(case).series["energy"])

    def test_equilibria(self):
        vesicle = tubule.equilibrium(VESICLE)
        self.assertEqual(vesicle.stop, "finished")
        # Seifert, Berndl, Lipowsky (1991): a prolate of reduced volume 0.9 has between 1 and 1.4 times the sphere's energy.
        self.assertTrue(1 < vesicle.energy / (16 * np.pi) < 1.4)
        with self.assertRaisesRegex(ValueError, "needs a table"):
            tubule.equilibrium(TUBE)


class Inputs(Folder):
    def test_the_case_of_a_result_reads_what_it_read(self):
        def put(bulge):
            t = np.linspace(0, np.pi, 60)
            r = (1 + bulge * np.cos(2 * t)) * np.sin(t)
            r[[0, -1]] = 0
            np.savetxt(self.folder / "p.csv", np.column_stack([r, -1.3 * np.cos(t)]), delimiter=",")

        put(0.1)
        (self.folder / "c.toml").write_text(
            'tier = "axisym"\n[energy]\nk20 = 1.0\n[model]\nkind = "overdamped"\n[shape]\nkind = "profile"\n'
            'path = "p.csv"\ntolerance = 1e-2\n[accuracy]\nenergy = 1e-2\n[time]\nend = 1e-3\n')  # fmt: skip
        case, file = self.folder / "c.toml", self.folder / "r.hdf"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            first = tubule.run(case, output=file)
            (self.folder / "p.csv").unlink()
            again = tubule.run(tubule.read(file).case)
            np.testing.assert_array_equal(again.series["energy"], first.series["energy"])
            put(0.2)
            with self.assertRaisesRegex(tubule.CaseError, "p.csv has changed since: bring back the file"):
                tubule.run(tubule.read(file).case)
            with self.assertRaisesRegex(tubule.CaseError, "holds the result of another case .*p.csv has changed since"):
                tubule.run(case, output=file)


class Shapes(Folder):
    def test_frames_of_surfaces(self):
        frame = tubule.run(SURFACE).frames[-1]
        mesh = frame.meshio()
        self.assertEqual(mesh.cells[0].type, "VTK_LAGRANGE_TRIANGLE")
        self.assertEqual(mesh.points.shape, frame.points.shape)
        np.testing.assert_array_equal(mesh.point_data["H"], frame["H"])
        grid = frame.vtk()
        self.assertEqual((grid.GetNumberOfPoints(), grid.GetNumberOfCells()), (len(frame.points), len(frame.cells)))
        self.assertAlmostEqual(self.vtk_area(grid), tubule.run(SURFACE).series["area"][-1], delta=0.02)

    def vtk_area(self, grid):
        from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter
        from vtkmodules.vtkFiltersCore import vtkMassProperties, vtkTriangleFilter

        surface, triangles, mass = vtkDataSetSurfaceFilter(), vtkTriangleFilter(), vtkMassProperties()
        surface.SetNonlinearSubdivisionLevel(3)
        surface.SetInputData(grid)
        triangles.SetInputConnection(surface.GetOutputPort())
        mass.SetInputConnection(triangles.GetOutputPort())
        return mass.GetSurfaceArea()

    def test_periods_of_tubes_are_closed(self):
        tube = SURFACE | {"shape": {"kind": "tube", "radius": 1, "length": 6, "mode": [{"amplitude": 0.1, "n": 1}]}}
        result = tubule.run(tube | {"discretisation": {"elements": 120, "order": 3, "time_tolerance": 1e-3}})
        grid = result.frames[0].vtk()
        self.assertAlmostEqual(self.vtk_area(grid), result.series["area"][0], delta=0.02 * result.series["area"][0])

    def test_profiles(self):
        result = tubule.run(TUBE)
        r, z = result.frames[0].profile(7)
        np.testing.assert_allclose(r, 1 + 0.12 * np.cos(2 * np.pi * z / 3 + 0.3), atol=1e-7)  # as the case has it
        mesh, (points, corners) = result.frames[0].meshio(), result.frames[0].triangles()
        np.testing.assert_array_equal(mesh.points, points)
        np.testing.assert_array_equal(mesh.cells[0].data, corners)

    def test_tables(self):
        result = tubule.run(TUBE)
        table = result.to_pandas()
        self.assertEqual(list(table), list(result.series))
        self.assertEqual(len(table), len(result.series["time"]))

    def test_what_is_no_result_is_refused(self):
        (self.folder / "x.hdf").write_text("no")
        with self.assertRaisesRegex(RuntimeError, "x.hdf"):
            tubule.read(self.folder / "x.hdf")
        with self.assertRaises(IndexError):
            tubule.run(TUBE).frames[99]
        with self.assertRaisesRegex(KeyError, "did you mean 'energy'"):
            tubule.run(TUBE).series["enrgy"]
        for points in (1, 10**9):
            with self.assertRaisesRegex(ValueError, "points must be from 2 to"):
                tubule.run(TUBE).frames[0].profile(points)
        with self.assertRaisesRegex(ValueError, "subdivide must be from 1 to 64"):
            tubule.run(TUBE).frames[0].triangles(-3)

    def test_copies(self):
        """A result is its file; a copy has all of it, the meshes of surfaces, too."""
        for case in (TUBE, SURFACE, VESICLE):
            result = tubule.run(case)
            for twin in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
                self.assertEqual(twin.about, result.about)
                self.assertEqual(twin.case.toml, result.case.toml)
                for name in result.series:
                    np.testing.assert_array_equal(twin.series[name], result.series[name])
                for a, b in zip(twin.frames, result.frames, strict=True):
                    self.assertEqual((a.time, a.kind, a.numbers), (b.time, b.kind, b.numbers))
                    for name in b.arrays:
                        np.testing.assert_array_equal(a[name], b[name])
                if case is SURFACE:
                    np.testing.assert_array_equal(twin.frames[-1].cells, result.frames[-1].cells)


def still(tier, **shape):
    """A shape that does not move, or hardly."""
    time = {"time": {"end": 1e-6}} if tier == "axisym" else {}
    return {"tier": tier, "energy": {"k20": 1}, "shape": shape, "accuracy": {"energy": 1e-3}} | time


RIPPLED = {"kind": "tube", "radius": 1, "length": 3, "mode": [{"amplitude": 0.2, "n": 1}]}


class Triangles(Folder):
    """Frame.triangles(), tubule.export() and `tubule export`. Areas and volumes of series have another quadrature, of curves."""

    def test_they_close_and_converge(self):
        for case, euler, rims in ((VESICLE, 2, 0), (still("axisym", kind="torus", radius=2, tube_radius=0.7), 0, 0), (still("axisym", **RIPPLED), 0, 2),
                                  (still("axisym", kind="patch", radius=1, height=0.5), 1, 1), (SURFACE, 2, 0),
                                  (still("surface3d", kind="torus", radius=2, tube_radius=0.7), 0, 0),
                                  (still("surface3d", **RIPPLED) | {"discretisation": {"elements": 120}}, 0, 2)):  # fmt: skip
            with self.subTest(case["tier"] + case["shape"]["kind"]):
                result, errors = tubule.run(case), []
                for n in (2, 4):
                    points, corners = result.frames[-1].triangles(n)
                    sides = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
                    both, times = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
                    self.assertEqual(len(np.unique(sides, axis=0)), len(sides))  # no two triangles run along a side the same way
                    self.assertEqual(len(points) - len(both) + len(corners), euler)
                    rim = both[times == 1]
                    self.assertEqual(len(np.unique(rim)), len(rim))
                    self.assertEqual(len(rim) > 0, rims > 0)
                    a, b, c = (points[corners[:, i]] for i in range(3))
                    normal = np.cross(b - a, c - a) / 2
                    volume = ((a + b + c)[:, :2] * normal[:, :2]).sum() / 6  # INT (x, y, 0).n dS / 2: nothing at ends of tubes
                    if case["shape"]["kind"] == "patch":  # over the plane z = 0
                        volume = ((a + b + c)[:, 2] * normal[:, 2]).sum() / 3
                    errors.append([np.linalg.norm(normal, axis=1).sum() / result.series["area"][-1] - 1, volume / result.series["volume"][-1] - 1])
                np.testing.assert_allclose(np.divide(*errors), 4, rtol=0.1)  # second order
                np.testing.assert_array_less(np.abs(errors[1]), 0.01)

    def test_the_command_writes_what_can_be_read_as_an_initial_shape(self):
        from tubule.drawing import command_line, export

        result = tubule.run(VESICLE, output=self.folder / "vesicle.hdf")
        files = [self.folder / f"vesicle{ending}" for ending in (".stl", ".ply", ".OBJ")]
        options = command_line.COMMANDS["export"]([f"{self.folder}/vesicle.hdf", "--subdivide", "1", *(f"-o{file}" for file in files)])
        with contextlib.redirect_stdout(io.StringIO()) as said:
            self.assertEqual(export.main(options), 0)
        self.assertEqual(said.getvalue().split(), list(map(str, files)))
        for file in files:
            case = still("surface3d", kind="file", path=str(file))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                read = tubule.run(case | {"accuracy": {"energy": 0.1}, "discretisation": {"order": 2}})
            for name in ("area", "volume"):  # smooth again: closer than the flat triangles, 0.8 and 1.6 % less
                self.assertAlmostEqual(read.series[name][0] / result.series[name][0], 1, delta=1e-3)
            written = file.read_bytes()
            tubule.export(result, file, subdivide=1)
            self.assertEqual(file.read_bytes(), written)

    def test_refusals(self):
        result, nothing = tubule.run(VESICLE, output=self.folder / "a.hdf"), self.folder / "none" / "a.stl"
        for output, options, error, words in (
            ("a.vtk", {}, ValueError, "one of .stl, .ply, .obj"), (nothing, {}, ValueError, "none does not exist"), ("/", {}, ValueError, "one of"),
            ("a.stl", {"subdivide": 0}, ValueError, "from 1 to 64, not 0"), ("a.stl", {"frame": 1}, IndexError, "1 frames"),
        ):  # fmt: skip
            with self.assertRaisesRegex(error, words):
                tubule.export(result, self.folder / output, **options)
        (self.folder / "folder.stl").mkdir()
        with self.assertRaisesRegex(ValueError, "cannot be written: Is a directory"):
            tubule.export(result, self.folder / "folder.stl")
        with self.assertRaisesRegex(TypeError, "a result or a frame is wanted"):
            tubule.export("a.hdf", "a.stl")
        for words, message in ((["--frame", "1"], "no frame 1: there are 0 to 0"), (["--subdivide", "65"], "65 is not between 1 and 64")):
            done = self.program("export", "a.hdf", "-oa.stl", *words)
            self.assertEqual((done.returncode, message in done.stderr), (2, True), done.stderr)


class Notebooks(Folder):
    def test_what_a_notebook_shows(self):
        page = tubule.run(TUBE)._repr_html_()
        self.assertTrue(page.startswith("<iframe srcdoc="), page[:200])
        self.assertIn("const data", html.unescape(page))
        empty = tubule.run(TUBE)
        empty._core = types.SimpleNamespace(image=lambda: b"")
        self.assertIn("cannot be read as HDF5", empty._repr_html_())
        scan = tubule.scan(TUBE, {"energy.k42": [0, 0.1]})
        self.assertRegex(repr(scan), r"^<tubule.Scan over energy.k42: 1 undecided, 1 uniform-tube>$")
        self.assertEqual(scan._repr_html_().count("<tr>"), 3)

    def test_films(self):
        result = tubule.run(TUBE | {"time": {"end": 0.2}})  # two frames
        tubule.film(result, self.folder / "a.gif")
        self.assertEqual((self.folder / "a.gif").read_bytes()[:4], b"GIF8")
        for output, options, error, words in (("a.gif", {"colour": "Q"}, ValueError, "not one of H"), ("a.avi", {}, ValueError, "one of .mp4, .gif")):
            with self.assertRaisesRegex(error, words):
                tubule.film(result, self.folder / output, **options)
        with self.assertRaisesRegex(TypeError, "a result is wanted"):
            tubule.film("a.hdf", "a.gif")


class Answers(Folder):
    def test_stability_as_the_program_says_it(self):
        for options, arguments in (({}, ()), ({"model": "all", "modes": 1, "waves": 3}, ("--model", "all", "--modes", "1", "--waves", "3")),
                                   ({"numerical": True, "rates": 2}, ("--numerical", "--rates", "2"))):
            path = self.written(TUBE)
            theirs = json.loads(self.program("stability", path, "--json", *arguments).stdout)
            self.assertEqual(tubule.stability(path, **options), theirs)
        result = self.folder / "r.hdf"
        self.program("run", path, "-o", result)
        theirs = json.loads(self.program("stability", result, "--fit", "1", "--json").stdout)
        self.assertEqual(tubule.stability(tubule.read(result), fit=(1,)), theirs)
        with self.assertRaisesRegex(ValueError, "exclude"):
            tubule.stability(path, q=[1.0], waves=2)

    def test_what_cannot_be_asked_of_stability(self):
        """As the command says it, but for the dashes."""
        case = tubule.Case(TUBE)
        for options, words in (({"fit": (1,)}, "fit needs a result"), ({"frame": 3}, "frame needs a result"),
                               ({"rates": 0}, "rates must be from 1 to 100, not 0"), ({"rates": -1, "numerical": True}, "rates must be from 1"),
                               ({"modes": 10**9}, "modes must be from 0 to 100"), ({"modes": -1}, "modes must be from 0"),
                               ({"waves": 10**8}, "waves must be from 1 to 10000"), ({"waves": -5}, "waves must be from 1"),
                               ({"Re": -1.0}, "Re must be from 1e-100"), ({"gamma": -1.0}, "gamma must be from 0"),
                               ({"tension": float("nan")}, "tension must be from"), ({"model": "stokse"}, "did you mean 'stokes'"),
                               ({"q": []}, "q must not be empty"), ({"q": [float("nan")]}, "is not a number")):  # fmt: skip
            with self.assertRaisesRegex(ValueError, "^(?!--).*" + words):
                tubule.stability(case, **options)
        for options, words in (({"model": None}, "model must be a text"), ({"modes": 1.5}, "modes must be an integer"),
                               ({"Re": "x"}, "Re must be a number")):  # fmt: skip
            with self.assertRaisesRegex(TypeError, words):
                tubule.stability(case, **options)
        with self.assertRaisesRegex(ValueError, "m must be from 0"):
            case.growth_rate(1.0, m=-1)

    def test_comparisons_as_the_program_says_them(self):
        for name, k42 in (("a.hdf", 0.1), ("b.hdf", 0.11)):
            self.assertEqual(self.program("run", self.written(TUBE), "--set", f"energy.k42={k42}", "-o", name).returncode, 0)
        theirs = json.loads(self.program("compare", "a.hdf", "b.hdf", "--json").stdout)
        ours = tubule.compare(tubule.read(self.folder / "a.hdf"), tubule.read(self.folder / "b.hdf"))
        self.assertEqual(ours["series"], theirs["series"])
        self.assertEqual(ours["frames"], theirs["frames"])
        with self.assertRaisesRegex(ValueError, "no frame 77"):
            tubule.compare(tubule.run(TUBE), tubule.run(TUBE), frames=[(77, 0)])
        with self.assertRaisesRegex(ValueError, "no-shapes must be absent"):
            tubule.compare(tubule.run(TUBE), tubule.run(TUBE), align=True, shapes=False)
        with self.assertRaisesRegex(TypeError, "a result is wanted"):
            tubule.compare(tubule.run(TUBE), "b.hdf")

    def test_scans_as_the_program_makes_them(self):
        over = {"energy.k42": [0, 0.1], "shape.mode.0.amplitude": "0.1:0.3:3"}
        file = self.folder / "scan.hdf"
        ours = tubule.scan(TUBE, over, output=file)
        self.assertEqual((ours.outcome.shape, ours.keys), ((2, 3), list(over)))
        np.testing.assert_allclose(ours.values[1], [0.1, 0.2, 0.3])
        self.assertEqual(len(ours.to_pandas()), 6)
        self.program("scan", self.written(TUBE), "--over", "energy.k42=0,0.1", "--over", "shape.mode.0.amplitude=0.1:0.3:3", "-o", "theirs.hdf")
        with h5py.File(self.folder / "theirs.hdf") as theirs, h5py.File(file) as written:
            np.testing.assert_array_equal(ours["energy"].ravel(), theirs["points/energy"][:].ravel())
            np.testing.assert_array_equal(written["points/energy"][:], theirs["points/energy"][:])
        with self.assertRaisesRegex(tubule.CaseError, "energy.k24"):
            tubule.scan(TUBE, {"energy.k24": [1, 2]})
        for options, words in (({"jobs": 0}, "jobs must be 1 or more"), ({"boundary": "not-run"}, "boundary: must be one of"),
                               ({"output": "a.csv"}, "a result is an HDF5 file")):  # fmt: skip
            with self.assertRaisesRegex(tubule.CaseError, words):
                tubule.scan(TUBE, {"energy.k42": [0, 0.1]}, **options)
        with self.assertRaisesRegex(TypeError, "over must be a dictionary"):
            tubule.scan(TUBE, ["energy.k42"])
        self.assertEqual(len(pickle.loads(pickle.dumps(ours)).to_pandas()), 6)

    def test_closed_forms(self):
        # theory.md (2.1); a tube of radius R has H = -1/R, K = 0, a sphere H = -2/R, K = 1/R^2.
        self.assertAlmostEqual(tubule.energy_density(-1.5, 2.0, k20=0.5, k42=0.1, H0=-1), 0.5 * 0.25 + 0.1 * 4)
        H, K = tubule.curvatures(np.array([2.0, 4.0]), 0.0, 0.0)
        np.testing.assert_allclose((H, K), ([-0.5, -0.25], [0, 0]), atol=1e-16)
        a = np.linspace(0.2, 2.9, 5)  # a circle of radius 3
        H, K = tubule.curvatures(3 * np.sin(a), 3 * np.cos(a), -3 * np.sin(a), 3 * np.sin(a), 3 * np.cos(a))
        np.testing.assert_allclose((H, K), (np.full(5, -2 / 3), np.full(5, 1 / 9)), rtol=1e-14)
        case = tubule.Case(TUBE)
        f = case.energy_derivatives(-0.8, 0.3)
        step = 1e-6
        self.assertAlmostEqual(f["f_K"], (case.energy_density(-0.8, 0.3 + step) - case.energy_density(-0.8, 0.3 - step)) / (2 * step), places=8)
        table = tubule.stability(case, q=[0.5, 1.0], modes=0)
        rates = [wave["rate"] for wave in find(table, "waves")]
        np.testing.assert_allclose(case.growth_rate(np.array([0.5, 1.0])), rates, rtol=1e-12)


def find(tree, key):
    """The first value of this key in nested tables."""
    if isinstance(tree, dict):
        if key in tree:
            return tree[key]
        tree = list(tree.values())
    if isinstance(tree, list):
        for branch in tree:
            if (found := find(branch, key)) is not None:
                return found
    return None


class Drawing(Folder):
    """A picture of a result in memory is that of its file, which is what the program draws."""

    def same(self, case, **options):
        file = self.folder / "result.hdf"
        result = tubule.run(case, threads=1)
        tubule.run(case, threads=1, output=file)
        result._name = str(file)  # a picture may show it
        settings = dict(matplotlib.rcParams)
        tubule.draw(result, self.folder / "memory.svg", **options)
        tubule.draw(file, self.folder / "file.svg", **options)
        self.assertEqual(dict(matplotlib.rcParams), settings)
        words = [f"--{name}={value}" for name, value in options.items()]
        self.assertEqual(self.program("plot", file, "-o", "program.svg", *words).returncode, 0)
        memory, read, drawn = ((self.folder / f"{name}.svg").read_text() for name in ("memory", "file", "program"))
        self.assertEqual(memory, read)
        self.assertEqual(drawn, read)
        file.unlink()

    def test_profiles(self):
        case = TUBE | {"units": {"length": "50 nm", "bending_rigidity": "20 kT", "friction": "2e4 Pa s/m"}}  # k20 = 1/2
        self.same(case)
        result = tubule.run(case)
        for name, scale, unit in (("energy", 20, "kT"), ("r_min", 50, "nm"), ("order", 1, "")):
            values, found = result.in_units(name)
            self.assertEqual(found, unit)
            np.testing.assert_allclose(values, scale * result.series[name])
        values, found = result.in_units("r_min", "um")
        self.assertEqual(found, "um")
        np.testing.assert_allclose(values, 0.05 * result.series["r_min"])
        for name, unit in (("r_min", "pN"), ("energy", "J"), ("order", "nm")):
            with self.assertRaisesRegex(ValueError, f"{name} is in .*, which is not {unit} with another prefix"):
                result.in_units(name, unit)
        axes = tubule.draw(result, kind="energy", units="length=2 um").axes[0]
        self.assertEqual(axes.get_xlabel(), "time t (initial phase) [s]")
        self.assertEqual(tubule.draw(result, kind="energy", units="none").axes[0].get_xlabel(), "time t (initial phase)")
        self.assertEqual(tubule.run(TUBE).units, {})

    def test_notes_and_warnings_are_warnings_of_python(self):
        bowl = {"tier": "axisym", "energy": {"k20": 1, "H0": 0.5}, "shape": {"kind": "ellipsoid", "a": 1, "b": 1, "c": 1.2},
                "accuracy": {"energy": 0.1}, "time": {"end": 1e-3}}  # fmt: skip
        with self.assertWarnsRegex(UserWarning, "energy.H0 = 0.5 is positive, but H is negative where"):
            result = tubule.run(bowl)
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter("always")
            result = tubule.run(bowl)
        self.assertTrue(result.warnings)
        self.assertLessEqual(set(result.warnings), {str(one.message) for one in seen})
        self.assertIn(f", {len(result.warnings)} warning", repr(result))

    def test_surfaces(self):
        self.same(SURFACE, kind="cuts")

    def test_scans(self):
        scan = tubule.scan(TUBE, {"energy.k42": [0, 0.1]}, output=self.folder / "scan.hdf")
        tubule.draw(scan, self.folder / "scan.svg")
        self.assertIn("energy", (self.folder / "scan.svg").read_text())
        axes = tubule.draw(scan, units="length=50 nm,bending_rigidity=20 kT").axes[0]
        self.assertEqual(axes.get_ylabel(), "energy where the run stopped [kT]")
        with self.assertRaisesRegex(ValueError, "has no file"):
            tubule.draw(tubule.scan(TUBE, {"energy.k42": [0]}))

    def test_refusals(self):
        result = tubule.run(TUBE)
        for options, words in (({"output": "x.jpg"}, "one of .png"), ({"kind": "all of it"}, "is not one of"),
                               ({"kind": "surface"}, "no surfaces"), ({"times": [7]}, "no result has a frame"),
                               ({"dpi": 5}, "not between 30 and 1200"), ({"colour": ["T"]}, "is not one of H, K"),
                               ({"plane": ("w", 0)}, "is not x, y or z"), ({"times": [float("nan")]}, "not a list of numbers"),
                               ({"quantity": "energy"}, "belong to scans")):  # fmt: skip
            with self.assertRaisesRegex(ValueError, words):
                tubule.draw(result, **options)
        with self.assertRaisesRegex(ValueError, "no result to draw"):
            tubule.draw([])


class Missing(Folder):
    def test_the_compiled_part(self):
        package = self.folder / "tubule"
        package.mkdir()
        for file in (TOP / "tools/python/tubule").glob("*.py"):
            (package / file.name).write_text(file.read_text())

        def said():
            done = subprocess.run(["/usr/bin/python3", "-c", "import tubule"], cwd=self.folder, capture_output=True, text=True)
            self.assertEqual(done.returncode, 1)
            return done.stderr.splitlines()[-1]

        self.assertRegex(said(), "ImportError: tubule lacks its compiled part: .*tools/start.*python3-dev and pybind11-dev.*cmake --preset release")
        (package / "_core.cpython-39-x86_64-linux-gnu.so").touch()
        self.assertRegex(said(), "compiled for another Python .*cpython-39.* run /usr/bin/python3")


class Documentation(unittest.TestCase):
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE

    def test_examples_in_the_modules(self):
        for module in (cases, commands, pictures, results):
            failed, _ = doctest.testmod(module, extraglobs={"tubule": tubule, "tube": tubule.Case(TUBE)}, optionflags=self.flags)
            self.assertEqual(failed, 0)

    def test_the_tutorial(self):
        text = (TOP / "docs/tutorials/python.md").read_text()
        blocks = "\n".join(re.findall(r"^```pycon\n(.*?)^```$", text, re.M | re.S))
        example = doctest.DocTestParser().get_doctest(blocks, {}, "python.md", "python.md", 0)
        before = os.getcwd()
        os.chdir(TOP)
        self.addCleanup(os.chdir, before)
        runner = doctest.DocTestRunner(optionflags=self.flags)
        runner.run(example)
        self.assertGreater(runner.tries, 10)
        self.assertEqual(runner.failures, 0)

    def test_everything_public_says_what_it_is(self):
        for name in tubule.__all__:
            self.assertTrue(getattr(tubule, name).__doc__, name)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
