#!/usr/bin/python3
"""Comments of a header as Doxygen reads them: that of the file, those above a declaration, those behind a member.

A comment above several declarations without a blank line between them is that of all of them.
"""
import re
import sys
from pathlib import Path

BEHIND = re.compile(r'((?:[^"/]|/(?!/)|"(?:[^"\\]|\\.)*")*[\w;,})])\s+//(?!/)\s?(\S.*)$')
COMMENT = re.compile(r"(\s*)//(?!/)\s?(.*)$")
# What begins a declaration that may share the comment of the one above.
DECLARATION = re.compile(r"\s*(?!return|public|private|protected|namespace|using|#|[{}]|if|for|else)[\w:<~].*[;({]")


def filtered(lines, path):
    """Line by line, so that line numbers stay."""
    length = next((i for i, line in enumerate(lines) if not line.startswith("//")), 0)  # of the comment of the file
    column = -1  # of a comment behind a declaration, which may go on below
    shared, indent, begins = "", "", False  # the comment above, its indent, whether a declaration has just ended
    for number, line in enumerate(lines):
        comment, behind = COMMENT.match(line), BEHIND.match(line)
        if number < length:
            yield "/// " + comment[2] + (f" @file {path}" if number == length - 1 else "")
        elif comment:
            goes_on = len(comment[1]) == column
            if not goes_on:
                shared = f"{shared} {comment[2]}" if not begins and shared and indent == comment[1] else comment[2]
                indent, begins = comment[1], False
            yield f"{comment[1]}///{'<' if goes_on else ''} {comment[2]}"
        elif behind and not line.startswith("#"):
            column = line.index("//", len(behind[1]))
            yield f"{behind[1]}  ///< {behind[2]}"
        else:
            column = -1
            own = line.startswith(indent) and not line.startswith(indent + " ")
            if not line.strip():
                shared = ""
            elif shared and begins and own and DECLARATION.match(line):
                line = f"{indent}/** {shared} */ {line.strip()}"
            begins = line.rstrip().endswith((";", "}"))
            yield line


if __name__ == "__main__":
    name = Path(sys.argv[1])
    sys.stdout.write("\n".join(filtered(name.read_text(encoding="utf-8").split("\n"), name)))
