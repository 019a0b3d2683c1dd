#!/usr/bin/python3
"""Starts that a case brings along, run in both tiers: they equal the built-in shapes; a fluid goes on with the velocity of a
result; what is refused. Argument: the program."""
import re
import unittest

import h5py
import numpy as np

from inputs_test import octahedron
from program import ProgramTest, about, series

ENERGY = "[energy]\nk20 = 0.5\nk42 = 0.05\nH0 = -1.0\n"
TUBE = 'kind = "tube"\nradius = 1.0\nlength = 2.0\n[[shape.mode]]\namplitude = 0.2\nn = 1\n'
SPHERE = 'kind = "sphere"\nradius = 1.0\n[[shape.mode]]\namplitude = 0.1\nl = 2\n'
# Re Y_2^0 = sqrt(5/(16 pi)) (3 cos^2 - 1)
Y20 = "1 + 0.1*sqrt(5/(16*pi))*(3*cos(theta)^2 - 1)"
MOVES = "[accuracy]\nenergy = {}\n[time]\nend = 0.01\n"
BEGINS = MOVES.replace("0.01", "1e-6")  # where only the start counts
AT_REST = "[accuracy]\nenergy = 1e-4\n[discretisation]\nelements = 180\n"


def case(shape, more, tier="axisym", model=""):
    return f'tier = "{tier}"\n{ENERGY}{model}[shape]\n{shape}{more}'


class Starts(ProgramTest):
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


class StartsTest(Starts):
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


def mode(**keys):
    return "[[shape.mode]]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items())


ROUND = 'kind = "sphere"\nradius = 1.3\n'
STRAIGHT = 'kind = "tube"\nradius = 1.2\nlength = 2.0\n'
RING = 'kind = "torus"\nradius = 2.0\ntube_radius = {}\n'
OVERDAMPED = '[model]\nkind = "overdamped"\n'


