"""
A plant that drifts, jumps and becomes noisy: ARX
=================================================

The gain of a heater drifts, then a valve is replaced, a sample is wrong, and in the end the sensor gets worse.
Nothing of this is told. **The answer** is the gain at every sample, with the events; **how sure**: the band, and odds
for each event. **Others**: a fixed forgetting factor must be chosen, and is too slow or too restless; least squares
without forgetting never arrives.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, k = np.random.default_rng(3), np.arange(3000)
gain = 1 + 0.3 * np.sin(k / 300) + 0.5 * (k >= 1500)
u, y = rng.choice([-1.0, 1.0], 3000), np.zeros(3000)
for t in range(1, 3000):
    y[t] = 0.8 * y[t - 1] + gain[t] * u[t - 1] + (0.1 if t < 2400 else 0.3) * rng.standard_normal()
y[1000] += 3.0

# %%
# The estimator and its memory; a record at once, the same numbers as sample by sample.

trace = dw.ARX(1, 1, memory=dw.AutoMemory()).scan(y, u)
for event in trace.events():
    if event.kind in ("OUTLIER", "JUMP", "NOISE"):
        print(event.sample, event.text)

# %%
# Beside it what a forgetting factor of .98 makes of the same record.

forgetting = dw.ARX(1, 1, memory=dw.ExponentialForgetting(0.98)).scan(y, u)
b, std = trace.parameters[:, 1], trace.parameters_std[:, 1]
fig, ax = plt.subplots(figsize=(8, 4))
ax.plot(k, forgetting.parameters[:, 1], color="0.75", lw=1, label="forgetting .98")
ax.fill_between(k, b - 1.96 * std, b + 1.96 * std, alpha=0.25, lw=0, label="95 %")
ax.plot(k, b, lw=1.2, label="ARX with AutoMemory")
ax.plot(k, gain, "k--", lw=1, label="truth")
ax.set(xlabel="sample", ylabel="gain b1", ylim=(0.4, 2.2), title="The gain drifts, jumps at 1500, and is followed")
ax.legend(ncols=2)
for name, each in {"AutoMemory": trace, "forgetting .98": forgetting}.items():
    print(f"{name}: error {np.sqrt(np.mean((each.parameters[50:, 1] - gain[50:]) ** 2)):.3f}")
