"""Samples that come late, put in their place: the last ones are kept with the state before each, and run again.

The state of a series is then bit for bit that of the record in order, as long as what comes late finds its place among
the samples that are kept. One mechanism for whatever takes samples in order of time: it is told how one is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

FORGOTTEN, HORIZON, KEPT, LATE, REFUSED = COUNTS = "forgotten", "horizon", "kept", "late", "refused"


class LateBuffer(NamedTuple):
    """The last samples of a series, the row of numbers before each, and how one more is put among them.

    A sample is so many ``numbers``, the first of them its instant. Two of one instant stand in the order in which they
    came where ``repeats``; else they are one, and the later fills what is NaN in the other.

    Attributes
    ----------
    run : ``run(row, sample)`` returns the next row, another array, and what the sample showed
    width : numbers of a row
    numbers : of a sample
    lag : how long before the newest sample a late one may be, s
    samples : how many are kept
    repeats : whether instants may come again
    is_regular : samples stand dt apart, so that a late one only fills in what was missing in its place
    slack : by how many seconds two instants of one sample may differ
    """

    run: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, Any]]
    width: int
    numbers: int
    lag: float
    samples: int
    repeats: bool = False
    is_regular: bool = False
    slack: float = 0.0

    @property
    def dtype(self) -> np.dtype:
        """The type of its state: plain numbers."""
        counts = [(name, float) for name in COUNTS]
        before = [("before", float, (self.samples, self.width)), ("sample", float, (self.samples, self.numbers))]
        return np.dtype([*counts, ("row", float, (self.width,)), *before])

    def put(self, state: np.ndarray, sample: np.ndarray) -> tuple[np.ndarray, Any]:
        """Return the next state, and what the sample showed in its place; None where it is refused.

        It is refused, and counted, more than ``lag`` before the newest; before those that are kept, once some were
        forgotten; and where its instant is taken and nothing of it is missing.
        """
        state = np.array(state)
        kept, samples, before = int(state[KEPT]), state["sample"], state["before"]
        times, newest = samples[:kept, 0], samples[kept - 1, 0]
        is_next = not kept or sample[0] > newest + self.slack or (self.repeats and sample[0] == newest)
        at = kept if is_next else int(np.searchsorted(times, sample[0] + self.slack, side="right"))
        fills = not is_next and not self.repeats and at > 0 and times[at - 1] >= sample[0] - self.slack
        if not is_next:
            state[LATE] += 1.0
            if not self._has_place(state, sample, at, fills):
                state[REFUSED] += 1.0
                return state, None
        at -= int(fills)
        row, shown = np.array(before[at] if at < kept else state["row"]), None
        if fills:
            samples[at, 1:] = np.where(np.isnan(samples[at, 1:]), sample[1:], samples[at, 1:])
        elif kept == self.samples and at == 0:  # older than all of them: it is the one to be forgotten
            row, shown = self.run(row, sample)
            state[FORGOTTEN], state[HORIZON] = state[FORGOTTEN] + 1.0, sample[0]
        else:
            if kept == self.samples:
                state[FORGOTTEN], state[HORIZON] = state[FORGOTTEN] + 1.0, samples[0, 0]
                at -= 1
                samples[:at], before[:at] = samples[1 : at + 1], before[1 : at + 1]
            else:
                samples[at + 1 : kept + 1] = samples[at:kept]
                kept += 1
            samples[at] = sample
        for i in range(at, kept):
            before[i] = row
            row, seen = self.run(row, samples[i])
            shown = seen if shown is None else shown
        state[KEPT], state["row"] = kept, row
        return state, shown

    def _has_place(self, state, sample, at: int, fills: bool) -> bool:
        """Say whether a sample that is not the next one can still be taken."""
        kept = state["sample"][: int(state[KEPT])]
        if kept[-1, 0] - sample[0] > self.lag or (self.is_regular and not fills):
            return False
        if fills:
            return bool(np.any(np.isnan(kept[at - 1, 1:]) & ~np.isnan(sample[1:])))
        is_after = sample[0] > state[HORIZON] or (self.repeats and sample[0] == state[HORIZON])
        return at > 0 or state[FORGOTTEN] == 0.0 or bool(is_after)
