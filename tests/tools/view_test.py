#!/usr/bin/python3
"""The pages of `tubule view`: what is packed into them, and, in a browser without a screen, what they draw in use.

    view_test.py TUBULE [--browser [--screenshots FOLDER]]    with a browser, which must be installed
"""

import base64
import functools
import html
import io
import json
import random
import re
import subprocess
import sys
import tempfile
import time
import unittest
from operator import attrgetter
from pathlib import Path

import h5py
import matplotlib.image
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools/python/tubule"), str(ROOT / "tests/support")]
import scripts  # noqa: E402
from browser import Browser as Program  # noqa: E402
from drawing import results, scan, surfaces, tubes, view  # noqa: E402

TUBULE = sys.argv[1]
SCREENSHOTS = Path(sys.argv[sys.argv.index("--screenshots") + 1]) if "--screenshots" in sys.argv else None
TUBE = ["run", "cases/figure_k42_006.toml", "--set", "accuracy.energy=1e-3"]
CELL = ["run", "cases/capsule_stokes.toml"]
BRANCH = ["equilibrium", "cases/branch_prolate.toml", "--set", "equilibrium.branch.to=0.85"]
SURFACE = ["run", "cases/surface_rotating_tube.toml", "--set", "time.end=0.05", "--set", "accuracy.estimate=false"]
WAVES = ["run", "cases/surface_tube_modes.toml", "--set", "time.end=0.05", "--set", "time.output=[0.005,0.02]", "--set",
         "accuracy.estimate=false", "--set", "accuracy.energy=0.05", "--set", "discretisation.elements=120"]  # fmt: skip
SCAN = ["scan", "cases/figure_k42_006.toml", "--set", "accuracy.energy=1e-3", "--over", "energy.k42=0,0.1",
        "--over", "shape.mode.0.amplitude=0.1,0.2,0.45"]  # fmt: skip

CURVES = ["scan", "cases/vesicle.toml", "--over", 'equilibrium.family="prolate","oblate"',
          "--over", "equilibrium.reduced_volume=0.6,0.7"]  # fmt: skip
FAMILIES = [*CURVES, "--over", "energy.H0=-0.1,0"]
VESICLES = [*CURVES[:4], "--over", "equilibrium.reduced_volume=0.55:0.9:8", "--over", "energy.H0=-1:1:3"]
NEUTRAL = ["scan", "cases/tube_swells.toml", "--set", "energy.H0=-1", "--set", "energy.k42=0.1", "--set",
           "shape.length=6", "--set", "time.end=20", "--set", "accuracy.energy=1e-2",
           "--over", "model.tension=-0.4,-0.1", "--over", "model.pressure=-0.5,0"]  # fmt: skip
KEPT = tempfile.TemporaryDirectory()


def made(command):
    """A result and its page, made once."""
    return made_once(tuple(command))


@functools.cache
def made_once(command):
    folder = Path(tempfile.mkdtemp(dir=KEPT.name))
    result, page = (folder / f"{Path(command[1]).stem}.{ending}" for ending in ("hdf", "html"))
    subprocess.run([TUBULE, *command, "--quiet", "-o", result], cwd=ROOT, check=True, capture_output=True)
    done = scripts.run_script(ROOT / "tools/python/tubule/drawing", "view", result, "-o", page)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{page}\n", ""), done
    return result, page


def data_of(page):
    return json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', page.read_text(), re.S)[1])


def unpacked(text, low, high):
    return low + (high - low) * np.frombuffer(base64.b64decode(text), "<u2") / 65535


