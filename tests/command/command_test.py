#!/usr/bin/python3
"""The program `tubule` as its users see it: exit statuses, messages, files.

command_test.py TUBULE
"""
import json
import os
import re
import shlex
import sys
import tomllib
import unittest
from pathlib import Path

import h5py
import numpy as np

from program import QUICK, ProgramTest, about, series

EXPECT = """
[expect]
energy = {value = 100, abs = 1}
[[expect.at]]
time = 0.03
r_min = {value = 0.9, abs = 0.2}
energy_42 = {value = -7, abs = 1e-3}
"""

# Its seams make waves that few triangles do not resolve.
ROUGH = """tier = "surface3d"
energy = {k20 = 0.125, k42 = 0.12}
model = {kind = "fluid"}
shape = {kind = "capsule", radius = 0.5, length = 1.0}
accuracy = {energy = 1e-3}
time = {end = 0.005}
"""

# Moves in three dimensions: 1 s.
SURFACE = """tier = "surface3d"
energy = {k20 = 1.0}
model = {kind = "overdamped"}
shape = {kind = "ellipsoid", a = 1.0, b = 0.9, c = 0.8}
accuracy = {energy = 1e-2}
discretisation = {elements = 80, order = 3}
time = {end = 0.02}
"""


class Run(ProgramTest):
    def test_result_is_named_after_the_case_and_in_the_current_folder(self):
        case = self.write("elsewhere/tube.toml", QUICK)
        out, err = self.tubule("run", case)
        self.assertEqual(self.files(), {"case.toml", "elsewhere", "tube.hdf"})
        self.assertIn(f"{case}: finished at t = 0.2: reached time.end", out)
        self.assertEqual(about(self.folder / "tube.hdf")["stop"], "finished")
        with h5py.File(self.folder / "tube.hdf") as file:
            self.assertEqual(file["case"].asstr()[()], QUICK)
            times = [file["frames"][name].attrs["time"] for name in sorted(file["frames"])]
        self.assertEqual(times, [0, 0.01, 0.05, 0.2])

    def test_output_names_the_result(self):
        self.tubule("run", self.case, "-o", "other.hdf")
        self.assertEqual(self.files(), {"case.toml", "other.hdf"})

    def test_set_changes_the_case_and_is_kept(self):
        self.tubule("run", self.case, "--set", "energy.k42=0.4", "--set", "time.output=[]")
        with h5py.File(self.result) as file:
            self.assertEqual(list(file["case"].attrs["set"]), ["energy.k42=0.4", "time.output=[]"])
            self.assertEqual(len(file["frames"]), 2)
        changed = series(self.result)["energy_42"][0]
        self.tubule("run", self.case, "--overwrite")
        # k42 is a factor of its term; the meshes of both runs hold the start within the requested accuracy, 1e-6 E_ref.
        self.assertAlmostEqual(changed, 4 * series(self.result)["energy_42"][0], delta=2e-4)

    def test_several_cases(self):
        second = self.write("second.toml", QUICK)
        out, _ = self.tubule("run", self.case, second, "--set", "time.end=0.1")
        self.assertEqual(self.files(), {"case.toml", "second.toml", "case.hdf", "second.hdf"})
        self.assertEqual(out.count("finished at t = 0.1"), 2)

    def test_status_of_several_cases_is_the_first_that_is_not_0(self):
        second = self.write("second.toml", QUICK)
        # It shrinks, and 0.8 counts as a pinch-off.
        third = self.write("third.toml", QUICK.replace("-1.0", "-2.0").replace("1e-6", "1e-6\nr_min = 0.8"))
        self.tubule("run", self.case, third, second, "--quiet", status=3)
        self.assertTrue((self.folder / "second.hdf").exists())

    def test_quiet_is_silent(self):
        self.assertEqual(self.tubule("run", self.case, "--quiet"), ("", ""))
        self.write("case.toml", QUICK + EXPECT.replace("100", "0").replace("-7, abs = 1e-3", "0, abs = 1"))
        self.assertEqual(self.tubule("run", self.case, "--quiet", "--expect"), ("", ""))

    def test_a_result_is_replaced(self):
        self.tubule("run", self.case)
        self.tubule("run", self.case, "--set", "time.end=0.1", "--overwrite")
        self.assertEqual(series(self.result)["time"][-1], 0.1)

    def test_check_derivatives(self):
        out, _ = self.tubule("run", self.case, "--check-derivatives")
        for term in ("k20", "k42"):
            self.assertRegex(out, rf"case.toml: {term}\ngradient: right, .*\nHessian : right, ")
        self.assertNotIn("k40", out)  # not in use
        self.assertNotIn("alpha", out)
        self.assertTrue(self.result.exists())
        out, _ = self.tubule("run", self.case, "--check-derivatives", "--overwrite", "--set", "energy.alpha=0.3", "--set", "energy.M0=-20")
        for term in ("k20", "k42", "alpha"):
            self.assertRegex(out, rf"case.toml: {term}\ngradient: right, .*\nHessian : right, ")


