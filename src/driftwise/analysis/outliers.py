"""What outliers have in common: where an input moves, or the output is far out, the model is wrong, not the sensor."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..engine.status import Status

FEW = 10  # outliers, of which nothing is said
NEAR = 3  # samples before an outlier in which what makes it may have happened
TAIL, MOST = 0.9, 0.5  # the quantile from which a sample is far out, and the share of outliers that come of such


def common_words(trace) -> str:
    """Return where most outliers of a whole run come, in words; nothing where they are few, or anywhere."""
    y, u, at = trace.y, trace.u, np.flatnonzero(trace.status & (Status.OUTLIER | Status.REJECTED))
    if len(at) < FEW:
        return ""
    firsts = at[np.diff(at, prepend=-NEAR) >= NEAR]  # one that follows another may but follow from it
    moves = np.abs(np.diff(u, axis=0, prepend=u[:1])).T
    if any(is_common(recent(x), firsts) for x in moves):
        return "most where an input moves"
    before = np.append(np.nan, y[:-1])
    return "most where the output is far out" if is_common(np.abs(before - np.nanmedian(y)), firsts) else ""


def recent(x) -> np.ndarray:
    """Return the largest of the last `NEAR` values at each sample, (T,); what is not known is none."""
    return sliding_window_view(np.append(np.zeros(NEAR - 1), np.nan_to_num(x)), NEAR).max(axis=1)


def is_common(x, at) -> bool:
    """Say whether most of the samples ``at`` are in the tail of x (T,), where few others are."""
    return bool(len(at) and np.mean(x[at] > np.nanquantile(x, TAIL)) > MOST)
