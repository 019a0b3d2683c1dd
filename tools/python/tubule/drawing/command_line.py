"""The command lines of `tubule plot`, `view`, `export` and `chart`, and what all scripts that draw share. Standard library only."""

import argparse
import difflib
import json
import math
import os
import re
import sys
import textwrap

EXIT_BAD_INPUT, EXIT_UNAVAILABLE, EXIT_INTERRUPTED = 2, 4, 130
DEBIAN_PACKAGES = {"numpy": "python3-numpy", "matplotlib": "python3-matplotlib", "h5py": "python3-h5py"}
KINDS = ("profiles", "surface", "cuts", "energy", "balance", "all")
COLOURS = ("H", "K", "u_n", "p", "H0", "energy_density")
SCALES = ("run", "shape")
PLANE = re.compile(r"([xyz])=([-+.\deE]+)")
BAD_INPUT = "invalid input, and nothing was written; or the output could not be written"


class Unavailable(Exception):
    """What is missing on this machine, and what to install."""


class BadInput(Exception):
    """One line for the user: which file or argument is wrong, and why."""


class Help(Exception):
    """An answer instead of a picture."""


# ---- the value of an option: functions from its text, which raise ArgumentTypeError


def value(parse, words):
    """That of parse(text), which raises ValueError or TypeError for what is none; then `words` say so of the text, {}."""

    def parsed(text):
        try:
            return parse(text)
        except (ValueError, TypeError, argparse.ArgumentTypeError):
            raise argparse.ArgumentTypeError(words.format(text)) from None

    return parsed


def finite(text):
    if not math.isfinite(float(text)):
        raise ValueError(text)
    return float(text)


def number(low=-math.inf, high=math.inf, parse=value(finite, "{} is not a finite number")):
    def parsed(text):
        if not low <= parse(text) <= high:
            raise argparse.ArgumentTypeError(f"{text} is not between {low:g} and {high:g}")
        return parse(text)

    return parsed


def listed(parse):
    return lambda text: [parse(one) for one in text.split(",") if one]


def one_of(words):
    return value(lambda text: words[words.index(text)], f"{{!r}} is not one of {', '.join(words)}")


def colour(text):
    return text if re.fullmatch(r"mode_[1-9]\d*", text) else one_of((*COLOURS, "mode_1", "..."))(text)


def file_name(text):
    if not text.strip():
        raise argparse.ArgumentTypeError("must not be blank: give the file a name")
    return text


def position(text):
    found = PLANE.fullmatch(text)
    return found[1], finite(found[2])


def angles(text):
    azimuth, elevation = text.split(",")
    return number(-360, 360)(azimuth), number(-90, 90)(elevation)


def changes(text):
    if text not in ("", "none") and not all("=" in part for part in text.split(",")):
        raise ValueError(text)
    return text


integer = value(int, "{} is not an integer")
time = value(lambda text: math.inf if text == "end" else finite(text), "'{}' is not a list of numbers t1,t2,... or end")
plane = value(position, "'{}' is not x, y or z = number, such as z=0")
camera = value(angles, "'{}' is not AZIMUTH,ELEVATION in degrees, up to 360 and 90, such as -37,22")
units = value(changes, "'{}' is neither none nor key=value,..., as in length=50 nm,bending_rigidity=20 kT")


# ---- the commands


