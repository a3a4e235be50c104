"""
A mass on a spring: three numbers from a push
=============================================

A random force pushes, the position is measured each 10 ms to 0.1 mm. **The answer**: mass, damping and stiffness.
**How sure**: all to a per mille. **Others**: an ARX model gives poles; the three numbers follow only by way of them,
and with bias.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
u = np.repeat(rng.uniform(-3, 3, 80), 10)
truth = {"m": 1.7, "d": 1.1, "k": 64.0}

est = dw.GreyBox("mass_spring_damper", dt=0.01)
y = est.simulate(u, truth, noise=1e-4, seed=1)
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
