#!/usr/bin/python3
"""The pages of `tubule view`: what is packed into them, and, in a browser without a screen, what they draw.

    view_test.py TUBULE [--browser [--screenshots FOLDER]]    with a browser, which must be installed
"""

import base64
import html
import json
import random
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import matplotlib.image
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools/python/tubule"), str(ROOT / "tests/support")]
import scripts  # noqa: E402
from drawing import view  # noqa: E402

TUBULE = sys.argv[1]
SCREENSHOTS = Path(sys.argv[sys.argv.index("--screenshots") + 1]) if "--screenshots" in sys.argv else None
BROWSERS = ("chromium-headless-shell", "chromium")
TUBE = ["run", "cases/figure_k42_006.toml", "--set", "accuracy.energy=1e-3"]
CELL = ["run", "cases/capsule_stokes.toml"]
BRANCH = ["equilibrium", "cases/branch_prolate.toml", "--set", "equilibrium.branch.to=0.85"]
SURFACE = ["run", "cases/surface_rotating_tube.toml", "--set", "time.end=0.05", "--set", "accuracy.estimate=false"]
WAVES = ["run", "cases/surface_tube_modes.toml", "--set", "time.end=0.05", "--set", "time.output=[0.005,0.02]", "--set",
         "accuracy.estimate=false", "--set", "accuracy.energy=0.05", "--set", "discretisation.elements=120"]  # fmt: skip
SCAN = ["scan", "cases/figure_k42_006.toml", "--set", "accuracy.energy=1e-3", "--over", "energy.k42=0,0.1",
        "--over", "shape.mode.0.amplitude=0.1,0.2,0.45"]  # fmt: skip


def made(folder, command):
    """A result in the folder, and its page."""
    name = f"{command[0]}-{Path(command[1]).stem}"
    result, page = folder / f"{name}.hdf", folder / f"{name}.html"
    subprocess.run([TUBULE, *command, "--quiet", "-o", result], cwd=ROOT, check=True, capture_output=True)
    done = scripts.run_script(ROOT / "tools/python/tubule/drawing", "view", result, "-o", page)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{page}\n", ""), done
    return result, page


def data_of(page):
    return json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', page.read_text(), re.S)[1])


def unpacked(text, low, high):
    return low + (high - low) * np.frombuffer(base64.b64decode(text), "<u2") / 65535


class Folder(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))


