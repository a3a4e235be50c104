"""
A pendulum with a motor at its pivot
====================================

Torque swings it up to a radian, the angle is measured each 20 ms. **The answer**: inertia, weight and friction,
although the sine is not linear. **How sure**: to some per mille. **Others**: linearised about hanging down, the same
fit is off by more than its bars.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
u = np.repeat(rng.uniform(-1.2, 1.2, 60), 15)
truth = {"J": 0.14, "weight": 1.5, "b": 0.09}

est = dw.GreyBox("pendulum", dt=0.02)
y = est.simulate(u, truth, noise=0.01, seed=1)
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
