"""What a reproduction says: verdicts a script can rely on, and sections a person can read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

SURE = 3.0  # standard errors of a difference that chance is allowed: one comparison in 370


@dataclass(frozen=True)
class Statement:
    """A statement of the paper that does not hold: where it stands, what it says, and what holds instead."""

    where: str
    paper: str
    truth: str


@dataclass(frozen=True)
class Verdict:
    """One finding: what came out, what was expected, and whether this run confirms it (None: skipped).

    ``source`` says whose finding it is. Where the finding shows that a statement of the paper does not hold,
    ``refutes`` is that statement.
    """

    name: str
    value: str
    expected: str
    confirmed: bool | None
    source: str
    refutes: Statement | None = None

    @property
    def fails(self) -> bool:
        """Whether the finding was looked for and not confirmed."""
        return self.confirmed is False

    def row(self) -> dict:
        """Return the verdict as JSON has it; a skipped one passes and says so in its value."""
        return {
            "name": self.name,
            "value": self.value,
            "expected": self.expected,
            "pass": not self.fails,
            "skipped": self.confirmed is None,
            "source": self.source,
        }


@dataclass(frozen=True)
class Table:
    """Numbers under a caption: a head and rows of words. One ``is_result`` is what the command was called for."""

    caption: str
    head: list[str]
    rows: list[list[str]]
    is_result: bool = False


@dataclass(frozen=True)
class Picture:
    """A figure to be drawn when somebody wants it: ``draw`` returns a matplotlib Figure."""

    name: str
    caption: str
    draw: Callable[[], Any]


@dataclass
class Section:
    """One topic: a few words, tables, pictures, verdicts, and what could not be reproduced."""

    title: str
    words: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    verdicts: list[Verdict] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Reproduction:
    """Everything one reproduction found; ``note`` says how its signs and choices are to be read."""

    name: str
    title: str
    lead: str
    seeds: int
    sections: list[Section]
    note: str = ""

    @property
    def verdicts(self) -> list[Verdict]:
        """All verdicts, section by section."""
        return [verdict for section in self.sections for verdict in section.verdicts]

    @property
    def passes(self) -> bool:
        """Whether no verdict fails."""
        return not any(verdict.fails for verdict in self.verdicts)

    @property
    def refuted(self) -> list[tuple[Statement, str]]:
        """The paper's statements that this run shows not to hold, in its order, each with what was measured."""
        found = [(v.refutes, v.value) for v in self.verdicts if v.refutes is not None and v.confirmed]
        return sorted(found, key=lambda pair: pair[0].where)

    @property
    def headline(self) -> str:
        """How many findings are confirmed."""
        failed, skipped = sum(v.fails for v in self.verdicts), sum(v.confirmed is None for v in self.verdicts)
        return (
            f"{len(self.verdicts) - failed - skipped} of {len(self.verdicts)} findings confirmed"
            + (f", {failed} not confirmed" if failed else "")
            + (f", {skipped} skipped" if skipped else "")
        )

    @property
    def against(self) -> str:
        """How many statements of the paper do not hold; empty where none was refuted."""
        count = len(self.refuted)
        words = "statement of the paper does" if count == 1 else "statements of the paper do"
        return f"{count} {words} not hold" if count else ""

    def record(self) -> dict:
        """Return what ``--json`` writes."""
        tables = [vars(table) for section in self.sections for table in section.tables if table.is_result]
        more = {"tables": [{k: t[k] for k in ("caption", "head", "rows")} for t in tables]} if tables else {}
        return {"name": self.name, "seeds": self.seeds, "verdicts": [v.row() for v in self.verdicts], **more}


def numbers(values, digits: int = 3) -> str:
    """Return several numbers as words: "0.239, -1.175, 1.896"."""
    return ", ".join(f"{float(value):.{digits}f}" for value in values)


def short(value: float) -> str:
    """Return a number in powers of ten with two digits, zero as it is, and what is no number as overflow."""
    return "overflow" if value != value else "0" if value == 0 else f"{value:.1e}"


@dataclass(frozen=True)
class Estimate:
    """Numbers that were estimated from records, with the standard error of each. What is expected is one, too."""

    value: np.ndarray
    std: np.ndarray
    records: int

    @classmethod
    def median(cls, samples) -> Estimate:
        """Return the medians of (S, ..) samples; four of their standard errors are 2 sqrt(S) ranks."""
        samples = np.sort(np.asarray(samples, float), axis=0)
        S = len(samples)
        low, high = (np.clip(round(S / 2 + way * np.sqrt(S) - 0.5), 0, S - 1) for way in (-1, 1))
        return cls(np.median(samples, axis=0), (samples[high] - samples[low]) / 4, S)

    @classmethod
    def share(cls, value, records: int) -> Estimate:
        """Return shares of so many records; one more of either kind is thought of, so that none is certain."""
        value = np.asarray(value, float)
        p = (value * records + 1) / (records + 2)
        return cls(value, np.sqrt(p * (1 - p) / records), records)

    def expected(self, value, records: int) -> Estimate:
        """Return what is expected of such numbers, which others estimated in the same way from ``records`` records.

        They are errors: theirs has the same standard error as this one, in proportion.
        """
        value = np.asarray(value, float)
        return Estimate(value, self.std * (value / self.value) * np.sqrt(self.records / records), records)

    def room(self, other: Estimate) -> np.ndarray:
        """Return how far two estimates of one number may lie apart by chance: both have an error."""
        return SURE * np.hypot(self.std, other.std)

    def agrees(self, other: Estimate) -> bool:
        """Say whether both may be estimates of the same numbers."""
        return bool(np.all(abs(self.value - other.value) <= self.room(other)))

    def is_at_most(self, other: Estimate) -> bool:
        """Say whether this may be an estimate of numbers no larger than those of the other."""
        return bool(np.all(self.value - other.value <= self.room(other)))


class Scaled:
    """How many records a check uses and how wide its tolerance is, when ``--seeds`` is not what it was set for.

    A tolerance that is a number was set where found and expected come from about ``reference`` records each, and is for
    their difference: with more records it stays, as the expected one gains nothing. Where the records are at hand,
    `Estimate` says what both sides are worth.
    """

    def __init__(self, seeds: int, reference: int = 300):
        self.share = seeds / reference

    def records(self, count: int, least: int = 4) -> int:
        """Return how many of ``count`` records to run."""
        return max(least, round(count * self.share))

    def wide(self, tolerance):
        """Return a statistical tolerance, widened like the standard error where there are fewer records."""
        return tolerance * max(1.0, self.share**-0.5)