class DisturbedTest(Starts):
    """Modes and noise of frames and meshes: on spheres, tubes and tori they are those of the built-in shapes."""

    def base(self, shape, more, tier="axisym", model=""):
        self.run_case(case(shape, more, tier, model))
        self.result.rename(self.folder / "base.hdf")

    def same(self, shape, disturbed, waves, tier, relative, more=None, frame='kind = "result"\npath = "base.hdf"\nframe = 0\n'):
        more = more or (BEGINS.format(1e-6) if tier == "axisym" else AT_REST.replace("180", "180\norder = 2"))
        model = OVERDAMPED if tier == "axisym" else ""
        expected, _ = self.run_case(case(shape + disturbed, more, tier, model))
        found, _ = self.run_case(case(frame + waves, more, tier, model))
        for name in ("energy", "area", "volume"):
            self.assertAlmostEqual(found[name][0] / expected[name][0], 1, delta=relative, msg=f"{waves} {tier} {name}")

    def test_of_a_profile(self):
        round_, wavy = mode(amplitude=0.1, l=3), mode(amplitude=0.1, n=2, phase=0.4)
        triaxial, around = mode(amplitude=0.1, l=3, m=2), mode(amplitude=0.05, n=1, m=3)
        noise = "[[shape.noise]]\namplitude = 0.02\n{} = 4\nm = {}\nseed = 3\n"
        self.base(ROUND, BEGINS.format(1e-6), model=OVERDAMPED)
        for tier, one, m, relative in (("axisym", round_, 0, 1e-6), ("surface3d", triaxial, 2, 1e-3)):
            waves = one + noise.format("l", m)
            self.same(ROUND, waves, waves, tier, relative)
        self.base(STRAIGHT, BEGINS.format(1e-6))  # a graph
        wavy += noise.format("n", 0).replace("n = 4", "n = 2")
        self.same(STRAIGHT, wavy, wavy, "axisym", 1e-6)
        self.same(STRAIGHT, around, around, "surface3d", 5e-3)
        self.base(RING.format(0.5), BEGINS.format(1e-6), model=OVERDAMPED)
        thicker = mode(amplitude=0.1, n=0)
        self.same(RING.format(0.6), "", thicker, "axisym", 1e-6)
        self.same(RING.format(0.6), "", thicker, "surface3d", 1e-2, AT_REST.replace("180", "720"))  # grids differ

    def test_of_a_surface(self):
        more = AT_REST.replace("elements = 180\n", "")
        self.base(ROUND, AT_REST, "surface3d")
        self.same(ROUND, mode(amplitude=0.1, l=2, m=1), mode(amplitude=0.1, l=2, m=1), "surface3d", 1e-3, more)
        self.base(STRAIGHT, AT_REST, "surface3d")
        self.same(STRAIGHT, mode(amplitude=0.1, n=1, m=2), mode(amplitude=0.1, n=1, m=2), "surface3d", 1e-3, more)

    def test_of_a_mesh_of_any_size(self):
        self.write("mesh.off", octahedron(0))
        more = AT_REST.replace("elements = 180\n", "").replace("1e-4", "0.1")
        for size, radius in (("", 1), ("scale = 1.3\n", 1.3), (f"area = {4 * np.pi * 1.3**2!r}\n", 1.3)):
            waves = mode(amplitude=0.1, l=2, m=2)
            self.same(f'kind = "sphere"\nradius = {radius}\n', waves, waves, "surface3d", 2e-2, more,
                      'kind = "file"\npath = "mesh.off"\n' + size)  # fmt: skip
        found, _ = self.run_case(case('kind = "file"\npath = "mesh.off"\narea = 3.0\n', more, "surface3d"))
        self.assertAlmostEqual(found["area"][0], 3, delta=1e-9)

    def test_what_a_frame_cannot_have(self):
        self.base(ROUND, MOVES.format(1e-4), model=OVERDAMPED)
        frame = 'kind = "result"\npath = "base.hdf"\n'
        for waves, words in (
            (mode(amplitude=0.1, n=2), r"case\.toml:\d+:\d+: shape\.mode must have l, not n: the frame is a closed surface"),
            (mode(amplitude=0.1), "shape.mode.0 needs l, if the frame is a closed surface, or n, if it is a tube or a ring"),
            (mode(amplitude=0.1, n=1) + mode(amplitude=0.1, l=2), "shape.mode.1 must have the same of l and n as the others"),
            (mode(amplitude=0.1, l=2, phase=1), "shape.mode.0.phase must be absent: only valid with n"),
            (mode(amplitude=0.1, l=2, m=2), "shape.mode.0.m must be 0, not 2"),
            (mode(amplitude=3, l=1), "shape.mode moves the surface across its axis at z = "),
            ("[[shape.noise]]\namplitude = 0.1\nn = 3\n", "shape.noise must have l, not n"),
        ):
            path = self.write("case.toml", case(frame + waves, MOVES.format(1e-4), model=OVERDAMPED))
            self.assertRegex(self.refused("run", path), words)
        self.base(STRAIGHT, MOVES.format(1e-4))
        path = self.write("case.toml", case(frame + mode(amplitude=0.1, l=2), MOVES.format(1e-4)))
        self.assertIn("shape.mode must have n, not l: the frame is a tube or a ring", self.refused("run", path))
        both = 'kind = "file"\npath = "mesh.off"\narea = 1.0\nscale = 2.0\n'
        path = self.write("case.toml", case(both, AT_REST, "surface3d"))
        self.assertIn("shape.scale must be absent: area says how large the surface is", self.refused("run", path))

    def test_a_time_that_does_not_fit_the_size_of_a_mesh_is_told(self):
        # R^4/(2 k20) of the unit sphere is 1 for k20 = 0.5, and 1e-8 of one that is 100 times smaller.
        self.write("mesh.off", octahedron(0.3))
        more = "[accuracy]\nenergy = 0.1\nestimate = false\n[time]\nend = 1.0\n"
        small = self.write("small.toml", case('kind = "file"\npath = "mesh.off"\nscale = 0.01\n', more, "surface3d"))
        words = r"warning: time\.end = 1 is \S+e\+07 times the \S+e-08 in which bending moves .* set time\.end to \de-08 or so"
        self.assertRegex(self.tubule("check", small, "--quick")[1], words)
        self.assertRegex(self.tubule("run", small, "--set", "time.limit=1e-9", status=5)[1], words)
        fits = self.write("fits.toml", case('kind = "file"\npath = "mesh.off"\n', more, "surface3d"))
        self.assertNotIn("warning", self.tubule("check", fits, "--quick")[1])

    def test_advice_for_a_mesh_names_keys_that_it_has(self):
        """A mesh that folds at once, at rest and in motion, and a frame of it."""
        self.write("mesh.off", octahedron(0))
        moves = "[accuracy]\nenergy = 0.1\nestimate = false\n[time]\nend = 1e-3\n"
        for more in (AT_REST.replace("elements = 180\n", ""), moves):
            text = case('kind = "file"\npath = "mesh.off"\n' + mode(amplitude=0.8, l=9, m=5), more, "surface3d")
            path = self.write("case.toml", text)
            out, _ = self.tubule("run", path, "-o", self.result, "--overwrite", status=4)
            self.assertIn("mesh-lost", out)
            self.assertIn("set shape.remesh, or give the file more triangles", out)
            self.assertNotIn("E_ref", self.tubule("show", self.result)[0])
            said = about(self.result)
            self.assertNotIn("estimated_error", said)
            for key in re.findall(r"\b(?:shape|discretisation|accuracy|time)\.\w+", said["advice"]):
                value = {"shape.remesh": "100"}.get(key, "1")
                answer = self.start("check", path, "--quick", "--set", f"{key}={value}").communicate()[1]
                self.assertNotIn(f"{key} must be absent", answer)


if __name__ == "__main__":
    unittest.main(argv=["starts_test.py"])
