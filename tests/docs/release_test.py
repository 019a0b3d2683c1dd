#!/usr/bin/python3
"""What a release states: one version everywhere, references that the manual has, checks that are those of everybody.

release_test.py SOURCES
"""
import json
import re
import sys
import unittest
from pathlib import Path

TOP = Path(sys.argv.pop(1))


def text(name):
    return (TOP / name).read_text()


class Release(unittest.TestCase):
    def test_one_version(self):
        version = re.search(r"project\(Tubule VERSION ([\d.]+)", text("CMakeLists.txt"))[1]
        short = version.rpartition(".")[0]
        stated = {
            "CITATION.cff": re.search(r"^version: (\S+)", text("CITATION.cff"), re.M)[1],
            "codemeta.json": json.loads(text("codemeta.json"))["version"],
            "CHANGELOG.md": re.search(r"^## (\S+)", text("CHANGELOG.md"), re.M)[1],
            "debian/changelog": re.search(r"^tubule \(([^)]+)\)", text("tools/packaging/debian/changelog"))[1],
        }
        self.assertEqual(stated, dict.fromkeys(stated, version))
        self.assertIn(f"Package: libtubule{short}\n", text("tools/packaging/debian/control"))
        self.assertTrue((TOP / f"tools/packaging/debian/libtubule{short}.install").exists())
        self.assertIn(f"libtubule{short}", text("docs/installation.md"))

    def test_references_of_the_paper(self):
        """Each is cited, and its DOI is one that the manual cites."""
        keys, dois = (re.findall(rule, text("paper.bib"), re.M) for rule in (r"^@\w+\{(\w+),", r"doi = \{(.+)\}"))
        self.assertEqual(sorted(set(re.findall(r"@(\w+)", text("paper.md")))), sorted(keys))
        manual = "".join(path.read_text() for path in (TOP / "docs").rglob("*.md"))
        self.assertEqual([doi for doi in dois if doi not in manual], [])

    def test_public_checks_are_the_project_s(self):
        self.assertEqual(re.findall(r"run: (.*)", text(".github/workflows/check.yml")), [".ci/run"])


if __name__ == "__main__":
    unittest.main()
