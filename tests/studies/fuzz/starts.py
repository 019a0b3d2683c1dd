"""Starts and energies that users write: profiles as CSV, radii, energies and spontaneous curvatures as formulas, noise; sound, spoilt
and broken.

The program runs each for a moment: no crash, no hang; a refusal names the file and the line, or the case, in whole characters; no
number of a result is nan or inf. A sound profile is never refused, a formula that is not defined on the start always, for that reason."""

import math
import re
import unicodedata

from cases import LIMIT, broken_text, no_number_is_lost
from sandbox import Finding

STUDY = range(10, 50)
FUNCTIONS = ("sqrt", "exp", "log", "sin", "cos", "sinh", "cosh", "tanh", "atan")
OPERATORS = ("+", "+", "-", "*", "*", "/", "^")
UNICODE = ("\u00b2", "\u03c0", "\u2212", "\u00d7", "\u0397", "\u221e", "\u200b", "\u0301", "\0", "\x7f", "\U0001f9ea", "\ufeff", "\u202e")
OVERFLOWS = ("exp(exp(exp(H^2)))", "1e308*1e308*H", "cosh(1000*H)", "exp(1e3*K)", "H*1e300*exp(H^2*99)", "(1e200*H)^2")


def number(rng):
    return rng.choice(("0", "1", "2", "3", "0.5", "1e-3", "1e9", "1e300", "1e-300", "pi", f"{rng.uniform(-2, 2):.3g}"))


def formula(rng, variables, depth):
    """A formula of the grammar, nearly always; whether it is defined anywhere is another question."""
    if depth == 0 or rng.random() < 0.1:
        return rng.choice((*variables, number(rng)))
    inner = formula(rng, variables, depth - 1)
    match rng.choice(("function", "operator", "operator", "power", "minus", "bracket")):
        case "function":
            return f"{rng.choice(FUNCTIONS)}({inner})"
        case "operator":
            return f"{inner}{rng.choice(OPERATORS)}{formula(rng, variables, depth - 1)}"
        case "power":
            return f"({inner})^{rng.choice((2, 2, 3, 4, 0, -1, 0.5, 40))}"
        case "minus":
            return f"-{inner}"
    return f"({inner})"


def mild(rng, variables, length):
    """1 and a little of something that repeats itself: most often a start that is accepted."""
    terms = {"z": lambda: f"cos({rng.choice((1, 2, 3))}*2*pi*z/{length})", "theta": lambda: f"cos({rng.choice((2, 3))}*theta)"}
    if length is None:
        terms = {"theta": lambda: f"cos(theta)^{rng.choice((1, 2, 3))}", "phi": lambda: "sin(theta)^2*cos(2*phi)"}
    about = [f"{rng.uniform(-0.3, 0.3):.3g}*{terms[name]()}" for name in variables]
    return "1+" + "+".join(about) if rng.random() < 0.7 else f"exp({'+'.join(about)})"


def quoted(rng, words):
    """As a string of TOML, its characters broken now and then."""
    if rng.random() < 0.25:
        words = broken_text(rng, words).decode("utf-8", "replace")
    if rng.random() < 0.1:
        at = rng.randrange(len(words) + 1)
        words = words[:at] + rng.choice(UNICODE) + words[at:]
    return '"' + "".join(c if c.isprintable() and c not in '"\\' else f"\\u{ord(c) % 0xD800:04x}" for c in words) + '"'


def spheroid(rng):
    n, b = rng.choice((60, 200)), 10 ** rng.uniform(-0.5, 0.5)
    return [[math.sin(math.pi * i / n) if 0 < i < n else 0.0, -b * math.cos(math.pi * i / n)] for i in range(n + 1)], None


def ring(rng):
    n, a = 150, rng.uniform(1.2, 4)
    return [[a + math.cos(2 * math.pi * i / n), math.sin(2 * math.pi * i / n)] for i in range(n)] + [[a + 1.0, 0.0]], None


def tube(rng):
    n, length, a = 150, rng.choice((1.0, 2.0, 6.0)), rng.uniform(0, 0.4)
    return [[1 + a * math.cos(2 * math.pi * i / n), length * i / n] for i in range(n + 1)], length


