"""
A tank that empties through a hole
==================================

Inflow is switched, the level is measured every two seconds with a ripple of 3 mm. **The answer**: cross-section of
the tank and effective area of its hole: a clogged one is smaller. **How sure**: both to a per mille or two. **Others**:
Torricelli's law is not linear; a gain and a time constant would hold at one level alone.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
u = np.repeat(rng.uniform(0.5e-3, 2.2e-3, 15), 60)
truth = {"A": 0.16, "a": 0.00038}

est = dw.GreyBox("tank", dt=2.0)
y = est.simulate(u, truth, noise=0.003, seed=1)
trace = est.scan(y, u)

fig, axes = plt.subplots(1, 2, figsize=(5.8, 2.8), layout="constrained")
for ax, name in zip(axes, truth):
    low, high = trace.interval(name)
    value = trace.parameters[-1, est.names.index(name)]
    print(f"{name} = {value:.4g} ({low[-1]:.4g} to {high[-1]:.4g}), the truth is {truth[name]:.4g}")
    assert low[-1] - (value - low[-1]) < truth[name] < high[-1] + (high[-1] - value)  # two bars
    ax.fill_between(trace.time, low, high, alpha=0.25, lw=0)
    ax.plot(trace.time, trace.parameters[:, est.names.index(name)])
    ax.axhline(truth[name], color="k", ls="--", lw=1)
    ax.set(title=f"{name} ({est.formulas.units[name]})", xlabel="s", ylim=(0.5 * truth[name], 1.5 * truth[name]))