class Parser(argparse.ArgumentParser):
    """Its help and its words about what is wrong are as those of the program's other commands."""

    def __init__(self, name, description, examples, statuses, page):
        super().__init__(prog=f"tubule {name}", description=description, add_help=False, allow_abbrev=False)
        self.name = name
        lines = ["Example:" if len(examples) == 1 else "Examples:", *(f"  tubule {name} {words}" for words in examples), "Exit status:"]
        statuses = {0: "finished as requested", 2: BAD_INPUT, **statuses}
        self.footer = "\n".join([*lines, *(f"  {code:<4} {words}" for code, words in statuses.items()), f"More: docs/{page}.md"])
        self.option("-h", "--help", type=None, help="Print this help message and exit")

    def option(self, *names, help, type=str, metavar="TEXT", words=(), **more):
        """With `type` None it is a flag. `words`: the only ones of which its value consists."""
        more = {"action": "store_true"} if type is None else {"type": type, "metavar": metavar, **more}
        self.add_argument(*names, help=help, **more).words = words

    def described(self):
        """docs/schemas/describe.json"""
        options = [
            {
                "names": sorted(action.option_strings, key=lambda name: not name.startswith("--")) or [action.metavar],
                "positional": not action.option_strings,
                "type": "" if action.nargs == 0 else action.metavar + (f":{{{','.join(action.words)}}}" if action.words else ""),
                "choices": list(action.words),
                "default": action.default if isinstance(action.default, str) else "",
                "repeated": action.nargs == "+" or isinstance(action.default, list),
                "required": action.required,
                "description": action.help,
            }
            for action in self._actions
        ]
        return {"name": self.name, "description": self.description, "footer": self.footer, "options": options, "commands": []}

    def format_help(self):
        said = self.described()
        lines = {True: [], False: []}
        for option in said["options"]:
            left = ",".join(reversed(option["names"])) + (f" {option['type']}" if option["type"] and not option["positional"] else "")
            left += f"={option['default']}" if option["default"] else ""
            left = f"  {left}{' ...' if option['repeated'] else ''}{' REQUIRED' if option['required'] else ''}"
            lines[option["positional"]] += [*([f"{left:<29} {option['description']}"] if len(left) < 29 else [left, " " * 30 + option["description"]])]
        name = next(option for option in said["options"] if option["positional"])
        usage = f"Usage: {self.prog} [OPTIONS] {name['names'][0]}{'...' if name['repeated'] else ''}"
        return "\n".join([said["description"], usage, "", "Positionals:", *lines[True], "", "Options:", *lines[False], "", self.footer, ""])

    def error(self, message):
        for words, plain in ((r"argument (\S+): expected one argument", r"\1: a value is missing after it"),
                             (r"the following arguments are required: (\S+)", r"\1 is missing"), (r"argument (.*)", r"\1")):  # fmt: skip
            message = re.sub(f"^{words}", plain, message)
        raise BadInput(f"{self.prog}: {message}")

    def parsed(self, words):
        """The options. Raises BadInput, and Help where that is asked for."""
        if "--describe" in words:
            raise Help(json.dumps(self.described()))
        takes = {name: action.option_strings[-1] for action in self._actions if action.nargs != 0 for name in action.option_strings}
        options, files, rest = [], [], iter(words)
        for word in rest:  # values are joined to their options, since they may begin with a hyphen as well
            if word == "--":
                files += rest
            elif word in takes:
                options += [word if value is None else f"{takes[word]}={value}" for value in [next(rest, None)]]
            else:
                (options if word.startswith("-") else files).append(word)
        if {"-h", "--help"} & set(options):
            raise Help(self.format_help())
        unknown = [word for word in options if word.partition("=")[0] not in self._option_string_actions and word[:2] not in takes]
        if unknown:
            self.unexpected(unknown)
        found, more = self.parse_known_args(options + (["--", *files] if files else []))
        if more:
            self.unexpected(more)
        return found

    def unexpected(self, words):
        names = [name for name in self._option_string_actions if name.startswith("--")]
        near = difflib.get_close_matches(words[0].partition("=")[0], names, 1)
        known = f"; options are {' '.join(names)}" if words[0].startswith("-") else ""
        meant = f"; did you mean '{near[0]}'?" if near else known
        if words[0].startswith(("\u2013", "\u2014")):
            meant = "; an option begins with the hyphen of the keyboard, -"
        raise BadInput(f"{self.prog}: not expected: {' '.join(words)}{meant}\nRun `{self.prog} --help` for more information.")


UNITS = {"type": units, "default": "",
         "help": "keys of [units], as \"length=50 nm,bending_rigidity=20 kT\", or none (default: those of the case)"}  # fmt: skip


