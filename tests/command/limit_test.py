#!/usr/bin/python3
"""Limits of time and memory: `time.limit` and Ctrl-C end meshes, starts, equilibria, spectra and steps in time, and
what cannot fit into memory is refused before it is tried. Argument: the program.

The times are those that the user asked for, with generous room for slow machines; without these limits each of the runs
takes many times longer."""
import os
import resource
import signal
import subprocess
import time
import unittest
from pathlib import Path

from program import CAPSULE, QUICK, ProgramTest, about

LIMIT, ROOM = 0.2, 12  # seconds: what is asked, and when it must have ended on any machine

SURFACE = QUICK.replace('tier = "axisym"', 'tier = "surface3d"')
# Its meridian is found by a search at every point, and its rim asks for many small elements.
PANCAKE = """tier = "axisym"
energy = {k20 = 1.0}
model = {kind = "overdamped"}
shape = {kind = "ellipsoid", a = 1.0, b = 1.0, c = 0.0071}
accuracy = {energy = 0.095}
discretisation = {elements = 100000}
time = {end = 1.0}
"""
# Area and volume of a shape far from the start, and an accuracy that takes long.
EQUILIBRIUM = """tier = "axisym"
energy = {k20 = 0.125, k42 = 0.12}
shape = {kind = "ellipsoid", a = 0.7, b = 0.7, c = 1.7}
accuracy = {energy = 1e-9}
equilibrium = {area = 14.4, volume = 0.0024}
"""
BRANCH = CAPSULE + 'modes = 2\n[equilibrium.branch]\nvary = "energy.k42"\nto = 0.0\nstep = 0.001\n'


# 80 triangles, and a shape without symmetry whose trial runs take seconds.
FEW = """tier = "surface3d"
energy.k20 = 1.0
model.kind = "stokes"
shape = {kind = "ellipsoid", a = 1.0, b = 0.9, c = 1.3}
accuracy.energy = 0.1
discretisation = {elements = 80, order = 3}
time.end = 0.01
"""
ROUGH = """tier = "surface3d"
energy.k20 = 1.0
model.kind = "auto"
shape = {kind = "sphere", radius = 1.0, mode = [{amplitude = 0.3, l = 4, m = 3}]}
accuracy.energy = 0.01
time.end = 1e6
"""


class TimeLimit(ProgramTest):
    def ends_in_time(self, command, text, *sets):
        case = self.write("limited.toml", text)
        begin = time.monotonic()
        out, err = self.tubule(command, case, "--quiet", *sets, "--set", f"time.limit={LIMIT}", status=5)
        self.assertLess(time.monotonic() - begin, LIMIT + ROOM)
        self.assertIn(f"reached the time limit of {LIMIT} s (time.limit)", out + err)

    def test_in_the_start_of_graphs(self):
        self.ends_in_time("run", QUICK, "--set", "discretisation.elements=100000")

    def test_in_the_start_of_curves(self):
        self.ends_in_time("run", PANCAKE)

    def test_in_the_mesh_of_a_surface(self):
        self.ends_in_time("run", SURFACE, "--set", "discretisation.elements=100000", "--set", "discretisation.order=2")

    def test_in_the_mesh_of_a_tube_of_almost_no_radius(self):
        text = 'tier = "surface3d"\nenergy.k20 = 1.0\n[shape]\nkind = "formula"\nr = "1e-30"\nlength = 4.0\n'
        case = self.write("thin.toml", text + f"[accuracy]\nenergy = 0.01\n[time]\nend = 1e-3\nlimit = {LIMIT}\n")
        begin = time.monotonic()
        with self.start("run", case, "-o", self.result) as process:
            process.wait(timeout=LIMIT + 10 * ROOM)
        self.assertNotEqual(process.returncode, 0)
        self.assertLess(time.monotonic() - begin, LIMIT + ROOM)

    def test_in_trial_runs_that_choose_a_model(self):
        out, err = self.tubule("run", self.write("rough.toml", ROUGH), "--set", "time.limit=0.01", status=5)
        self.assertEqual((out + err).removeprefix(f"{self.folder}/"), "rough.toml: reached the time limit of 0.01 s (time.limit) before the first state was "
                         "computed, in trial runs that choose the model: name it in model.kind\n")  # fmt: skip
        self.assertIn("expected: unknown: trial runs that choose the model reach the time limit of 0.01 s (time.limit)",
                      self.tubule("check", "rough.toml", "--set", "time.limit=0.01")[1])  # fmt: skip

    def test_in_a_descent_to_an_equilibrium(self):
        self.ends_in_time("equilibrium", EQUILIBRIUM)

    def test_along_a_branch_whose_shapes_so_far_are_kept(self):
        self.ends_in_time("equilibrium", BRANCH)
        shown = self.shown(self.folder / "limited.hdf")[1]
        self.assertGreater(len(shown), 0)
        self.assertLess(len(shown), 121)

    def test_a_case_at_rest_has_a_limit_and_nothing_else_of_time(self):
        case = self.write("limited.toml", EQUILIBRIUM + "[time]\nend = 1.0\nlimit = 2\n")
        self.assertIn("time.end must be absent: only valid with a motion, without [equilibrium]", self.refused("check", case))


