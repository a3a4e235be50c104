"""`Board`: what a page, an API or a scraper may know of a running service, and the two things it may ask of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

SPARKLINE = 120  # outputs of a series that a picture of it shows


class ParameterView(NamedTuple):
    """A parameter as it is now; ``std`` is its standard deviation."""

    name: str
    value: float
    std: float


@dataclass(frozen=True)
class EventView:
    """What happened to a series: one of the kinds jump, drift, noise, stuck, lost, outliers, silent, back,
    model.

    number : counts up over the life of the store, without holes
    time : seconds since 1970 of the sample that told it
    odds : the detector's statistic over its threshold, None where no detector spoke
    """

    number: int
    key: str
    time: float
    kind: str
    sentence: str
    odds: float | None = None
    acknowledged: bool = False


@dataclass(frozen=True)
class SeriesView:
    """A series as it is now. Numbers are in the unit of the data; None where there is none yet.

    count : samples taken
    time : seconds since 1970 of the last one
    prediction, band : of the last output, before it came: the forecast and the bounds of 95 %
    ahead : forecasts of the next outputs, nearest first, with inputs as they are: (prediction, low, high) each
    model : in words, "arx:2,2 with auto memory"; "identifying: 120 of 500 samples" while it is not chosen
    status : "identifying", "warming up", "well", or the kind of trouble
    nis : mean of e^2 / variance, 1 where error bars are true
    sparkline : the last outputs, oldest first, NaN where missing
    score : who needs a look: the larger, the sooner; 0 needs none
    acknowledged : whether all its events were seen by somebody
    """

    key: str
    name: str
    unit: str = ""
    count: int = 0
    time: float | None = None
    output: float | None = None
    prediction: float | None = None
    band: tuple[float, float] | None = None
    ahead: tuple[tuple[float, float, float], ...] = ()
    parameters: tuple[ParameterView, ...] = ()
    model: str = ""
    status: str = "warming up"
    last_event: EventView | None = None
    nis: float | None = None
    sparkline: tuple[float, ...] = ()
    score: float = 0.0
    acknowledged: bool = True


class Row(NamedTuple):
    """A sample of the history of a series; NaN where there was none."""

    time: float
    output: float
    prediction: float
    std: float
    status: int


class ParameterRow(NamedTuple):
    """A parameter of a series as it was; ``std`` is its standard deviation."""

    time: float
    name: str
    value: float
    std: float


class Sample(NamedTuple):
    """One message about a series: ``values`` by field; a plain number is the field "value".

    time : seconds since 1970, None where the message has none and the moment of receipt is its own
    """

    key: str
    values: dict[str, float]
    time: float | None = None


class Receipt(NamedTuple):
    """What became of samples that were put: told after they are on disk."""

    taken: int
    refused: int
    reason: str = ""  # of the first that was refused


class Board(Protocol):
    """The picture of a running service. All calls are quick; those that wait are coroutines.

    Keys that are not there raise `KeyError`.
    """

    def series(self) -> list[SeriesView]:
        """Return every series, in the order they first came; parameters and forecasts are left to `view`."""

    def view(self, key: str) -> SeriesView:
        """Return one series."""

    def history(self, key: str, start: float | None = None, end: float | None = None) -> list[Row]:
        """Return what is kept of a series between two instants, oldest first; it reads files: call it in a thread."""

    def parameters(self, key: str, start: float | None = None, end: float | None = None) -> list[ParameterRow]:
        """Return the same of its parameters: every 100 samples, after jumps, and once a minute."""

    def events(
        self, since: int = 0, key: str | None = None, most: int | None = None, latest: bool = False
    ) -> list[EventView]:
        """Return events whose number is above ``since``, oldest first; at most so many, or the ``latest``."""

    def acknowledge(self, number: int) -> EventView:
        """Note that somebody saw an event; return it as it is now."""

    def changes(self, after: int) -> tuple[int, list[str]]:
        """Return the present revision, and the keys of series that have changed since the revision ``after``."""

    async def changed(self, after: int) -> int:
        """Wait until the revision is above ``after``; return it."""

    def health(self) -> dict[str, Any]:
        """Return how it is: {"ready": bool, "healthy": bool, "sources": {..}, "store": {..}, "notes": [..]}."""

    def counters(self) -> dict[str, float]:
        """Return totals since the start, by name: samples, late, refused, events, commits, bytes_in, .."""

    async def put(self, samples: Sequence[Sample]) -> Receipt:
        """Hand samples to the service; return after they are committed. A full queue makes it wait."""
