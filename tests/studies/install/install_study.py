#!/usr/bin/python3
"""An installed Tubule: its program runs, another CMake project links both tiers, each header compiles by itself, and the
programs of docs/cplusplus print what is expected.

install_study.py BUILD CMAKE: a finished build and the cmake to use.
"""
import json
import math
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

BUILD, CMAKE = sys.argv[1], sys.argv[2]
SOURCES = Path(__file__).parents[3]


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

    def test_programs_of_the_docs(self):
        """A spheroid with half axes 1.2 and 0.6, theory.md (7.3); the tube as the command runs it; a surface whose energy
        falls, but not below that of a sphere, 8 pi (Willmore)."""
        build, source = self.folder / "programs", SOURCES / "docs/cplusplus"
        run(CMAKE, "-S", source, "-B", build, f"-DCMAKE_PREFIX_PATH={self.prefix}", "-DCMAKE_BUILD_TYPE=Debug")
        run(CMAKE, "--build", build)
        printed = lambda name: run(build / name, cwd=self.folder)  # noqa: E731
        number = lambda pattern, text: float(re.search(pattern + r"\s*(-?[\d.e+-]+)", text)[1])  # noqa: E731

        text = printed("energy_of_a_profile")
        a, c = 1.2, 0.6
        e = math.sqrt(1 - (c / a) ** 2)
        self.assertAlmostEqual(number("area", text), 2 * math.pi * a**2 * (1 + (1 - e**2) / e * math.atanh(e)), delta=1e-6)
        self.assertAlmostEqual(number("volume", text), 4 * math.pi / 3 * a * a * c, delta=1e-6)
        squares = 3 * (2 * a**4 + c**4) + 2 * (a**4 + 2 * a * a * c * c)
        exact = 0.05 * 4 * math.pi * squares / (15 * a**4 * c**2)
        self.assertAlmostEqual(number(r"K\^2:", text), exact, delta=1e-5)
        self.assertAlmostEqual(number(r"size\)", text), number("differences", text), delta=1e-4)

        text = printed("run_a_tube")
        self.assertIn("finished", text)
        case = self.folder / "tube.toml"
        source = (SOURCES / "docs/cplusplus/run_a_tube.cpp").read_text()
        case.write_text(re.search(r'R"\((.*?)\)"', source, re.DOTALL)[1])
        run(self.prefix / "bin/tubule", "run", case, "--set", "energy.k42=0.12", "-o", self.folder / "tube.hdf")
        last = lambda name: run(self.prefix / "bin/tubule", "show", self.folder / name, "--csv").splitlines()[-1]  # noqa: E731
        energy = lambda line: line.split(",")[1]  # noqa: E731
        self.assertEqual(energy(last("run_a_tube.hdf")), energy(last("tube.hdf")))
        run(self.prefix / "bin/tubule", "run", case, "-o", self.folder / "given.hdf")
        run(build / "run_a_tube", case, self.folder / "from_file.hdf")
        self.assertEqual(energy(last("from_file.hdf")), energy(last("given.hdf")))
        self.assertNotEqual(energy(last("given.hdf")), energy(last("tube.hdf")))

        text = printed("run_a_surface")
        energies = [float(value) for value in re.findall(r"energy ([\d.]+)", text)]
        self.assertEqual(energies, sorted(energies, reverse=True))
        self.assertTrue(8 * math.pi < energies[-1] < energies[0] < 9 * math.pi, text)

    def test_each_header_compiles_by_itself(self):
        build, source = self.folder / "flags", Path(__file__).parent / "uses_tubule"
        run(CMAKE, "-S", source, "-B", build, f"-DCMAKE_PREFIX_PATH={self.prefix}", "-DCMAKE_BUILD_TYPE=Debug",
            "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON")  # fmt: skip
        entry = json.loads((build / "compile_commands.json").read_text())[0]
        command = shlex.split(entry["command"])
        flags = command[1 : command.index("-o")]
        headers = sorted((self.prefix / "include/tubule").rglob("*.hpp"))
        self.assertGreater(len(headers), 100)

        def errors(header):
            done = subprocess.run([command[0], *flags, "-fsyntax-only", "-x", "c++", header], capture_output=True, text=True)
            return done.stderr if done.returncode else ""

        with ThreadPoolExecutor(2) as pool:
            failed = [text for text in pool.map(errors, headers) if text]
        self.assertEqual(failed, [])

    def test_few_public_functions_lack_a_comment(self):
        if not shutil.which("doxygen"):
            self.skipTest("there is no doxygen")
        run(CMAKE, "--build", BUILD, "--target", "doc")
        warnings = (Path(BUILD) / "api/warnings.txt").read_text().splitlines()
        bare = [line for line in warnings if "(function)" in line and "is not documented" in line]
        self.assertLess(len(bare), 125, "\n".join(bare))  # those whose names say all: sizes, parts, constructors
        self.assertTrue((Path(BUILD) / "api/html/index.html").exists())

    def test_schemas_are_installed(self):
        found = {path.name for path in (self.prefix / "share/tubule/schemas").iterdir()}
        self.assertEqual(found, {path.name for path in (Path(__file__).parents[3] / "docs/schemas").iterdir()})

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
