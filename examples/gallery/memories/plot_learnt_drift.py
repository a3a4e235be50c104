"""
How fast does it drift? Seven ways to learn it
==============================================

Two coefficients walk at a speed that nobody knows. **The answer**: the error of each memory beside that of the Kalman
filter which knows the speed (1 is as good as can be). **How sure**: twenty records each. **Others**: the best fixed
forgetting factor, chosen with the truth in sight, stands beside them.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

memories = {
    "LikelihoodDrift": dw.memory.LikelihoodDrift(),
    "AutoMemory": dw.AutoMemory(),
    "VariationalBayes": dw.memory.VariationalBayes(),
    "MultipleModel": dw.memory.MultipleModel(),
    "IMM": dw.memory.IMM(),
    "FuzzyDrift": dw.memory.FuzzyDrift(),
    "CovarianceMatching": dw.memory.CovarianceMatching(),
    "AuxiliaryFilter": dw.memory.AuxiliaryFilter(),
    "AutocovarianceLS": dw.memory.AutocovarianceLS(),
    "best ExponentialForgetting": None,
}


def error(memory, y, phi, theta):
    """Return the RMS error of both coefficients, from sample 200 on."""
    trace = dw.Regression(2, memory=memory).scan(y, phi)
    return np.sqrt(np.mean((trace.parameters - theta)[200:] ** 2))


ratios = {name: [] for name in memories}
for seed in range(20):
    rng = np.random.default_rng(seed)
    theta = np.cumsum(0.01 * rng.standard_normal((1500, 2)), axis=0)
    phi = rng.standard_normal((1500, 2))
    y = np.sum(phi * theta, axis=1) + 0.2 * rng.standard_normal(1500)
    known = error(dw.memory.Drift(nvr=0.01**2 / 0.2**2), y, phi, theta)
    for name, memory in memories.items():
        tried = [memory] if memory else [dw.ExponentialForgetting(lam) for lam in (0.9, 0.95, 0.98, 0.99)]
        ratios[name].append(min(error(each, y, phi, theta) for each in tried) / known)

order = sorted(ratios, key=lambda name: np.median(ratios[name]))
fig, ax = plt.subplots(figsize=(8, 4.2), layout="constrained")
ax.boxplot([ratios[name] for name in order], orientation="horizontal", tick_labels=order, widths=0.6)
ax.axvline(1, color="k", ls="--", lw=1)
ax.invert_yaxis()
ax.set(xlabel="error over that of the filter that knows the speed", title="Twenty records of a walk of unknown speed")
for name in order:
    print(f"{name:28s} {np.median(ratios[name]):.2f}")