class Physics(ProgramTest):
    """What surprises in cases that are valid is said by `check` and `run`, and by nobody with --quiet."""

    ONE_WAVE = QUICK.replace("[accuracy]", '[model]\nkind = "overdamped"\n[accuracy]', 1)
    ONE_WAVE = ONE_WAVE.replace("[[shape.mode]]\namplitude = 0.05\nn = 2\nphase = 1.1\n", "")

    def said(self, text, *sets):
        case = self.write("case.toml", text)
        checked = self.tubule("check", "--quick", case, *sets)[1]
        self.assertEqual(self.tubule("run", case, "-o", self.result, "--overwrite", *sets)[1].count("note:"), checked.count("note:"))
        self.assertEqual(self.tubule("run", case, "-o", self.result, "--overwrite", "--quiet", *sets), ("", ""))
        return checked

    def test_a_single_wave_that_is_frozen(self):
        words = self.said(self.ONE_WAVE)
        self.assertIn("case.toml:12:1: note: shape.mode is a single wave, and can hardly move: area, volume and length are fixed", words)
        self.assertIn('model.volume = "free", model.area = "reservoir" or model.period = "free"', words)
        for change in ("model.volume=free", "model.area=reservoir", "model.kind=gradient-flow"):
            self.assertEqual(self.said(self.ONE_WAVE, "--set", change), "", change)
        self.assertEqual(self.said(QUICK), "")

    def test_the_sign_of_H0(self):
        words = self.said(QUICK, "--set", "energy.H0=2")
        self.assertIn("--set energy.H0=2: note: energy.H0 = 2 is positive, but H is negative on a tube: -1/radius = -1 here", words)
        sphere = QUICK.split("[shape]")[0] + "[shape]\nkind = 'sphere'\nradius = 2.0\n[time]\nend = 1e-3\n"
        self.assertIn("case.toml:6:6: note: energy.H0 = 1 is positive, but H is negative on a sphere: -2/radius = -1 here",
                      self.said(sphere.replace("H0 = -1.0", "H0 = 1.0")))  # fmt: skip
        self.assertEqual(self.said(sphere), "")

    def test_a_balance_that_is_off(self):
        # Waves of the seams are lost on 80 triangles. (A run that estimates its error would make more of them.)
        case = self.write("case.toml", ROUGH.replace("1e-3}", "1e-4, estimate = false}\ndiscretisation = {elements = 80, order = 2}"))
        out, _ = self.tubule("run", case, "-o", self.result, "--set", "time.end=1e-3")
        defect, reference = np.abs(series(self.result)["identity_defect"]).max(), about(self.result)["E_ref"]
        self.assertGreater(defect, 3e-4 * reference)
        self.assertIn(f"warning: the energy balance is off by {defect:.2g}, {defect / reference:.2g} of E_ref (series identity_defect)", out)
        self.assertIn("the energy balance is off by", self.tubule("show", self.result)[0])
        self.assertNotIn("balance", self.tubule("run", self.write("quick.toml", QUICK))[0])