def plot():
    parser = Parser(
        "plot", "Draw shapes and cuts through them at the output times, and energies over time",
        ("figure.hdf -o figure.svg", "k42.hdf --quantity energy --slice shape.radius=1 -o energy.png", "figure.hdf --movie figure.gif"),
        {4: "the picture could not be drawn"}, "pictures")  # fmt: skip
    option = parser.option
    option("results", metavar="RESULT", nargs="+", help="result files; several are labelled by what differs in their cases")
    option("-o", "--output", type=file_name, action="append", default=[],
           help="picture to write, .png, .svg or .pdf; may be repeated (default: both RESULT.png and .svg)")  # fmt: skip
    option("--times", type=listed(time), metavar="T1,T2,...", help="times of the frames, such as 0,0.05,end (default: up to six frames, between which the energy changes equally)")
    option("--kind", type=listed(one_of(KINDS)), words=KINDS, default="all", help=f"what to draw: {', '.join(KINDS)}, or several as in surface,energy")
    option("--colour", type=listed(colour), words=COLOURS, action="extend", default=[],
           help="quantities to colour shapes by: H, K, u_n (with arrows for the flow along them), p, H0, energy_density, of a surface in equilibrium "
                "mode_1 ..., or several as in u_n,H (default: H of surfaces that move, else H,K; profiles: left and right half)")  # fmt: skip
    option("--scale", type=one_of(SCALES), words=SCALES, default="run",
           help="velocities are drawn relative to the largest one of the run, or of each shape")  # fmt: skip
    option("--label", action="append", default=[], help="label of a result, one for each, in their order (default: what differs in their cases)")
    option("--camera", type=camera, metavar="AZIMUTH,ELEVATION", default="-37,22", help="from where surfaces are seen, in degrees from the x axis and above its plane")
    option("--plane", type=plane, default="z=0", help="of the cuts through surfaces: x, y or z = number")
    option("--series", type=listed(str), action="extend", default=[],
           help="series to draw instead of all else, such as r_min,r_max; `tubule show --csv` lists them")  # fmt: skip
    option("--x", default="time", help="with --series: the series they are drawn against")
    option("--from", type=number(), metavar="FLOAT", dest="low", help="draw series from this value of --x, energies from this time")
    option("--to", type=number(), metavar="FLOAT", dest="high", help="draw series up to this value of --x, energies up to this time")
    option("--logx", type=None, help="of series and energies: logarithmic horizontal axis")
    option("--logy", type=None, help="with --series: logarithmic vertical axis")
    option("--quantity", default="", help="of a scan: what its map shows: outcome (default), energy, r_min, volume, steps ... (all columns of show --csv)")
    option("--slice", action="append", default=[], help="of a scan with more than two axes: key=value of an axis that is cut; may be repeated")
    option("--confirmed", help="of a scan: the output of `tubule confirm --json`, whose points are marked on the map")
    option("--width", type=number(3, 20), metavar="FLOAT", default="7", help="inches of the page; below 5, for a column of a journal, legends and colour bars are below each other")
    option("--units", **UNITS)
    option("--dpi", type=number(30, 1200), metavar="FLOAT", default="300", help="pixels per inch of a .png, and of surfaces within .svg and .pdf")
    option("--movie", help="film to write instead, .mp4 (needs ffmpeg) or .gif: the shape of one result, frame by frame, "
                           "coloured by H or the given --colour, and its energy")  # fmt: skip
    option("--fps", type=number(0.1, 100), metavar="FLOAT", default="10", help="with --movie: frames per second")
    return parser


def view():
    parser = Parser(
        "view", "Write one HTML page with the shapes of a result, to turn in a browser, or with the map of a scan",
        ("figure.hdf",), {4: "the page could not be made"}, "pictures")  # fmt: skip
    parser.option("result", metavar="RESULT", help="result of run, equilibrium or scan")
    parser.option("-o", "--output", type=file_name, help="page to write (default: RESULT.html)")
    parser.option("--units", **UNITS)
    return parser


def export():
    parser = Parser(
        "export", "Write a shape of a result as flat triangles: STL, PLY or OBJ",
        ("figure.hdf -o figure.stl", "figure.hdf --frame 0 --subdivide 8 -o figure.ply"), {4: "the file could not be made"}, "meshes")  # fmt: skip
    parser.option("result", metavar="RESULT", help="result of run or equilibrium")
    parser.option("-o", "--output", type=file_name, action="append", required=True,
                  help="file to write, .stl (binary), .ply (binary, double precision) or .obj; may be repeated")  # fmt: skip
    parser.option("--frame", type=integer, metavar="INT", default="-1", help="which shape, counted from 0, or from -1 backwards")
    parser.option("--subdivide", type=number(1, 64, integer), metavar="INT",
                  help="n: a curved triangle becomes n^2 flat ones, a profile is revolved with 24 n points around its widest circle "
                       "(default: the degree of the triangles; 4)")  # fmt: skip
    return parser


def chart():
    parser = Parser(
        "chart", "Run a case with many settings, and draw error against CPU time",
        ("cases/decay.toml --vary accuracy.energy=1e-2,1e-4,1e-6 -o decay.svg",),
        {4: "a run, the data or the picture failed", 130: "interrupted; the same command continues"}, "charts")  # fmt: skip
    option, many = parser.option, {"action": "append", "default": []}
    option("file", metavar="FILE", help="a chart (docs/charts.md), or a case together with --vary")
    option("--vary", **many, help="key=value,value,...: a key with its values. The last --vary makes the points of a line, those before it make lines")
    option("--also", **many, help="key=value,key=value,...: further lines, with these keys set")
    option("--map", help="key=from:to:n: largest stable value of the key (a step), n values a decade, over the last --vary")
    option("--set", **many, help="override a key in all runs")
    option("--reference", help="a result to measure errors against (default: the run with the smallest estimated error)")
    option("--quantity", help="series whose error is drawn (default: energy)")
    option("--times", type=listed(time), metavar="T1,T2,...", help="times of the errors, such as 0.05,0.1 (default: outputs and end)")
    option("-o", "--output", type=file_name, **many,
           help="picture, .svg, .png or .pdf; may be repeated (default: FILE.svg, in this directory). The data are written "
                "beside the first, .csv")  # fmt: skip
    option("--jobs", type=integer, metavar="INT", default="1", help="runs at a time; 1 for times that can be compared")
    option("--limit", type=number(), metavar="FLOAT", help="seconds after which a run is given up (default 600)")
    option("--study", type=None, help="also what the chart marks as a study: long runs")
    option("--again", type=None, help="repeat runs that the data hold already")
    option("--draw", type=None, help="run nothing: draw what the data hold")
    option("--quiet", type=None, help="no lines of progress")
    return parser


