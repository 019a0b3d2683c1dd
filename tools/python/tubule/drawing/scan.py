"""Maps of scans: the outcome of each point, the boundaries between outcomes, and closed forms."""

import json
import math
import os
import re
import textwrap
import tomllib

import h5py
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from . import style, units
from .labels import as_label, flatten, formula, in_unit, number, pretty_unit, symbol
from .results import BadInput, opened, values

LEFT, BELOW, PANEL, ABOVE, BAR = 0.6, 0.45, 3.3, 0.27, 1.05  # inches: beside and below the axes, their height, title, colour bar
# By name of the outcome: light for equilibria, dark for early stops.
COLOURS = {
    "uniform-tube": "#d6e4f0",
    "unduloid": "#f6c667",
    "sphere": "#cfe8cf",
    "closed": "#8fc18f",
    "pinched": "#8a1538",
    "overhang": "#5e4fa2",
    "ill-posed": "#1a1a1a",
    "self-intersection": "#b5651d",
    "failed": "#ff00ff",
    "undecided": "#9aa5ad",
    "prolate": "#d6e4f0",
    "oblate": "#f6c667",
    "stomatocyte": "#8fc18f",
    "pear": "#c6b5dc",
}
VERDICTS = {
    "agrees": {"marker": "o", "color": "black", "markerfacecolor": "white", "markersize": 6, "mew": 1.2},
    "symmetry-broken": {"marker": "^", "color": "black", "markersize": 6},
    "other-outcome": {"marker": "X", "color": "black", "markersize": 6},
    "no-answer": {"marker": "$?$", "color": "black", "markersize": 6},
}
# What can be drawn of points: how it is called, and its dimensions.
QUANTITIES = {
    "outcome": ("outcome", ""),
    "energy": ("energy where the run stopped", "energy"),
    "time": ("time where the run stopped", "time"),
    "energy_error": ("estimated error of the energy / " + formula("E_{ref}"), ""),
    "E_ref": (formula("E_{ref}"), "energy"),
    "r_min": ("smallest radius", "length"),
    "r_max": ("largest radius", "length"),
    "area": ("area", "length^2"),
    "volume": ("volume", "length^3"),
    "height": ("height", "length"),
    "tension": ("tension", "energy/length^2"),
    "pressure": ("pressure", "energy/length^3"),
    "force": ("axial force", "energy/length"),
    "growth": ("largest growth rate", "1/time"),
    "free_energy": ("free energy F", "energy"),
    "limit_energy": ("energy of the vesiculated limit", "energy"),
    "steps": ("steps", ""),
    "elements": ("elements", ""),
    "wall_seconds": ("wall time in s", ""),
    "cpu_seconds": ("CPU time in s", ""),
}
UNITS_CHANGE = re.compile(r"(energy\.k20|model\.(kind|Re|gamma)|units\.\w+)=")  # keys that decide what a number stands for
AT_REST = ("uniform-tube", "unduloid", "sphere", "closed", "prolate", "oblate", "stomatocyte", "pear")
KNOWN_OF_FAILED = 1e-4  # of E_ref: to this the energy where a search failed is known
THRESHOLD_DASHES = ("--", ":", "-.", (0, (6, 2, 1, 2, 1, 2)), (0, (1, 4)))
NAMES = {
    "equilibrium.reduced_volume": "reduced volume",
    "energy.H0": "spontaneous curvature " + formula("H_0"),
    "shape.length": "length L",
    "model.tension": "tension " + formula("\\sigma"),
    "model.pressure": "pressure " + formula("\\Pi"),
    "model.force": "axial force " + formula("N"),
    "shape.radius": "radius",
    "equilibrium.area": "area",
    "equilibrium.volume": "volume",
    "shape.mode.0.amplitude": "amplitude A",
}


MODE = re.compile(r"shape\.mode\.(\d+)\.amplitude")
CAPTION = re.compile(r"energy\..*|shape\.(radius|length|a|b|c|mode\..*amplitude)|model\.(kind|tension|pressure|force|Re|gamma)|equilibrium\.(area|volume|reduced_volume)")


def name_of(key):
    modulus = re.fullmatch(r"energy\.(k(\d+|g))", key)
    mode = MODE.fullmatch(key)
    return symbol(modulus[1]) if modulus else NAMES.get(key) or (f"amplitude of mode {mode[1]}" if mode else key)


