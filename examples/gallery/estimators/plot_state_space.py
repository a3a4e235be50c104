"""
Matrices that you know: StateSpace, the Kalman filter
=====================================================

A position is measured with noise, with a gap of forty samples and two wrong plots; the speed is wanted. **The
answer**: position and speed. **How sure**: the band opens in the gap as it must. **Others**: any Kalman filter gives
the same numbers on clean data; here NaN is a missing sample, a gate takes outliers, and the covariance stays one.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(1)
speeds = 1 + 0.1 * np.cumsum(rng.standard_normal(200))
way = np.cumsum(speeds)
y = way + 2 * rng.standard_normal(200)
y[80:120] = np.nan
y[[40, 150]] += 40

est = dw.StateSpace([[1, 1], [0, 1]], H=[1, 0], Q=[0, 0.01], R=4.0, states=("way", "speed"), gate=dw.InnovationGate(5))
trace = est.scan(y)
speed, std = trace.of("speed")
k = np.arange(200)
fig, ax = plt.subplots(figsize=(8, 3.8))
ax.fill_between(k, speed - 1.96 * std, speed + 1.96 * std, alpha=0.25, lw=0, label="95 %")
ax.plot(k, speed, label="speed")
ax.plot(k, speeds, "k--", lw=1, label="truth")
ax.axvspan(80, 120, color="0.9", zorder=0)
ax.set(xlabel="sample", ylim=(-4, 5), title="Speed from noisy positions; nothing was measured in the grey part")
ax.legend(ncols=3)
print(*(event.text for event in trace.events()), sep="\n")
