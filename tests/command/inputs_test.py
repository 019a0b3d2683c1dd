#!/usr/bin/python3
"""What a case reads besides itself is in its result: a run goes on with the same only, and without the file where it is small.

inputs_test.py TUBULE. Kinds of files, of both tiers, are combined with what becomes of the file until --resume: it is the
same, changed at a random place, or missing.
"""
import random
import unittest

import h5py
import numpy as np

from program import ProgramTest, series

MODEL = """
[model]
kind = "overdamped"
[accuracy]
energy = 1e-2
[time]
end = 1e-3
"""
AXISYM = 'tier = "axisym"\n[energy]\nk20 = 1.0\n[shape]\n{}' + MODEL
SURFACE = 'tier = "surface3d"\n[energy]\nk20 = 1.0\n[shape]\n{}' + MODEL.replace("1e-2", "0.1\nestimate = false\n[discretisation]\norder = 2")
MANY = 1000  # comments: more bytes than a result keeps


def profile(bulge, comments=0, H0=False):
    t = np.linspace(0, np.pi, 60)
    r = (1 + bulge * np.cos(2 * t)) * np.sin(t)
    r[[0, -1]] = 0
    rows = np.column_stack([r, -1.3 * np.cos(t)] + ([-1 - bulge * np.cos(t) ** 2] if H0 else []))
    heading = "r,z,H0" if H0 else "r,z"
    return "# {}\n".format("-" * 70) * comments + heading + "\n" + "\n".join(",".join(f"{x:.17g}" for x in row) for row in rows) + "\n"


def octahedron(bulge, comments=0):
    """Its triangles twice divided, on an ellipsoid."""
    points = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    faces = [(a, b, c) for a in (0, 1) for b in (2, 3) for c in (4, 5)]
    faces = [f if np.linalg.det(np.array([points[i] for i in f])) > 0 else f[::-1] for f in faces]
    for _ in range(2):
        number, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in number:
                number[key] = len(points)
                points.append(tuple(np.add(points[a], points[b]) / 2))
            return number[key]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    at = [np.array(p) / np.linalg.norm(p) * (1, 1, 1 + bulge) for p in points]
    lines = ["OFF"] + ["# " + "-" * 70] * comments + [f"{len(at)} {len(faces)} 0"]
    lines += [" ".join(f"{x:.17g}" for x in p) for p in at]
    return "\n".join(lines + [f"3 {a} {b} {c}" for a, b, c in faces]) + "\n"


PROFILE = 'kind = "profile"\npath = "input.csv"\ntolerance = 1e-2\n'
MESH = 'kind = "file"\npath = "input.off"\n'
FRAME = 'kind = "result"\npath = "input.hdf"\nframe = 0\n'
# For each kind: the case, the file, what makes it for a bulge, whether a result keeps its bytes.
KINDS = {
    "profile": (AXISYM.format(PROFILE), "input.csv", lambda test, bulge: profile(bulge), True),
    "large profile": (AXISYM.format(PROFILE), "input.csv", lambda test, bulge: profile(bulge, MANY), False),
    "profile with H0": (
        AXISYM.format(PROFILE + "H0_tolerance = 1e-2\n"), "input.csv", lambda test, bulge: profile(bulge, 0, True), True),
    "profile in 3D": (SURFACE.format(PROFILE), "input.csv", lambda test, bulge: profile(bulge), True),
    "mesh": (SURFACE.format(MESH), "input.off", lambda test, bulge: octahedron(bulge), True),
    "frame": (AXISYM.format(FRAME), "input.hdf", lambda test, bulge: test.frame(AXISYM, bulge), True),
    "frame in 3D": (SURFACE.format(FRAME), "input.hdf", lambda test, bulge: test.frame(SURFACE, bulge), None),
}  # fmt: skip


