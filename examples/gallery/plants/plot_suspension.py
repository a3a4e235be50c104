"""
A quarter of a car on a test rig: does the damper still damp?
=============================================================

The rig moves the road, deflection and acceleration of the body are measured each 5 ms. **The answer**: damping cs,
stiffness of spring and tyre, mass of the wheel; the body was weighed. **How sure**: to a per cent in five seconds.
**Others**: the EUSAMA test tells adhesion, not the damper.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
u = np.repeat(rng.uniform(-0.02, 0.02, 50), 20)
truth = {"mu": 36.0, "ks": 17500.0, "cs": 950.0, "kt": 210000.0}

est = dw.GreyBox("suspension", dt=0.005)
y = est.simulate(u, truth, noise=[5e-4, 0.1], seed=1)
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
