"""
A room: two resistances and two capacities
==========================================

A heater goes on and off for three weeks while the weather changes; the air is measured each quarter of an hour. **The
answer**: how well the room holds heat (Re), and how much of it (Ci, Ce). **How sure**: Re to a per mille.
**Others**: the model TiTe of Bacher and Madsen (2011), fitted off-line.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
t = 900.0 * np.arange(2016)
outside = 3 + 5 * np.sin(2 * np.pi * t / 86400) + 2 * np.sin(2 * np.pi * t / 7e5)
u = np.column_stack([outside, 3000.0 * np.repeat(rng.integers(0, 2, 126), 16)])
truth = {"Ri": 0.0016, "Re": 0.0042, "Ci": 2500000.0, "Ce": 31000000.0}

est = dw.GreyBox("room", dt=900.0)
y = est.simulate(u, truth, noise=0.05, seed=1)
trace = est.scan(y, u)

fig, axes = plt.subplots(1, 4, figsize=(10.6, 2.8), layout="constrained")
for ax, name in zip(axes, truth):
    low, high = trace.interval(name)
    value = trace.parameters[-1, est.names.index(name)]
    print(f"{name} = {value:.4g} ({low[-1]:.4g} to {high[-1]:.4g}), the truth is {truth[name]:.4g}")
    assert low[-1] - (value - low[-1]) < truth[name] < high[-1] + (high[-1] - value)  # two bars
    ax.fill_between(trace.time, low, high, alpha=0.25, lw=0)
    ax.plot(trace.time, trace.parameters[:, est.names.index(name)])
    ax.axhline(truth[name], color="k", ls="--", lw=1)
    ax.set(title=f"{name} ({est.formulas.units[name]})", xlabel="s", ylim=(0.5 * truth[name], 1.5 * truth[name]))
