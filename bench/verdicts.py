"""One measured number beside what was promised; met and missed are printed alike. A table holds more of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple


class Verdict(NamedTuple):
    """A number, the budget in words, whether it was kept, and the file that measured it.

    Where somebody else did the same job: who, how many times as fast (more than 1: faster than we), and why.
    """

    name: str
    value: float | None
    expected: str
    kept: bool
    source: str
    note: str = ""
    rival: str = ""
    ahead: float = 0.0
    why: str = ""

    def as_dict(self) -> dict:
        """Return the form that scripts read."""
        value = None if self.value is None else float(f"{self.value:.4g}")
        row = {"name": self.name, "value": value, "expected": self.expected, "pass": self.kept, "source": self.source}
        beside = {"rival": self.rival, "ahead": float(f"{self.ahead:.3g}"), "why": self.why} if self.rival else {}
        return {**row, **({"note": self.note} if self.note else {}), **beside}

    def beside(self, rival: str, ahead: float, why: str = "") -> Verdict:
        """Return the verdict with who else did the job, how many times as fast as we, and why if faster."""
        return self._replace(rival=rival, ahead=float(ahead), why=why)


class Table(NamedTuple):
    """Numbers that belong together; the first column says what of."""

    title: str
    columns: tuple[str, ...]
    rows: list[tuple[Any, ...]]
    text: str = ""


def at_most(name: str, value: float, bound: float, unit: str, source: str, note: str = "") -> Verdict:
    """Return whether value <= bound."""
    return Verdict(name, value, f"<= {bound:g} {unit}".strip(), bool(value <= bound), source, note)


def at_least(name: str, value: float, bound: float, unit: str, source: str, note: str = "") -> Verdict:
    """Return whether value >= bound."""
    return Verdict(name, value, f">= {bound:g} {unit}".strip(), bool(value >= bound), source, note)


def for_information(name: str, value: float, unit: str, source: str, note: str = "") -> Verdict:
    """Return a number that nothing was promised about."""
    return Verdict(name, value, f"no budget ({unit})", True, source, note)


def not_measured(name: str, expected: str, source: str, why: str) -> Verdict:
    """Return what could not be measured here; a budget is not kept by that."""
    return Verdict(name, None, expected, expected.startswith("no budget"), source, why)


def write(path: Path, machine: dict[str, str], seconds: dict[str, float], found: list[Verdict | Table]) -> None:
    """Write verdicts and tables as JSON, and the seconds that each part took."""
    verdicts = [one.as_dict() for one in found if isinstance(one, Verdict)]
    tables = [one._asdict() for one in found if isinstance(one, Table)]
    told = {"name": "bench", "machine": machine, "seconds": seconds, "verdicts": verdicts, "tables": tables}
    path.write_text(json.dumps(told, indent=2) + "\n")


def number(value: Any) -> str:
    """Return a cell as it is read: three digits of a number, words as they are."""
    if value is None:
        return "-"
    if isinstance(value, str):
        return value
    if isinstance(value, int):
        return f"{value:,}".replace(",", " ")
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
