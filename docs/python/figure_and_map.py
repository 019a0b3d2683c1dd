#!/usr/bin/python3
# %% [markdown]
# The paper's axisymmetric figure, and a map of the fate of tubes. Writes figure.png and map.png.

# %%
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import tubule

# %% The figure: a tube relaxes for three moduli of K^2.
MODULI = (0, 0.06, 0.12)
tube = tubule.Case(
    {
        "tier": "axisym",
        "energy": {"k20": 0.2, "H0": -2},
        "shape": {"kind": "tube", "radius": 1, "length": 2, "mode": [{"amplitude": 0.25, "n": 1, "phase": -np.pi / 2}]},
        "accuracy": {"energy": 1e-6},
        "time": {"end": 1.4, "output": [0.01, 0.05, 0.2, 0.5]},
    }
)
results = tubule.run_many(tube.with_(energy__k42=k) for k in MODULI)

figure, (shapes, energies) = plt.subplots(1, 2, figsize=(7, 3), layout="constrained")
for k, result in zip(MODULI, results):
    r, z = result.frames[2].profile()
    shapes.plot(z, r, label=f"$k_{{42}} = {k}$")
    energies.semilogy(result.series["time"], result.series["energy"])
shapes.set(xlabel="$z$", ylabel=f"$r$ at $t = {results[0].frames[2].time:g}$")
shapes.legend()
energies.set(xlabel="$t$", ylabel="energy")
figure.savefig("figure.png", dpi=150)

# %% The map: which tubes pinch, over amplitude and k42.
steep = tubule.Case(
    {
        "tier": "axisym",
        "energy": {"k20": 0.2, "H0": -2},
        "shape": {"kind": "tube", "radius": 1, "length": 2, "mode": [{"amplitude": 0.3, "n": 1}]},
        "accuracy": {"energy": 1e-3, "r_min": 0.05},
        "discretisation": {"parametrisation": "graph"},
        "time": {"end": 20, "stationary": 1e-6},
    }
)
amplitudes, moduli = np.linspace(0.1, 0.5, 13), np.geomspace(1e-5, 1e-2, 13)
scan = tubule.scan(steep, {"shape.mode.0.amplitude": amplitudes, "energy.k42": moduli})
names = sorted(set(scan.outcome.ravel()))
colours = plt.get_cmap("viridis", len(names))
number = np.vectorize(names.index)(scan.outcome)

figure, axes = plt.subplots(figsize=(4, 3), layout="constrained")
picture = axes.pcolormesh(moduli, amplitudes, number, cmap=colours, vmin=-0.5, vmax=len(names) - 0.5, shading="nearest")
axes.set(xscale="log", xlabel="$k_{42}$", ylabel="amplitude")
figure.colorbar(picture, ticks=range(len(names))).ax.set_yticklabels(names)
figure.savefig("map.png", dpi=150)
print({name: int((scan.outcome == name).sum()) for name in names})
