#!/usr/bin/python3
"""Pictures of moving surfaces: the numbers that are drawn, on shapes and flows known exactly, and whole pages.

    plot_motion_test.py TUBULE
"""

import subprocess
import sys
import unittest

import h5py
import numpy as np
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from plot_surface_test import octasphere
from plot_test import PACKAGE, InFolder, replaced, resolved

from drawing import cuts, flow, raster, results, series, style, surfaces  # found by way of plot_test
from drawing.tubes import Column

NOTHING = results.Result("a.hdf", {}, {}, {}, [], [])

TUBULE = None
OMEGA = np.array([0.0, 0.0, 3.0])


def refined_sphere(order, halvings=2):
    """Nodes [8 * 4^halvings cells, n, 3] on the unit sphere."""
    flat = octasphere(1)
    for _ in range(halvings):
        a, b, c = (flat[:, i] for i in range(3))
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        flat = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    nodes = raster.lattice(order) / order @ flat
    return nodes / np.linalg.norm(nodes, axis=-1, keepdims=True)


def moving_sphere(time, radius=1.0):
    """Turns about z and grows at the poles, twice as fast at time 2 as at 1: u = t (OMEGA x X/R + 2 z^2/R^2 n)."""
    n = refined_sphere(4)
    u_n = 2 * time * n[..., 2] ** 2
    data = {"H": np.full(u_n.shape, -2 / radius), "K": np.full(u_n.shape, radius**-2.0), "u_n": u_n}
    u = time * np.cross(OMEGA, n) + u_n[..., None] * n
    return results.Surface(float(time), 4, True, radius * n, n, **data, u=u, p=5 + n[..., 0])


def write(path, times=(0, 1, 2), pressure=True, sets=()):
    """A result with moving_sphere() as its frames; energy 10 + exp(-t), dissipation exp(-t), defect 1e-3 t (t - 1)."""
    with h5py.File(path, "w") as file:
        text = h5py.string_dtype()
        file["case"] = ""
        case = resolved('tier = "surface3d"\n[about]\ntitle = "A sphere"\n', ['model.kind="fluid"', *sets])
        file.create_dataset("resolved_case", data=case, dtype=text)
        file.create_group("about").attrs["stop"] = "finished"
        t = np.concatenate([[0], np.geomspace(1e-3, times[-1], 50)])
        rows = {"time": t, "energy": 10 + np.exp(-t), "energy_20": 10 + np.exp(-t), "dissipation": np.exp(-t)}
        rows |= {"identity_defect": 1e-3 * t * (t - 1), "kinetic_energy": t**2, "energy_error": 0 * t}
        for name, values in rows.items():
            file[f"series/{name}"] = values
            file[f"series/{name}"].attrs["meaning"] = f"what {name} is"
        mesh = file.create_group("meshes/000000")
        mesh.attrs["order"], mesh.attrs["period"] = 4, 0.0
        for i, time in enumerate(times):
            surface = moving_sphere(time)
            frame = file.create_group(f"frames/{i:06d}")
            frame.attrs["time"], frame.attrs["mesh"] = float(time), 0
            frame["Points"] = surface.points.reshape(-1, 3)
            frame["Connectivity"] = np.arange(surface.H.size)  # every cell has points of its own
            for name in ("H", "K", "u_n", "normal", "u") + ("p",) * pressure:
                values = getattr(surface, name)
                frame[f"PointData/{name}"] = values.reshape(-1, 3) if values.ndim == 3 else values.ravel()
    return path


def length(segments):
    return np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()


