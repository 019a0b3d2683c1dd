#!/usr/bin/python3
"""Orders of both solvers on manufactured flows of surfaces that move, by sources.

The sphere of radius R(t) carries a shear flow or an octahedral vortex, as in tests/support/inflating_sphere.hpp. The
ellipsoid with half axes a(t) moves by the linear flow u = (a'/a) x, p = p0 + p1 x y or p0 + p1 z^2, whose force SymPy
derives from theory.md (3.26) with the level set x M x = 1. Both begin at rest. Exact integrals are by quadrature.

    sources_study.py TUBULE [time|space|axisym ...]

Exit status 1 if an order is more than 0.2 below what theory.md claims, or an error of the axisymmetric solver above what
it states.
"""

import functools
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
import sympy

K20, H0, GAMMA, P0, P1 = 0.3, -1.0, 0.5, -1.0, 0.4
T = sympy.Symbol("t")
X = sympy.symbols("x y z")
WAVE = 1 - sympy.cos(2 * T)
AXES = {
    "sphere": (1 + WAVE / 5,) * 3,
    "spheroid": (1 + WAVE / 10, 1 + WAVE / 10, sympy.Rational(4, 5) - WAVE / 20),
    "ellipsoid": (1 + WAVE / 10, sympy.Rational(9, 10) - WAVE / 20, sympy.Rational(11, 10) + WAVE / 10),
}
QUANTITIES = ("energy", "kinetic_energy", "area", "volume", "dissipation", "tension")
# What theory.md (10.11), (10.16) claim of fixed steps.
TIME = (("fluid", "euler", 1), ("fluid", "alpha", 2), ("stokes", "bdf2", 2), ("stokes", "bdf", 4), ("overdamped", "bdf", 4))
SPACE = {2: 4, 3: 4, 4: 6}  # of energy and area, by the order of the elements


def grad(f):
    return sympy.Matrix([sympy.diff(f, x) for x in X])


@functools.lru_cache
def flow(shape, vortex, inertia, viscosity, axisymmetric):
    """Body force, mass source and velocity, p: expressions of x, y, z, t."""
    x = sympy.Matrix(X)
    axes = AXES[shape]
    M = sympy.diag(*(a**-2 for a in axes))
    L = sympy.diag(*(sympy.diff(a, T) / a for a in axes))
    c = {"none": 0, "shear": sympy.sin(T), "octahedral": sympy.sin(T)}[vortex]
    q = sympy.Matrix([-X[1] * X[2], X[0] * X[2], 0]) if vortex != "octahedral" else sympy.Matrix(
        [X[i] * (X[i - 2] ** 2 - X[i - 1] ** 2) for i in range(3)])
    u = L * x + c * q
    form = lambda k: sum(M[i, i] ** k * X[i] ** 2 for i in range(3))  # x M^k x
    tr = lambda k: sum(M[i, i] ** k for i in range(3))
    # H = h(q, s) and K with q = x M^2 x, s = x M^3 x; and the surface Laplacian of functions of both.
    q_, s_ = sympy.symbols("q_ s_", positive=True)
    h = -tr(1) / sympy.sqrt(q_) + s_ / q_ ** sympy.Rational(3, 2)
    first = {q_: 2 * (tr(2) - form(4) / q_) + 2 * h * s_ / sympy.sqrt(q_),
             s_: 2 * (tr(3) - form(5) / q_) + 2 * h * form(4) / sympy.sqrt(q_)}
    second = {(q_, q_): 4 * (form(4) - s_**2 / q_), (q_, s_): 8 * (form(5) - s_ * form(4) / q_), (s_, s_): 4 * (form(6) - form(4) ** 2 / q_)}
    laplace = sum(sympy.diff(h, v) * f for v, f in first.items()) + sum(sympy.diff(h, *v) * f for v, f in second.items())
    K = M.det() / q_**2  # where x M x = 1
    b = -2 * K20 * (laplace + (h**2 - 2 * K) * (h - H0)) + h * K20 * (h - H0) ** 2
    H, b = (f.subs({q_: form(2), s_: form(3)}) for f in (h, b))
    size = sympy.sqrt(form(2))
    normal = M * x / size
    p = P0 + P1 * (X[2] ** 2 if axisymmetric else X[0] * X[1])
    G = u.jacobian(X)
    P = sympy.eye(3) - normal * normal.T
    along = lambda v: v - normal * normal.dot(v)
    D = P * (G + G.T) / 2 * P
    force = along(grad(p)) + p * H * normal + GAMMA * u - b * normal
    if inertia:
        force += sympy.diff(u, T) + G * u
    if viscosity:  # div_C D of the linear flow; what c q adds is that of a sphere
        l, pinned = sum(L[i, i] * normal[i] ** 2 for i in range(3)), L * normal
        trace = sum(L[i, i] * M[i, i] * (1 - 2 * normal[i] ** 2) for i in range(3)) + l * form(3) / form(2)
        stress = -along(M * along(pinned)) / size - normal * trace / size + H * (pinned - normal * l)
        decay = {"none": 0, "shear": 4, "octahedral": 10}[vortex]
        force -= 2 * stress - decay * c * q / axes[0] ** 2
    return force, L.trace() - sum(L[i, i] * normal[i] ** 2 for i in range(3)), u, p, D, H


