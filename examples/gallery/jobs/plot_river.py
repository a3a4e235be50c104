"""
A river, a well, and a dam: the gain in hindsight
=================================================

Groundwater follows a river, by a gain that falls when a dam is built and its bed clogs. **The answer**: the gain in
every week, from the whole record. **How sure**: a band in hindsight. **Others**: comparing the years before with
those after needs to know when.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, weeks = np.random.default_rng(12), 940
river = np.zeros(weeks)
for t in range(1, weeks):
    river[t] = 0.9 * river[t - 1] + 0.2 * rng.standard_normal() + 0.05 * np.sin(2 * np.pi * t / 52)
gain = np.where(np.arange(weeks) < 600, 0.30, 0.30 - 0.18 * (1 - np.exp(-(np.arange(weeks) - 600) / 40)))
well = np.zeros(weeks)
for t in range(1, weeks):
    well[t] = 0.75 * well[t - 1] + gain[t] * river[t - 1] + 0.03 * rng.standard_normal()

est = dw.ARX(1, 1, offset=True).scaled_to(well, river)
smoothed = est.smooth(well, river)
print(smoothed.words)
filtered = dw.ARX(1, 1, offset=True, memory=dw.AutoMemory()).scaled_to(well, river).scan(well, river)
b, std = smoothed.parameters[:, 1], smoothed.parameters_std[:, 1]
year = 1998 + np.arange(weeks) / 52
fig, ax = plt.subplots(figsize=(8, 4))
ax.plot(year, filtered.parameters[:, 1], color="0.65", lw=1, label="as it was known then")
ax.fill_between(year, b - 1.96 * std, b + 1.96 * std, alpha=0.25, lw=0)
ax.plot(year, b, label="in hindsight, 95 %")
ax.plot(year, gain, "k--", lw=1, label="truth")
ax.set(xlabel="year", ylabel="gain from the river", ylim=(0, 0.5), title="The bed clogs behind the dam")
ax.legend()
print(f"truth in the band: {100 * np.mean(np.abs(b - gain) < 1.96 * std):.0f} % of the weeks")
