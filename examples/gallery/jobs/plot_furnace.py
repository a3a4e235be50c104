"""
A furnace of two zones: several outputs, several inputs
=======================================================

Two burners, two thermocouples; each zone warms the other, and a tenth of the readings is missing. **The answer**: the
matrix of gains, which a decoupling controller needs. **How sure**: bars of each. **Others**: a step test for each
burner takes hours and disturbs the furnace.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, T = np.random.default_rng(9), 3000
u = np.repeat(rng.uniform(-1, 1, (T // 20, 2)), 20, axis=0)
F = np.array([[0.90, 0.04], [0.03, 0.93]])
G = np.array([[0.8, 0.0], [0.0, 0.6]])
y = np.zeros((T, 2))
for t in range(1, T):
    y[t] = F @ y[t - 1] + G @ u[t - 1] + 0.1 * rng.standard_normal(2)
truth = np.linalg.solve(np.eye(2) - F, G)
y[rng.random(y.shape) < 0.1] = np.nan

trace = dw.ARXMIMO(2, 2, na=1, nb=1).scaled_to(y, u).scan(y, u)
print(dict(zip(trace.names, trace.parameters[-1].round(3).tolist())))
mean = dict(zip(trace.names, trace.parameters[-1]))
std = dict(zip(trace.names, trace.parameters_std[-1]))


def gains(p):
    """Return the matrix of steady gains, K for each unit of a burner."""
    A = np.array([[p[f"a1.{i}{j}"] for j in (1, 2)] for i in (1, 2)])
    B = np.array([[p[f"b1.{i}{j}"] for j in (1, 2)] for i in (1, 2)])
    return np.linalg.solve(np.eye(2) + A, B)


draws = [gains({n: mean[n] + std[n] * rng.standard_normal() for n in mean}) for _ in range(500)]
bars = np.std(draws, axis=0)
fig, ax = plt.subplots(figsize=(8, 4))
labels = [f"burner {j + 1} on zone {i + 1}" for i in range(2) for j in range(2)]
ax.bar(range(4), gains(mean).ravel(), yerr=2 * bars.ravel(), capsize=5, alpha=0.7)
ax.plot(range(4), truth.ravel(), "k_", ms=40, mew=2, label="truth")
ax.set_xticks(range(4), labels, fontsize=8)
ax.set(ylabel="K for each unit of a burner", title="Which burner warms what, from everyday operation")
ax.legend()
for name, value, bar, true in zip(labels, gains(mean).ravel(), bars.ravel(), truth.ravel()):
    print(f"{name}: {value:.1f} ± {bar:.1f}, truth {true:.1f}")
