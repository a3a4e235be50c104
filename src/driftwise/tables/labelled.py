"""Rows as serial monitors show them: heater:50,temp:22.4 or heater=50 temp=22.4; 12:01:07.250 -> 50,22.4."""

from __future__ import annotations

import re
from collections.abc import Sequence

LEAST = 3  # rows that show it
Written = tuple[re.Pattern[bytes], bytes]  # what is to be written otherwise, and how
_LABEL, _VALUE = r"([A-Za-z_][\w.]*)[ \t]*[:=][ \t]*", r"[^\s,;|=]+"
_ROW = re.compile(rf"\s*(?:{_LABEL}{_VALUE}\s*[,;|]?\s*)+$")
_PAIR = re.compile(_LABEL + _VALUE)


def written_as(lines: Sequence[str]) -> tuple[Written | None, str, int]:
    """Return what in the lines of a file is to be written otherwise, a row of names, and how many it stands for."""
    cut, named = arrows_of(lines)
    if cut:
        return (re.compile(rb"(?m)^(\d\d:\d\d:\d\d\.\d{3}) -> "), rb"\1" + cut.encode()), named, bool(named)
    pattern, named = labels_of(lines)
    return ((pattern, b"") if pattern else None), named, 0


def labels_of(lines: Sequence[str]) -> tuple[re.Pattern[bytes] | None, str]:
    """Return what matches the names that all rows give to their values, and a row of them; (None, "") of other rows.

    >>> labels_of(["heater:50,temp:22.4", "heater:50,temp:22.5", "heater:60,temp:22.9"])[1]
    'heater,temp'
    >>> labels_of(["time,temp", "10:30,22.4", "10:31,22.5"])
    (None, '')
    """
    rows = [line for line in lines if line.strip()]
    if len(rows) < LEAST or not all(map(_ROW.match, rows)):
        return None, ""
    names = _PAIR.findall(rows[0])
    if len(set(names)) < len(names) or any(_PAIR.findall(row) != names for row in rows):
        return None, ""
    called = "|".join(map(re.escape, names))
    return re.compile(rf"(?<![\w.])(?:{called})[ \t]*[:=][ \t]*".encode("latin-1")), _PAIR.sub(r"\1", rows[0]).strip()


_ARROW = re.compile(r"(\d\d:\d\d:\d\d\.\d{3}) -> (.*)$")


def arrows_of(lines: Sequence[str]) -> tuple[str, str]:
    """Return what to write for the arrow of 12:01:07.250 -> 20,23.5, and a first row of names; ("", "") of others.

    The serial monitor of Arduino puts the time of day before each line; the cells behind are cut as they are.

    >>> arrows_of(["12:01:07.250 -> heater,temp", "12:01:07.500 -> 20,23.5", "12:01:07.750 -> 20,23.6"])
    (',', 'time,heater,temp')
    >>> arrows_of(["12:01:07.250,20", "12:01:07.500,20", "12:01:07.750,20"])
    ('', '')
    """
    rows = [line for line in lines if line.strip()]
    found = [match for match in map(_ARROW.match, rows) if match]
    if len(found) < LEAST or len(found) < len(rows):
        return "", ""
    behind = [match[2] for match in found]
    cut = next((mark for mark in "\t;," if all(mark in cells for cells in behind)), " ")
    is_named = not re.match(r"\s*[-+.\d]", behind[0])
    return cut, f"time{cut}{behind[0]}" if is_named else ""
