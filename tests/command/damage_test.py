#!/usr/bin/python3
"""Results of every kind with one flipped bit: every command that reads one refuses it and changes nothing.

damage_test.py TUBULE [FLIPS], so many of each kind. What is damaged is known, so nothing else is expected.
"""
import random
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "studies/fuzz"))

from results import commands
from samples import samples
from sandbox import Sandbox

PROGRAM = Path(sys.argv[1]).resolve()
FLIPS = int(sys.argv[2]) if len(sys.argv) > 2 else 4
HEAD = 4096  # where HDF5 has most of its structures


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

    def test_verify_says_good_or_damaged(self):
        for sample in samples(PROGRAM):
            with self.subTest(kind=sample.kind):
                box = self.box(sample)
                self.assertEqual(box.run("show", "case.hdf", "--verify").out, "case.hdf: as it was written\n")
                spoilt = bytearray(sample.result)
                spoilt[len(spoilt) // 2] ^= 1
                box.write("case.hdf", bytes(spoilt))
                done = box.run("show", "case.hdf", "--verify", statuses=(1,))
                self.assertEqual(done.out, "case.hdf: it is damaged: its checksum is wrong\n")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