class Refused(ProgramTest):
    """Bad input: exit status 2, and nothing is written."""

    def test_unknown_key(self):
        bad = self.write("bad.toml", QUICK.replace("radius", "raduis"))
        self.assertIn("bad.toml:10:1: unknown key shape.raduis; did you mean 'radius'?", self.refused("run", bad))
        # The good case before it is not run either.
        self.refused("run", self.case, bad)

    def test_unknown_key_in_set(self):
        self.assertIn("k43", self.refused("run", self.case, "--set", "energy.k43=1"))

    def test_impossible_shape(self):
        self.assertIn("shape", self.refused("run", self.case, "--set", "shape.mode.0.amplitude=1.5"))

    def test_no_case(self):
        self.assertIn("nowhere.toml", self.refused("run", "nowhere.toml"))
        self.assertIn("CASE", self.refused("run"))

    def test_no_folder_to_write_to(self):
        scan = ("scan", self.case, "--over", "energy.k42=0,0.1")
        for command in (("run", self.case), scan):
            self.assertEqual(self.refused(*command, "-o", "nowhere/x.hdf"),
                             "nowhere/x.hdf: cannot be written: there is no folder nowhere; make it, or choose another "
                             "file with -o\n")  # fmt: skip

    def test_output_that_is_no_result(self):
        self.assertIn("case.toml", self.refused("run", self.case, "-o", "case.toml"))
        self.assertEqual(self.case.read_text(), QUICK)

    def test_one_output_for_two_cases(self):
        second = self.write("second.toml", QUICK)
        self.assertIn("-o", self.refused("run", self.case, second, "-o", "x.hdf"))

    def test_two_cases_of_one_name(self):
        second = self.write("elsewhere/case.toml", QUICK)
        self.assertIn("case.hdf", self.refused("run", self.case, second))

    def test_unknown_subcommand_and_option(self):
        self.assertIn("tubule: not expected: walk", self.refused("walk", self.case))
        self.assertIn("tubule: not expected: Run case.toml; did you mean 'run'?\n", self.refused("Run", "case.toml"))
        self.assertIn("not expected: case.toml; to run a case: tubule run case.toml\n", self.refused("case.toml"))
        self.assertIn("not expected: x.hdf; to look at a result: tubule show x.hdf\n", self.refused("x.hdf"))
        message = self.refused("run", self.case, "--fast")
        self.assertRegex(message, r"^tubule run: not expected: --fast; options are .* --set .*by --set key=value\nRun `tubule run --help`")
        self.assertIn("; the commands are run equilibrium", self.refused("simulate", self.case))
        self.assertIn("; options follow the name of a command", self.refused("-o", self.result, "run", self.case))
        self.assertIn("; an option begins with the hyphen", self.refused("run", self.case, "\u2013o"))
        self.assertIn("; did you mean case.toml?", self.refused("run", str(self.case).replace("case", "cases")))
        self.assertIn("; ~ does not stand for the home directory", self.refused("run", "~/case.toml"))
        self.assertIn("not expected: stabilty; did you mean 'stability'?", self.refused("help", "stabilty"))
        self.assertIn("--output: a value is missing after it: result file", self.refused("run", self.case, "-o"))
        self.assertIn("RESULT: 2 are needed, 1 given", self.refused("compare", "x.hdf"))
        self.assertIn("--csv and --json cannot be given together", self.refused("show", "x.hdf", "--csv", "--json"))
        self.assertIn("a value with blanks stands in quotes: --set 'time", self.refused("run", self.case, "--set", "time.output=[0.1,", "0.2]"))
        words = self.refused("scan", self.case, "--over", "shape.length=4-8")
        self.assertRegex(words, "^--over shape.length=4-8: .*; --over takes a list, 0,0.1,0.2, or a range, lo:hi:n\n")
        for command in ("show", "plot", "view"):
            self.assertIn("; tubule run case.toml makes it", self.refused(command, self.result))
        self.assertIn("is no result of tubule", self.refused("show", "--verify", __file__))
        self.assertIn("is a folder: name a file in it", self.refused("run", self.case, "-o", self.case.parent))
        self.assertIn("a result is an HDF5 file: give it a name such as x.hdf", self.refused("run", self.case, "-o", "x.csv"))
        no_expectation = self.write("plain.toml", self.case.read_text().split("[expect]")[0])
        self.assertIn("has no table [expect]", self.refused("run", no_expectation, "--expect"))
        self.assertIn("not expected: --quite; did you mean '--quiet'?\n", self.refused("run", self.case, "--quite"))
        words = self.refused("scan", self.case, "--over", "energy.k42", "0", "1", "2")
        self.assertIn("tubule scan: not expected: 0 1 2\n", words)

    def test_results_that_are_none(self):
        self.assertIn("nowhere.hdf", self.refused("show", "nowhere.hdf"))
        for command in ("show", "plot", "view"):
            self.assertRegex(self.refused(command, "case.toml"),
                             r"case\.toml: is a case file, not a result: run it first \(tubule run \S*case\.toml; tubule scan "
                             r"for a scan\), then give its result, case\.hdf\n")  # fmt: skip
        self.assertIn("nowhere.hdf: no such file", self.refused("confirm", "nowhere.hdf"))

    def test_blank_names(self):
        self.tubule("run", "case.toml")
        for command in (["run", "case.toml"], ["scan", "case.toml", "--over", "energy.k42=0,0.1"], ["show", "case.hdf"],
                        ["view", "case.hdf"], ["plot", "case.hdf"], ["equilibrium", "case.toml"]):  # fmt: skip
            for name in ("", " ", "\t "):
                self.assertIn("must not be blank: give the file a name", self.refused(*command, "-o", name))

    def test_names_that_no_result_can_have(self):
        scan = ("scan", self.case, "--over", "energy.k42=0,0.1")
        for command in (("run", self.case), scan):
            long = "x" * 300
            self.assertIn(f"{long}: cannot be written: File name too long", self.refused(*command, "-o", long))

    def test_pipes_devices_and_files_of_any_size(self):
        os.mkfifo(self.folder / "pipe")
        with open(self.folder / "huge", "w") as file:
            file.truncate(2**40)
        by_points = ("scan", self.case, "--points")
        of_file = ("--set", "tier=surface3d", "--set", "shape={kind=\"result\",path=\"pipe\"}")
        for command in (["check"], ["run"], ["scan"], ["stability"], ["equilibrium"], by_points, ["show"], ["plot"],
                        ["compare", "pipe"], ["confirm"], ["run", self.case, *of_file, "--set"]):  # fmt: skip
            for name in ("pipe", "/dev/zero", "huge"):
                if command[-1] == "--set":
                    name = f"shape.path={name}"
                with self.subTest(command=command, name=name):
                    self.refused(*command, name)