def text(expression):
    return str(sympy.N(expression, 17)).replace("**", "^").replace(" ", "")


def model(tier, shape, vortex, kind):
    inertia, viscosity = kind == "fluid", kind in ("fluid", "stokes")
    force, mass, *_ = flow(shape, vortex, inertia, viscosity, tier == "axisym")
    lines = ['volume = "free"']
    if tier == "surface3d":
        lines += [f'source.force_{n} = "{text(f)}"' for n, f in zip("xyz", force)]
    else:  # at y = 0
        r = sympy.Symbol("r")
        force, mass = [f.subs({X[1]: 0, X[0]: r}) for f in force], mass.subs({X[1]: 0, X[0]: r})
        lines += [f'source.force_r = "{text(force[0])}"', f'source.force_z = "{text(force[2])}"']
        if inertia and vortex != "none":
            lines.append(f'source.force_theta = "{text(force[1])}"')
    return lines + [f'source.mass = "{text(mass)}"']


@functools.lru_cache
def exact(shape, vortex, kind, axisymmetric, time):
    inertia, viscosity = kind == "fluid", kind in ("fluid", "stokes")
    _, _, u, p, D, H = flow(shape, vortex, inertia, viscosity, axisymmetric)
    z, weight = np.polynomial.legendre.leggauss(60)
    phi = np.arange(80) * 2 * np.pi / 80
    ring = np.sqrt(1 - z**2)
    unit = np.array([np.outer(ring, np.cos(phi)), np.outer(ring, np.sin(phi)), np.outer(z, np.ones(80))]).reshape(3, -1)
    axes = np.array([float(a.subs(T, time)) for a in AXES[shape]])
    at = axes[:, None] * unit
    dS = np.repeat(weight, 80) * 2 * np.pi / 80 * np.prod(axes) * np.sqrt(np.sum((unit / axes[:, None]) ** 2, axis=0))
    number = lambda f: np.broadcast_to(sympy.lambdify(X, f.subs(T, time), "numpy")(*at), at[0].shape)
    speed2 = sum(number(v) ** 2 for v in u)
    strain2 = sum(number(d) ** 2 for d in D) if viscosity else 0
    area = dS.sum()
    return dict(energy=(K20 * (number(H) - H0) ** 2 * dS).sum(), kinetic_energy=inertia * (speed2 * dS).sum() / 2, area=area,
                volume=4 * np.pi / 3 * np.prod(axes), dissipation=((2 * strain2 + GAMMA * speed2) * dS).sum(),
                tension=-(number(p) * dS).sum() / area)


def field_errors(frame, shape, vortex, kind):
    """Of u and p: root mean squares over the nodes, relative to those of the exact fields."""
    _, _, u, p, *_ = flow(shape, vortex, kind == "fluid", kind in ("fluid", "stokes"), False)
    at, time = frame["Points"][:].T, float(frame.attrs["time"])
    number = lambda f: np.broadcast_to(sympy.lambdify(X, f.subs(T, time), "numpy")(*at), at[0].shape)
    exact_fields = {"u": np.array([number(v) for v in u]), "p": number(p)}
    return {n: np.sqrt(np.mean((frame[f"PointData/{n}"][:].T - e) ** 2) / np.mean(e**2)) for n, e in exact_fields.items()}


