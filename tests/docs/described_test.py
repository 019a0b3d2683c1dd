#!/usr/bin/python3
"""Manual pages and completion have all commands and options that the program's help shows, and no others.

described_test.py TUBULE SOURCES
"""
import json
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

TUBULE, SOURCES = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
SCRIPTS = SOURCES / "tools/packaging"
sys.path.insert(0, str(SOURCES / "tests/command"))
import schema  # noqa: E402


def run(*command, **options):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stderr
    return done.stdout


def help_of(*command):
    return run(TUBULE, *command, "--help")


def switches(text):
    """Options, long and short, at the beginning of lines of a help text."""
    found = set()
    for names in re.findall(r"^  (-[\w,-]+)", text, re.M):
        found |= set(names.split(","))
    return found


def commands_of_help():
    text = help_of()
    return re.findall(r"^  (\w+)  ", text[text.index("Subcommands:") : text.index("Exit status:")], re.M)


DESCRIBED = run(TUBULE, "--describe")
COMMANDS = commands_of_help()


class Described(unittest.TestCase):
    def test_schema(self):
        self.assertEqual(schema.against("describe", DESCRIBED), [])
        self.assertEqual([command["name"] for command in json.loads(DESCRIBED)["commands"]], COMMANDS)
        self.assertGreater(len(COMMANDS), 9)
        for command in json.loads(DESCRIBED)["commands"]:  # in words of its own, of C++ or Python
            self.assertRegex(help_of(), rf"(?m)^  {command['name']} +{re.escape(command['description'])}$")
            self.assertTrue(help_of(command["name"]).startswith(command["description"] + "\n"), command["name"])

    def test_manual_pages(self):
        with tempfile.TemporaryDirectory() as folder:
            run(SCRIPTS / "manual_pages.py", "1.2", "2026-01-31", folder, input=DESCRIBED)
            pages = {path.name for path in Path(folder).iterdir()}
            self.assertEqual(pages, {"tubule.1", *(f"tubule-{command}.1" for command in COMMANDS)})
            for page, command in [("tubule.1", []), *((f"tubule-{command}.1", [command]) for command in COMMANDS)]:
                path = Path(folder) / page
                text = run("man", "--warnings", "-E", "UTF-8", "-l", path, env={"MANWIDTH": "200", "PATH": "/usr/bin:/bin", "LANG": "C.UTF-8"})
                options = text[text.index("\nOPTIONS\n") : text.index("\nEXIT STATUS\n")].split("\nEXAMPLE")[0]
                found = {name for line in re.findall(r"^ {7}(-.*)", options, re.M) for name in re.findall(r"(?<!\S)--?[\w-]+", line)}
                self.assertEqual(found, switches(help_of(*command)), page)
                for line in help_of(*command).splitlines():
                    if line.startswith("  tubule "):
                        self.assertIn(line.strip(), text)
            whole = (Path(folder) / "tubule.1").read_text()
            for command in COMMANDS:
                self.assertIn(f"\\fB{command}\\fR", whole)

    def completed(self, script, *words):
        """What bash offers for the last one of the words."""
        line = " ".join(map(repr, words))
        ask = f"source {script}; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; compopt() {{ :; }}; _tubule; printf '%s\\n' \"${{COMPREPLY[@]}}\""
        return set(run("bash", "--norc", "-c", ask).split())

    def test_bash(self):
        with tempfile.NamedTemporaryFile("w") as script:
            script.write(run(SCRIPTS / "completion.py", "bash", input=DESCRIBED))
            script.flush()
            self.assertEqual(self.completed(script.name, "tubule", ""), set(COMMANDS))
            self.assertEqual(self.completed(script.name, "tubule", "s"), {"stability", "scan", "show"})
            self.assertEqual(self.completed(script.name, "tubule", "-"), switches(help_of()))
            for command in COMMANDS:
                self.assertEqual(self.completed(script.name, "tubule", command, "-"), switches(help_of(command)), command)
            kinds = re.search(r"--kind TEXT:\{(.*?)\}", help_of("plot"))[1].split(",")
            self.assertEqual(self.completed(script.name, "tubule", "plot", "a.hdf", "--kind", ""), set(kinds))
            self.assertEqual(self.completed(script.name, "tubule", "run", ""), set())  # files, which bash finds by itself

    def test_zsh(self):
        text = run(SCRIPTS / "completion.py", "zsh", input=DESCRIBED)
        parts = re.split(r"^ {16}(\w+)\)$", text, flags=re.M)
        self.assertEqual(parts[1::2], COMMANDS)
        for command, part in zip(COMMANDS, parts[2::2]):
            found = set()
            for names in re.findall(r"^ {24}(?:'\([^)]*\)'|'\*')?(?:\{([\w,-]+)\}|'\*?(-[\w-]+))", part, re.M):
                found |= set("".join(names).split(","))
            self.assertEqual(found, switches(help_of(command)), command)
        try:
            run("zsh", "-n", input=text)
        except FileNotFoundError:
            pass  # its syntax is looked at where there is a zsh

    def test_installed_cases_are_found_from_anywhere(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertIn("k42 = 0.06", run(TUBULE, "check", "--quick", "cases/figure_k42_006.toml", cwd=folder))
            chart = subprocess.run([TUBULE, "chart", "cases/decay.toml"], cwd=folder, capture_output=True, text=True)
            self.assertIn("is a case: it needs --vary", chart.stderr)
            missing = subprocess.run([TUBULE, "check", "cases/none.toml"], cwd=folder, capture_output=True, text=True)
            self.assertEqual(missing.returncode, 2)
            self.assertIn("cases/none.toml: cannot be opened", missing.stdout + missing.stderr)
            (Path(folder) / "cases").mkdir()
            (Path(folder) / "cases/figure_k42_006.toml").write_text("nonsense")  # what is here goes first
            here = subprocess.run([TUBULE, "check", "cases/figure_k42_006.toml"], cwd=folder, capture_output=True, text=True)
            self.assertEqual(here.returncode, 2)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