class Expect(ProgramTest):
    def test_what_did_not_come_out_is_named(self):
        self.write("case.toml", QUICK + EXPECT)
        out, err = self.tubule("run", self.case, "--expect", status=1)
        lines = err.splitlines()
        self.assertEqual(len(lines), 2, err)
        self.assertRegex(lines[0], r"case.toml: not as expected: energy at the end is .*, expected 100 within 1$")
        self.assertRegex(lines[1], r"energy_42 at t = 0.03 is .*, expected -7 within 0.001$")
        self.assertIn("finished", out)
        self.tubule("run", self.case)  # it counts only if requested

    def test_wrong_stop(self):
        self.write("case.toml", QUICK + '[expect]\nstop = "pinch-off"\n')
        self.assertIn("stop is finished, expected pinch-off", self.tubule("run", self.case, "--expect", status=1)[1])

    def test_a_stop_that_was_expected_is_success(self):
        self.write("case.toml", QUICK + '[expect]\nstop = "time-limit"\n')
        self.tubule("run", self.case, "--expect", "--set", "time.limit=1e-9")
        self.tubule("run", self.case, "--set", "time.limit=1e-9", "--overwrite", status=5)

    def test_of_a_complete_result(self):
        self.write("case.toml", QUICK + EXPECT)
        self.tubule("run", self.case, "--expect", status=1)
        _, err = self.tubule("run", self.case, "--expect", "--resume", status=1)
        self.assertEqual(err.count("not as expected"), 2, err)


