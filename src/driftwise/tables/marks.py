"""Numbers with marks that spreadsheets write into the cells: commas between thousands, and a unit behind."""

from __future__ import annotations

import re
from typing import NamedTuple

_GROUPED = re.compile(r"[+-]?\d{1,3}(,\d{3})+(\.\d*)?$")  # 1,234.5
_WITH_UNIT = re.compile(r"((?:[+-]\s*)?(?:\d[\d.,]*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\d\s.,+-]\S{0,7})$")


class Marks(NamedTuple):
    """What the cells of a column carry beside numbers."""

    grouped: bool  # commas between thousands
    unit: str  # "" if there is none

    def bare(self, cell: str) -> str:
        """Return a cell without its marks."""
        if self.unit and (match := _WITH_UNIT.match(cell)) and match[2] == self.unit:
            cell = match[1]
        return cell.replace(",", "") if self.grouped and _GROUPED.match(cell) else cell


def marks_of(cells: list[str]) -> Marks | None:
    """Return what all cells of a column carry, None where they carry nothing or not the same.

    Commas are between thousands where a point, or a second comma, leaves no doubt: 1,234 alone may be 1.234.

    >>> marks_of(["60,123.4", "999.9"]).grouped, marks_of(["60.0 %", "61 %"]).unit
    (True, '%')
    >>> marks_of(["60,123", "59,900"]), marks_of(["60 %", "61"]), marks_of(["3 apples", "4 apples"])
    (None, None, None)
    """
    from driftwise.tables.column_roles import is_unit

    if not cells:
        return None
    found = [_WITH_UNIT.match(cell) for cell in cells]
    units = {match[2] if match else "" for match in found}
    unit = units.pop() if len(units) == 1 else ""
    if unit and not is_unit(unit):
        return None
    bare = [match[1] for match in found if match] if unit else cells
    commas = [cell for cell in bare if "," in cell]
    grouped = bool(commas) and all(map(_GROUPED.match, commas)) and any("." in c or c.count(",") > 1 for c in commas)
    return Marks(grouped, unit) if grouped or unit else None


def plain(array, marks: Marks):
    """Return a pyarrow array of text without the marks; a cell that carries others stays as it is."""
    import pyarrow.compute as pc

    cells = pc.utf8_trim_whitespace(array)
    if marks.unit:
        cells = pc.replace_substring_regex(cells, rf"^([+-]?\s*\S*[\d.])\s*{re.escape(marks.unit)}$", r"\1")
    if marks.grouped:
        is_grouped = pc.fill_null(pc.match_substring_regex(cells, "^" + _GROUPED.pattern), False)
        cells = pc.if_else(is_grouped, pc.replace_substring(cells, ",", ""), cells)
    return cells
