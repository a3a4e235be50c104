"""
A cheap sensor beside a good one that visits now and then
=========================================================

An air quality sensor whose slope and zero drift; the reference comes for two hours in every fifty. **The answer**:
what the reference would show in between. **How sure**: a band, checked against the truth where no reference was.
**Others**: a calibration once for all is wrong after weeks; the last one, carried on, jumps with every visit.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, T = np.random.default_rng(0), 3000
truth = 50 + 10 * np.sin(np.arange(T) / 40) + 3 * np.sin(np.arange(T) / 7) + rng.standard_normal(T)
sensor = (truth * (1 - 8e-5 * np.arange(T)) - 0.01 * np.arange(T)) / 5 + 0.1 * rng.standard_normal(T)
seen = np.arange(T) % 50 < 2
reference = np.where(seen, truth, np.nan)

est = dw.estimators.sensor_calibration(["sensor"]).scaled_to(reference, sensor - sensor[:100].mean())
trace = est.scan(reference, sensor - sensor[:100].mean())
once = np.polyfit(sensor[:100], truth[:100], 1)
error = {"driftwise": trace.prediction - truth, "calibrated once": np.polyval(once, sensor) - truth}
fig, ax = plt.subplots(figsize=(8, 4))
part = slice(2600, 2800)
k, band = np.arange(T)[part], trace.band(0.95)[part]
ax.fill_between(k, trace.prediction[part] - band, trace.prediction[part] + band, alpha=0.25, lw=0, label="95 %")
ax.plot(k, trace.prediction[part], label="driftwise")
ax.plot(k, np.polyval(once, sensor[part]), "C1", lw=1, label="calibrated once")
ax.plot(k, truth[part], "k--", lw=1, label="truth")
ax.plot(k, reference[part], "ro", ms=4, label="reference")
ax.set(xlabel="hour", ylabel="µg/m³", title="Two hours of reference in fifty")
ax.legend(ncols=2, fontsize=8)
for name, each in error.items():
    print(f"{name}: RMS error {np.sqrt(np.mean(each[1500:][~seen[1500:]] ** 2)):.2f} between references")
held = np.abs(error["driftwise"]) < trace.band(0.95)
print(f"{100 * held[500:][~seen[500:]].mean():.0f} % in the 95 % band")