def with_sets(case, sets):
    """{"energy.k20": 0.2, ...} of the text of a case with overrides "key=value"; a table of values replaces its key."""
    flat = flatten(tomllib.loads(case))
    for one in sets:
        key, _, value = one.partition("=")
        try:
            flat |= flatten(tomllib.loads(f"x = {value}")["x"], key.strip())
        except tomllib.TOMLDecodeError:  # a word without quotes
            flat[key.strip()] = value.strip()
    return flat


class Axis:
    unit, scale = "", 1.0  # of its values; a number of the file times `scale` is one of them

    def __init__(self, group):
        keys = list(group.attrs["keys"])
        self.key = ", ".join(keys)
        self.logarithmic = bool(group.attrs["logarithmic"])
        numbers = values(group["values"])
        rows = [[text.decode() for text in row] for row in values(group["texts"])]
        self.texts = [", ".join(row) for row in rows]
        self.sets = [[f"{key}={text}" for key, text in zip(keys, row)] for row in rows]  # the overrides of the points there
        self.is_numeric = numbers.shape[1] == 1 and np.isfinite(numbers).all() and (np.diff(numbers[:, 0]) > 0).all()
        self.values = numbers[:, 0] if self.is_numeric else np.arange(len(numbers), dtype=float)

    @property
    def label(self):
        return in_unit(name_of(self.key), self.unit)

    def at(self, places):
        """Values at places of older files, which have integers, or the values themselves."""
        return self.values[places] if places.dtype.kind in "iu" else self.scale * places

    def words(self, place):
        """The key with its value there."""
        value = f"{number(self.values[place])} {self.unit}" if self.unit else self.texts[place]
        return f"{self.key} = {value}"

    def place(self, value):
        """The place of a value on the axis, given as text; None if it has no such value."""
        if self.is_numeric and value not in self.texts:
            try:
                value = next((text for text in self.texts if math.isclose(float(text), float(value), rel_tol=1e-9)), None)
            except ValueError:
                return None
        return self.texts.index(value) if value in self.texts else None

    def borders(self):
        """Midpoints between the values, and as far beyond the first and last."""
        v = np.log(self.values) if self.logarithmic else self.values
        middle = (v[1:] + v[:-1]) / 2 if v.size > 1 else v + 0.5
        borders = np.concatenate([[2 * v[0] - middle[0]], middle, [2 * v[-1] - middle[-1]] if v.size > 1 else []])
        return np.exp(borders) if self.logarithmic else borders

    def mark(self, axis):
        if not self.is_numeric:
            axis.set_ticks(self.values, self.texts)


def is_scan(path):
    if not os.path.isfile(path):
        return False  # reported where it is read
    try:
        with h5py.File(path) as file:
            return "scan" in file and "points" in file
    except OSError:
        return False  # reported where it is read


