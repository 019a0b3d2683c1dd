#!/usr/bin/python3
"""tier = "auto": an axisymmetric run that switches to three dimensions, in one file; interrupted and resumed.

auto_test.py TUBULE CASES. A straight tube whose volume is free buckles: the wave n = 1, m = 1 grows at the rate of the
dispersion relation (`tubule stability`), from the noise to the amplitude of the switch, and on.
"""
import csv
import io
import math
import os
import shutil
import signal
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np

from program import ProgramTest, about, series, study

CASE = Path(sys.argv[2], "auto_buckles.toml")
RATE, LENGTH = 0.612294287659, 9.0
SWITCH = math.log(100) / RATE  # from 1e-4 to 1e-2
E_REF = (1 + 2.5**2) * 2 * math.pi * LENGTH


class Buckling(ProgramTest):
    whole = None  # the file of the uninterrupted run

    def setUp(self):
        super().setUp()
        # With order 2 the start in three dimensions costs a tenth.
        text = CASE.read_text().replace("[accuracy]", "[accuracy]\nestimate = false")
        self.write("case.toml", text.replace("elements = 190", "elements = 400\norder = 2"))
        if Buckling.whole is None:
            Buckling.folder_of_whole = tempfile.TemporaryDirectory()
            Buckling.whole = Path(self.folder_of_whole.name, "case.hdf")
            Buckling.printed = self.tubule("run", self.case, "-o", self.whole)
        shutil.copy(self.whole, self.result)

    def test_switch_is_where_noise_has_grown(self):
        end = about(self.result)
        self.assertEqual(end["choice"], "axisym, then surface3d")
        self.assertEqual(end["switch_mode"], 1)
        # The requested accuracy of the rates is 1e-2; on a straight tube any mesh gives them to 1e-8.
        self.assertAlmostEqual(end["switch_time"], SWITCH, delta=1e-4 * SWITCH)
        self.assertAlmostEqual(end["switch_amplitude"], 1e-2, delta=1e-6)
        for words in self.printed:
            self.assertIn("the non-axisymmetric mode m = 1 grows from 0.0001 to 0.01 of the radius at t = 7.521", words)

    def test_rows_of_both_parts_join(self):
        rows = series(self.result)
        tier, times = rows["tier"], rows["time"]
        first = int((tier == 1).sum())
        self.assertTrue((tier[:first] == 1).all() and (tier[first:] == 2).all())
        self.assertTrue((np.diff(times) >= 0).all())
        self.assertAlmostEqual(times[first - 1], SWITCH, delta=1e-4 * SWITCH)
        self.assertEqual(times[first - 1], times[first])
        self.assertTrue((np.diff(rows["wall_seconds"]) >= 0).all())
        # The energies agree except for the wave (second order: at most its square times E_ref) and both errors.
        jump = abs(rows["energy"][first] - rows["energy"][first - 1])
        self.assertLess(jump, (1e-4 + 1e-3) * E_REF)
        # The wave is there, in the normal direction, with the requested amplitude.
        self.assertAlmostEqual(rows["r_max"][first], 1.01, delta=2e-4)
        self.assertAlmostEqual(rows["r_max"][first - 1], 1, delta=1e-9)

    def test_the_wave_goes_on_at_its_rate(self):
        out, _ = self.tubule("stability", self.result, "--fit", "1,1", "--csv")
        times, amplitudes = np.array([list(map(float, row)) for row in list(csv.reader(io.StringIO(out)))[1:]]).T
        self.assertEqual(list(times[1:]), [7.7, 7.8, 7.9, 8.0, 8.1, 8.2])
        # A standing wave is the sum of two of half its amplitude, winding in opposite directions; the root of the sum of
        # their squares is measured.
        self.assertAlmostEqual(amplitudes[0], 1e-2 / math.sqrt(2), delta=1e-4)
        # Rates fall with the square of the amplitude, which is .015 at the end.
        rate = math.log(amplitudes[-1] / amplitudes[0]) / (times[-1] - times[0])
        self.assertAlmostEqual(rate / RATE, 1, delta=0.02)

    def test_frames_of_both_tiers_are_shown_and_drawn(self):
        with h5py.File(self.result) as file:
            frames = [file["frames"][name] for name in sorted(file["frames"])]
            self.assertEqual(["mesh" in frame.attrs for frame in frames], [False] * 3 + [True] * 7)
            waves = [frame.attrs["wave_1"] for frame in frames[:3]]
            for wave, frame in zip(waves, frames):
                self.assertAlmostEqual(wave / (1e-4 * math.exp(RATE * frame.attrs["time"])), 1, delta=1e-3)
            self.assertEqual(frames[2].attrs["switch_m"], 1)
            self.assertEqual(len(file["VTKHDF/Steps/Values"]), 7)
        out, _ = self.tubule("show", self.result)
        self.assertRegex(out, r"frame +time +energy +length .*wave_1")
        self.assertRegex(out, r"frame +time +mesh +energy")
        self.tubule("show", self.result, "--csv", "--frame", 0)
        self.tubule("show", self.result, "--csv", "--frame", -1)
        self.tubule("compare", self.result, self.whole, "--tolerance", "energy=1e-12")
        self.plot(self.result, "--kind=cuts", "-o", "picture.svg")
        self.assertIn("picture.svg", self.files())

    def assert_ends_like_the_undisturbed_run(self):
        ends, whole = series(self.result), series(self.whole)
        self.assertEqual(about(self.result)["stop"], "finished")
        self.assertEqual(about(self.result)["choice"], "axisym, then surface3d")
        self.assertAlmostEqual(about(self.result)["switch_time"], SWITCH, delta=1e-3 * SWITCH)
        self.assertTrue((np.diff(ends["time"]) >= 0).all() and (np.diff(ends["tier"]) >= 0).all())
        self.assertEqual(ends["time"][-1], 8.2)
        self.assertAlmostEqual(ends["energy"][-1], whole["energy"][-1], delta=1e-4 * E_REF)
        self.assertAlmostEqual(ends["r_max"][-1], whole["r_max"][-1], delta=1e-4)
        with h5py.File(self.result) as file:
            frames = [file["frames"][name].attrs for name in sorted(file["frames"])]
            self.assertEqual(sum("switch_m" in frame for frame in frames), 1)
            self.assertEqual(["mesh" in frame for frame in frames], [False] * 3 + [True] * 7)

    def disturbed(self, number, tier):
        self.result.unlink()
        process = self.start("run", self.case, "--quiet", env=os.environ | {"TUBULE_WRITE_SECONDS": "0.02"})
        self.wait(process, lambda: self.result.exists() and (series(self.result)["tier"] == tier).sum() > 3)
        process.send_signal(number)
        process.communicate()

    def test_killed_in_its_first_part(self):
        self.disturbed(signal.SIGKILL, 1)
        self.tubule("run", self.case, "--resume", "--quiet")
        self.assert_ends_like_the_undisturbed_run()

    @study
    def test_interrupted_in_its_second_part(self):
        self.disturbed(signal.SIGINT, 2)
        self.assertEqual(about(self.result)["stop"], "interrupted")
        before = series(self.result)
        self.tubule("run", self.case, "--resume", "--quiet")
        self.assert_ends_like_the_undisturbed_run()
        after = series(self.result)
        first = int((before["tier"] == 1).sum())
        self.assertEqual(list(after["time"][:first]), list(before["time"][:first]))
        self.assertEqual(list(after["energy"][:first]), list(before["energy"][:first]))


