"""
4. Ten thousand pumps
=====================

One long table, a row for each sample and pump. Which of ten thousand pumps needs a look, why, and since when? This
walk runs the fleet, checks the answer against faults that are known, and goes on the next day.

**You will use** ``driftwise fleet run``, and `dw.Fleet` where the samples come to your own program.
"""

import csv
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from pyarrow import parquet

import driftwise as dw


def driftwise(*words):
    """Run a command as in a shell, and print what it says."""
    done = subprocess.run(
        [sys.executable, "-m", "driftwise", *map(str, words)], capture_output=True, text=True, check=True
    )
    print(done.stdout)


folder = Path(tempfile.mkdtemp())

# %%
# The table
# ---------
#
# Simulated, so that the truth is known: some six pumps in a hundred have a fault. (Two thousand of them here, so that
# this page is soon built; ``--series 10000`` takes five times as long and the same memory.)

driftwise("fleet", "simulate", folder / "pumps", "--series", 2000, "--samples", 200)

# %%
# The answer
# ----------
#
# One command. Each series gets an estimator of its own, in its own units; nothing is tuned; memory does not grow with
# the table.

begun = time.perf_counter()
order = [
    "--by",
    "asset",
    "--output",
    "flow",
    "--input",
    "speed",
    "--time",
    "time",
    "--dt",
    60,
    "--out",
    folder / "results",
]
driftwise("fleet", "run", folder / "pumps", *order)
print(f"{time.perf_counter() - begun:.0f} s")

# %%
# Was it right?
# -------------

with open(folder / "pumps" / "_faults.csv") as f:
    faulty = {row["asset"]: row["fault"] for row in csv.DictReader(f) if row["fault"]}
with open(folder / "results" / "outliers.csv") as f:
    named = {row["key"]: row["kind"] for row in csv.DictReader(f)}
print(
    f"{len(faulty.keys() & named.keys())} of {len(faulty)} faulty pumps named, {len(named.keys() - faulty.keys())} more"
)

# %%
# A picture: the gains of all pumps, as the table of results has them.

final = parquet.read_table(folder / "results" / "final.parquet").to_pydict()
gain = np.array(final["b1"], float)
at = {key: place for place, key in enumerate(final["key"])}
fig, ax = plt.subplots(figsize=(8, 4))
ax.plot(gain, ".", ms=2, color="0.7", label="pumps")
worn = [at[key] for key in named if key in at]
ax.plot(worn, gain[worn], "x", color="C3", ms=5, label="need a look")
ax.set(
    xlabel="pump",
    ylabel="gain b1",
    ylim=np.nanquantile(gain, (0.001, 0.999)),
    title="Two thousand pumps; those that need a look are few",
)
ax.legend()

# %%
# In your own program
# -------------------
#
# The same estimators, a sample of each pump at a time: rows of a table of numbers, found by key.

fleet = dw.Fleet(dw.ARX(1, 1), [f"pump {k}" for k in range(1000)])
rng = np.random.default_rng(0)
for _ in range(100):
    step = fleet.update_batch(None, rng.standard_normal(1000), rng.standard_normal(1000))
print(fleet.mean("pump 7").round(2), step.innovation.shape)

# %%
# **Where to go from here**: what is promised (:doc:`/fleet`), going on after a kill (:doc:`/fleet-checkpoints`), a
# cluster (:doc:`/spark`), a GPU (:doc:`/gpu`).
