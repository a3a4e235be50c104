"""
A hedge ratio that moves
========================

Two shares that move together, by a ratio that drifts, and breaks once. **The answer**: the ratio on every day, and
the day of the break. **How sure**: its bar, which says when not to trade. **Others**: ordinary least squares over a
window of sixty days is late by a month, and does not tell a break from noise.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, days = np.random.default_rng(8), 1000
market = 0.01 * rng.standard_normal(days)
ratio = 1.2 + 0.15 * np.sin(np.arange(days) / 150) - 0.5 * (np.arange(days) >= 600)
share = ratio * market + 0.003 * rng.standard_normal(days)

trace = dw.Regression(["ratio"], offset=True, memory=dw.AutoMemory()).scaled_to(share, market).scan(share, market)
b, std = trace.parameters[:, 0], trace.parameters_std[:, 0]
windowed = (
    dw.Regression(["ratio"], offset=True, memory=dw.memory.Window(60)).scaled_to(share, market).scan(share, market)
)
for jump in trace.jumps():
    print(jump.sample, jump.text)
fig, ax = plt.subplots(figsize=(8, 4))
ax.plot(windowed.parameters[:, 0], color="0.65", lw=1, label="least squares of 60 days")
ax.fill_between(np.arange(days), b - 2 * std, b + 2 * std, alpha=0.25, lw=0)
ax.plot(b, label="AutoMemory")
ax.plot(ratio, "k--", lw=1, label="truth")
ax.set(xlabel="trading day", ylabel="hedge ratio", ylim=(0.3, 1.8), title="The ratio drifts, and breaks on day 600")
ax.legend()
for name, each in {"AutoMemory": trace, "window": windowed}.items():
    unhedged = share - np.r_[0, each.parameters[:-1, 0]] * market
    print(f"{name}: what is left moves {1e4 * unhedged[100:].std():.1f} basis points a day")
