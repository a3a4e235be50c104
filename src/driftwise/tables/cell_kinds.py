"""What a cell of text holds: a number, a time stamp, a word, or nothing."""

from __future__ import annotations

import re

from driftwise.tables.dates import STAMP

MISSING = frozenset(
    "|--.-|---.-|NA|N/A|n/a|na|#N/A|nan|NaN|NAN|Nan|-nan|-NaN|null|NULL|Null|None|none|NONE|missing|<NA>|NaT|\u2212|\u2013|\u2014".split(
        "|"
    )
) | {mark * times for mark in "-.?*" for times in range(1, 6)}
# How minus is written besides, and as it is read: a typographer's (which reports here print), an accountant's, SAP's.
# A sign may stand apart, as scales and loggers print it: +   22.40.
MINUS = (
    (r"^([+-])\s+([0-9.])", r"\1\2"),
    ("\u2212", "-"),
    (r"^\(\s*([0-9.,]*[0-9][0-9.,]*)\s*\)$", r"-\1"),
    (r"^([0-9.,]*[0-9][0-9.,]*)-$", r"-\1"),
)

_DOT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?$|[+-]?inf(inity)?$", re.I)
_COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+|[1-9]\d{0,2}(\.\d{3})+,\d*)([eEdD][+-]?\d+)?$")
GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(\.\d{3})+$")  # 1.234 in a table whose decimal mark is a comma


def kind(cell: str) -> str:
    """Return what a cell holds: "number", "comma" (with a decimal comma), "missing", "stamp" or "text"."""
    cell = cell.strip()
    if cell in MISSING:
        return "missing"
    if cell[:1] in "(\u2212" or cell[-1:] == "-" or "\u2212" in cell or cell[1:2] == " ":
        for written, read in MINUS:
            cell = re.sub(written, read, cell)
    if _DOT.match(cell):
        return "number"
    if _COMMA.match(cell):
        return "comma"
    return "stamp" if STAMP.match(cell) else "text"
