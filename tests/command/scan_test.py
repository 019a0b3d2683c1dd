#!/usr/bin/python3
"""`tubule scan`: outcomes as of single runs, refusals, kills, boundaries, tables, pictures; ranks where MPI is built in.

scan_test.py TUBULE CASES [MPIRUN]
"""
import csv
import io
import json
import os
import re
import resource
import signal
import subprocess
import sys
import tomllib
import unittest
from pathlib import Path

import h5py
import numpy as np

CASES = Path(sys.argv[2])
MPIRUN = sys.argv[3] if len(sys.argv) > 3 else None

from program import PROGRAM, UNDULATED_TUBE, ProgramTest, about, finished_points, study

AMPLITUDE, K42 = "shape.mode.0.amplitude", "energy.k42"

CASE = UNDULATED_TUBE
# A map with pinched tubes, unduloids (held open by k42) and straight tubes.
MAP = ("--over", f"{AMPLITUDE}=0.3:0.5:3", "--over", f"{K42}=1.6e-5:1.6e-3:3:log")
MADE = {}
# Points that take 0.1 s each, so that there is time to kill their scan.
SLOW = ("--over", f"{AMPLITUDE}=0.1:0.12:12", "--set", "time.end=0.05", "--set", "discretisation.elements=20",
        "--set", "discretisation.time_tolerance=1e-12", "--set", "time.max_order=2", "--to-the-end")


def points(result):
    with h5py.File(result) as file:
        return {name: data[()] for name, data in file["points"].items()}


def outcomes(result):
    with h5py.File(result) as file:
        data = file["points/outcome"]
        return np.array(data.attrs["names"])[data[()]]

os.environ["TUBULE_WRITE_SECONDS"] = "0.02"  # points are to be seen before a kill


class ScanTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("case.toml", CASE)
        self.result = self.folder / "scan.hdf"

    def scan(self, *arguments, status=0):
        """Anew, or with --resume; whatever scan is there may be replaced. Of the map one is made, and copied."""
        if arguments in MADE and (self.folder / "case.toml").read_text() == CASE:
            self.result.write_bytes(MADE[arguments])
            return "", ""
        anew = () if "--resume" in arguments else ("--overwrite",)
        said = self.tubule("scan", *arguments, *anew, "-o", self.result, status=status)
        if arguments[1:] in (MAP, (*MAP, "--to-the-end")):
            MADE[arguments] = self.result.read_bytes()
        return said

    def assert_same_points(self, one, other):
        """Everything except the times that the points took."""
        for name, data in one.items():
            if name.endswith("_seconds"):
                continue
            equal = np.array_equal(data, other[name], equal_nan=True) if data.dtype.kind == "f" else None
            self.assertTrue((data == other[name]).all() if equal is None else equal, name)


