"""
The mass of a vehicle, and the grade of its road
================================================

Force at the wheels and acceleration, ten samples a second; the road changes its grade now and then. **The answer**:
the mass, and the grade at every moment. **How sure**: bars of both; while the vehicle cruises, nothing is learnt of
its mass, and the run says so. **Others**: force regressed on acceleration, the other way round, is biased by the
noise of the accelerometer.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

G, rng, T = 9.81, np.random.default_rng(2), 4000
mass = 1640.0
grade = np.repeat(rng.uniform(-0.05, 0.05, 8), T // 8)
drive = np.repeat(rng.uniform(-3000.0, 3500.0, T // 40), 40) + 200.0 * rng.standard_normal(T)
a = drive / mass - G * (0.012 + grade) + 0.15 * rng.standard_normal(T)

# %%
# a = F (1/m) - g (rolling + grade): 1/m rests, the other moves. `AutoMemory` finds that out.

X = np.stack([drive, np.full(T, -G)], axis=1)
trace = dw.Regression(["1/m", "slope"], memory=dw.AutoMemory()).scaled_to(a, X).scan(a, X, keep="covariance")
found = trace.estimator.derived(trace.state, {"mass": lambda p: 1 / p["1/m"]})["mass"]
print("mass {:.0f} to {:.0f} kg, truth {:.0f}".format(*found.interval, mass))
steps = [jump.sample for jump in trace.jumps()]
print(f"grade steps told at {steps}; there were steps at {list(range(T // 8, T, T // 8))}")

fig, ax = plt.subplots(figsize=(8, 4))
t, slope, std = np.arange(T) / 10, trace.parameters[:, 1] - 0.012, trace.parameters_std[:, 1]
ax.fill_between(t, 100 * (slope - 2 * std), 100 * (slope + 2 * std), alpha=0.25, lw=0)
ax.plot(t, 100 * slope, lw=1, label="grade, two bars")
ax.plot(t, 100 * grade, "k--", lw=1, label="truth")
ax.set(xlabel="s", ylabel="grade, %", ylim=(-9, 9), title="The road, from what the motor has to do")
ax.legend()
