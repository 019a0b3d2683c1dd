#!/usr/bin/python3
"""`pip install --no-build-isolation .` into an environment: the package runs, draws, and leaves nothing in the tree.

pip_study.py SOURCES
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCES = Path(sys.argv[1]).resolve()
SCRIPT = """
import tubule
result = tubule.run(tubule.Case("cases/figure_k42_006.toml"))
assert result.stop == "finished"
tubule.draw(result, "a.png")
print(tubule.__file__, tubule.__version__)
"""


def run(*command, **options):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


class Pip(unittest.TestCase):
    def test_install(self):
        with tempfile.TemporaryDirectory() as folder:
            environment = Path(folder) / "environment"
            run("/usr/bin/python3", "-m", "venv", "--system-site-packages", environment)
            before = run("git", "-C", SOURCES, "status", "--short")
            run(environment / "bin/pip", "install", "--no-build-isolation", "--no-deps", "--no-index", SOURCES)
            self.assertEqual(run("git", "-C", SOURCES, "status", "--short"), before)
            (Path(folder) / "cases").symlink_to(SOURCES / "cases")
            found, version = run(environment / "bin/python", "-c", SCRIPT, cwd=folder).split()
            self.assertTrue(Path(found).is_relative_to(environment), found)
            self.assertIn(f"VERSION {version} ", (SOURCES / "CMakeLists.txt").read_text())
            self.assertGreater((Path(folder) / "a.png").stat().st_size, 10000)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
