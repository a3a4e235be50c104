"""
Parameters that jump: restart, reset, or all instants at once
=============================================================

A gain jumps every five hundred samples or so. **The answer**: the gain, and when it jumped. **How sure**: bars that
open at an alarm, and close again. **Others**: a random walk that is quick enough for the jumps is restless between
them; Bayesian change points are the most accurate, and cost twenty filters.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, T = np.random.default_rng(7), 3000
gain = np.repeat(rng.uniform(0.5, 2.0, 6), 500)
u = rng.standard_normal(T)
y = np.r_[0.0, gain[1:] * u[:-1]] + 0.3 * rng.standard_normal(T)
score = dw.detect.ScoreCUSUM("1 per 10_000")
memories = {
    "CovarianceInflation": dw.RestartOnChange(score, dw.memory.CovarianceInflation(1.0), settle=20),
    "GainReset": dw.RestartOnChange(score, dw.memory.GainReset(5), settle=20),
    "BayesianChangePoint": dw.memory.BayesianChangePoint(1.0, 500),
    "RandomWalk": dw.RandomWalk(0.01),
}
fig, axes = plt.subplots(2, 2, figsize=(9, 5), sharex=True, sharey=True, layout="constrained")
for ax, (name, memory) in zip(axes.flat, memories.items()):
    trace = dw.ARX(0, 1, memory=memory).scan(y, u)
    b, std = trace.parameters[:, 0], trace.parameters_std[:, 0]
    error = np.sqrt(np.mean((b - gain)[50:] ** 2))
    ax.fill_between(np.arange(T), b - 2 * std, b + 2 * std, alpha=0.25, lw=0)
    ax.plot(b, lw=1)
    ax.plot(gain, "k--", lw=0.8)
    ax.set(title=f"{name}: error {error:.3f}", ylim=(0, 2.6))
    print(f"{name:20s} error {error:.3f}, jumps told {[int(jump.sample) for jump in trace.jumps()]}")
