"""One statement of an answer: what it is about, the number, how sure it is, and the words it is said in."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from ..models.quantities import NORMAL_95

KINDS = {  # what an answer speaks of, and what `value` is
    "column": "the part of columns: their names",
    "clock": "the time between samples: seconds, or the unit of the clock",
    "reading": "another way to read the columns: the output that was taken",
    "table": "what is odd in the table: a number that says how much",
    "plant": "the model as a whole: its order; None where nothing can be said",
    "gain": "steady state of the output for one unit of an input",
    "time constant": "of a mode that decays, in the unit of the clock",
    "pole": "of a mode that does more than decay: the period of an oscillation, or the pole",
    "delay": "samples from an input to the first answer",
    "change": "the first sample after a change; where there is none, the smallest that would have been told, by kind",
    "together": "the first row of a change that several columns have in common",
    "season": "share of the error variance that a season takes off, of the best model without",
    "noise": "standard deviation of what cannot be predicted",
    "forecast": "share of the movement that is predicted, or of samples in their band, in percent",
    "model choice": "the name of the model that is shown",
    "note": "what to beware of: the number of the verdict",
}


@dataclass(frozen=True)
class Claim:
    """One statement of an answer; its text is what a reader sees, the rest is what a program, or a test, can check.

    Attributes
    ----------
    kind : what it speaks of, one of `KINDS`
    subject : of what: a column, an input, what moved
    text : the sentence
    value : the number or name that is claimed; None where the words have no number
    interval : where the number lies in 95 of 100 records; None where nothing is claimed of it
    odds : against the opposite; None where they were not weighed
    """

    kind: str
    subject: str
    text: str
    value: Any = None
    interval: tuple[float, float] | None = None
    odds: float | None = None

    def __post_init__(self):
        if self.kind not in KINDS:
            raise ValueError(f"a claim is of {', '.join(KINDS)}, got {self.kind!r}")

    def __str__(self):
        return self.text

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return asdict(self)


def told(claims: Iterable[Claim]) -> str:
    """Return claims as one paragraph: their texts and nothing else."""
    return " ".join(claim.text for claim in claims)


def around(value: float, std: float) -> tuple[float, float] | None:
    """Return the interval of a number with a normal error; None where it has no bound."""
    return (value - NORMAL_95 * std, value + NORMAL_95 * std) if math.isfinite(std) else None
