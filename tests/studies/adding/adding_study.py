#!/usr/bin/python3
"""An energy term, a shape and a stop reason, each added to a copy of the sources as CONTRIBUTING.md says and nowhere
else, are known everywhere.

adding_study.py SOURCE FOLDER CMAKE: the sources, a folder for the copy and its build (kept, so that it need not be
compiled again), the cmake to use.
"""
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np

SOURCE, FOLDER, CMAKE = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
COPY, BUILD = FOLDER / "source", FOLDER / "build"
PARTS = ["common", "axisym", "surface3d", "tools", "tests", "docs", "cases", "CMakeLists.txt", "README.md"]

# The unit sphere with its parallels scaled by 1 + q z.
SHAPE = """// Shape "egg".
#pragma once

#include "common/geometry/surface_point.hpp"
#include "common/shapes/base_surface.hpp"
#include "common/shapes/curve.hpp"

namespace tubule {

struct Egg {
    static constexpr const char* kind = "egg";
    double q = 0;
};

template <class S>
Vector3<S> position(const Egg& egg, const Vector3<S>& p) {
    const Vector3<S> n = p * inverse_sqrt(S(p.dot(p)));
    const S scale = egg.q * n[2] + 1.0;
    return {scale * n[0], scale * n[1], n[2]};
}
inline UnitSphere base(const Egg&) {
    return {};
}
inline Curve meridian(const Egg& egg) {
    return sphere_image(egg);
}

template <class Keys>
void keys(Keys& k, Egg& egg) {
    k.number("q", egg.q, {.above = 0, .to = 0.5}, k.required);
}

}  // namespace tubule
"""
Q = 0.25
VOLUME = np.pi * (4 / 3 + 4 / 15 * Q**2)  # pi INT (1 - z^2) (1 + q z)^2 dz over -1 ... 1

STOP = 'reason(went_out, "went-out", 3, "the light went out")'


def edit(path, pattern, replacement):
    file = COPY / path
    text, count = re.subn(pattern, lambda _: replacement, file.read_text(), count=1, flags=re.DOTALL)
    assert count == 1, f"{path} has no {pattern}"
    file.write_text(text)


def copied():
    """The copy with its additions; files that are as they were keep their times."""
    fresh = FOLDER / "fresh"
    shutil.rmtree(fresh, ignore_errors=True)
    for part in PARTS:
        if (SOURCE / part).is_dir():
            shutil.copytree(SOURCE / part, fresh / part)
        else:
            fresh.mkdir(parents=True, exist_ok=True)
            shutil.copy2(SOURCE / part, fresh / part)
    shutil.rmtree(COPY, ignore_errors=True)
    fresh.rename(COPY)
    terms = "common/energy/bending.hpp"
    run(CMAKE, f"-DINPUT={SOURCE / terms}", f"-DOUTPUT={COPY / terms}", "-DPLACE=first",
        "-P", SOURCE / "tests/adding/add_term.cmake")  # fmt: skip
    (COPY / "common/shapes/egg.hpp").write_text(SHAPE)
    edit("common/case/case.hpp", r"(?=#include \"common/shapes/)", '#include "common/shapes/egg.hpp"\n')
    edit("common/case/case.hpp", r"(?<= Dumbbell,)", " Egg,")
    edit("common/solve/stop.hpp", r"(?<=\"SIGINT or SIGTERM\"\))", " \\\n    " + STOP)


def run(*arguments, status=0):
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True)
    assert done.returncode == status, f"{arguments}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def case(tier, shape="kind = 'sphere'\nradius = 1.0", energy="k20 = 1.0", more=""):
    return f"tier = '{tier}'\n[energy]\n{energy}\n[shape]\n{shape}\n[accuracy]\nenergy = 1e-3\n{more}"


EGG = f"kind = 'egg'\nq = {Q}"
MOVES = "[time]\nend = 1e-4\n"


