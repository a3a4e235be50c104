"""
A thousand series at once: Fleet
================================

A thousand pumps, a sample of each at a time; in twenty of them the gain falls by a third. **The answer**: which, and
when. **How sure**: a promised rate of false alarms, for the whole fleet. **Others**: a loop over estimators in Python
gives the same numbers, and takes much longer.
"""

import time

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, pumps, T = np.random.default_rng(5), 1000, 600
a, b = rng.uniform(0.6, 0.9, pumps), rng.uniform(0.5, 1.5, pumps)
worn, when = rng.choice(pumps, 20, replace=False), 400
u = rng.choice([-1.0, 1.0], (T, pumps))
y = np.zeros((T, pumps))
for t in range(1, T):
    gain = b.copy()
    if t >= when:
        gain[worn] *= 0.67
    y[t] = a * y[t - 1] + gain * u[t - 1] + 0.1 * rng.standard_normal(pumps)

est = dw.ARX(1, 1, memory=dw.RestartOnChange(dw.detect.ScoreCUSUM("1 per 1_000_000", jump=0.3)))
fleet = dw.Fleet(est, range(pumps))
begun, alarms = time.perf_counter(), {}
for t in range(T):
    step = fleet.update_batch(None, y[t], u[t])
    for key in np.flatnonzero(step.status & dw.Status.JUMP):
        alarms.setdefault(int(key), t)
seconds = time.perf_counter() - begun
print(f"{pumps * T} samples in {seconds:.1f} s; {len(set(alarms) & set(worn.tolist()))} of {len(worn)} found, ")
print(f"{len(set(alarms) - set(worn.tolist()))} false; the latest {max(alarms.values()) - when} samples after the fall")

gains = fleet.states["theta"][:, 1]
fig, ax = plt.subplots(figsize=(8, 4))
sound = np.setdiff1d(np.arange(pumps), worn)
ax.plot(b[sound], gains[sound], ".", ms=3, color="0.6", label="sound")
ax.plot(b[worn], gains[worn], "rx", label="worn")
ax.plot([0.3, 1.6], [0.3, 1.6], "k--", lw=1)
ax.set(
    xlabel="gain when it was new", ylabel="gain now", title="A thousand pumps; those that alarmed are below the line"
)
ax.legend()
