#!/usr/bin/python3
"""The notebook of docs/python runs from its first cell to its last, and shows what it is there to show.

    notebook_test.py FOLDER PACKAGES

By Jupyter, which the test needs: tools/packages-room.txt.
"""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

FOLDER, PACKAGES = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()


class Notebook(unittest.TestCase):
    def test_tour(self):
        with tempfile.TemporaryDirectory() as folder:
            shutil.copy(FOLDER / "tour.ipynb", folder)  # it writes files beside it
            done = subprocess.run(["/usr/bin/python3", "-m", "nbconvert", "--to", "notebook", "--execute", "--inplace", "tour.ipynb"], cwd=folder,
                                  env=os.environ | {"PYTHONPATH": str(PACKAGES)}, capture_output=True, text=True)  # fmt: skip
            self.assertEqual(done.returncode, 0, done.stderr[-3000:])
            cells = json.loads((Path(folder) / "tour.ipynb").read_text())["cells"]
        shown = [{kind: "".join(text) for out in cell.get("outputs", ()) for kind, text in out.get("data", {}).items()} for cell in cells]
        pages = [data["text/html"] for data in shown if "text/html" in data]
        self.assertTrue(pages[0].startswith("<iframe srcdoc="), pages[0][:200])
        self.assertEqual(pages[1].count("<tr>"), 5)
        kinds = [kind for data in shown for kind in data]
        self.assertEqual((kinds.count("image/png"), kinds.count("image/gif")), (3, 1))
        source = json.loads((FOLDER / "tour.ipynb").read_text())["cells"]
        self.assertFalse([cell for cell in source if cell.get("outputs")])  # kept without


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
