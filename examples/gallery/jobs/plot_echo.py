"""
Adaptive echo cancellation
==========================

A loudspeaker is heard by the microphone through a room; a door opens at 2 s. **The answer**: the room's response, and
what is left when it is taken away. **How sure**: the residual echo, in decibels. **Others**: padasip's NLMS is the
same recursion, and takes some fifty times as long; recursive least squares converges sooner and costs more.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import lfilter

import driftwise as dw

rng, rate, taps = np.random.default_rng(0), 4000, 48
far = lfilter([1.0], [1.0, -0.7], rng.standard_normal(4 * rate))  # coloured, as speech is
rooms = rng.standard_normal((2, taps)) * np.exp(-np.arange(taps) / 8)
half = 2 * rate
echo = np.r_[lfilter(rooms[0], 1, far)[:half], lfilter(rooms[1], 1, far)[half:]]
microphone = echo + 0.01 * rng.standard_normal(len(far))

fig, ax = plt.subplots(figsize=(8, 4))
for name, est in {
    "NLMS": dw.ARX(0, taps, 0, method="nlms", step=0.5, at_rest=True),
    "RLS, window of 400": dw.ARX(0, taps, 0, memory=dw.ExponentialForgetting(1 - 1 / 400), at_rest=True),
}.items():
    left = est.scan(microphone, far).innovation
    db = 10 * np.log10(np.convolve(left**2, np.ones(200) / 200, "same") / np.mean(echo**2))
    ax.plot(np.arange(len(far)) / rate, db, lw=1, label=name)
    print(f"{name}: {np.median(db[rate:half]):.0f} dB left before the door, {np.median(db[-rate:]):.0f} dB at the end")
ax.set(xlabel="s", ylabel="residual echo, dB", title="A door opens at 2 s")
ax.legend()
