#!/usr/bin/python3
"""The script for Slurm, without Slurm: it runs all ranks, saves and asks to be queued again before its time limit, and goes
on when it is run again.

slurm_test.py TUBULE SCRIPT [MPIRUN]
"""
import csv
import os
import signal
import stat
import subprocess
import sys
import time
import unittest

SCRIPT = sys.argv[2]
MPIRUN = sys.argv[3] if len(sys.argv) > 3 else None

from program import PROGRAM, QUICK, SLOW, ProgramTest, about

SCAN = 'case = "case.toml"\nover = ["energy.k42=0.1:0.12:8"]\nset = ["discretisation.parametrisation=graph"]\nuntil = "end"\n'


@unittest.skipUnless(MPIRUN, "built without MPI")
class Slurm(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("case.toml", SLOW)
        self.write("map.toml", SCAN)
        queue = self.write("scontrol", '#!/bin/sh\necho "$@" >> queued\n')
        queue.chmod(queue.stat().st_mode | stat.S_IXUSR)
        self.environment = {
            **os.environ, "TUBULE": PROGRAM, "TUBULE_MPIRUN": f"{MPIRUN} --allow-run-as-root --oversubscribe -n 2",
            "SLURM_JOB_ID": "17", "PATH": f"{self.folder}:{os.environ['PATH']}"}  # fmt: skip

    def job(self, *arguments):
        return subprocess.Popen(["bash", SCRIPT, *arguments], cwd=self.folder, env=self.environment,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip

    def test_a_scan_that_is_queued_again(self):
        with self.job("map.toml") as job:
            while not (self.folder / "map.hdf").exists():
                self.assertIsNone(job.poll(), "it ended before it could be disturbed")
                time.sleep(0.02)
            job.send_signal(signal.SIGTERM)  # as Slurm does near the limit
            job.communicate()
        self.assertEqual(job.returncode, 130)
        self.assertEqual((self.folder / "queued").read_text(), "requeue 17\n")
        known = len(self.tubule("show", "map.hdf", "--csv")[0].splitlines()) - 1
        self.assertTrue(0 < known < 8, known)
        with self.job("map.toml") as job:
            out, err = job.communicate()
        self.assertEqual(job.returncode, 0, err)
        self.assertIn(f"{8 - known} run now", out)
        self.assertEqual(about(self.folder / "map.hdf")["workers"], 2)

    def test_a_chart(self):
        self.environment["TUBULE_COMMAND"] = "chart"
        self.write("case.toml", QUICK)
        with self.job("case.toml", "--vary", "accuracy.energy=1e-2,1e-3") as job:
            _, err = job.communicate()
        self.assertEqual(job.returncode, 0, err)
        with open(self.folder / "case.csv", newline="") as file:
            self.assertEqual(len(list(csv.DictReader(file))), 2)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
