"""Rows that repeat the names of their values, heater:50,temp:22.4 or heater=50 temp=22.4, as serial monitors show."""

from __future__ import annotations

import re
from collections.abc import Sequence

LEAST = 3  # rows that show it
_LABEL, _VALUE = r"([A-Za-z_][\w.]*)[ \t]*[:=][ \t]*", r"[^\s,;|=]+"
_ROW = re.compile(rf"\s*(?:{_LABEL}{_VALUE}\s*[,;|]?\s*)+$")
_PAIR = re.compile(_LABEL + _VALUE)


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