class Show(ProgramTest):
    def setUp(self):
        super().setUp()
        self.tubule("run", self.case)

    def test_words(self):
        out, _ = self.tubule("show", self.result)
        self.assertRegex(out, r"title +A quick one")
        self.assertRegex(out, r"stop +finished")

    def test_into_a_file(self):
        for words in (("--csv",), ("--json",), ()):
            out = "-".join(("out", *words))
            self.assertEqual(self.tubule("show", self.result, *words, "-o", out), ("", ""))
            self.assertEqual((self.folder / out).read_text(), self.tubule("show", self.result, *words)[0])
        before = self.result.read_bytes()
        self.assertIn("is HDF5", self.refused("show", self.result, "--csv", "-o", self.result))
        self.assertEqual(self.result.read_bytes(), before)
        self.assertIn("nowhere/out.csv: cannot be written", self.refused("show", self.result, "-o", "nowhere/out.csv"))

    def test_only_a_table_of_its_own_is_replaced(self):
        case = (self.folder / "case.toml").read_bytes()
        for what in ([], ["--csv"], ["--json"]):
            said = self.tubule("show", self.result, *what, "-o", "case.toml", status=2)[1]
            self.assertIn("case.toml: is no table that show has written: choose another file with -o", said)
            self.assertEqual((self.folder / "case.toml").read_bytes(), case)
            for _ in range(2):  # its own, again
                self.tubule("show", self.result, *what, "-o", "table")
            (self.folder / "table").unlink()
        self.write("empty", "")
        self.tubule("show", self.result, "--csv", "-o", "empty")
        self.tubule("show", self.result, "--csv", "-o", "case.toml", "--overwrite")
        self.assertNotEqual((self.folder / "case.toml").read_bytes(), case)

    def test_times_need_commas(self):
        err = self.refused("plot", "--times", "0", "0.1", "case.hdf")
        self.assertIn("several times are separated by commas, without spaces: --times 0,0.1", err)

    def test_output_times_as_a_range(self):
        self.tubule("run", self.case, "--set", "time.output=0.05:0.15:3", "-o", "range.hdf")
        with h5py.File(self.folder / "range.hdf") as file:
            times = [file["frames"][name].attrs["time"] for name in sorted(file["frames"])]
        np.testing.assert_allclose(times, [0, 0.05, 0.1, 0.15, 0.2], rtol=1e-14)

    def test_csv_is_the_series_to_the_last_bit(self):
        header, rows = self.shown(self.result)
        values = series(self.result)
        self.assertEqual(header[0], "time")
        self.assertEqual(set(header), set(values))
        self.assertLessEqual({"energy", "energy_20", "energy_40", "energy_42", "r_min", "mode_1", "mode_2"}, set(header))
        table = np.array(rows, dtype=float)
        for column, name in enumerate(header):
            np.testing.assert_array_equal(table[:, column], values[name], name)

    def test_csv_of_a_frame(self):
        out, _ = self.tubule("show", self.result, "--csv", "--frame", "-1")
        lines = out.splitlines()
        self.assertEqual(lines[0], "z,r,H,K,u_n")
        table = np.array([line.split(",") for line in lines[1:]], dtype=float)
        with h5py.File(self.result) as file:
            last = file["frames"][max(file["frames"])]
            for column, name in enumerate(("z", "r", "H", "K", "u_n")):
                np.testing.assert_array_equal(table[:, column], last[name][:])

    def test_json_is_the_result(self):
        data = json.loads(self.tubule("show", self.result, "--json", "--frame", "1")[0])
        self.assertEqual((data["case"]["text"], data["case"]["set"]), (QUICK, []))
        self.assertIn("k40 = 0", data["case"]["resolved"])
        self.assertEqual(data["about"]["stop"], "finished")
        self.assertEqual({name: list(values) for name, values in series(self.result).items()}, data["series"])
        self.assertEqual([frame["time"] for frame in data["frames"]], [0, 0.01, 0.05, 0.2])
        with h5py.File(self.result) as file:
            self.assertEqual(data["frames"][1]["arrays"]["r"]["data"], list(file["frames/000001/r"][:]))
        self.assertNotIn("data", data["frames"][2]["arrays"]["r"])

    def test_a_frame_that_is_not_there(self):
        self.assertIn("0 to 3", self.tubule("show", self.result, "--csv", "--frame", "4", status=2)[1])


