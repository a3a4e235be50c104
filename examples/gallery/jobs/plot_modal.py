"""
Modes of a structure while it warms up
======================================

One accelerometer on a bridge, moved by traffic. Two modes; the first slows down as the deck gets warm. **The
answer**: frequency and damping against time, as of some twenty seconds ago (a memory is late by its length). **How
sure**: bars at every moment. **Others**: a spectrogram gives the frequency to its bin width, and no damping.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, rate, T = np.random.default_rng(6), 20.0, 12_000
f1 = 2.0 - 0.25 * np.arange(T) / T
y = np.zeros(T)
e = rng.standard_normal(T)
for k in range(4, T):
    a = np.ones(1)
    for f, zeta in ((f1[k], 0.02), (4.6, 0.015)):
        w = 2 * np.pi * f / rate
        r = np.exp(-zeta * w)
        a = np.convolve(a, [1.0, -2 * r * np.cos(w * np.sqrt(1 - zeta**2)), r * r])
    y[k] = -a[1:] @ y[k - 1 : k - 5 : -1] if k > 4 else 0.0
    y[k] += e[k]

# %%
# AR(4), with a memory of a thousand samples; a mode is a pair of roots.

trace = dw.AR(4, memory=dw.ExponentialForgetting(0.999)).scaled_to(y).scan(y, keep="covariance")


def mode(number):
    """Return functions of the parameters: frequency in Hz and damping in per cent of a mode, the slow one first."""

    def root(p):
        s = np.log(np.roots([1.0, *(p[f"a{i}"] for i in range(1, 5))]) + 1e-12j) * rate
        s = s[s.imag > 0]
        return sorted(s, key=abs)[min(number, len(s) - 1)]

    return lambda p: abs(root(p)) / (2 * np.pi), lambda p: -100 * root(p).real / abs(root(p))


(f_low, z_low), (f_high, z_high) = mode(0), mode(1)
quantities = {"f1": f_low, "z1": z_low, "f2": f_high, "z2": z_high}
found = trace.derived(quantities, every=600)
t = np.arange(len(found["f1"])) * 600 / rate / 60
part = slice(3, None)
fig, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for name, color in (("1", "C0"), ("2", "C1")):
    for ax, letter in ((left, "f"), (right, "z")):
        key = letter + name
        ax.fill_between(t[part], found[f"{key}_low"][part], found[f"{key}_high"][part], color=color, alpha=0.25, lw=0)
        ax.plot(t[part], found[key][part], color=color, label=f"mode {name}")
left.plot(np.arange(T) / rate / 60, f1, "k--", lw=1)
left.axhline(4.6, color="k", ls="--", lw=1)
right.axhline(2, color="C0", ls="--", lw=1)
right.axhline(1.5, color="C1", ls="--", lw=1)
left.set(xlabel="minutes", ylabel="Hz", ylim=(1, 5.5), title="Frequencies")
right.set(xlabel="minutes", ylabel="% of critical", ylim=(0, 5), title="Damping")
left.legend()
for key in quantities:
    print(f"{key}: {found[key][-1]:.2f}, {found[f'{key}_low'][-1]:.2f} to {found[f'{key}_high'][-1]:.2f}")
