"""
A DC motor: resistance, inductance, torque constant, inertia, friction
======================================================================

A motor is driven by steps of voltage; current and speed are measured each millisecond. **The answer**: its five
numbers, from any start within a factor of five. **How sure**: to a per cent after a second. **Others**: by hand, a
locked rotor for R and L and a run-down for J and b.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
u = np.repeat(rng.uniform(-12, 12, 40), 25)
truth = {"R": 1.6, "L": 0.0035, "k": 0.042, "J": 6e-05, "b": 0.00012}

est = dw.GreyBox("dc_motor", dt=0.001)
y = est.simulate(u, truth, noise=[0.05, 1.0], seed=1)
trace = est.scan(y, u)

fig, axes = plt.subplots(1, 5, figsize=(11, 2.8), layout="constrained")
for ax, name in zip(axes, truth):
    low, high = trace.interval(name)
    value = trace.parameters[-1, est.names.index(name)]
    print(f"{name} = {value:.4g} ({low[-1]:.4g} to {high[-1]:.4g}), the truth is {truth[name]:.4g}")
    assert low[-1] - (value - low[-1]) < truth[name] < high[-1] + (high[-1] - value)  # two bars
    ax.fill_between(trace.time, low, high, alpha=0.25, lw=0)
    ax.plot(trace.time, trace.parameters[:, est.names.index(name)])
    ax.axhline(truth[name], color="k", ls="--", lw=1)
    ax.set(title=f"{name} ({est.formulas.units[name]})", xlabel="s", ylim=(0.5 * truth[name], 1.5 * truth[name]))
