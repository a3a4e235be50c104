"""Verdicts: a number, the range in which it is fine, and what to do where it is not."""

from __future__ import annotations

import math
import textwrap
from typing import Any, NamedTuple

from ..models.markup import columns
from .numbers import plain, sentence

WIDTH = 110  # of the printed table


class Verdict(NamedTuple):
    """One number about a run, and what follows from it.

    Attributes
    ----------
    name : what was looked at
    value : the number; NaN where there is too little to judge by (then it counts as fine)
    threshold : (low, high), the range in which the value is fine; infinite where it has no end
    is_fine : whether it is
    advice : one sentence: what it means, and what to do about it

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> verdict = dw.ARX(1, 1).scan(y, u).diagnose().find("coverage")
    >>> verdict.is_fine, verdict.threshold, verdict.advice
    (True, (0.9175257731958762, 0.9768041237113402), 'the 95 % bands hold what they should')
    """

    name: str
    value: float
    threshold: tuple[float, float]
    is_fine: bool
    advice: str

    @property
    def is_known(self) -> bool:
        """Whether there was enough to judge by."""
        return not math.isnan(self.value)

    @property
    def limits(self) -> str:
        """The range in which the value is fine, in words; nothing where it has no end."""
        low, high = self.threshold
        if math.isinf(low) and math.isinf(high):
            return ""
        if math.isinf(high):
            return f"at least {_number(low)}"
        if math.isinf(low):
            return f"at most {_number(high)}"
        return f"{_number(low)} to {_number(high)}"

    @property
    def shown(self) -> str:
        """The value as one prints it."""
        return _number(self.value) if self.is_known else "-"

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values; a threshold without end, and a value not known, are None."""
        return self._asdict() | {
            "value": self.value if math.isfinite(self.value) else None,
            "threshold": [end if math.isfinite(end) else None for end in self.threshold],
        }


class Diagnosis(list[Verdict]):
    """The verdicts of a run, a list; print it for a table, in which ``!`` marks what is not fine.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> diagnosis = dw.ARX(1, 1).scan(y, u).diagnose()
    >>> [verdict.name for verdict in diagnosis if not verdict.is_fine]
    []
    """

    @property
    def is_fine(self) -> bool:
        """Whether every verdict is fine."""
        return all(verdict.is_fine for verdict in self)

    @property
    def not_fine(self) -> list[Verdict]:
        """The verdicts that ask for something."""
        return [verdict for verdict in self if not verdict.is_fine]

    def find(self, name: str) -> Verdict:
        """Return the verdict of that name; KeyError where it was not given."""
        for verdict in self:
            if verdict.name == name:
                return verdict
        raise KeyError(f"no verdict {name!r}; there are: {', '.join(verdict.name for verdict in self)}")

    @property
    def words(self) -> str:
        """What is not fine, in plain sentences."""
        said = [sentence(verdict.advice) for verdict in self.not_fine]
        return " ".join(said) if said else f"All of {', '.join(verdict.name for verdict in self)} are fine."

    def as_dict(self) -> dict[str, Any]:
        """Return the verdicts by name, as plain values."""
        return {verdict.name: verdict.as_dict() for verdict in self}

    def __str__(self):
        head = ["", "verdict", "value", "fine", ""]
        rows = [[" " if v.is_fine else "!", v.name, v.shown, v.limits, v.advice] for v in self]
        wide = [max(len(row[j]) for row in [head, *rows]) for j in range(4)]
        left = sum(wide) + 2 * 4 - 1
        lines = []
        for row in [head, *rows]:
            cells = [row[0].ljust(wide[0]), row[1].ljust(wide[1]), row[2].rjust(wide[2]), row[3].ljust(wide[3])]
            advice = textwrap.wrap(row[4], max(WIDTH - left, 40)) or [""]
            lines.append(" ".join([cells[0], "  ".join([*cells[1:], advice[0]])]).rstrip())
            lines += [" " * left + more for more in advice[1:]]
        return "\n".join(lines)

    __repr__ = __str__

    def _repr_html_(self):
        marks = ["" if verdict.is_fine else "!" for verdict in self]
        shown = {"verdict": [v.name for v in self], "value": [v.shown for v in self], "fine": [v.limits for v in self]}
        return columns({"": marks, **shown, "what it means": [v.advice for v in self]})


def _number(value: float) -> str:
    """Return a number with three digits, counts with all of them, and in words where nobody reads it."""
    if abs(value) >= 999_500:
        return plain(value, 0)
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
