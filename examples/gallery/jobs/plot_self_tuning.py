"""
A controller that tunes itself
==============================

A loop that must hold its set point while the plant's gain jumps sixfold. **The answer**: a controller that designs
itself anew from what is known at each moment. **How sure**: it is cautious where the model is not known. **Others**:
a controller designed for the plant before swings between its limits.

It needs python-control: ``pip install '.[control]'``.
"""

import control
import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw
from driftwise.adapters.control import create_adaptive_controller


def step(t, x, u, params):
    """Return the next state: two poles, and a gain that jumps."""
    gain = 1.0 if t < 250 else 6.0
    return [1.6 * x[0] - 0.63 * x[1] + gain * (0.1 * u[0] + 0.08 * x[2]) + u[1], x[0], u[0]]


def loop(memory):
    """Return set point, output, input and estimate of the closed loop."""
    plant = control.nlsys(
        step, lambda t, x, u, params: x[0], inputs=["u", "e"], outputs=["y"], states=3, dt=1, name="plant"
    )
    tuner = create_adaptive_controller(dw.ARX(2, 2, memory=memory), limits=(-10, 10), name="tuner")
    whole = control.interconnect([plant, tuner], inputs=["r", "v", "e"], outputs=["y", "u", "b1"], check_unused=False)
    rng, t = np.random.default_rng(0), np.arange(500)
    r = np.where(t // 50 % 2, 1.0, -1.0)
    dither, noise = rng.choice([-0.1, 0.1], 500), 0.05 * rng.standard_normal(500)
    return r, *control.input_output_response(whole, t, [r, dither, noise]).outputs


fig, (top, bottom) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
for name, memory in {"AutoMemory": dw.AutoMemory(), "no forgetting": dw.Constant()}.items():
    r, y, u, b1 = loop(memory)
    top.plot(y, lw=1, label=name)
    bottom.plot(b1, lw=1)
    print(f"{name}: RMS of r - y {np.sqrt(np.mean((r - y)[255:320] ** 2)):.2f} after the jump")
top.plot(r, "k--", lw=0.8)
top.set(ylabel="output", ylim=(-4, 4), title="The gain of the plant jumps sixfold at 250")
top.legend(ncols=2)
bottom.set(xlabel="sample", ylabel="estimate of b1")