class Cuts(unittest.TestCase):
    def test_of_a_sphere_is_a_circle(self):
        # How far the elements are off the sphere: measured at the cuts 3.1e-3 and 5.8e-5; their lengths 1e-3, 1.3e-5.
        for order, accuracy in ((2, 4e-3), (4, 1e-4)):
            nodes = refined_sphere(order)
            surface = results.Surface(0.0, order, True, nodes, nodes, nodes[..., 0], nodes[..., 0])
            for axis, level in ((2, 0.0), (1, 0.0), (0, -0.6), (2, 0.37)):
                found = cuts.cut(surface, axis, level)
                np.testing.assert_allclose(found[..., axis], level, atol=1e-13)
                self.assertLess(np.abs(np.linalg.norm(found, axis=-1) - 1).max(), accuracy)
                self.assertAlmostEqual(length(found) / (2 * np.pi * np.sqrt(1 - level**2)), 1, delta=accuracy / 3)

    def test_lies_on_the_curved_triangles(self):
        # z = x^2 + y^2 over two flat triangles is a quadratic: its cut z = 1/4 a circle of radius 1/2, exactly.
        flat = np.array([[(-1, -1, 0), (1, -1, 0), (1, 1, 0)], [(-1, -1, 0), (1, 1, 0), (-1, 1, 0)]], float)
        for order in (2, 3, 4):
            nodes = raster.lattice(order) / order @ flat
            nodes[..., 2] = nodes[..., 0] ** 2 + nodes[..., 1] ** 2
            found = cuts.cut(results.Surface(0.0, order, False, nodes, nodes, nodes, nodes), 2, 0.25)
            np.testing.assert_allclose(np.hypot(found[..., 0], found[..., 1]), 0.5, atol=1e-12)
            self.assertAlmostEqual(length(found), np.pi, delta=1e-3)

    def test_that_misses_is_empty(self):
        self.assertEqual(cuts.cut(moving_sphere(0), 2, 1.5).shape, (0, 2, 3))

    def test_drawn_in_their_plane_to_scale(self):
        shapes = [moving_sphere(0, 1.0), moving_sphere(1, 0.5)]
        columns = [Column(s.time, [s], [None]) for s in shapes]
        panel = cuts.CutPanel([NOTHING], [["a"]], columns, ("y", 0.0))
        figure = Figure(figsize=(style.WIDTH, panel.height))
        panel.draw(figure, 0.0)
        (axes,) = figure.axes
        self.assertEqual((axes.get_xlabel(), axes.get_ylabel()), ("x", "z"))
        for lines, radius in zip(axes.collections, (1.0, 0.5)):
            points = np.array(lines.get_segments())
            self.assertAlmostEqual(length(points), 2 * np.pi * radius, delta=1e-3)
        ends = axes.transData.transform([(0, 0), (1, 0), (0, 1)])
        self.assertAlmostEqual(ends[1][0] - ends[0][0], ends[2][1] - ends[0][1], places=6)
        self.assertNotEqual(*(to_hex(lines.get_colors()[0]) for lines in axes.collections))

    def test_none_met_is_refused(self):
        with self.assertRaisesRegex(results.BadInput, "z = 2 meets none"):
            cuts.CutPanel([NOTHING], [["a"]], [Column(0.0, [moving_sphere(0)], [None])], ("z", 2.0))
        in_nm = results.Result("a.hdf", {}, {}, {}, [], [], units={"length": {"scale": 50.0, "unit": "nm"}})
        with self.assertRaisesRegex(results.BadInput, "z = 100 nm meets none"):  # asked for is z = 2 of the file
            cuts.CutPanel([in_nm], [["a"]], [Column(0.0, [moving_sphere(0)], [None])], ("z", 2.0))


