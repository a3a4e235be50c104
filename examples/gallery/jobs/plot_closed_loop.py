"""
Identification in closed loop
=============================

The plant cannot be opened: a controller is on it. **The answer**: the plant, from data of the loop, because the model
of the noise is right. **How sure**: bars; with and without a dither on the set point. **Others**: the ratio of
spectra, and instruments made of past inputs, give the inverse of the controller.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw


def loop(dither, seed, T=3000):
    """Return output and input of a loop: y = .8 y + u(t-1) + e, e coloured, u = -.5 y + dither."""
    rng = np.random.default_rng(seed)
    v, y, u = 0.3 * rng.standard_normal(T), np.zeros(T), np.zeros(T)
    for t in range(1, T):
        y[t] = 0.8 * y[t - 1] + u[t - 1] + v[t] + 0.6 * v[t - 1]
        u[t] = -0.5 * y[t] + dither * rng.choice([-1.0, 1.0])
    return y, u


fig, ax = plt.subplots(figsize=(8, 4))
ways = {
    "ARMAX": lambda: dw.ARMAX(1, 1, 1),
    "ARX": lambda: dw.ARX(1, 1),
    "instruments": lambda: dw.ARX(1, 1, method="iv", instruments="delayed"),
}
for row, (name, make) in enumerate(ways.items()):
    for shift, dither in ((-0.1, 0.05), (0.1, 0.5)):
        y, u = loop(dither, 1)
        trace = make().scaled_to(y, u).scan(y, u)
        a, std = trace.parameters[-1, 0], trace.parameters_std[-1, 0]
        color = "C0" if dither > 0.1 else "C1"
        ax.errorbar(-a, row + shift, xerr=min(2 * std, 1.0), fmt="o", color=color, capsize=3, label=f"dither {dither}")
        print(f"{name:12s} dither {dither}: pole {-a:.3f} ± {std:.3f}")
ax.axvline(0.8, color="k", ls="--", lw=1)
ax.set_yticks(range(3), list(ways))
ax.set(
    xlim=(0, 1.5),
    xlabel="pole, two bars; the truth is 0.8",
    title="A model with the right colour of noise holds in a loop",
)
handles, labels = ax.get_legend_handles_labels()
ax.legend(handles[:2], labels[:2])
