#!/usr/bin/python3
"""Why each case stops: said alike by its [expect], the exit status, the words and the result.

stops_test.py TUBULE CASES: the program, the folder of the cases.
"""
import re
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

import h5py

PROGRAM, CASES = sys.argv[1], sorted(Path(sys.argv[2]).glob("*.toml"))

# Exit statuses by the table of docs/results.md, which a test compares with the program.
RESULTS = (Path(sys.argv[2]).parent / "docs" / "results.md").read_text()
ABOUT = RESULTS[RESULTS.index("### /about") : RESULTS.index("### /series")]
# No case is interrupted, and none makes a solver fail: other tests show those.
WITHOUT_CASE = {"interrupted", "solver-failed"}
STATUS = {name: int(status) for name, status in re.findall(r"^\| `([a-z-]+)` \| (\d+) \|", ABOUT, re.MULTILINE)}


class Stops(unittest.TestCase):
    def test_status_words_and_result_agree(self):
        reached = set()
        with tempfile.TemporaryDirectory() as folder:
            for case in CASES:
                with self.subTest(case=case.stem):
                    expect = tomllib.loads(case.read_text())["expect"]
                    stop = expect.get("stop", "finished")
                    if stop == "finished" and stop in reached:
                        continue  # those are run by cases.* as well; here one of each kind of stop is enough
                    result = Path(folder, case.stem + ".hdf")
                    done = subprocess.run(
                        [PROGRAM, "run", str(case), "-o", str(result)], capture_output=True, text=True, timeout=100
                    )
                    self.assertEqual(done.returncode, STATUS[stop], done.stdout + done.stderr)
                    self.assertIn(f"{case}: {stop} at t = ", done.stdout)
                    with h5py.File(result) as file:
                        about = file["about"].attrs
                        self.assertEqual(about["stop"], stop)
                        self.assertIn(about["stop_message"], done.stdout)
                        self.assertIn(about["advice"], done.stdout)
                        # The end is in the series, and in a state that can be looked at or gone on with.
                        if stop != "mesh-lost" or about["stop_time"] > 0:  # else nothing was computed
                            self.assertEqual(file["series/time"][-1], about["stop_time"])
                        last = file["checkpoint"] if stop == "time-limit" else file["frames"][max(file["frames"])]
                        if last.attrs.get("restart_role", 0):  # of a coarser run: the one that is told of has not begun
                            self.assertIn("of the coarser run", about["stop_message"])
                            self.assertGreater(last.attrs["time"], about["stop_time"])
                        else:
                            self.assertEqual(last.attrs["time"], about["stop_time"])
                    reached.add(stop)
        self.assertEqual(reached, set(STATUS) - WITHOUT_CASE, "a stop reason that no case shows")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
