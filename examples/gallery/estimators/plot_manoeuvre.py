"""
How long does a manoeuvre last? Manoeuvre
=========================================

One coordinate of a target that weaves. **The answer**: the pole phi of its acceleration, from scan to scan, learnt
with the state. **How sure**: phi has a bar; near one the acceleration lasts, near zero it is anew at every scan.
**Others**: Singer's model needs that time constant from somebody.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, time = np.random.default_rng(1), 4.0 * np.arange(300)
east = 200 * time + 4000 * np.sin(time / 30) + 30 * rng.standard_normal(300)
est = dw.tracking.Manoeuvre(dt=4.0).scaled_to(east)
state, found = est.start(), []
for y in east:
    state, step = est.update(state, y)
    found.append((*est.pole(state), *est.velocity(state)))
phi, phi_std, speed, speed_std = np.array(found).T
fig, (top, bottom) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
top.fill_between(time, phi - 2 * phi_std, phi + 2 * phi_std, alpha=0.25, lw=0)
top.plot(time, phi)
top.set(ylabel="phi", ylim=(-1, 1.6), title="The pole of the manoeuvre: the weaving lasts")
bottom.fill_between(time, speed - 2 * speed_std, speed + 2 * speed_std, alpha=0.25, lw=0)
bottom.plot(time, speed, label="velocity")
bottom.plot(time, 200 + 4000 / 30 * np.cos(time / 30), "k--", lw=1, label="truth")
bottom.set(xlabel="s", ylabel="m/s", ylim=(-50, 450))
bottom.legend()
