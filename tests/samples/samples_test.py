#!/usr/bin/python3
"""Results of an earlier version open in all that reads results; a run goes on with them, or names why it does not.

samples_test.py TUBULE PACKAGES. What is in them: README.md.
"""
import contextlib
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

TUBULE = Path(sys.argv[1]).resolve()
sys.path.insert(0, sys.argv[2])

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
import scripts
import tubule

DRAWING = Path(__file__).resolve().parents[2] / "tools/python/tubule/drawing"
HERE = Path(__file__).parent
RUNS = {"graph": "axisym", "curve": "axisym", "surface": "surface3d"}


class Samples(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.names = [path.stem for path in HERE.glob("*.hdf")]
        self.assertEqual(len(self.names), 5)
        for name in self.names:
            shutil.copy(HERE / f"{name}.hdf", self.folder)

    def tubule(self, *arguments, status=0):
        if arguments[0] in ("plot", "view"):
            with contextlib.chdir(self.folder):
                done = scripts.run_script(DRAWING, *arguments)
        else:
            done = subprocess.run([TUBULE, *arguments], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done

    def test_they_open(self):
        for name in self.names:
            with self.subTest(name):
                file = f"{name}.hdf"
                picture = ["plot", file, "-o", f"{name}.png", *["--series=energy"] * (name == "surface")]  # shaded, it takes 5 s
                for reading in (["show", file], ["show", file, "--csv"], ["show", file, "--json"], picture,
                                ["view", file, "-o", f"{name}.html"]):  # fmt: skip
                    done = self.tubule(*reading)
                    self.assertEqual(done.stderr, "")
                    self.assertTrue(done.stdout)
                self.assertIn("as it was written", self.tubule("show", file, "--verify").stdout)
                self.assertGreater((self.folder / f"{name}.png").stat().st_size, 10_000)
                self.assertEqual((self.folder / file).read_bytes(), (HERE / file).read_bytes())

    def test_python_reads_runs(self):
        for name in (*RUNS, "equilibrium"):
            result = tubule.read(self.folder / f"{name}.hdf")
            self.assertEqual(result.about["git_hash"], "f79f616fc706")
            self.assertEqual(result.stop, "finished")
            self.assertGreater(result.series["energy"][0], 0)
            self.assertTrue(result.frames)

    def test_a_run_goes_on_or_says_why_not(self):
        for name in RUNS:
            done = subprocess.run([TUBULE, "run", f"{name}.hdf", "--resume", "--until", "0.25"], cwd=self.folder, capture_output=True,
                                  text=True)  # fmt: skip
            if done.returncode != 0:
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertRegex(done.stderr, f"{name}.hdf: .*other versions.*run the case without --resume")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
