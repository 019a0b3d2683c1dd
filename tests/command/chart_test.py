#!/usr/bin/python3
"""`tubule chart`: the front, failures, resuming, references, maps, refusals.

chart_test.py TUBULE PACKAGE [MPIRUN]: the program, the folder of the Python package.
"""
import contextlib
import csv
import os
import resource
import signal
import stat
import subprocess
import sys
import textwrap
import time
import unittest
from pathlib import Path

from program import PROGRAM, QUICK, SLOW, ProgramTest, study

MPIRUN = sys.argv[3] if len(sys.argv) > 3 else None
sys.path[:0] = [sys.argv[2], str(Path(__file__).resolve().parents[1] / "support")]
os.environ["TUBULE_PROGRAM"] = str(Path(PROGRAM).resolve())
import scripts  # noqa: E402
from drawing import chart, chart_file, chart_runs  # noqa: E402

# Stands for the program: what a run does depends on its elements alone, and costs nothing. E_ref is 2, the energy at the
# end 1 + 1/elements^2; from 64 elements on it crashes, with 32 it hangs, with 4 it stops early. Every run leaves a line.
STAND_IN = """#!/usr/bin/python3
import json, os, signal, sys, time
from pathlib import Path
command, arguments = sys.argv[1], sys.argv[2:]
if command == "check":
    print("[time]\\nend = 1.0\\noutput = [0.5]")
elif command == "run":
    sets = dict(a.split("=", 1) for a in arguments if "=" in a)
    n = int(sets["discretisation.elements"])
    with open(Path(__file__).with_name("ran"), "a") as log:
        log.write(f"{n}\\n")
    if n == 32:
        time.sleep(100)
    if n >= 64:
        os.kill(os.getpid(), signal.SIGSEGV)
    step = float(sets.get("discretisation.step", 0))
    Path(arguments[arguments.index("-o") + 1]).write_text(json.dumps([n, step]))
else:
    n, step = json.loads(Path(arguments[0]).read_text())
    stop, end = ("pinch-off", 0.5) if n == 4 else ("finished", 1.0)
    about = {"stop": stop, "E_ref": 2.0, "estimated_error": 1 / n**2, "elements": n, "steps": 7}
    rows = [(0, 2), (0.5, 2 * (1 + step * n)), (1, 1 + 1 / n**2)]  # unstable where step * n exceeds 0.1
    times, energies = zip(*[row for row in rows if row[0] <= end])
    print(json.dumps({"about": about, "series": {"time": times, "energy": energies}}))
"""


class Charts(ProgramTest):
    def rows(self, name="case.csv"):
        with open(self.folder / name, newline="") as file:
            return list(csv.DictReader(file))

    def chart(self, *arguments):
        """As tubule() of the command itself."""
        with contextlib.chdir(self.folder):
            return scripts.run_script(Path(sys.argv[2]) / "drawing", "chart", *arguments)


class RealRuns(Charts):
    def test_a_chart_of_accuracies(self):
        """The smallest of three accuracies is the reference; the others meet theirs. A second call runs nothing."""
        command = ("chart", self.case, "--vary", "accuracy.energy=1e-1,1e-3,1e-7")
        out, err = self.tubule(*command)
        self.assertEqual(err.count("finished"), 3)
        rows = self.rows()
        self.assertEqual([row["outcome"] for row in rows], ["finished"] * 3)
        self.assertEqual(rows[2]["front"], "reference")
        for row, asked in zip(rows[:2], (1e-1, 1e-3)):
            self.assertLess(float(row["error"]), asked)
            self.assertGreater(float(row["error"]), 1e-9)  # two runs are not the same
        self.assertRegex(out, r"for 1e-03: settings of the case: energy=0\.(1|001) ")  # the faster one
        self.assertIn("for 1e-06: none reaches it", out)
        self.assertTrue((self.folder / "case.svg").read_text().startswith("<?xml"))
        again = self.chart(*command[1:])
        self.assertEqual((again.returncode, again.stdout, again.stderr), (0, out, ""))
        self.assertEqual(self.rows(), rows)

    def test_a_result_as_reference_in_a_chart_file(self):
        self.tubule("run", self.case, "--quiet", "--set", "accuracy.energy=1e-8", "-o", "fine.hdf")
        chart_text = """
            case = "case.toml"
            times = [0.01, 0.05, 0.2]
            [reference]
            result = "fine.hdf"
            [[series]]
            name = "asked"
            vary = { accuracy.energy = [1e-3, 1e-5] }
            [[series]]
            study = true
            vary = { accuracy.energy = [1e-9] }
        """
        self.write("wp.toml", textwrap.dedent(chart_text))
        out = self.chart("wp.toml", "-o", "wp.svg", "--quiet").stdout
        rows = self.rows("wp.csv")
        self.assertEqual([row["series"] for row in rows], ["asked", "asked"])  # the study was not requested
        for row, asked in zip(rows, (1e-3, 1e-5)):
            self.assertLess(float(row["error"]), asked)
        self.assertIn("reference: fine.hdf", out)


