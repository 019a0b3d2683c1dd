#!/usr/bin/python3
"""Pictures: drawn from results made up here, whose curvatures are exact (docs/results.md has the layout).

    plot_test.py [TUBULE]    with the program, its subcommand `plot` is tested too
"""

import os
import pty
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
from drawing import colours, command_line, curves, energy, labels, movie, results, tubes  # noqa: E402

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


def replaced(path, **changes):
    """The result with other data sets (None: without); __ in names stands for /."""
    with h5py.File(path, "a") as file:
        for name, values in changes.items():
            del file[name.replace("__", "/")]
            if values is not None:
                file[name.replace("__", "/")] = values
    return path


class InFolder(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, name="a.hdf", **options):
        return write(self.folder / name, **options)

    def plot(self, *arguments, program=None):
        if not program:
            return scripts.run_script(PLOT, "plot", *arguments)
        done = subprocess.run([program, "plot", *arguments], capture_output=True, text=True)
        # Files made here by h5py have no checksums, which the program says of each.
        said = [line for line in done.stderr.splitlines(True) if "has no checksums" not in line]
        return subprocess.CompletedProcess(done.args, done.returncode, done.stdout, "".join(said))

    def drawn(self, *arguments, **options):
        """Lines of text of the SVG drawn, which must be of the page's width."""
        done = self.plot(*arguments, "--dpi=60", "-o", self.folder / "p.svg", **options)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        width, height = (float(x) for x in re.search('width="(.*?)pt" height="(.*?)pt"', (self.folder / "p.svg").read_text()).groups())
        self.assertEqual(width, 7 * 72)  # the page's width in points
        self.assertGreater(height, 72)
        return svg_texts(self.folder / "p.svg")

    def check_words(self, texts, *words, never=()):
        """Each of the words is a line of the picture, those that end with ... its beginning; none has a word of `never`."""
        lines = "\n".join(texts).split("\n")
        for word in words:
            begins = word.endswith("...") and any(line.startswith(word[:-3]) for line in lines)
            self.assertTrue(begins or word in lines, (word, lines))
        for word in never:
            self.assertFalse([line for line in lines if word in line], word)

    def refused(self, words, *arguments, status=2, **options):
        with self.subTest(words):
            done = self.plot(*arguments, **options)
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn(words, done.stderr)


class Labels(unittest.TestCase):
    def test_of_cases(self):
        def words(*cases):
            return labels.row_labels([tomllib.loads(text) for text in cases], [f"file{i}" for i in range(len(cases))])

        text, k0, k1 = CASE.format(k42=0), "k\u2084\u2082 = 0", "k\u2084\u2082 = 1"
        for why, cases, expected in (
            ("only what differs; 0 and 0.0 are equal", (resolved(text, ["energy.H0=-1"]), CASE.format(k42="0.0")),
             [["H\u2080 = \u22121"], ["H\u2080 = \u22122"]]),
            ("one mode has no index", (text, text.replace("amplitude = 0.2", "amplitude = 0.3")), [["amplitude = 0.2"], ["amplitude = 0.3"]]),
            ("modes have their index", (text, text + "[[shape.mode]]\namplitude = 0.1\n"), [["no mode 1"], ["mode 1 amplitude = 0.1"]]),
            ("absent keys", (text, resolved(text, ["energy.k40=0.1"])), [["k\u2084\u2080 by default"], ["k\u2084\u2080 = 0.1"]]),
            ("about, expect and time are no difference",
             (resolved(text, ['about.title="x"', "time.output=[1,2]"]), resolved(text, ['expect.stop="finished"', "time.end=3", "energy.k42=1"])),
             [[k0], [k1]]),
            ("equal cases", (text, text), [["file0"], ["file1"]]),
            ("too many differences", (text, resolved(text, [f"energy.x{i}=1" for i in range(5)])), [["file0"], ["file1"]]),
            ("some are equal", (text, text, resolved(text, ["energy.k42=1"])), [[k0, "file0"], [k0, "file1"], [k1, "file2"]]),
            ("equal last words", ("[a]\nx = 1\n[b]\nx = 1\n", "[a]\nx = 2\n[b]\nx = 2\n"), [["a.x = 1", "b.x = 1"], ["a.x = 2", "b.x = 2"]]),
        ):  # fmt: skip
            with self.subTest(why):
                self.assertEqual(words(*cases), expected)

    def test_formulas_and_numbers(self):
        self.assertEqual(labels.formula("k_{20}(H-H_0)^2"), "k\u2082\u2080(H\u2212H\u2080)\u00b2")
        self.assertEqual(labels.formula("E_{42}"), "E\u2084\u2082")
        self.assertEqual(labels.formula("\\sigma"), "\u03c3")
        cases = [tomllib.loads(CASE.format(k42=k42)) for k42 in (0.2, 0, 0.06)]
        self.assertEqual(labels.sorted_by_value(cases), [1, 2, 0])
        self.assertEqual(labels.sorted_by_value([{"a": "y"}, {"a": "x"}]), [0, 1])
        self.assertEqual(labels.formula("k_g|\\nabla H|^2"), "kg|\u2207H|\u00b2")
        found = [labels.power(value, 2) for value in (0, 0.0123, 4567, 4.26e-5, -1.5e7)]
        self.assertEqual(found, ["0", "0.012", "4600", "4.3\u00b710\u207b\u2075", "\u22121.5\u00b710\u2077"])


