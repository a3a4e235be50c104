"""`Choosing`: series whose model is to be chosen, or chosen again because it does not predict as it says."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .fit import CLIP
from .models import Models
from .roster import Roster
from .rows import Rows
from .series import Series, arrays


class Choice(NamedTuple):
    """A model that samples chose, and the log density it gave the later half of them (see `Fit`)."""

    words: str
    make: Callable[[], Any]
    score: float


class Choosing:
    """Series whose samples are collected, until a model is chosen by them.

    A series without a model gets the one that is chosen, and all samples so far are its first. One that has a model
    keeps it unless another was chosen that gave the later half of the collected samples a higher log density, though it
    began with the first of them; then it goes on with that one, with those collected as its first samples.
    """

    def __init__(self, roster: Roster, models: Models):
        self.roster, self.models = roster, models
        self.series: dict[int, Series] = {}  # by number

    def add(self, series: Series) -> None:
        """Begin to collect."""
        self.series[series.number] = series

    def asking(self) -> Series | None:
        """Return a series that has samples enough, and is not being asked for."""
        found = next((series for series in self.series.values() if series.can_choose), None)
        if found is not None:
            found.is_asked = True
        return found

    @property
    def is_busy(self) -> bool:
        """Whether a model is being chosen, or is about to be."""
        return any(series.is_asked or series.can_choose for series in self.series.values())

    def choose(self, series: Series) -> Choice:
        """Return the model that the samples of a series choose; it takes seconds: use a thread."""
        samples = series.samples[: series.config.identify]
        words, make = self.models.chosen(series.config, *arrays(samples))
        return Choice(words, make, math.nan if series.group is None else _score(make, series, samples))

    def chosen(self, series: Series, choice: Choice) -> str:
        """Go on with one of two models; return in words with which."""
        group, code, number = series.group, series.code, series.config.identify
        assert group is not None
        samples, before, rows = self.taken(series), self.roster.model(series), self.roster.groups[group]
        score = float(rows.fit["score"][code])
        if choice.words == before or not choice.score > score:
            rows.fit.stays(code)
            none = "no other is chosen" if choice.words == before else f"{choice.words}, predicts no better"
            return f"the model stays {before}: {none}"
        patience, count, watch = (
            rows.fit["patience"][code] / 2,
            rows.tally["samples"][code],
            rows.watch.table[code].copy(),
        )
        self.roster.leave([series])
        self.roster.assign(series, choice.words, choice.make)
        self._feed(series, samples[:number])
        rows = self.roster.groups[series.group or 0]
        rows.fit.begin(series.code, patience)
        self._feed(series, samples[number:])
        rows.tally["samples"][series.code], rows.watch.table[series.code] = count, watch
        gain = (choice.score - score) / (number - number // 2)
        return f"{choice.words}, takes the place of {before}: log density {gain:+.3g} a sample"

    def taken(self, series: Series) -> list[tuple[float, ...]]:
        """Stop collecting; return the samples."""
        del self.series[series.number]
        series.is_asked = False
        samples, series.samples, series.kept = series.samples, [], 0
        return samples

    def _feed(self, series: Series, samples: list[tuple[float, ...]]) -> None:
        """Let a series take samples of which everything was told by its former model."""
        table = np.array(samples).reshape(-1, series.width)
        rows = self.roster.groups[series.group or 0]
        deque(rows.take([series.code] * len(table), table[:, 0], table[:, 1], table[:, 2:]), 0)


def _score(make: Callable[[], Any], series: Series, samples: list[tuple[float, ...]]) -> float:
    """Return the log density that a model gives the later half of samples, from which it learns."""
    config, table = series.config, np.array(samples)
    rows = Rows(make(), config.dt, config.first)
    code = rows.add(series.key)
    shown = list(rows.take([code] * len(table), table[:, 0], table[:, 1], table[:, 2:]))
    _, e, variance = np.concatenate([one.outs[:, :3] for one in shown] or [np.zeros((0, 3))])[len(table) // 2 :].T
    is_seen = np.isfinite(e) & (variance > 0)
    e, variance = e[is_seen], variance[is_seen]
    z2 = np.minimum(e * e / variance, CLIP**2)
    return float(-0.5 * np.sum(np.log(variance) + z2)) if len(e) else -math.inf
