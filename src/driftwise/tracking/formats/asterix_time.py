"""When ASTERIX reports were made: days, midnights, category 1's short times, turns of the antenna."""

from __future__ import annotations

import datetime
from bisect import bisect_right
from collections import deque

import numpy as np

from ...engine.errors import InputError

DAY, NAN = 86400.0, float("nan")


def midnight_of(day) -> float | None:
    """Return Unix time of the midnight before a day, None where there is none."""
    if day is None:
        return None
    try:
        day = datetime.date.fromisoformat(day) if isinstance(day, str) else day
        return float((datetime.date(day.year, day.month, day.day) - datetime.date(1970, 1, 1)).days) * DAY
    except (ValueError, AttributeError, TypeError):
        raise InputError(f'day must be a date or "YYYY-MM-DD", got {day!r}') from None


def times(rows, midnight):
    """Return s of each row: times of day completed, and midnights told apart."""
    reference: dict[str, list] = {}  # category 2: sensor -> (row number, time of day, when captured)
    for k, row in enumerate(rows):
        if row.category == 2 and row.body.time == row.body.time:
            reference.setdefault(row.sensor, []).append((k, row.body.time, row.captured))
    out, recent = np.full(len(rows), np.nan), deque[float](maxlen=9)
    for k, row in enumerate(rows):
        time = row.body.time
        if row.category == 1 and time == time:
            time = _completed(time, reference.get(row.sensor), k, row.captured)
        if time != time:
            continue
        if midnight is None and row.captured == row.captured:
            out[k] = time + DAY * round((row.captured - time) / DAY)
            continue
        around = sorted(recent)[len(recent) // 2] if recent else time  # one wild time does not move the day
        time += DAY * round((around - time) / DAY)
        recent.append(time)
        out[k] = time + (midnight or 0.0)
    return out


def _completed(time, reference, k, captured):
    """Return the time of day of one modulo 512 s: near the radar's last message, its next, or the packet's."""
    if reference:
        _, near, then = reference[max(bisect_right(reference, k, key=lambda one: one[0]) - 1, 0)]
        if captured == captured and then == then:
            near += captured - then
    elif captured == captured:
        near = captured % DAY
    else:
        return NAN
    return (near + (time - near + 256) % 512 - 256) % DAY


def periods(messages) -> dict[str, float]:
    """Return s of a turn of the antenna of each radar: as it tells, else between north crossings."""
    reported: dict[str, list] = {}
    north: dict[str, list] = {}
    for row, time in messages:
        if row.body.period == row.body.period and row.body.period > 0:
            reported.setdefault(row.sensor, []).append(row.body.period)
        if row.body.type == 1 and time == time:
            north.setdefault(row.sensor, []).append(time)
    turns = {s: np.diff(np.unique(t)) for s, t in north.items()}
    return {s: float(np.median(d)) for s, d in turns.items() if len(d)} | {
        s: float(np.median(p)) for s, p in reported.items()
    }
