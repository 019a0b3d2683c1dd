#!/usr/bin/python3
"""Tier surface3d through the program: results of either tier as starts, and both tiers agreeing on one shape.

Arguments: the program, the directory of the cases.
"""
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import h5py

PROGRAM, CASES = (Path(argument).resolve() for argument in sys.argv[1:3])

SHAPE_FROM = """
tier = "surface3d"
[energy]
k20 = 0.2
k42 = 0.06
H0 = -2.0
[shape]
kind = "result"
path = "{path}"
frame = {frame}
[accuracy]
energy = {accuracy}
"""

PROFILE = """
tier = "axisym"
[energy]
k20 = 0.2
k42 = 0.06
H0 = -2.0
[shape]
{shape}
[accuracy]
energy = {accuracy}
[time]
end = {end}
[discretisation]
parametrisation = "even"
"""


def run(directory, *arguments):
    return subprocess.run([PROGRAM, "run", "--quiet", *map(str, arguments)], cwd=directory, capture_output=True, text=True)


def last(path, series):
    with h5py.File(path) as f:
        return f["series"][series][-1]


class Surface(unittest.TestCase):
    def setUp(self):
        self.kept = tempfile.TemporaryDirectory()
        self.directory = Path(self.kept.name)
        self.addCleanup(self.kept.cleanup)

    def case(self, name, **values):
        path = self.directory / name
        path.write_text(SHAPE_FROM.format(**values))
        return path

    def test_tiers_agree_on_a_frame(self):
        """Energies of a tier-1 frame, computed by the 3D tier: within what both state."""
        done = run(self.directory, CASES / "figure_k42_006.toml", "-o", "tube.hdf")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run(self.directory, self.case("surface.toml", path="tube.hdf", frame=2, accuracy=1e-5))
        self.assertEqual(done.returncode, 0, done.stderr)
        with h5py.File(self.directory / "tube.hdf") as f:
            expected = f["frames/000002"].attrs["energy"]
            time, volumes = f["frames/000002"].attrs["time"], f["series/volume"][:]
            volume = volumes[list(f["series/time"][:]).index(time)]
        self.assertAlmostEqual(last(self.directory / "surface.hdf", "energy") / expected, 1, delta=2e-5)
        self.assertAlmostEqual(last(self.directory / "surface.hdf", "volume") / volume, 1, delta=1e-5)

    def agree(self, shape, end, accuracy):
        """The last frame of a run of tier 1 that holds no spline but points, as a surface: energies within what both
        tiers state, area and volume."""
        (self.directory / "profile.toml").write_text(PROFILE.format(shape=shape, end=end, accuracy=accuracy))
        done = run(self.directory, "profile.toml", "-o", "profile.hdf")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run(self.directory, self.case("surface.toml", path="profile.hdf", frame=-1, accuracy=accuracy))
        self.assertEqual(done.returncode, 0, done.stderr)
        profile, surface = self.directory / "profile.hdf", self.directory / "surface.hdf"
        with h5py.File(profile) as f:
            self.assertNotIn("knots", f["frames/000001"])
        stated = last(surface, "energy_error")  # of the surface; the frame's energy is that of its profile
        self.assertLess(abs(last(surface, "energy") - last(profile, "energy")), stated)
        for series in ("area", "volume"):
            self.assertAlmostEqual(last(surface, series) / last(profile, series), 1, delta=2e-5, msg=series)
        return last(profile, "energy")

    def test_tiers_agree_on_a_closed_cell(self):
        energy = self.agree('kind = "capsule"\nradius = 0.5\nlength = 2.0', end=0.01, accuracy=1e-5)
        self.assertLess(energy, 5.0)  # it has moved: the capsule itself has 4 pi (k20 + k42/r^2) = 5.529

    def test_tiers_agree_on_a_tube_that_overhangs(self):
        self.agree('kind = "tube"\nradius = 1.0\nlength = 1.0\nmode = [{amplitude = 0.45, n = 1}]', end=0.0092,
                   accuracy=1e-4)
        with h5py.File(self.directory / "profile.hdf") as f:
            heights = f["frames/000001/z"][:]
        self.assertTrue((heights[1:] < heights[:-1]).any(), "it does not overhang")

    def test_tiers_agree_on_a_torus(self):
        self.agree('kind = "torus"\nradius = 1.5\ntube_radius = 0.5', end=0.01, accuracy=1e-5)

    def test_a_surface_begins_where_another_ended(self):
        """A frame of tier surface3d as a start is the same mesh: the same energies to rounding."""
        done = run(self.directory, CASES / "surface_tube_modes.toml", "-o", "tube.hdf", "--set", "energy.H0=-2.0",
                   "--set", "energy.k20=0.2", "--set", "energy.k42=0.06")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run(self.directory, self.case("again.toml", path="tube.hdf", frame=-1, accuracy=0.01))
        self.assertEqual(done.returncode, 0, done.stderr)
        for series in ("energy", "area", "volume", "elements"):
            before, again = last(self.directory / "tube.hdf", series), last(self.directory / "again.hdf", series)
            self.assertAlmostEqual(again / before, 1, delta=1e-12, msg=series)

    def test_refused_frames(self):
        run(self.directory, CASES / "surface_ellipsoid.toml", "-o", "ellipsoid.hdf")
        done = run(self.directory, self.case("none.toml", path="ellipsoid.hdf", frame=3, accuracy=0.01))
        self.assertEqual(done.returncode, 2)
        self.assertIn("shape.frame must be one of the 1 frames of ellipsoid.hdf, not 3", done.stderr)
        self.assertFalse((self.directory / "none.hdf").exists())
        done = run(self.directory, self.case("gone.toml", path="gone.hdf", frame=0, accuracy=0.01))
        self.assertEqual(done.returncode, 2)
        self.assertIn(": shape.path cannot be used: cannot open", done.stderr)

    def test_a_start_is_not_replaced(self):
        run(self.directory, CASES / "surface_ellipsoid.toml", "-o", "start.hdf")
        before = (self.directory / "start.hdf").read_bytes()
        for path in ("start.hdf", self.directory / "start.hdf"):  # the name of a case is that of its result
            done = run(self.directory, self.case("start.toml", path=path, frame=0, accuracy=0.01))
            self.assertEqual(done.returncode, 2)
            self.assertIn("start.hdf is where the run starts (shape.path) and must not be its result", done.stderr)
            self.assertEqual((self.directory / "start.hdf").read_bytes(), before)

    def test_no_derivatives_to_check(self):
        for case in (CASES / "surface_dumbbell.toml", self.case("any.toml", path="none.hdf", frame=0, accuracy=0.01)):
            done = run(self.directory, case, "--check-derivatives")
            self.assertEqual(done.returncode, 2)
            self.assertIn(f"{case}: --check-derivatives must be absent: it checks tubes", done.stderr)

    def test_resumed_from_the_beginning(self):
        """What an interrupted run has written is replaced, not continued: there is one row, one frame."""
        case = (CASES / "surface_slow.toml", "--set", "accuracy.energy=1e-3")
        with subprocess.Popen([PROGRAM, "run", "--quiet", *case], cwd=self.directory) as process:
            while not (self.directory / "surface_slow.hdf.lock").exists():  # from then on, signals are caught
                time.sleep(0.01)
            process.send_signal(signal.SIGINT)
        self.assertEqual(process.returncode, 130)
        with h5py.File(self.directory / "surface_slow.hdf") as f:
            few = f["series/elements"][-1] if len(f["series/elements"]) else 0
        done = run(self.directory, *case, "--resume")
        self.assertEqual(done.returncode, 0, done.stderr)
        with h5py.File(self.directory / "surface_slow.hdf") as f:
            self.assertEqual((len(f["series/time"]), len(f["frames"]), len(f["meshes"])), (1, 1, 1))
            self.assertGreater(f["series/elements"][-1], few)

    def test_folded_mesh_is_kept_to_be_looked_at(self):
        done = run(self.directory, CASES / "surface_folded.toml", "-o", "folded.hdf")
        self.assertEqual(done.returncode, 4, done.stderr)
        with h5py.File(self.directory / "folded.hdf") as f:
            self.assertEqual(f["about"].attrs["stop"], "mesh-lost")
            self.assertEqual(f["frames/000000/Points"].shape, (642, 3))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
