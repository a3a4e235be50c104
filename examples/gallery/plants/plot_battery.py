"""
A battery cell: R0, R1 and C1, and the day R0 rises by 30 %
===========================================================

Current steps of a drive cycle, voltage each second to half a millivolt. **The answer**: ohmic resistance and one RC
pair, around a rest voltage that nobody told; and when R0 jumped. **How sure**: R0 to some per mille. **Others**:
reading the edge by hand gives R0 alone, at edges alone.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
u = np.repeat(rng.choice([-10.0, -4.0, 0.0, 6.0], 90), 20)
truth = {"R0": 0.0032, "R1": 0.0054, "C1": 3400.0}

est = dw.GreyBox("battery", memory=dw.AutoMemory(), dt=1.0)
new, aged = (est.simulate(u, truth | {"R0": R0}, noise=5e-4, seed=1) for R0 in (0.0032, 1.3 * 0.0032))
trace = est.scan(np.where(np.arange(1800) < 1200, new, aged), u)
truth["R0"] *= 1.3
for event in trace.jumps():
    print(event.text)

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