class Columns(InFolder):
    """Times of the columns, and the shapes in them."""

    def columns(self, *options, times=None):
        files = [self.write(f"{i}.hdf", **each) for i, each in enumerate(options)]
        columns = tubes.choose_columns([results.read_result(str(file)) for file in files], times)
        return [column.time for column in columns], columns

    def test_times(self):
        for options, wanted, expected in (
            # Six at most, first and last kept, those between which the energy 3 + exp(-6 t) changes, then evenly.
            ([{"times": [float(i) for i in range(31)]}], None, [0, 1, 8, 15, 22, 30]),
            ([{"times": [0, 1, 2, 3]}, {"times": [0, 1.5, 2, 3]}], None, [0, 2, 3]),  # shared times go first
            ([{"times": [0, 1, 2, 3]}], [2, 0], [0, 2]),
            ([{"times": [0, 1, 2, 3]}, {"times": [0, 1, 4]}], [0, np.inf], [0, None]),  # the last ones, each at its time
        ):
            self.assertEqual(self.columns(*options, times=wanted)[0], expected)
        with self.assertRaisesRegex(results.BadInput, "no result has a frame at t = 1.5; there are .* 0, 1, 2, 3"):
            self.columns({"times": [0, 1, 2, 3]}, times=[0, 1.5])

    def test_a_run_that_stopped_ends_in_the_next_column(self):
        times, columns = self.columns({"times": [0, 1, 2, 3]}, {"times": [0, 1, 1.5], "stop": "pinch-off"})
        self.assertEqual(times, [0, 1, 2, 3])
        self.assertEqual(columns[2].cells[1].time, 1.5)
        self.assertEqual([column.stops[1] for column in columns], [None, None, "pinch-off", None])
        self.assertIsNone(columns[3].cells[1])

    def test_all_runs_stopped_early(self):
        times, columns = self.columns(*({"times": [0, 1 + i / 10], "stop": "overhang"} for i in range(2)))
        self.assertEqual(times, [0, None])
        self.assertEqual([frame.time for frame in columns[1].cells], [1, 1.1])


