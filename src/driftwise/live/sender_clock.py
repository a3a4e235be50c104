"""Senders whose clock is ahead of the one here: what is taken off their stamps, so that no sample is lost by it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ..results.numbers import lasting

AHEAD = 600.0  # s that a stamp may be ahead of the clock here
FAR = 1e9  # s that no clock is ahead: another unit, or no date
DATES = 1e8  # stamps above are dates


@dataclass
class SenderClock:
    """How far the clock of a series is ahead, ``offset`` in s, and the latest stamp that was taken, without that.

    A stamp that is ahead, and leaps ahead of those before, says how far. Stamps that creep ahead come faster than time
    goes, as those of a file that is played, and stay as they are.
    """

    offset: float = 0.0
    reached: float = -math.inf

    def right(self, times: list[float], now: float) -> Righted:
        """Take off, in place, what stamps (n,) are ahead at the instant ``now``."""
        found, last = Righted(), now + AHEAD
        if last < DATES or not times:
            return found
        if max(times) <= last:
            self.reached = max(self.reached, *times)
            return found
        for i, time in enumerate(times):
            if time > last:
                found.ahead += 1
                if time - now > FAR:
                    found.beyond.append(i)
                    continue
                if time - self.offset > max(last, self.reached + AHEAD):
                    self.offset = time - now
                    found.said.append((now, ahead_words(self.offset)))
                times[i] = time - self.offset
            self.reached = max(self.reached, times[i])
        return found

    def as_json(self) -> list[float]:
        """Return it as JSON has it; [] of a clock that was never ahead."""
        return [self.offset, self.reached] if self.offset else []


@dataclass
class Righted:
    """How many stamps were ahead, which of them (places) belong to no clock, and what is to be told: (time, words)."""

    ahead: int = 0
    beyond: list[int] = field(default_factory=list)
    said: list[tuple[float, str]] = field(default_factory=list)


def ahead_words(offset: float) -> str:
    """Return how far a clock is ahead, and what is done about it."""
    return f"its clock is {lasting(offset)} ahead of the one here; so much is taken off its stamps"


def beyond_words(key: str) -> str:
    """Return why a stamp is not used."""
    return f"a stamp of {key} is more than 30 years ahead of the clock here: is time_unit another?"