class Outcomes(ScanTest):
    def test_as_of_single_runs(self):
        """The names of outcomes follow from why a run stops and how its radii differ then (tools/scan/outcome.hpp)."""
        self.scan("case.toml", *MAP, "--to-the-end")
        found, values = outcomes(self.result), points(self.result)
        self.assertEqual(set(found.flat), {"uniform-tube", "unduloid", "pinched"})
        with h5py.File(self.result) as file:
            axes = [file[f"axes/{i}/values"][:, 0] for i in (0, 1)]
        for i, j in ((0, 0), (2, 0), (2, 1), (1, 1), (2, 2)):
            sets = [f"--set={AMPLITUDE}={axes[0][i]}", f"--set={K42}={axes[1][j]}"]
            run = self.folder / "run.hdf"
            with self.start("run", "case.toml", *sets, "--overwrite", "-o", run) as process:
                process.communicate()
            self.assertIn(process.returncode, (0, 3))
            with h5py.File(run) as file:
                stop = file["about"].attrs["stop"]
                last = {name: data[-1] for name, data in file["series"].items()}
            wave = (last["r_max"] - last["r_min"]) / (last["r_max"] + last["r_min"])
            expected = "pinched" if stop == "pinch-off" else "unduloid" if wave > 0.01 else "uniform-tube"
            self.assertEqual((stop, found[i, j]), ("pinch-off" if expected == "pinched" else "stationary", expected))
            # The scan asks for no frames, which are the only difference: it takes the same steps.
            for mine, name in (("energy", "energy"), ("time", "time"), ("r_min", "r_min"), ("volume", "volume")):
                self.assertEqual(values[mine][i, j], last[name], (i, j, name))

    def test_known_early_or_run_to_the_end(self):
        self.scan("case.toml", *MAP)
        early = outcomes(self.result), points(self.result)["steps"].sum()
        self.scan("case.toml", *MAP, "--to-the-end")
        self.assertTrue((outcomes(self.result) == early[0]).all())
        self.assertLess(early[1], points(self.result)["steps"].sum())

    def test_a_table_of_points(self):
        self.write("points.csv", f"{AMPLITUDE}, {K42}, time.end\n0.38,0,20.0\n0.382,0,20.0\n0.2,0.1,0.001\n")
        self.scan("case.toml", "--points", "points.csv")
        # .38103 is critical (cases/nearly_pinched.toml)
        self.assertEqual(list(outcomes(self.result)), ["uniform-tube", "pinched", "undecided"])

    def test_points_that_are_no_case(self):
        """Each value is possible, the last two are not together."""
        self.scan("case.toml", "--over", f"{AMPLITUDE}=0.1,0.6", "--over", "shape.radius=1.0,0.5")
        self.assertEqual(outcomes(self.result)[1, 1], "failed")
        self.assertIn("radius", points(self.result)["message"][1, 1].decode())
        out, _ = self.tubule("show", self.result, "--csv")
        self.assertIn("refused", out)

    def test_a_limit_of_time(self):
        self.scan("case.toml", "--over", f"{AMPLITUDE}=0.1,0.2", "--set", "time.limit=1e-9")
        self.assertEqual(set(outcomes(self.result)), {"undecided"})
        self.assertIn("time-limit", self.tubule("show", self.result, "--csv")[0])

    def test_surfaces(self):
        """The same for tier 2; two threads give the result of one."""
        surface = """tier = "surface3d"
energy = {k20 = 1.0}
model = {kind = "gradient-flow"}
shape = {kind = "ellipsoid", a = 1.0, b = 1.0, c = 1.2}
discretisation = {elements = 20, order = 2}
time = {end = 1e-3}
"""
        self.write("surface.toml", surface)
        two = ("surface.toml", "--over", "shape.c=1.1,1.2", "--over", "energy.H0=-1.0,0.0")
        self.scan(*two, "--jobs", "1")
        alone = points(self.result)
        self.assertTrue(np.isfinite(alone["energy"]).all())
        self.scan(*two, "--jobs", "2")
        self.assert_same_points(points(self.result), alone)

    def test_closed_cells(self):
        self.write("sphere.toml", CASE.split("[shape]")[0] + """[shape]
kind = "sphere"
radius = 1.0
[time]
end = 0.02
stationary = 1e2
[accuracy]
energy = 1e-2
""")
        self.scan("sphere.toml", "--over", "energy.H0=-2.0,-1.9", "--set", "energy.k20=1.0")
        self.assertEqual(set(outcomes(self.result)), {"sphere"})  # at rest for H0 = -2: H = H0

    def test_every_scan_file_small(self):
        files = sorted((CASES / "scans").glob("*.toml"))
        self.assertTrue(files)
        for path in files:
            over = tomllib.loads(path.read_text())["over"]
            few = [re.sub(r":\d+(:log)?$", r":2\1", axis) for axis in over]
            arguments = [word for axis in few for word in ("--over", axis)]
            with self.subTest(path.name):
                # At corners of the vesicles necks close: some points fail, some after seconds.
                vesicles = path.name == "vesicles.toml"
                self.scan(path, *arguments, "--set", "accuracy.energy=1e-1", *["--set=time.limit=0.2"] * vesicles)
                sizes = [2 if axis.count(":") else axis.count(",") + 1 for axis in few]
                self.assertEqual(list(outcomes(self.result).shape), sizes)
                self.assertLessEqual(np.count_nonzero(outcomes(self.result) == "failed"), 4 * vesicles)


