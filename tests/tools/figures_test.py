#!/usr/bin/python3
"""`tools/figures --stale` lists pictures of docs/ whose inputs have changed, on a copy of the sources.

    figures_test.py TUBULE            that it notices changes, and only these
    figures_test.py TUBULE --study    that nothing in the sources is out of date
"""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
TUBULE = Path(sys.argv[1]).resolve()


def figures(top, *arguments):
    """Lines by their first word."""
    done = subprocess.run([top / "tools/figures", *arguments, "--build", TUBULE.parent], capture_output=True, text=True)
    assert done.returncode in (0, 1), done
    return {line.split()[0]: line for line in done.stdout.splitlines()}, done.returncode


class Stale(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.top = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        for folder in ("cases", "docs", "tools", "tests/docs", "tests/studies/benchmark"):
            shutil.copytree(TOP / folder, cls.top / folder)
        for name in ("axisym", "flow"):
            figures(cls.top, "--current", name)

    def found_after(self, name, change, *figure):
        """What is listed once the text of a file is changed; the file is put back."""
        path = self.top / name
        kept = path.read_bytes() if path.exists() else None
        path.write_bytes(change(kept))
        try:
            now, status = figures(self.top, *figure, "--stale")
        finally:
            path.unlink() if kept is None else path.write_bytes(kept)
        self.assertEqual(status, 1 if now else 0)
        return now

    def test_changes_of_inputs_and_of_pictures(self):
        for figure in ("axisym", "flow"):
            self.assertEqual(figures(self.top, figure, "--stale"), ({}, 0))
        for name, old, new, stale in (
            ("cases/figure_k42_006.toml", b"k42 = 0.06", b"k42 = 0.07", "axisym"),
            ("cases/peanut.toml", b"[time]", b"[time]\nlimit = 5", "flow"),
            ("tools/python/tubule/drawing/energy.py", b"import ", b"import this\nimport ", "axisym"),  # not named by the command itself
            ("docs/figure_flow.svg", b"</svg>", b"<g/></svg>", "flow"),
            ("tools/figures", b'run("peanut", "peanut")', b'run("decay", "peanut")', "flow"),
        ):
            found = self.found_after(name, lambda text: text.replace(old, new, 1), stale)
            self.assertIn(stale, found, name)
            self.assertIn("commands" if name == "tools/figures" else name, found[stale])

        for name, line in (("tools/python/tubule/drawing/style.py", b"\n\n# A remark.\n"), ("cases/figure_k42_006.toml", b"\n# A remark.\n")):
            self.assertEqual(self.found_after(name, lambda text: text + line, "axisym"), {}, name)  # comments and layout
        self.assertIn("docs/stray.png", self.found_after("docs/stray.png", lambda _: b"x"))  # no command makes it

    def test_a_picture_is_drawn_and_noted(self):
        picture = self.top / "docs/figure_flow.svg"
        picture.unlink()
        self.assertIn("docs/figure_flow.svg", figures(self.top, "flow", "--stale")[0]["flow"])
        self.assertEqual(figures(self.top, "flow")[1], 0)
        self.assertIn("<svg", picture.read_text())
        self.assertEqual(figures(self.top, "flow", "--stale"), ({}, 0))


class StudyOfTheSources(unittest.TestCase):
    def test_all_pictures_are_what_their_commands_make(self):
        self.assertEqual(figures(TOP, "--stale"), ({}, 0))


if __name__ == "__main__":
    os.environ["OMP_NUM_THREADS"] = "1"
    only = "StudyOfTheSources" if "--study" in sys.argv else "Stale"
    unittest.main(argv=[sys.argv[0], only])
