#!/usr/bin/python3
"""Why cases stop: said alike by their [expect], the exit status, the words and the result.

stops_test.py TUBULE CASES          each stop reason has a case, and its exit status is as documented
stops_test.py TUBULE CASE RESULT    runs this case, which must come out as its [expect] says and tell so alike
"""
import re
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

import h5py

PROGRAM, CASES = sys.argv[1], Path(sys.argv[2])
RESULT = Path(sys.argv[3]) if len(sys.argv) > 3 else None

# Exit statuses by the table of docs/results.md, which a test compares with the program.
RESULTS = (Path(__file__).parents[2] / "docs" / "results.md").read_text()
ABOUT = RESULTS[RESULTS.index("### /about") : RESULTS.index("### /series")]
# No case is interrupted, and none makes a solver fail: other tests show those.
WITHOUT_CASE = {"interrupted", "solver-failed"}
STATUS = {name: int(status) for name, status in re.findall(r"^\| `([a-z-]+)` \| (\d+) \|", ABOUT, re.MULTILINE)}


def expected_stop(case):
    return tomllib.loads(case.read_text())["expect"].get("stop", "finished")


class Stops(unittest.TestCase):
    def test_each_reason_has_a_case(self):
        reached = {expected_stop(case) for case in CASES.glob("*.toml")}
        self.assertEqual(reached, set(STATUS) - WITHOUT_CASE)

    def test_exit_status(self):
        for name in ("stationary", "pinch_off", "resolution_lost", "time_limit"):
            case = CASES / f"{name}.toml"
            with self.subTest(case=name), tempfile.TemporaryDirectory() as folder:
                command = [PROGRAM, "run", case, "--quiet", "--overwrite", "-o", Path(folder, "case.hdf")]
                self.assertEqual(subprocess.run(command, capture_output=True).returncode, STATUS[expected_stop(case)])


class OneCase(unittest.TestCase):
    def test_words_and_result_agree(self):
        stop = expected_stop(CASES)
        command = [PROGRAM, "run", CASES, "--expect", "--overwrite", "-o", RESULT]
        done = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, rf"{re.escape(str(CASES))}: {stop}( at t = .*)?: ")
        with h5py.File(RESULT) as file:
            about = file["about"].attrs
            self.assertEqual(about["stop"], stop)
            self.assertIn(about["stop_message"], done.stdout)
            self.assertIn(about["advice"], done.stdout)
            if stop not in ("stationary", "time-limit"):
                self.assertIn(f"docs/failures.md#{about['stop']}", done.stdout)
            # The end is in the series, and in a state that can be looked at or gone on with.
            if stop != "mesh-lost" or about["stop_time"] > 0:  # else nothing was computed
                self.assertEqual(file["series/time"][-1], about["stop_time"])
            last = file["checkpoint"] if stop == "time-limit" else file["frames"][max(file["frames"])]
            self.assertEqual(last.attrs["time"], about["stop_time"])


def load_tests(loader, suite, pattern):
    return loader.loadTestsFromTestCase(OneCase if RESULT else Stops)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
