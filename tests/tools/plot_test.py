#!/usr/bin/python3
"""Pictures: drawn from results made up here, whose curvatures are exact (docs/results.md has the layout).

    plot_test.py [TUBULE]    with the program, its subcommand `plot` is tested too
"""

import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import tomllib
import unittest
import unittest.mock
import xml.etree.ElementTree
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image, ImageSequence

PACKAGE = Path(__file__).resolve().parents[2] / "tools/python/tubule"
PLOT = PACKAGE / "drawing"
sys.path[:0] = [str(PACKAGE), str(Path(__file__).resolve().parents[1] / "support")]
import scripts  # noqa: E402
import drawing  # noqa: E402
from drawing import colours, curves, energy, labels, movie, results, tubes  # noqa: E402

FIGURES = Path(__file__).resolve().parents[2] / "docs/figures"
drawing.__path__.append(str(FIGURES))
from drawing import validation, work_precision, work_precision_fluid  # noqa: E402

TUBULE = None
CASE = """tier = "axisym"
[about]
title = "A made-up tube"
[energy]
k20 = 0.2
H0 = -2.0
k42 = {k42}
[shape]
kind = "tube"
length = 2.0
[[shape.mode]]
amplitude = 0.2
[time]
end = 1.0
"""
TERMS = {"energy_20": "k_{20}(H-H_0)^2", "energy_42": "k_{42}K^2"}


def resolved(text, sets):
    """The case with other values "table.key=value"."""
    for key, value in (one.split("=", 1) for one in sets):
        table, _, name = key.rpartition(".")
        text = re.sub(rf"(?m)^{name} = .*\n", "", text)
        head = f"[{table}]\n"
        text = (text if head in text else text + head).replace(head, f"{head}{name} = {value}\n")
    return text


def tube(time, amplitude, length=2.0, points=65):
    """z, r, H, K of r = 1 + a cos(2 pi z / length), a = amplitude exp(-3 t), by the formulas for a graph r(z)."""
    z, q, a = np.linspace(0, length, points), 2 * np.pi / length, amplitude * np.exp(-3 * time)
    r, slope, bend = 1 + a * np.cos(q * z), -a * q * np.sin(q * z), -a * q * q * np.cos(q * z)
    g = np.sqrt(1 + slope**2)
    return {"z": z, "r": r, "H": (bend / g**2 - 1 / r) / g, "K": -bend / (r * g**4)}


def ball(time, points=65):
    """A unit sphere from pole to pole that begins to move: u_n = 2 t cos(2 a), u_t = t sin(2 a), a the polar angle."""
    angle = np.linspace(np.pi, 0, points)
    return {"z": np.cos(angle), "r": np.sin(angle), "H": np.full(points, -2.0), "K": np.ones(points),
            "u_n": 2 * time * np.cos(2 * angle), "u_t": time * np.sin(2 * angle)}  # fmt: skip


def write(path, k42=0.0, sets=(), times=(0, 0.01, 0.05, 0.2, 0.5, 1.0), amplitude=0.2, stop="finished", rows=40,
          profile=None, kinetic=False):  # fmt: skip
    """A result with a frame at each time, of tube() or `profile`, and `rows` rows of series."""
    with h5py.File(path, "w") as file:
        for name in ("id", "sequence", "about_begun"):
            file.attrs[name] = np.uint64(1)
        text = h5py.string_dtype()
        file.create_dataset("case", data="", dtype=text).attrs.create("set", [], shape=(0,), dtype=text)
        file.create_dataset("resolved_case", data=resolved(CASE.format(k42=k42), sets), dtype=text)
        about = file.create_group("about")
        if stop:
            about.attrs["stop"] = stop
            about.attrs["stop_time"] = float(times[-1]) if times else 1.0
        time = np.linspace(0, times[-1] if times else 1.0, rows) if rows else np.empty(0)
        bend, gauss = 3 + np.exp(-6 * time), 5 * k42 * np.exp(-6 * time)
        columns = {"time": time, "energy": bend + gauss, "energy_20": bend, "energy_40": 0 * time, "energy_42": gauss}
        if kinetic:
            columns["kinetic_energy"] = np.sin(np.pi * time) ** 2
        series = file.create_group("series")
        series.attrs["order"] = np.array(list(columns), dtype=text)
        for name, values in columns.items():
            series[name] = values
            if name in TERMS:
                series[name].attrs["label"] = TERMS[name]
        file.create_group("frames")
        for index, t in enumerate(times):
            frame = file.create_group(f"frames/{index:06d}")
            frame.attrs["time"] = float(t)
            for name, values in (profile(t) if profile else tube(t, amplitude)).items():
                frame[name] = values
    return path


def png_size(path):
    header = path.read_bytes()[:24]
    assert header[:8] == b"\x89PNG\r\n\x1a\n", path
    return struct.unpack(">II", header[16:24])


