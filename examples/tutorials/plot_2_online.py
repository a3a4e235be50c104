"""
2. A drifting plant, on-line
============================

A sample arrives, an answer leaves: the loop of a controller or of a data logger. The plant drifts, a valve sticks one
day, the sensor misses samples. This walk builds that loop, checks its promises, saves the state, and goes on after a
restart as if nothing had happened.

**You will use** `dw.ARX`, `dw.AutoMemory`, `update`, `dw.save_state`.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

# %%
# The plant
# ---------
#
# A heat exchanger fouls slowly: its gain falls by a third. At 2600 it is cleaned. One sample in twenty does not arrive.

rng, T = np.random.default_rng(1), 4000
gain = 1.2 - 0.4 * np.minimum(np.arange(T), 2600) / 2600 + 0.4 * (np.arange(T) >= 2600)
u = np.repeat(rng.choice([-1.0, 1.0], T // 5), 5)
y = np.zeros(T)
for t in range(1, T):
    y[t] = 0.85 * y[t - 1] + gain[t] * 0.15 * u[t - 1] + 0.05 * rng.standard_normal()
y[rng.random(T) < 0.05] = np.nan

# %%
# The loop
# --------
#
# An estimator is settings; a state is a row of numbers; ``update`` takes one and the sample, and returns the next one
# and what the sample meant. Nothing else is kept.

est = dw.ARX(1, 1, memory=dw.AutoMemory())
state, b, bar, events = est.start(), [], [], []
for t in range(T):
    state, step = est.update(state, y[t], u[t])
    b.append(state["theta"][1])
    bar.append(np.sqrt(est.sigma2(state) * est.covariance(state)[1, 1]))
    if step.status & dw.Status.JUMP:
        events.append(t)
b, bar = np.array(b), np.array(bar)
print("jumps told at", events)

fig, ax = plt.subplots(figsize=(8, 4))
ax.fill_between(np.arange(T), b - 2 * bar, b + 2 * bar, alpha=0.25, lw=0)
ax.plot(b, label="b1 and two bars")
ax.plot(0.15 * gain, "k--", lw=1, label="truth")
for t in events:
    ax.axvline(t, color="C3", lw=1)
ax.set(xlabel="sample", ylim=(0.05, 0.3), title="The exchanger fouls, and is cleaned at 2600")
ax.legend()
print(f"two bars hold the truth at {100 * np.mean(np.abs(b - 0.15 * gain)[100:] < 2 * bar[100:]):.0f} % of the samples")

# %%
# The same numbers, at once
# -------------------------
#
# A record takes one call; the numbers are those of the loop, bit for bit.

trace = est.scan(y, u)
assert (trace.parameters[-1] == state["theta"][: len(trace.names)]).all()
print(trace.summary().words)

# %%
# After a power failure
# ---------------------
#
# A state is written down, read by another process, and goes on.

path = Path(tempfile.mkdtemp()) / "exchanger.json"
half = est.scan(y[:2000], u[:2000]).state
dw.save_state(est, half, path)
again, resumed = dw.load_state(path)
rest = again.scan(y[2000:], u[2000:], state=resumed)
assert (rest.parameters[-1] == trace.parameters[-1]).all()
print(path.stat().st_size, "bytes; the numbers are the same")

# %%
# What if another memory were better?
# -----------------------------------

scores = dw.compare(
    y,
    u,
    {
        "AutoMemory": est,
        **{f"forgetting {lam}": dw.ARX(1, 1, memory=dw.ExponentialForgetting(lam)) for lam in (0.98, 0.995)},
    },
)
print(scores)

# %%
# **Where to go from here**: which memory (:doc:`/memory`), jumps at a promised rate of false alarms
# (:doc:`/detectors`), the same in a microcontroller (:doc:`/export`).
