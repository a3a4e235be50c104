"""
1. A file and no opinion
========================

You are given a table from a plant and a question: *what drives the temperature, and has anything changed?* Nobody
tells which column is what. This walk goes from the file to an answer with error bars, and ends with a forecast.

**You will use** `dw.identify`, which is `driftwise run FILE` on the command line.
"""

import csv
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

# %%
# The file
# --------
#
# A kiln, one row a minute: a clock, the burner's valve, the draught and the temperature. (It is simulated, so that
# the answer can be checked: from row 1800 on the burner gives a third less heat.)

rng, T = np.random.default_rng(7), 3000
valve = np.repeat(rng.uniform(20, 80, T // 25), 25)
draught = 50 + np.cumsum(rng.standard_normal(T)) * 0.5
gain = np.where(np.arange(T) < 1800, 0.30, 0.20)
temperature = np.zeros(T)
for t in range(2, T):
    heat = gain[t] * (valve[t - 1] - 50) - 0.3 * (draught[t - 1] - 50)
    temperature[t] = 1.2 * temperature[t - 1] - 0.3 * temperature[t - 2] + heat + 0.5 * rng.standard_normal()
temperature += 850
temperature[rng.random(T) < 0.02] = np.nan

folder = Path(tempfile.mkdtemp())
with open(folder / "kiln.csv", "w", newline="") as f:
    rows = csv.writer(f)
    rows.writerow(["time", "valve_percent", "draught_pa", "temperature_degc"])
    for t in range(T):
        value = "" if np.isnan(temperature[t]) else f"{temperature[t]:.2f}"
        rows.writerow([60 * t, f"{valve[t]:.1f}", f"{draught[t]:.2f}", value])
print((folder / "kiln.csv").read_text()[:160])

# %%
# The answer
# ----------
#
# One call. It finds the clock, the output and the inputs, compares models and memories, and says what it is sure of.

found = dw.identify(folder / "kiln.csv")
print(found)

# %%
# Each sentence is a claim with a number behind it; what is not known is said, too. The same in a shell:
#
# .. code-block:: bash
#
#    driftwise run kiln.csv --report page.html
#
# What changed
# ------------
#
# The trace of the model that `identify` chose has the parameters at every sample, with their bars.

trace = found.trace
print(trace.estimator)
fig, (top, bottom) = plt.subplots(2, 1, figsize=(8, 5.5), sharex=True, layout="constrained")
top.plot(temperature, lw=0.5, color="0.4")
top.set(ylabel="°C", title="The kiln: what was measured, and its parameters")
for i, name in enumerate(trace.names):
    if name.startswith("b"):
        b, std = trace.parameters[:, i], trace.parameters_std[:, i]
        bottom.fill_between(np.arange(len(b)), b - 2 * std, b + 2 * std, alpha=0.2, lw=0)
        bottom.plot(b, label=name)
bottom.axvline(1800, color="k", ls="--", lw=1)
bottom.set(xlabel="minute", ylim=(-0.3, 0.6))
bottom.legend(ncols=3)

# %%
# Can it be believed?
# -------------------
#
# Nine questions that an experienced engineer would ask, each with a number and the range in which it is fine.

print(trace.diagnose())

# %%
# What comes next
# ---------------
#
# Twenty minutes ahead, if the valve goes to 70 %; then one more sample arrives, and the answer goes on from there.

to_come = {"valve_percent": np.full(20, 70.0), "draught_pa": np.full(20, draught[-1])}
ahead = np.column_stack([to_come[name] for name in found.table.inputs])
mean, std = found.predict(ahead)
print(f"in 20 minutes: {mean[-1]:.1f} ± {1.96 * std[-1]:.1f} °C")

# %%
# **Where to go from here**: a model that you name (:doc:`/run`), which column is what (:doc:`/columns`), what the
# answer is good and bad at (:doc:`/identify`).
