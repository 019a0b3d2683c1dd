#!/usr/bin/python3
"""Citations of docs/theory.md and links between the pages of the documentation lead somewhere.

Argument: the top of the source tree. A citation is `theory.md (5.4)`, `theory.md (5.4), (5.6)` or, of a section,
`theory.md 5`; a line break with its comment sign may stand in between.
"""
import re
import sys
import unittest
from pathlib import Path

TOP = Path(sys.argv.pop(1)) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
FOLDERS = ("axisym", "surface3d", "common", "tools", "tests", "cases", "docs")
ENDINGS = {".cpp", ".hpp", ".py", ".toml", ".md", ".cmake", ".txt"}
CITATION = re.compile(r"theory\.md (?:((?:\(\d+\.\d+\)(?:, )?)+)|(\d+)(?!\d|\.\d))")
BADLY_FORMED = re.compile(r"theory\.md[ :,(]{0,2}[(\d]")
RETIRED = re.compile(r"\bmaths[ ][(\d]|[(]maths\b|\bmaths[.]md|\bT[R]AP\b|\(design[)]|\bdesign[ ]\d")


def sources():
    files = [p for folder in FOLDERS for p in sorted((TOP / folder).rglob("*")) if p.suffix in ENDINGS]
    return [p for p in files if "__pycache__" not in p.parts] + sorted(TOP.glob("*.md"))


def joined(text):
    """One line, without the comment signs at which lines begin."""
    return re.sub(r"\s*\n\s*(?:(?://+|#+|\*)\s*)?", " ", text)


def without_code(text):
    text = re.sub(r"^( {0,3})```.*?^\1```", "", text, flags=re.M | re.S)
    text = re.sub(r"^\$\$$.*?^\$\$$", "", text, flags=re.M | re.S)
    return re.sub(r"`[^`\n]*`", "", text)


def anchors(page):
    """GitHub's anchors of the headings of a page, and those that it sets itself."""
    text = page.read_text()
    found = set(re.findall(r'<a id="([^"]+)">', text))
    for heading in re.findall(r"^#{1,6} +(.*?) *$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), flags=re.M):
        slug = re.sub(r"[^\w\- ]", "", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)).lower().replace(" ", "-")
        while slug in found:
            slug += "-1"
        found.add(slug)
    return found


class Theory(unittest.TestCase):
    page = (TOP / "docs/theory.md").read_text()
    sections = re.findall(r"^## (\d+)\. ", page, flags=re.M)
    equations = re.findall(r"\\tag\{([^}]*)\}", page)

    def test_equations_are_numbered_in_order_and_have_anchors(self):
        self.assertEqual(self.sections, [str(i + 1) for i in range(len(self.sections))])
        self.assertEqual(re.findall(r'<a id="eq-([^"]+)">', self.page), self.equations)
        expected = []
        for section, text in zip(self.sections, re.split(r"^## \d+\. ", self.page, flags=re.M)[1:]):
            expected += [f"{section}.{i + 1}" for i in range(text.count("\\tag{"))]
        self.assertEqual(self.equations, expected)

    def test_references_within_the_page_exist(self):
        for number in re.findall(r"\((\d+\.\d+)\)", without_code(self.page)):
            self.assertIn(number, self.equations)

    def test_cited_equations_and_sections_exist(self):
        cited = 0
        for path in sources():
            if path == Path(__file__).resolve():
                continue
            text = joined(path.read_text())
            for equations, section in CITATION.findall(text):
                for number in re.findall(r"\d+\.\d+", equations):
                    self.assertIn(number, self.equations, path)
                if section:
                    self.assertIn(section, self.sections, path)
                cited += 1
            for place in BADLY_FORMED.finditer(text):
                self.assertTrue(CITATION.match(text, place.start()), f"{path}: {text[place.start():][:40]}")
        self.assertGreater(cited, 100)

    def test_no_citation_of_pages_that_are_not_in_the_repository(self):
        for path in sources():
            self.assertIsNone(RETIRED.search(path.read_text()), path)


class Links(unittest.TestCase):
    def test_lead_to_files_and_anchors(self):
        for page in (p for p in sources() if p.suffix == ".md"):
            for target in re.findall(r"\]\(([^()\s]+)\)", without_code(page.read_text())):
                if re.match(r"[a-z]+:", target):
                    continue
                name, _, anchor = target.partition("#")
                file = page.parent / name if name else page
                self.assertTrue(file.exists(), f"{page}: {target}")
                if anchor:
                    self.assertIn(anchor, anchors(file), f"{page}: {target}")


if __name__ == "__main__":
    unittest.main()