class Scales(unittest.TestCase):
    def test_a_neck_does_not_set_the_colour_scale(self):
        values, area = np.append(np.linspace(-1, 1, 1000), -1e6), np.append(np.ones(1000), 1e-3)
        norm, extend = colours.colour_scale(values, area, 0.0)
        self.assertAlmostEqual(norm.vmax, colours.MARGIN * colours.COVERED, delta=0.01)  # 98 % of a uniform spread
        self.assertEqual((norm.vmin, extend), (-norm.vmax, "min"))

    def test_white_is_the_mean_where_all_is_far_from_the_centre(self):
        values, area = np.linspace(-1.4, -0.8, 1001), np.ones(1001)
        self.assertTrue(colours.is_far(0.0, values, area))
        self.assertFalse(colours.is_far(-1.0, values, area))
        (norm, extend), words = colours.about_mean(values, area, 1.0)
        self.assertAlmostEqual(norm(-1.1), 0.5)
        self.assertEqual((norm(-1.4) > 0, norm(-0.8) < 1, extend, words), (True, True, "neither", ", white: mean \u2248 \u22121.1"))

    def test_rounding_is_no_colour(self):
        norm, extend = colours.colour_scale(np.array([1e-14, -1e-14]), np.ones(2), 0.0)
        self.assertEqual((norm.vmin, norm.vmax, extend), (-1, 1, "neither"))
        norm, _ = colours.colour_scale(np.full(5, -2.0), np.ones(5), -2.0)
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
        files = [self.write(f"{i}.hdf", k42=k42) for i, k42 in enumerate((0.12, 0, 0.06))]
        texts = self.drawn(*files)
        self.assertEqual([text for text in texts if "k\u2084\u2082 =" in text], 2 * [f"k\u2084\u2082 = {k}" for k in ("0", "0.06", "0.12")])
        for words in ("k\u2084\u2082 = 0", "k\u2084\u2082 = 0.06", "k\u2084\u2082 = 0.12"):
            self.assertEqual(texts.count(words), 2, words)  # beside its row and in the legend
        # A term that is zero everywhere has no line.
        self.check_words(texts, "(a)", "(b)", "t\u2081 = 0.01", "t\u2085 = 1", "total", "k\u2082\u2080(H\u2212H\u2080)\u00b2",
                         "k\u2084\u2082K\u00b2", "bending energy E", never=("energy_40", "E\u2084\u2080"))  # fmt: skip
        texts = self.drawn(*files[:2], "--label=coarse", "--label=fine")
        self.assertEqual((texts.count("coarse"), texts.count("fine")), (2, 2))
        self.check_words(texts, never=["k\u2084\u2082 ="])
        self.refused("--label: 1 labels, but 2 results", *files[:2], "--label=coarse", "-o", self.folder / "q.svg")

    def test_options(self):
        file, other = self.write(), self.write("b.hdf", k42=0.06)
        stopped = self.write("c.hdf", k42=1, times=[0, 0.01, 0.03], stop="pinch-off")
        varying = self.write("d.hdf", sets=['energy.H0="-2 + 0.1*cos(pi*z)"'], amplitude=0.0)
        domains = self.write("f.hdf", profile=lambda t: tube(t, 0.2) | {"H0": np.linspace(-3, -1, 65)})
        large = self.write("e.hdf")
        with h5py.File(large, "a") as f:
            f["series/energy"][:] = 37.69923 + 1e-5 * f["series/time"][:]
        for arguments, words, never in (
            ((file, other, "--series=energy,energy_20", "--logy", "--from=0.1", "--to=0.5", "--label=a", "--label=b"),
             ("a", "b", "energy", "energy_20", "time t"), ["t\u2081 = 0.01"]),
            ((file, "--series=energy", "--x=energy_20"), ["energy_20"], []),
            ((file, "--kind", "profiles"), ["mean curvature..."], ["bending energy E"]),
            ((file, "--kind", "energy"), ["bending energy E"], ["mean curvature"]),
            ((file, "--times", "0,0.2"), ["t\u2081 = 0.2"], ["t\u2082 = 0.5"]),
            # In the legend; below its last tube, which stands in the column of t = 0.05, and so has its own time.
            ((file, stopped), ["pinch-off at t = 0.03", "pinch-off", "t = 0.03"], []),
            # No value of H0 is white, so the scale is about the mean curvature: -1 on the straight tube of radius 1.
            ((varying, "--kind", "profiles"), ["mean curvature H = \u03ba\u2081 + \u03ba\u2082 (left halves)", "white: mean \u2248 \u22121"], []),
            ((domains, "--kind", "profiles,energy", "--colour", "H0,K", "--logx", "--from=0.1"),
             ["spontaneous curvature H\u2080 (left halves)", "time t", "bending energy E"], ["mean curvature"]),
            # Small changes of a large energy are ticks from a round number: 37.69923 is 3.
            ((large, "--kind", "energy"), ["(bending energy E \u2212 37.6992) / 10\u207b\u2075", "3"], []),
        ):  # fmt: skip
            with self.subTest(arguments=arguments[-2:]):
                self.check_words(self.drawn(*arguments), *words, never=never)

    def test_one_result_has_its_title_and_default_names(self):
        done = self.plot(self.write("one.hdf"))
        self.assertEqual(done.returncode, 0, done.stderr)
        width, height = png_size(self.folder / "one.png")
        self.assertEqual(width, 2100)
        self.assertGreater(height, 300)
        self.assertGreater((self.folder / "one.png").stat().st_size, 15000)  # not blank
        self.assertEqual(self.plot(self.folder / "one.hdf", "--width=3.4", "--dpi=100").returncode, 0)
        self.assertEqual(png_size(self.folder / "one.png")[0], 340)
        self.assertIn("A made-up tube", svg_texts(self.folder / "one.svg"))

    def test_files(self):
        file = self.write()
        self.drawn(file)
        before = (self.folder / "p.svg").read_bytes()
        self.drawn(file)
        self.assertEqual((self.folder / "p.svg").read_bytes(), before)  # the same again
        self.assertEqual(self.plot(file, "-o", self.folder / "a.pdf").returncode, 0)
        self.assertEqual((self.folder / "a.pdf").read_bytes()[:5], b"%PDF-")

    def test_degenerate_inputs(self):
        for name, options in {
            "uniform tube": {"amplitude": 0.0},
            "one frame": {"times": [0.0], "rows": 1},
            "no frames": {"times": []},
            "no series": {"rows": 0},
            "times going back": {"times": [0, 0.5, 0.2, 0.5, 1]},
            "nearly pinched": {"amplitude": 0.9999},
            "never finished": {"stop": None},
            "no graph": {"times": [0], "profile": lambda t: tube(t, 0.2) | {"z": np.linspace(0, 2, 65) + 0.5 * np.sin(np.linspace(0, 4 * np.pi, 65))}},
        }.items():
            with self.subTest(name):
                self.drawn(self.write(**options))

    def test_eight_rows_one_of_them_without_frames(self):
        files = [self.write(f"{i}.hdf", k42=i, times=[] if i == 3 else [0, 0.5, 1]) for i in range(8)]
        self.assertEqual(self.drawn(*files).count("k\u2084\u2082 = 3"), 2)


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

    def test_pictures(self):
        def turning(time):
            return ball(0.0) | {"u_theta": 3 * ball(0.0)["r"]}

        def overhanging(time):
            frame = tube(time, 0.2)
            z = frame["z"] - 0.6 * np.sin(2 * np.pi * frame["z"])  # goes back and forth
            return frame | {"z": z, "u_n": np.cos(np.pi * frame["z"])}

        def moving(time):
            return tube(time, 0.2) | {"u_n": np.ones(65)}

        for options, words, never in (
            ({"profile": ball, "kinetic": True, "sets": ['model.kind="fluid"'], "times": [0, 0.5, 1]},
             ("at rest", "|u\u2099| \u2264 2", "|u\u209c| \u2264 1", "|u\u209c| \u2264 0.5", energy.KINETIC, "energy", "normal velocity...",
              "velocity u\u209c along the profile..."), ["mean curvature"]),
            ({"profile": ball, "kinetic": True, "sets": ['model.kind="stokes"']}, ["bending energy E"], [energy.KINETIC]),  # no inertia
            ({"profile": turning, "times": [0], "rows": 0}, ["|u\u03b8| \u2264 3"], ["at rest"]),
            ({"profile": overhanging, "times": [0, 1]}, ["|u\u2099| \u2264 1"], ["along the profile"]),
            ({"profile": moving}, ["mean curvature..."], []),  # a graph
        ):  # fmt: skip
            with self.subTest(options=options):
                colour = ["--colour=u_n"] * any(word.startswith(("|u", "normal")) for word in words)
                self.check_words(self.drawn(self.write(**options), *colour), *words, never=never)

    def test_equilibria_have_numbers_and_curvatures(self):
        def at_rest(time):
            return {name: values for name, values in ball(0.0).items() if not name.startswith("u_")}

        sets = ['equilibrium.branch.vary="equilibrium.reduced_volume"']
        file = self.write(profile=at_rest, sets=sets, times=[0, 1, 2], rows=3)
        with h5py.File(file, "a") as f:
            for number, frame in enumerate(f["frames"].values()):
                frame.attrs["parameter"] = 0.9 - 0.1 * number
            f["series/parameter"] = [0.9, 0.8, 0.7]
            f["series"].attrs["order"] = np.array([*f["series"].attrs["order"], "parameter"], dtype=h5py.string_dtype())
        bar = "mean curvature H = \u03ba\u2081 + \u03ba\u2082 (left halves)"
        self.check_words(self.drawn(file), bar, "shape 2", "reduced volume", "= 0.7", "bending energy E", never=["t\u2081", "number of the"])
        single = self.write("b.hdf", profile=at_rest, sets=["equilibrium.area=1"], times=[0], rows=1)
        self.check_words(self.drawn(single), never=["bending energy E"])


