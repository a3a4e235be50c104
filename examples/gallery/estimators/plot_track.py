"""
An object that moves: TrackEstimator
====================================

The first fifteen minutes of an airliner, its positions as they were received, every second one left out. **The
answer**: where it is, how fast, and how it turns. **How sure**: bands, and where the next plot will be. **Others**: a
fixed constant-velocity filter is either late in turns or restless between them. Nothing is tuned here.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

flight = dw.sample_data("flight")
part = slice(0, 450, 2)
time = flight["time_s"][part]
plots = np.stack([flight["east_m"][part], flight["north_m"][part]], axis=1)
trace = dw.TrackEstimator("aircraft").scan(time, plots)

fig, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
left.plot(plots[:, 0] / 1e3, plots[:, 1] / 1e3, ".", ms=3, color="0.6", label="plots")
left.plot(trace.position[:, 0] / 1e3, trace.position[:, 1] / 1e3, lw=1.2, label="track")
left.set(xlabel="East, km", ylabel="North, km", aspect="equal")
left.legend()
heard = np.interp(time, flight["time_s"], flight["ground_speed_mps"])
right.fill_between(time, trace.speed - 2 * trace.speed_sd, trace.speed + 2 * trace.speed_sd, alpha=0.25, lw=0)
right.plot(time, trace.speed, label="speed from plots")
right.plot(time, heard, "k--", lw=1, label="speed that it sent")
right.set(xlabel="s", ylabel="m/s", ylim=(60, 260), title="Its own speed was not used")
right.legend()
error = (trace.speed - heard)[20:]
print(f"median error of the speed {np.nanmedian(np.abs(error)):.1f} m/s")
