#!/usr/bin/python3
"""Points of a map: what is judged, in which order, and how often."""

import unittest

from lattice import FINEST, Axis, follow, fraction


class Follow(unittest.TestCase):
    def judge(self, points):
        """Inside and outside of a circle about a corner, of radius 3.3 coarse intervals."""
        self.asked += points
        return [i * i + j * j < (3.3 * FINEST) ** 2 for i, j in points]

    def setUp(self):
        self.asked = []

    def test_a_coarse_lattice_first(self):
        sorts = follow({}, self.judge, 4, 0)
        self.assertEqual(len(sorts), 25)
        self.assertEqual({fraction(i, 4) for i, _ in sorts}, {0, 0.25, 0.5, 0.75, 1})

    def test_lines_are_followed(self):
        """Each point of the line lies between judged ones of both sorts that are no farther apart than the finest step."""
        levels = 3
        sorts = follow({}, self.judge, 4, levels)
        step = FINEST // 2**levels
        for j in range(0, 3 * FINEST, step):
            inside = max(i for i, k in sorts if k == j and sorts[i, j])
            outside = min(i for i, k in sorts if k == j and not sorts[i, j])
            self.assertEqual(outside - inside, step)
        self.assertLess(len(sorts), (4 * 2**levels + 1) ** 2 / 4)

    def test_nothing_is_judged_twice(self):
        known = follow({}, self.judge, 4, 1)
        self.assertEqual(len(self.asked), len(set(self.asked)))
        self.asked = []
        follow(known, self.judge, 4, 2)
        self.assertFalse(set(self.asked) & set(known))
        self.assertTrue(self.asked)


class Axes(unittest.TestCase):
    def test_values(self):
        self.assertEqual(Axis("x", 1, 3).value(0.25), 1.5)
        self.assertEqual(Axis("x", 1e-4, 1, log=True).value(0.5), 0.01)
        self.assertEqual(Axis("x", 4, 200, log=True, whole=True).value(0.5), 28)


if __name__ == "__main__":
    unittest.main()
