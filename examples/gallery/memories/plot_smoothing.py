"""
In hindsight: smooth, and a drift that is learnt from the whole record
======================================================================

A record is complete; what was the gain at each time? **The answer**: each sample judged by those after it too. **How
sure**: bands that count that the speed of drift itself was learnt. **Others**: a filter knows the past only, and is
late everywhere.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, T = np.random.default_rng(3), 1200
gain = 1 + 0.4 * np.sin(np.arange(T) / 120) + 0.6 * (np.arange(T) >= 700)
u, y = rng.standard_normal(T), np.zeros(T)
for t in range(1, T):
    y[t] = 0.7 * y[t - 1] + gain[t] * u[t - 1] + 0.4 * rng.standard_normal()

filtered = dw.ARX(1, 1, memory=dw.AutoMemory()).scan(y, u)
smoothed = dw.ARX(1, 1).smooth(y, u)
print(smoothed.words)

b, std = smoothed.parameters[:, 1], smoothed.parameters_std[:, 1]
fig, ax = plt.subplots(figsize=(8, 4))
ax.plot(filtered.parameters[:, 1], color="0.6", lw=1, label="filtered, AutoMemory")
ax.fill_between(np.arange(T), b - 1.96 * std, b + 1.96 * std, alpha=0.25, lw=0, label="95 %")
ax.plot(b, label="smoothed")
ax.plot(gain, "k--", lw=1, label="truth")
ax.set(xlabel="sample", ylabel="gain b1", ylim=(0, 2.6), title="Each sample in the light of those after it")
ax.legend(ncols=2)
for name, each in {"filtered": filtered.parameters, "smoothed": smoothed.parameters}.items():
    print(f"{name}: error {np.sqrt(np.mean((each[50:, 1] - gain[50:]) ** 2)):.3f}")
