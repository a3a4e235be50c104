"""
3. A physical model: a battery cell
===================================

You know how the thing works, and want *its* numbers: the resistances and the capacity of a cell, while it is used,
with error bars, and a word when one of them jumps. This walk writes the plant as formulas, checks what the data can
tell, follows a cell that ages, and asks what another current would have told.

**You will use** `dw.GreyBox`, `dw.AutoMemory`.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

# %%
# The plant, in formulas
# ----------------------
#
# A rest voltage, a resistance R0, and a pair R1, C1 in series. ``dv1`` is the derivative by time, in seconds. Units
# are for people; ``start`` says roughly how large a parameter is, within a factor of five.

CELL = """
[states]
v1 = {unit = "V", std = 0.01}
rest = {unit = "V", start = 3.7, std = 0.5, walk = 1e-5}

[inputs]
i = {unit = "A"}

[outputs]
v = {unit = "V", noise = 1e-3}

[parameters]
R0 = {unit = "Ohm", start = 0.01}
R1 = {unit = "Ohm", start = 0.02}
C1 = {unit = "F", start = 1000}

[formulas]
dv1 = "(i - v1 / R1) / C1"
drest = "0"
v = "rest + R0 * i + v1"
"""

# %%
# The data
# --------
#
# Twenty minutes of a drive cycle. At 700 s a weld loosens: R0 rises by a third. (Simulated from the same formulas, so
# that the answer can be checked.)

rng, T, fault = np.random.default_rng(1), 1200, 700
current = np.repeat(rng.choice([-8.0, -3.0, 0.0, 4.0, 10.0], T // 8), 8)
est = dw.GreyBox(CELL, memory=dw.AutoMemory())
truth = {"R0": 0.020, "R1": 0.015, "C1": 2500.0}
healthy, faulty = (est.simulate(current, {**truth, "R0": R0}, seed=1) for R0 in (0.020, 0.0265))
voltage = np.where(np.arange(T)[:, None] < fault, healthy.reshape(T, -1), faulty.reshape(T, -1)).ravel()

# %%
# The answer
# ----------

trace = est.scan(voltage, current)
print(trace.summary().words)
for jump in trace.jumps():
    print(jump.sample, jump.text)

fig, axes = plt.subplots(4, 1, figsize=(8, 8), sharex=True, layout="constrained")
axes[0].plot(voltage, lw=0.7, color="0.4")
axes[0].set(ylabel="V", title="Voltage, and what is inside")
for ax, name in zip(axes[1:], truth):
    low, high = trace.interval(name)
    ax.fill_between(np.arange(T), low, high, alpha=0.3, lw=0)
    ax.plot(trace.parameters[:, trace.names.index(name)], lw=1)
    value = np.where(np.arange(T) < fault, truth[name], 0.0265 if name == "R0" else truth[name])
    ax.plot(value, "k--", lw=1)
    ax.set(ylabel=name, ylim=(0.8 * value.min(), 1.2 * value.max()))
axes[-1].set(xlabel="s")

# %%
# Nothing is shown at first: the first samples are kept, and fitted at once, because from a prior a factor of five
# wide such a filter goes astray as often as not. Then it follows, sample by sample.
#
# What the record cannot tell
# ---------------------------
#
# The same cell, at rest but for a trickle: three numbers are asked of a record that speaks of one.

trickle = est.scan(est.simulate(0.02 * np.sign(current), truth, seed=2), 0.02 * np.sign(current))
print(trickle.summary().words)
for note in est.notes_of(trickle.state):
    print(note)

# %%
# What others would give
# ----------------------
#
# A difference equation finds the same numbers by a detour: b0 = R0 of an output error model. It needs to know nothing
# of the cell, and tells R0 by itself; R1 and C1 follow by algebra.

rest = np.mean(voltage[current == 0])
oe = dw.OE(2, 1, 0, offset=True).scaled_to(voltage[:fault] - rest, current[:fault])
found = oe.scan(voltage[:fault] - rest, current[:fault])
print({name: f"{value:.4g}" for name, value in zip(found.names, found.parameters[-1])})

# %%
# **Where to go from here**: what happens at a sample (:doc:`/grey-box`), plants that come along (:doc:`/plants`), a
# known plant and an unknown push (:doc:`/algebraic`).