class Scan:
    """A scan file: axes, arrays of the points by name, and what was found between the points."""

    def __init__(self, path):
        self.path = path
        with opened(path) as file:
            self.axes = [Axis(file["axes"][name]) for name in sorted(file["axes"], key=int)]
            self.points = {name: values(data) for name, data in file["points"].items()}
            self.names = list(file["points/outcome"].attrs["names"])
            self.title = file["scan"].attrs["title"]
            self.text, self.sets = file["case"][()].decode(), list(file["case"].attrs.get("set", []))
            self.case = with_sets(self.text, self.sets) if "set" in file["case"].attrs else {}  # of older scans not known
            self.units = {}  # unit and scale by dimensions; none: all is as in the file
            self.starts = file["scan"].attrs.get("start_axis")  # the axis of initial shapes of an equilibrium, or None
            self.boundary = values(file["boundary"])
            self.crossings = values(file["crossing"]).mean(axis=1) if "crossing" in file else []
            self.thresholds = [(line.attrs["label"], values(line["first"]), values(line["second"]), values(line["values"]))
                               for line in file["thresholds"].values()]  # fmt: skip
            self.equal = {name: values(data) for name, data in file["equal_energies"].items()} if self.starts is not None else {}

    @property
    def has_units(self):
        return any(key.startswith("units.") for key in self.case)

    @property
    def is_equilibrium(self):
        return "equilibrium" in tomllib.loads(self.text) or any("equilibrium." in axis.key for axis in self.axes)

    def convert(self, units_of):
        """Changes all numbers to units that all points share; `units_of` has those of the point with these overrides."""
        first = [one for axis in self.axes for one in axis.sets[0]]
        shared = units_of(first)
        for axis in self.axes:
            changed = axis.sets[1:] if any(map(UNITS_CHANGE.match, axis.sets[0])) else ()
            for other in (units_of([*first, *sets]) for sets in changed):
                shared = {of: unit for of, unit in shared.items() if other.get(of) == unit}
        if self.is_equilibrium:
            shared.pop("time", None)  # they have none
        self.units = {of: (pretty_unit(unit["unit"]), unit["scale"]) for of, unit in shared.items()}
        for axis in self.axes:
            axis.unit, axis.scale = self.unit_of_key(axis.key)
            axis.values = axis.values * axis.scale if axis.is_numeric else axis.values
        for name in self.points:
            if self.unit_of(name)[0]:
                self.points[name] = self.points[name] * self.unit_of(name)[1]
        return self

    def unit_of_key(self, key):
        """The unit of its values, and what one number of the file is in it."""
        amplitude = MODE.fullmatch(key) and self.case.get("shape.kind") == "tube"
        return self.units.get("length" if amplitude else units.OF_KEYS.get(key), ("", 1.0))

    def unit_of(self, quantity):
        """Likewise of values of points."""
        return self.units.get(QUANTITIES.get(quantity, ("", ""))[1], ("", 1.0))

    def label(self, quantity):
        return in_unit(QUANTITIES.get(quantity, (quantity,))[0], self.unit_of(quantity)[0])

    def caption(self):
        """What all points have in common and the title need not say: moduli that are not zero, sizes, loads."""
        varied = [key for axis in self.axes for key in axis.key.split(", ")]
        shown = {key: value for key, value in self.case.items() if key not in varied and CAPTION.fullmatch(key)}
        words = []
        for key, value in sorted(shown.items(), key=lambda item: not item[0].startswith("energy.")):
            name = symbol(key.split(".")[-1]) if key.startswith("energy.") else name_of(key)
            if isinstance(value, str):
                words.append(value)
            elif value and not isinstance(value, (bool, list)):
                unit, scale = self.unit_of_key(key)
                words.append(f"{name} = {number(value * scale)} {unit}".rstrip())
        return words

    def places(self, slices):
        """The place of its value for each axis that is cut: {axis number: place}."""
        places = {}
        for text in slices:
            key, equals, value = text.partition("=")
            if not equals:
                raise BadInput(f"--slice {text}: must have the form key=value")
            numbers = [i for i, axis in enumerate(self.axes) if axis.key == key]
            if not numbers:
                raise BadInput(f"--slice {text}: {self.path} varies {', '.join(axis.key for axis in self.axes)}")
            place = self.axes[numbers[0]].place(value)
            if place is None:
                raise BadInput(f"--slice {text}: {key} has the values {', '.join(self.axes[numbers[0]].texts)}")
            places[numbers[0]] = place
        return places

    def at(self, places):
        """Where these axes are cut: arrays of the other ones."""
        index = tuple(places.get(i, slice(None)) for i in range(len(self.axes)))
        return {name: data[index] for name, data in self.points.items()}

    def at_rest(self, outcome):
        """Where outcomes are stationary shapes."""
        return np.isin(outcome, [k for k, name in enumerate(self.names) if name in AT_REST])

    def best_starts(self):
        """For each point the initial shape that leads to the least energy, the first one where none leads to a shape."""
        energy = np.where(self.at_rest(self.points["outcome"]), self.points["free_energy"], np.inf)
        return np.argmin(energy, axis=self.starts, keepdims=True)


def differing(outcome):
    """Pairs of neighbours whose outcomes differ, by their numbers."""
    for axis in range(outcome.ndim):
        numbers = np.arange(outcome.size).reshape(outcome.shape)
        pairs = np.stack([np.delete(numbers, end, axis).ravel() for end in (-1, 0)], axis=1)
        a, b = outcome.ravel()[pairs].T
        yield from pairs[(a != b) & (a > 0) & (b > 0)]


def is_lower(energy, than):
    """Where an energy is known and less than another that may be unknown."""
    return np.isfinite(energy) & ~(energy >= than)