class CtrlC(ProgramTest):
    def computing(self, *arguments, seconds=0.1, **options):
        """A process that has used so many seconds of processor time."""
        process, stat = self.start(*arguments, **options), lambda: Path(f"/proc/{process.pid}/stat").read_text()
        self.wait(process, lambda: int(stat().rsplit(")")[1].split()[11]) / os.sysconf("SC_CLK_TCK") > seconds)
        return process

    def ends_when_interrupted(self, *command, words="interrupted", **options):
        process = self.computing(*command, **options)
        process.send_signal(signal.SIGINT)
        begin = time.monotonic()
        out, err = process.communicate()
        self.assertLess(time.monotonic() - begin, ROOM)
        self.assertEqual(process.returncode, 130, out + err)
        self.assertIn(words, out + err)

    def test_in_an_equilibrium(self):
        self.ends_when_interrupted("equilibrium", self.write("cell.toml", EQUILIBRIUM), "--set", "equilibrium.volume=1e-9")

    def test_in_a_start(self):
        self.ends_when_interrupted("run", self.write("pancake.toml", PANCAKE))

    def test_in_growth_rates(self):
        self.ends_when_interrupted("stability", self.case, "--waves", "10000", "--modes", "100", "--model", "all")

    def test_in_trial_runs_that_choose_a_model(self):
        words = "rough.toml: a signal ended the run before the first state was computed\n"
        self.ends_when_interrupted("run", self.write("rough.toml", ROUGH), words=words)
        self.ends_when_interrupted("check", self.write("rough.toml", ROUGH))

    def test_in_values_that_extend_a_scan(self):
        case = self.write("scanned.toml", QUICK)
        self.tubule("scan", case, "--over", "energy.k20=0.5,0.6", "-o", "scan.hdf", "--quiet")
        self.ends_when_interrupted("scan", "scan.hdf", "--extend", "--over", "energy.k20=1:2:500000", seconds=0.4)

    def test_one_that_is_ignored_from_the_beginning_stays_ignored(self):
        # As a shell does for background jobs of a script.
        with self.computing("run", self.write("pancake.toml", PANCAKE), "--set", "time.limit=1",
                            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN)) as process:  # fmt: skip
            process.send_signal(signal.SIGINT)
            out, err = process.communicate()
        self.assertEqual(process.returncode, 5, out + err)

    def test_a_second_one_ends_at_once_and_leaves_a_file_that_opens(self):
        process = self.computing("run", self.write("pancake.toml", PANCAKE))
        for _ in range(2):
            process.send_signal(signal.SIGINT)
            time.sleep(0.05)
        process.communicate()
        self.assertEqual(process.returncode, -signal.SIGINT)
        if (self.folder / "pancake.hdf").exists():
            self.assertIn("pancake.hdf", self.tubule("show", "pancake.hdf")[0])


