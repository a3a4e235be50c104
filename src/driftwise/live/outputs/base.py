"""What an output is told, after it was committed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from ..board import EventView


class Estimate(NamedTuple):
    """The last sample of a series, and what was expected of it, in the unit of the data."""

    key: str
    time: float
    output: float
    prediction: float
    std: float
    status: int


class Output(Protocol):
    """An output. Its fields are its options in the configuration.

    ``events`` and ``estimates`` say whether it wants them. It is given what was committed; what it was given and has
    not delivered when the service is killed is given again, from ``delivered`` on.
    """

    events: bool
    estimates: bool

    @property
    def name(self) -> str:
        """What to call it."""

    def plan(self) -> str:
        """Say in a line what it will do."""

    async def run(self, queue: Any, note: Callable[[str, str], None], delivered: Callable[[str, int], None]) -> None:
        """Deliver what comes through a queue, lists of `EventView` and `Estimate`, until it is cancelled."""


def message(event: EventView) -> dict[str, Any]:
    """Return an event as JSON has it."""
    found = {
        "number": event.number, "key": event.key, "time": event.time, "kind": event.kind, "sentence": event.sentence,
    }  # fmt: skip
    return found if event.odds is None else found | {"odds": event.odds}
