"""Write the words and units by which columns are known into docs/columns.md: ``python scripts/vocabulary.py``."""

from __future__ import annotations

import sys
from pathlib import Path

from driftwise.tables.vocabulary import MOTION, PLACES, PLAIN_UNITS, SECONDS, UNITS, WORDS

PAGE = Path(__file__).resolve().parents[1] / "docs/columns.md"
BEGIN, END = "<!-- written by scripts/vocabulary.py -->", "<!-- end -->"


def tables() -> str:
    """Return the vocabulary as Markdown."""
    lines = ["| part | words |", "|---|---|"]
    lines += [f"| {kind} | {' '.join(dict.fromkeys(words.split()))} |" for kind, words in WORDS.items()]
    lines += ["", "| unit | more often |", "|---|---|"]
    lines += [f"| {units} | {kind} |" for kind, units in UNITS.items()]
    lines += ["", f"Where a body is, by two columns: {', '.join(PLACES)}."]
    lines += ["", f"How it moves: {' '.join(dict.fromkeys(MOTION.split()))}."]
    lines += ["", f"Units of a clock: {' '.join(SECONDS)}.", "", f"Units in ASCII: {PLAIN_UNITS}."]
    return "\n".join(lines)


def page() -> str:
    """Return the page with the vocabulary of today."""
    text = PAGE.read_text()
    head, rest = text.split(BEGIN)
    return f"{head}{BEGIN}\n{tables()}\n{END}{rest.split(END, 1)[1]}"


if __name__ == "__main__":
    if "--check" in sys.argv:
        sys.exit(page() != PAGE.read_text() and "docs/columns.md is not up to date: python scripts/vocabulary.py")
    PAGE.write_text(page())