class Films(InFolder):
    def film(self, name, *arguments, **options):
        done = self.plot(*arguments, "--movie", self.folder / name, **options)
        self.assertEqual((done.returncode, done.stdout), (0, f"{self.folder / name}\n"), done.stderr)
        return self.folder / name

    def frames(self, path):
        with Image.open(path) as film:
            return [np.asarray(frame.convert("RGB"), int) for frame in ImageSequence.Iterator(film)]

    def test_shape_and_point_on_the_energy_move_and_nothing_else(self):
        path = self.write(times=(0, 0.5, 1), profile=lambda t: tube(t, 0.3 * (1 - t), points=17))
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
        path = self.write(times=(0, 1e-4))
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
        path = self.write(times=(0, 1))
        with unittest.mock.patch.dict(os.environ, PATH="/nowhere"):
            self.refused("install the package ffmpeg", path, "--movie", self.folder / "a.mp4", status=4)
        if shutil.which("ffmpeg"):
            self.assertEqual(self.film("a.mp4", path).read_bytes()[4:8], b"ftyp")

    def test_interrupted_film_leaves_nothing(self):
        path = self.write(times=list(np.linspace(0, 1, 30)))
        command = ["/usr/bin/python3", "-B", PLOT, "plot", path, "--movie", self.folder / "a.gif"]
        terminal, end = pty.openpty()  # on which each frame is reported
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=end, text=True) as process:
            while b"frame" not in os.read(terminal, 1000):
                pass
            process.send_signal(signal.SIGINT)
            out, _ = process.communicate(timeout=60)
        self.assertEqual((process.returncode, out), (130, ""))
        self.assertEqual([p.name for p in self.folder.iterdir()], ["a.hdf"])

    def test_profile_becomes_a_surface(self):
        for profile, area in ((ball(0, 201), 4 * np.pi), (tube(0, 0.0), 4 * np.pi)):
            frame = results.Frame(0.0, *(profile[name] for name in ("z", "r", "H", "K")))
            surface = movie.as_surface(frame, "H")
            a, b, c = (surface.points[:, i] for i in range(3))
            twice = np.cross(b - a, c - a)
            self.assertAlmostEqual(np.linalg.norm(twice, axis=1).sum() / 2 / area, 1, delta=3e-3)
            solid = np.linalg.norm(twice, axis=1) > 1e-9
            self.assertTrue((np.einsum("ij,ij->i", twice, surface.normal.mean(axis=1))[solid] > 0).all())  # seen from outside
            self.assertEqual(surface.closed, profile["r"][0] < 1e-9)
            np.testing.assert_allclose(surface.H, frame.H[0], atol=1e-6)

    def test_refusals(self):
        one, two = write(self.folder / "one.hdf", times=(0,)), write(self.folder / "two.hdf")
        self.refused("a film needs two or more", one, "--movie", self.folder / "a.gif")
        self.refused("--movie goes with --times, --label, --fps, --camera, --units and one --colour only", two, "--movie", self.folder / "a.gif", "--dpi=100")
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
        with h5py.File(self.folder / "other.hdf", "a") as file:
            file.attrs["schema"] = 3
        self.refused("a later version of tubule, with schema 3; this version reads 1 to 2", self.folder / "other.hdf")

    def test_damaged_records(self):
        for changes, words in (
            ({"frames__000001__r": np.ones(3)}, "frame 000001: z, r, H, K must be lists of one length"),
            ({"frames__000001__H": np.full(65, np.nan)}, "/frames/000001/H contains numbers that are not finite"),
            ({"frames__000001__K": None}, "frame 000001 lacks K"),
            ({"series__energy": np.ones(3)}, "series of different lengths"),
            ({"resolved_case": "[energy"}, "its case is not valid TOML"),
        ):
            self.refused(words, replaced(self.write("damaged.hdf"), **changes))
        short = self.write("short.hdf", profile=lambda t: tube(t, 0.2) | {"u_t": np.ones(3)})
        self.refused("frame 000000: z, r, H, K, u_t must be lists of one length", short)

    def test_values_that_the_file_does_not_hold(self):
        """Links to other files, values in them, and more values than the file has bytes: refused by every reader."""
        secret, other, name = self.folder / "secret", self.write("other.hdf"), "series/energy"
        secret.write_bytes(np.arange(40.0).tobytes())
        virtual = h5py.VirtualLayout((40,), float)
        virtual[:] = h5py.VirtualSource(str(other), "/series/energy", (40,))
        for change, words in (
            (lambda file: file.update({name: h5py.ExternalLink(str(other), "/series/energy")}), "link to another file: not followed"),
            (lambda file: file.create_dataset(name, (40,), float, external=[(str(secret), 0, 320)]), "in another file: not read"),
            (lambda file: file.create_virtual_dataset(name, virtual), "in another file: not read"),
            (lambda file: file.create_dataset(name, (2**40,), float, chunks=(1024,)), "not all are in the file"),
            (lambda file: file.create_dataset(name, (2**40,), float, chunks=(1024,), compression="gzip"), "not all are in the file"),
            (lambda file: file.create_dataset(name, data=np.full(40, np.nan)), "energy"),
        ):
            path = self.write("foreign.hdf")
            with h5py.File(path, "a") as file:
                del file[name]
                change(file)
            self.refused(words, path)
            self.assertRaisesRegex(results.BadInput, words, results.read_result, path)
            for command in ("show", "plot", "view") if TUBULE and "link" in words else ():
                done = subprocess.run([TUBULE, command, path], capture_output=True, text=True)
                self.assertEqual(done.returncode, 2, (command, done))
                self.assertIn(words, done.stderr)
                self.assertNotIn("Traceback", done.stderr)

    def test_titles_that_no_picture_holds(self):
        path = replaced(self.write(), resolved_case=CASE.format(k42=0).replace("A made-up tube", "x" * 200000))
        self.check_words(self.drawn(path), "x" * 97, "xxx...")

    @unittest.skipUnless(sys.argv[1:], "needs the program")
    def test_interrupts_while_libraries_are_imported(self):
        """Imports of Python itself, and ours: the process ends as the program does, without a word."""
        path = self.write()
        for module in ("sitecustomize", "h5py"):
            folder = self.folder / module
            folder.mkdir()
            (folder / f"{module}.py").write_text("import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(1)\n")
            done = subprocess.run([TUBULE, "plot", path], env=os.environ | {"PYTHONPATH": str(folder)}, capture_output=True, text=True)
            words = [line for line in done.stderr.splitlines() if "has no checksums" not in line]
            self.assertEqual((done.returncode, done.stdout, words), (130, "", []))

    def test_arguments(self):
        file, empty = self.write(), self.write("empty.hdf", rows=0, times=[])
        (self.folder / "taken.png").mkdir()
        for words, *arguments in (
            ("no profiles to draw", self.write("b.hdf", times=[]), "--kind", "profiles"),
            ("no energy series to draw", self.write("c.hdf", rows=0), "--kind", "energy"),
            ("neither frames nor an energy series", empty),
            ("has no series r_mni; it has energy", file, "--series", "r_mni"),
            ("time; did you mean energy_40 or", file, "--series", "enrgy_40"),
            ("no row has a time in the range; it goes from 0 to 1", file, "--series", "energy", "--from", "2"),
            ("energy_40 is nowhere positive in the range, as --logy needs it", file, "--series=energy_40", "--logy"),
            ("time is nowhere positive in the range, as --logx needs it", file, "--series=energy", "--logx", "--to=0"),
            ("not all of its frames have H0, which those have where it varies", file, "--colour=H0"),
            ("is no scan, to which --confirmed belongs", file, "--confirmed", "points.json"),
            ("no result has a frame at t = 0.3; there are frames at 0, 0.01", file, "--times", "0.3"),
            ("x.jpg: a picture is written as one of .png, .svg, .pdf", file, "-o", self.folder / "x.jpg"),
            ("does not exist", file, "-o", self.folder / "none/x.png"),
            ("taken.png: cannot be written", file, "-o", self.folder / "taken.png"),
        ):
            self.refused(words, *arguments)

    def test_values_of_options(self):
        for words, option in (("is not a list of numbers", "--times=0,x"), ("--x and --logy belong to --series", "--logy"),
                              ("--dpi: 20 is not between 30 and 1200", "--dpi=20"), ("is not AZIMUTH,ELEVATION in degrees", "--camera=1,100"),
                              ("--width: 2 is not between 3 and 20", "--width=2")):  # fmt: skip
            with self.assertRaisesRegex(results.BadInput, words):
                command_line.plot_options(["a.hdf", option])

    def test_missing_library_names_its_package(self):
        # A module of that name that cannot be imported, found before Debian's.
        (self.folder / "h5py.py").write_text("raise ImportError")
        path = {"PYTHONPATH": str(self.folder)}
        done = subprocess.run([sys.executable, "-B", PLOT, "plot", self.write()], env=os.environ | path, capture_output=True, text=True)
        self.assertEqual(done.returncode, 4)
        self.assertIn("has no h5py; install the package python3-h5py", done.stderr)


