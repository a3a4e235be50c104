"""
Forgetting, five ways, while the input rests
============================================

Exponential, variable, directional forgetting, a gain floor, a window. The gain jumps at 1000; from 1500 on the input
rests. **The answer**: all follow, and differ in what they lose while nothing comes in. **How sure**: their bars,
below. **Others**: plain exponential forgetting winds up in such a rest until it bursts; here it stops at one typical
sample.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, T = np.random.default_rng(2), 2500
gain = np.where(np.arange(T) < 1000, 1.0, 1.6)
u, y = rng.choice([-1.0, 1.0], T), np.zeros(T)
u[1500:] = 0.0
for t in range(1, T):
    y[t] = 0.8 * y[t - 1] + gain[t] * u[t - 1] + 0.1 * rng.standard_normal()

memories = {
    "ExponentialForgetting(.98)": dw.ExponentialForgetting(0.98),
    "VariableForgetting(50)": dw.memory.VariableForgetting(50),
    "DirectionalForgetting(.96)": dw.memory.DirectionalForgetting(0.96),
    "GainFloor(50)": dw.memory.GainFloor(50),
    "Window(50)": dw.memory.Window(50),
}
fig, (top, bottom) = plt.subplots(2, 1, figsize=(8, 5.5), sharex=True, layout="constrained")
for name, memory in memories.items():
    trace = dw.ARX(1, 1, memory=memory).scan(y, u)
    top.plot(trace.parameters[:, 1], lw=1, label=name)
    bottom.semilogy(trace.parameters_std[:, 1], lw=1)
    late = np.flatnonzero(np.abs(trace.parameters[1000:1500, 1] - 1.6) < 0.1)
    print(f"{name:28s} near the new gain after {late[0]} samples; bar at the end {trace.parameters_std[-1, 1]:.3f}")
top.plot(gain, "k--", lw=1)
top.set(ylim=(0.7, 1.9), ylabel="gain b1", title="A jump at 1000, and a rest from 1500 on")
top.legend(fontsize=8, ncols=2)
bottom.set(ylabel="its standard error", xlabel="sample", ylim=(3e-3, 1))
for ax in (top, bottom):
    ax.axvspan(1500, T, color="0.93", zorder=0)