class Check(ProgramTest):
    def test_what_a_case_comes_to_is_a_case(self):
        out, _ = self.tubule("check", "--quick", self.case, "--set", "energy.k40=0.25")
        case = tomllib.loads(out)
        self.assertEqual(case["energy"], {"k20": 0.5, "H0": -1.0, "k40": 0.25, "k42": 0.1, "kg": 0.0})
        self.assertEqual(case["accuracy"]["r_min"], 1e-3)  # a default
        again = self.tubule("check", "--quick", self.write("again.toml", out))[0]
        self.assertEqual(again.split("\n", 1)[1], out.split("\n", 1)[1])
        self.assertEqual(self.files(), {"case.toml", "again.toml"})

    def test_what_it_prints_prints_itself_again(self):
        """Whatever the sign of zero, the digits, the characters of texts and the name of the file."""
        awkward = """
            about.title = "\\t\\"\\\\ \\u0001 \\u007f\\né"
            shape.mode.0.phase = -0.0
            shape.mode.1.amplitude = 8.361757361286462e-6
            time.output = [-0.0, 5e-324, 1.0e-7, 0.1]
            expect = {energy = {value = -0.0, abs = 1e22}, at = [{time = 0.1, r_min = {value = 1, rel = 0.1}}]}
        """
        sets = [part for line in awkward.strip().splitlines() for part in ("--set", line.strip().replace(" = ", "=", 1))]
        self.write("again.toml", self.tubule("check", "--quick", self.case, *sets)[0])
        once = self.tubule("check", "--quick", "again.toml")[0]
        self.write("again.toml", once)
        self.assertEqual(self.tubule("check", "--quick", "again.toml")[0], once)
        case = tomllib.loads(once)
        self.assertEqual(str(case["shape"]["mode"][0]["phase"]), "-0.0")
        self.assertEqual(case["shape"]["mode"][1]["amplitude"], 8.361757361286462e-6)
        for name in (b"two\nlines = 1", b"\xff\xfe"):
            path = os.fsencode(self.folder) + b"/" + name
            os.rename(self.write("plain.toml", QUICK), path)
            tomllib.loads(self.tubule("check", "--quick", os.fsdecode(path))[0])

    def test_what_it_takes_is_told(self):
        """The number of steps within a factor 2; times are for the study."""
        words = self.tubule("check", self.case)[1]
        self.assertRegex(words, r"case.toml: expected: \d+ elements; about \d+ steps, [^,]+, \d+ MB\n$")
        self.assertEqual(self.tubule("check", self.case, "--quick")[1], "")
        surface = self.write("surface.toml", SURFACE)
        words = self.tubule("check", surface)[1]
        found = re.search(r"expected: about 80 triangles of order 3; about (\d+) steps, [^,]+, \d+ MB\n$", words)
        self.assertTrue(found, words)
        self.tubule("run", surface, "--quiet", "-o", "surface.hdf")
        steps = about(self.folder / "surface.hdf")["steps"]
        self.assertTrue(0.5 < int(found[1]) / steps < 2, f"{words}, but {steps} steps")

    def test_all_bad_cases_are_told(self):
        one = self.write("one.toml", QUICK.replace("kind", "knid"))
        two = self.write("two.toml", QUICK.replace("0.5", '"much"'))
        out, err = self.tubule("check", "--quick", one, self.case, two, status=2)
        self.assertIn("one.toml:9:1: ", err)
        self.assertIn("two.toml:5:7: ", err)
        self.assertIn("# OK", out)


