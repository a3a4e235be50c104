"""
A heat exchanger: UA tells how dirty it is
==========================================

Flows and inlet temperatures of two streams vary; both outlets are measured each second. **The answer**: the transfer
coefficient UA, which falls with dirt, and the capacities of both sides. **How sure**: UA to a tenth of a per cent in
ten minutes. **Others**: UA by logarithmic mean temperatures needs steady state.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
flows = np.repeat(rng.uniform(0.3, 0.9, (20, 2)), 30, axis=0)
inlets = np.repeat(rng.uniform([70, 10], [85, 15], (6, 2)), 100, axis=0)
u = np.hstack([flows, inlets])
truth = {"UA": 1450.0, "Ch": 31000.0, "Cc": 52000.0}

est = dw.GreyBox("exchanger", dt=1.0)
y = est.simulate(u, truth, noise=[0.1, 0.1], seed=1)
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
