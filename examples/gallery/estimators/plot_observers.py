"""
A plant that you know, and a push that you do not: WindowObserver, AlgebraicObserver
====================================================================================

A cart is pushed by somebody; only its position is measured, with noise. **The answer**: its speed and the push, in
m/s². **How sure**: the deviation is computed before the first sample, from the length of the window alone.
**Others**: differences of the position have a deviation thirty times as large; an observer with poles needs those
chosen.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

t = np.arange(600) * 0.01
push = np.where(t < 3, 1.0, -0.5)
speed = np.cumsum(push) * 0.01
y = np.cumsum(speed) * 0.01 + 0.002 * np.random.default_rng(0).standard_normal(600)

cart = dw.Plant([[0, 1], [0, 0]], states=("position", "speed"))
unknown = dw.models.Polynomial([0, 1], np.inf, name="push")
est = dw.WindowObserver(cart, 0.6, noise_std=0.002, disturbances=unknown, dt=0.01)
trace = est.scan(y)
for name, std in zip(("position", "speed", "push"), est.design.std):
    print(f"{name}: ± {std:.4f}, known beforehand")

# %%
# The theorem of Tian (2009), integrals of y only, never forgets: right until the push changes, and wrong for ever
# after.

algebraic = dw.AlgebraicObserver(cart, into=[0, 1], dt=0.01, noise_std=0.002, tolerance=0.2).scan(y)
q, std = trace.of("push")
fig, ax = plt.subplots(figsize=(8, 3.8))
ax.fill_between(t, q - 2 * std, q + 2 * std, alpha=0.25, lw=0)
ax.plot(t, q, label="window of 0.6 s")
ax.plot(t, algebraic.of("pi")[0], "C1", lw=1, label="all samples (algebraic)")
ax.plot(t, push, "k--", lw=1, label="truth")
ax.set(xlabel="s", ylabel="push, m/s²", ylim=(-1.5, 2), title="Somebody turns round at 3 s")
ax.legend()