class Slice:
    """The part of a scan that is drawn: two axes or one, the others at one value each, and of several initial shapes the
    equilibrium of least energy."""

    def __init__(self, scan, slices):
        cut, starts = scan.places(slices), scan.starts
        self.names, self.all_starts, self.equal, self.boundary, self.crossings = scan.names, [], [], [], []
        best = starts is not None and starts not in cut
        kept = [i for i in range(len(scan.axes)) if i not in cut and not (best and i == starts)]
        self.axes = [scan.axes[i] for i in kept]
        if len(kept) > 2:
            more = " ".join(f"--slice {axis.key}={axis.texts[0]}" for axis in self.axes[2:])
            raise BadInput(f"{scan.path}: a picture has one or two axes, this scan {len(kept)} axes: "
                           f"{', '.join(axis.key for axis in self.axes)}: cut it, as by {more}")  # fmt: skip
        if not kept:
            raise BadInput(f"{scan.path}: a picture has one or two axes: cut fewer")
        if best:
            if not cut:
                self._equal_energies(scan, kept)
            self.all_starts = [scan.at(cut | {starts: start}) for start in range(scan.points["outcome"].shape[starts])]
            best_of = scan.best_starts()
            index = tuple(cut.get(i, 0 if i == starts else slice(None)) for i in range(len(scan.axes)))
            self.points = {name: np.take_along_axis(data, best_of, starts)[index] for name, data in scan.points.items()}
        else:
            self.points = scan.at(cut)
        self._lower_states(scan)
        self.thresholds = [] if set(cut) - {starts} else scan.thresholds
        if starts is None:
            self._boundary(scan, cut, kept)
        else:
            self.boundary = [*differing(self.points["outcome"])]
        self.caption = scan.caption()
        where = ", ".join(scan.axes[i].words(place) for i, place in sorted(cut.items()))
        self.title = ": ".join(words for words in (scan.title, where) if words)
        self.label = scan.label

    def _lower_states(self, scan):
        """Where spheres joined by points have less energy than any smooth shape found; and where the lowest state is not
        known, since a search that failed had come to less, or nothing at all was found."""
        found = scan.at_rest(self.points["outcome"])
        self.vesiculated = self.unreached = np.zeros(found.shape, bool)
        if not self.all_starts:
            return
        least = np.where(found, self.points["free_energy"], np.nan)
        limit = self.points.get("limit_energy", np.full(found.shape, np.nan))  # older scans have none
        lower = is_lower(limit, least)
        unreached = (self.points["outcome"] > 0) & ~found & ~lower
        for points in self.all_starts:
            failed = (points["outcome"] > 0) & ~scan.at_rest(points["outcome"])
            unreached |= failed & is_lower(points["free_energy"] + KNOWN_OF_FAILED * points["E_ref"], np.where(lower, limit, least))
        self.vesiculated, self.unreached = lower & ~unreached, unreached

    def _boundary(self, scan, cut, kept):
        """What the scan has found of it, with the places on the sides of cells where it was refined."""
        for number, ends in enumerate(scan.boundary):
            places = [np.unravel_index(end, scan.points["outcome"].shape) for end in ends]
            if all(place[i] == at for place in places for i, at in cut.items()):
                self.boundary.append([np.ravel_multi_index([place[i] for i in kept], self.shape) for place in places])
                self.crossings += [scan.crossings[number]] if len(scan.crossings) else []

    def _equal_energies(self, scan, kept):
        """Places where the energies of two kinds are equal: (places of the two neighbours, axis, value, kinds, lowest)."""
        shape = scan.points["outcome"].shape
        for ends, axis, kinds, value, lowest in zip(*(scan.equal[name] for name in ("points", "axis", "kinds", "value", "lowest"))):
            if np.isfinite(value):
                places = [tuple(np.unravel_index(end, shape)[i] for i in kept) for end in ends]
                self.equal.append((*places, kept.index(axis), scan.axes[axis].at(value), tuple(kinds), bool(lowest)))

    @property
    def shape(self):
        return self.points["outcome"].shape

    def plain_outcomes(self):
        """0 where cells are hatched, or nothing is known."""
        return np.where(self.vesiculated | self.unreached, 0, self.points["outcome"])


