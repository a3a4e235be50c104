"""Instants of samples: finite seconds that increase, checked."""

from __future__ import annotations

import numpy as np

from ...engine.errors import InputError


def instants(time, shape, state=None, repeats: bool = False) -> np.ndarray:
    """Return increasing finite instants of the given shape, later than those a state has seen.

    With ``repeats`` an instant may come again: another measurement of the same state.
    """
    if np.asarray(time).dtype.kind in "mM":  # their numbers are of any unit: no seconds
        raise InputError(
            "time must hold seconds as numbers, got dates: take (t - t0) / np.timedelta64(1, 's'), with one t0 for all"
        )
    try:
        time = np.ascontiguousarray(time, float)
    except (TypeError, ValueError):
        raise InputError(f"time must hold seconds as numbers, got {time!r}; turn dates into seconds first") from None
    if time.shape != shape:
        raise InputError(f"time must have shape {shape}, one instant per sample, got {time.shape}")
    if not np.isfinite(time).all():
        where = int(np.flatnonzero(~np.isfinite(time))[0])
        raise InputError(f"time[{where}] is {time[where]}: every sample needs its instant, also where y is missing")
    bad = np.flatnonzero(np.diff(time) < 0 if repeats else np.diff(time) <= 0)
    if len(bad):
        k = int(bad[0]) + 1
        is_again = time[k] == time[k - 1]
        cause = (
            "Are two sensors in one column, or is the clock too coarse for the samples?"
            if is_again
            else "Is the file unsorted, are two files joined, or was the clock set back?"
        )
        raise InputError(
            f"time must increase, but time[{k}] = {time[k]:.17g} {'repeats' if is_again else 'comes after'} "
            f"time[{k - 1}] = {time[k - 1]:.17g} ({len(bad)} such). {cause}"
        )
    if state is not None and len(time) and float(np.asarray(state)["samples"]) > 0:
        before = float(np.asarray(state)["time"])
        if time[0] < before or (time[0] == before and not repeats):
            raise InputError(
                f"time[0] = {time[0]:.17g} is not after the state's last sample at {before:.17g} s. Was this sample "
                "fed twice, or is the state from another record?"
            )
    return time
