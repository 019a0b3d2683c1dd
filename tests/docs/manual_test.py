#!/usr/bin/python3
"""`tools/manual` writes web pages of docs/ without a warning, in the order of the index, with all pictures and formulas;
with --browser a browser without a screen draws the formulas. Skipped where the packages of tools/packages-manual.txt are
missing.

    manual_test.py TOP [--browser]
"""

import importlib.util
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

TOP = Path(sys.argv[1]).resolve()
MODULES = ("sphinx", "myst_parser", "sphinx_rtd_theme")
MATHJAX = Path("/usr/share/javascript/mathjax")
MISSING = [name for name in MODULES if not importlib.util.find_spec(name)] + ["mathjax"] * (not MATHJAX.exists())
BROWSERS = ("chromium-headless-shell", "chromium")


def manual(top, folder):
    return subprocess.run([top / "tools/manual", folder], capture_output=True, text=True)


@unittest.skipIf(MISSING, f"not installed: {MISSING}")
class Folder(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))


class Manual(Folder):
    def test_has_all_pages_in_the_order_of_the_index_and_what_they_show(self):
        done = manual(TOP, self.folder)
        self.assertEqual((done.returncode, done.stderr, done.stdout), (0, "", f"{self.folder}/index.html\n"))
        self.assertIn("docs/README.html", (self.folder / "index.html").read_text())
        pages = {p.relative_to(TOP / "docs").with_suffix("") for p in (TOP / "docs").rglob("*.md")}
        self.assertEqual({p.relative_to(self.folder / "docs").with_suffix("") for p in (self.folder / "docs").rglob("*.html")}, pages)
        index = (self.folder / "docs/README.html").read_text()
        places = [index.index(f">{caption}<") for caption in re.findall(r"^\*\*([^*\n]+)\*\*", (TOP / "docs/README.md").read_text(), re.M)
                  if f'caption-text">{caption}<' in index]
        self.assertGreater(len(places), 4)
        self.assertEqual(places, sorted(places))
        for page in self.folder.rglob("*.html"):
            text = page.read_text()
            for source in re.findall(r'<(?:img|script)[^>]* src="([^"?]+)', text):
                self.assertTrue((page.parent / source).exists(), f"{page}: {source}")
            self.assertNotRegex(text, r"""<(?:script|link|img)[^>]*(?:src|href)=["'](?:https?:)?//""")

    def small(self, index):
        """The manual of a tree of its own, with this index and a page `a.md`."""
        with tempfile.TemporaryDirectory() as folder:
            top = Path(folder)
            (top / "docs").mkdir()
            shutil.copytree(TOP / "tools/sphinx", top / "tools/sphinx")
            for name in ("CMakeLists.txt", "tools/manual", "tools/packages", "tools/packages-manual.txt"):
                shutil.copy(TOP / name, top / name)
            (top / "docs/a.md").write_text('# A\n\n## Part\n\n$x$:\n\n<a id="eq-1.1"></a>\n\n$$\nx = y \\tag{1.1}\n$$\n')
            (top / "docs/README.md").write_text(f"# Index\n\n**Pages**: {index}\n")
            return manual(top, top / "pages")

    def test_names_broken_links_and_pages_that_the_index_forgets(self):
        good = self.small("[a](a.md), [part](a.md#part), [(1.1)](a.md#eq-1.1)")
        self.assertEqual((good.returncode, good.stderr), (0, ""))
        bad = self.small("[a](a.md#whole) [b](b.md) [c](a.md#eq-1.2) ![x](x.png)")
        self.assertNotEqual(bad.returncode, 0)
        for words in ("a.md#whole", "b.md", "eq-1.2", "x.png", "a.md: WARNING: document isn't included"):
            self.assertIn(words, bad.stderr)


class Browser(Folder):
    def test_formulas_are_drawn(self):
        self.assertEqual(manual(TOP, self.folder).returncode, 0)
        browser = next(path for name in BROWSERS if (path := shutil.which(name)))
        page = self.folder / "docs/theory.html"
        done = subprocess.run([browser, "--headless", "--no-sandbox", "--enable-logging=stderr", "--virtual-time-budget=60000",
                               "--dump-dom", page.as_uri()], capture_output=True, text=True, timeout=120)  # fmt: skip
        self.assertNotIn("CONSOLE", done.stderr)
        self.assertEqual(re.findall(r'<span class="MathJax_Error|<merror[^>]*>.{80}', done.stdout), [])
        written = len(re.findall(r'class="math notranslate', page.read_text()))
        self.assertGreater(written, 500)
        self.assertEqual(len(re.findall(r'<span class="MathJax_SVG"', done.stdout)), written)


if __name__ == "__main__":
    only = "Browser" if "--browser" in sys.argv else "Manual"
    unittest.main(argv=[sys.argv[0], only])