class Boundary(ScanTest):
    def edges(self):
        with h5py.File(self.result) as file:
            return {tuple(sorted(edge)) for edge in file["boundary"][()].tolist()}

    def test_as_of_the_whole_map(self):
        fine = ("--over", f"{AMPLITUDE}=0.2:0.5:10", "--over", f"{K42}=1e-5:1e-2:10:log", "--set", "accuracy.energy=1e-2")
        self.scan("case.toml", *fine)
        whole, edges = points(self.result), self.edges()
        self.assertTrue(edges)
        self.scan("case.toml", *fine, "--boundary", "outcome", "--seeds", "4")
        self.assertEqual(self.edges(), edges)
        some = points(self.result)
        run = some["outcome"] != 0
        self.assertLess(run.sum(), 0.6 * run.size)
        self.assert_same_points({k: v[run] for k, v in some.items()}, {k: v[run] for k, v in whole.items()})
        self.assertTrue(np.isnan(some["energy"][~run]).all())

        names = outcomes(self.result)
        around = {edge for edge in edges if "pinched" in (names.flat[edge[0]], names.flat[edge[1]])}
        self.scan("case.toml", *fine, "--boundary", "pinched", "--seeds", "4")
        self.assertEqual(self.edges(), around)

    def test_says_what_it_may_miss(self):
        asked = ("case.toml", "--over", f"{AMPLITUDE}=0:0.01:6", "--boundary", "outcome")
        out, _ = self.scan(*asked, "--seeds", "2")
        self.assertIn("regions smaller than 3 values of an axis may be missed: --seeds 5 sees all", out)
        out, _ = self.scan(*asked, "--seeds", "5")
        self.assertNotIn("missed", out)

    def test_refined(self):
        """Between 0.38103 and 0.38104 (an independent spectral code, cases/nearly_pinched.toml) the neck opens again."""
        asked = (CASES / "nearly_pinched.toml", "--over", f"{AMPLITUDE}=0.3:0.5:3", "--over", f"{K42}=0:1e-2:2")
        self.scan(*asked, "--boundary", "pinched", "--refine", "8", "--set", "accuracy.energy=1e-4")
        with h5py.File(self.result) as file:
            edges, crossings = file["boundary"][()].tolist(), file["crossing"][()]
            numbers, stop = file["between/point"][()], file["about"].attrs["stop"]
        self.assertEqual(stop, "finished")
        self.assertEqual(len(numbers), 8 * len(edges))
        low, high = crossings[edges.index([0, 2])]  # k42 = 0, amplitudes 0.3 and 0.4
        self.assertAlmostEqual(high - low, 0.1 / 2**8, places=12)
        self.assertTrue(low < 0.38104 and high > 0.38103, (low, high))
        # A resumed scan knows all results.
        out, _ = self.tubule("scan", *asked, "--boundary", "pinched", "--refine", "8", "--set", "accuracy.energy=1e-4",
                             "--resume", "-o", self.result)
        self.assertIn("nothing to resume", out)
        picture = self.folder / "map.svg"
        self.plot(self.result, "-o", picture)
        self.assertIn("refined", picture.read_text())


class Threads(ScanTest):
    OVER = ("--over", f"{AMPLITUDE}=0.1:0.3:4", "--set", "time.end=0.01", "--to-the-end", "--quiet")

    def workers(self, jobs, **limits):
        limit = lambda: [resource.setrlimit(getattr(resource, name), value) for name, value in limits.items()]  # noqa: E731
        with self.start("scan", "case.toml", *self.OVER, "--jobs", jobs, preexec_fn=limit) as process:
            out, err = process.communicate()
        self.assertEqual(process.returncode, 0, out + err)
        self.assertEqual(len(self.shown("case_scan.hdf")[1]), 4)
        return about(self.folder / "case_scan.hdf")["workers"]

    def test_no_more_than_points(self):
        self.assertEqual(self.workers(100000), 4)
        self.assertEqual(self.workers(3), 3)

    def test_no_more_than_the_system_allows(self):
        """A stack of 2 GB for each thread in 5 GB: the points are run by fewer."""
        hard = resource.getrlimit(resource.RLIMIT_STACK)[1]
        self.assertIn(self.workers(4, RLIMIT_STACK=(2 << 30, hard), RLIMIT_AS=(5 << 30, 5 << 30)), (1, 2, 3))


