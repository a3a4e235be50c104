"""
Samples at irregular instants: ContinuousJoint
==============================================

An oscillator seen at random instants, 20 to 300 ms apart. **The answer** is its differential equation: frequency and
damping. **How sure**: bars, which know noise only: on data as precise as these, the straight lines between samples
cost more, and two observer rates tell how much. **Others**: a discrete model has no meaning here; interpolation to a
grid makes the damping wrong.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng = np.random.default_rng(0)
time = np.cumsum(rng.uniform(0.02, 0.3, 1500))
y, u = dw.models.simulate_continuous([0.3, 1.0], [0.0, 2.0], time=time, noise_std=0.01, seed=1)
trace = dw.ContinuousJoint(2, inputs=1, dt=0.16).scan(y, u, time=time)
for name, value, std in zip(trace.names, trace.parameters[-1], trace.parameters_std[-1]):
    print(f"{name} {value:.3f} ± {std:.3f}")

for rate in (0.6, 1.2, 2.4):
    other = dw.ContinuousJoint(2, inputs=1, dt=0.16, observer=rate).scan(y, u, time=time)
    print(f"observer at {rate} rad/s: a1 {other.parameters[-1, 0]:.3f}, a2 {other.parameters[-1, 1]:.3f}")

a1, a2 = trace.parameters[:, 0], np.maximum(trace.parameters[:, 1], 1e-9)
w, w_std = np.sqrt(a2), trace.parameters_std[:, 1] / (2 * np.sqrt(a2))
fig, (top, bottom) = plt.subplots(2, 1, figsize=(8, 5), layout="constrained")
top.plot(time[:60], y[:60], "o-", ms=3, lw=0.6, color="0.4")
top.set(title="The first sixty samples, at whatever instants", xlabel="s")
part = slice(30, None)
bottom.fill_between(time[part], (w - 2 * w_std)[part], (w + 2 * w_std)[part], alpha=0.25, lw=0)
bottom.plot(time[part], w[part])
bottom.axhline(1.0, color="k", ls="--", lw=1)
bottom.set(xlabel="s", ylabel="rad/s", ylim=(0.98, 1.02), title="Natural frequency; the truth is 1")