class Memory(ProgramTest):
    def with_memory(self, mib, *arguments):
        with self.start(*arguments, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (mib << 20,) * 2)) as process:
            try:
                out, err = process.communicate(timeout=60)
            except subprocess.TimeoutExpired:
                process.kill()
                raise
        return process.returncode, out + err

    def test_little_of_it_ends_the_program(self):
        # OpenBLAS asks for 128 MB, forever if there are none; its threads do so before the program begins.
        case = self.write("small.toml", FEW)
        self.assertEqual(self.with_memory(140, "--version")[0], 0)
        for mib in range(100, 401, 60):
            with self.subTest(mib=mib):
                status, words = self.with_memory(mib, "run", case, "--quiet", "--overwrite")
                self.assertIn(status, (0, 4), words)
                self.assertIn("memory" if status == 4 else "", words)
        self.assertEqual(status, 0)

    def test_a_mesh_that_does_not_fit_is_refused(self):
        case = self.write("large.toml", SURFACE)
        resource.setrlimit(resource.RLIMIT_AS, (4 << 30, resource.RLIM_INFINITY))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_AS, (resource.RLIM_INFINITY,) * 2)
        out, err = self.tubule("run", case, "--set", "discretisation.elements=1000000", status=4)
        self.assertRegex(
            out + err,
            r"a surface of 1000000 triangles of order 4 would take about \S+ GB of memory, but only \S+ GB are free: "
            r"use fewer elements \(discretisation.elements\)",
        )

    def test_elements_that_rounding_asks_for_are_bounded(self):
        # Waves of .1 on a radius of 2e9 are lost in rounding, which no mesh resolves: 4000 elements of a cell at most.
        self.tubule("run", self.case, "--set", "shape.radius=2147483648", "--set", "time.limit=60", status=4)
        self.assertEqual(about(self.result)["stop"], "resolution-lost")
        self.assertLessEqual(about(self.result)["elements"], 4000)


class Cost(ProgramTest):
    def test_of_many_frames_is_told_by_the_first(self):
        err = self.tubule("run", self.case, "--set", 'time.output="0:0.2:20000"', "--set", "time.limit=0.05", status=5)[1]
        self.assertRegex(err, r"case.toml: time.output asks for 20001 frames: a result of about \d+ MB, which takes 17 s and \d+ MB of memory\n")

    def test_of_many_triangles_at_rest_is_told_before(self):
        rest = 'tier = "surface3d"\nenergy.k20 = 1.0\nshape = {kind = "sphere", radius = 1.0}\ndiscretisation.elements = 1000000\n'
        told = r"rest.toml: expected: about 1000000 triangles of order 4; about \d:\d\d, \d+000 MB\n"
        self.assertRegex(self.tubule("check", self.write("rest.toml", rest))[1], told)
        with self.start("run", self.folder / "rest.toml") as process:
            self.addCleanup(process.kill)
            self.assertRegex(process.stderr.readline(), told)
            process.send_signal(signal.SIGINT)
            process.communicate()
            self.assertEqual(process.returncode, 130)

    def test_of_many_waves_is_small(self):
        began = time.monotonic()
        out, _ = self.tubule("stability", self.case, "--waves", "10000", "--modes", "10", "--csv")
        self.assertEqual(out.count("\n"), 11 * 10001)  # a header, but no n = 0 of m = 1, a shift
        self.assertLess(time.monotonic() - began, 60)


class NoEquilibrium(ProgramTest):
    def fails(self, text, *words, status=4):
        out, err = self.tubule("equilibrium", self.write("cell.toml", text), "--quiet", status=status)
        for word in words:
            self.assertIn(word, out + err)

    def test_an_energy_without_minimum(self):
        # f_HH = 2 k20 + 12 k40 H^2 = -2 + .012 on the tube: short waves lower the energy.
        tube = 'tier = "axisym"\n[energy]\nk20 = -1.0\nk40 = 0.001\n[shape]\nkind = "tube"\nradius = 1.0\nlength = 4.0\n'
        self.fails(tube + '[equilibrium]\nheld = "area"\n', "the energy has no minimum there", "see the moduli in [energy]")

    def test_a_volume_that_no_shape_has(self):
        # The isoperimetric inequality: at most 6^(3/2)/(6 pi^(1/2)) = 1.38198.
        self.fails(
            EQUILIBRIUM.replace("area = 14.4", "area = 6.0").replace("0.0024", "1.4"),
            "cell.toml:5:37: equilibrium.volume must be at most 1.38198: no shape with this equilibrium.area encloses more",
            status=2,
        )

    def test_a_volume_that_no_tube_has(self):
        # In a period of 4 a ball of area 6 encloses 1.38198, more than a cylinder, 36/(16 pi).
        tube = 'tier = "axisym"\n[energy]\nk20 = 1.0\n[shape]\nkind = "tube"\nradius = 0.25\nlength = 4.0\n'
        self.fails(
            tube + "[equilibrium]\narea = 6.0\nvolume = 1.4\n",
            "equilibrium.volume: a volume of 1.4 a period is impossible: an area of 6 encloses at most 1.38198",
            status=2,
        )


if __name__ == "__main__":
    import sys

    unittest.main(argv=sys.argv[:1])
