"""
A vehicle: mass, drag and rolling resistance on a road from the map
===================================================================

Force at the wheels and the map's grade are known, speed is measured each half second. **The answer**: mass (is it
loaded?), drag area and rolling resistance. **How sure**: mass to a per mille, rolling to some per cent. **Others**: a
coast-down on a closed road.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
grade = 0.03 * np.sin(2 * np.pi * np.arange(1200) / 311) + 0.02 * np.sin(2 * np.pi * np.arange(1200) / 97)
push = np.repeat(rng.uniform(200, 2400, 30), 40) + 1900 * 9.81 * np.sin(grade) * 0.7
u = np.column_stack([push, grade])
truth = {"mass": 1900.0, "drag": 0.74, "rolling": 0.0085}

est = dw.GreyBox("vehicle", dt=0.5)
y = est.simulate(u, truth, noise=0.1, seed=1)
trace = est.scan(y, u)

fig, axes = plt.subplots(1, 3, figsize=(8.2, 2.8), layout="constrained")
for ax, name in zip(axes, truth):
    low, high = trace.interval(name)
    value = trace.parameters[-1, est.names.index(name)]
    print(f"{name} = {value:.4g} ({low[-1]:.4g} to {high[-1]:.4g}), the truth is {truth[name]:.4g}")
    assert low[-1] - (value - low[-1]) < truth[name] < high[-1] + (high[-1] - value)  # two bars
    ax.fill_between(trace.time, low, high, alpha=0.25, lw=0)
    ax.plot(trace.time, trace.parameters[:, est.names.index(name)])
    ax.axhline(truth[name], color="k", ls="--", lw=1)
    ax.set(title=f"{name} ({est.formulas.units[name]})", xlabel="s", ylim=(0.5 * truth[name], 1.5 * truth[name]))
