"""
Smoothing a GPS track
=====================

A walker's logger, a fix every five seconds, with gaps under trees and jumps between houses. **The answer**: the way,
and how long it was. **How sure**: bands. **Others**: the sum of the distances between fixes makes every walk longer
than it was.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, dt, T = np.random.default_rng(4), 5.0, 360
course = np.cumsum(np.where(rng.random(T) < 0.04, rng.uniform(-1.5, 1.5, T), 0.02 * rng.standard_normal(T)))
way = np.cumsum(1.4 * dt * np.stack([np.sin(course), np.cos(course)], axis=1), axis=0)
fixes = way + 4.0 * rng.standard_normal((T, 2))
fixes[rng.random(T) < 0.02] += 60.0 * rng.standard_normal(2)
fixes[150:165] = np.nan
time = dt * np.arange(T)

trace = dw.TrackEstimator("uav").scan(time, fixes)


def length(points):
    """Return the length of a way in m."""
    return np.nansum(np.linalg.norm(np.diff(points, axis=0), axis=1))


measured = fixes[np.isfinite(fixes[:, 0])]
for name, points in {"truth": way, "fixes": measured, "track": trace.position}.items():
    print(f"{name}: {length(points):.0f} m")
error = np.linalg.norm(trace.position - way, axis=1)
raw = np.linalg.norm(fixes - way, axis=1)
print(f"median error {np.nanmedian(error[10:]):.1f} m, of the fixes {np.nanmedian(raw):.1f} m")
fig, ax = plt.subplots(figsize=(7, 5))
ax.plot(*fixes.T, ".", color="0.6", ms=4, label="fixes")
ax.plot(*trace.position.T, lw=1.3, label="track")
ax.plot(*way.T, "k--", lw=0.8, label="truth")
ax.set(xlabel="East, m", ylabel="North, m", aspect="equal", title="Half an hour on foot")
ax.legend()
