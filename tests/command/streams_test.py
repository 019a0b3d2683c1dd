#!/usr/bin/python3
"""The program with closed, full and broken standard streams, and with a limit on file sizes: nothing that cannot be
written ends a run or harms its result, and what a command was asked for is written or reported missing.

streams_test.py TUBULE
"""
import itertools
import os
import resource
import subprocess
import sys
import unittest

from program import CAPSULE, PROGRAM, SLOW, ProgramTest, about, series

FULL = "cannot write the output: No space left on device"


class StreamsTest(ProgramTest):
    def redirected(self, streams, *arguments, **options):
        """The program, its streams redirected as the shell would."""
        command = ["bash", "-c", f'exec "$0" "$@" {streams}', PROGRAM, *map(str, arguments)]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True, timeout=60, **options)

    def answers(self):
        """Commands that print what they were asked for."""
        self.tubule("run", self.case, "--quiet")
        capsule = self.write("capsule.toml", CAPSULE)
        return (["show", self.result], ["show", self.result, "--csv"], ["check", self.case], ["stability", self.case],
                ["compare", self.result, self.result], ["equilibrium", capsule], ["--help"], [], ["--version"],
                ["run", "--help"])  # fmt: skip


class Closed(StreamsTest):
    def test_no_file_of_a_run_takes_the_place_of_a_closed_stream(self):
        self.write("case.toml", SLOW)
        command = ["bash", "-c", 'exec "$0" "$@" <&- >&- 2>&-', PROGRAM, "run", str(self.case)]
        with subprocess.Popen(command, cwd=self.folder) as process:
            self.addCleanup(process.kill)
            while not (self.result.exists() and self.shown(self.result)[1]):
                self.assertIsNone(process.poll())
            for stream in range(3):
                self.assertEqual(os.readlink(f"/proc/{process.pid}/fd/{stream}"), "/dev/null")
            process.terminate()
        self.assertEqual(process.returncode, 130)

    def test_every_command_with_every_set_of_closed_streams(self):
        answers = self.answers()
        scan = ["scan", self.case, "--over", "energy.k42=0.1,0.2", "-o", "scan.hdf"]
        bad = ["run", self.case, "--set", "energy.k43=1"]
        others = ((["run", self.case], 0), (scan, 0), (bad, 2))
        for closed in itertools.chain.from_iterable(itertools.combinations((0, 1, 2), n) for n in (1, 2, 3)):
            streams = " ".join(("<&-", ">&-", "2>&-")[stream] for stream in closed)
            asked = answers if len(closed) == 3 else answers[:1]
            for arguments, status in [*((a, 2 if 1 in closed else 0) for a in asked), *others]:
                with self.subTest(streams=streams, arguments=arguments):
                    done = self.redirected(streams, *arguments)
                    self.assertEqual(done.returncode, status, done.stderr)
                    if 1 in closed and 2 not in closed and status == 2 and arguments is not bad:
                        self.assertIn("cannot write the output: Bad file descriptor", done.stderr)
        self.assertEqual(about(self.result)["stop"], "finished")


class Full(StreamsTest):
    def test_an_answer_that_cannot_be_written_is_reported(self):
        for arguments in self.answers():
            with self.subTest(arguments=arguments):
                done = self.redirected(">/dev/full", *arguments)
                self.assertEqual(done.returncode, 2)
                self.assertIn(FULL, done.stderr)

    def test_messages_that_cannot_be_written_change_nothing(self):
        for arguments, status in ((["run", self.case], 0), (["run", self.case, "--check-derivatives"], 0),
                                  (["run", "none.toml"], 2), (["show", "none.hdf"], 2), (["walk"], 2),
                                  (["scan", self.case, "--over", "energy.k42=0.1,0.2", "-o", "scan.hdf"], 0),
                                  (["compare", "none.hdf", "none.hdf"], 2), (["check", "none.toml"], 2),
                                  (["chart", "none.toml"], 2), (["plot", "none.hdf"], 2)):  # fmt: skip
            with self.subTest(arguments=arguments):
                self.assertEqual(self.redirected(">/dev/full 2>/dev/full", *arguments).returncode, status)
        self.assertEqual(about(self.result)["stop"], "finished")

    def test_a_result_beyond_the_limit_of_file_sizes_is_told_and_resumed(self):
        """SLOW writes several megabytes."""
        self.write("case.toml", SLOW)
        limit = 300_000
        done = self.redirected("", "run", self.case, "--quiet", env=os.environ | {"TUBULE_WRITE_SECONDS": "0.01"},
                               preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))  # fmt: skip
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertRegex(done.stderr, r"case.toml: cannot write .*case.hdf.*: File too large")
        kept = self.shown(self.result)[1]
        self.assertGreater(len(kept), 10)
        self.tubule("run", self.case, "--resume", "--quiet")
        self.assertEqual(series(self.result)["time"][-1], 0.2)
        self.assertGreater(len(self.shown(self.result)[1]), len(kept))


class Broken(StreamsTest):
    """A pipe whose reader has gone."""

    def test_a_run_is_saved(self):
        self.write("case.toml", SLOW)
        read, write = os.pipe()
        os.close(read)
        with subprocess.Popen([PROGRAM, "run", self.case], cwd=self.folder, stdout=write, stderr=write) as process:
            os.close(write)
        self.assertEqual(process.returncode, 0)
        self.assertEqual(about(self.result)["stop"], "finished")

    def test_an_answer_is_reported(self):
        self.tubule("run", self.case, "--quiet")
        read, write = os.pipe()
        os.close(read)
        command = [PROGRAM, "show", self.result, "--csv"]
        with subprocess.Popen(command, stdout=write, stderr=subprocess.PIPE, text=True) as process:
            os.close(write)
            err = process.communicate()[1]
        self.assertEqual(process.returncode, 2)
        self.assertIn("cannot write the output: Broken pipe", err)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