class Pages(Folder):
    def test_hold_the_numbers_of_the_result_to_the_rounding_they_state(self):
        for command in (TUBE, CELL, BRANCH, SURFACE):
            result, page = made(self.folder, command)
            data = data_of(page)
            with h5py.File(result) as file:
                records = [file["frames"][name] for name in sorted(file["frames"])]
                self.assertEqual(len(data["frames"]), len(records))
                for frame, record in zip(data["frames"], records):
                    points = record["Points"][()].T if "Points" in record else (record["r"][()], record["z"][()])
                    for text, low, high, column in zip(frame["points"], data["low"], data["high"], points):
                        self.assertLessEqual(np.abs(unpacked(text, low, high) - column).max(), data["rounding"] * 1.001)
                    values = record["PointData"] if "Points" in record else record
                    for field in data["fields"]:
                        off = unpacked(frame["fields"][field["name"]], field["low"], field["high"]) - values[field["name"]][()]
                        self.assertLessEqual(np.abs(off).max(), (field["high"] - field["low"]) / 65535)
                np.testing.assert_array_equal(data["series"]["energy"], file["series/energy"][()])

    def test_need_no_network(self):
        for command in (TUBE, SCAN):
            page = made(self.folder, command)[1].read_text()
            self.assertNotRegex(page, r"""(src|href)\s*=\s*["']?(https?:)?//""")
            self.assertNotIn("@DATA@", page)
            self.assertNotIn("@SCRIPT@", page)

    def test_titles_are_text_and_no_mathematics(self):
        page = made(self.folder, [*TUBE, "--set", "about.title=$k$ & co", "--overwrite"])[1]
        self.assertEqual(data_of(page)["title"], "$k$ & co")
        self.assertIn("<title>$k$ &amp; co</title>", page.read_text())

    def test_titles_are_words_whatever_they_are(self):
        data = view.run_page(made(self.folder, TUBE)[0])
        rng, parts = random.Random(36), ["@DATA@", "@SCRIPT@", "@THREE@", "@TITLE@", "<!--", "<script>", "</script>", "-->", "\\u003c", "\\1", "&", "<"]
        for title in (*parts, "<!--<script>", *("".join(rng.choices(parts, k=rng.randint(2, 6))) for _ in range(20))):
            with self.subTest(title=title):
                page = view.page_of(data | {"title": title})
                inside = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S)[1]
                self.assertNotIn("<", inside)
                self.assertEqual(json.loads(inside)["title"], title)
                self.assertEqual(html.unescape(re.search("<title>(.*?)</title>", page, re.S)[1]), title)
                self.assertEqual(page.count("three.js authors"), 1 + Path(view.THREE).read_text().count("three.js authors"))

    def test_map_of_a_scan_names_the_command_of_a_point(self):
        result, page = made(self.folder, SCAN)
        data = data_of(page)
        with h5py.File(result) as file:
            np.testing.assert_array_equal(data["points"]["outcome"], file["points/outcome"][()].ravel())
        self.assertEqual(data["command"], ["tubule run figure_k42_006.toml", "--set accuracy.energy=1e-3"])
        self.assertEqual([axis["key"] for axis in data["axes"]], ["energy.k42", "shape.mode.0.amplitude"])

    def test_error_that_is_unknown_is_no_number(self):
        self.assertEqual(view.ending({"estimated_error": 1.0})["estimated_error"], "unknown")
        self.assertEqual(view.ending({"estimated_error": 2e-5})["estimated_error"], "2e-05 of E_ref")

    def test_triangles_between_nodes_cover_each_cell_once(self):
        corners = np.array([(0, 0), (1, 0), (0, 1)], float)
        for order in (1, 2, 3, 4):
            nodes = view.lattice(order) / order @ corners
            triangles = nodes[view.node_triangles(np.arange(len(nodes))[None], order)]
            (ax, ay), (bx, by) = (triangles[:, 1] - triangles[:, 0]).T, (triangles[:, 2] - triangles[:, 0]).T
            area = (ax * by - ay * bx) / 2
            np.testing.assert_allclose(area, 0.5 / order**2, rtol=1e-12)  # equal, with one orientation

    def test_hundred_frames_of_320_triangles_take_less_than_10_MB(self):
        result = self.folder / "many.hdf"
        subprocess.run([TUBULE, "run", "cases/surface_ellipsoid.toml", "--set", "discretisation.elements=320",
                        "--set", "discretisation.order=4", "--quiet", "-o", result], cwd=ROOT, check=True,
                       capture_output=True)  # fmt: skip
        shape = view.Shape(view.read_result(str(result)).surfaces[-1])
        self.assertGreaterEqual(len(shape.cells), 300)
        shape.u = np.random.default_rng(1).normal(size=shape.points.shape)  # as of a fluid
        shape.fields |= {name: shape.u[:, 0] for name in ("u_n", "p", "energy_density")}
        shapes = [shape] * 100
        size = len(json.dumps(view.packed_shapes(shapes, view.described_fields(shapes))))
        self.assertLess(size + Path(view.THREE).stat().st_size, 10e6)

    def test_bad_input(self):
        for arguments, words in ((["nowhere.hdf"], "nowhere.hdf"), ([__file__], "view_test.py")):
            done = subprocess.run([TUBULE, "view", *arguments], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2, done)
            self.assertIn(words, done.stderr)
        result, _ = made(self.folder, TUBE)
        before = result.read_bytes()
        drawing = ROOT / "tools/python/tubule/drawing"
        done = scripts.run_script(drawing, "view", result, "-o", result)
        self.assertEqual((done.returncode, result.read_bytes()), (2, before), done)
        self.assertIn("must end in .html", done.stderr)
        done = scripts.run_script(drawing, "view", result, "-o", "/nowhere/page.html")
        self.assertEqual(done.returncode, 2, done)
        self.assertIn("/nowhere/page.html: cannot be written", done.stderr)


class Browser(Folder):
    """What the pages draw: the page says what it has drawn, the picture has colours, the console has no error."""

    @staticmethod
    def opened(page, place, *arguments):
        browser = next(path for name in BROWSERS if (path := shutil.which(name)))
        command = [browser, "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
                   "--enable-unsafe-swiftshader", "--window-size=1200,700", "--enable-logging=stderr",
                   "--virtual-time-budget=3000", *arguments, page.as_uri() + place]  # fmt: skip
        return subprocess.run(command, capture_output=True, text=True, timeout=120)

    def drawn(self, page, name, place=""):
        """What the page says that it has drawn, and the part of its left half that is not white or grey."""
        done = self.opened(page, place, "--dump-dom")
        self.assertNotIn("CONSOLE", done.stderr)
        picture = page.with_suffix(".png")
        self.opened(page, place, f"--screenshot={picture}")
        pixels = matplotlib.image.imread(picture)[:, :700, :3]
        if SCREENSHOTS:
            shutil.copyfile(picture, SCREENSHOTS / f"view_{name}.png")
        return re.search(r'data-drawn="([^"]*)"', done.stdout)[1], float((np.ptp(pixels, axis=2) > 0.1).mean())

    def test_shapes(self):
        for name, command, begin in (("tube", TUBE, 2), ("cell", CELL, 2), ("branch", BRANCH, ""), ("surface", WAVES, 1)):
            page = made(self.folder, command)[1]
            frames = len(data_of(page)["frames"])
            words, part = self.drawn(page, name, f"#{begin}")
            self.assertRegex(words, rf"^frame {begin or frames} of {frames}, \d{{4,}} triangles, H$")
            self.assertGreater(part, 0.05, command)

    def test_map(self):
        words, part = self.drawn(made(self.folder, SCAN)[1], "scan")
        self.assertEqual(words, "map of 2 x 3, outcome")
        self.assertGreater(part, 0.1)


if __name__ == "__main__":
    only = "Browser" if "--browser" in sys.argv else "Pages"
    unittest.main(argv=[sys.argv[0], only])