class Arrows(unittest.TestCase):
    def setUp(self):
        self.surface, self.view = moving_sphere(1), raster.View()
        s = self.surface
        fields = np.concatenate([s.u @ self.view.axes, s.points], axis=-1)
        self.samples = raster.sample(s.points, s.normal, fields, 4, True, self.view, (-1.1, 1.1), 200, 440, 440)

    def test_are_the_tangential_flow_where_they_stand(self):
        places, along = flow.surface_arrows(self.samples, self.samples.values[:, :3], 40)
        normal, x = self.samples.normal[places], self.samples.values[places, 3:]
        np.testing.assert_allclose((along * normal).sum(axis=1), 0, atol=1e-13)
        exact = np.cross(OMEGA, x) @ self.view.axes  # of u the rotation alone is tangential
        # Linear between the corners of pieces 6 samples of 200 long: (6/200)^2 / 8 of |u|, at the rim 1/STEEPEST as far.
        np.testing.assert_allclose(along, exact, atol=3 * 3e-3)
        self.assertGreater(np.linalg.norm(along, axis=1).max(), 2)

    def test_stand_evenly_on_what_faces_the_eye(self):
        places, _ = flow.surface_arrows(self.samples, self.samples.values[:, :3], 40)
        row, column = np.divmod(places, 440)
        r = np.hypot(column - 219.5, row - 219.5) / 200
        # The normal turns STEEPEST away from the eye at this distance from the middle of the disc.
        self.assertLess(r.max(), np.sqrt(1 - flow.STEEPEST**2) + 0.02)
        # One a cell of the hexagonal lattice: 40 x 40 sqrt(3/4), give or take the rim.
        self.assertAlmostEqual(len(places), np.pi * (200**2 * (1 - flow.STEEPEST**2)) / (40 * 35), delta=12)
        distance = np.hypot(row[:, None] - row, column[:, None] - column) + 1e9 * np.eye(len(row))
        self.assertGreater(distance.min(), 39)

    def test_lengths_are_relative_to_the_largest_of_the_shape(self):
        motion = flow.Motion([self.surface])
        self.assertAlmostEqual(motion.largest("u_t", self.surface), 3)  # |OMEGA| at the equator, where there are nodes
        self.assertAlmostEqual(motion.largest("u_n", self.surface), 2)
        figure = Figure(figsize=(2, 2))
        axes = figure.add_axes([0, 0, 1, 1])
        flow.draw_surface_arrows(axes, self.samples, self.samples.values[:, :3], 3.0, 0.0, 2.0, 220)
        arrows = [patch for patch in axes.patches if isinstance(patch, FancyArrowPatch)]
        ends = np.array([arrow._posA_posB for arrow in arrows])
        sizes = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        self.assertGreater(sizes.min(), flow.SHORTEST_ARROW - 1e-12)
        self.assertAlmostEqual(sizes.max(), flow.LONGEST_ARROW, delta=0.01)  # at the equator in the middle
        middle = ends.mean(axis=1)
        self.assertLess(np.hypot(*(middle - 1).T).max(), 200 / 220)  # on the disc, which is 200 samples in radius
        # Turns to the left seen from above: in front everything goes to the right.
        self.assertTrue((ends[:, 1, 0] > ends[:, 0, 0])[middle[:, 1] < 1].all())


class Colours(unittest.TestCase):
    def test_normal_velocity_relative_to_its_largest(self):
        shapes = [moving_sphere(t) for t in (0, 1, 2)]
        result = results.Result("a.hdf", {}, {}, {}, [], shapes)
        ((_, scale),) = surfaces.quantities(["u_n"], [result], shapes, "shape")
        motion = flow.Motion(shapes)
        for shape, largest in zip(shapes, (0, 1, 1)):
            self.assertEqual(np.abs(motion.relative(shape)).max(), largest)
        red, blue, white = scale.rgb(np.array([1.0, -1.0, 0.0]))
        self.assertGreater(red[0], 2 * red[2])  # outward is red, as in the paper
        self.assertGreater(blue[2], 2 * blue[0])
        self.assertGreater(white.min(), 0.95)

    def test_pressure_is_white_at_its_mean(self):
        shape = moving_sphere(1)  # p = 5 + x
        ((_, scale),) = surfaces.quantities(["p"], [results.Result("a.hdf", {}, {}, {}, [], [shape])], [shape], "shape")
        norm = scale.norm
        self.assertAlmostEqual((norm.vmin + norm.vmax) / 2, 5, delta=1e-9)
        self.assertTrue(0.9 < (norm.vmax - norm.vmin) / 2 < 1.3)  # |x| <= 1, times MARGIN at most

    def test_a_normal_motion_has_no_arrows(self):
        shape = moving_sphere(1)
        shape.u = shape.u_n[..., None] * shape.normal + 1e-6
        self.assertEqual(flow.Motion([shape]).largest("u_t", shape), 0)


