#!/usr/bin/python3
"""Starts that a case brings along, run in both tiers: they equal the built-in shapes; a fluid goes on with the velocity of a
result; what is refused. Argument: the program."""
import unittest

import h5py
import numpy as np

from program import ProgramTest, about, series

ENERGY = "[energy]\nk20 = 0.5\nk42 = 0.05\nH0 = -1.0\n"
TUBE = 'kind = "tube"\nradius = 1.0\nlength = 2.0\n[[shape.mode]]\namplitude = 0.2\nn = 1\n'
SPHERE = 'kind = "sphere"\nradius = 1.0\n[[shape.mode]]\namplitude = 0.1\nl = 2\n'
# Re Y_2^0 = sqrt(5/(16 pi)) (3 cos^2 - 1)
Y20 = "1 + 0.1*sqrt(5/(16*pi))*(3*cos(theta)^2 - 1)"
MOVES = "[accuracy]\nenergy = {}\n[time]\nend = 0.01\n"
AT_REST = "[accuracy]\nenergy = 1e-4\n[discretisation]\nelements = 180\n"


def case(shape, more, tier="axisym", model=""):
    return f'tier = "{tier}"\n{ENERGY}{model}[shape]\n{shape}{more}'


class StartsTest(ProgramTest):
    def run_case(self, text, status=0):
        path = self.write("case.toml", text)
        out, err = self.tubule("run", path, "-o", self.result, "--overwrite", status=status)
        return series(self.result), out + err

    def profile(self, name, r, z):
        self.write(name, "r,z\n" + "".join(f"{a:.17g},{b:.17g}\n" for a, b in zip(r, z)))

    def compare(self, built_in, others, names, relative, tier, more):
        expected, _ = self.run_case(case(built_in, more, tier))
        for shape in others:
            found, _ = self.run_case(case(shape, more, tier))
            for name in names:
                for row in (0, -1):
                    self.assertAlmostEqual(found[name][row] / expected[name][row], 1, delta=relative, msg=f"{shape} {name}")

    def test_a_profile_that_is_not_there_is_refused_at_its_key(self):
        text = 'tier = "axisym"\nenergy = {k20 = 1.0}\ntime = {end = 1e-3}\nshape = {kind = "profile", path = "none.csv"}\n'
        for tier in ("axisym", "surface3d"):
            _, said = self.tubule("run", self.write("case.toml", text.replace("axisym", tier)), status=2)
            self.assertRegex(said, r"case\.toml:4:\d+: shape\.path cannot be used: .*none\.csv: there is no such file")

    def test_tubes_equal_the_built_in_one(self):
        z = 2 * np.arange(81) / 80
        self.profile("tube.csv", 1 + 0.2 * np.cos(np.pi * z), z)
        own = (
            'kind = "formula"\nlength = 2.0\nr = "1 + 0.2*cos(pi*z)"\n',
            'kind = "profile"\nlength = 2.0\npath = "tube.csv"\ntolerance = 1e-8\n',
        )
        for tier, more, relative in (("axisym", MOVES.format(1e-6), 1e-5), ("surface3d", AT_REST, 1e-4)):
            self.compare(TUBE, own, ("energy", "area", "volume"), relative, tier, more)

    def test_closed_surfaces_equal_the_built_in_one(self):
        t = np.linspace(0, np.pi, 121)
        r = 1 + 0.1 * np.sqrt(5 / (16 * np.pi)) * (3 * np.cos(t) ** 2 - 1)
        rho = r * np.sin(t)
        rho[[0, -1]] = 0
        self.profile("cell.csv", rho, -r * np.cos(t))
        own = (f'kind = "formula"\nr = "{Y20}"\n', 'kind = "profile"\npath = "cell.csv"\ntolerance = 1e-8\n')
        for tier, more, relative in (("axisym", MOVES.format(1e-6), 1e-5), ("surface3d", AT_REST, 2e-4)):
            self.compare(SPHERE, own, ("energy", "area", "volume"), relative, tier, more)

    def test_formulas_without_symmetry(self):
        # Re Y_2^2 = sqrt(15/(32 pi)) sin^2 cos(2 phi); the tube by its own modes.
        round_ = SPHERE.replace("l = 2", "l = 2\nm = 2")
        own = 'kind = "formula"\nr = "1 + 0.1*sqrt(15/(32*pi))*sin(theta)^2*cos(2*phi)"\n'
        self.compare(round_, (own,), ("energy", "area", "volume"), 1e-9, "surface3d", AT_REST)
        tube = TUBE + "[[shape.mode]]\namplitude = 0.05\nn = 0\nm = 3\n"
        own = 'kind = "formula"\nlength = 2.0\nr = "1 + 0.2*cos(pi*z) + 0.05*cos(3*theta)"\n'
        self.compare(tube, (own,), ("energy", "area", "volume"), 1e-9, "surface3d", AT_REST)

    def test_smoothing_is_reported(self):
        t = np.linspace(0, np.pi, 121)
        rho, z = np.sin(t), -1.5 * np.cos(t)
        rho[[0, -1]] = 0
        self.profile("cell.csv", rho, z)
        _, words = self.run_case(case('kind = "profile"\npath = "cell.csv"\ntolerance = 1e-3\n', MOVES.format(1e-4)))
        self.assertRegex(words, r"a smooth curve of \d+ waves is at most \S+ from the 121 points")

    def test_bad_files_are_refused(self):
        self.write("bad.csv", "r,z\n0,-1\n0.5,oops\n")
        path = self.write("case.toml", case('kind = "profile"\npath = "bad.csv"\n', MOVES.format(1e-4)))
        self.assertIn("bad.csv:3:5: 'oops' is not a finite number", self.refused("run", path))
        self.assertIn("bad.csv:3:5: 'oops' is not a finite number", self.refused("check", path))
        path = self.write("case.toml", case('kind = "formula"\nr = "1 + 0.1*cos(phi"\n', MOVES.format(1e-4)))
        self.assertRegex(self.refused("run", path), r"case\.toml:8:17: shape\.r, character 12: this parenthesis is not closed")
        path = self.write("case.toml", case('kind = "formula"\nr = "1 + 0.1*sin(theta)^2*cos(2*phi)"\n', MOVES.format(1e-4)))
        self.assertIn("shape.r must not contain phi", self.refused("run", path))

    def test_H0_of_the_points_goes_with_them(self):
        # A run that is resumed has the H0 that it began with, and ends like one that went through.
        t = np.linspace(0, np.pi, 121)
        rho, z = np.sin(t), -np.cos(t)
        rho[[0, -1]] = 0
        rows = zip(rho, z, -2 - np.tanh(((1 + z) / 2 - 0.6) / 0.25))
        self.write("domains.csv", "r,z,H0\n" + "".join(f"{a:.17g},{b:.17g},{c:.17g}\n" for a, b, c in rows))
        shape = 'kind = "profile"\npath = "domains.csv"\ntolerance = 1e-6\n'
        energy, model = "[energy]\nk20 = 0.5\n", '[model]\nkind = "overdamped"\nvolume = "free"\n'
        surface = "[accuracy]\nenergy = 1e-2\nestimate = false\n[discretisation]\nelements = 80\n[time]\nend = 0.02\n"
        for tier, more, relative in (("axisym", MOVES.format(1e-6).replace("0.01", "0.02"), 4e-6), ("surface3d", surface, 1e-3)):
            text = f'tier = "{tier}"\n{energy}{model}[shape]\n{shape}{more}'
            whole, words = self.run_case(text)
            scale = about(self.result)["E_ref"]
            if tier == "axisym":
                self.assertRegex(words, r"a smooth curve of \d+ waves is at most \S+ from the 121 points of the profile, a smooth H0 at most")
            with h5py.File(self.result) as file:
                H0 = file["frames/000000/H0"][:] if "H0" in file["frames/000000"] else file["frames/000000/PointData/H0"][:]
            self.assertAlmostEqual(H0.max(), -2 + np.tanh(0.6 / 0.25), delta=1e-3)
            self.run_case(text.replace("end = 0.02", "end = 0.008"))
            self.tubule("run", self.result, "--resume", "--until", "0.02")
            resumed = series(self.result)
            self.assertEqual(resumed["time"][-1], 0.02)
            self.assertAlmostEqual(resumed["energy"][-1], whole["energy"][-1], delta=relative * scale)
            self.assertLess(whole["energy"][-1], 0.99 * whole["energy"][0])
        # Given twice; and what has no law for it.
        path = self.write("case.toml", text.replace("k20 = 0.5", "k20 = 0.5\nH0 = -1.0"))
        self.assertRegex(self.refused("run", path), r"case\.toml:4:6: energy\.H0 must be absent: .*domains\.csv:1:5 has H0 in a column")
        path = self.write("case.toml", f'tier = "axisym"\n{energy}{model}[shape]\n{shape}{MOVES.format(1e-4)}')
        self.assertIn("shape.path has a column H0, but H0 must be a number for growth rates", self.refused("stability", path))
        self.assertIn("must be a number in a scan", self.refused("scan", path, "--over", "energy.k20=1:2:2"))
        self.write("domains.csv", "r,z\n" + "".join(f"{a:.17g},{b:.17g}\n" for a, b in zip(rho, z)))
        # A result remembers, whatever became of the file.
        self.assertIn("must be a number for growth rates", self.refused("stability", self.result))

    def test_a_fluid_goes_on_with_the_velocity_of_a_result(self):
        # Kinetic energy at the start is that of the frame; the energies at 2T are those of a run that went through.
        fluid = '[model]\nkind = "fluid"\nRe = 5.0\n'
        times = "[accuracy]\nenergy = 1e-5\n[time]\nend = {}\n"
        whole, _ = self.run_case(case(SPHERE, times.format(0.2) + "output = [0.1]\n", model=fluid))
        self.result.rename(self.folder / "first.hdf")
        again = fluid + '[velocity]\ninitial = "result"\n'
        frame = 'kind = "result"\npath = "first.hdf"\nframe = 1\n'
        rest, _ = self.run_case(case(frame, times.format(0.1), model=again))
        at = np.searchsorted(whole["time"], 0.1)
        self.assertGreater(whole["kinetic_energy"][at], 1e-4)
        self.assertAlmostEqual(rest["kinetic_energy"][0] / whole["kinetic_energy"][at], 1, delta=1e-3)
        reference = about(self.result)["E_ref"]
        self.assertAlmostEqual(rest["energy"][-1], whole["energy"][-1], delta=1e-4 * reference)
        self.assertAlmostEqual(rest["kinetic_energy"][-1], whole["kinetic_energy"][-1], delta=1e-4 * reference)
        still, _ = self.run_case(case(frame, times.format(0.1), model=fluid))
        # Without that velocity it ends elsewhere.
        misses, without = (abs(run["energy"][-1] - whole["energy"][-1]) for run in (rest, still))
        self.assertGreater(without, 10 * misses)
        # In three dimensions from the same frame, and from there again.
        surface = "[accuracy]\nenergy = 1e-2\nestimate = false\n[discretisation]\nelements = 80\n[time]\nend = 0.01\n"
        three, _ = self.run_case(case(frame, surface, "surface3d", again))
        self.assertAlmostEqual(three["kinetic_energy"][0] / whole["kinetic_energy"][at], 1, delta=1e-2)
        self.result.rename(self.folder / "second.hdf")
        last = 'kind = "result"\npath = "second.hdf"\n'
        more, _ = self.run_case(case(last, surface.replace("elements = 80\n", "order = 4\n"), "surface3d", again))
        self.assertAlmostEqual(more["kinetic_energy"][0] / three["kinetic_energy"][-1], 1, delta=1e-6)

    def test_results_without_a_velocity_are_refused(self):
        self.run_case(case(TUBE, MOVES.format(1e-4)))
        self.result.rename(self.folder / "graph.hdf")
        again = '[model]\nkind = "fluid"\n[velocity]\ninitial = "result"\n'
        path = self.write("case.toml", case('kind = "result"\npath = "graph.hdf"\n', MOVES.format(1e-4), model=again))
        self.assertIn("velocity.initial must not be \"result\": the frame of shape.path", self.refused("run", path))


if __name__ == "__main__":
    unittest.main(argv=["starts_test.py"])
