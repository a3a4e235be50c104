"""Tables written as JSON: an object a line, as services log, a list of objects, or columns of values."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from itertools import zip_longest
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.tables.parquetfile import MemorySource

MOST_JSON = 1 << 26  # bytes: all of it is held, and as objects is ten times as large
DEPTH = 4  # objects within objects whose names are joined
CUT_LINES = 0.1  # share of the lines that may be no JSON: a logger that lost power leaves a part of one
_BEGINS = re.compile(rb"\s*(\{|\[\s*[\[{])")
_AS_CSV = "write its records as CSV (pandas: read_json, then to_csv), a row each"


def is_json(head: bytes) -> bool:
    """Say whether a file that begins so holds records as JSON.

    >>> [is_json(head) for head in (b'{"t": 1}', b' [ {"t": 1}', b"[s],[V]", b"t,y")]
    [True, True, False, False]
    """
    return bool(_BEGINS.match(head.removeprefix(b"\xef\xbb\xbf")))


def json_source(stream) -> MemorySource:
    """Return the reader of records in JSON, from a binary stream."""
    data = stream.read(MOST_JSON + 1)
    if len(data) > MOST_JSON:
        raise InputError(f"the table is JSON of more than {MOST_JSON >> 20} MB, all of which is held: {_AS_CSV}.")
    text = data.decode("utf-8-sig", "replace")
    try:
        rows, cut = _rows(text)
        columns = _columns([_flat(row) for row in rows])
    except RecursionError:
        raise InputError(f"the table is JSON of objects in one another without end: {_AS_CSV}.") from None
    if not columns:
        raise InputError(f"the table is JSON without records of values: {_AS_CSV}.")
    source = MemorySource(columns)
    if cut:
        lines = "1 line is" if cut == 1 else f"{cut} lines are"
        source.notes = (f"{lines} no JSON: left out.",)
    return source


def _rows(text: str) -> tuple[list[Any], int]:
    """Return the records of a text, and how many of its lines are none.

    >>> _rows('{"t": 1}\\n{"t": 2}\\n{"t"')[0]
    Traceback (most recent call last):
        ...
    driftwise.engine.errors.InputError: the table is no JSON that can be read: 1 of 3 lines are damaged.
    """
    try:
        return _records(json.loads(text)), 0
    except ValueError:
        pass
    rows, lines = [], [line for line in text.splitlines() if line.strip()]
    for line in lines:
        try:
            rows.append(json.loads(line))
        except ValueError:
            continue
    cut = len(lines) - len(rows)
    if cut > CUT_LINES * len(lines):
        raise InputError(f"the table is no JSON that can be read: {cut} of {len(lines)} lines are damaged.")
    return _records(rows), cut


def _records(found: Any) -> list[Any]:
    """Return the records of a document: its list, the columns of values, or the one list of records within it.

    >>> _records({"t": [0, 1], "y": [5, 6]})
    [{'t': 0, 'y': 5}, {'t': 1, 'y': 6}]
    >>> _records({"columns": ["t", "y"], "data": [[0, 5]]}), _records([["t", "y"], [0, 5]])
    ([{'t': 0, 'y': 5}], [{'t': 0, 'y': 5}])
    >>> _records({"status": "ok", "results": [{"t": 0}]}), _records({"t": {"0": 5, "1": 6}})
    ([{'t': 0}], [{'t': 5}, {'t': 6}])
    """
    if isinstance(found, list):
        return _named(found)
    if not isinstance(found, Mapping):
        return []
    names, rows = found.get("columns"), found.get("data")
    if isinstance(names, list) and isinstance(rows, list) and all(isinstance(row, list) for row in rows):
        return _named([names, *rows])
    lists = {name: value for name, value in found.items() if isinstance(value, list)}
    nested = [name for name, value in lists.items() if value and isinstance(value[0], Mapping | list)]
    if len(nested) == 1:
        return _named(lists[nested[0]])
    if len(lists) > 1 and not nested:
        return [dict(zip(lists, row)) for row in zip_longest(*lists.values())]
    inner = [value for value in found.values() if isinstance(value, Mapping)]
    if len(inner) == len(found) and not any(isinstance(v, Mapping | list) for value in inner for v in value.values()):
        index = list(dict.fromkeys(key for value in inner for key in value))
        return [{name: value.get(key) for name, value in found.items()} for key in index]
    return _records(inner[0]) if len(inner) == 1 and not lists else [found]


def _named(rows: list[Any]) -> list[Any]:
    """Return rows as objects; of rows that are lists the first may hold the names."""
    if not all(isinstance(row, list) for row in rows):
        return [row for row in rows if isinstance(row, Mapping)]
    is_header = bool(rows) and all(isinstance(cell, str) for cell in rows[0])
    names = rows[0] if is_header else [f"column{j + 1}" for j in range(max(map(len, rows), default=0))]
    return [dict(zip(names, row)) for row in rows[is_header:]]


def _flat(record: Mapping[str, Any], before: str = "", depth: int = DEPTH) -> dict[str, Any]:
    """Return the values of a record, those of an object within by both names; lists are no values.

    >>> _flat({"t": 0, "oven": {"temp": 20.5, "at": [1, 2]}})
    {'t': 0, 'oven.temp': 20.5}
    """
    found: dict[str, Any] = {}
    for name, value in record.items():
        if isinstance(value, Mapping):
            found |= _flat(value, f"{before}{name}.", depth - 1) if depth else {}
        elif not isinstance(value, list):
            found[f"{before}{name}"] = value
    return found


def _columns(rows: list[dict[str, Any]]) -> Any:
    """Return the columns of records as an Arrow table; a column of numbers and words is one of words."""
    import pyarrow as pa

    names = dict.fromkeys(name for row in rows for name in row)
    columns = {}
    for name in names:
        cells = [row.get(name) for row in rows]
        if any(isinstance(cell, str) for cell in cells):
            cells = [cell if cell is None or isinstance(cell, str) else json.dumps(cell) for cell in cells]
        elif not all(cell is None or isinstance(cell, bool) for cell in cells):
            cells = [None if cell is None else _number(cell) for cell in cells]
        columns[name] = pa.array(cells)
    return pa.table(columns) if columns else None


def _number(cell: Any) -> float:
    try:
        return float(cell)
    except OverflowError:
        return float("inf")