class Refusals(ScanTest):
    def assert_refused(self, words, *arguments):
        before = self.files()
        _, err = self.tubule("scan", *arguments, "-o", "scan.hdf", status=2)
        self.assertIn(words, err)
        self.assertEqual(self.files(), before)

    def test_bad_input(self):
        over = ("--over", f"{K42}=0,0.1")
        for words, *arguments in (
            ("nothing varies", "case.toml"),
            ("no.toml: cannot be opened", "no.toml", *over),
            ("did you mean 'k42'", "case.toml", "--over", "energy.k24=0,0.1"),
            ("must be a finite number, not the string \"high\"", "case.toml", "--over", f"{K42}=0,high"),
            ("the range is empty", "case.toml", "--over", f"{K42}=1:0:5"),
            ("1 values", "case.toml", "--over", f"{K42}=0:1:1"),
            ("no values", "case.toml", "--over", f"{K42}="),
            ("varies twice", "case.toml", *over, *over),
            ("the scan varies energy.k42", "case.toml", *over, "--set", "energy.k42=1.0"),
            ("--boundary: must be one of outcome, uniform-tube", "case.toml", *over, "--boundary", "pinch"),
            ("--seeds: must be absent", "case.toml", *over, "--seeds", "3"),
            ("--seeds: must be an integer >= 1, not 0", "case.toml", *over, "--boundary", "outcome", "--seeds", "0"),
            ("--refine: must be absent: it is only valid with --boundary", "case.toml", *over, "--refine", "3"),
            ("--refine: must be an integer from 0 to 30, not 31", "case.toml", *over, "--boundary", "outcome", "--refine", "31"),
            ("refine needs numbers: model.kind takes", "case.toml", "--over", 'model.kind="gradient-flow","overdamped"',
             "--boundary", "outcome", "--refine", "3"),
            ("--jobs must be 1 or more", "case.toml", *over, "--jobs", "0"),
            ("points are too many", "case.toml", "--over", f"{K42}=0:1:100000", "--over", f"{AMPLITUDE}=0:0.1:1000"),
            ("below the smallest radius of the initial shape", "case.toml", "--over", f"{AMPLITUDE}=0.1,0.99"),
            ("points.csv: cannot be opened", "case.toml", "--points", "points.csv"),
        ):
            with self.subTest(words):
                self.assert_refused(words, *arguments)

    def test_a_table_has_no_boundary(self):
        self.write("points.csv", "energy.k42\n0\n0.1\n")
        self.assert_refused("exclude each other", "case.toml", "--points", "points.csv", "--boundary", "outcome")

    def test_a_branch_is_no_point(self):
        text = CASE.split("[time]")[0].split("[discretisation]")[0].replace("r_min = 0.05\n", "")
        self.write("rest.toml", text + f'[equilibrium.branch]\nvary = "{K42}"\nto = 0.1\nstep = 0.05\n')
        self.assert_refused("a point of a scan is one shape", "rest.toml", "--over", f"{AMPLITUDE}=0.1,0.2")

    def test_bad_scan_files(self):
        for words, text in (
            ("1:1: unknown key cases; did you mean 'case'?", 'cases = "x"\ncase = "case.toml"\n'),
            ("it needs case", 'over = ["energy.k42=0,1"]\n'),
            ("over must be a list of strings", 'case = "case.toml"\nover = "energy.k42=0,1"\n'),
            ("until must be", 'case = "case.toml"\nover = ["energy.k42=0,1"]\nuntil = "dawn"\n'),
            ("seeds must be an integer", 'case = "case.toml"\nover = ["energy.k42=0,1"]\nseeds = 1.5\n'),
            ("refine must be an integer", 'case = "case.toml"\nover = ["energy.k42=0,1"]\nrefine = 1.5\n'),
            ("not valid TOML", "case = \n"),
            ("gone.toml: cannot be opened", 'case = "gone.toml"\nover = ["energy.k42=0,1"]\n'),
        ):
            with self.subTest(words):
                path = self.write("bad.toml", text)
                self.assert_refused(words, path)
                path.unlink()

    def test_other_files_are_not_replaced(self):
        text = self.result
        text.write_text("mine")
        self.assertIn("is not a scan", self.scan("case.toml", "--over", f"{K42}=0,0.1", status=2)[1])
        self.assertEqual(text.read_text(), "mine")

    def test_another_scan_is_kept(self):
        self.scan("case.toml", "--over", f"{K42}=0,0.1")
        before = self.result.read_bytes()
        _, err = self.tubule("scan", "case.toml", "--over", f"{K42}=0,0.2", "-o", self.result, status=2)
        self.assertIn("--overwrite", err)
        self.assertEqual(self.result.read_bytes(), before)
        self.tubule("scan", "case.toml", "--over", f"{K42}=0,0.1", "-o", self.result)  # the same may be made again
        self.scan("case.toml", "--over", f"{K42}=0,0.2")
        self.assertNotEqual(self.result.read_bytes(), before)

    def test_resume_with_another_scan(self):
        self.scan("case.toml", "--over", f"{K42}=0,0.1")
        before = self.result.read_bytes()
        for other in (("--over", f"{K42}=0,0.2"), ("--over", f"{K42}=0,0.1", "--set", "time.end=1.0")):
            self.assertIn("another scan", self.scan("case.toml", *other, "--resume", status=2)[1])
        self.assertIn("nothing to resume", self.scan("case.toml", "--over", f"{K42}=0,0.1", "--resume")[0])
        self.assertEqual(self.result.read_bytes(), before)
        self.assertEqual(self.files(), {"case.toml", "scan.hdf"})


