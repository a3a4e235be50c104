"""
Alarms that can be lived with
=============================

A motor's current follows its load; a bearing begins to wear, and one day the belt slips. **The answer**: two alarms
that name what changed. **How sure**: one false alarm in ten thousand samples was allowed; a year without faults is
counted. **Others**: a limit on the current itself alarms at every heavy load, or never.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw


def record(seed, faults):
    """Return current and load of six thousand minutes, with or without the faults."""
    rng, T = np.random.default_rng(seed), 6000
    load = np.repeat(rng.uniform(0.2, 1.0, T // 30), 30) + 0.05 * rng.standard_normal(T)
    friction = 2.0 + faults * 0.4 * (np.arange(T) >= 2500)
    gain = 8.0 - faults * 1.5 * (np.arange(T) >= 4500)
    current = np.zeros(T)
    for t in range(1, T):
        current[t] = 0.6 * current[t - 1] + 0.4 * (friction[t] + gain[t] * load[t - 1]) + 0.15 * rng.standard_normal()
    return current, load


watch = dw.RestartOnChange(dw.detect.ScoreCUSUM("1 per 10_000"))
est = dw.ARX(1, 1, offset=True, memory=watch)
current, load = record(1, True)
trace = est.scaled_to(current, load).scan(current, load)
for jump in trace.jumps():
    print(jump.sample, jump.text)

quiet = [record(seed, False) for seed in range(20)]
false = sum(len(est.scaled_to(y, u).scan(y, u).jumps()) for y, u in quiet)
print(f"without faults: {false} alarms in {20 * 6000} samples ({20 * 6000 // 10_000} promised)")

fig, (top, bottom) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
top.plot(current, lw=0.4, color="0.4")
top.set(ylabel="current, A", title="Nothing to be seen by eye: friction at 2500, the belt at 4500")
for i in (1, 2):
    bottom.plot(trace.parameters[:, i], label=trace.names[i])
for jump in trace.jumps():
    for ax in (top, bottom):
        ax.axvline(jump.sample, color="C3", lw=1)
bottom.set(xlabel="minute", ylim=(0, 5))
bottom.legend()
