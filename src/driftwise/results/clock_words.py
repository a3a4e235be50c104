"""Instants and spans of time as one writes them."""

from __future__ import annotations

import numpy as np

SECONDS, SAMPLES = "s", "samples"  # what time is counted in: the latter where there is no clock


def lasting(seconds: float, unit: str = SECONDS) -> str:
    """Return a time span in the unit one would use; of a span in another unit than seconds, that one.

    >>> lasting(1.7994), lasting(86400), lasting(0.002), lasting(86400, SAMPLES)
    ('1.8 s', '1 d', '0.002 s', '8.64e+04 samples')
    """
    if unit != SECONDS:
        return f"{seconds:.3g} {unit}"
    for unit, size, least in (("a", 365.25 * 86400, 2), ("d", 86400, 1), ("h", 3600, 2), ("min", 60, 5)):
        if seconds >= least * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


def instant(seconds: float, origin: str | None, unit: str = SECONDS) -> str:
    """Return a time as it is written: seconds, or a date where the time stamp of second 0 is known, or a sample.

    >>> instant(86400 * 30.5, "2011-11-26"), instant(2.5, None)
    ('2011-12-26 12:00:00', '2.5 s')
    """
    if origin is None:
        return f"{seconds:.6g} s" if unit == SECONDS else f"sample {seconds:.0f}"
    stamp = np.datetime64(origin, "ms") + np.timedelta64(round(1000 * seconds), "ms")
    return str(stamp).replace("T", " ").removesuffix(".000").removesuffix(" 00:00:00")
