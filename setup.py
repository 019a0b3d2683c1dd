"""What pyproject.toml cannot say: the version, and that CMake compiles the module tubule._core."""

import os
import re
import subprocess
import sysconfig
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

TOP = Path(__file__).resolve().parent
BUILD = TOP / "build/release"  # that of tools/start: what it has compiled is not compiled again


class ByCMake(build_ext):
    def build_extension(self, extension):
        subprocess.run(["cmake", "--preset", "release"], cwd=TOP, check=True)
        jobs = str(os.cpu_count() or 1)
        subprocess.run(["cmake", "--build", BUILD, "--target", "tubule_python", "--parallel", jobs], check=True)
        made = BUILD / "python/tubule" / f"_core{sysconfig.get_config_var('EXT_SUFFIX')}"
        if not made.exists():
            raise SystemExit(f"{made} was not built: use Debian's Python, {sysconfig.get_config_var('EXT_SUFFIX')} is another one")
        self.copy_file(str(made), self.get_ext_fullpath(extension.name))


setup(
    version=re.search(r"project\(Tubule VERSION ([\d.]+)", (TOP / "CMakeLists.txt").read_text())[1],
    ext_modules=[Extension("tubule._core", sources=[])],
    cmdclass={"build_ext": ByCMake},
)
