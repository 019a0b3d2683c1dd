#!/usr/bin/python3
"""The scripts of docs/python run, and write their pictures.

    script_test.py FOLDER PACKAGES
"""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

FOLDER, PACKAGES = Path(sys.argv[1]).resolve(), sys.argv[2]


class Scripts(unittest.TestCase):
    def test_figure_and_map(self):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(["/usr/bin/python3", "-B", FOLDER / "figure_and_map.py"], cwd=folder, text=True,
                                  env=os.environ | {"PYTHONPATH": PACKAGES}, capture_output=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            for name in ("figure.png", "map.png"):
                self.assertGreater((Path(folder) / name).stat().st_size, 10000)
            self.assertIn("pinched", done.stdout)
            self.assertIn("uniform-tube", done.stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
