#!/usr/bin/python3
"""Pictures of curved surfaces: pixels of a sphere, known exactly, and pages drawn from results.

    plot_surface_test.py SURFACE_RESULTS

SURFACE_RESULTS writes results with curved surfaces (surface_results.cpp).
"""

import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import matplotlib.image
import numpy as np
from plot_test import InFolder, replaced, write

from drawing import raster, results  # found by way of plot_test

SURFACE_RESULTS = None
BAR = "mean curvature H = \u03ba\u2081 + \u03ba\u2082"


def octasphere(order):
    """Nodes [8 cells, n, 3] on the unit sphere, moved out from an octahedron."""
    corners = [[(x, 0, 0), (0, y, 0), (0, 0, z)][:: x * y * z] for x in (1, -1) for y in (1, -1) for z in (1, -1)]
    flat = raster.lattice(order) / order @ np.array(corners, float)
    return flat / np.linalg.norm(flat, axis=-1, keepdims=True)


class Raster(unittest.TestCase):
    SIZE = 200  # pixels from -1.25 to 1.25

    def sphere(self, order, closed=True):
        nodes, samples = octasphere(order), self.SIZE * raster.OVERSAMPLING
        view = raster.View()
        return raster.sample(
            nodes, nodes, nodes, order, closed, view, (-1.25, 1.25), samples / 2.5, samples, samples
        ), view

    def test_functions_are_one_at_their_node_and_zero_at_others(self):
        for order in (1, 2, 3, 4):
            nodes = raster.lattice(order) / order
            np.testing.assert_allclose(raster.lagrange(order, nodes), np.eye(len(nodes)), atol=1e-13)

    def test_pieces_cover_the_triangle_once(self):
        for n in (1, 2, 5):
            places, corners = raster.division(n)
            (ax, ay), (bx, by), (cx, cy) = (places[corners[:, i], 1:].T for i in range(3))
            areas = ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2
            np.testing.assert_allclose(areas, np.full(n * n, 0.5 / n**2))

    def test_a_sphere_is_a_full_disc_of_its_depth_normal_and_values(self):
        samples, view = self.sphere(4)
        h, w = samples.shape
        x = (np.arange(w) + 0.5) * 2.5 / w - 1.25
        x, y = (field.ravel() for field in np.meshgrid(x, -x))
        r2 = x * x + y * y
        inside, outside = r2 < 0.96**2, r2 > 1.03**2
        self.assertTrue(np.isfinite(samples.depth[inside]).all())  # no holes between cells or pieces
        self.assertFalse(np.isfinite(samples.depth[outside]).any())
        self.assertTrue(samples.outside[inside].all())
        exact = np.stack([x, y, np.sqrt(1 - np.minimum(r2, 1))], axis=1)[inside]
        # The quartics lie up to 0.0212 off the sphere (measured at 8 x 561 points); depth is steeper than that by 1/n.
        np.testing.assert_array_less(np.abs(samples.depth[inside] * 2.5 / w - exact[:, 2]) * exact[:, 2], 0.03)
        normal = samples.normal[inside] / np.linalg.norm(samples.normal[inside], axis=1)[:, None]
        np.testing.assert_array_less(np.abs(normal - exact) * exact[:, 2:], 0.03)
        np.testing.assert_array_less(np.abs(samples.values[inside] @ view.axes - exact) * exact[:, 2:], 0.03)

    def test_what_is_nearer_hides_what_is_behind(self):
        # Seen along x: two triangles, the one in front smaller, given first and last.
        flat = np.array([[[0, -1, -1], [0, 1, -1], [0, 0, 1.0]]])
        front, back = 0.4 * flat + [1, 0, -0.2], flat
        for both in (np.concatenate([front, back]), np.concatenate([back, front])):
            tag = both[..., :1]
            view = raster.View(0, 0)
            samples = raster.sample(both, np.zeros_like(both), tag, 1, False, view, (-1, 1), 20, 40, 40)
            values = samples.values.reshape(40, 40)
            self.assertEqual(values[22, 20], 1)  # in the middle
            self.assertEqual(values[37, 20], 0)  # at the lower edge there is only the one behind

    def test_the_inside_shows_where_it_is_open(self):
        nodes = octasphere(4)
        turned = nodes[:, [0, 2, 1, 11, 10, 9, 8, 7, 6, 5, 4, 3, 12, 14, 13]]  # inside out
        outside = []
        for cells, closed in ((nodes, False), (turned, False), (nodes, True), (turned, True)):
            samples = raster.sample(cells, cells, cells, 4, closed, raster.View(), (-1.25, 1.25), 80, 200, 200)
            near = samples.depth > 0.4 * 80  # away from the rim, where both sides meet
            outside.append((near.sum() > 10000, samples.outside[near].mean() if near.any() else None))
        # Only what faces the eye is drawn of a closed surface: inside out, nothing of the near half.
        self.assertEqual(outside, [(True, 1), (True, 0), (True, 1), (False, None)])

    def test_shading_is_smooth_and_outlined(self):
        samples, _ = self.sphere(4)
        picture = raster.shaded(samples, np.ones((np.isfinite(samples.depth).sum(), 3))).astype(float)
        self.assertEqual(picture.shape, (self.SIZE, self.SIZE, 4))
        y, x = np.mgrid[: self.SIZE, : self.SIZE]
        r = np.hypot(x - 99.5, y - 99.5) / 80
        grey = np.where(r < 0.9, picture[..., 0], np.nan)
        # Equal values look alike, above and below: within 3 % up to 60 degrees from the eye, r = 0.866.
        self.assertGreater(np.nanmin(grey[r < 0.86]), 247)
        np.testing.assert_allclose(*np.where(r < 0.86, [grey, grey[::-1]], 0), atol=4)
        # Across a seam of cells too: shades change by a few grey levels from pixel to pixel, never by more.
        self.assertLess(np.nanmax(np.abs(np.diff(grey, axis=0))), 8)
        self.assertLess(np.nanmax(np.abs(np.diff(grey, axis=1))), 8)
        self.assertLess(picture[(r > 0.98) & (r < 0.99)][:, 0].min(), 100)  # the rim is dark
        self.assertTrue((picture[r > 1.03][:, 3] == 0).all())