class Refusals(Charts):
    def test_each_says_what_is_wrong(self):
        vary = ("--vary", "accuracy.energy=1e-2,1e-3")
        self.write("c.toml", 'case = "case.toml"\n[[series]]\nvari = { accuracy.energy = [1] }')
        self.write("none.toml", 'case = "no.toml"\n[[series]]\nvary = { accuracy.energy = [1] }')
        self.write("two.toml", 'case = "case.toml"\n[reference]\nresult = "x"\nvalues = [1]\n[[series]]')
        self.write("values.toml", 'case = "case.toml"\n[reference]\nvalues = [1]\nE_ref = 1\n[[series]]')
        self.write("study.toml", 'case = "case.toml"\n[[series]]\nstudy = true')
        self.write("list.toml", 'case = "case.toml"\n[[series]]\nvary = { accuracy.energy = 1 }')
        self.write("other.csv", "a,b\n1,2\n")
        (self.folder / "binary.csv").write_bytes(b"\xff\0")
        (self.folder / "folder.csv").mkdir()
        self.write("huge.toml", QUICK + "#" * 2**20)
        self.write("nested.toml", "a = " + "[" * 10000)
        os.mkfifo(self.folder / "pipe")
        before = self.files()
        for arguments, words in (
            (["case.toml"], "it needs --vary"),
            (["missing.toml", *vary], "cannot be read"),
            (["c.toml"], "series.0.vari: unknown key; allowed: name, set, vary, study; did you mean 'vary'?"),
            (["none.toml"], "no such file"),
            (["two.toml"], "reference: needs one of result, set, values, not result and values"),
            (["values.toml"], "reference.values: needs times, one for each of its 1 values"),
            (["study.toml"], "every series is a study"),
            (["list.toml"], "series.0.vary.accuracy.energy: must be a list of values, not 1"),
            (["study.toml", *vary], "--vary applies only to a case"),
            (["case.toml", "--vary", "accuracy.energy"], "must be key=value"),
            (["case.toml", "--vary", "accuracy.energy=1e-2,,1"], "a value is empty"),
            (["case.toml", "--vary", "accuracy.enrgy=1e-2"], "did you mean"),
            (["case.toml", "--vary", "accuracy.energy=7"], "in series"),
            (["case.toml", *vary, "--map", "discretisation.step=3"], "must be key=from:to"),
            (["case.toml", *vary, "--map", "discretisation.step=3:1"], "from = 3 must be below to = 1"),
            (["case.toml", *vary, "--reference", "none.hdf"], "none.hdf: no such file"),
            (["case.toml", *vary, "-o", "x.gif"], "a picture is written as one of"),
            (["case.toml", *vary, "-o", "no/x.svg"], "the folder no does not exist"),
            (["case.toml", *vary, "-o", "other.svg"], "is no table of a chart"),
            (["case.toml", *vary, "--jobs", "0"], "must be 1 or more"),
            (["case.toml", *vary, "--times", "0.2,0.1"], "must be growing numbers above 0"),
            (["case.toml", *vary, "--quantity", "enrgy"], "quantity enrgy: no series has this name; did you mean 'energy'?"),
            (["case.toml", *vary, "--quantity", "a.b"], "quantity 'a.b': is no name of a series"),
            (["case.toml", *vary, "-o", "folder.svg"], "folder.csv: is no file"),
            (["case.toml", *vary, "-o", "binary.svg"], "binary.csv: is no table of a chart"),
            (["pipe", *vary], "pipe: is a directory, a pipe or a device, not a file"),
            (["huge.toml", *vary], "huge.toml: is larger than 1 MB, the most that is read"),
            (["nested.toml", *vary], "nested.toml: is not TOML"),
            (["case.toml", *vary, "--reference", "pipe"], "pipe: is a directory, a pipe or a device, not a file"),
        ):
            with self.subTest(arguments=arguments):
                done = self.chart(*arguments)
                self.assertEqual((done.returncode, done.stdout, self.files()), (2, "", before))
                self.assertIn(words, done.stderr)