class Kill(ScanTest):
    def shown(self):
        """Finished points, as `tubule show` has them: number to line."""
        out, _ = self.tubule("show", self.result, "--csv")
        return {int(line.split(",")[0]): line for line in out.splitlines()[1:]}

    def disturbed(self, signal_number, least, command=(), *arguments):
        """Starts or resumes the slow scan and sends a signal once `least` points are finished; what was finished."""
        command = [*command, PROGRAM, "scan", "case.toml", *SLOW, "-o", str(self.result), "--resume", "--quiet", *arguments]
        process = subprocess.Popen(command, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.wait(process, lambda: finished_points(self.result) >= least)
        self.signal(process, signal_number)
        process.communicate()
        return process.returncode, self.shown()

    def signal(self, process, signal_number):
        process.send_signal(signal_number)

    def assert_kept(self, before):
        """Points that were finished were not run again: even the seconds they took are the same."""
        after = self.shown()
        self.assertEqual({point: after[point] for point in before}, before)

    def test_disturbed_again_and_again(self):
        known = {}
        for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGKILL):
            status, finished = self.disturbed(number, len(known) + 1)
            self.assert_kept(known)
            known = finished
            if number == signal.SIGKILL:
                self.assertEqual(status, -number)
                self.assertIn("none yet", self.tubule("show", self.result)[0])
            else:
                self.assertEqual((status, about(self.result)["stop"]), (130, "interrupted"))
                self.assertEqual(self.files(), {"case.toml", "scan.hdf"})
        out, _ = self.scan("case.toml", *SLOW, "--resume")
        self.assertIn(f"{12 - len(known)} run now", out)
        self.assert_kept(known)
        self.assertEqual(self.files(), {"case.toml", "scan.hdf"})
        self.assertEqual(about(self.result)["stop"], "finished")
        resumed = points(self.result)
        self.scan("case.toml", *SLOW)
        self.assert_same_points(points(self.result), resumed)

    def test_a_boundary_goes_on(self):
        """After a kill the scan follows the same boundary as without."""
        fine = ("--over", f"{AMPLITUDE}=0.2:0.5:10", "--over", f"{K42}=1e-5:1e-2:10:log", "--boundary", "outcome")
        self.scan("case.toml", *fine)
        whole = points(self.result)
        self.result.unlink()
        process = self.start("scan", "case.toml", *fine, "-o", self.result, "--quiet")
        self.wait(process, lambda: finished_points(self.result) >= 20)
        process.kill()
        process.communicate()
        self.scan("case.toml", *fine, "--resume")
        self.assert_same_points(points(self.result), whole)


