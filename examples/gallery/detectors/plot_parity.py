"""
A fault of a plant that you know: Parity
========================================

A cart's sensor slips by five millimetres. **The answer**: an alarm, because two windows contradict each other. **How
sure**: one false alarm in a million samples, a bound for any dependence. **Others**: a limit on the innovations sees
the slip for one sample only, and must be low.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

t = np.arange(800) * 0.01
y = 0.2 * np.sin(t) + 0.001 * np.random.default_rng(0).standard_normal(800)
y[500:] += 0.005
cart = dw.Plant([[0, 1], [0, 0]], states=("position", "speed"))
push = dw.models.Polynomial([0, 1], np.inf, name="push")
est = dw.WindowObserver(
    cart, 0.3, noise_std=0.001, disturbances=push, dt=0.01, detector=dw.detect.Parity("1 per 1_000_000")
)
trace = est.scan(y)
alarms = np.flatnonzero(trace.status & dw.Status.JUMP)
print(f"alarms at {[float(t[k]) for k in alarms]}; {trace.events()[-1].text}")
speed, std = trace.of("speed")
fig, ax = plt.subplots(figsize=(8, 4))
ax.fill_between(t, speed - 2 * std, speed + 2 * std, alpha=0.25, lw=0)
ax.plot(t, speed, label="speed")
ax.plot(t, 0.2 * np.cos(t), "k--", lw=1, label="truth")
for k in alarms:
    ax.axvline(t[k], color="C3", lw=1)
ax.set(xlabel="s", ylabel="m/s", ylim=(-0.4, 0.4), title="The sensor slips at 5 s: told, and the window begins anew")
ax.legend()
