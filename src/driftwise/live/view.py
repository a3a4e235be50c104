"""`LiveBoard`: the `Board` of a running service, read from its core."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..engine.errors import InputError
from ..fleet.intake import SETTLED
from ..models.quantities import NORMAL_95
from .board import EventView, ParameterRow, ParameterView, Receipt, Row, Sample, SeriesView
from .core import Core
from .decode import Chunk
from .inbox import ServiceInbox
from .series import Series
from .sources.base import Parcel

AHEAD = 20  # outputs that are forecast


class LiveBoard:
    """What a running service shows, and what it may be asked."""

    def __init__(self, core: Core, inbox: ServiceInbox):
        self.core, self.inbox = core, inbox
        self.store_trouble = ""
        self._news = asyncio.Event()

    # --- series --------------------------------------------------------------------------------------------

    def series(self) -> list[SeriesView]:
        return [self._view(series) for series in self.core.series.values()]

    def view(self, key: str) -> SeriesView:
        series = self.core.find(key)
        return self._view(series, **self._learnt(series))

    def _view(self, series: Series, **more: Any) -> SeriesView:
        nis, config = self._nis(series), series.config
        return SeriesView(
            key=series.key, name=config.name or series.key, unit=config.unit, model=self._model(series),
            status=self._status(series), nis=nis, sparkline=self.core.picture.line(series.slot),
            score=self.core.picture.score(series.slot, nis), **self.core.picture.seen(series.slot), **more,
        )  # fmt: skip

    def _row(self, series: Series) -> int | None:
        """Return the row of a series in its fleet, None before its first sample went there."""
        is_there = series.group is not None and series.code < len(self.core.roster.groups[series.group].fleet)
        return series.code if is_there else None

    def _nis(self, series: Series) -> float | None:
        row = self._row(series)
        if row is None or series.group is None:
            return None
        tally = self.core.roster.groups[series.group].tally
        if row >= len(tally) or not tally["scored"][row]:
            return None
        return float(tally["z2"][row] / tally["scored"][row])

    def _model(self, series: Series) -> str:
        if series.group is None:
            return f"identifying: {len(series.samples)} of {series.config.identify} samples"
        again = f"; choosing again: {len(series.samples)} of {series.config.identify} samples"
        return self.core.roster.model(series) + (again if series.number in self.core.choosing.series else "")

    def _status(self, series: Series) -> str:
        if series.group is None:
            return "identifying"
        row, rows = self._row(series), self.core.roster.groups[series.group]
        if row is None or rows.intake.columns["stage"][row] != SETTLED or not rows.tally["scored"][row]:
            return "warming up"
        if self.core.picture.columns["is_lost"][series.slot]:
            return "lost"
        watch = rows.watch
        if row < len(watch) and watch["is_stuck"][row]:
            return "stuck"
        runs = rows.events.table[row]
        for word, run, least in rows.events.runs(runs):
            if run >= least:
                return word.lower()
        return "well"

    def _learnt(self, series: Series) -> dict[str, Any]:
        """Return parameters and forecasts."""
        row = self._row(series)
        if row is None or series.group is None:
            return {}
        rows = self.core.roster.groups[series.group]
        if rows.intake.columns["stage"][row] != SETTLED:
            return {}
        est, state = rows.fleet.estimator_of(series.key), rows.fleet.state(series.key)
        theta, P = est.parameters_of(state)
        std = np.sqrt(np.diag(np.atleast_2d(P)).clip(0))
        found: dict[str, Any] = {
            "parameters": tuple(ParameterView(*one) for one in zip(est.names, theta.tolist(), std.tolist()))
        }
        held = np.array(series.held)
        if len(held) == len(series.config.inputs) and np.isfinite(held).all():  # inputs stay as they are
            u = np.tile(held - rows.intake.levels[1][row], (AHEAD, 1)) if len(held) else None
            mean, sd = est.predict(state, u, AHEAD)
            mean = mean + rows.intake.levels[0][row, 0]
            ahead = np.column_stack([mean, mean - NORMAL_95 * sd, mean + NORMAL_95 * sd])
            if np.isfinite(ahead).all():
                found["ahead"] = tuple((mean, low, high) for mean, low, high in ahead.tolist())
        return found

    def history(self, key: str, start: float | None = None, end: float | None = None) -> list[Row]:
        rows = self.core.history.read(self.core.series[key].number, key, start, end).tolist()
        return [Row(t, y, ahead, std, int(status)) for t, y, ahead, std, status in rows]

    def parameters(self, key: str, start: float | None = None, end: float | None = None) -> list[ParameterRow]:
        groups = [rows.drift.parameters for rows in self.core.roster.groups]
        rows = self.core.past.read(self.core.series[key].number, key, start, end).tolist()
        return [ParameterRow(t, groups[int(group)][int(i)], value, std) for t, group, i, value, std in rows]

    # --- events --------------------------------------------------------------------------------------------

    def events(
        self, since: int = 0, key: str | None = None, most: int | None = None, latest: bool = False
    ) -> list[EventView]:
        return self.core.store.events(since, key, most, latest)

    def acknowledge(self, number: int) -> EventView:
        event = self.core.store.acknowledge(number)
        if event.key in self.core.series:
            self.core.picture.happened(self.core.series[event.key].slot, event)
        self.stir()
        return event

    def changes(self, after: int) -> tuple[int, list[str]]:
        picture = self.core.picture
        which = np.flatnonzero(picture.columns["revision"] > after)
        return picture.revision, [series.key for series in map(self.core.roster.by_slot.__getitem__, which) if series]

    async def changed(self, after: int) -> int:
        while self.core.picture.revision <= after:
            await self._news.wait()
        return self.core.picture.revision

    def stir(self) -> None:
        """Wake those who wait for a change."""
        self._news.set()
        self._news = asyncio.Event()

    # --- the service ---------------------------------------------------------------------------------------

    def health(self) -> dict[str, Any]:
        notes = [f"{name}: {words}" for name, words in self.inbox.notes.items() if words]
        store = {"commits": self.core.commits, "trouble": self.store_trouble}
        notes += [f"store: {self.store_trouble}"] if self.store_trouble else []
        notes += ["samples come faster than they are taken"] if self.inbox.is_full else []
        sources = {name: words or "well" for name, words in self.inbox.notes.items()}
        return {"ready": True, "healthy": not notes, "sources": sources, "store": store, "notes": notes,
                "reasons": dict(self.core.reasons)}  # fmt: skip

    def counters(self) -> dict[str, float]:
        found = {name: float(value) for name, value in self.core.counters.items()}
        for name in ("late", "duplicate", "timeless", "early", "jumped"):
            found[name] = float(sum(rows.tally[name].sum() for rows in self.core.roster.groups))
        return found | {"commits": float(self.core.commits), "resting": float(self.core.resting)}

    async def put(self, samples: Sequence[Sample]) -> Receipt:
        done, told = asyncio.get_running_loop().create_future(), list[str]()

        def committed() -> None:
            if not done.done():
                done.set_result(None)

        await self.inbox.put(Parcel(gathered(samples), committed, told=told))
        await done
        refused = min(len(told), len(samples))
        return Receipt(len(samples) - refused, refused, told[0] if told else "")


def gathered(samples: Sequence[Sample]) -> list[Chunk]:
    """Return samples as chunks: those of a series with the same fields together."""
    found: dict[tuple, Chunk] = {}
    for key, values, time in samples:
        names = (key, *values)
        chunk = found.get(names)
        if chunk is None:
            chunk = found[names] = Chunk(key, [], {name: [] for name in values})
        chunk.time.append(math.nan if time is None else time)
        for name, value in values.items():
            if math.isinf(value):
                raise InputError(f"{name} of {key} is infinite")
            chunk.fields[name].append(value)
    return list(found.values())