@unittest.skipIf(MPIRUN, "built with MPI")
class WithoutMpi(ProgramTest):
    def test_processes_of_an_mpirun_are_refused(self):
        done = subprocess.run([PROGRAM, "scan", self.write("case.toml", UNDULATED_TUBE), "--over", "energy.k42=0,0.1"], cwd=self.folder,
                              env=os.environ | {"OMPI_COMM_WORLD_SIZE": "2"}, capture_output=True, text=True)  # fmt: skip
        self.assertEqual(done.returncode, 2, done)
        self.assertIn("install libopenmpi-dev and openmpi-bin", done.stderr)


@unittest.skipUnless(MPIRUN, "built without MPI")
class Ranks(Kill):
    """The same across the processes of an mpirun."""

    def mpirun(self, ranks):
        # Tests may run as root in a container, with fewer processors than ranks.
        return [MPIRUN, "--allow-run-as-root", "--oversubscribe", "-n", str(ranks)]

    def on_ranks(self, ranks, *arguments):
        command = [*self.mpirun(ranks), PROGRAM, "scan", *map(str, arguments), "-o", str(self.result)]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True)

    @study
    def test_disturbed_again_and_again(self):
        """A rank dies: MPI ends the others, and a resumed scan loses nothing."""
        status, known = self.disturbed(signal.SIGKILL, 2, self.mpirun(3))
        self.assertNotEqual(status, 0)
        done = self.on_ranks(2, "case.toml", *SLOW, "--resume")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assert_kept(known)
        self.assertIn(f"{12 - len(known)} run now", done.stdout)
        self.assertEqual(self.files(), {"case.toml", "scan.hdf"})

    def signal(self, process, signal_number):
        """To the last rank, not to mpirun, or to whichever rank if that one is gone."""
        folder = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        ranks = [int(child) for child in folder.read_text().split()]
        os.kill(ranks[-1], signal_number)

    def test_same_content_on_any_number(self):
        self.scan("case.toml", *MAP)
        alone = points(self.result)
        for ranks in (2, 4):
            done = self.on_ranks(ranks, "case.toml", *MAP)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(about(self.result)["workers"], ranks)
            self.assert_same_points(points(self.result), alone)

    def test_a_boundary_goes_on(self):
        fine = ("case.toml", *MAP, "--boundary", "outcome", "--seeds", "2")
        self.scan(*fine)
        alone = points(self.result)
        self.assertEqual(self.on_ranks(3, *fine).returncode, 0)
        self.assert_same_points(points(self.result), alone)

    def test_refusals(self):
        done = self.on_ranks(2, "case.toml", "--over", "energy.k24=0,1")
        self.assertEqual(done.returncode, 2)
        self.assertIn("did you mean 'k42'", done.stderr)
        done = self.on_ranks(2, "case.toml", *MAP, "--jobs", "2")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--jobs must be absent under mpirun", done.stderr)
        self.assertEqual(self.files(), {"case.toml"})


