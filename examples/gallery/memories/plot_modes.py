"""
Several speeds at once: MultipleModel, IMM, AutoMemory
======================================================

A parameter rests, then walks, then rests. **The answer**: a bank of filters, each of another speed; the likely ones
are heard. **How sure**: bars wide while it walks, narrow while it rests. **Others**: one speed for all times is wrong
twice.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, T = np.random.default_rng(11), 3000
steps = np.where((np.arange(T) > 1000) & (np.arange(T) < 2000), 0.03, 0.0) * rng.standard_normal(T)
theta = 1 + np.cumsum(steps)
phi = rng.standard_normal((T, 1))
y = phi[:, 0] * theta + 0.3 * rng.standard_normal(T)
memories = {
    "MultipleModel": dw.memory.MultipleModel(),
    "IMM": dw.memory.IMM(),
    "AutoMemory": dw.AutoMemory(),
    "RandomWalk, one speed": dw.RandomWalk(0.01),
}
fig, (top, bottom) = plt.subplots(2, 1, figsize=(8, 5.5), sharex=True, layout="constrained")
for name, memory in memories.items():
    trace = dw.Regression(1, memory=memory).scan(y, phi)
    top.plot(trace.parameters[:, 0], lw=1, label=name)
    bottom.semilogy(trace.parameters_std[:, 0], lw=1)
    parts = [np.sqrt(np.mean((trace.parameters[part, 0] - theta[part]) ** 2)) for part in np.split(np.arange(T), 3)]
    print(f"{name:24s} error at rest {parts[0]:.3f}, walking {parts[1]:.3f}, at rest {parts[2]:.3f}")
top.plot(theta, "k--", lw=1)
top.set(ylabel="parameter", title="It rests, walks, and rests", ylim=(theta.min() - 0.5, theta.max() + 0.5))
top.legend(fontsize=8, ncols=2)
bottom.set(ylabel="its standard error", xlabel="sample", ylim=(3e-3, 1))
