"""
State and parameters at once, with a third of the samples missing: Joint
========================================================================

A plant of order two, a third of whose outputs never arrived. **The answer**: what the plant is, and where it was
while nobody saw it. **How sure**: the band is the exact posterior given all that came; count what it holds.
**Others**: least squares on what is complete loses most rows, for each lag that is missing takes a row with it; a
filter that is not told of gaps ends in NaN.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

complete, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=600, noise_std=0.3, seed=4)
missing = np.random.default_rng(1).random(600) < 0.33
y = np.where(missing, np.nan, complete)

trace = dw.Joint(2, inputs=1).scaled_to(y, u).scan(y, u)
for name, value, std, truth in zip(trace.names, trace.parameters[-1], trace.parameters_std[-1], [-1.5, 0.7, 1.0, 0.5]):
    print(f"{name} {value:6.3f} ± {std:.3f}   truth {truth}")

predicted, band = trace.prediction, trace.band(0.95)
part = slice(400, 470)
k = np.arange(600)[part]
fig, ax = plt.subplots(figsize=(8, 3.8))
ax.fill_between(k, (predicted - band)[part], (predicted + band)[part], alpha=0.25, lw=0, label="95 %")
ax.plot(k, predicted[part], lw=1, label="predicted")
ax.plot(k, y[part], "ko", ms=3, label="measured")
ax.plot(k[missing[part]], complete[part][missing[part]], "rx", ms=5, label="never arrived")
ax.set(xlabel="sample", title="Where the plant was while nobody saw it")
ax.legend(ncols=4, fontsize=8)
inside = np.abs(predicted - complete)[missing] < band[missing]
print(f"{100 * inside[20:].mean():.0f} % of the missing ones lie in their 95 % band")