def spoil(rng, points):
    at = rng.randrange(len(points))
    match rng.choice(("noise", "far", "move", "drop", "again", "reverse", "scale", "cross", "few", "column")):
        case "noise":
            size = 10 ** rng.uniform(-9, 0)
            points[:] = [[x + rng.gauss(0, size) for x in p] for p in points]
        case "far":
            points[at][rng.randrange(2)] = rng.choice((1e9, 1e100, 1e160, 1e300, -1e300, 1e-300, float("nan"), float("inf")))
        case "move":
            points[at] = list(points[rng.randrange(len(points))])
        case "drop":
            del points[at:at + rng.choice((1, 1, 5))]
        case "again":
            points[at:at] = points[at:at + rng.choice((1, 3))]
        case "reverse":
            points.reverse()
        case "scale":
            r, z = (10 ** rng.uniform(-6, 6) for _ in range(2))
            points[:] = [[p[0] * r, p[1] * z] for p in points]
        case "cross":
            points[at][0] *= -1
        case "few":
            del points[rng.randrange(5):]
        case "column":
            points[at].append(1.0)


def profile(rng, box, tier):
    points, length = rng.choice((spheroid, ring, tube))(rng)
    state = rng.choice(("sound", "spoilt", "spoilt", "broken"))
    if state == "spoilt":
        for _ in range(rng.choice((1, 1, 2))):
            if points:
                spoil(rng, points)
    separator = rng.choice((", ", ";", " ", "\t"))
    contents = rng.choice(("", "r, z\n", "# points\n")) + "".join(separator.join(map(repr, p)) + rng.choice(("\n", "\n", "\r\n")) for p in points)
    box.write("profile.csv", broken_text(rng, contents) if state == "broken" else contents)
    tolerance = rng.choice(("", "tolerance = 1e-3", "tolerance = 0.1", "tolerance = 1e-12")) if state != "sound" else ""
    return state, f'kind = "profile"\npath = "profile.csv"\n{f"length = {length}" if length else ""}\n{tolerance}'


def radius(rng, box, tier):
    length = rng.choice((None, 1.0, 4.0))
    variables = ("theta", "phi") if length is None else ("z", "theta")
    if tier == "axisym" and rng.random() < 0.9:
        variables = variables[:1]
    words = mild(rng, variables, length) if rng.random() < 0.6 else formula(rng, variables, rng.choice((1, 2, 4, 12)))
    return "formula", f'kind = "formula"\nr = {quoted(rng, words)}\n{f"length = {length}" if length else ""}'


def noisy(rng, box, tier):
    base, degree = rng.choice((('kind = "sphere"\nradius = 1.0\n', "l"), ('kind = "tube"\nradius = 1.0\nlength = 3.0\n', "n")))
    degree = rng.choice(("l", "n")) if rng.random() < 0.1 else degree
    noise = f"[[shape.noise]]\namplitude = {10 ** rng.uniform(-6, 0):.3g}\n{degree} = {rng.choice((1, 4, 8, 60))}\nseed = {rng.choice((0, 1, 77, 2**31))}\n"
    if rng.random() < (0.1 if tier == "axisym" else 0.7):
        noise += f"m = {rng.choice((0, 2, 5))}\n"
    return "noise", base + noise


def varied(rng, tier):
    """A spontaneous curvature as a formula of places, which may be sharp, or not defined."""
    variables = ("area", *(("r", "z") if tier == "axisym" else ("x", "y", "z")))
    width = rng.choice((0.1, 0.1, 0.3, 1e-3, 1e-300))
    mild_one = rng.choice((f"-1-tanh((area-0.6)/{width})", "-2+0.3*z^2", "cos(2*pi*area)", "area*(1-area)", "1e9*area", "1/area", "log(area)"))
    return quoted(rng, mild_one if rng.random() < 0.6 else formula(rng, variables, rng.choice((1, 2, 4))))


