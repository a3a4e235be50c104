"""
6. Live, from a bus
===================

A pump station publishes; you want to know at once when a pump is not what it was. This walk runs the service on a
stream, breaks a pump, sees the alarm, and looks into what was kept. Here the bus is a pipe, so that the tutorial runs
anywhere; with a broker one line changes.

**You will use** ``driftwise live``.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

folder = Path(tempfile.mkdtemp())

# %%
# What is sent
# ------------
#
# A message for each sample: whose it is, when, and what was measured. Three pumps; pump 2 loses a third of its gain
# at minute 700.

rng, minutes = np.random.default_rng(5), 1200
gain = np.full((minutes, 3), 0.5)
gain[700:, 1] *= 0.67
speed = rng.choice([-1.0, 1.0], (minutes, 3))
flow = np.zeros((minutes, 3))
for t in range(1, minutes):
    flow[t] = 0.7 * flow[t - 1] + gain[t] * speed[t - 1] + 0.05 * rng.standard_normal(3)
messages = [
    {"key": f"pump {k + 1}", "time": 1_700_000_000 + 60 * t, "flow": round(flow[t, k], 3), "speed": speed[t, k]}
    for t in range(minutes)
    for k in range(3)
]
print(json.dumps(messages[0]))

# %%
# What will happen
# ----------------
#
# A configuration says what comes in, what runs and what goes out. With a broker the source would be ``kind = "mqtt"``
# with ``url = "mqtt://host"`` and ``topics = ["plant/+/flow"]``; here it is standard input.

(folder / "live.toml").write_text(
    f"""
[model]
model = "arx:1,1"
memory = "auto"
output = "flow"
inputs = ["speed"]
dt = 60.0

[[source]]
kind = "stdin"

[store]
path = "{folder / "store"}"

[web]
enabled = false

[[out]]
kind = "log"
"""
)


def driftwise(*words, given=""):
    """Run a command as in a shell; return what it printed."""
    command = [sys.executable, "-m", "driftwise", *map(str, words)]
    done = subprocess.run(command, input=given, capture_output=True, text=True, check=True)
    return done.stdout + done.stderr


print(driftwise("live", folder / "live.toml", "--check"))

# %%
# The stream
# ----------
#
# The service runs until the pipe is closed. Every event is a line; it may also be a signed webhook, a message on the
# bus, a metric.

stream = "".join(json.dumps(message) + "\n" for message in messages)
print(driftwise("live", folder / "live.toml", given=stream))

# %%
# What was kept
# -------------
#
# States and events are in the store (and, day by day, history as Parquet). Killed at any moment, the service goes on
# from there, to the same numbers bit for bit.

print(driftwise("live", "status", folder / "live.toml"))

# %%
# The same, afterwards
# --------------------
#
# The estimator of the service, on the record of pump 2: the alarm, and the gain that it saw fall.

est = dw.ARX(1, 1, offset=True, memory=dw.AutoMemory(), dt=60.0).scaled_to(flow[:, 1], speed[:, 1])
trace = est.scan(flow[:, 1], speed[:, 1])
for jump in trace.jumps():
    print(jump.sample, jump.text)
b, std = trace.parameters[:, 1], trace.parameters_std[:, 1]
fig, ax = plt.subplots(figsize=(8, 4))
ax.fill_between(np.arange(minutes), b - 2 * std, b + 2 * std, alpha=0.25, lw=0)
ax.plot(b, label="gain of pump 2, two bars")
ax.plot(gain[:, 1], "k--", lw=1, label="truth")
for jump in trace.jumps():
    ax.axvline(jump.sample, color="C3", lw=1)
ax.set(xlabel="minute", ylim=(0.2, 0.7), title="Pump 2 loses a third of its gain at minute 700")
ax.legend()

# %%
# **Where to go from here**: sources and outputs (:doc:`/live`), the page and what programs read from it
# (:doc:`/live-page`), the same estimator in a controller (:doc:`/export`).
