"""Maps of tools: where lines of a scan are lost, where fitted growth rates are wrong, where an alignment ends beside the
best fit. What is true of a point is known beforehand: an exhaustive scan, the rate of the numbers that are fitted, a
surface that was only rotated."""

import json
import zlib

import h5py
import numpy as np
import toml
from judging import Judgement
from lattice import Axis, Map
from surface_maps import icosphere

SECONDS = 120  # of a processor, for a command; mostly far less than one


def generator(*words):
    """Random numbers that are the same for the same point."""
    return np.random.default_rng(zlib.crc32(" ".join(map(str, words)).encode()))


# ---------------------------------------------------------------------------------------------- lines of scans

VALUES = 25  # of each axis of the scan
# f_HH of straight tubes, in u = H - a and v = H0 - b: negative, so ill-posed, in a region of the plane of H and H0.
# The formula is f, integrated twice by hand.
REGIONS = {
    "disc": "u^4/12 + (v^2 - w^2)*u^2/2",  # u^2 + v^2 < w^2
    "strip": "u^4/12*0.64 + 0.48*v*u^3/3 + (0.36*v^2 - w^2)*u^2/2",  # |0.8 u + 0.6 v| < w
    "ring": "u^6/30 + (v^2 - 0.04)*u^4/6 + ((v^2 - 0.04)^2 - 0.16*w^2)*u^2/2",  # |u^2 + v^2 - 0.2^2| < 0.4 w
}


def lines(box, region, width, seeds):
    """A region of half width `width` in a square of side 1, at random; `width` is given in that unit."""
    a, b = generator("lines", region, width, seeds).uniform(-0.2, 0.2, 2)
    formula = REGIONS[region]
    for letter, words in (("u", f"(H + {1 - a:.6f})"), ("v", f"(H0 - ({b:.6f}))"), ("w", f"{width}")):
        formula = formula.replace(letter, words)
    case = {"tier": "axisym", "energy": {"H0": 0.0, "term": [{"modulus": 1.0, "formula": formula}]}}
    case |= {"model": {"kind": "gradient-flow"}, "shape": {"kind": "tube", "radius": 1.0, "length": 2.0}, "time": {"end": 1e-6}}
    box.write("case.toml", toml.dump(case))
    radii = ",".join(f"{1 / (1 - x):.9g}" for x in np.linspace(-0.5, 0.5, VALUES))  # H = -1/radius, evenly
    over = ("--over", f"shape.radius={radii}", "--over", f"energy.H0=-0.5:0.5:{VALUES}", "--jobs", "1", "--overwrite")
    box.run("scan", "case.toml", *over, "-o", "all.hdf", limit=SECONDS)
    words = box.run("scan", "case.toml", *over, "--boundary", "outcome", "--seeds", str(seeds), "-o", "lines.hdf", limit=SECONDS).out
    every, found = outcomes(box.folder / "all.hdf"), outcomes(box.folder / "lines.hdf")
    return judged_lines(every, found, seeds, "may be missed" in words)


def outcomes(path):
    with h5py.File(path) as file:
        return file["points/outcome"][:]


def edges(outcome):
    """Pairs of neighbours whose outcomes differ, where both are known (0: not run)."""
    for axis in (0, 1):
        low, high = np.moveaxis(outcome, axis, 0)[:-1], np.moveaxis(outcome, axis, 0)[1:]
        for at in np.argwhere((low != high) & (low > 0) & (high > 0)):
            after = at + (1, 0)
            yield tuple(at[::-1] if axis else at), tuple(after[::-1] if axis else after)


def regions(outcome):
    """A number of its connected region for each point."""
    from scipy import ndimage

    labels = np.zeros_like(outcome)
    for kind in np.unique(outcome):
        found, count = ndimage.label(outcome == kind)
        labels[outcome == kind] = found[outcome == kind] + labels.max()
    return labels