def terms(rng, tier):
    """The energy: the shorthands, and often further terms."""
    H0 = varied(rng, tier) if rng.random() < 0.3 else rng.choice((0.0, -1.0, -2.0, 1.0))
    energy = f"[energy]\nk20 = {rng.choice((1.0, 0.5, 0.0, -0.2))}\nH0 = {H0}\n"
    for _ in range(rng.choice((0, 0, 1, 1, 2))):
        energy += f"[[energy.term]]\nmodulus = {rng.choice((0.1, 0.01, 1.0, -0.1, 1e9)):g}\n"
        if rng.random() < 0.5:
            energy += f"H = {rng.choice((0, 1, 2, 3, 4, 6))}\nK = {rng.choice((0, 1, 2))}\n"
        elif "formula" not in energy:
            mild_one = rng.choice(("log(1+(H-H0)^2)", "exp(-K)", "sqrt(1+H^2)", "tanh(H)^2", "K^2/(1+H^2)"))
            words = mild_one if rng.random() < 0.5 else formula(rng, ("H", "K", "H0"), rng.choice((1, 2, 4)))
            energy += f"formula = {quoted(rng, words)}\n"
    return energy


def undefined(rng, box):
    """A formula that has its pole, or its end, within the curvatures of a spheroid of axes 1 and 2, which has H from -4 to -1.25; or one
    that no double holds there."""
    end = f"H+{rng.uniform(1.5, 3.7):.4g}"
    words = rng.choice((*(f"{before}({end}){after}" for before, after in (("1/", ""), ("K/", "^3"), ("log", ""), ("sqrt", ""), ("", "^0.5"))), *OVERFLOWS))
    tier = rng.choice(("axisym", "surface3d"))
    energy = f'{{k20 = 1.0, term = [{{modulus = {rng.choice((0.1, 1e-9, -0.5))}, formula = "{words}"}}]}}'
    box.write("case.toml", f'tier = "{tier}"\nenergy = {energy}\nshape = {{kind = "ellipsoid", a = 1.0, b = 1.0, c = 2.0}}\naccuracy = {{energy = 1e-2}}\ntime = {{end = 1e-4, limit = 5}}\n')
    done = box.run("run", "case.toml", "--quiet", limit=30)
    clean(done)
    if "before the first state was computed" in done.out:
        return "no state in time"
    if done.status not in (2, 4) or not re.search("formula|divisor|overflow|too large", done.out + done.err):
        raise Finding("no-reason", f"{words}: exit {done.status}, {(done.out + done.err)[:500]!r}")
    return f"undefined: exit {done.status}"


def clean(refused):
    """No half characters and no control characters in what is said."""
    if bad := [c for c in refused.err if c != "\n" and unicodedata.category(c) in ("Cc", "Cs")]:
        raise Finding("unclean", f"says {bad[0]!r}: {refused.err[:500]!r}")


def one(rng, box):
    if rng.random() < 0.1:
        return undefined(rng, box)
    tier = rng.choice(("axisym", "axisym", "surface3d"))
    energy = terms(rng, tier) if rng.random() < 0.5 else "[energy]\nk20 = 1.0\n"
    state, shape = rng.choice((profile, profile, radius, noisy))(rng, box, tier)
    box.write("case.toml", f'tier = "{tier}"\n{energy}[shape]\n{shape}\n[accuracy]\nenergy = 1e-2\n[time]\nend = 1e-3\nlimit = {LIMIT}\n')
    checked = box.run("check", "--quick", "case.toml", statuses=(0, 2))
    done = box.run("run", "case.toml", "--quiet", "--overwrite", limit=30)
    for refused in (checked, done):
        clean(refused)
        if refused.status == 2 and not re.search(r"profile\.csv|case\.toml:\d+:\d+: ", refused.err):
            raise Finding("no-place", f"refused without naming file or case: {refused.err[:500]!r}")
    if checked.status == 2 != done.status:
        raise Finding("check-refuses", f"run accepts, check does not: {checked.err[:500]}")
    if state == "sound" and done.status == 2 and energy == "[energy]\nk20 = 1.0\n":
        raise Finding("sound-refused", f"a sound profile is refused: {done.err[:500]}")
    if done.status == 2 or (done.status == 5 and "before the first state was computed" in done.err):
        return f"{state}: refused" if done.status == 2 else "no state in time"
    if (box.folder / "case.hdf").exists():
        no_number_is_lost(box, "case.hdf")
    return f"{state}: exit {done.status}"