class Tubes(unittest.TestCase):
    def test_cells_that_are_periods_away_join_the_others(self):
        x, z = np.meshgrid(np.arange(5.0), np.arange(0.25, 3, 0.5))
        z = z.reshape(-1, 1) + [-0.2, 0.0, 0.2]  # cells of three nodes
        points = np.stack([np.repeat(x.reshape(-1, 1), 3, axis=1), np.zeros_like(z), z], axis=-1)
        moved = points.copy()
        moved[3, :, 2] += 6
        moved[20, :, 2] -= 3
        results.join_periods(moved, 3.0)
        apart = moved[..., 2] - z
        self.assertLess(np.ptp(moved[..., 2].mean(axis=1)), 3)
        np.testing.assert_allclose(apart, 3 * np.round(apart / 3), atol=1e-12)
        np.testing.assert_array_equal(moved[..., :2], points[..., :2])


class Surfaces(InFolder):
    @classmethod
    def setUpClass(cls):
        cls.made = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        subprocess.run([SURFACE_RESULTS, cls.made], check=True)
        cls.torus, cls.sphere, cls.tube = (cls.made / f"shapes_{name}.hdf" for name in ("torus", "sphere", "tube"))

    def test_one_surface_twice_side_by_side(self):
        texts = self.drawn(self.torus, "-o", self.folder / "p.png")
        self.check_words(texts, "A torus", BAR, "Gaussian curvature K", never=["bending energy E"])  # one row
        picture = matplotlib.image.imread(self.folder / "p.png")[..., :3]
        red, green, blue = np.moveaxis(picture, -1, 0)
        half = picture.shape[1] // 2
        top = slice(0, int(0.7 * picture.shape[0]))  # above the colour bars
        orange, blues = (red > 1.5 * blue) & (red > 0.3), (blue > 1.5 * red) & (blue > 0.3)
        # H < 0 but on the inner rim: orange, on the left; K < 0 on the inner half: blue, on the right.
        self.assertGreater(orange[top, :half].mean(), 0.1)
        self.assertGreater(blues[top, half:].mean(), 0.02)
        self.assertFalse(blues[top, :half].any())

    def test_pages(self):
        for arguments, words, never in (
            ([self.sphere], ("t\u2080 = 0", "t\u2083 = 3", "H", "K", "bending energy E", "(a)", "(b)"), []),
            ((self.tube, "--kind", "surface", "--times", "0,2"), ["t\u2081 = 2"], ("t\u2082 = 3", "bending energy E")),
            ((self.tube, "--kind", "energy"), ["bending energy E"], [BAR]),
            ((self.torus, "--kind", "energy"), ["bending energy E"], []),
            ((write(self.folder / "a.hdf", times=[0, 1]), self.torus), ("(a)", "(b)", "(c)", f"{BAR} (left halves)", BAR), []),  # both tiers
        ):
            with self.subTest(arguments=arguments):
                self.check_words(self.drawn(*arguments), *words, never=never)

    def test_refusals(self):
        self.refused("no profiles to draw", self.torus, "--kind", "profiles")
        self.refused("no surfaces to draw; those of tier axisym are drawn by --kind profiles", write(self.folder / "a.hdf"), "--kind", "surface")
        self.refused("frame 000000 lacks H, K, normal", self.made / "closed_3.hdf")
        size = len(results.read_result(str(self.torus)).surfaces[0].nodes["K"])
        for changes, words in (
            ({"frames__000000__PointData__K": np.full(size, np.nan)}, "contains numbers that are not finite"),
            ({"frames__000000__PointData__H": np.ones(5)}, "frame 000000: Points, normal, H, K must have one row per point"),
            ({"meshes": None}, "damaged or not a result of tubule"),
        ):
            self.refused(words, replaced(Path(shutil.copy(self.torus, self.folder / "damaged.hdf")), **changes))


if __name__ == "__main__":
    SURFACE_RESULTS = sys.argv.pop(1)
    unittest.main()
