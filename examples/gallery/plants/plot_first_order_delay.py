"""
Gain, time constant and dead time
=================================

A valve is stepped, what comes out is sampled each second. **The answer**: the three numbers that controllers are
tuned by. **How sure**: the dead time to a tenth of a second, between the samples. **Others**: the tangent by eye, on
one step without noise.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
u = np.repeat(rng.uniform(-1, 1, 20), 40)
truth = {"gain": 1.8, "tau": 17.0, "delay": 6.3}

est = dw.GreyBox("first_order_delay", dt=1.0)
y = est.simulate(u, truth, noise=0.03, seed=1)
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