class Pages(InFolder):
    def test_of_moving_surfaces(self):
        file = write(self.folder / "a.hdf")
        others = [write(self.folder / f"{k}.hdf", sets=[f"energy.k42={k}"]) for k in (0, 1)]
        bars = ("mean curvature H = \u03ba\u2081 + \u03ba\u2082", "Gaussian curvature K", "pressure p, white: mean \u2248 5")
        for arguments, words, never in (
            ((file, "--colour", "u_n"), ("(d)", "at rest", "|u\u2099| \u2264 2", "|u\u209c| \u2264 3", "|u\u209c| \u2264 6", "cut z = 0", "t\u2082 = 2",
                      "what dissipation is", "what identity_defect is", "what kinetic_energy is", "normal velocity..."),
             ("what energy_error is", "curvature")),  # all of the error is zero
            ((file, "--kind", "surface", "--colour", "H,K,p", "--times", "0,2"), (*bars, "t\u2081 = 2"), ("velocity", "|u")),
            ((file, "--kind", "surface", "--times", "1", "--camera", "0,90"), ["t\u2080 = 1", "mean curvature..."], ["normal velocity"]),
            ((file, "--kind", "surface", "--colour", "u_n", "--times", "1", "--scale", "shape"),
             ["t\u2080 = 1", "normal velocity u\u2099 / max |u\u2099| of the shape..."], []),
            ((file, "--kind", "balance"), ["what dissipation is"], ["(a)"]),
            ((*others, "--times", "1"), ["(d)"], []),
        ):  # fmt: skip
            with self.subTest(arguments=arguments[1:]):
                texts = self.drawn(*arguments)
                self.check_words(texts, *words, never=never)
        self.assertGreaterEqual(texts.count("k\u2084\u2082 = 0"), 3)  # of the shapes, the cuts, the lines

    def test_velocities_are_relative_to_the_run_or_the_shape(self):
        motion = flow.Motion([moving_sphere(time) for time in (0, 1, 2)])
        slow, fast = motion.shapes[1:]
        self.assertEqual(motion.scale("u_n", slow), slow.largest("u_n"))
        motion.by_run = True
        self.assertEqual(motion.scale("u_n", slow), fast.largest("u_n"))
        self.assertGreater(fast.largest("u_n"), slow.largest("u_n"))

    def test_refusals(self):
        file = write(self.folder / "a.hdf", pressure=False)
        self.refused("not all of its frames have p", file, "--colour", "p")
        self.refused("'T' is not one of H, K, u_n, p, H0, energy_density, mode_1, ...", file, "--colour", "H,T")
        self.refused("--plane: z = 2 meets none of the surfaces", file, "--plane", "z=2")
        for plane in ("w=0", "z=", "z=e", "z=nan", "z"):
            self.refused(f"'{plane}' is not x, y or z = number", file, "--plane", plane)
        self.refused("frame 000001: has only one of u and u_n", replaced(file, frames__000001__PointData__u=None))


class Balance(InFolder):
    def test_lines_are_sizes_at_positive_times(self):
        result = results.read_result(str(write(self.folder / "a.hdf", times=(0, 1, 2))))
        panel = series.BalancePanel([result], [["a"]], [0, 1, 2])
        figure = Figure(figsize=(style.WIDTH, panel.height))
        panel.draw(figure, 0.0)
        lines = {style: line for style, line in zip(panel.styles, figure.axes[0].lines)}
        time, defect = lines["identity_defect"].get_data()
        self.assertGreater(time.min(), 0)
        np.testing.assert_allclose(defect, 1e-3 * time * np.abs(time - 1), rtol=1e-12)
        np.testing.assert_allclose(lines["dissipation"].get_ydata(), np.exp(-time), rtol=1e-12)
        self.assertEqual(figure.axes[0].get_xlim(), (1e-3, 2.0))

    def test_an_unknown_error_is_a_gap(self):
        rows = {"time": np.array([0, 1.0, 2]), "energy_error": np.array([5, 5, 0.1])}
        result = results.Result("a.hdf", {}, {"E_ref": 5.0}, rows, [], [])
        np.testing.assert_array_equal(series.magnitude(result, "energy_error")[1], [np.nan, 0.1])
        rows["energy_error"][2] = 5
        self.assertIsNone(series.magnitude(result, "energy_error"))

    def test_zeros_are_gaps(self):
        rows = {"time": np.array([0, 1.0, 2, 3]), "x": np.array([1, -2.0, 0, 3])}
        time, values = series.magnitude(results.Result("a.hdf", {}, {}, rows, [], []), "x")
        np.testing.assert_array_equal(values, [2, np.nan, 3])
        np.testing.assert_array_equal(time, [1, 2, 3])


