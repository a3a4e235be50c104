"""
Outliers: InnovationGate, and a monitor of one signal
=====================================================

One sample in forty is wrong by twenty sigma. **The answer**: the plant all the same, and which samples were wrong.
**How sure**: a gate of five sigma takes one good sample in two million. **Others**: least squares is bent by each; a
median filter takes the plant's own peaks with them.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=1500, noise_std=0.1, seed=6)
wrong = np.random.default_rng(1).random(1500) < 1 / 40
wrong[:60] = False
y = y + 2.0 * wrong
truth = [-1.5, 0.7, 1.0, 0.5]
fig, ax = plt.subplots(figsize=(8, 4))
for row, (name, gate) in enumerate({"with InnovationGate(5)": dw.InnovationGate(5), "without": None}.items()):
    trace = dw.ARX(2, 2, gate=gate).scan(y, u)
    x = np.arange(4) + 0.1 * (2 * row - 1)
    ax.errorbar(x, trace.parameters[-1] - truth, 2 * trace.parameters_std[-1], fmt="o", capsize=3, label=name)
    print(f"{name}: rejected {trace.summary().rejected} of {wrong.sum()} wrong ones")
ax.axhline(0, color="k", ls="--", lw=1)
ax.set_xticks(range(4), trace.names)
ax.set(ylabel="error, two standard errors", title="One sample in forty is wrong by twenty sigma")
ax.legend()

# %%
# A signal that is no estimator's: watched sample by sample.

monitor = dw.detect.Monitor(dw.PageHinkley("1 per 10_000", jump=2.0), mean=20.0, std=0.5)
state = monitor.start()
for t, value in enumerate([20.1, 19.8, 20.2, 21.2, 20.9, 21.3, 21.3, 20.8, 21.1]):
    state, sign = monitor.update(state, value)
    if sign.alarm:
        print(f"sample {t}: {'up' if sign.alarm > 0 else 'down'}, since {sign.since} samples")