def judged_lines(every, found, seeds, warned):
    """Told: the scan says that regions between the points of its lattice may be missed, and this one is there."""
    real = set(edges(every))
    missed = real - set(edges(found))
    if np.any(every[found > 0] != found[found > 0]):
        return Judgement("silent", "wrong outcomes")
    if not missed:
        return Judgement("right", "found" if real else "no region", 0.0)
    labels = regions(every)
    lattice = np.array([i * (VALUES - 1) // seeds for i in range(seeds + 1)])
    seen = set(labels[np.ix_(lattice, lattice)].flat)
    between = all(labels[low] not in seen or labels[high] not in seen for low, high in missed)
    kind = "told" if warned and between else "silent"
    return Judgement(kind, "missed" if len(missed) == len(real) else "a part is missed", len(missed) / len(real))


# ---------------------------------------------------------------------------------------------- fitted growth rates

CERTAIN = 0.1  # of the fitted rate: with a larger error bar, the program says that the amplitude is nowhere exponential


def fits(box, variant, noise, folds):
    """A wave that grows or decays by `folds` powers of e, with noise relative to its first amplitude."""
    way, points = variant.split(", ")
    times = np.linspace(0, 1, int(points.split()[0]))
    rate = folds if way == "grows" else -folds
    drawn = generator("fits", variant, noise, folds).standard_normal(len(times))
    amplitudes = 1e-4 * np.abs(np.exp(rate * times) + noise * drawn)
    return judged_fit(box, times, amplitudes, rate)


def judged_fit(box, times, amplitudes, rate):
    case = {"tier": "axisym", "energy": {"k20": 1.0}, "model": {"kind": "gradient-flow"}, "time": {"end": 1e-3}}
    case["shape"] = {"kind": "tube", "radius": 1.0, "length": 5.0, "mode": [{"amplitude": 0.01, "n": 1}]}
    box.write("case.toml", toml.dump(case))
    box.run("run", "case.toml", "--quiet", "--overwrite", "-o", "run.hdf", limit=SECONDS)
    with h5py.File(box.folder / "run.hdf", "r+") as file:  # measured numbers instead of computed ones
        for name in list(file["series"]):
            values = {"time": times, "mode_1": amplitudes}.get(name, np.resize(file["series"][name][:], len(times)))
            del file["series"][name]
            file["series"][name] = values
    done = box.run("stability", "run.hdf", "--fit", "1", "--json", limit=SECONDS)
    if done.status:
        return Judgement("told", "refused")
    fit = json.loads(done.out)
    apart, stated = abs(fit["rate"] / rate - 1), fit["error"] / abs(rate)
    if fit["error"] >= CERTAIN * abs(fit["rate"]):
        return Judgement("told", "large error bar", apart, stated)
    wrong = apart > max(2 * stated, 1e-6)
    return Judgement("silent" if wrong else "right", "wrong rate" if wrong else "finished", apart, stated)


# ---------------------------------------------------------------------------------------------- alignment

TRIANGLES = 3  # parts of an edge of an icosahedron: 180 triangles
AMPLITUDE = 0.02  # of the waves
ALIGNED = 1.2  # how much farther apart than by the known rotation: the best fit is not farther


def alignment(box, waves, degree, noise):
    """A sphere with harmonics of one degree, and the same with noise, relative to the waves, and rotated at random."""
    from scipy.spatial.transform import Rotation
    from scipy.special import sph_harm

    draw = generator("alignment", waves, degree, noise)
    points, faces = icosphere(TRIANGLES)
    around, down = np.arctan2(points[:, 1], points[:, 0]), np.arccos(points[:, 2])
    orders = {"m = 0": {0: 1.0}, "m = l": {degree: 1.0}}.get(waves) or dict(enumerate(draw.standard_normal(degree + 1)))
    wave = sum(size * np.real(sph_harm(m, degree, around, down)) for m, size in orders.items())
    wave *= AMPLITUDE / np.abs(wave).max()
    noisy = points * (1 + wave + noise * AMPLITUDE * draw.standard_normal(len(points)))[:, None]
    turn = Rotation.random(random_state=int(draw.integers(1 << 30)))
    for name, corners in (("a", points * (1 + wave)[:, None]), ("b", noisy), ("c", turn.apply(noisy))):
        if not surface(box, name, corners, faces):
            return Judgement("told", "no surface")
    known = json.loads(box.run("compare", "a.hdf", "b.hdf", "--json", limit=SECONDS).out)["frames"][0]["l2"]
    done = box.run("compare", "a.hdf", "c.hdf", "--align", "--json", limit=SECONDS)
    if done.status:
        return Judgement("told", "refused")
    apart = json.loads(done.out)["frames"][0]["l2"] / AMPLITUDE
    right = apart <= ALIGNED * known / AMPLITUDE + 1e-6
    return Judgement("right" if right else "told" if done.err.strip() else "silent", "aligned" if right else "not aligned", apart, known / AMPLITUDE)


def surface(box, name, corners, faces):
    """A result with a smooth surface through the corners; whether there is one."""
    words = [f"OFF\n{len(corners)} {len(faces)} 0"] + ["{:.12g} {:.12g} {:.12g}".format(*p) for p in corners]
    box.write(f"{name}.off", "\n".join(words + ["3 {} {} {}".format(*f) for f in faces]) + "\n")
    case = {"tier": "surface3d", "energy": {"k20": 1.0}, "shape": {"kind": "file", "path": f"{name}.off"}, "accuracy": {"energy": 0.1}}
    box.write(f"{name}.toml", toml.dump(case))
    return not box.run("run", f"{name}.toml", "--quiet", "--overwrite", "-o", f"{name}.hdf", limit=SECONDS).status


WIDTH, SEEDS = Axis("half width", 0.005, 0.3, log=True), Axis("seeds", 2, 24, log=True, whole=True)
NOISE, FOLDS = Axis("noise", 1e-6, 10, log=True), Axis("powers of e", 0.03, 30, log=True)
DEGREE, HIDING = Axis("degree", 2, 8, whole=True), Axis("noise", 1e-3, 1, log=True)
ENDS = ("grows, 10 points", "decays, 10 points", "grows, 200 points", "decays, 200 points")
MAPS = {
    "lines": Map("Lines of a scan", WIDTH, SEEDS, lines, tuple(REGIONS), across=4, levels=0, tier="tools"),
    "fits": Map("Fitted growth rates", NOISE, FOLDS, fits, ENDS, across=8, levels=1, tier="tools"),
    "alignment": Map("Aligned surfaces", DEGREE, HIDING, alignment, ("m = 0", "m = l", "all m"), across=4, levels=0, tier="tools"),
}