def svg_texts(path):
    nodes = xml.etree.ElementTree.parse(path).iter("{http://www.w3.org/2000/svg}text")
    return ["".join(node.itertext()).strip() for node in nodes]


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def plot(self, *arguments, program=None):
        if not program:
            return scripts.run_script(PLOT, "plot", *arguments)
        done = subprocess.run([program, "plot", *arguments], capture_output=True, text=True)
        # Files made here by h5py have no checksums, which the program says of each.
        said = [line for line in done.stderr.splitlines(True) if "has no checksums" not in line]
        return subprocess.CompletedProcess(done.args, done.returncode, done.stdout, "".join(said))

    def drawn(self, *arguments, dpi=100, **options):
        """Texts of the SVG drawn; the PNG beside it must be of the page's width and not blank."""
        done = self.plot(*arguments, f"--dpi={dpi}", "-o", self.folder / "p.png", "-o", self.folder / "p.svg", **options)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        width, height = png_size(self.folder / "p.png")
        self.assertEqual(width, 7 * dpi)  # the page's width in inches
        self.assertGreater(height, dpi)
        self.assertGreater((self.folder / "p.png").stat().st_size, 50 * dpi)
        return svg_texts(self.folder / "p.svg")

    def refused(self, words, *arguments, status=2, **options):
        done = self.plot(*arguments, **options)
        self.assertEqual(done.returncode, status, done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn(words, done.stderr)


class Labels(unittest.TestCase):
    def words(self, *cases, sets=None):
        read = [tomllib.loads(resolved(text, one)) for text, one in zip(cases, sets or [[]] * len(cases))]
        return labels.row_labels(read, [f"file{i}" for i in range(len(cases))])

    def test_only_what_differs_is_named_and_equal_numbers_are_equal(self):
        # The second case says 0.0 where the first says 0: no difference.
        found = self.words(CASE.format(k42=0), CASE.format(k42="0.0"), sets=[["energy.H0=-1"], []])
        self.assertEqual(found, [["H\u2080 = \u22121"], ["H\u2080 = \u22122"]])

    def test_modes_have_their_index(self):
        text = CASE.format(k42=0)
        self.assertEqual(
            self.words(text, text.replace("amplitude = 0.2", "amplitude = 0.3")),
            [["amplitude = 0.2"], ["amplitude = 0.3"]],
        )
        self.assertEqual(
            self.words(text, text + "[[shape.mode]]\namplitude = 0.1\n"),
            [["no mode 1"], ["mode 1 amplitude = 0.1"]],
        )

    def test_absent_keys(self):
        text = CASE.format(k42=0)
        self.assertEqual(
            self.words(text, text, sets=[[], ["energy.k40=0.1"]]),
            [["k\u2084\u2080 by default"], ["k\u2084\u2080 = 0.1"]],
        )

    def test_about_expect_and_time_are_no_difference(self):
        text = CASE.format(k42=0)
        sets = [['about.title="x"', "time.output=[1,2]"], ['expect.stop="finished"', "time.end=3", "energy.k42=1"]]
        self.assertEqual(self.words(text, text, sets=sets), [["k\u2084\u2082 = 0"], ["k\u2084\u2082 = 1"]])

    def test_file_names_where_labels_do_not_tell_apart(self):
        text = CASE.format(k42=0)
        self.assertEqual(self.words(text, text), [["file0"], ["file1"]])
        many = [f"energy.x{i}=1" for i in range(5)]
        self.assertEqual(self.words(text, text, sets=[[], many]), [["file0"], ["file1"]])
        self.assertEqual(
            self.words(text, text, text, sets=[[], [], ["energy.k42=1"]]),
            [["k\u2084\u2082 = 0", "file0"], ["k\u2084\u2082 = 0", "file1"], ["k\u2084\u2082 = 1", "file2"]],
        )

    def test_equal_last_words_are_told_apart(self):
        found = self.words("[a]\nx = 1\n[b]\nx = 1\n", "[a]\nx = 2\n[b]\nx = 2\n")
        self.assertEqual(found[0], ["a.x = 1", "b.x = 1"])

    def test_formulas(self):
        self.assertEqual(labels.formula("k_{20}(H-H_0)^2"), "k\u2082\u2080(H\u2212H\u2080)\u00b2")
        self.assertEqual(labels.formula("E_{42}"), "E\u2084\u2082")


class Columns(InFolder):
    def read(self, name, **options):
        return results.read_result(str(write(self.folder / name, **options)))

    def test_six_at_most_first_and_last_kept(self):
        times = [float(i) for i in range(31)]
        found = [column.time for column in tubes.choose_columns([self.read("a.hdf", times=times)])]
        self.assertEqual(found, [0, 6, 12, 18, 24, 30])

    def test_a_run_that_stopped_ends_in_the_next_column(self):
        whole = self.read("whole.hdf", times=[0, 1, 2, 3])
        pinched = self.read("pinched.hdf", times=[0, 1, 1.5], stop="pinch-off")
        columns = tubes.choose_columns([whole, pinched])
        self.assertEqual([column.time for column in columns], [0, 1, 2, 3])
        self.assertEqual(columns[2].cells[1].time, 1.5)
        self.assertEqual([column.stops[1] for column in columns], [None, None, "pinch-off", None])
        self.assertIsNone(columns[3].cells[1])

    def test_all_runs_stopped_early(self):
        early = [self.read(f"{i}.hdf", times=[0, 1 + i / 10], stop="overhang") for i in range(2)]
        columns = tubes.choose_columns(early)
        self.assertEqual([column.time for column in columns], [0, None])
        self.assertEqual([frame.time for frame in columns[1].cells], [1, 1.1])

    def test_shared_times_go_first(self):
        a, b = self.read("a.hdf", times=[0, 1, 2, 3]), self.read("b.hdf", times=[0, 1.5, 2, 3])
        self.assertEqual([column.time for column in tubes.choose_columns([a, b])], [0, 2, 3])

    def test_wanted_times(self):
        result = self.read("a.hdf", times=[0, 1, 2, 3])
        self.assertEqual([column.time for column in tubes.choose_columns([result], [2, 0])], [0, 2])
        with self.assertRaisesRegex(results.BadInput, "no result has a frame at t = 1.5; there are .* 0, 1, 2, 3"):
            tubes.choose_columns([result], [0, 1.5])


class Scales(unittest.TestCase):
    def test_a_neck_does_not_set_the_colour_scale(self):
        values, area = np.append(np.linspace(-1, 1, 1000), -1e6), np.append(np.ones(1000), 1e-3)
        norm, extend = colours.colour_scale([values], [area], 0.0)
        self.assertAlmostEqual(norm.vmax, colours.MARGIN * colours.COVERED, delta=0.01)  # 98 % of a uniform spread
        self.assertEqual((norm.vmin, extend), (-norm.vmax, "min"))

    def test_rounding_is_no_colour(self):
        norm, extend = colours.colour_scale([np.array([1e-14, -1e-14])], [np.ones(2)], 0.0)
        self.assertEqual((norm.vmin, norm.vmax, extend), (-1, 1, "neither"))
        norm, _ = colours.colour_scale([np.full(5, -2.0)], [np.ones(5)], -2.0)
        self.assertEqual(norm(-2.0), 0.5)

    def test_interpolation_is_exact_on_parabolas_and_never_overshoots(self):
        x = np.linspace(0, 2, 21)
        fine = np.linspace(0, 2, 501)
        self.assertLess(np.abs(energy.monotone_cubic(x, (1 + x) ** 2, fine) - (1 + fine) ** 2).max(), 1e-4)
        steep = energy.monotone_cubic(np.array([0.0, 1, 2, 3]), np.array([5.0, 0, 0, 0]), np.linspace(0, 3, 301))
        self.assertGreaterEqual(steep.min(), 0)
        self.assertTrue((np.diff(steep) <= 0).all())


class Pictures(InFolder):
    def test_three_results_labelled_by_what_differs(self):
        files = [write(self.folder / f"{i}.hdf", k42=k42) for i, k42 in enumerate((0, 0.06, 0.12))]
        texts = self.drawn(*files)
        for words in ("k\u2084\u2082 = 0", "k\u2084\u2082 = 0.06", "k\u2084\u2082 = 0.12"):
            self.assertEqual(texts.count(words), 2, words)  # beside its row and in the legend
        formulas = "k\u2082\u2080(H\u2212H\u2080)\u00b2", "k\u2084\u2082K\u00b2"
        for words in ("(a)", "(b)", "t\u2081 = 0.01", "t\u2085 = 1", "total", *formulas, "bending energy E"):
            self.assertIn(words, texts)
        self.assertFalse([text for text in texts if "energy_40" in text or "E\u2084\u2080" in text])  # zero: no line

    def test_labels_as_given(self):
        files = [write(self.folder / f"{i}.hdf", k42=k42) for i, k42 in enumerate((0, 0.06))]
        texts = self.drawn(*files, "--label=coarse", "--label=fine")
        for words in ("coarse", "fine"):
            self.assertEqual(texts.count(words), 2, words)
        self.assertFalse([text for text in texts if text.startswith("k\u2084\u2082 =")])
        done = self.plot(*files, "--label=coarse", "-o", self.folder / "q.svg")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--label: 1 labels, but 2 results", done.stderr)

    def test_series_against_time_or_another_series(self):
        files = [write(self.folder / f"{i}.hdf", k42=k42) for i, k42 in enumerate((0, 0.06))]
        texts = self.drawn(*files, "--series=energy,energy_20", "--logy", "--from=0.1", "--to=0.5", "--label=a", "--label=b")
        for words in ("a", "b", "energy", "energy_20", "time t"):
            self.assertIn(words, texts)
        self.assertNotIn("t\u2081 = 0.01", texts)  # no shapes
        self.assertIn("energy_20", self.drawn(files[0], "--series=energy", "--x=energy_20"))

    def test_one_result_has_its_title_and_default_names(self):
        done = self.plot(write(self.folder / "one.hdf"))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(png_size(self.folder / "one.png")[0], 2100)
        self.assertIn("A made-up tube", svg_texts(self.folder / "one.svg"))

    def test_a_stop_is_marked_in_both_panels(self):
        whole = write(self.folder / "a.hdf")
        texts = self.drawn(whole, write(self.folder / "b.hdf", k42=1, times=[0, 0.01, 0.03], stop="pinch-off"))
        self.assertIn("pinch-off at t = 0.03", texts)
        self.assertIn("pinch-off", texts)  # below its last tube, which stands in the column of t = 0.05,
        self.assertIn("t = 0.03", texts)  # and so has its own time

    def test_kinds_and_pdf(self):
        file = write(self.folder / "a.hdf")
        self.assertNotIn("bending energy E", self.drawn(file, "--kind", "profiles"))
        texts = self.drawn(file, "--kind", "energy")
        self.assertIn("bending energy E", texts)
        self.assertFalse([text for text in texts if "mean curvature" in text])
        self.assertEqual(self.plot(file, "-o", self.folder / "a.pdf").returncode, 0)
        self.assertEqual((self.folder / "a.pdf").read_bytes()[:5], b"%PDF-")

    def test_spontaneous_curvature_that_varies(self):
        """No value of H0 is white, so the scale is about the mean curvature: -1 on the straight tube of radius 1."""
        path = write(self.folder / "a.hdf", sets=['energy.H0="-2 + 0.1*cos(pi*z)"'], amplitude=0.0)
        texts = self.drawn(path, "--kind", "profiles")
        self.assertTrue(any("white: mean \u2248 \u22121" in words for words in texts), texts)

    def test_wanted_times(self):
        texts = self.drawn(write(self.folder / "a.hdf"), "--times", "0,0.2")
        self.assertIn("t\u2081 = 0.2", texts)
        self.assertNotIn("t\u2082 = 0.5", texts)

    def test_drawing_again_gives_the_same_files(self):
        file = write(self.folder / "a.hdf")
        self.drawn(file)
        before = (self.folder / "p.svg").read_bytes()
        self.drawn(file)
        self.assertEqual((self.folder / "p.svg").read_bytes(), before)

    def test_degenerate_inputs(self):
        for name, options in {
            "uniform tube": {"amplitude": 0.0},
            "one frame": {"times": [0.0], "rows": 1},
            "no frames": {"times": []},
            "no series": {"rows": 0},
            "times going back": {"times": [0, 0.5, 0.2, 0.5, 1]},
            "nearly pinched": {"amplitude": 0.9999},
            "never finished": {"stop": None},
        }.items():
            with self.subTest(name):
                self.drawn(write(self.folder / "a.hdf", **options))

    def test_eight_rows_one_of_them_without_frames(self):
        files = [write(self.folder / f"{i}.hdf", k42=i, times=[] if i == 3 else [0, 0.5, 1]) for i in range(8)]
        texts = self.drawn(*files)
        self.assertEqual(texts.count("k\u2084\u2082 = 3"), 2)

    def test_a_profile_that_is_no_graph(self):
        file = write(self.folder / "a.hdf", times=[0])
        angle = np.linspace(0, np.pi, 65)
        with h5py.File(file, "a") as f:
            f["frames/000000/z"][:] = np.linspace(0, 2, 65) + 0.5 * np.sin(4 * angle)
        self.drawn(file)


class Curves(InFolder):
    """Profiles that are not graphs, or that flow."""

    def test_outside_of_a_sphere_is_farther_from_its_centre(self):
        section = curves.Section(results.Frame(0.0, **ball(0.0, 401)), 2.0)  # radius 2 inches
        self.assertAlmostEqual(section.length, 2 * np.pi, delta=1e-3)
        for distance in (0.0, 0.1, -0.1):
            x, y = section.beside(section.places, distance)
            np.testing.assert_allclose(np.hypot(x, y), 2 + distance, atol=1e-3)

    def test_arrows_go_with_the_velocity_and_are_as_long(self):
        section = curves.Section(results.Frame(0.0, **ball(0.0, 401)), 1.0)  # half a turn: pi inches
        angle = np.pi - section.places  # 0 at the last point
        found = curves.arrows(section, -3 * np.sin(2 * angle), 3)
        self.assertGreater(len(found), 10)
        for places in found:
            # By the formula: -sin(2 a) of the largest.
            expected = -curves.LONGEST_ARROW * np.sin(2 * (np.pi - places[4]))
            self.assertAlmostEqual(places[-1] - places[0], expected, delta=2e-3)
        slow = curves.arrows(section, np.where(section.places < 0.3, 1.0, 0.01), 1)
        self.assertLess(max(places[-1] for places in slow), 0.4)  # too short to see elsewhere

    def test_a_flowing_cell_and_its_kinetic_energy(self):
        file = write(self.folder / "a.hdf", profile=ball, kinetic=True, sets=['model.kind="fluid"'], times=[0, 0.5, 1])
        texts = self.drawn(file)
        self.assertEqual(texts.count("at rest"), 1)  # t = 0
        for words in ("|u\u2099| \u2264 2", "|u\u209c| \u2264 1", "|u\u209c| \u2264 0.5", energy.KINETIC, "energy"):
            self.assertIn(words, "\n".join(texts).split("\n"))
        self.assertTrue([text for text in texts if text.startswith("normal velocity")])
        self.assertTrue([text for text in texts if text.startswith("velocity u\u209c along the profile")])
        self.assertFalse([text for text in texts if "mean curvature" in text])

    def test_kinetic_energy_is_no_part_of_flows_without_inertia(self):
        texts = self.drawn(write(self.folder / "a.hdf", profile=ball, kinetic=True, sets=['model.kind="stokes"']))
        self.assertIn("bending energy E", texts)
        self.assertNotIn(energy.KINETIC, texts)

    def test_swirl_is_written_below(self):
        def turning(time):
            return ball(0.0) | {"u_theta": 3 * ball(0.0)["r"]}

        texts = self.drawn(write(self.folder / "a.hdf", profile=turning, times=[0]), "--kind", "profiles")
        self.assertIn("|u\u03b8| \u2264 3", texts)
        self.assertNotIn("at rest", texts)

    def test_an_overhanging_tube_without_flow_along_it(self):
        def overhanging(time):
            frame = tube(time, 0.2)
            z = frame["z"] - 0.6 * np.sin(2 * np.pi * frame["z"])  # goes back and forth
            return frame | {"z": z, "u_n": np.cos(np.pi * frame["z"])}

        texts = self.drawn(write(self.folder / "a.hdf", profile=overhanging, times=[0, 1]))
        self.assertIn("|u\u2099| \u2264 1", texts)
        self.assertFalse([text for text in texts if "along the profile" in text])

    def test_a_graph_keeps_its_curvatures_though_it_moves(self):
        def moving(time):
            return tube(time, 0.2) | {"u_n": np.ones(65)}

        texts = self.drawn(write(self.folder / "a.hdf", profile=moving))
        self.assertTrue([text for text in texts if text.startswith("mean curvature")])

    def test_stationary_shapes_have_numbers_and_curvatures(self):
        def at_rest(time):
            return {name: values for name, values in ball(0.0).items() if not name.startswith("u_")}

        sets = ['equilibrium.branch.vary="equilibrium.reduced_volume"']
        file = write(self.folder / "a.hdf", profile=at_rest, sets=sets, times=[0, 1, 2], rows=3)
        with h5py.File(file, "a") as f:
            for number, frame in enumerate(f["frames"].values()):
                frame.attrs["parameter"] = 0.9 - 0.1 * number
        texts = self.drawn(file)
        bar = "mean curvature H = \u03ba\u2081 + \u03ba\u2082 (left halves), white: H\u2080 = \u22122"
        for words in (bar, "shape 2", "number of the shape", "= 0.7"):
            self.assertIn(words, "\n".join(texts).split("\n"))
        self.assertFalse([text for text in texts if text.startswith("t\u2081")])
        single = write(self.folder / "b.hdf", profile=at_rest, sets=["equilibrium.area=1"], times=[0], rows=1)
        self.assertNotIn("bending energy E", self.drawn(single))

    def test_small_changes_of_a_large_energy_are_ticks_from_a_round_number(self):
        file = write(self.folder / "a.hdf")
        with h5py.File(file, "a") as f:
            f["series/energy"][:] = 37.69923 + 1e-5 * f["series/time"][:]
        texts = self.drawn(file, "--kind", "energy")
        self.assertIn("(bending energy E \u2212 37.6992) / 10\u207b\u2075", texts)
        self.assertIn("3", texts)  # 37.69923

    def test_numbers_far_from_one(self):
        found = [labels.power(value, 2) for value in (0, 0.0123, 4567, 4.26e-5, -1.5e7)]
        expected = ["0", "0.012", "4600", "4.3\u00b710\u207b\u2075", "\u22121.5\u00b710\u2077"]
        self.assertEqual(found, expected)


class Films(InFolder):
    def film(self, name, *arguments, **options):
        done = self.plot(*arguments, "--movie", self.folder / name, **options)
        self.assertEqual((done.returncode, done.stdout), (0, f"{self.folder / name}\n"), done.stderr)
        return self.folder / name

    def frames(self, path):
        with Image.open(path) as film:
            return [np.asarray(frame.convert("RGB"), int) for frame in ImageSequence.Iterator(film)]

    def test_shape_and_point_on_the_energy_move_and_nothing_else(self):
        path = write(self.folder / "a.hdf", times=(0, 0.5, 1), profile=lambda t: tube(t, 0.3 * (1 - t)))
        first, second, last = self.frames(self.film("a.gif", path))
        self.assertEqual(first.shape, (450, 800, 3))
        changed = (np.abs(first - last).max(axis=2) > 60).any(axis=0).nonzero()[0]
        self.assertTrue((changed < 400).any() and (changed > 528).any())  # shape; point
        np.testing.assert_array_equal(abs(first - last)[390:] > 60, False)  # colour bar

        def reds(frame):  # the point is red: matplotlib's C3
            return (np.abs(frame - [214, 39, 40]).max(axis=2) < 40).nonzero()[1].mean()

        middle = (reds(first) + reds(last)) / 2
        self.assertAlmostEqual(reds(second), middle, delta=6)  # rows are 1/39 of the time apart
        self.assertFalse(list(self.folder.glob("*.part*")))

    def test_small_times_do_not_overlap(self):
        path = write(self.folder / "a.hdf", times=(0, 1e-4))
        result = results.read_result(path)
        stage = movie.Stage(result, result.frames, "H", "")
        FigureCanvasAgg(stage.figure).draw()
        panel = next(axes for axes in stage.figure.axes if axes.get_xlabel() == "time t")
        low, high = panel.get_xlim()
        boxes = [tick.label1.get_window_extent() for tick in panel.xaxis.get_major_ticks() if low <= tick.get_loc() <= high]
        self.assertGreaterEqual(len(boxes), 3)
        for one, next_one in zip(boxes, boxes[1:]):
            self.assertLess(one.x1 + 4, next_one.x0)

    def test_mp4(self):
        path = write(self.folder / "a.hdf", times=(0, 1))
        with unittest.mock.patch.dict(os.environ, PATH="/nowhere"):
            self.refused("install the package ffmpeg", path, "--movie", self.folder / "a.mp4", status=4)
        if shutil.which("ffmpeg"):
            self.assertEqual(self.film("a.mp4", path).read_bytes()[4:8], b"ftyp")

    def test_interrupted_film_leaves_nothing(self):
        path = write(self.folder / "a.hdf", times=list(np.linspace(0, 1, 200)))
        command = ["/usr/bin/python3", "-B", PLOT, "plot", path, "--movie", self.folder / "a.gif"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            while process.poll() is None and not process.stderr.readline().startswith("frame"):
                pass
            process.send_signal(signal.SIGINT)
            out, _ = process.communicate(timeout=60)
        self.assertEqual((process.returncode, out), (130, ""))
        self.assertEqual([p.name for p in self.folder.iterdir()], ["a.hdf"])

    def test_profile_becomes_a_surface(self):
        for profile, area in ((ball(0, 201), 4 * np.pi), (tube(0, 0.0), 4 * np.pi)):
            frame = results.Frame(0.0, *(profile[name] for name in ("z", "r", "H", "K")))
            points, normal, values, closed = movie.revolved(frame, frame.H)
            a, b, c = (points[:, i] for i in range(3))
            twice = np.cross(b - a, c - a)
            self.assertAlmostEqual(np.linalg.norm(twice, axis=1).sum() / 2 / area, 1, delta=3e-3)
            solid = np.linalg.norm(twice, axis=1) > 1e-9
            self.assertTrue((np.einsum("ij,ij->i", twice, normal.mean(axis=1))[solid] > 0).all())  # seen from outside
            self.assertEqual(closed, profile["r"][0] < 1e-9)
            np.testing.assert_allclose(values, frame.H[0], atol=1e-6)

    def test_refusals(self):
        one, two = write(self.folder / "one.hdf", times=(0,)), write(self.folder / "two.hdf")
        self.refused("a film needs two or more", one, "--movie", self.folder / "a.gif")
        self.refused("--movie goes with --times, --label, --fps and one --colour only", two, "--movie", self.folder / "a.gif", "--dpi=100")
        self.refused("one of .mp4, .gif", two, "--movie", self.folder / "a.avi")
        self.refused("does not exist", two, "--movie", self.folder / "no/a.gif")
        self.refused("shows one result", one, two, "--movie", self.folder / "a.gif")
        self.refused("not all frames have p", two, "--movie", self.folder / "a.gif", "--colour", "p")
        self.refused("one --colour only", two, "--movie", self.folder / "a.gif", "--kind", "energy")


class Refusals(InFolder):
    def test_files(self):
        text = self.folder / "text.hdf"
        text.write_text("no HDF5")
        self.refused(str(text), text)
        self.refused("missing.hdf", self.folder / "missing.hdf")
        with h5py.File(self.folder / "other.hdf", "w") as file:
            file["x"] = 1
        self.refused("other.hdf: is not a result of tubule (it has no /case)", self.folder / "other.hdf")

    def test_damaged_records(self):
        def damaged(change, words):
            path = write(self.folder / "damaged.hdf")
            with h5py.File(path, "a") as file:
                change(file)
            self.refused(words, path)

        def short(file):
            del file["frames/000001/r"]
            file["frames/000001/r"] = np.ones(3)

        def nan(file):
            file["frames/000001/H"][3] = np.nan

        def lack(file):
            del file["frames/000001/K"]

        def ragged(file):
            del file["series/energy"]
            file["series/energy"] = np.ones(3)

        def text(file):
            file["resolved_case"][()] = "[energy"

        def short_velocity(file):
            file["frames/000001/u_t"] = np.ones(3)

        damaged(short, "frame 000001: z, r, H, K must be lists of one length")
        damaged(short_velocity, "frame 000001: z, r, H, K, u_t must be lists of one length")
        damaged(nan, "/frames/000001/H contains numbers that are not finite")
        damaged(lack, "frame 000001 lacks K")
        damaged(ragged, "series of different lengths")
        damaged(text, "its case is not valid TOML")

    def test_values_that_the_file_does_not_hold(self):
        """Links to other files, values in them, and more values than the file has bytes: refused by every reader."""
        secret = self.folder / "secret"
        secret.write_bytes(np.arange(40.0).tobytes())
        other = write(self.folder / "other.hdf")

        def linked(file):
            file["series/energy"] = h5py.ExternalLink(str(other), "/series/energy")

        def outside(file):
            file.create_dataset("series/energy", (40,), float, external=[(str(secret), 0, 320)])

        def virtual(file):
            layout = h5py.VirtualLayout((40,), float)
            layout[:] = h5py.VirtualSource(str(other), "/series/energy", (40,))
            file.create_virtual_dataset("series/energy", layout)

        def huge(file):
            file.create_dataset("series/energy", (2**40,), float, chunks=(1024,))

        def huge_packed(file):
            file.create_dataset("series/energy", (2**40,), float, chunks=(1024,), compression="gzip")

        def nan(file):
            file["series/energy"] = np.full(40, np.nan)

        for change, words in ((linked, "link to another file: not followed"), (outside, "in another file: not read"), (virtual, "in another file: not read"),
                              (huge, "not all are in the file"), (huge_packed, "not all are in the file"), (nan, "energy")):  # fmt: skip
            path = write(self.folder / "foreign.hdf")
            with h5py.File(path, "a") as file:
                del file["series/energy"]
                change(file)
            with self.subTest(change=change.__name__):
                self.refused(words, path)
                self.assertRaisesRegex(results.BadInput, words, results.read_result, path)
                for command in ("show", "plot", "view") if TUBULE else ():
                    done = subprocess.run([TUBULE, command, path], capture_output=True, text=True)
                    self.assertEqual(done.returncode, 2, (command, done))
                    self.assertIn(words, done.stderr)
                    self.assertNotIn("Traceback", done.stderr)

    def test_titles_that_no_picture_holds(self):
        path = write(self.folder / "a.hdf")
        with h5py.File(path, "a") as file:
            file["resolved_case"][()] = CASE.format(k42=0).replace("A made-up tube", "x" * 200000)
        done = scripts.run_script(PLOT, "plot", path, "-o", self.folder / "a.svg")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("x" * 197 + "...", svg_texts(self.folder / "a.svg"))

    @unittest.skipUnless(sys.argv[1:], "needs the program")
    def test_interrupts_while_libraries_are_imported(self):
        """Of Python itself, and of ours: the process ends as the program does, without a word."""
        path = write(self.folder / "a.hdf")
        for module in ("sitecustomize", "h5py"):
            folder = self.folder / module
            folder.mkdir()
            (folder / f"{module}.py").write_text("import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(1)\n")
            done = subprocess.run([TUBULE, "plot", path], env=os.environ | {"PYTHONPATH": str(folder)}, capture_output=True, text=True)
            words = [line for line in done.stderr.splitlines() if "has no checksums" not in line]
            self.assertEqual((done.returncode, done.stdout, words), (130, "", []))

    def test_nothing_to_draw(self):
        self.refused("no profiles to draw", write(self.folder / "a.hdf", times=[]), "--kind", "profiles")
        self.refused("no energy series to draw", write(self.folder / "a.hdf", rows=0), "--kind", "energy")
        self.refused("neither frames nor an energy series", write(self.folder / "a.hdf", rows=0, times=[]))

    def test_arguments(self):
        file = write(self.folder / "a.hdf")
        self.refused("is not a list of numbers", file, "--times", "0,x")
        self.refused("has no series r_mni; it has energy", file, "--series", "r_mni")
        self.refused("time; did you mean energy_40 or", file, "--series", "enrgy_40")
        self.refused("no row has a time in the range; it goes from 0 to 1", file, "--series", "energy", "--from", "2")
        self.refused("energy_40 is nowhere positive in the range, as --logy needs it", file, "--series=energy_40", "--logy")
        self.refused("--x, --from, --to and --logy belong to --series", file, "--logy")
        self.refused("is no scan, to which --confirmed belongs", file, "--confirmed", "points.json")
        self.refused("no result has a frame at t = 0.3; there are frames at 0, 0.01", file, "--times", "0.3")
        self.refused("--dpi: 20 is not between 30 and 1200", file, "--dpi=20")
        self.refused("x.jpg: a picture is written as one of .png, .svg, .pdf", file, "-o", self.folder / "x.jpg")
        self.refused("does not exist", file, "-o", self.folder / "none/x.png")
        (self.folder / "taken.png").mkdir()
        self.refused("taken.png: cannot be written", file, "-o", self.folder / "taken.png")

    def test_missing_library_names_its_package(self):
        # A module of that name that cannot be imported, found before Debian's.
        (self.folder / "h5py.py").write_text("raise ImportError")
        path = {"PYTHONPATH": str(self.folder)}
        done = subprocess.run([sys.executable, "-B", PLOT, "plot", "a.hdf"], env=os.environ | path, capture_output=True, text=True)
        self.assertEqual(done.returncode, 4)
        self.assertIn("has no h5py; install the package python3-h5py", done.stderr)


class Validation(InFolder):
    HEAD = "surface,mesh,k,recovery,h,H,K,grad_H,grad_K\n"
    ROW = "dumbbell,structured,3,{},{},{},2e-3,3e-2,4e-2\n"

    def draw(self, text):
        table = self.folder / "table.csv"
        table.write_text(text)
        return scripts.run_script(PLOT, FIGURES / "validation.py", table, "-o", self.folder / "v.svg")

    def test_figure(self):
        rows = [self.ROW.format(name, h, 1e-3 * h) for name in ("elementwise", "patch", "unknown") for h in (0.1, 0.2)]
        done = self.draw(self.HEAD + "".join(rows))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        texts = svg_texts(self.folder / "v.svg")
        for words in ("patch recovery, the default", "longest edge h", "h\u2074", "\u2207K"):
            self.assertIn(words, texts)
        table = validation.read_table(self.folder / "table.csv")
        self.assertEqual(table[3, "patch", "H"], [(0.2, 2e-4), (0.1, 1e-4)])  # coarse first
        self.assertNotIn((3, "unknown", "H"), table)

    def test_surface_has_the_area_of_the_papers_and_the_curvature_of_a_sphere(self):
        # 5.176926500756, and INT K = 4 pi: rings of the profile by the midpoint rule.
        angle = (np.arange(4000) + 0.5) * np.pi / 4000
        r, z, nr, nz, H, K = validation.profile(angle)
        area = 2 * np.pi * r * np.hypot(np.gradient(r, angle), np.gradient(z, angle)) * np.pi / 4000
        self.assertAlmostEqual(np.sum(area), 5.176926500756, delta=1e-4)
        self.assertAlmostEqual(np.sum(K * area), 4 * np.pi, delta=1e-3)
        self.assertTrue(np.all(H < -np.sqrt(np.maximum(4 * K, 0)) + 1e-9))  # outward normal; H^2 >= 4 K
        np.testing.assert_allclose(nr**2 + nz**2, 1, atol=1e-12)

    def test_refusals(self):
        for text, words in (
            ("a,b\n1,2\n", "must have the columns"),
            (self.HEAD + self.ROW.format("patch", 0.1, "small"), "must have the columns"),
            (self.HEAD + self.ROW.format("patch", 0.1, 0), "positive numbers"),
            (self.HEAD, "has no rows"),
        ):
            done = self.draw(text)
            self.assertEqual(done.returncode, 2)
            self.assertIn(words, done.stderr)


class WorkPrecision(InFolder):
    def draw(self, text):
        table = self.folder / "table.csv"
        table.write_text(text)
        return scripts.run_script(PLOT, FIGURES / "work_precision.py", table, "-o", self.folder / "w.svg")

    def test_chart(self):
        rows = 'series,energy_asked,error,estimate,cpu_ms\n"k42 = 0",1e-6,1e-7,4e-7,1.2\n"k42 = 0",1e-4,0,4e-5,0.4\n'
        done = self.draw(rows)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        texts = svg_texts(self.folder / "w.svg")
        for words in ("k42 = 0", "prototype, tuned by hand", "asked: 1e-4", "asked: 1e-6"):
            self.assertIn(words, texts)
        table = work_precision.read_table(self.folder / "table.csv")
        self.assertEqual([row[0] for row in table["k42 = 0"]], [1e-4, 1e-6])  # coarse first

    def test_refusals(self):
        for text, words in (
            ("a,b\n1,2\n", "must have the columns"),
            ("series,energy_asked,error,estimate,cpu_ms\nx,1,2,3,fast\n", "must have the columns"),
            ("series,energy_asked,error,estimate,cpu_ms\nx,1,2,3,-1\n", "negative or not finite"),
            ("series,energy_asked,error,estimate,cpu_ms\n", "has no rows"),
        ):
            done = self.draw(text)
            self.assertEqual(done.returncode, 2)
            self.assertIn(words, done.stderr)


class StepCosts(InFolder):
    HEADER = "part,order,triangles,measure,clock,threads,whole,analysis,factors,iterations,fill,residual\n"
    ROWS = (
        "solvers,3,320,a step,cpu,1,70,0,0,0,0,0\n"
        '"solvers",3,320,"its system, with border",cpu,1,30,0,0,5,0,0\n'
        "solvers,3,320,some factors,cpu,1,28,4,16,5,1e6,1e-12\n"
        "lagged,3,320,factors kept for 1,cpu,1,28,0,16,5,0,0\n"
        "lagged,3,320,factors kept for 8,cpu,1,42,0,2,19,0,0\n"
        "threads,3,320,a step,wall,1,70,0,0,0,0,0\n"
        "threads,3,320,a step,wall,2,50,0,0,0,0,0\n"
    )

    def draw(self, text):
        table = self.folder / "table.csv"
        table.write_text(text)
        return scripts.run_script(PLOT, FIGURES / "step_costs.py", table, "-o", self.folder / "s.svg")

    def test_chart(self):
        done = self.draw(self.HEADER + self.ROWS)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        texts = svg_texts(self.folder / "s.svg")
        # The factors' own time beside their bar; iterations of the factors that are kept longest.
        for words in ("some factors", "28 of 68", "k = 3, 320 triangles", "19", "rest of the step", "two threads"):
            self.assertIn(words, texts)

    def test_without_threads(self):
        done = self.draw(self.HEADER + "".join(r for r in self.ROWS.splitlines(True) if not r.startswith("threads")))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertNotIn("two threads", svg_texts(self.folder / "s.svg"))

    def test_refusals(self):
        for text, words in (
            ("a,b\n1,2\n", "must have the columns"),
            (self.HEADER + self.ROWS.replace("70", "nan"), "negative or not finite"),
            (self.HEADER + self.ROWS.replace("solvers", "other"), "has no rows of solvers"),
        ):
            done = self.draw(text)
            self.assertEqual(done.returncode, 2)
            self.assertIn(words, done.stderr)


class WorkPrecisionFluid(InFolder):
    HEADER = "model,series,asked,error,estimate,cpu_s\n"
    ROWS = (
        "{0},reference,0,1e-5,1e-5,9\n"
        "{0},accuracy asked for,1e-3,2e-4,4e-4,3\n"
        '{0},"material, order 5",0,1e-3,2e-3,1\n'
        '{0},"even, order 5",0,1e-2,2e-3,0.5\n'
    )

    def draw(self, text):
        table = self.folder / "table.csv"
        table.write_text(text)
        return scripts.run_script(PLOT, FIGURES / "work_precision_fluid.py", table, "-o", self.folder / "w.svg")

    def test_chart(self):
        done = self.draw(self.HEADER + self.ROWS.format("fluid") + self.ROWS.format("stokes"))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        texts = svg_texts(self.folder / "w.svg")
        for words in ("fluid, with inertia", "Stokes flow", "material, order 5", "even, order 5", "requested accuracy"):
            self.assertIn(words, texts)

    def test_only_runs_that_none_beats_are_drawn(self):
        runs = [SimpleNamespace(error=error, cpu_s=cpu) for error, cpu in ((1, 1), (2, 2), (0.5, 3), (0.6, 1.5))]
        self.assertEqual([(run.error, run.cpu_s) for run in work_precision_fluid.best(runs)], [(1, 1), (0.6, 1.5), (0.5, 3)])

    def test_refusals(self):
        for text, words in (
            ("a,b\n1,2\n", "must have the columns"),
            (self.HEADER + "fluid,reference,0,1e-5,fast,9\n", "must have the columns"),
            (self.HEADER + "gas,reference,0,1e-5,1e-5,9\n", "has no reference, or no other run, of fluid"),
            (self.HEADER + self.ROWS.format("fluid"), "has no reference, or no other run, of stokes"),
        ):
            done = self.draw(text)
            self.assertEqual(done.returncode, 2)
            self.assertIn(words, done.stderr)


class Command(InFolder):
    """`tubule plot` itself; in the suite only where the program is given."""

    def test_labels_and_formulas_come_through(self):
        files = [write(self.folder / f"{i}.hdf", k42=k42) for i, k42 in enumerate((0.06, 0.12))]
        texts = self.drawn("--times", "0,0.2", *files, program=TUBULE)
        for words in ("k\u2084\u2082 = 0.06", "k\u2084\u2082K\u00b2", "t\u2081 = 0.2"):
            self.assertIn(words, texts)

    def test_exit_status(self):
        self.refused("missing.hdf", self.folder / "missing.hdf", program=TUBULE)
        self.refused("no result has a frame", write(self.folder / "a.hdf"), "--times", "7", program=TUBULE)


def load_tests(loader, suite, pattern):
    if TUBULE:
        return suite
    cases = (Labels, Columns, Scales, Pictures, Curves, Refusals, WorkPrecision)
    return unittest.TestSuite(loader.loadTestsFromTestCase(case) for case in cases)


if __name__ == "__main__":
    if len(sys.argv) > 1 and not sys.argv[1].startswith("-") and Path(sys.argv[1]).is_file():
        TUBULE = sys.argv.pop(1)
    unittest.main()
