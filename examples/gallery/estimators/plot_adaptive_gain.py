"""
Noise levels that nobody knows: AdaptiveGain
============================================

The matrices are known, Q and R are not, and R jumps by sixteen when the sensor is shaken. **The answer** is the gain
of the best filter, learnt from the innovations. **How sure**: the gain has a bar of its own. **Others**: a Kalman
filter with the R of the first half follows the noise in the second.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, T = np.random.default_rng(1), 4000
x = np.cumsum(0.5 * rng.standard_normal(T))
r = np.where(np.arange(T) < 2000, 1.0, 4.0)
y = x + r * rng.standard_normal(T)


def best(q, r):
    """Return the gain of the steady Kalman filter of a random walk."""
    p = (q + np.sqrt(q * q + 4 * q * r)) / 2
    return p / (p + r)


trace = dw.AdaptiveGain(1.0, detector=dw.detect.GainProbes()).scan(y)
fixed = dw.StateSpace([[1.0]], Q=[0.25], R=1.0).scan(y)
gain, std = trace.parameters[:, 0], trace.parameters_std[:, 0]
fig, ax = plt.subplots(figsize=(8, 3.8))
ax.fill_between(np.arange(T), gain - 2 * std, gain + 2 * std, alpha=0.25, lw=0)
ax.plot(gain, label="learnt gain, two bars")
ax.plot(best(0.25, r**2), "k--", lw=1, label="of the filter that knows")
ax.set(xlabel="sample", ylabel="gain", ylim=(0, 0.8), title="R grows by sixteen at 2000")
ax.legend()
for name, each in {"AdaptiveGain": trace, "Kalman filter of the first half": fixed}.items():
    error = each.x[2300:].ravel() - x[2300:]
    print(f"{name}: error {np.sqrt(np.mean(error**2)):.2f} after the jump")
