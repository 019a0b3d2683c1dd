#!/usr/bin/python3
"""Every command of docs/tutorials/ and of pages like it runs and prints what the page shows.

    tutorials_test.py TUBULE TOP [PAGE...]              compares; without a page all of them
    tutorials_test.py TUBULE TOP --update [PAGE...]     writes what the commands print, and draw, into the pages

Pages are named relative to docs/tutorials/, without their ending. A block ```console has commands after "$ " and what they print; a line "..." there stands for any lines. The file of
"Save this as `NAME`:" is written before the commands that follow it; what `sed -i` and others change stays changed. Numbers
agree within one unit of their last digit, long ones within 1e-5 of themselves. Not compared: times in seconds, sizes in MB, and when something came to rest.
Counts of steps, points and the like agree within a tenth, and errors (at most two digits with an exponent) within a factor
of 2, since both vary with the processor. Numbers below 1e-8 are rounding.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

TUBULE, TOP = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
UPDATE = "--update" in sys.argv
WANTED = [word for word in sys.argv[3:] if not word.startswith("-")]
FOLDER = TOP / "docs/tutorials"
PIECES = re.compile(r"as `([\w.]+)`:\n\n```toml\n(.*?)^```$|^```console\n(.*?)^```$", re.M | re.S)
IGNORED = re.compile(r"\d[\d.]* (?:s|MB)\b|stationary at t = \S+|[0-9T:-]{19}Z")
COUNTS = re.compile(r"(\d+) (steps|rejected|rows|points|amplitudes|nodes|run now|in the last)\b")
ROUNDING = 1e-8  # what is smaller, such as the momentum of a symmetric motion, is zero but for rounding
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\w)")


def commands(block):
    """Pairs of a command and the lines it prints."""
    found = []
    for line in block.rstrip("\n").split("\n"):
        if line.startswith("$ "):
            found.append((line[2:], []))
        elif found:
            found[-1][1].append(line)
    return found


def unit(text):
    """What one in the last digit that is shown stands for."""
    mantissa, _, exponent = text.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def same_number(shown, found):
    a, b = float(shown), float(found)
    if max(abs(a), abs(b)) < ROUNDING:
        return True
    if abs(a - b) <= max(1.001 * unit(shown), 1e-5 * abs(a)):
        return True
    is_error = "e" in shown and len(shown.partition("e")[0].replace(".", "").lstrip("-+")) <= 2
    return is_error and a * b > 0 and 0.5 <= a / b <= 2


def same_line(shown, found):
    shown, found = (IGNORED.sub("(ignored)", line.rstrip()) for line in (shown, found))
    if not same_counts(shown, found):
        return False
    shown, found = (COUNTS.sub(r"(count) \2", line) for line in (shown, found))
    if NUMBER.sub("0", shown).split() != NUMBER.sub("0", found).split():
        return False
    return all(same_number(*pair) for pair in zip(NUMBER.findall(shown), NUMBER.findall(found)))


def same_counts(shown, found):
    a, b = COUNTS.findall(shown), COUNTS.findall(found)
    return len(a) == len(b) and all(abs(int(m) - int(n)) <= 1 + 0.1 * int(m) for (m, _), (n, _) in zip(a, b))


def same(shown, found):
    """Whether the lines agree; "..." stands for any lines, none included."""
    if not shown:
        return not found
    if shown[0].strip() == "...":
        return any(same(shown[1:], found[i:]) for i in range(len(found) + 1))
    return bool(found) and same_line(shown[0], found[0]) and same(shown[1:], found[1:])


def pages():
    return [FOLDER / f"{name}.md" for name in WANTED] or sorted(p for p in FOLDER.glob("*.md") if p.stem != "README")


class Page:
    """A page whose commands run one after the other in a folder of their own."""

    def __init__(self, path, folder):
        self.path, self.folder = path, folder
        (folder / "bin").mkdir()
        (folder / "bin/tubule").symlink_to(TUBULE)
        (folder / "cases").symlink_to(TOP / "cases")
        self.environment = {**os.environ, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}", "OMP_NUM_THREADS": "1"}

    def run(self, command):
        """The lines that the command prints; messages on stderr are shown of those that fail."""
        done = subprocess.run(command, shell=True, cwd=self.folder, env=self.environment, capture_output=True, text=True)
        text = done.stdout + (done.stderr if done.returncode else "")
        return text.rstrip("\n").split("\n") if text else []

    def results(self):
        """For each piece of the page (match, [(command, shown, found)]); writes the files on the way."""
        for piece in PIECES.finditer(self.path.read_text()):
            name, text, block = piece.groups()
            if name:
                (self.folder / name).write_text(text)
            else:
                yield piece, [(command, shown, self.run(command)) for command, shown in commands(block)]


def update(path):
    text, moved = path.read_text(), 0
    with tempfile.TemporaryDirectory() as folder:
        for piece, done in Page(path, Path(folder)).results():
            lines = [line for command, shown, found in done
                     for line in [f"$ {command}", *(shown if same(shown, found) else found)]]
            new = "```console\n" + "\n".join(line.rstrip() for line in lines) + "\n```"
            text = text[: piece.start() + moved] + new + text[piece.end() + moved :]
            moved += len(new) - (piece.end() - piece.start())
        for picture in re.findall(r"\]\((\w+\.png)\)", text):
            shutil.copyfile(Path(folder) / picture, FOLDER / picture)
    path.write_text(text)


class Tutorials(unittest.TestCase):
    maxDiff = None

    def test_commands_print_what_the_pages_show(self):
        self.assertTrue(pages(), FOLDER)
        for path in pages():
            count = 0
            with tempfile.TemporaryDirectory() as folder:
                for _, done in Page(path, Path(folder)).results():
                    for command, shown, found in done:
                        count += 1
                        with self.subTest(page=path.stem, command=command):
                            if not same(shown, found):
                                self.assertEqual("\n".join(shown), "\n".join(found))
            self.assertGreater(count, 3, path)


class Comparison(unittest.TestCase):
    """What counts as the same; otherwise the test above could not fail."""

    def test_numbers(self):
        for shown, found in (("1.25", "1.259"), ("1.5e-05", "2.9e-05"), ("7", "7"), ("0.0101 s", "2 s"), ("12 steps", "13 steps")):
            self.assertTrue(same([shown], [found]), (shown, found))
        for shown, found in (("1.25", "1.27"), ("1.5e-05", "3.1e-05"), ("7", "9"), ("1.523e-05", "1.6e-05"), ("a 1", "b 1"),
                             ("-2.0", "2.0"), ("12 steps", "15 steps"), ("x", "x y")):
            self.assertFalse(same([shown], [found]), (shown, found))

    def test_lines(self):
        self.assertTrue(same(["a", "...", "c"], ["a", "b", "b", "c"]))
        self.assertFalse(same(["a", "...", "c"], ["a", "b"]))
        self.assertFalse(same(["a"], ["a", "b"]))
        self.assertFalse(same([], ["b"]))


if __name__ == "__main__":
    if UPDATE:
        for page in pages():
            update(page)
    else:
        unittest.main(argv=sys.argv[:1])
