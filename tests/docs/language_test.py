#!/usr/bin/python3
"""Pages and texts of the program use the terms of the field, in place of the phrases of a list. Argument: the top of the
source tree. A phrase may be broken over lines, or over literals that follow each other; comments are not looked at."""

import re
import sys
import tokenize
import unittest
from pathlib import Path

TOP = Path(sys.argv.pop(1)) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
SAY_INSTEAD = {
    r"shapes? at rest": "equilibrium shape, or stationary shape",
    r"waves? around (the|its|their) axis": "non-axisymmetric mode",
    r"waves that no step resolves": "short-wavelength modes",
    r"ask for (less|more) accuracy|(smaller|larger) accuracy(?!\.)": "use a looser (tighter) accuracy.energy",
    r"stated errors?|(error|energy) as stated": "estimated error",
    r"silent errors?": "undetected error",
    r"the start of the case|makes the start": "the initial shape",
    r"rough (starts?|initial shapes?)": "non-smooth initial shape",
    r"(its|their) fates?": "final state",
}
LINKS = re.compile(r'\]\([^()\s]+\)|<a id="[^"]*">|[\w/.-]+\.md(?:#[\w-]+)?')
LITERALS = re.compile(r"""//[^\n]*|/\*.*?\*/|'(?:\\.|[^\\\n])'|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|`[^`]*`""", re.S)


def literals(path, text):
    """The text with all else as spaces, line by line where it was."""
    if path.suffix in (".cpp", ".hpp", ".js"):
        spans = [match.span() for match in LITERALS.finditer(text) if match[0][:2] not in ("//", "/*")]
    else:
        begins, lines = [match.start() for match in re.finditer(r"^", text, re.M)], iter(text.splitlines(True))
        spans = [[begins[row - 1] + column for row, column in (token.start, token.end)] for token in tokenize.generate_tokens(lines.__next__)
                 if tokenize.tok_name[token.type] in ("STRING", "FSTRING_MIDDLE")]  # fmt: skip
    kept = list(re.sub(r"\S", " ", text))
    for begin, end in spans:
        kept[begin:end] = re.sub(r"""^\w*(?=["'])|["'`]""", lambda quote: " " * len(quote[0]), text[begin:end])
    return "".join(kept)


class Language(unittest.TestCase):
    def expect_terms(self, path, text):
        for phrase, instead in SAY_INSTEAD.items():
            for match in re.finditer(rf"\b(?:{phrase})\b".replace(" ", r"\s+"), text, re.I):
                with self.subTest():
                    line = text.count("\n", 0, match.start()) + 1
                    self.fail(f"{path.relative_to(TOP)}:{line}: say {instead}, not: {' '.join(match[0].split())}")

    def test_pages(self):
        for path in (TOP / "README.md", *sorted((TOP / "docs").rglob("*.md"))):
            self.expect_terms(path, LINKS.sub(lambda link: " " * len(link[0]), path.read_text()))

    def test_texts_of_the_program(self):
        for path in (p for folder in ("common", "axisym", "surface3d", "tools") for p in sorted((TOP / folder).rglob("*")) if p.is_file()):
            if path.suffix in (".cpp", ".hpp", ".js", ".py") or (not path.suffix and path.read_text().startswith("#!/usr/bin/python3")):
                self.expect_terms(path, literals(path, path.read_text()))

    def test_pages_are_short(self):
        """Words outside code blocks and tables that a test writes (between <!-- NAME --> and <!-- end -->)."""
        left_out = re.compile(r"^<!-- [\w, ]+ -->$.*?^<!-- end -->$|^ *```.*?^ *```$", re.M | re.S)
        words = {path: sum(any(map(str.isalnum, word)) for word in left_out.sub("", path.read_text()).split())
                 for path in (TOP / "README.md", *(TOP / "docs").rglob("*.md"))}  # fmt: skip
        self.assertLess(sum(words.values()), 60_000)
        self.assertLess(sum(n for path, n in words.items() if path.parent.name == "decisions"), 12_000)

    def test_keys_are_in_alphabetical_order(self):
        """Within each table of keys of docs/case_files.md."""
        page = (TOP / "docs/case_files.md").read_text()
        for table in re.split(r"^\| \*\*.*$", page.split("## All keys")[1].split("\n## ")[0], flags=re.M)[1:]:
            keys = re.findall(r"^\| `(\w+)`", table, re.M)
            self.assertEqual(keys, sorted(keys, key=str.lower))


if __name__ == "__main__":
    unittest.main()