class FiguresOfDocs(InFolder):
    """docs/figures/*.py, which draw tables."""

    CURVATURE = "surface,mesh,k,recovery,h,H,K,grad_H,grad_K\n"
    CURVATURE_ROW = "dumbbell,structured,3,{},{},{},2e-3,3e-2,4e-2\n"
    CURVATURE_ROWS = "".join(f"dumbbell,structured,3,{name},{h},{1e-3 * h},2e-3,3e-2,4e-2\n"
                             for name in ("elementwise", "patch", "unknown") for h in (0.1, 0.2))  # fmt: skip
    WORK = "series,energy_asked,error,estimate,cpu_ms\n"
    WORK_ROWS = '"k42 = 0",1e-6,1e-7,4e-7,1.2\n"k42 = 0",1e-4,0,4e-5,0.4\n'
    STEPS = "part,order,triangles,measure,clock,threads,whole,analysis,factors,iterations,fill,residual\n"
    STEP_ROWS = (
        "solvers,3,320,a step,cpu,1,70,0,0,0,0,0\n"
        '"solvers",3,320,"its system, with border",cpu,1,30,0,0,5,0,0\n'
        "solvers,3,320,some factors,cpu,1,28,4,16,5,1e6,1e-12\n"
        "lagged,3,320,factors kept for 1,cpu,1,28,0,16,5,0,0\n"
        "lagged,3,320,factors kept for 8,cpu,1,42,0,2,19,0,0\n"
    )
    THREAD_ROWS = "threads,3,320,a step,wall,1,70,0,0,0,0,0\nthreads,3,320,a step,wall,2,50,0,0,0,0,0\n"
    FLUID = "model,series,asked,error,estimate,cpu_s\n"
    FLUID_ROWS = (
        "{0},reference,0,1e-5,1e-5,9\n"
        "{0},accuracy asked for,1e-3,2e-4,4e-4,3\n"
        '{0},"material, order 5",0,1e-3,2e-3,1\n'
        '{0},"even, order 5",0,1e-2,2e-3,0.5\n'
    )

    def draw(self, script, text):
        table = self.folder / "table.csv"
        table.write_text(text)
        return scripts.run_script(PLOT, FIGURES / f"{script}.py", table, "-o", self.folder / "v.svg")

    def test_figures(self):
        both = self.FLUID_ROWS.format("fluid") + self.FLUID_ROWS.format("stokes")
        for script, text, words, never in (
            ("validation", self.CURVATURE + self.CURVATURE_ROWS, ("patch recovery, the default", "longest edge h", "h\u2074", "\u2207K"), []),
            ("work_precision", self.WORK + self.WORK_ROWS, ("k42 = 0", "prototype, tuned by hand", "asked: 1e-4", "asked: 1e-6"), []),
            # The factors' own time beside their bar; iterations of the factors that are kept longest.
            ("step_costs", self.STEPS + self.STEP_ROWS + self.THREAD_ROWS,
             ("some factors", "28 of 68", "k = 3, 320 triangles", "19", "rest of the step", "two threads"), []),
            ("step_costs", self.STEPS + self.STEP_ROWS, ["some factors"], ["two threads"]),
            ("work_precision_fluid", self.FLUID + both,
             ("fluid, with inertia", "Stokes flow", "material, order 5", "even, order 5", "requested accuracy"), []),
        ):  # fmt: skip
            with self.subTest(script):
                done = self.draw(script, text)
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.check_words(svg_texts(self.folder / "v.svg"), *words, never=never)

    def test_refusals(self):
        columns = "must have the columns"
        for script, text, words in (
            ("validation", "a,b\n1,2\n", columns),
            ("validation", self.CURVATURE + self.CURVATURE_ROW.format("patch", 0.1, "small"), columns),
            ("validation", self.CURVATURE + self.CURVATURE_ROW.format("patch", 0.1, 0), "positive numbers"),
            ("validation", self.CURVATURE, "has no rows"),
            ("work_precision", "a,b\n1,2\n", columns),
            ("work_precision", self.WORK + "x,1,2,3,fast\n", columns),
            ("work_precision", self.WORK + "x,1,2,3,-1\n", "negative or not finite"),
            ("work_precision", self.WORK, "has no rows"),
            ("step_costs", "a,b\n1,2\n", columns),
            ("step_costs", self.STEPS + self.STEP_ROWS.replace("70", "nan"), "negative or not finite"),
            ("step_costs", self.STEPS + self.STEP_ROWS.replace("solvers", "other"), "has no rows of solvers"),
            ("work_precision_fluid", "a,b\n1,2\n", columns),
            ("work_precision_fluid", self.FLUID + "fluid,reference,0,1e-5,fast,9\n", columns),
            ("work_precision_fluid", self.FLUID + "gas,reference,0,1e-5,1e-5,9\n", "has no reference, or no other run, of fluid"),
            ("work_precision_fluid", self.FLUID + self.FLUID_ROWS.format("fluid"), "has no reference, or no other run, of stokes"),
        ):
            with self.subTest(script=script, words=words):
                done = self.draw(script, text)
                self.assertEqual(done.returncode, 2)
                self.assertIn(words, done.stderr)

    def test_tables_are_read_coarse_first(self):
        table = self.folder / "table.csv"
        table.write_text(self.CURVATURE + self.CURVATURE_ROWS)
        read = validation.read_table(table)
        self.assertEqual(read[3, "patch", "H"], [(0.2, 2e-4), (0.1, 1e-4)])
        self.assertNotIn((3, "unknown", "H"), read)
        table.write_text(self.WORK + self.WORK_ROWS)
        self.assertEqual([row[0] for row in work_precision.read_table(table)["k42 = 0"]], [1e-4, 1e-6])

    def test_surface_has_the_area_of_the_papers_and_the_curvature_of_a_sphere(self):
        # 5.176926500756, and INT K = 4 pi: rings of the profile by the midpoint rule.
        angle = (np.arange(4000) + 0.5) * np.pi / 4000
        r, z, nr, nz, H, K = validation.profile(angle)
        area = 2 * np.pi * r * np.hypot(np.gradient(r, angle), np.gradient(z, angle)) * np.pi / 4000
        self.assertAlmostEqual(np.sum(area), 5.176926500756, delta=1e-4)
        self.assertAlmostEqual(np.sum(K * area), 4 * np.pi, delta=1e-3)
        self.assertTrue(np.all(H < -np.sqrt(np.maximum(4 * K, 0)) + 1e-9))  # outward normal; H^2 >= 4 K
        np.testing.assert_allclose(nr**2 + nz**2, 1, atol=1e-12)

    def test_only_runs_that_none_beats_are_drawn(self):
        runs = [SimpleNamespace(error=error, cpu_s=cpu) for error, cpu in ((1, 1), (2, 2), (0.5, 3), (0.6, 1.5))]
        self.assertEqual([(run.error, run.cpu_s) for run in work_precision_fluid.best(runs)], [(1, 1), (0.6, 1.5), (0.5, 3)])


class Command(InFolder):
    """`tubule plot` itself; in the suite only where the program is given."""

    def test_labels_and_formulas_come_through(self):
        files = [self.write(f"{i}.hdf", k42=k42) for i, k42 in enumerate((0.06, 0.12))]
        texts = self.drawn("--times", "0,0.2", *files, program=TUBULE)
        self.check_words(texts, "k\u2084\u2082 = 0.06", "k\u2084\u2082K\u00b2", "t\u2081 = 0.2")


def load_tests(loader, suite, pattern):
    if TUBULE:
        return suite
    cases = (Labels, Columns, Scales, Pictures, Curves, Refusals, FiguresOfDocs)
    return unittest.TestSuite(loader.loadTestsFromTestCase(case) for case in cases)


if __name__ == "__main__":
    if len(sys.argv) > 1 and not sys.argv[1].startswith("-") and Path(sys.argv[1]).is_file():
        TUBULE = sys.argv.pop(1)
    unittest.main()
