#!/usr/bin/python3
"""Equilibrium surfaces of the program against computations that share nothing with it: tubes that buckle and wrinkle and
vesicles of two and three mirror planes through an axis (graphs.py), Lawson's surface of genus 2 (lawson.py).

    independent_surfaces_study.py TUBULE [TEST...]
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import graphs
import h5py
import lawson
import numpy as np

TUBULE, CASES = Path(sys.argv.pop(1)).resolve(), Path(__file__).resolve().parents[3] / "cases"
LAWSON = """tier = "surface3d"
[energy]
k20 = 0.25
[shape]
kind = "file"
path = "lawson.off"
remesh = 1000
[accuracy]
energy = 1e-4
[equilibrium]
held = "nothing"
rates = 1
"""


class Surfaces(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)

    def equilibrium(self, case, *sets):
        """Series of the last shape, as attributes the estimated error."""
        result = self.folder / "found.hdf"
        words = [word for key in sets for word in ("--set", key)]
        subprocess.run([TUBULE, "equilibrium", case, "--overwrite", "-o", result, *words], check=True, capture_output=True)
        with h5py.File(result) as file:
            self.assertEqual(file["about"].attrs["stop"], "finished")
            return {name: data[-1] for name, data in file["series"].items()}

    def expect(self, found, exact, what):
        """Energy, area, volume, tension, pressure of graphs.py; errors of surfaces are no bounds."""
        apart = found["energy"] - exact[0]
        print(f"{what}: energy {found['energy']:.8f}, exact {exact[0]:.8f}, apart {apart:.1e}, stated {found['energy_error']:.1e}; "
              f"tension {found['tension']:.6f}, exact {exact[3]:.6f}", flush=True)  # fmt: skip
        self.assertLess(abs(apart), 2 * found["energy_error"])
        self.assertLess(abs(found["tension"] - exact[3]), 5e-3 * abs(exact[3]))

    def test_coil(self):
        graph, c, volume = graphs.helix(8.0, 30), np.zeros(31), 8 * np.pi
        c[:2] = 1, 0.2
        c, *exact = graph.equilibrium(c, 0.5, volume=volume, tension=-2.1, pressure=-2.6, along=(1, 0.2, 0))
        for area in (51.0, 52.0, 53.0, 54.0):
            c, *exact = graph.equilibrium(c, 0.5, area=area, volume=volume, tension=exact[3], pressure=exact[4])
        self.expect(self.equilibrium(CASES / "surface_branch_coil.toml"), exact, "coil")

    def test_wrinkled(self):
        pairs, graph = graphs.tube(9.0, 10, 12, lambda j, k: k % 2 == 0 and (j + k // 2) % 2 == 0, -3.0)
        c, wave = np.zeros(len(pairs)), pairs.index((1, 2))
        c[0], c[wave] = 1, 0.05
        exact = [0, 0, 0, -6.92, -2.92]
        for amplitude in (0.05, 0.1, 0.15, 0.2):
            c, *exact = graph.equilibrium(c, 0.5, volume=9 * np.pi, tension=exact[3], pressure=exact[4], along=(wave, amplitude, 0))
        c, *exact = graph.equilibrium(c, 0.5, area=57.6, volume=9 * np.pi, tension=exact[3], pressure=exact[4])
        self.expect(self.equilibrium(CASES / "surface_equilibrium_wrinkled.toml"), exact, "wrinkled tube")

    def test_triaxial(self):
        pairs, graph = graphs.sphere(40, lambda l, m: l % 2 == 0 and m % 2 == 0)
        c = graphs.ellipsoid(graph, 1.35, 1.12, 0.55)
        area = 4 * np.pi
        c, *exact = graph.equilibrium(c, 0.5, area=area, volume=0.735 * area / 3, tension=-5.8, pressure=-15.8)
        self.expect(self.equilibrium(CASES / "surface_branch_triaxial.toml"), exact, "triaxial vesicle")

    def test_threefold(self):
        pairs, graph = graphs.sphere(24, lambda l, m: m % 3 == 0 and (l + m) % 2 == 0, -2.8)
        c, area, wave = graphs.ellipsoid(graph, 1.2, 1.2, 0.62), 4 * np.pi, pairs.index((3, 3))
        c, *exact = graph.equilibrium(c, 0.25, area=area, volume=0.95 * area / 3)
        for amplitude in (0.02, 0.05, 0.1, 0.15):
            c, *exact = graph.equilibrium(c, 0.25, area=area, tension=exact[3], pressure=exact[4], along=(wave, amplitude, 1))
        c, *exact = graph.equilibrium(c, 0.25, area=area, volume=0.85 * area / 3, tension=exact[3], pressure=exact[4])
        self.expect(self.equilibrium(CASES / "surface_branch_threefold.toml"), exact, "vesicle of threefold symmetry")

    def test_lawson(self):
        torus, _ = lawson.area_in_the_sphere(1, 64)
        self.assertLess(abs(torus - 2 * np.pi**2), 1e-6)
        exact, change = lawson.area_in_the_sphere()
        print(f"Lawson's surface of genus 2: area in the 3-sphere {exact:.6f} +- {change:.0e}", flush=True)
        (self.folder / "case.toml").write_text(LAWSON)
        points, cells = lawson.surface(24)
        for name, pole in zip("ab", lawson.POLES):
            lawson.write_off(self.folder / "lawson.off", lawson.in_space(points, pole), cells)
            for triangles in (1000, 2000, 4000):
                found = self.equilibrium(self.folder / "case.toml", f"shape.remesh={triangles}")
                apart = found["energy"] - exact
                print(f"  image {name}, {found['elements']:.0f} triangles: energy {found['energy']:.6f}, apart {apart:.1e}, "
                      f"stated {found['energy_error']:.1e}, {found['negative_directions']:.0f} negative directions, then {-found['rate_1']:.4f}", flush=True)  # fmt: skip
                self.assertLess(abs(apart), 3 * found["energy_error"])  # at most 2.3
                self.assertEqual(found["negative_directions"], 0)
            self.assertLess(abs(apart), 2e-3)


if __name__ == "__main__":
    unittest.main()
