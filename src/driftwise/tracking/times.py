"""Seconds as dates, where they are Unix time."""

from __future__ import annotations

import numpy as np

DATED = 1e8  # s: times beyond are Unix time (1973); below, seconds of a day or of a recording


def dated(time) -> bool:
    """Say whether times are Unix times."""
    return len(time) > 0 and float(np.min(time)) >= DATED


def stamps(time) -> np.ndarray:
    """Return Unix times as datetime64, rounded to microseconds."""
    return np.round(np.asarray(time) * 1e6).astype("datetime64[us]")


def iso(time) -> list[str]:
    """Return Unix times in ISO 8601, UTC, rounded to milliseconds."""
    rounded = np.round(np.asarray(time) * 1e3).astype("datetime64[ms]")
    return [f"{stamp}Z" for stamp in np.datetime_as_string(rounded)]
