#!/usr/bin/python3
"""The packages: what they export, on an old processor, and in a bare Debian with nothing else.

packages_study.py SOURCES [--made]      --made: takes those of build/package instead of making them

The tests that need root, a network, debootstrap or qemu-user are skipped where these are missing.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

SOURCES = Path(sys.argv[1]).resolve()
DEBS = SOURCES / "build/package"
LIB = "usr/lib/x86_64-linux-gnu"
CASE = "cases/figure_k42_006.toml"


def run(*command, **options):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command}: {done.stdout[-3000:]}{done.stderr[-3000:]}"
    return done.stdout


def setUpModule():
    if "--made" not in sys.argv:
        run(SOURCES / "tools/package")


class Unpacked(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.root = Path(folder.name)
        for deb in DEBS.glob("*.deb"):
            run("dpkg-deb", "-x", deb, cls.root)
        cls.environment = os.environ | {"LD_LIBRARY_PATH": str(cls.root / LIB), "OMP_NUM_THREADS": "1"}

    def libraries(self):
        """The baseline, then the variants."""
        return [self.root / LIB / "libtubule.so.0.2", *sorted((self.root / LIB / "glibc-hwcaps").glob("*/libtubule.so.0.2"))]

    def test_variants_export_the_same_and_only_what_is_ours(self):
        names = [set(run("nm", "-DC", "--defined-only", "--format=just-symbols", path).split("\n")) for path in self.libraries()]
        self.assertGreater(len(names), 1)
        for others in names[1:]:
            self.assertEqual(names[0] ^ others, set())
        self.assertGreater(len(names[0]), 500)
        foreign = [name for name in names[0] if name and "tubule::" not in name]
        self.assertEqual(foreign, [])
        registers = [name for name in names[0] if re.search(r"__m(128|256|512)|__vector|Packet\d|simd", name)]
        self.assertEqual(registers, [])

    def test_what_others_compile_with(self):
        flags = "".join(path.read_text() for path in (self.root / LIB / "cmake/Tubule").glob("*.cmake"))
        self.assertNotIn("march", flags)
        self.assertIn("EIGEN_MAX_ALIGN_BYTES=64", flags)
        headers = [path.read_text() for path in (self.root / "usr/include/tubule").rglob("*.hpp")]
        self.assertGreater(len(headers), 100)
        self.assertFalse([text for text in headers if re.search(r"experimental/simd|immintrin|__AVX", text)])

    def test_old_processors(self):
        """Processors of 2003 (SSE2) and 2008 (SSE4.2) use the baseline; its result is that of the other variant."""
        emulator = shutil.which("qemu-x86_64")
        if not emulator:
            self.skipTest("there is no qemu-x86_64: package qemu-user")
        program = self.root / "usr/bin/tubule"
        if "avx2" in Path("/proc/cpuinfo").read_text():
            self.assertIn("-march=x86-64-v", run(program, "--version", env=self.environment))
        energies = []
        for number, start in enumerate(([], [emulator, "-cpu", "qemu64"], [emulator, "-cpu", "Nehalem"])):
            if start:
                self.assertNotIn("-march", run(*start, program, "--version", env=self.environment))
            result = self.root / f"{number}.hdf"
            run(*start, program, "run", self.root / "usr/share/tubule" / CASE, "-o", result, env=self.environment)
            last = run(program, "show", result, "--csv", env=self.environment).splitlines()
            energies.append(float(last[-1].split(",")[last[0].split(",").index("energy")]))
        for energy in energies[1:]:
            self.assertAlmostEqual(energy, energies[0], delta=1e-7)  # 1e-6 of E_ref = 21 is asked for

    def test_manual_pages_and_completion_are_there(self):
        for path in ("share/man/man1/tubule.1.gz", "share/man/man1/tubule-run.1.gz", "share/zsh/vendor-completions/_tubule",
                     "share/bash-completion/completions/tubule", "share/tubule/cases/meshes/disc.off",
                     "share/doc/tubule/docs/results.md", "lib/python3/dist-packages/tubule/drawing/view_body.js"):  # fmt: skip
            self.assertTrue((self.root / "usr" / path).exists(), path)


class BareDebian(unittest.TestCase):
    """A Debian that has nothing but what every one has: three commands to a picture, and the first tutorial."""

    @classmethod
    def setUpClass(cls):
        if os.geteuid() != 0 or not shutil.which("debootstrap"):
            raise unittest.SkipTest("needs root and debootstrap")
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.root = Path(folder.name) / "debian"
        done = subprocess.run(["debootstrap", "--variant=minbase", "bookworm", cls.root], capture_output=True, text=True)
        if done.returncode != 0:
            raise unittest.SkipTest(f"debootstrap: {done.stdout[-500:]}{done.stderr[-500:]}")
        run("mount", "-t", "proc", "proc", cls.root / "proc")
        cls.addClassCleanup(run, "umount", cls.root / "proc")
        (cls.root / "packages").mkdir()
        for deb in DEBS.glob("*.deb"):
            shutil.copy(deb, cls.root / "packages")
        cls.inside("useradd", "--create-home", "somebody")
        for part in ("docs/tutorials", "tests/docs", "cases"):
            shutil.copytree(SOURCES / part, cls.root / "tubule" / part)

    @classmethod
    def inside(cls, *command, timed=False):
        begin = time.monotonic()
        out = run("chroot", cls.root, "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND=noninteractive", *command)
        if timed:
            print(f"{time.monotonic() - begin:6.1f} s  {' '.join(map(str, command))}", flush=True)
        return out

    def user(self, command, **options):
        return self.inside("su", "somebody", "-c", f"cd; {command}", **options)

    def test_from_nothing_to_a_picture(self):
        self.inside("apt-get", "update")
        self.inside("sh", "-c", "apt-get install --yes --no-install-recommends /packages/tubule_*.deb /packages/libtubule0*.deb /packages/python3-tubule_*.deb python3-h5py python3-matplotlib", timed=True)
        # matplotlib of Debian brings scipy, which brings a compiler: nobody may need it.
        self.inside("sh", "-c", "rm -f /usr/bin/*gcc* /usr/bin/*g++* /usr/bin/cc /usr/bin/c++ /usr/bin/cpp*")
        self.user(f"tubule run {CASE}", timed=True)
        self.user("tubule plot figure_k42_006.hdf", timed=True)
        self.assertGreater((self.root / "home/somebody/figure_k42_006.png").stat().st_size, 10000)
        self.user("python3 /tubule/tests/docs/tutorials_test.py /usr/bin/tubule /tubule first_tube", timed=True)
        self.user("python3 -c 'import tubule; r = tubule.run(\"/usr/share/tubule/" + CASE + '"); tubule.draw(r, "a.png"); print(r)\'')
        self.assertGreater((self.root / "home/somebody/a.png").stat().st_size, 10000)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