class Surroundings(Charts):
    VARY = ("--vary", "accuracy.energy=1e-2,1e-3")

    def test_names_that_are_no_text_or_more_than_a_line(self):
        for name in (b"two\nlines.toml", b"\xff $x_{$.toml"):
            with self.subTest(name=name):
                path = os.fsencode(self.folder) + b"/" + name
                os.rename(self.write("plain.toml", QUICK), path)
                self.assertEqual(self.chart(os.fsdecode(path), *self.VARY, "-o", "x.svg", "--again").returncode, 0)

    def test_a_limit_of_file_sizes_is_told(self):
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))  # noqa: E731
        with self.start("chart", self.case, *self.VARY, preexec_fn=limit) as process:
            _, err = process.communicate()
        self.assertEqual(process.returncode, 4, err)
        self.assertIn("File too large", err)
        self.assertNotIn("Traceback", err)

    def test_sigterm_ends_it_and_its_runs(self):
        self.write("case.toml", SLOW)

        def runs_of(chart):
            """Its children, but for those that only check or show a case."""
            for task in Path(f"/proc/{chart}/task").glob("*/children"):
                for child in task.read_text().split():
                    with contextlib.suppress(OSError):  # it has ended
                        if b"\0run\0" in Path(f"/proc/{child}/cmdline").read_bytes():
                            yield child

        with self.start("chart", self.case, "--vary", "discretisation.time_tolerance=1e-13,2e-14") as process:
            while not (runs := list(runs_of(process.pid))):
                self.assertIsNone(process.poll())
            process.send_signal(signal.SIGTERM)
            _, err = process.communicate()
        self.assertEqual(process.returncode, 130, err)
        self.assertIn("tubule chart: interrupted", err)
        self.assertFalse(any(os.path.exists(f"/proc/{run}") for run in runs))