class Shown(ScanTest):
    def test_words_csv_json(self):
        self.scan("case.toml", *MAP)
        out, _ = self.tubule("show", self.result)
        self.assertIn("0.3 to 0.5, 3 values", out)
        self.assertIn("right: shape.mode.0.amplitude; up: energy.k42", out)
        rows = list(csv.DictReader(io.StringIO(self.tubule("show", self.result, "--csv")[0])))
        values, names = points(self.result), outcomes(self.result)
        self.assertEqual([row["outcome"] for row in rows], list(names.flat))
        self.assertEqual([float(row["energy"]) for row in rows], list(values["energy"].flat))
        self.assertEqual(float(rows[-1][AMPLITUDE]), 0.5)
        document = json.loads(self.tubule("show", self.result, "--json")[0])
        self.assertEqual([p["r_min"] for p in document["points"]], list(values["r_min"].flat))
        self.assertEqual(document["case"]["text"], CASE)
        self.assertIn("no frames", self.tubule("show", self.result, "--csv", "--frame", "0", status=2)[1])
        for name in ("height", "tension", "pressure", "growth", "free_energy"):  # of equilibria only
            self.assertTrue(np.isnan(values[name]).all(), name)
            self.assertEqual({row[name] for row in rows}, {"nan"})
            self.assertEqual({p[name] for p in document["points"]}, {None})

    def test_pictures(self):
        picture = self.folder / "map.svg"
        self.scan("case.toml", *MAP)
        self.plot(self.result, "-o", picture)
        text = picture.read_text()
        for words in ("amplitude A", "k\u2084\u2082", *(f"{name} (" for name in set(outcomes(self.result).flat))):
            self.assertIn(words, text)
        self.assertNotIn("longest unduloid", text)  # only k42 = 0 has this closed form
        self.scan("case.toml", "--over", f"{AMPLITUDE}=0.1,0.2,0.3")
        self.plot(self.result, "-o", picture)
        self.assertIn("energy where the run stopped", picture.read_text())
        for words, *arguments in (("drawn alone", "--times", "0.1"), ("drawn alone", self.result)):
            self.assertIn(words, self.plot(self.result, *arguments, "-o", picture, status=2)[1])
        three = ("--over", "energy.k20=0.2,0.3", "--over", "energy.H0=-2.0,-1.9", "--over", f"{AMPLITUDE}=0,0.1")
        self.scan("case.toml", *three)
        self.assertIn("this scan 3", self.plot(self.result, "-o", picture, status=2)[1])

    def test_closed_forms(self):
        """Unduloids of mean curvature H0 have periods of 4/|H0| to 2 pi/|H0| (Delaunay)."""
        self.scan("case.toml", "--over", "shape.length=1.5:6:4", "--over", "energy.H0=-2:-1:3", "--set", "time.end=1e-3")
        with h5py.File(self.result) as file:
            L, H0 = (file[f"axes/{i}/values"][:, 0] for i in (0, 1))
            for name, product in (("longest_unduloid", 2 * np.pi), ("shortest_unduloid", 4)):
                line = file["thresholds"][name]
                first, second = line["first"][()], line["second"][()]
                self.assertTrue(min(first.size, second.size) >= 65 and set(L) <= set(first) and set(H0) <= set(second))
                expected = np.outer(first, -second) - product
                np.testing.assert_allclose(line["values"][()], expected, atol=1e-12)
        picture = self.folder / "map.svg"
        self.plot(self.result, "-o", picture)
        self.assertIn("longest unduloid, L|H\u2080| = 2\u03c0", picture.read_text())
        # Area differences cost energy on all of these but one: no line.
        self.write("ade.toml", CASE.replace('parametrisation = "graph"', "").replace("k20 = ", "alpha = 0.01\nM0 = -20\nk20 = "))
        self.scan("ade.toml", "--over", "shape.length=1.5:6:4", "--over", "energy.H0=-2:-1:3", "--set", "time.end=1e-3")
        with h5py.File(self.result) as file:
            self.assertEqual([name for name in file["thresholds"] if "unduloid" in name], [])

    def check_line(self, found, exact):
        """The same sides of the line everywhere, and the same values beside it."""
        np.testing.assert_array_equal(np.sign(np.round(found, 9)), np.sign(np.round(exact, 9)))
        near = np.zeros(found.shape, bool)
        for axis in (0, 1):
            crossed = np.diff(np.sign(found), axis=axis) != 0
            for side in (0, -1):
                near |= np.insert(crossed, crossed.shape[axis] if side else 0, False, axis=axis)
        self.assertGreater(near.sum(), 60)
        np.testing.assert_allclose(found[near], exact[near], rtol=1e-9, atol=1e-12)

    def test_pearling_and_buckling(self):
        """theory.md (5.21), (5.23) with Sigma = 0 (free volume), c = H0 R, x = q^2: neutral where
        (1 + k42/k20) x^2 + 2 c x + 1 = 0, m = 0, and where (1 + k42/k20) x + 2 (1 + c) = 0, m = 1. No wave
        with m = 2 grows, as Sigma > -3 and c > -5/2, theory.md (5.24)."""
        case = CASE.replace("[shape]", '[model]\nkind = "overdamped"\nvolume = "free"\n[shape]')
        self.write("free.toml", case.replace('parametrisation = "graph"', ""))
        k20, M0, n = 0.2, -40, np.arange(1, 40)
        for alpha in (0, 0.01):  # theory.md (2.20): H0 - alpha (M - M0)/(2 k20) stands for H0, M = -2 pi L
            sets = ("--set", f"energy.alpha={alpha}", "--set", f"energy.M0={M0}") if alpha else ()
            self.scan("free.toml", "--over", "shape.length=3:12:4", "--over", f"{K42}=0:1:3", "--set", "time.end=1e-9", *sets)
            with h5py.File(self.result) as file:
                line = file["thresholds/pearling"]
                found, first, second = (line[name][()] for name in ("values", "first", "second"))
                buckling = file["thresholds/buckling/values"][()]
                self.assertNotIn("ovalisation", file["thresholds"])
            x, k = (2 * np.pi * n / first[:, None, None]) ** 2, second[:, None]
            c = -2 + alpha * (2 * np.pi * first[:, None, None] + M0) / (2 * k20)
            self.check_line(found, -2 * k20 * ((1 + k / k20) * x**2 + 2 * c * x + 1).min(axis=2))
            self.check_line(buckling, (-2 * k20 * x * ((1 + k / k20) * x + 2 * (1 + c))).max(axis=2))

    def test_thresholds_of_tensions(self):
        """theory.md (5.20), (5.21) at the tension of a reservoir, with c = H0 R and x = q^2."""
        model = '[model]\nkind = "overdamped"\narea = "reservoir"\n[shape]'
        self.write("fed.toml", CASE.replace("[shape]", model).replace('parametrisation = "graph"', ""))
        self.scan("fed.toml", "--over", "shape.length=3:12:4", "--over", "model.tension=0:2:3", "--set", "time.end=1e-9")
        with h5py.File(self.result) as file:
            line = file["thresholds/pearling"]
            found, first, second = (line[name][()] for name in ("values", "first", "second"))
        k20, c, n = 0.2, -2, np.arange(1, 40)
        x = (2 * np.pi * n / first[:, None, None]) ** 2
        reduced = second[:, None] / (2 * k20) + (c * c - 1) / 2
        self.check_line(found, -2 * k20 * (x**2 + (reduced + 2 * c) * x + 1 - reduced).min(axis=2))

    def test_the_file_says_what_was_asked(self):
        text = f'title = "A small one"\ncase = "case.toml"\nover = ["{K42}=0,0.1"]\nset = ["{AMPLITUDE}=0.2"]\n'
        self.write("small.toml", text)
        self.tubule("scan", "small.toml")
        with h5py.File(self.folder / "small.hdf") as file:
            self.assertEqual(file["scan/text"][()].decode(), text)
            self.assertEqual(file["case"][()].decode(), CASE)
            self.assertEqual(list(file["case"].attrs["set"]), [f"{AMPLITUDE}=0.2"])
            self.assertEqual(file["axes/0/values"][:, 0].tolist(), [0, 0.1])
            self.assertEqual(list(file["axes/0"].attrs["keys"]), [K42])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
