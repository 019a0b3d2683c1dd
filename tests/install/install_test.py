#!/usr/bin/python3
"""An installed Tubule: its program runs, and another CMake project links both tiers.

install_test.py BUILD CMAKE: a finished build and the cmake to use.
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

BUILD, CMAKE = sys.argv[1], sys.argv[2]


def run(*arguments, **options):
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True, timeout=500, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


class Install(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.prefix = cls.folder / "prefix"
        run(CMAKE, "--install", BUILD, "--prefix", cls.prefix)

    def test_another_project_links_both_tiers(self):
        build = self.folder / "build"
        source = Path(__file__).parent / "uses_tubule"
        run(CMAKE, "-S", source, "-B", build, f"-DCMAKE_PREFIX_PATH={self.prefix}", "-DCMAKE_BUILD_TYPE=Debug")
        run(CMAKE, "--build", build)
        self.assertIn("energy", run(build / "uses_tubule"))

    def test_schemas_are_installed(self):
        found = {path.name for path in (self.prefix / "share/tubule/schemas").iterdir()}
        self.assertEqual(found, {path.name for path in (Path(__file__).parents[2] / "docs/schemas").iterdir()})

    def test_installed_cases_find_their_meshes(self):
        cases = self.prefix / "share/tubule/cases"
        run(self.prefix / "bin/tubule", "run", cases / "surface_file.toml", "--expect", cwd=self.folder)

    def test_installed_program_finds_its_scripts(self):
        cases = self.prefix / "share/tubule/cases"
        result, picture = self.folder / "torus.hdf", self.folder / "torus.png"
        run(self.prefix / "bin/tubule", "run", cases / "surface_clifford_torus.toml", "-o", result)
        run(self.prefix / "bin/tubule", "plot", result, "-o", picture)
        self.assertTrue(picture.exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
