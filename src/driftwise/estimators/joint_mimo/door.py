"""The door for several outputs: y (T, p) instead of (T,)."""

from __future__ import annotations

import math

import numpy as np

from ...engine.errors import InputError
from ...engine.validation import numbers, one, simultaneous


def record(y, u, outputs: int, inputs: int):
    """Return y (T, p) and u (T, k), contiguous float64, of a record."""
    y = numbers("y", y)
    if y.ndim == 1 and outputs == 1:
        y = y[:, None]
    if y.ndim != 2 or y.shape[1] != outputs:
        raise InputError(
            f"y must have shape (T, {outputs}), one column per output, got {y.shape}; time comes first. "
            "Is it transposed, or are these other outputs?"
        )
    return np.ascontiguousarray(y), simultaneous(u, len(y), inputs)


def sample(y, u, outputs: int, inputs: int):
    """Return y (1, 1, p) and u (1, 1, k) of one sample."""
    try:
        ys, us = one(y, outputs), one(() if u is None else u, inputs)
    except (TypeError, ValueError):
        raise InputError(
            f"one sample is {outputs} output(s) y and {inputs} input(s), got y = {y!r}, u = {u!r}; for records use scan"
        ) from None
    if any(map(math.isinf, ys.ravel().tolist() + us.ravel().tolist())):
        raise InputError(f"y and u must be finite, or NaN where missing; got y = {y!r}, u = {u!r}")
    return ys, us


def fleet(y, u, series: int, outputs: int, inputs: int):
    """Return y (S, T, p), u (S, T, k) and the shape of y, for S series."""
    y = numbers("y", y)
    if y.ndim not in (2, 3) or len(y) != series or y.shape[-1] != outputs:
        raise InputError(
            f"y must be ({series}, {outputs}) or ({series}, T, {outputs}), one row per state, got shape {y.shape}"
        )
    if (u is None) != (inputs == 0):
        raise InputError(f"the model has {inputs} input(s); u was {'not ' if u is None else ''}given")
    lead = y.shape[:-1]
    us = numbers("u", np.zeros((*lead, 0)) if u is None else u)
    if us.shape not in ((*lead, inputs), lead if inputs == 1 else None):
        raise InputError(f"u must be {(*lead, inputs)}, like y with the inputs last, got shape {us.shape}")
    length = 1 if y.ndim == 2 else y.shape[1]
    return y.reshape(series, length, outputs), us.reshape(series, length, inputs), y.shape
