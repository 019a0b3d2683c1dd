#!/usr/bin/python3
"""Completion of the command line for bash and zsh, from what the program says of itself.

    tubule --describe | completion.py bash or zsh
"""

import json
import re
import sys

SOURCE = "made by tools/packaging/completion.py from `tubule --describe`"
NUMBERS = ("INT", "UINT", "FLOAT")


def kind(option):
    """What its value is: "" for a flag, "choices", "number", "file"."""
    if not option["type"]:
        return ""
    if option["choices"]:
        return "choices"
    return "number" if option["type"].startswith(NUMBERS) else "file"


def switches(command):
    return [option for option in command["options"] if not option["positional"]]


def bash(program):
    names = [command["name"] for command in program["commands"]]
    everything = [("", program), *((command["name"], command) for command in program["commands"])]
    lines = [f"# bash completion of tubule, {SOURCE}", "_tubule()", "{"]
    lines += ["    local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} command= words= word"]
    lines += ['    for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do', "        case $word in"]
    lines += [f"            {' | '.join(names)})", "                command=$word", "                break", "                ;;"]
    lines += ["        esac", "    done", "    case $command:$previous in"]
    for name, command in everything:
        for option in switches(command):
            if kind(option) not in ("choices", "number"):
                continue
            lines += [f"        {' | '.join(f'{name}:{switch}' for switch in option['names'])})"]
            lines += [f"            words='{' '.join(option['choices'])}'"] if option["choices"] else ["            compopt +o default"]
            lines += ['            COMPREPLY=($(compgen -W "$words" -- "$current"))', "            return", "            ;;"]
    lines += ["    esac", "    case $command in"]
    for name, command in everything:
        words = " ".join(switch for option in switches(command) for switch in option["names"])
        lines += [f"        {name or chr(39) * 2})", f"            words='{words}'", "            ;;"]
    lines += ["    esac", "    if [[ $current == -* ]]; then", '        COMPREPLY=($(compgen -W "$words" -- "$current"))']
    lines += ["    elif [[ -z $command ]]; then", f"        COMPREPLY=($(compgen -W '{' '.join(names)}' -- \"$current\"))"]
    lines += ["    fi  # else the names of files", "}", "complete -o default -F _tubule tubule"]
    return "\n".join(lines) + "\n"


def quoted(text):
    return "'" + text.replace("'", "'\\''") + "'"


def said(text):
    """A description within the brackets of an option."""
    return re.sub(r"([\[\]:\\])", r"\\\1", text)


def action(option):
    if option["choices"]:
        return f":value:({' '.join(option['choices'])})"
    return {"": "", "number": ":number: ", "file": ":file:_files"}[kind(option)]


def zsh_options(command):
    for option in switches(command):
        names, repeated = option["names"], "*" if option["repeated"] else ""
        text = f"[{said(option['description'])}]{action(option)}"
        if len(names) == 1:
            yield quoted(f"{repeated}{names[0]}{text}")
        else:
            apart = quoted(repeated) if repeated else quoted(f"({' '.join(names)})")
            yield f"{apart}{{{','.join(names)}}}{quoted(text)}"


def zsh(program):
    lines = ["#compdef tubule", f"# zsh completion of tubule, {SOURCE}", "_tubule() {"]
    lines += ["    local curcontext=$curcontext state", "    local -a commands=("]
    lines += [f"        {quoted(command['name'] + ':' + said(command['description']))}" for command in program["commands"]]
    lines += ["    )", "    _arguments -C \\"]
    lines += [f"        {option} \\" for option in zsh_options(program)]
    lines += ["        '1:command:->command' '*::argument:->arguments'", "    case $state in"]
    lines += ["        command) _describe command commands ;;", "        arguments)", "            case $words[1] in"]
    for command in program["commands"]:
        lines += [f"                {command['name']})", "                    _arguments \\"]
        lines += [f"                        {option} \\" for option in zsh_options(command)]
        lines += ["                        '*:file:_files'", "                    ;;"]
    lines += ["            esac", "            ;;", "    esac", "}", '_tubule "$@"']
    return "\n".join(lines) + "\n"


def main():
    print({"bash": bash, "zsh": zsh}[sys.argv[1]](json.load(sys.stdin)), end="")


if __name__ == "__main__":
    main()