def plot_options(words):
    """The options of `tubule plot`, and of draw() in Python. Raises BadInput."""
    options = plot().parsed(words)
    for name in options.results if options.times else ():  # "--times 0 0.1 10"
        if re.fullmatch(r"[-+.\deE]+", name) and not os.path.exists(name):
            raise BadInput(f"--times: several times are separated by commas, without spaces: --times {options.times[-1]:g},{name}")
    if not options.series and (options.logy or options.x != "time"):
        raise BadInput("tubule plot: --x and --logy belong to --series")
    options.times = options.times or []
    return options


# The script's options by its name, for those that the program forwards.
COMMANDS = {"plot": plot_options} | {make.__name__: lambda words, make=make: make().parsed(words) for make in (view, export, chart)}


# ---- what scripts share


def say(words, out=None):
    """Prints words, by default to stderr. Nothing depends on them: where they cannot be written, they are left out."""
    out = out or sys.stderr
    try:
        print(words, file=out, flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), out.fileno())  # else what is left in its buffer fails again at exit


def status_of(work):
    """Its exit status, and words for what ends it."""
    try:
        return work()
    except Help as answer:
        try:
            print(answer, flush=True)
            return 0
        except OSError as error:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            say(f"tubule: cannot write the output: {error.strerror}")
            return EXIT_BAD_INPUT
    except BadInput as error:
        say(error)
        return EXIT_BAD_INPUT
    except (MemoryError, Unavailable) as error:
        say("out of memory" if isinstance(error, MemoryError) else error)
        return EXIT_UNAVAILABLE
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED


def why_missing(path):
    """What may have been meant by the name of a file that is not there."""
    folder, name = os.path.split(path)
    case = os.path.splitext(name)[0] + ".toml"
    if path.startswith("~"):
        return "; ~ does not stand for the home directory here: write the whole path"
    if name.endswith(".hdf") and os.path.exists(os.path.join(folder, case)):
        return f"; tubule run {case} makes it"
    others = os.listdir(folder or ".") if os.path.isdir(folder or ".") else []
    near = difflib.get_close_matches(name, [other for other in others if os.path.splitext(other)[1] == os.path.splitext(name)[1]], 1)
    return f"; did you mean {near[0]}?" if near else ""


def check_file(path):
    """Raises BadInput if there is none of this name that could be a result."""
    if not os.path.exists(path):
        raise BadInput(f"{path}: no such file{why_missing(path)}")
    if not os.path.isfile(path):
        raise BadInput(f"{path}: is a directory, a pipe or a device, not a file")
    if path.endswith(".toml"):
        raise BadInput(f"{path}: is a case file, not a result: run it first (tubule run {path}; tubule scan for a scan), then give "
                       f"its result, {os.path.basename(path)[:-5]}.hdf")  # fmt: skip


def check_output(path, formats, what):
    """Raises BadInput, before any work, for a file that cannot be written, "a picture is", say."""
    if os.path.splitext(path)[1].lower() not in formats:
        raise BadInput(f"{path}: {what} written as one of {', '.join(formats)}")
    folder = os.path.dirname(path) or "."
    if not os.path.isdir(folder):
        raise BadInput(f"{path}: the folder {folder} does not exist")


def require_libraries(program):
    """Raises Unavailable, naming the package, if a library is missing. To be called before the imports that need them."""
    # A result file never changes in place, so it needs no lock; on some disks locks fail.
    os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")
    for module, package in DEBIAN_PACKAGES.items():
        try:
            __import__(module)
        except ImportError:
            raise Unavailable(f"{program}: {sys.executable} has no {module}; install the package {package}") from None


def run(draw, outputs, name=None):
    """Calls draw(outputs) and prints the pictures by name(path), if given. The exit status."""
    from . import style

    style.check_outputs(outputs)
    draw(outputs)
    for path in outputs if name else ():
        say(name(path), sys.stdout)
    return 0


def main(description, draw, argument="table", nargs=None):
    """Calls draw(argument, outputs) with what the command line gives, and prints the pictures where there is an argument."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    if argument:
        parser.add_argument(argument, nargs=nargs)
    parser.add_argument("-o", "--output", action="append", required=True)
    options = parser.parse_args()
    given = argument and getattr(options, argument)
    return run(lambda outputs: draw(given, outputs), options.output, argument and os.path.relpath)