class Others(ProgramTest):
    def test_version(self):
        out, _ = self.tubule("--version")
        for name in ("version", "git_hash", "compiler", "sundials", "suitesparse", "cgal", "hdf5", "blas"):
            self.assertRegex(out, rf"(?m)^{name} +\S")
        if "none: no shape.remesh" in out:
            self.assertRegex(out, "(?m)^lacks +shape.remesh: install libcgal-dev$")
            self.assertIn("then cmake --preset release", out)

    def test_help(self):
        out, _ = self.tubule("--help")
        for subcommand in ("run", "check", "show", "plot"):
            self.assertIn(subcommand, out)
        self.assertEqual(self.tubule(), (out, ""))
        self.assertEqual(self.tubule("help"), (out, ""))
        self.assertEqual(self.tubule("help", "run"), self.tubule("run", "--help"))

    def test_help_of_each_command_has_examples_that_work(self):
        """And names the exit statuses and pages of docs/. `confirm` is left out: it computes in three dimensions."""
        root = Path(__file__).parents[2]
        (self.folder / "cases").symlink_to(root / "cases")
        statuses = (root / "docs/command.md").read_text()
        commands = re.findall(r"(?m)^  (\w+) ", self.tubule("--help")[0].split("Subcommands:")[1].split("Exit status")[0])
        self.assertEqual(len(commands), 13)
        for command in commands:
            out, _ = self.tubule(command, "--help")
            examples = re.findall(r"(?m)^  (tubule .*)$", out)
            self.assertTrue(examples, command)
            for status in re.findall(r"(?m)^  (\d+) ", out.split("Exit status:")[1]):
                self.assertIn(f"| {status} | ", statuses)
            pages = re.search(r"(?m)^More: (.*)$", out)[1].split()
            for page in pages:
                self.assertTrue((root / page).is_file(), page)
            for example in examples if command != "confirm" else ():
                if "--movie" not in example:  # plot_motion makes one
                    with self.subTest(example=example):
                        words = shlex.split(example)[1:]
                        (self.plot(*words[1:]) if command == "plot" else self.tubule(*words, *["--quick"] * (command == "check")))

    def test_threads_that_the_environment_asks_for(self):
        """As many would not fit into memory."""
        root = Path(__file__).parents[2]
        many = {**os.environ, "OMP_NUM_THREADS": "100000"}
        with self.start("run", root / "cases/surface_ellipsoid.toml", "--quiet", env=many) as process:
            self.assertEqual(process.communicate(), ("", ""))
        self.assertEqual(process.returncode, 0)

    def test_overrides_of_a_result_of_version_0_1(self):
        """It lacks /resolved_case: the program tells it, and applies what --set was."""
        self.tubule("run", self.case)
        self.tubule("run", self.case, "--set", "energy.k42=0.2", "-o", "new.hdf")
        with h5py.File(self.folder / "new.hdf") as new, h5py.File(self.folder / "old.hdf", "w") as old:
            old.attrs.update(new.attrs)
            for name in set(new) - {"resolved_case"}:
                new.copy(name, old)
        self.tubule("plot", self.result, "old.hdf", "-o", "picture.svg")
        self.assertIn("k\u2084\u2082 = 0.2", (self.folder / "picture.svg").read_text())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