class Inputs(ProgramTest):
    def frame(self, tier, bulge):
        """The bytes of a result."""
        ellipsoid = f'kind = "ellipsoid"\na = 1.0\nb = 1.0\nc = {1.2 + bulge}\n'
        (self.folder / "input.hdf").unlink(missing_ok=True)
        self.write("other.toml", tier.format(ellipsoid))
        self.tubule("run", "other.toml", "-o", "input.hdf", "--quiet")
        return (self.folder / "input.hdf").read_bytes()

    def put(self, name, contents):
        (self.folder / name).write_bytes(contents if isinstance(contents, bytes) else contents.encode())

    def begun(self, kind, bulge):
        case, name, make, kept = KINDS[kind]
        self.write("case.toml", case)
        self.put(name, make(self, bulge))
        self.tubule("run", "case.toml", "-o", "case.hdf", "--overwrite", "--quiet")
        with h5py.File(self.result) as file:
            (entry,) = file["inputs"].values()
            self.assertTrue(entry.attrs["name"].startswith(name), kind)
            if kept is not None:
                self.assertEqual(entry.size > 0, kept, kind)
            return name, entry.size > 0

    def test_a_run_goes_on_with_what_it_began_with(self):
        dice = random.Random(36)
        for kind in KINDS:
            with self.subTest(kind=kind):
                bulge = dice.uniform(0, 0.2)
                name, kept = self.begun(kind, bulge)
                begun, original = self.result.read_bytes(), (self.folder / name).read_bytes()
                rows = series(self.result)["energy"]
                goes_on = (["case.toml", "-o", "case.hdf"], ["case.hdf"])

                self.put(name, KINDS[kind][2](self, bulge + dice.choice((-0.1, 0.1))))
                said = self.tubule("run", *dice.choice(goes_on), "--resume", "--until", "2e-3", status=2)[1]
                self.assertIn(f"{name}", said)
                self.assertIn("has changed since", said)
                self.assertEqual(self.result.read_bytes(), begun)
                said = self.tubule("run", "case.toml", "-o", "case.hdf", status=2)[1]
                self.assertIn("holds the result of another case", said)
                self.assertIn("has changed since", said)

                (self.folder / name).unlink()
                what = dice.choice(goes_on)
                said = self.tubule("run", *what, "--resume", "--until", "2e-3", status=0 if kept else 2)[1]
                without = series(self.result)["energy"]
                if not kept:
                    self.assertIn(name, said)

                self.result.write_bytes(begun)
                self.put(name, original)
                self.tubule("run", *dice.choice(goes_on), "--resume", "--until", "2e-3")
                self.assertGreater(len(series(self.result)["energy"]), len(rows))
                np.testing.assert_array_equal(series(self.result)["energy"][: len(rows)], rows)
                if kept:
                    np.testing.assert_array_equal(series(self.result)["energy"], without)

    def test_a_result_without_it_goes_on_as_before(self):
        name, _ = self.begun("profile", 0.1)
        with h5py.File(self.result, "a") as file:
            del file["inputs"]
        self.tubule("run", "case.hdf", "--resume", "--until", "2e-3")

    def test_a_scan_grows_and_goes_on_with_what_it_began_with(self):
        over = ["--over", "energy.k42=0,0.1"]
        more = ["--extend", "--over", "energy.k42=0.05"]
        self.write("case.toml", AXISYM.format(PROFILE))
        self.put("input.csv", profile(0.1))
        self.tubule("scan", "case.toml", *over, "-o", "scan.hdf", "--quiet")
        begun = (self.folder / "scan.hdf").read_bytes()
        self.put("input.csv", profile(0.15))
        for arguments in (["scan.hdf", *more], ["scan.hdf", "--resume"]):
            said = self.tubule("scan", *arguments, status=2)[1]
            self.assertIn("input.csv has changed since: bring back the file that the scan began with", said)
        self.assertIn("holds another scan", self.tubule("scan", "case.toml", *over, "-o", "scan.hdf", status=2)[1])
        self.assertEqual((self.folder / "scan.hdf").read_bytes(), begun)
        self.tubule("scan", "case.toml", *over, "-o", "other.hdf", "--quiet")
        said = self.tubule("scan", "scan.hdf", "--merge", "other.hdf", "-o", "both.hdf", status=2)[1]
        self.assertIn("input.csv was another file", said)
        (self.folder / "input.csv").unlink()
        self.tubule("scan", "scan.hdf", *more, "--quiet")

    def test_a_scan_over_files_keeps_each(self):
        self.write("case.toml", AXISYM.format(PROFILE))
        for name, bulge in (("input.csv", 0.1), ("b.csv", 0.15)):
            self.put(name, profile(bulge))
        self.tubule("scan", "case.toml", "--over", "shape.path=input.csv,b.csv", "-o", "scan.hdf", "--quiet")
        with h5py.File(self.folder / "scan.hdf") as file:
            self.assertEqual([entry.attrs["name"] for entry in file["inputs"].values()], ["input.csv", "b.csv"])
        self.put("b.csv", profile(0.2))
        said = self.tubule("scan", "scan.hdf", "--extend", "--over", "energy.k42=0.05", status=2)[1]
        self.assertIn("b.csv has changed since", said)


if __name__ == "__main__":
    unittest.main(argv=["inputs_test"])
