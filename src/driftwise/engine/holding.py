"""What is missing keeps its last value: a line to the next one would know what comes."""

import numpy as np


def held(values, before=np.nan) -> np.ndarray:
    """Return values (T, ..) with the last known one wherever one is missing, ``before`` ahead of the first.

    >>> held(np.array([np.nan, 2.0, np.nan, 3.0]), 1.0).tolist()
    [1.0, 2.0, 2.0, 3.0]
    """
    rows = np.concatenate([np.broadcast_to(before, values.shape[1:])[None], values])
    number = np.arange(len(rows)).reshape(-1, *(1,) * (rows.ndim - 1))
    last = np.maximum.accumulate(np.where(np.isfinite(rows), number, 0), axis=0)
    return np.take_along_axis(rows, last, axis=0)[1:]