class Command(InFolder):
    CASE = """tier = "surface3d"
energy = {k20 = 1.0}
model = {kind = "stokes"}
shape = {kind = "ellipsoid", a = 1.0, b = 1.1, c = 0.9}
accuracy = {energy = 0.1}
discretisation = {elements = 80, order = 3}
time = {end = 0.01}
"""

    def test_options_and_refusals_come_through(self):
        case, file = self.folder / "moving.toml", self.folder / "moving.hdf"
        case.write_text(self.CASE)
        subprocess.run([TUBULE, "run", case, "--quiet", "-o", file], check=True)
        texts = self.drawn(file, "--plane", "x=-0.25", "--colour", "p,H", "--times", "0.01", program=TUBULE)
        self.check_words(texts, "cut x = \u22120.25", "mean curvature H = \u03ba\u2081 + \u03ba\u2082...",
                         "pressure p, white: mean...")  # fmt: skip
        self.refused("is not x, y or z = number", file, "--plane=w=0", program=TUBULE)


class Render(InFolder):
    """tools/render without ParaView, and the commands it would pass to it."""

    def render(self, *arguments):
        command = [sys.executable, "-B", PACKAGE.parents[1] / "render", *arguments]
        return subprocess.run(command, capture_output=True, text=True, env={"PATH": str(self.folder), **self.more})

    def setUp(self):
        super().setUp()
        self.more = {}

    def fake(self, name, script):
        """A program on the PATH, of the shell alone."""
        (self.folder / name).write_text(f"#!/bin/sh\n{script}\n")
        (self.folder / name).chmod(0o755)

    def test_says_that_there_is_none(self):
        done = self.render(write(self.folder / "a.hdf", times=(0, 1)))
        self.assertEqual(done.returncode, 2)
        self.assertIn("pvpython is not on the PATH", done.stderr)
        self.assertIn("no such file", self.render(self.folder / "b.hdf").stderr)

    def test_gives_the_series_to_paraview_where_there_is_one(self):
        file = write(self.folder / "a.hdf", times=(0, 1))
        (self.folder / "view").mkdir()
        (self.folder / "view/a.hdf.series").touch()
        self.fake("pvpython", f'echo "$@" > {self.folder}/said; : > {self.folder}/out/000000.png')
        done = self.render(file, "-o", self.folder / "out", "--colour", "H")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("ffmpeg is not on the PATH", done.stderr)
        said = (self.folder / "said").read_text().split()
        self.assertEqual(said[-3:], [str((self.folder / path).resolve()) for path in ("view/a.hdf.series", "out")] + ["H"])

    def test_film_has_no_pictures_of_an_earlier_run(self):
        file, out = write(self.folder / "a.hdf", times=(0, 1)), self.folder / "a"
        out.mkdir()
        for name in ("000000.png", "000007.png", "mine.png"):
            (out / name).touch()
        self.fake("pvpython", f": > {out}/000000.png; : > {out}/000001.png")
        self.fake("ffmpeg", "echo *.png > film.mp4")
        done = self.render(file)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((out / "film.mp4").read_text().split(), ["000000.png", "000001.png", "mine.png"])

    def test_starts_an_x_server_only_without_a_display(self):
        file = write(self.folder / "a.hdf", times=(0, 1))
        self.fake("pvpython", f": > {self.folder}/a/000000.png")
        self.fake("xvfb-run", f'echo "$@" > {self.folder}/said; shift 3; exec "$@"')
        self.assertEqual(self.render(file).returncode, 0)
        self.assertTrue((self.folder / "said").read_text().startswith("-a -s -noreset "))
        (self.folder / "said").unlink()
        self.more = {"DISPLAY": ":7"}
        self.assertEqual(self.render(file).returncode, 0)
        self.assertFalse((self.folder / "said").exists())

    def test_failures_of_paraview(self):
        file = write(self.folder / "a.hdf", times=(0, 1))
        (self.folder / "a").mkdir()
        (self.folder / "a/000000.png").touch()  # from an earlier run: not a success
        self.fake("pvpython", "exit 0")
        done = self.render(file)
        self.assertEqual(done.returncode, 1)
        self.assertIn("xvfb", done.stderr)
        self.fake("pvpython", "exit 2")  # it has reported the reason
        done = self.render(file)
        self.assertEqual((done.returncode, done.stderr), (2, ""))


if __name__ == "__main__":
    TUBULE = sys.argv.pop(1)
    unittest.main()