@unittest.skipUnless(MPIRUN, "built without MPI")
class Ranks(Charts):
    """Across the processes of an mpirun, of which each takes runs that no other one has taken."""

    def command(self, ranks, *arguments):
        return [MPIRUN, "--allow-run-as-root", "--oversubscribe", "-n", str(ranks), PROGRAM, "chart", self.case, *arguments]

    def test_the_same_chart_as_of_one_process(self):
        vary = ("--vary", "discretisation.elements=12,20", "--map", "discretisation.time_tolerance=1e-5:1e-2:1")
        self.assertEqual(self.chart(self.case, *vary, "--quiet", "-o", "one.svg").returncode, 0)
        done = subprocess.run(self.command(2, *vary, "-o", "ranks.svg"), cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.count("ranks.csv"), 1)  # one of them reports
        for row, other in zip(self.rows("ranks.csv"), self.rows("one.csv"), strict=True):
            for name in ("key", "outcome", "stop_time", "elements", "steps", "stated_error", "width"):
                self.assertEqual(row[name], other[name], name)
        self.assertFalse((self.folder / "ranks.ranks").exists())

    @study
    def test_killed_in_between_it_goes_on(self):
        slow = QUICK.replace("end = 0.2\noutput = [0.01, 0.05]", "end = 0.05\nmax_order = 2")
        self.write("case.toml", slow + "[discretisation]\nelements = 40\n")
        command = self.command(2, "--vary", "discretisation.time_tolerance=1e-10,9e-11,8e-11,7e-11,6e-11,5e-11", "-o", "c.svg")
        with subprocess.Popen(command, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            self.addCleanup(process.kill)
            tables = lambda: list(self.folder.glob("c.ranks/*/rank_*.csv"))  # noqa: E731
            while not tables():
                self.assertIsNone(process.poll(), "it ended before it could be disturbed")
                time.sleep(0.01)
            children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
            os.kill(int(children[-1]), signal.SIGKILL)
        self.assertNotEqual(process.returncode, 0)
        known = {row["key"]: row["cpu_s"] for table in tables() for row in self.rows(table)}
        self.assertTrue(0 < len(known) < 6, known)
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = {row["key"]: row for row in self.rows("c.csv")}
        self.assertEqual([row["outcome"] for row in rows.values()], ["finished"] * 6)
        self.assertEqual({key: rows[key]["cpu_s"] for key in known}, known)  # not run again


class Outcomes(Charts):
    """With a fake program, whose errors and failures are known."""

    def setUp(self):
        super().setUp()
        self.program = self.write("stand_in", STAND_IN)
        self.program.chmod(self.program.stat().st_mode | stat.S_IXUSR)

    def ran(self):
        return (self.folder / "ran").read_text().split()

    def runner(self, limit=5.0, at_once=2):
        program = chart_runs.Program(self.program, self.folder, limit, "energy")
        table = chart_runs.Table(self.folder / "t.csv", "energy", [0.5, 1.0])
        return chart_runs.Runner(program, table, at_once, say=lambda words: None)

    def jobs(self, *elements):
        return chart_file.chart_of_case(self.case, [f"discretisation.elements={','.join(map(str, elements))}"], []).jobs()

    def test_crash_hang_and_stop_are_outcomes_and_nothing_is_repeated(self):
        jobs = self.jobs(4, 8, 32, 64)
        self.runner().run(jobs)
        again = self.runner()  # reads the table
        again.run(jobs)
        self.assertEqual(sorted(self.ran(), key=int), ["4", "8", "32", "64"])  # each once
        runs = [again.table.runs[job.key] for job in jobs]
        self.assertEqual([run.outcome for run in runs], ["pinch-off", "finished", "too slow", "crashed"])
        self.assertEqual(runs[0].stop_time, 0.5)
        self.assertEqual(runs[1].values, {0.5: 2.0, 1.0: 1 + 1 / 64})
        self.assertIn("SIGSEGV", runs[3].message)

    def test_a_table_cut_short_goes_on(self):
        jobs = self.jobs(4, 8, 16)
        self.runner().run(jobs[:2])
        self.runner().run(jobs)
        self.assertEqual(sorted(self.ran(), key=int), ["4", "8", "16"])
        self.runner().table.write(jobs[:1])  # fewer are requested: the others keep their names
        self.assertEqual([row["settings"] for row in self.rows("t.csv")], ["elements=4", "elements=8", "elements=16"])

    def test_another_case_is_another_run(self):
        jobs = self.jobs(8)
        self.runner().run(jobs)
        self.case.write_text(QUICK.replace("k42 = 0.1", "k42 = 0.2"))
        self.runner().run(jobs)
        self.assertEqual(self.ran(), ["8", "8"])

    def test_the_largest_stable_step_is_bisected(self):
        """Growth 1 + step n above 1.1, grid 10^(-3 + i/4): with 12 elements from 0.01 on (0.12), with 6 from 0.0178 on."""
        one = chart_file.chart_of_case(self.case, ["discretisation.elements=12,6"], [])
        one.map = chart_file.map_option("discretisation.step=1e-3:1e-1:4")
        program = chart_runs.Program(self.program, self.folder, 20, "energy")
        options = type("Options", (), {"jobs": 2, "again": False, "draw": False, "quiet": True})
        real, chart.checked = chart.checked, lambda program, jobs: {}
        self.addCleanup(setattr, chart, "checked", real)
        self.assertTrue(chart.stability_map(one, options, [self.folder / "m.svg"], program))
        found = {}
        for row in self.rows("m.csv"):
            step = float(row["settings"].split("step=")[1])
            found.setdefault((row["elements"], float(row["growth"]) <= 1.1), []).append(step)
        for elements, stable, unstable in (("12", 0.00562, 0.01), ("6", 0.01, 0.0178)):
            self.assertEqual(max(found[elements, True]), stable)
            self.assertEqual(min(found[elements, False]), unstable)
        self.assertLess(len(self.rows("m.csv")), 2 * 9)  # fewer than all: 9 values each


class Front(unittest.TestCase):
    def run_of(self, key, cpu_s, error, outcome="finished"):
        return chart_runs.Run(key, outcome, cpu_s=cpu_s, values={1.0: 1 + 2 * error}, E_ref=2.0)

    def test_front_and_choices(self):
        """Errors relative to E_ref = 2 against 1. c is beaten by b, e failed, and below 1e-5 nothing is known."""
        runs = [self.run_of("a", 1, 1e-2), self.run_of("b", 2, 5e-4), self.run_of("c", 3, 6e-4),
                self.run_of("d", 4, 1e-9), self.run_of("e", 1, 1e-9, "pinch-off"), self.run_of("f", 9, 0)]  # fmt: skip
        judged, front, chosen = chart.judge(runs, chart.Truth({1.0: 1.0}, 2.0, 1e-5, "made up"))
        self.assertEqual([run.key for run in front], ["a", "b", "d"])
        self.assertEqual([judged[key]["front"] for key in "abcdef"], [1, 2, "", 3, "", ""])
        self.assertEqual({target: run and run.key for target, run in chosen.items()}, {1e-3: "b", 1e-4: "d", 1e-6: None})
        self.assertEqual(judged["b"]["chosen_for"], "1e-03")
        self.assertEqual(judged["c"]["error"], "6.0000e-04")

    def test_options_make_lines(self):
        one = chart_file.chart_of_case(Path("c.toml"), ["a.order=2,3", "a.elements=8,16"], ["a.scheme=euler,b.x=[1,2]"])
        self.assertEqual([series.name for series in one.series], ["order = 2", "order = 3", "scheme = euler, x = [1,2]"])
        self.assertEqual([series.vary for series in one.series], [{"a.elements": [8, 16]}] * 3)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
