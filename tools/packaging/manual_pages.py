#!/usr/bin/python3
"""Manual pages, from what the program says of itself: one of tubule and one of each command.

    tubule --describe | manual_pages.py VERSION DATE FOLDER
"""

import json
import re
import sys
from pathlib import Path

PARENT = "tubule"


def escaped(text):
    text = text.replace("\\", "\\(rs").replace("-", "\\-").replace("'", "\\(aq").replace("`", "\\(ga")
    return re.sub(r"^([.'])", r"\\&\1", text, flags=re.M)


def bold(text):
    return f"\\fB{escaped(text)}\\fR"


def value_name(option):
    if option["choices"]:
        return "|".join(option["choices"])
    return option["type"].partition(":")[0] or "TEXT"


def option_lines(option):
    value = value_name(option) if option["type"] else ""
    names = ", ".join(bold(name) + (f" \\fI{escaped(value)}\\fR" if value else "") for name in option["names"])
    default = f" Default: {option['default']}." if option["default"] else ""
    repeated = " May be repeated." if option["repeated"] and "repeated" not in option["description"] else ""
    text = option["description"]
    end = "." if (default or repeated) and not text.endswith(".") else ""
    return [".TP", names, escaped(text + end + default + repeated)]


def synopsis(command, name):
    words = [bold(name), "[\\fIOPTION\\fR]..."]
    for option in command["options"]:
        if option["positional"]:
            words.append(f"\\fI{escaped(option['names'][0])}\\fR" + ("..." if option["repeated"] else ""))
    return " ".join(words)


def footer_lines(footer):
    """Examples, exit status and pages to read, which end the help of a command."""
    lines = []
    for line in footer.splitlines():
        if re.match(r"Examples?:$", line):
            lines.append(".SH EXAMPLES")
        elif line == "Exit status:":
            lines.append(".SH EXIT STATUS")
        elif line.startswith("More:"):
            pages = [f"/usr/share/doc/tubule/{page}" for page in line.split()[1:]]
            lines += [".SH MORE", escaped(", ".join(pages))]
        elif match := re.match(r"  (\d+)\s+(.*)", line):
            lines += [".TP", bold(match[1]), escaped(match[2])]
        else:
            lines += [".PP", ".nf", ".RS 4", escaped(line.strip()), ".RE", ".fi"]
    return lines


def sentence(text):
    return text[:1].lower() + text[1:].rstrip(".")


def page(command, version, date, others):
    whole = command["name"] == PARENT
    title = PARENT if whole else f"{PARENT}-{command['name']}"
    called = PARENT if whole else f"{PARENT} {command['name']}"
    lines = [f'.TH {escaped(title.upper())} 1 "{date}" "Tubule {version}" "User Commands"', ".SH NAME"]
    lines.append(f"{escaped(title)} \\- {escaped(sentence(command['description']))}")
    lines += [".SH SYNOPSIS", synopsis(command, called)]
    if whole:
        lines += [".br", f"{bold(PARENT)} \\fICOMMAND\\fR [\\fIOPTION\\fR]... \\fIFILE\\fR..."]
        lines.append(".SH COMMANDS")
        for other in command["commands"]:
            lines += [".TP", bold(other["name"]), escaped(other["description"])]
    arguments = [option for option in command["options"] if option["positional"]]
    if arguments:
        lines.append(".SH ARGUMENTS")
        for option in arguments:
            lines += [".TP", f"\\fI{escaped(option['names'][0])}\\fR", escaped(option["description"])]
    lines.append(".SH OPTIONS")
    for option in command["options"]:
        if not option["positional"]:
            lines += option_lines(option)
    lines += footer_lines(command["footer"])
    if whole:
        lines += [".SH FILES", ".TP", "\\fI/usr/share/tubule/cases\\fR"]
        lines.append(escaped("Examples. Where there is no file cases/NAME.toml, the commands take the one installed here."))
    lines += [".SH SEE ALSO", ", ".join(f"{bold(name)}(1)" for name in others if name != title)]
    return title, "\n".join(lines) + "\n"


def main():
    version, date, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    program = json.load(sys.stdin)
    names = [PARENT, *(f"{PARENT}-{command['name']}" for command in program["commands"])]
    folder.mkdir(parents=True, exist_ok=True)
    for command in [program, *program["commands"]]:
        title, text = page(command, version, date, names)
        (folder / f"{title}.1").write_text(text)


if __name__ == "__main__":
    main()