def draw_borders(part, panel):
    """The sides that the cells of neighbouring points share, for each pair that differs and where no line of equal energies
    passes; and the places on them where the outcome changes."""
    (x, y), lines, places = (axis.borders() for axis in part.axes), [], []
    crossed = {tuple(np.ravel_multi_index(end, part.shape) for end in ends) for *ends, _, _, _, lowest in part.equal if lowest}
    for number, pair in enumerate(part.boundary):
        (i, j), (k, _) = (np.unravel_index(end, part.shape) for end in pair)
        hatched = [part.vesiculated.flat[end] or part.unreached.flat[end] for end in pair]
        if tuple(pair) not in crossed and not all(hatched):
            lines.append([(x[i + 1], y[j]), (x[i + 1], y[j + 1])] if k > i else [(x[i], y[j + 1]), (x[i + 1], y[j + 1])])
        if len(part.crossings):
            value = part.crossings[number]
            first, second = part.axes
            places.append((first.at(value), second.values[j]) if k > i else (first.values[i], second.at(value)))
    panel.add_collection(LineCollection(lines, colors="black", linewidths=0.8))
    handles = draw_equal_energies(part, panel)
    if places:
        panel.plot(*np.transpose(places), ".", color="black", markersize=3)
        handles.append(Line2D([], [], color="black", marker=".", markersize=3, linestyle="", label="refined"))
    return handles


def draw_equal_energies(part, panel):
    """Lines through the places where energies are equal, cell by cell."""
    x, y = part.axes[0].values, part.axes[1].values
    cells, handles = {}, []  # (kinds, cell): [(place, lowest)]
    for (i, j), _, axis, value, kinds, lowest in part.equal:
        place = (value, y[j]) if axis == 0 else (x[i], value)
        for cell in ((i, j), (i, j - 1) if axis == 0 else (i - 1, j)):
            cells.setdefault((kinds, cell), []).append((place, lowest))
    pairs = [ends for ends in cells.values() if len(ends) == 2]
    for are_lowest, look, caps, label in (
        (True, {"color": "black", "linewidth": 1.8, "linestyle": "-"}, "round", "equal energies"),
        (False, {"color": "0.3", "linewidth": 1.0, "linestyle": (0, (2, 2))}, "butt", "the same, a third is lower"),
    ):
        if lines := [[a[0], b[0]] for a, b in pairs if (a[1] and b[1]) == are_lowest]:
            panel.add_collection(LineCollection(lines, capstyle=caps, **look))
            handles.append(Line2D([], [], label=label, **look))
    return handles


def draw_hatches(part, panel):
    handles = []
    for where, hatch, label in ((part.vesiculated, "////", "vesiculated limit is lower"), (part.unreached, "xxxx", "not reached")):
        if where.any():
            cells = np.ma.masked_where(~where, np.ones(part.shape))
            panel.pcolor(*(axis.borders() for axis in part.axes), cells.T, hatch=hatch, facecolor="none", edgecolor="0.5", linewidth=0)
            handles.append(Patch(facecolor="none", edgecolor="0.5", linewidth=0.4, hatch=hatch, label=f"{label} ({where.sum()})"))
    return handles


def draw_cells(part, quantity, panel):
    """The colour of each point's cell."""
    if quantity == "outcome":
        shown = np.ma.masked_equal(part.plain_outcomes(), 0).astype(float)
        look = {"cmap": ListedColormap([COLOURS.get(name, "#ffffff") for name in part.names]),
                "norm": BoundaryNorm(np.arange(-0.5, len(part.names)), len(part.names))}  # fmt: skip
    else:
        shown, look = np.ma.masked_invalid(part.points[quantity]), {"cmap": "viridis"}
    mesh = panel.pcolormesh(*(axis.borders() for axis in part.axes), shown.T, rasterized=True, **look)
    if quantity != "outcome":
        bar = panel.inset_axes([1.04, 0, 0.03, 1])
        panel.figure.colorbar(mesh, cax=bar, label=part.label(quantity))


def draw_map(part, quantity, panel):
    axes = part.axes
    draw_cells(part, quantity, panel)
    handles = draw_borders(part, panel) + draw_hatches(part, panel)
    for dashes, (label, first, second, height) in zip(THRESHOLD_DASHES, part.thresholds):
        panel.contour(axes[0].at(first), axes[1].at(second), height.T, [0], colors="#c0392b", linestyles=[dashes], linewidths=1.2)
        handles.append(Line2D([], [], color="#c0392b", linestyle=dashes, label=label))
    panel.set(xlabel=axes[0].label, ylabel=axes[1].label)
    if axes[1].logarithmic:
        panel.set_yscale("log")
    axes[1].mark(panel.yaxis)
    return handles


