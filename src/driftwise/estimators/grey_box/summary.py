"""What a run of a grey box amounts to: its parameters, when they moved, and what is not to be believed of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine.status import Status
from ...results.numbers import finite
from ...results.observer_summary import ObserverSummary
from ...results.physical_sentences import (
    CURVED_WORDS,
    EDGE_WORDS,
    STIFF_WORDS,
    UNDEFINED_WORDS,
    jump_at_words,
    within,
)

SAID = ((Status.CURVED, CURVED_WORDS), (Status.AT_EDGE, EDGE_WORDS))  # of the last sample
ANYWHERE = ((Status.UNDEFINED, UNDEFINED_WORDS), (Status.STIFF, STIFF_WORDS))
JUMPS_SAID = 5


class GreyBoxSummary(ObserverSummary):
    """Numbers of a run of a grey box; add one trace after the other, memory does not grow."""

    def __init__(self, estimator):
        super().__init__(estimator)
        self.moves: list[Any] = []
        self.status = 0

    def add(self, trace: Any) -> GreyBoxSummary:
        """Take in one more stretch of the run."""
        super().add(trace)
        if len(trace):
            self.status |= int(np.bitwise_or.reduce(trace.status.ravel()))
            self.moves = (self.moves + trace.jumps())[-JUMPS_SAID:]
        return self

    @property
    def parameters(self) -> list[tuple[str, float, float]]:
        """(name, value, standard deviation) of each parameter now, in its unit."""
        values, P = self.estimator.parameters_of(self.state)
        return [(n, float(v), float(s)) for n, v, s in zip(self.estimator.names, values, np.sqrt(np.diag(P)))]

    @property
    def notes(self) -> list[str]:
        """What is not told, or not to be believed, in sentences."""
        return [
            *self.estimator.notes_of(self.state),
            *(words for bit, words in SAID if int(self.state["status"]) & bit),
            *(words for bit, words in ANYWHERE if self.status & bit),
        ]

    @property
    def words(self) -> str:
        """The run in a few plain sentences."""
        if not self.samples or np.isnan(self.first_ready):
            return super().words
        est, units = self.estimator, self.estimator.formulas.units
        intervals = est.intervals(self.state)
        known = ", ".join(within(n, v, intervals[n], units[n]) for n, v, _ in self.parameters)
        moves = [jump_at_words(event.moved, event.time) for event in self.moves]
        more = self.jumps - len(moves)
        if moves:
            moves = ["; ".join([*moves, *([f"and {more} jumps before"] if more else [])]) + "."]
        return " ".join([f"{known}, with 95 %.", *moves, self.remarks])

    @property
    def remarks(self) -> str:
        """How well it predicts, and what is not told, or not to be believed."""
        return " ".join(one for one in [self._fit_words(), *self.notes] if one)

    def _fit_words(self) -> str:
        """Return how well the outputs are predicted: what an observer says of it, less its jumps."""
        if self.jumps and not all(nis.is_consistent for nis in self.nis if nis.samples):
            return ""  # the samples from a jump to its alarm are not predicted, and say nothing of the noise
        jumps, self.jumps = self.jumps, 0
        try:
            words = super().words
        finally:
            self.jumps = jumps
        return words.removeprefix("The first estimate was ready after 0 s. ")

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, ready for JSON (NaN becomes None)."""
        est, units = self.estimator, self.estimator.formulas.units
        intervals = est.intervals(self.state)
        return super().as_dict() | finite({
            "parameters": [
                {"name": n, "value": v, "std": s, "interval": list(intervals[n]), "unit": units[n]}
                for n, v, s in self.parameters
            ],
            "moves": [{"name": e.parameter, "time": e.time, "words": e.moved} for e in self.moves],
            "notes": self.notes,
        })  # fmt: skip