def errors(program, tier, shape, vortex, kind, end, discretisation, asked):
    initial = [float(a.subs(T, 0)) for a in AXES[shape]]
    shape_keys = 'kind = "ellipsoid"\n' + "\n".join(f"{n} = {a}" for n, a in zip("abc", initial))
    case = [f'tier = "{tier}"', f"energy = {{k20 = {K20}, H0 = {H0}}}", f"accuracy.energy = {asked}", f"time.end = {end}"]
    if tier == "surface3d":
        case.append("accuracy.estimate = false")
    case += ["[discretisation]"] + [f"{k} = {v}" for k, v in discretisation.items()]
    case += ["[shape]", shape_keys, "[model]", f'kind = "{kind}"', f"gamma = {GAMMA}"] + model(tier, shape, vortex, kind)
    with tempfile.TemporaryDirectory() as folder:
        path, result = Path(folder) / "case.toml", Path(folder) / "result.hdf"
        path.write_text("\n".join(case) + "\n")
        done = subprocess.run([program, "run", path, "-o", result, "--quiet"], capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"{tier} {shape} {kind}: {done.stdout}{done.stderr}")
        with h5py.File(result) as file:
            series = file["series"]
            values = exact(shape, vortex, kind, tier == "axisym", float(series["time"][-1]))
            scale = float(file["about"].attrs["E_ref"])
            stated = float(series["energy_error"][-1])
            out = {q: abs(float(series[q][-1]) - values[q]) / max(abs(values[q]), 1e-30) for q in QUANTITIES
                   if q in series and values[q] != 0}
            out["stated"] = abs(float(series["energy"][-1]) - values["energy"]) / stated if stated > 0 else np.nan
            if tier == "surface3d":
                out |= field_errors(file["frames"][sorted(file["frames"])[-1]], shape, vortex, kind)
            out["of_scale"] = abs(float(series["energy"][-1]) - values["energy"]) / scale
    return out


def table(title, rows, names, steps):
    """Errors, and orders from row to row; the orders of the last two."""
    print(title)
    for step, row in zip(steps, rows):
        print(f"  {step:<8g}", " ".join(f"{row.get(n, 0):10.2e}" for n in names), flush=True)
    orders = {n: np.log(rows[-2][n] / rows[-1][n]) / np.log(steps[-2] / steps[-1]) for n in names if rows[-1].get(n)}
    print("  order   ", " ".join(f"{orders.get(n, np.nan):10.2f}" for n in names), flush=True)
    return orders


def main():
    program, parts = sys.argv[1], sys.argv[2:] or ["time", "space", "axisym"]
    bad = []
    if "axisym" in parts:
        for shape, vortex, kind in (("sphere", "shear", "fluid"), ("spheroid", "none", "fluid"), ("spheroid", "none", "stokes"),
                                    ("spheroid", "none", "overdamped")):
            for asked in (1e-4, 1e-6, 1e-8):
                row = errors(program, "axisym", shape, vortex, kind, 1, {}, asked)
                print(f"axisym {shape} {vortex} {kind} {asked:g}: error over E_ref {row['of_scale']:.1e}, over stated {row['stated']:.2f},",
                      " ".join(f"{q} {row[q]:.1e}" for q in QUANTITIES if q in row), flush=True)
                if row["stated"] > 1:
                    bad.append(f"axisym {shape} {kind} {asked}")
    if "time" in parts:
        names = ("kinetic_energy", "area", "dissipation")
        for kind, scheme, claim in TIME:
            steps = (0.1, 0.05, 0.025)
            keys = {"elements": 320, "order": 4, "scheme": f'"{scheme}"'}
            rows = [errors(program, "surface3d", "sphere", "shear", kind, 1, keys | {"step": s}, 0.1) for s in steps]
            orders = table(f"sphere, {kind}, {scheme}, steps; claimed {claim}: {' '.join(names)}", rows, names, steps)
            if orders["area"] < claim - 0.2:
                bad.append(f"{kind} {scheme} {orders}")
    if "space" in parts:
        for shape, vortex in (("sphere", "octahedral"), ("ellipsoid", "none")):
            for k, claim in SPACE.items():
                counts = (180, 320, 720)
                widths = [n**-0.5 for n in counts]
                keys = {"order": k, "scheme": '"bdf"', "step": 0.005}
                rows = [errors(program, "surface3d", shape, vortex, "stokes", 0.2, keys | {"elements": n}, 0.1) for n in counts]
                names = (*QUANTITIES, "u", "p")
                orders = table(f"{shape}, k = {k}, widths; claimed {claim}: {' '.join(names)}", rows, names, widths)
                if orders["energy"] < claim - 0.2:
                    bad.append(f"{shape} k = {k} {orders}")
    for what in bad:
        print("not as claimed:", what)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
