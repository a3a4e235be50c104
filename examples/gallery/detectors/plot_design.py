"""
A threshold from a promise: run lengths
=======================================

How high must a threshold be for one false alarm in ten thousand samples, and what does that cost? **The answer** by
Page's integral equation, to eleven digits. **How sure**: simulated beside it. **Others**: thresholds are found by
trial.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

promises = np.array([100, 300, 1000, 3000, 10_000, 100_000])
fig, ax = plt.subplots(figsize=(8, 4))
for mean in (0.5, 1.0, 2.0):
    heights = [dw.detect.threshold_for(float(promise), mean / 2) for promise in promises]
    delays = [dw.detect.run_length(h, mean / 2, mean=mean) for h in heights]
    ax.semilogx(promises, delays, "o-", label=f"a shift of {mean} sd")
    print(f"shift {mean}: thresholds {np.round(heights, 2)}, delays {np.round(delays, 1)}")

rng, h, lengths = np.random.default_rng(0), dw.detect.threshold_for(300.0, 0.5), []
for _ in range(300):
    g, n = 0.0, 0
    while g < h:
        g, n = max(0.0, g + rng.standard_normal() - 0.5), n + 1
    lengths.append(n)
print(f"promised 300 samples between false alarms; simulated {np.mean(lengths):.0f} ± {np.std(lengths) / 300**0.5:.0f}")
ax.set(xlabel="samples between false alarms, promised", ylabel="samples until the alarm", title="What a promise costs")
ax.legend()
