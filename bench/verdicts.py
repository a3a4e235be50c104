"""One measured number beside what was promised; met and missed are printed alike."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple


class Verdict(NamedTuple):
    """A number, the budget in words, whether it was kept, and the file that measured it."""

    name: str
    value: float | None
    expected: str
    kept: bool
    source: str
    note: str = ""

    def as_dict(self) -> dict:
        """Return the form that scripts read."""
        value = None if self.value is None else float(f"{self.value:.4g}")
        row = {"name": self.name, "value": value, "expected": self.expected, "pass": self.kept, "source": self.source}
        return {**row, "note": self.note} if self.note else row


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
    """Return a budget that could not be measured here, which does not keep it."""
    return Verdict(name, None, expected, False, source, why)


def write(path: Path, verdicts: list[Verdict]) -> None:
    """Write the verdicts as JSON."""
    path.write_text(json.dumps({"name": "bench", "verdicts": [v.as_dict() for v in verdicts]}, indent=2) + "\n")


def page(verdicts: list[Verdict]) -> str:
    """Return the verdicts as the Markdown page of the documentation."""
    missed = sum(not v.kept for v in verdicts)
    rows = [
        f"| {v.name} | {'-' if v.value is None else f'{v.value:.3g}'} | {v.expected} "
        f"| {'met' if v.kept else '**missed**'} | {v.note} |"
        for v in verdicts
    ]
    return "\n".join([PAGE.format(met=len(verdicts) - missed, missed=missed), *rows, ""])


PAGE = """# Benchmarks

Written by `make bench`; every number is measured in one run, opponents alternating with driftwise, medians of several
rounds. What was missed is printed as plainly as what was met. `python -m bench --big` takes 1e8 rows of Parquet.

The opponent in C (`bench/joint.c`) is the same U D recursion with run-time sizes, compiled with -O3 and checked to give
the same numbers to 1e-9. filterpy is fed the matrices of every sample, built beforehand (smoothing: with noise on every
state, since its smoother inverts P), and so is the dense filter in NumPy. Wall times (start-up, threads) want an idle
machine.

This run: {met} met, {missed} missed.

| what | measured | budget | | note |
|---|---|---|---|---|"""


def table():
    """Return an empty table for `add`."""
    from rich.table import Table

    out = Table("what", "measured", "budget", "", "note")
    out.columns[1].justify = "right"
    return out


def add(out, verdict: Verdict) -> None:
    """Add a row."""
    value = "-" if verdict.value is None else f"{verdict.value:.3g}"
    out.add_row(verdict.name, value, verdict.expected, "met" if verdict.kept else "MISSED", verdict.note)
