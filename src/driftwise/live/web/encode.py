"""What the network is told of a board: JSON without NaN, short rows for the stream."""

from __future__ import annotations

import json
from collections.abc import Iterable
from math import isfinite
from typing import Any

from driftwise.live.board import EventView, ParameterRow, Row, SeriesView

COLUMNS = ("key", "name", "unit", "count", "time", "output", "prediction", "low", "high", "nis", "status", "score")
LAST = (*COLUMNS, "acknowledged", "event")  # of a row of the stream


def dumps(value: Any) -> bytes:
    """Return compact JSON in UTF-8; a NaN that is still in it is an error of ours."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode("utf-8", "replace")


def finite(value: float | None) -> float | None:
    """Return a number that JSON knows, else None."""
    return value if value is not None and isfinite(value) else None


def event(seen: EventView) -> dict[str, Any]:
    return {
        "number": seen.number,
        "key": seen.key,
        "time": finite(seen.time),
        "kind": seen.kind,
        "sentence": seen.sentence,
        "odds": finite(seen.odds),
        "acknowledged": seen.acknowledged,
    }


def row(view: SeriesView) -> list[Any]:
    """Return a series as the list of all series has it, in the order of `LAST`."""
    low, high = view.band or (None, None)
    numbers = (view.time, view.output, view.prediction, low, high, view.nis)
    last = None if view.last_event is None else event(view.last_event)
    told = [view.key, view.name, view.unit, view.count, *map(finite, numbers), view.status, finite(view.score) or 0.0]
    return [*told, view.acknowledged, last]


def short(view: SeriesView) -> dict[str, Any]:
    return dict(zip(LAST, row(view)))


def full(view: SeriesView, events: Iterable[EventView] = ()) -> dict[str, Any]:
    """Return everything that is known of one series."""
    parameters = [{"name": p.name, "value": finite(p.value), "std": finite(p.std)} for p in view.parameters]
    return short(view) | {
        "model": view.model,
        "parameters": parameters,
        "ahead": [[finite(number) for number in step] for step in view.ahead],
        "sparkline": [finite(value) for value in view.sparkline],
        "events": [event(seen) for seen in events],
    }


def past(rows: list[ParameterRow], points: int) -> dict[str, Any]:
    """Return instants, at most ``points`` and evenly many, and of each parameter values and deviations there."""
    times = sorted({r.time for r in rows})
    times = [times[i * len(times) // points] for i in range(points - 1)] + times[-1:] if len(times) > points else times
    at = {time: i for i, time in enumerate(times)}
    told: dict[str, dict[str, Any]] = {}
    for r in rows:
        one = told.setdefault(r.name, {"name": r.name, "value": [None] * len(times), "std": [None] * len(times)})
        if r.time in at:
            one["value"][at[r.time]], one["std"][at[r.time]] = finite(r.value), finite(r.std)
    return {"time": times, "parameters": list(told.values())}


def history(rows: list[Row], points: int) -> dict[str, list[Any]]:
    """Return columns of a history, at most `points` rows: of each stretch those of its extremes, nothing averaged."""
    kept = rows if len(rows) <= points else _extremes(rows, points)
    told: dict[str, list[Any]] = {
        name: [finite(getattr(r, name)) for r in kept] for name in ("time", "output", "prediction", "std")
    }
    return told | {"status": [int(r.status) for r in kept]}


def _extremes(rows: list[Row], points: int) -> list[Row]:
    """Return the lowest and the highest row of each of ``points / 2`` stretches, in order."""
    bins, kept = max(points // 2, 1), []
    for k in range(bins):
        part = rows[k * len(rows) // bins : (k + 1) * len(rows) // bins]
        known = [r for r in part if isfinite(r.output)] or part
        ends = {id(r): r for r in (min(known, key=_output), max(known, key=_output))}
        kept += sorted(ends.values(), key=lambda r: r.time)
    return kept


def _output(r: Row) -> float:
    return r.output