class FewTriangles(ProgramTest):
    """Where little accuracy is requested, as few triangles as `tubule check` advises; more where the start is wavy."""

    def run_case(self, shape):
        case = f"""tier = "auto"
[energy]
k20 = 1.0
[model]
kind = "overdamped"
[shape]
{shape}
[accuracy]
energy = 1e-2
[time]
end = 1e-3
"""
        self.tubule("run", self.write("case.toml", case), "--quiet", "-o", self.result)
        return about(self.result)

    def test_a_smooth_start_has_80(self):
        end = self.run_case('kind = "ellipsoid"\na = 1.0\nb = 0.9\nc = 0.8')
        self.assertEqual((end["choice"], end["elements"]), ("surface3d", 80))
        self.assertEqual(end["triangles"], "80, since the initial shape is smooth")
        self.assertLess(end["estimated_error"], 1e-2)

    def test_a_wavy_start_has_more(self):
        end = self.run_case('kind = "sphere"\nradius = 1.0\nmode = [{amplitude = 0.3, l = 4, m = 3}]')
        self.assertGreater(end["elements"], 80)
        self.assertNotIn("triangles", end)


class Places(ProgramTest):
    def lose_axis(self, end, order, load, *names):
        """A vesicle goes on in three dimensions with the same values: the wall, a field of r and z, and beads are where they were."""
        case = f"""tier = "auto"
energy = {{k20 = 0.5, potential = [{{kind = "plane", z = -1.2, strength = 0.2, range = 0.4}}, {{kind = "formula", formula = "-0.03*r^2"}}]}}
model = {{kind = "gradient-flow", area = "fixed", volume = "fixed"{load}}}
shape = {{kind = "ellipsoid", a = 1.0, b = 1.0, c = 0.5}}
auto = {{noise = 3e-3, modes = 2}}
accuracy = {{energy = 1e-2, estimate = false}}
discretisation = {{elements = 180, order = {order}}}
time = {{end = {end}}}
"""
        result = self.folder / "wall.hdf"
        self.tubule("run", self.write("wall.toml", case), "--quiet", "-o", result)
        self.assertEqual(about(result)["choice"], "axisym, then surface3d")
        with h5py.File(result) as file:
            tier, *values = (file["series"][name][()] for name in ("tier", *names))
        first = int((tier == 2).argmax())
        return [(of[first - 1], of[first]) for of in values], about(result)["E_ref"]

    def test_a_vesicle_at_a_wall(self):
        both, E_ref = self.lose_axis(0.1167, 2, "", "potential_energy", "energy")
        self.assertLess(both[0][1], -0.1)
        for before, after in both:
            self.assertAlmostEqual(before, after, delta=5e-3 * E_ref)

    @study
    def test_a_vesicle_between_beads(self):
        both, E_ref = self.lose_axis(0.1115, 3, ", bead_width = 0.35, force = 0.5", "bead_distance", "free_energy")
        self.assertAlmostEqual(*both[0], delta=1e-4)
        self.assertAlmostEqual(*both[1], delta=1e-3 * E_ref)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
