"""
The thermal resistance and capacity of a building
=================================================

Room temperature, heating power and weather, two samples an hour, with gaps. **The answer**: the heat loss in W/K, the
capacity in kWh/K, the time constant. **How sure**: bars through the nonlinear formula, by the delta method.
**Others**: a degree-day regression gives the loss after a season, and no capacity at all.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, dt, T = np.random.default_rng(3), 1800.0, 48 * 20
R, C = 1 / 180.0, 2.0e7  # K/W, J/K
k = np.arange(T)
outside = 3 + 5 * np.sin(2 * np.pi * k / 48) + np.cumsum(0.15 * rng.standard_normal(T))
heating = 4000.0 * (rng.standard_normal(T // 4 + 1) > 0).repeat(4)[:T]  # W, on or off for two hours
inside, T0 = np.zeros(T), 19.0
decay = np.exp(-dt / (R * C))
inside[0] = T0
for t in range(1, T):
    goal = outside[t - 1] + R * heating[t - 1]
    inside[t] = goal + (inside[t - 1] - goal) * decay
measured = inside + 0.05 * rng.standard_normal(T)
measured[rng.random(T) < 0.1] = np.nan

# %%
# x+ = a x + (1 - a) (outside + R heating): one pole, two gains; the noise is on the sensor.

u = np.stack([outside, heating / 1e3], axis=1)
est = dw.Joint(1, inputs=2, noise=dw.models.OutputError(), offset=True).scaled_to(measured, u)
trace = est.scan(measured, u, keep="covariance")


def resistance(p):
    """Return K/kW: the gain of the heating."""
    return p["b1.2"] / (1 + p["a1"]) if p["a1"] > -1 else np.nan


def seconds(p):
    """Return the time constant; NaN where there is none."""
    return -dt / np.log(-p["a1"]) if 0 < -p["a1"] < 1 else np.nan


physical = {
    "heat loss, W/K": lambda p: 1e3 / resistance(p),
    "capacity, kWh/K": lambda p: seconds(p) / resistance(p) / 3600.0,
    "time constant, h": lambda p: seconds(p) / 3600.0,
}
truth = [1 / R, C / 3.6e6, R * C / 3600]
for (name, found), value in zip(est.derived(trace.state, physical).items(), truth):
    low, high = found.interval
    print(f"{name}: {low:.4g} to {high:.4g}, truth {value:.4g}")

# %%
# How the answer comes: the loss along the record.

along = trace.derived({"loss": physical["heat loss, W/K"]}, every=12)
days = np.arange(len(along["loss"])) * 12 * dt / 86400
fig, ax = plt.subplots(figsize=(8, 4))
ax.fill_between(days, along["loss_low"], along["loss_high"], alpha=0.25, lw=0, label="95 %")
ax.plot(days, along["loss"], label="heat loss")
ax.axhline(1 / R, color="k", ls="--", lw=1, label="truth")
ax.set(xlabel="days", ylabel="W/K", ylim=(150, 210), title="After a few days the building is known")
ax.legend()
