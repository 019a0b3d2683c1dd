"""The differences between cases, in words short enough for a picture. Standard library only."""

import re
import textwrap

SUBSCRIPT = {str(d): chr(0x2080 + d) for d in range(10)}
SUPERSCRIPT = dict(zip("0123456789-", "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079\u207b"))
MINUS = "\u2212"
LETTERS = {"nabla": "\u2207", "kappa": "\u03ba", "alpha": "\u03b1", "gamma": "\u03b3", "sigma": "\u03c3", "Pi": "\u03a0", "rho": "\u03c1", "pi": "\u03c0"}
NOT_SET = object()
LONGEST_LABEL = 200  # characters: more than is to be read in a picture
MAX_DIFFERENCES = 4  # cases with more differences are labelled by their names

# Never a label: descriptions and expectations of a case, and times, which are visible.
IGNORED = ("about.", "units.", "expect.", "time.")
NAMES = {
    "tier": "tier",
    "accuracy.energy": "accuracy",
    "accuracy.r_min": "neck floor",
    "model.kind": "model",
    "shape.kind": "shape",
}


def shortened(words):
    return words if len(words) <= LONGEST_LABEL else words[: LONGEST_LABEL - 3] + "..."


def as_label(words):
    """A name given by a user or a file, as text of a picture: "$" is no mathematics, undecodable bytes become "?"."""
    return shortened(words.encode(errors="replace").decode()).replace("$", r"\$")


def flatten(node, prefix=""):
    """{"shape.mode.0.amplitude": 0.25, ...}; an array of plain values stays one value."""
    if isinstance(node, dict):
        items = node.items()
    elif isinstance(node, list) and any(isinstance(entry, (dict, list)) for entry in node):
        items = ((str(index), entry) for index, entry in enumerate(node))
    else:
        return {prefix: node}
    flat = {}
    for key, value in items:
        flat |= flatten(value, f"{prefix}.{key}" if prefix else key)
    return flat


def sorted_by_value(cases):
    """Their indices, by the numbers in which the cases differ; as they are where they differ in other things."""
    flats = [flatten(case) for case in cases]
    keys = differing_keys(flats)
    rows = [[flat.get(key) for key in keys] for flat in flats]
    if len(keys) > MAX_DIFFERENCES or not all(isinstance(value, (int, float)) for row in rows for value in row):
        return list(range(len(cases)))
    return sorted(range(len(cases)), key=rows.__getitem__)


def differing_keys(flats):
    return [key for key in dict.fromkeys(key for flat in flats for key in flat) if not key.startswith(IGNORED)
            and any(flat.get(key, NOT_SET) != flats[0].get(key, NOT_SET) for flat in flats)]  # fmt: skip


def row_labels(cases, fallbacks):
    """One list of words ("k42 = 0.06", ...) per case: the differences, else its fallback."""
    if len(cases) == 1:
        return [[fallbacks[0]]]
    flats = [flatten(case) for case in cases]
    keys = differing_keys(flats)
    if len(keys) > MAX_DIFFERENCES or {"shape.a", "shape.b", "shape.c"} <= set(keys):
        return [[fallback] for fallback in fallbacks]
    one_mode = not any(key.startswith("shape.mode.1.") for flat in flats for key in flat)
    labels = [list(dict.fromkeys(_words(key, keys, flat, one_mode) for key in keys)) for flat in flats]
    if len({tuple(label) for label in labels}) < len(labels):
        labels = [[*label, fallback] for label, fallback in zip(labels, fallbacks)]
    return labels


def _words(key, keys, flat, one_mode):
    """What a case says of one of the keys that differ."""
    parts = key.split(".")
    if key.startswith("shape.mode."):
        if key not in flat and not any(other.startswith(f"shape.mode.{parts[2]}.") for other in flat):
            return f"no mode {parts[2]}"
        name = parts[3] if one_mode else f"mode {parts[2]} {parts[3]}"
    else:
        clash = sum(other.split(".")[-1] == parts[-1] for other in keys) > 1
        name = NAMES.get(key) or (key if clash else symbol(parts[-1]))
    return f"{name} = {_value(flat[key])}" if key in flat else f"{name} by default"


def symbol(key):
    """k42 and H0 with subscript digits; other words unchanged."""
    letter, digits = key[:1], key[1:]
    return letter + "".join(SUBSCRIPT[d] for d in digits) if letter in "kH" and digits.isdigit() else key


def _value(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float)):
        return number(value)
    if isinstance(value, list):
        return shortened("[" + ", ".join(_value(entry) for entry in value) + "]")
    return shortened(str(value))


def number(value):
    """Six digits at most, with a true minus sign."""
    return f"{value:.6g}".replace("-", MINUS)


def power(value, digits):
    """That many digits, far from 1 as 3.2\u00b710\u207b\u2075."""
    text = f"{value:.{digits - 1}e}"
    mantissa, exponent = text.split("e")
    if -4 < int(exponent) < 4:
        return number(float(text))
    return f"{number(float(mantissa))}\u00b710" + formula(f"^{{{int(exponent)}}}")


def pretty_unit(name):
    """um, 1/nm^2 with a real \u00b5 and superscripts."""
    return formula(re.sub(r"\bu(?=[msN])", "\u00b5", name))


def in_unit(words, unit):
    """A quantity, and the unit of its numbers if they have one."""
    return f"{words} [{unit}]" if unit else words


def wrapped(words, width):
    """One word group per line, long ones broken."""
    return "\n".join("\n".join(textwrap.wrap(word, width)) for word in words)


def formula(mathtext):
    """k_{20}(H-H_0)^2, \\sigma with real sub- and superscripts and letters, so that it is plain text in an SVG."""
    out, table, braced = [], None, False
    for char in re.sub(r"\\(\w+) ?", lambda name: LETTERS.get(name[1], name[0]), mathtext):
        if char in "_^":
            table = SUBSCRIPT if char == "_" else SUPERSCRIPT
        elif char == "{":
            braced = table is not None
        elif char == "}":
            table, braced = None, False
        else:
            out.append((table or {}).get(char, MINUS if char == "-" else char))
            table = table if braced else None
    return "".join(out)
