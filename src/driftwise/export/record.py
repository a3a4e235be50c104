"""A record to try an export with, and what the estimator itself says of it, bit by bit."""

from __future__ import annotations

import numpy as np

from ..engine import compile

SAMPLES = 100  # of the test that goes with an export


def record(est, state, samples: int = SAMPLES, seed: int = 1) -> np.ndarray:
    """Return samples (T, p + k) in units of the estimator, and instants after those of a state where it goes by them.

    A plant of second order whose gain doubles half-way; every eleventh output is missing, some inputs are, one sample
    in fifty is wild.
    """
    rng = np.random.default_rng(seed)
    k, p = est.model.inputs, est.outputs or 1
    y, u = np.zeros((samples, p)), rng.standard_normal((samples, k))
    e = 0.1 * rng.standard_normal((samples, p))
    for t in range(samples):
        gain = 1.0 if 2 * t < samples else 2.0
        drive = gain * u[t - 1].sum() if t and k else 0.0 if k else 5 * e[t].sum()
        y[t] = 1.2 * y[t - 1] - 0.5 * y[t - 2] + drive * (1 + np.arange(p)) + e[t] if t > 1 else e[t]
    y[25::50] += 20.0
    y[10::11] = np.nan
    u[17::23, :1] = np.nan
    y_scale, u_scale = (est.options.get(name, 1.0) for name in ("y_scale", "u_scale"))
    y, u = y * np.broadcast_to(y_scale, p), u * (u_scale if k else 1.0)
    begun = float(state["time"]) if est.takes_instants else 0.0
    stamps = [begun + est.dt * (np.arange(samples) + 1.0)] if est.takes_instants else []
    return np.column_stack([y, u, *stamps])


def answers(est, state, keep: str, samples) -> np.ndarray:
    """Return what every update leaves to be asked, (T, columns): the same loop uncompiled, the same bits."""
    p, rows = est.outputs or 1, est._rows(state)
    ys, us = np.ascontiguousarray(samples[None, :, :p]), np.ascontiguousarray(samples[None, :, p:])
    outs = np.zeros((1, len(samples), est.table_width(keep)))
    drive = compile.plain_driver(*map(type, est.policies))
    with np.errstate(all="ignore"):
        drive(rows, ys, us, outs, est.spec, est.scratch())
    return outs[0]


def words(numbers, is_single: bool) -> list[int]:
    """Return the bits of numbers as integers; every NaN is one."""
    numbers = np.asarray(numbers, np.float32 if is_single else np.float64)
    return np.where(np.isnan(numbers), numbers.dtype.type(np.nan), numbers).view(f"u{numbers.itemsize}").tolist()
