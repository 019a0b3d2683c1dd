"""Case files as data that can be changed and written again."""

import tomllib


def dump(table):
    """A TOML document of a dictionary as tomllib gives it."""
    return "".join(f"{key(name)} = {value(entry)}\n" for name, entry in table.items())


def key(name):
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else string(name)


def value(entry):
    match entry:
        case bool():
            return str(entry).lower()
        case str():
            return string(entry)
        case dict():
            return "{" + ", ".join(f"{key(name)} = {value(inner)}" for name, inner in entry.items()) + "}"
        case list():
            return "[" + ", ".join(map(value, entry)) + "]"
    return str(entry)  # numbers: inf and nan as TOML has them


def string(text):
    return '"' + "".join(c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in text) + '"'


def places(entry, path=()):
    """The paths of all that an entry holds, tables and lists included, itself not."""
    inner = entry.items() if isinstance(entry, dict) else enumerate(entry) if isinstance(entry, list) else ()
    for name, below in inner:
        yield (*path, name)
        yield from places(below, (*path, name))


def holder(table, path):
    for name in path[:-1]:
        table = table[name]
    return table


NUMBERS = (0, -0.0, 1, -1, 2, 3, 0.5, 1e-3, 1e-9, 1e-300, 5e-324, 1e3, 1e6, 1e9, 1e160, 1e300, -1e300, 2**31 - 1, 2**31, -(2**31), 2**63 - 1)
NO_NUMBERS = (float("nan"), float("inf"), -float("inf"), True, "", "1", "sphere", "../case.toml", "\0", "\u00e9", [], {}, [1, 2], [[]], {"a": 1}, [{}])


def near(rng, number):
    """A number as somebody might have meant it: of the same size, or far off; whole where it was."""
    if isinstance(number, int):
        return max(number + rng.choice((-2, -1, 1, 2, 10)), rng.choice((0, 1)))
    factor = rng.choices((rng.uniform(0.5, 2), 10 ** rng.uniform(-6, 6), -1), (8, 3, 1))[0]
    return number * factor


def bend(rng, table):
    """Changes one number of the table to one near it."""
    numbers = [path for path in places(table) if not {"expect", "about", "output"} & set(path) and is_number(holder(table, path)[path[-1]])]
    if numbers:
        path = rng.choice(numbers)
        holder(table, path)[path[-1]] = near(rng, holder(table, path)[path[-1]])


def is_number(entry):
    return isinstance(entry, (int, float)) and not isinstance(entry, bool)


def change(rng, table):
    """Changes one entry of the table: its value, its name, whether it is there at all."""
    path = rng.choice(list(places(table)))
    where, name = holder(table, path), path[-1]
    old = where[name]
    what = rng.choice(("near", "number", "other", "remove", "rename", "again", "swap"))
    if what == "near" and is_number(old):
        where[name] = near(rng, old)
    elif what == "number":
        where[name] = rng.choice(NUMBERS)
    elif what == "other":
        where[name] = rng.choice(NO_NUMBERS)
    elif what == "remove":
        del where[name]
    elif what == "rename" and isinstance(where, dict):
        at = rng.randrange(len(name) + 1)
        where[name[:at] + rng.choice(("", "_", "x", ".", " ")) + name[at + rng.randrange(2):]] = where.pop(name)
    elif what == "again" and isinstance(where, list):
        where.extend([old] * rng.choice((1, 2, 100)))
    elif what == "swap":
        other = rng.choice(list(places(table)))
        there = holder(table, other)
        where[name], there[other[-1]] = there[other[-1]], old
