"""Instants and spans of time as one writes them."""

from __future__ import annotations

import numpy as np


def lasting(seconds: float) -> str:
    """Return a time span in the unit one would use.

    >>> lasting(1.7994), lasting(86400), lasting(0.002)
    ('1.8 s', '1 d', '0.002 s')
    """
    for unit, size, least in (("a", 365.25 * 86400, 2), ("d", 86400, 1), ("h", 3600, 2), ("min", 60, 5)):
        if seconds >= least * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


def instant(seconds: float, origin: str | None) -> str:
    """Return a time as it is written: seconds, or a date where the time stamp of second 0 is known.

    >>> instant(86400 * 30.5, "2011-11-26"), instant(2.5, None)
    ('2011-12-26 12:00:00', '2.5 s')
    """
    if origin is None:
        return f"{seconds:.6g} s"
    stamp = np.datetime64(origin, "ms") + np.timedelta64(round(1000 * seconds), "ms")
    return str(stamp).replace("T", " ").removesuffix(".000").removesuffix(" 00:00:00")
