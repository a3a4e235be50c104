"""
Several outputs: ARXMIMO and JointMIMO
======================================

Two outputs that act on each other, one input. **The answer**: which acts on which. **How sure**: two standard errors
of each parameter; those that hold zero are links that the record does not show. **Others**: two ARX models, one an
output, leave out the link, and call it noise.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

truth = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.0]
y, u = dw.models.simulate_mimo((2, 1), truth, samples=1500, inputs=1, noise_std=0.3, seed=2)
joint = dw.JointMIMO((2, 1), inputs=1).scaled_to(y, u).scan(y, u)
arx = dw.ARXMIMO(2, 1, na=[[2, 2], [1, 1]], nb=[2, 1]).scaled_to(y, u).scan(y, u)

fig, ax = plt.subplots(figsize=(8, 3.8))
for trace, name, shift in ((joint, "JointMIMO", -0.12), (arx, "ARXMIMO", 0.12)):
    at = [joint.names.index(each) if each in joint.names else None for each in trace.names]
    shown = [(i, place) for i, place in enumerate(at) if place is not None]
    x = np.array([place for _, place in shown]) + shift
    rows = [i for i, _ in shown]
    ax.errorbar(x, trace.parameters[-1, rows], 2 * trace.parameters_std[-1, rows], fmt="o", ms=4, capsize=3, label=name)
ax.plot(np.arange(len(truth)), truth, "k_", ms=18, label="truth")
ax.set_xticks(range(len(joint.names)), joint.names)
ax.axhline(0, color="0.7", lw=0.8)
ax.set(title="a1.12: how output 2 acts on output 1 after one sample", ylabel="parameter, two standard errors")
ax.legend()
for name, value, std in zip(joint.names, joint.parameters[-1], joint.parameters_std[-1]):
    print(f"{name:6s} {value:6.3f} ± {std:.3f}")