def draw_line(part, quantity, panel):
    for points in part.all_starts or [part.points]:
        for k, name in enumerate(part.names):
            here = points["outcome"] == k
            if k > 0 and here.any():
                panel.plot(part.axes[0].values[here], points[quantity][here], "o", color=COLOURS.get(name),
                           markeredgecolor="0.3", markeredgewidth=0.4)  # fmt: skip
    for *_, value, _, lowest in part.equal:
        panel.axvline(value, color="black", linewidth=0.8, linestyle="-" if lowest else ":")
    panel.set(xlabel=part.axes[0].label, ylabel=part.label(quantity))


def draw_confirmed(path, part, panel):
    """A mark at each point of the JSON of `tubule confirm` that was run in three dimensions, by what came out."""
    try:
        with open(path) as file:
            found = [(int(point["point"]), point["values"]["verdict"]) for point in json.load(file)["points"]]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInput(f"{path}: is not what `tubule confirm --json` prints") from error
    if any(not 0 <= number < part.points["outcome"].size for number, _ in found):
        raise BadInput(f"{path}: belongs to another scan, with more points")
    handles = []
    for verdict, look in VERDICTS.items():
        here = [np.unravel_index(number, part.shape) for number, one in found if one == verdict]
        if here:
            x, y = (axis.values[list(index)] for axis, index in zip(part.axes, zip(*here)))
            panel.plot(x, y, linestyle="", clip_on=False, zorder=4, **look)
            handles.append(Line2D([], [], linestyle="", label=f"3D: {verdict} ({len(here)})", **look))
    return handles


def read(path, option=""):
    """The scan in a file, in the units of its case if it has any; `option` as --units."""
    scan = Scan(path)
    if not units.are_wanted(option, scan.has_units):
        return scan
    return scan.convert(lambda sets: units.asked(path, option, sets))


def figure_of(scan, quantity, slices, confirmed=None):
    """The map of a scan, or curves over its only axis."""
    path, part = scan.path, Slice(scan, slices)
    if not part.points["outcome"].any():
        raise BadInput(f"{path}: no point is finished yet")
    if quantity and quantity not in QUANTITIES:
        raise BadInput(f"--quantity {quantity}: must be one of {', '.join(QUANTITIES)}")
    is_map = len(part.axes) == 2
    of_outcomes = not is_map or quantity in ("", "outcome")
    count = np.bincount(part.plain_outcomes().ravel(), minlength=len(part.names))
    patches = [Patch(facecolor=COLOURS.get(name, "#ffffff"), edgecolor="0.3", linewidth=0.4, label=f"{name} ({count[k]})")
               for k, name in enumerate(part.names) if of_outcomes and k > 0 and count[k]]  # fmt: skip
    if confirmed and (not is_map or slices):
        raise BadInput(f"{path}: --confirmed marks points of a scan of two axes, without --slice")
    figure = Figure(figsize=(style.WIDTH, PANEL))
    panel, handles = figure.add_axes([0, 0, 1, 1]), []
    if is_map:
        handles = draw_map(part, quantity or "outcome", panel)
        handles += draw_confirmed(confirmed, part, panel) if confirmed else []
    else:
        draw_line(part, quantity if quantity not in ("", "outcome") else "energy", panel)
    if part.axes[0].logarithmic:
        panel.set_xscale("log")
    part.axes[0].mark(panel.xaxis)
    legend = style.Legend(patches + handles)
    captions = textwrap.wrap(", ".join(part.caption), int(style.WIDTH / 0.062))
    right, low = max(legend.right + (0 if of_outcomes else BAR), 0.15), legend.below + BELOW
    tall = low + PANEL + ABOVE + 0.13 * len(captions)
    figure.set_size_inches(style.WIDTH, tall)
    panel.set_position([LEFT / style.WIDTH, low / tall, 1 - (LEFT + right) / style.WIDTH, PANEL / tall])
    figure.text(0.5, 1 - 0.05 / tall, as_label(part.title), ha="center", va="top", fontsize=8)
    figure.text(0.5, (low + PANEL + 0.06) / tall, "\n".join(captions), ha="center", va="bottom", fontsize=6.5, color="0.25")
    legend.draw(panel, 0.02)
    return figure