class Adding(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        copied()
        run(CMAKE, "-S", COPY, "-B", BUILD, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
            "-DCMAKE_CXX_FLAGS_RELEASE=-O1", "-DTUBULE_BENCHMARKS=OFF")  # fmt: skip
        run(CMAKE, "--build", BUILD, "--target", "tubule", "unit_tests")

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def tubule(self, *arguments, status=0):
        return run(BUILD / "tubule", *arguments, status=status)

    def result(self, text):
        path = self.folder / "case.toml"
        path.write_text(text)
        self.tubule("run", path, "-o", self.folder / "result.hdf", "--quiet", "--overwrite")
        return self.folder / "result.hdf"

    def refusal(self, text):
        path = self.folder / "case.toml"
        path.write_text(text)
        return self.tubule("check", path, status=2)

    def picture(self, result, *options):
        self.tubule("plot", result, "-o", self.folder / "picture.svg", *options)
        return (self.folder / "picture.svg").read_text()

    def test_term(self):
        self.assertIn("k22", self.refusal(case("surface3d", energy="k99 = 1.0")))
        paper = '[model]\nkind = "fluid"\n[discretisation]\nscheme = "paper"\nstep = 0.1\n' + MOVES
        self.assertIn('scheme must not be "paper" with energy.k22', self.refusal(case("surface3d", energy="k20 = 1.0\nk22 = 0.1", more=paper)))
        for tier, more in (("axisym", MOVES), ("surface3d", "")):
            # On the unit sphere H = -2, K = 1: k22 INT H^2 K dS = 16 pi k22.
            with h5py.File(self.result(case(tier, energy="k20 = 1.0\nk22 = 0.1", more=more))) as result:
                self.assertAlmostEqual(result["series/energy_22"][0] / (1.6 * np.pi), 1, delta=1e-3, msg=tier)
        # dE/dt = -dissipation holds only if force and energy know the same terms.
        wave = "[[shape.mode]]\namplitude = 0.2\nn = 1\n"
        tube = case("axisym", "kind = 'tube'\nradius = 0.8\nlength = 2.0\n" + wave, "k20 = 0.2\nH0 = -0.5\nk22 = 0.02", MOVES.replace("1e-4", "1e-3"))
        result = self.result(tube.replace("energy = 1e-3", "energy = 1e-6"))
        with h5py.File(result) as file:
            energy, defect = file["series/energy"][:], file["series/identity_defect"][:]
        self.assertLess(abs(defect).max(), 0.1 * (energy[0] - energy[-1]))
        self.assertIn("k\u2082\u2082H\u00b2K", self.picture(result, "--kind=energy"))
        slope = "right, Taylor slope (2\\.0|1\\.9)"
        said = self.tubule("run", "--check-derivatives", "--overwrite", self.folder / "case.toml", "-o", result)
        self.assertRegex(said, f"k22\ngradient: {slope}.*\nHessian : {slope}")

    def test_shape(self):
        self.assertIn('"egg"', self.refusal(case("surface3d", "kind = 'cube'")))
        self.assertIn("shape.q", self.refusal(case("surface3d", "kind = 'egg'\nq = 2.0")))
        for tier, more in (("axisym", MOVES), ("surface3d", "")):
            result = self.result(case(tier, EGG, more=more))
            with h5py.File(result) as file:
                self.assertAlmostEqual(file["series/volume"][0] / VOLUME, 1, delta=1e-3, msg=tier)
        self.assertIn("<svg", self.picture(self.result(case("axisym", EGG, more=MOVES))))
        self.assertIn("q = 0.25", self.tubule("check", self.folder / "case.toml"))

    def test_stop_reason(self):
        moving = case("axisym", "kind = 'tube'\nradius = 1.0\nlength = 2.0", more=MOVES)
        self.assertIn('"went-out"', self.refusal(moving + "[expect]\nstop = 'cold'\n"))
        result = self.result(moving)
        with h5py.File(result, "r+") as file:  # as if it had stopped for this reason
            file["about"].attrs["stop"] = "went-out"
        self.assertIn("went-out", self.tubule("show", result))
        self.assertIn("went-out", self.picture(result))

    def test_docs_are_asked_for(self):
        words = subprocess.run(
            [BUILD / "tests" / "unit_tests", "--gtest_filter=Docs.*"], capture_output=True, text=True
        ).stdout
        for missing in ("lacks k22", "lacks the shape egg", "| `went-out` | 3 | the light went out |"):
            self.assertIn(missing, words)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