class Pages(unittest.TestCase):
    def test_hold_the_numbers_of_the_result_to_the_rounding_they_state(self):
        for command in (TUBE, CELL, BRANCH, SURFACE):
            result, page = made(command)
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
                        name, low, high = field["name"], field["low"], field["high"]
                        off = unpacked(frame["fields"][name], low, high) - values[name][()]
                        self.assertLessEqual(np.abs(off).max(), (high - low) / 65535)
                np.testing.assert_array_equal(data["series"]["energy"], file["series/energy"][()])

    def test_need_no_network(self):
        for command in (TUBE, SCAN):
            page = made(command)[1].read_text()
            self.assertNotRegex(page, r"""(src|href)\s*=\s*["']?(https?:)?//""")
            self.assertNotIn("@DATA@", page)
            self.assertNotIn("@SCRIPT@", page)

    def test_titles_are_text_and_no_mathematics(self):
        page = made([*TUBE, "--set", "about.title=$k$ & co"])[1]
        self.assertEqual(data_of(page)["title"], "$k$ & co")
        self.assertIn("<title>$k$ &amp; co</title>", page.read_text())

    def test_titles_are_words_whatever_they_are(self):
        data = view.run_page(results.read_result(str(made(TUBE)[0])))
        parts = ["@DATA@", "@SCRIPT@", "@TITLE@", "<!--", "<script>", "</script>", "-->", "\\u003c", "\\1", "&", "<"]
        rng = random.Random(36)
        for title in (*parts, "<!--<script>", *("".join(rng.choices(parts, k=rng.randint(2, 6))) for _ in range(20))):
            with self.subTest(title=title):
                page = view.page_of(data | {"title": title})
                inside = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S)[1]
                self.assertNotIn("<", inside)
                self.assertEqual(json.loads(inside)["title"], title)
                self.assertEqual(html.unescape(re.search("<title>(.*?)</title>", page, re.S)[1]), title)

    def test_map_of_a_scan_names_the_command_of_a_point(self):
        result, page = made(SCAN)
        data = data_of(page)
        with h5py.File(result) as file:
            np.testing.assert_array_equal(data["slices"][""]["points"]["outcome"], file["points/outcome"][()].ravel())
        self.assertEqual(data["command"], ["tubule run figure_k42_006.toml", "--set accuracy.energy=1e-3"])
        self.assertEqual([axis["key"] for axis in data["axes"]], ["energy.k42", "shape.mode.0.amplitude"])

    def test_error_that_is_unknown_is_no_number(self):
        self.assertEqual(view.ending({"estimated_error": 1.0})[0]["estimated_error"], "unknown")
        self.assertEqual(view.ending({"estimated_error": 2e-5})[0]["estimated_error"], "2e-05 of E_ref")

    def test_warnings_are_a_list(self):
        self.assertEqual(view.ending({"warnings": "one\ntwo"})[1], ["one", "two"])
        self.assertEqual(view.ending({"warnings": ""})[1], [])

    def test_colours_are_those_of_print(self):
        for command in (TUBE, SURFACE):
            result = results.read_result(str(made(command)[0]))
            if result.surfaces:
                columns = tubes.choose_columns([result], None, attrgetter("surfaces"))
                panel = surfaces.SurfacePanel([result], [[""]], columns, ["H", "K"])
                printed = list(panel.quantities.values())
            else:
                printed = tubes.TubePanel([result], [[""]], tubes.choose_columns([result]), ["H", "K"]).colours
            shown = {field["name"]: field for field in data_of(made(command)[1])["fields"]}
            for name, colours in zip("HK", printed):
                self.assertEqual(shown[name]["shown"], [colours.norm.vmin, colours.norm.vmax])
                self.assertEqual(shown[name]["colours"], view.colour_table(colours.map))
            middle = np.frombuffer(base64.b64decode(shown["H"]["colours"]), "u1").reshape(256, 3)[127:129]
            self.assertGreater(middle.min(), 240)  # white

    def test_map_of_equilibria_has_the_lines_of_print(self):
        result, page = made(FAMILIES)
        data, found = data_of(page), scan.Scan(str(result))
        self.assertEqual([axis["key"] for axis in data["axes"]], ["equilibrium.reduced_volume", "energy.H0"])
        self.assertEqual(list(data["slices"]), ["0", "1", "2"])  # of least energy, from prolates, from oblates
        least = data["slices"]["0"]
        best = found.best_starts()[0]
        self.assertEqual(least["starts"], best.ravel().tolist())
        for start, slice_ in enumerate(("1", "2")):
            energy = np.array(data["slices"][slice_]["points"]["free_energy"], float)
            np.testing.assert_array_equal(energy, found.points["free_energy"][start].ravel())
        lines = {line["label"]: line["ways"] for line in least["lines"]}
        self.assertIn("equal energies", lines)
        ends = {tuple(place) for way in lines["equal energies"] for place in way}
        crossings = {float(value) for value, lowest in zip(found.equal["value"], found.equal["lowest"]) if lowest}
        self.assertTrue(crossings <= {number for place in ends for number in place}, (crossings, ends))

    def test_map_has_the_lines_of_closed_forms(self):
        result, page = made(NEUTRAL)
        ((label, first, second, height),) = scan.Scan(str(result)).thresholds
        data = data_of(page)
        (line,) = (line for line in data["slices"][""]["lines"] if line["label"] == label)
        for a, b in np.concatenate(line["ways"]):  # on the sides of cells, where the form is 0 between their corners
            i, j = np.searchsorted(first, a, "right") - 1, np.searchsorted(second, b, "right") - 1
            i, j = min(i, len(first) - 2), min(j, len(second) - 2)
            s, t = (a - first[i]) / (first[i + 1] - first[i]), (b - second[j]) / (second[j + 1] - second[j])
            self.assertAlmostEqual(np.array([1 - s, s]) @ height[i : i + 2, j : j + 2] @ np.array([1 - t, t]), 0, 9)

    def test_curves_of_equilibria_are_those_of_all_families(self):
        result, page = made(CURVES)
        data, found = data_of(page), scan.Scan(str(result))
        self.assertEqual([axis["key"] for axis in data["axes"]], ["equilibrium.reduced_volume"])
        for start in (0, 1):
            points = data["slices"][str(start + 1)]["points"]
            np.testing.assert_array_equal(points["energy"], found.points["energy"][start])
        values = [value for value, lowest in data["slices"]["0"]["equal"] if lowest]
        self.assertEqual(len(values), 1)
        self.assertTrue(0.64 < values[0] < 0.66, values)  # prolates above, oblates below

    def test_triangles_between_nodes_cover_each_cell_once(self):
        corners = np.array([(0, 0), (1, 0), (0, 1)], float)
        for order in (1, 2, 3, 4):
            nodes = view.lattice(order) / order @ corners
            triangles = nodes[view.node_triangles(np.arange(len(nodes))[None], order)]
            (ax, ay), (bx, by) = (triangles[:, 1] - triangles[:, 0]).T, (triangles[:, 2] - triangles[:, 0]).T
            area = (ax * by - ay * bx) / 2
            np.testing.assert_allclose(area, 0.5 / order**2, rtol=1e-12)  # equal, with one orientation

    def test_hundred_frames_of_320_triangles_take_less_than_10_MB(self):
        result = Path(KEPT.name) / "many.hdf"
        subprocess.run([TUBULE, "run", "cases/surface_ellipsoid.toml", "--set", "discretisation.elements=320",
                        "--set", "discretisation.order=4", "--quiet", "-o", result], cwd=ROOT, check=True,
                       capture_output=True)  # fmt: skip
        read = results.read_result(str(result))
        shape = view.Shape(read.surfaces[-1])
        self.assertGreaterEqual(len(shape.cells), 300)
        shape.u = np.random.default_rng(1).normal(size=shape.points.shape)  # as of a fluid
        shape.fields |= {name: shape.u[:, 0] for name in ("u_n", "energy_density", "mode_1")}
        shapes = [shape] * 100
        fields = view.described_fields(shapes, read, read.surfaces)
        self.assertLess(len(json.dumps(view.packed_shapes(shapes, fields))), 10e6)

    def test_bad_input(self):
        drawing = ROOT / "tools/python/tubule/drawing"
        done = subprocess.run([TUBULE, "view", "nowhere.hdf"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 2, done)
        self.assertIn("nowhere.hdf", done.stderr)
        done = scripts.run_script(drawing, "view", __file__)
        self.assertEqual(done.returncode, 2, done)
        self.assertIn("view_test.py", done.stderr)
        result, _ = made(TUBE)
        before = result.read_bytes()
        done = scripts.run_script(drawing, "view", result, "-o", result)
        self.assertEqual((done.returncode, result.read_bytes()), (2, before), done)
        self.assertIn("must end in .html", done.stderr)
        done = scripts.run_script(drawing, "view", result, "-o", "/nowhere/page.html")
        self.assertEqual(done.returncode, 2, done)
        self.assertIn("/nowhere/page.html: cannot be written", done.stderr)


def fresh(page, **changes):
    """The page with other data."""
    other = page.with_name(f"{page.stem}_{'_'.join(changes)}.html")
    other.write_text(view.page_of(data_of(page) | changes))
    return other


class Browser(unittest.TestCase):
    """The pages in use: they say what they have drawn, pictures are those of the shapes, the console has no error."""

    @classmethod
    def setUpClass(cls):
        cls.downloads = Path(KEPT.name) / "downloads"
        cls.browser = cls.enterClassContext(Program(cls.downloads))

    def tearDown(self):
        errors = list(self.browser.errors)
        self.browser.errors.clear()
        self.assertEqual(errors, [])

    def open(self, command, place="", **screen):
        page = command if isinstance(command, Path) else made(command)[1]
        self.browser.open(page.as_uri() + place, **screen)
        return data_of(page)

    def drawn(self):
        return self.browser.value("document.body.dataset.drawn")

    def picture(self):
        """[rows, columns, 3] of the screen."""
        return matplotlib.image.imread(io.BytesIO(self.browser.screenshot()))[..., :3]

    def body(self):
        """The part of the screen with the surface, without the words above and below it."""
        left, top, width, height = self.browser.box("#body")
        return self.picture()[int(top) + 30 : int(top + height) - 66, int(left) : int(left + width)]

    def saved(self, name):
        """The picture that a click on a button saves."""
        before = set(self.downloads.glob("*.png"))
        self.browser.click(*self.browser.middle(name))
        end = time.monotonic() + 20
        while not (new := set(self.downloads.glob("*.png")) - before):
            self.assertLess(time.monotonic(), end, f"{name} saved nothing")
            time.sleep(0.05)
        return new.pop()

    def test_shapes(self):
        pages = ("tube", TUBE, 2), ("cell", CELL, 2), ("branch", BRANCH, ""), ("surface", WAVES, 1)
        for name, command, begin in pages:
            data = self.open(command, f"#{begin}")
            self.assertRegex(self.drawn(), rf"^frame {begin or 1} of {len(data['frames'])}, \d{{4,}} triangles, H$")
            self.assertGreater((np.ptp(self.body(), axis=2) > 0.1).mean(), 0.05, command)
            if SCREENSHOTS:
                (SCREENSHOTS / f"view_{name}.png").write_bytes(self.browser.screenshot())

    def test_first_frame_is_first_and_others_are_chosen_by_slider_chart_and_play(self):
        data, browser = self.open(CELL), self.browser
        last = len(data["frames"])
        self.assertTrue(self.drawn().startswith("frame 1 of"))
        left, top, width, height = browser.box("#time")
        browser.click(left + width - 4, top + height / 2)
        self.assertTrue(self.drawn().startswith(f"frame {last} of"))
        x, y = browser.middle("#plot")
        browser.drag((x, y), (x - 0.4 * width, y))
        self.assertFalse(self.drawn().startswith(f"frame {last} of"))
        browser.move(x, y)
        near = browser.value("document.querySelector('#plot').dataset.near")
        word, when, _, value = re.fullmatch(r"(\w+) (\S+), (\w+) (\S+)", near).groups()
        times = np.array(data["series"]["time"])
        self.assertAlmostEqual(float(value), data["series"]["energy"][np.abs(times - float(when)).argmin()], 5)
        self.assertEqual(word, "time")
        shown = self.drawn()
        browser.click(*browser.middle("#play"))
        browser.wait(f"document.body.dataset.drawn !== '{shown}'")
        browser.click(*browser.middle("#play"))
        self.assertEqual(browser.text("#play"), "play")

    def test_scale_bar_and_colours_are_those_of_the_surface(self):
        data, browser = self.open(CELL), self.browser
        length, pixels = map(float, browser.value("document.querySelector('#over').dataset.bar").split())
        body = self.body()
        columns = np.flatnonzero((body.min(axis=2) < 0.97).any(axis=0))
        frame = data["frames"][0]
        r, z = (unpacked(text, low, high) for text, low, high in zip(frame["points"], data["low"], data["high"]))
        self.assertAlmostEqual(np.ptp(columns) + 1, 2 * r.max() * pixels / length, delta=2.5)  # the axis is upright
        x, y = browser.middle("#body")
        y += 170  # on the lower cap
        browser.move(x, y)
        found = re.fullmatch(r"H = (\S+)\nr = (\S+), z = (\S+)", browser.text("#tip"))
        value, radius, height = map(float, found.groups())
        field = data["fields"][0]
        H = unpacked(frame["fields"]["H"], field["low"], field["high"])
        near = np.hypot(r - radius, z - height).argmin()
        self.assertLess(np.hypot(r - radius, z - height)[near], 0.02)
        self.assertAlmostEqual(value, H[near], delta=0.02 * (field["shown"][1] - field["shown"][0]))
        low, high = field["shown"]
        table = np.frombuffer(base64.b64decode(field["colours"]), "u1").reshape(256, 3)
        table = table[int(np.clip(256 * (value - low) / (high - low), 0, 255))]
        browser.move(1, 1)  # no tip
        pixel = self.picture()[int(y), int(x)]
        self.assertGreater(np.ptp(table), 100)
        np.testing.assert_allclose(pixel / pixel.sum(), table / table.sum(), atol=0.03)

    def test_turning_moving_zooming_and_back(self):
        data, browser = self.open(SURFACE), self.browser
        before, (x, y) = self.body(), browser.middle("#body")
        acts = (
            lambda: browser.drag((x, y), (x + 60, y + 40)),
            lambda: browser.mouse("Wheel", x, y, deltaX=0, deltaY=-400),
            lambda: browser.touch([(x - 30, y), (x + 30, y)], [(x - 60, y + 20), (x + 60, y + 20)]),
        )
        for act in acts:
            act()
            self.assertGreater(np.abs(self.body() - before).max(), 0.1)
            browser.click(*browser.middle("#reset"))
            np.testing.assert_array_equal(self.body(), before)
        self.assertTrue(data["frames"][0]["period"])

    def test_pictures_are_saved(self):
        self.open(TUBE, "#2")
        for name, ending in (("#save", "frame_2.png"), ("#save_chart", "energy.png")):
            path = self.saved(name)
            self.assertTrue(path.name.endswith(ending), path)
            pixels = matplotlib.image.imread(path)[..., :3]
            self.assertGreater((np.ptp(pixels, axis=2) > 0.1).mean(), 0.002)
            self.assertGreater(pixels.shape[1], 300)
        self.open(FAMILIES)
        self.assertTrue(self.saved("#save").name.endswith("outcome.png"))

    def test_small_screen(self):
        for command in (TUBE, BRANCH, SCAN, FAMILIES):
            self.open(command, width=390, height=844, touch=True)
            self.assertLessEqual(self.browser.value("document.documentElement.scrollWidth"), 390)
        self.open(TUBE, width=390, height=844, touch=True)
        before, (x, y) = self.body(), self.browser.middle("#body")
        self.browser.touch([(x, y)], [(x + 30, y + 60)])  # turns, and the page stays where it is
        self.assertEqual(self.browser.value("window.scrollY"), 0)
        self.assertGreater(np.abs(self.body() - before).max(), 0.1)

    def test_warnings_and_a_browser_without_webgl(self):
        page = fresh(made(TUBE)[1], warnings=["one", "<b>two</b>"])
        self.open(page)
        listed = self.browser.value("[...document.querySelectorAll('#warnings li')].map(x => x.textContent)")
        self.assertEqual(listed, ["one", "<b>two</b>"])
        none = """const c = HTMLCanvasElement.prototype, f = c.getContext;
            c.getContext = function(kind) { return kind === 'webgl2' ? null : f.call(this, kind); };"""
        blocked = self.browser("Page.addScriptToEvaluateOnNewDocument", source=none)
        self.open(TUBE)
        self.browser("Page.removeScriptToEvaluateOnNewDocument", **blocked)
        self.assertIn("no WebGL 2", self.browser.text(".missing"))
        self.assertTrue(self.drawn())

    def test_map(self):
        data, browser = self.open(SCAN), self.browser
        self.assertEqual(self.drawn(), "map of 2 x 3, outcome")
        self.assertGreater((np.ptp(self.picture()[:, :700], axis=2) > 0.1).mean(), 0.1)
        x, y = browser.middle("#map")
        browser.click(x + 100, y - 200)
        words = browser.text("#now")
        self.assertIn("--set energy.k42=0.1 --set shape.mode.0.amplitude=0.45", words)
        self.assertIn(f"outcome: {data['names']['outcome'][int(data['slices']['']['points']['outcome'][5])]}\n", words)
        browser.move(x - 100, y + 200)  # the point is kept
        self.assertEqual(browser.text("#now"), words)

    def test_families_of_equilibria(self):
        self.open(VESICLES)
        self.assertIn('from "oblate": oblate', self.browser.text("#now"))
        x, y = self.browser.middle("#map")
        self.browser.click(x, y + 60)
        if SCREENSHOTS:
            (SCREENSHOTS / "view_scan.png").write_bytes(self.browser.screenshot())
        before = self.picture()
        change = "s.value = 2; s.dispatchEvent(new Event('change'));"
        self.browser.value(f"(s => {{ {change} }})(document.querySelectorAll('select')[1])")
        self.assertGreater(np.abs(self.picture() - before).max(), 0.1)
        self.assertIn("--set 'equilibrium.family=\"oblate\"'", self.browser.text("#now"))
        self.open(CURVES)
        self.assertEqual(self.drawn(), "map of 2 x 1, outcome")


if __name__ == "__main__":
    only = "Browser" if "--browser" in sys.argv else "Pages"
    unittest.main(argv=[sys.argv[0], only])
