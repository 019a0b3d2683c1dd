#!/usr/bin/python3
"""Output for machines: every --json is as its schema of docs/schemas says, and all that is wrong with a case is told at once.

json_test.py TUBULE
"""
import json
import sys
import unittest

import schema
from confirm_test import CASE as BUCKLING
from confirm_test import FEW
from kill_test import SURFACE
from program import QUICK, ProgramTest
from stability_test import TUBE

SPHERE = TUBE[: TUBE.index("[shape]")] + '[shape]\nkind = "sphere"\nradius = 1.0\n[time]\nend = 1.0\n'


class Schemas(ProgramTest):
    def answer(self, name, *arguments, status=0):
        """What the command prints, which is as the schema says; and what it would print if it forgot its last entry is not."""
        out, _ = self.tubule(*arguments, "--json", status=status)
        self.assertEqual(schema.against(name, out), [], f"{name}: {arguments}")
        answer = json.loads(out)
        self.assertNotEqual(schema.against(name, json.dumps(dict(list(answer.items())[:-1]))), [])
        self.assertNotEqual(schema.against(name, json.dumps({**answer, "more": 1})), [])
        return answer

    def test_check(self):
        found = self.answer("check", "check", "case.toml")["cases"][0]
        self.assertTrue(found["valid"])
        self.assertIn('kind = "tube"', found["toml"])
        self.assertGreater(found["expected"]["steps"], 10)
        self.assertEqual((found["advice"]["tier"], found["advice"]["model"]), ("axisym", "gradient-flow"))
        quick = self.answer("check", "check", "case.toml", "--quick")["cases"][0]
        self.assertEqual((quick["expected"], quick["advice"]), (None, None))

    def test_check_warns_of_energies_without_lower_bound(self):
        sound = self.answer("check", "check", "case.toml", "--quick")["cases"][0]
        self.assertIsNone(sound["warning"])
        falls = self.answer("check", "check", "case.toml", "--quick", "--set", "energy.k42=-0.01")["cases"][0]
        self.assertTrue(falls["valid"])
        self.assertIn("no lower bound", falls["warning"])

    def test_check_of_several_of_which_one_is_wrong(self):
        self.write("bad.toml", QUICK.replace("radius", "raduis").replace("k42 = 0.1", 'k42 = "much"'))
        good, bad = self.answer("check", "check", "case.toml", "bad.toml", "--set", "time.edn=1", "--quick", status=2)["cases"]
        self.assertFalse(good["valid"])
        self.assertIsNone(good["toml"])
        words = [(e["file"], e["line"], e["column"], e["key"], e["suggestion"]) for e in bad["errors"]]
        self.assertEqual(words, [("bad.toml", 7, 7, "energy.k42", None), ("bad.toml", 10, 1, "shape.raduis", "radius"),
                                 (None, None, None, "time.edn", "end")])  # fmt: skip
        self.assertEqual(bad["errors"][2]["place"], "--set time.edn=1")
        self.assertIn("energy.k42 must be a finite number, not the string", bad["errors"][0]["message"])

    def test_show(self):
        self.tubule("run", "case.toml")
        self.answer("show", "show", "case.hdf")
        frame = self.answer("show", "show", "case.hdf", "--frame", "1")["frames"][1]
        self.assertIn("data", frame["arrays"]["z"])

    def test_show_a_surface(self):
        self.write("surface.toml", SURFACE)
        self.tubule("run", "surface.toml", "--set", "time.end=0.01", "--set", "time.output=[]")
        shown = self.answer("show", "show", "surface.hdf", "--frame", "0")
        self.assertEqual(len(shown["meshes"][0]["cells"]), 6 * shown["meshes"][0]["triangles"])

    def test_show_a_scan(self):
        self.tubule("scan", "case.toml", "--over", "energy.k42=0.1,0.2", "--over", "shape.radius=1,-1", "-o", "scan.hdf",
                    status=2)  # fmt: skip
        self.tubule("scan", "case.toml", "--over", "energy.k42=0.1,0.2", "-o", "scan.hdf", "--quiet")
        self.assertEqual(len(self.answer("show_scan", "show", "scan.hdf")["points"]), 2)

    def test_compare(self):
        self.tubule("run", "case.toml")
        self.tubule("run", "case.toml", "--set", "accuracy.energy=1e-4", "-o", "coarse.hdf")
        found = self.answer("compare", "compare", "case.hdf", "coarse.hdf", "--tolerance", "energy=1e-12", status=1)
        self.assertFalse(found["checks"][0]["within"])

    def test_confirm(self):
        self.write("tube.toml", BUCKLING)
        self.tubule("scan", "tube.toml", "--over", "energy.H0=-0.5,0", "-o", "scan.hdf", "--quiet")
        points = self.answer("confirm", "confirm", "scan.hdf", *FEW, "--points", "1", "--end", "0.05", "--quiet", status=None)
        self.assertEqual(len(points["points"]), 1)

    def test_stability(self):
        self.write("tube.toml", TUBE)
        self.write("sphere.toml", SPHERE)
        self.assertEqual(self.answer("stability", "stability", "tube.toml", "--model", "all", "--modes", "2")["shape"], "tube")
        self.assertEqual(self.answer("stability", "stability", "sphere.toml")["shape"], "sphere")
        self.tubule("run", "tube.toml", "--set", "time.end=0.1", "--set", "time.output=[0.02,0.04,0.06]")
        self.assertEqual(self.answer("stability", "stability", "tube.hdf", "--numerical")["shape"], "profile")
        self.assertIn("rate", self.answer("stability", "stability", "tube.hdf", "--fit", "1"))

    def tubule(self, *arguments, status=0):
        if status is not None:
            return super().tubule(*arguments, status=status)
        with self.start(*arguments) as process:  # whatever its status
            return process.communicate()


class Check(ProgramTest):
    def test_files_that_a_case_names_are_read(self):
        case = SURFACE.split("[shape]")[0].replace('[model]\nkind = "fluid"\n', "") + '[shape]\nkind = "file"\npath = "%s"\n'
        self.write("open.off", "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n")
        self.write("hole.toml", case % "open.off")
        err = self.tubule("check", "hole.toml", "--quick", status=2)[1]
        self.assertIn("open.off", err)
        self.write("none.toml", case % "nowhere.off")
        self.assertIn("nowhere.off", self.tubule("check", "none.toml", "--quick", status=2)[1])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
