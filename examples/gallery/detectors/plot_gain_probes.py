"""
Is the gain of a filter still right? GainProbes and PullTest
============================================================

A Kalman filter whose process noise grows by nine at 1500. **The answer**: an alarm when another gain would predict
better. **How sure**: false alarms per thousand samples, printed. **Others**: the innovations of a wrong gain are
coloured, but hardly larger; a test of their size is slow.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, T = np.random.default_rng(4), 3000
q = np.where(np.arange(T) < 1500, 0.1, 0.9)
y = np.cumsum(q * rng.standard_normal(T)) + rng.standard_normal(T)
fig, ax = plt.subplots(figsize=(8, 4))
watched = {
    "GainProbes": dw.AdaptiveGain(1.0, detector=dw.detect.GainProbes()),
    "PullTest": dw.AdaptiveGain(1.0, memory=dw.Constant(), method="plr", detector=dw.detect.PullTest(), restart=26.5),
    "no detector": dw.AdaptiveGain(1.0),
}
for name, est in watched.items():
    trace = est.scan(y)
    alarms = np.flatnonzero(trace.status & dw.Status.JUMP)
    after = alarms[alarms >= 1500]
    print(
        f"{name}: first alarm {after[0] - 1500 if len(after) else 'never'} samples after; {sum(alarms < 1500)} before"
    )
    ax.plot(trace.parameters[:, 0], lw=1, label=name)
known = np.where(q < 0.5, *[(-v + np.sqrt(v * v + 4 * v)) / 2 for v in (0.01, 0.81)])
ax.plot(known, "k--", lw=1, label="of the filter that knows")
ax.set(xlabel="sample", ylabel="gain", ylim=(0, 0.9), title="The plant becomes restless at 1500")
ax.legend()
