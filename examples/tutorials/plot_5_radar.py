"""
5. A radar
==========

Plots of a rotating radar: every four seconds, a range and a bearing of whoever was seen. Where is everybody, how
fast, who turns, and where will they be in a minute? Nothing is tuned; scans are missed, plots are wild, and two paths
cross.

**You will use** `dw.track`, which is ``driftwise track FILE`` on the command line.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

# %%
# The plots
# ---------
#
# Three aircraft that say who they are. Errors are 60 m along the beam and 1.5 mrad across it, so they grow with the
# range; one scan in ten is missed.

rng, period, scans = np.random.default_rng(3), 4.0, 200
t = period * np.arange(scans)
turning = np.cumsum(np.where((t > 200) & (t < 380), np.radians(1.2), 0.0) * period)
paths = {
    "4B1801": np.stack([-40e3 + 200 * t, 15e3 + 20 * t], axis=1),
    "3C65AB": np.stack([30e3 - 170 * t, 35e3 - 60 * t], axis=1),
    "406A3F": np.cumsum(np.stack([150 * np.sin(turning), 150 * np.cos(turning)], axis=1) * period, axis=0)
    - [10e3, 60e3],
}
columns = {name: [] for name in ("time", "east", "north", "icao24")}
for address, path in paths.items():
    reach = np.linalg.norm(path, axis=1)
    bearing = np.arctan2(path[:, 0], path[:, 1]) + 1.5e-3 * rng.standard_normal(scans)
    reach = reach + 60.0 * rng.standard_normal(scans)
    seen = rng.random(scans) > 0.1
    columns["time"] += (t + rng.uniform(0, 0.5))[seen].tolist()
    columns["east"] += (reach * np.sin(bearing))[seen].tolist()
    columns["north"] += (reach * np.cos(bearing))[seen].tolist()
    columns["icao24"] += [address] * int(seen.sum())
order = np.argsort(columns["time"])
plots = {name: np.asarray(values)[order] for name, values in columns.items()}
plots["east"][100] += 5000.0  # a reflection
print(len(plots["time"]), "plots")

# %%
# The tracks
# ----------
#
# A file would do as well: ``driftwise track radar.csv --report tracks.html``.

tracks = dw.track(plots, origin=(47.46, 8.55))  # where the radar stands: latitude, longitude
for track in tracks:
    print(track)
for event in tracks.events:
    if event.kind in ("outlier", "split", "confirmed"):
        print(f"{event.time:6.1f} s  {event.words}")

fig, (left, right) = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained")
left.plot(plots["east"] / 1e3, plots["north"] / 1e3, ".", ms=2, color="0.7")
for track in tracks:
    east, north = track.trace.position.T / 1e3
    left.plot(east, north, lw=1.2, label=track.key)
left.set(xlabel="East, km", ylabel="North, km", aspect="equal", title="Plots and tracks")
left.legend(fontsize=8)
for track in tracks:
    trace = track.trace
    right.fill_between(trace.time, trace.speed - 2 * trace.speed_sd, trace.speed + 2 * trace.speed_sd, alpha=0.2, lw=0)
    right.plot(trace.time, trace.speed, label=track.key)
right.set(xlabel="s", ylabel="m/s", ylim=(100, 260), title="Speeds, two deviations")

# %%
# Who turns?
# ----------
#
# The turn rate with its deviation: one aircraft turned at 1.2 degrees a second between 200 and 380 s.

fig, ax = plt.subplots(figsize=(8, 3.5))
for track in tracks:
    trace = track.trace
    ax.plot(trace.time, np.degrees(trace.turn_rate), label=track.key)
ax.axvspan(200, 380, color="0.92", zorder=0)
ax.set(xlabel="s", ylabel="degrees/s", ylim=(-1, 2.5), title="Turn rates; one was told to turn in the grey part")
ax.legend()

# %%
# In a minute
# -----------

for track in tracks:
    place, covariance = track.predict(float(t[-1]) + 60.0)
    (east, north), (wide, high) = place / 1e3, 2 * np.sqrt(np.diag(covariance)) / 1e3
    print(f"{track.key}: {east:.1f} ± {wide:.1f} km East, {north:.1f} ± {high:.1f} km North")

# %%
# Files for others
# ----------------

out = Path(tempfile.mkdtemp())
tracks.write(out, ("csv", "geojson", "kml"))
print(sorted(path.name for path in out.iterdir()))

# %%
# **Where to go from here**: the rules (:doc:`/tracker`), what can be read (:doc:`/plots`), ASTERIX (:doc:`/asterix`),
# clutter and many targets (:doc:`/stonesoup`).
