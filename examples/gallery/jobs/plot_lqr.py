"""
From an estimate to an LQR, with the bars propagated
====================================================

A plant is identified, a regulator is designed for it: will the loop be stable on the *true* plant? **The answer**:
gain and closed-loop poles. **How sure**: two hundred plants drawn from the posterior, each with that one gain.
**Others**: a design for the estimate alone says nothing of that.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import solve_discrete_are

import driftwise as dw

y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=150, noise_std=0.5, seed=4)
model = dw.ARX(2, 2).scaled_to(y, u).scan(y, u).model()


def matrices(values):
    """Return A and B of the observer canonical form."""
    a1, a2, b1, b2 = values
    return np.array([[-a1, 1.0], [-a2, 0.0]]), np.array([[b1], [b2]])


A, B = matrices(model.values)
P = solve_discrete_are(A, B, np.diag([1.0, 0.0]), np.eye(1))
K = np.linalg.solve(np.eye(1) + B.T @ P @ B, B.T @ P @ A)
print(f"gain {K.round(3).tolist()}, poles {np.linalg.eigvals(A - B @ K).round(3).tolist()}")

drawn = np.random.default_rng(0).multivariate_normal(model.values, model.covariance, 200)
poles = np.array([np.linalg.eigvals(a - b @ K) for a, b in map(matrices, drawn)])
truth = np.linalg.eigvals(np.subtract(matrices([-1.5, 0.7, 1.0, 0.5])[0], matrices([-1.5, 0.7, 1.0, 0.5])[1] @ K))
unstable = np.mean(np.abs(poles).max(axis=1) >= 1)
print(
    f"largest modulus: median {np.median(np.abs(poles).max(axis=1)):.2f}, unstable {100 * unstable:.1f} % of the plants"
)

fig, ax = plt.subplots(figsize=(5.5, 5.5))
ax.plot(poles.real, poles.imag, ".", color="C0", ms=4, alpha=0.4)
ax.plot(truth.real, truth.imag, "r+", ms=14, mew=2, label="on the true plant")
ax.plot(np.cos(np.linspace(0, 7, 200)), np.sin(np.linspace(0, 7, 200)), "k", lw=0.8)
ax.set(aspect="equal", xlabel="real", ylabel="imaginary", title="Closed-loop poles of 200 likely plants")
ax.legend()
