#!/usr/bin/python3
"""Results of every kind with one flipped bit: every command that reads one refuses it and changes nothing.

damage_test.py TUBULE [FLIPS], so many of each kind. What is damaged is known, so nothing else is expected.
"""
import random
import struct
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "fuzz"))

from results import commands
from samples import samples
from sandbox import Sandbox

PROGRAM = Path(sys.argv[1]).resolve()
FLIPS = int(sys.argv[2]) if len(sys.argv) > 2 else 8
HEAD = 4096  # where HDF5 has most of its structures


def table(csv):
    return [line.split(",") for line in csv.splitlines()]


class Damage(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def box(self, sample):
        box = Sandbox(PROGRAM, self.folder / sample.kind)
        sample.put(box)
        return box

    def test_flipped_bits_are_refused(self):
        for sample in samples(PROGRAM):
            box, rng = self.box(sample), random.Random(sample.kind)
            asked = list(commands(sample.kind))
            for flip in range(FLIPS):
                spoilt = bytearray(sample.result)
                at = rng.randrange(len(spoilt) if flip % 2 else HEAD)
                spoilt[at] ^= 1 << rng.randrange(8)
                result = box.write("case.hdf", bytes(spoilt))
                arguments = asked[flip % len(asked)]
                with self.subTest(kind=sample.kind, byte=at, command=arguments[0]):
                    done = box.run(*arguments, statuses=(2,))
                    self.assertRegex(done.err, r"case\.hdf: .*damaged")
                    self.assertEqual(done.out, "")
                    self.assertEqual(result.read_bytes(), bytes(spoilt))

    def test_what_is_good_is_rescued(self):
        for sample in samples(PROGRAM):
            with self.subTest(kind=sample.kind):
                box = self.box(sample)
                done = box.run("show", "case.hdf", "--verify")
                self.assertIn("as it was written", done.out)
                expected = box.run("show", "case.hdf", "--csv").out
                spoilt = bytearray(sample.result)
                spoilt[0:2048] = bytes(2048)  # what HDF5 needs first
                box.write("case.hdf", bytes(spoilt))
                if sample.kind == "scan":
                    self.assertIn("nothing of it can be rescued", box.run("show", "case.hdf", "--verify", statuses=(2,)).err)
                    continue
                (box.folder / "round.hdf").symlink_to("round.hdf")
                self.assertIn("round.hdf exists already", box.run("show", "case.hdf", "--rescue", "round.hdf", statuses=(2,)).err)
                done = box.run("show", "case.hdf", "--rescue", "good.hdf", statuses=(1,))
                self.assertIn("it is damaged", done.out)
                rows, all_rows = table(box.run("show", "good.hdf", "--csv").out), table(expected)
                self.assertLessEqual(set(rows[0]), set(all_rows[0]))
                kept = [all_rows[0].index(name) for name in rows[0]]
                all_rows = [[row[j] for j in kept] for row in all_rows]
                self.assertTrue(all(row in all_rows for row in rows))
                self.assertEqual(len(rows) - 1, int(done.out.split("good")[1].split()[0]))
                if "rows" not in done.out.split("good")[0]:
                    self.assertEqual(rows, all_rows)

    def test_a_lost_series_costs_no_rows(self):
        sample = next(s for s in samples(PROGRAM) if s.kind != "scan")
        box = self.box(sample)
        head, *rows = table(box.run("show", "case.hdf", "--csv").out)
        energies = struct.pack(f"<{len(rows)}d", *(float(row[head.index("energy")]) for row in rows))
        spoilt = bytearray(sample.result)
        spoilt[sample.result.index(energies) + len(energies) // 2] ^= 1
        box.write("case.hdf", bytes(spoilt))
        done = box.run("show", "case.hdf", "--rescue", "good.hdf", statuses=(1,))
        self.assertIn(f"series energy: {len(rows)} of {len(rows)} rows", done.out)
        good_head, *good = table(box.run("show", "good.hdf", "--csv").out)
        self.assertNotIn("energy", good_head)
        self.assertEqual(good, [[row[head.index(name)] for name in good_head] for row in rows])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
