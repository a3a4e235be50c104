"""
Poles of an observer, chosen: AdaptiveObserver
==============================================

White noise on the sensor, and a family of observers between ARX (poles at zero) and the plant's own poles. **The
answer**: the nearer the observer's poles are to the plant's, the smaller the bias. **How sure**: bars of each.
**Others**: `dw.OE` needs no choice; this one is linear, starts from nothing and cannot fail to converge.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

y, u = dw.simulate([-0.8], [1.0], samples=4000, noise_std=0.7, noise="output", seed=3)
poles = np.array([0.0, 0.2, 0.4, 0.6, 0.7, 0.75, 0.8])
found = []
for pole in poles:
    trace = dw.estimators.AdaptiveObserver(1, pole, inputs=1).scan(y, u)
    found.append((-trace.parameters[-1, 0], trace.parameters_std[-1, 0]))
value, std = np.array(found).T
fig, ax = plt.subplots(figsize=(8, 3.8))
ax.errorbar(poles, value, 2 * std, fmt="o-", capsize=3)
ax.axhline(0.8, color="k", ls="--", lw=1)
ax.set(
    xlabel="pole of the observer", ylabel="pole found", title="The plant's pole is 0.8; noise is on the sensor alone"
)
oe = dw.OE(1, 1).scan(y, u)
print(
    f"observer at .8: {value[-1]:.3f} ± {std[-1]:.3f}; OE: {-oe.parameters[-1, 1]:.3f} ± {oe.parameters_std[-1, 1]:.3f}"
)
