"""What a notebook shows of a result: its sentences, and a small table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

HEAD = "<tr><th>parameter</th><th>value</th><th>standard deviation</th></tr>"


def markup(words: str, parameters: Sequence[tuple[str, float, float]] = ()) -> str:
    """Return sentences, line by line, and a table of (name, value, standard deviation); names are no tags."""
    text = "".join(f"<p>{escape(line)}</p>" for line in words.splitlines() if line)
    rows = "".join(f"<tr><td>{escape(n)}</td><td>{v:.6g}</td><td>{s:.2g}</td></tr>" for n, v, s in parameters)
    return text + f"<table>{HEAD}{rows}</table>" if rows else text


def as_typed(text: str) -> str:
    """Return a text whose columns stand one below the other."""
    return f"<pre>{escape(text)}</pre>"


def columns(table: Mapping[str, Iterable], limit: int = 30) -> str:
    """Return a table by its columns, so many rows of it at most."""
    rows = list(zip(*table.values()))
    head = "".join(f"<th>{escape(name)}</th>" for name in table)
    body = "".join(f"<tr>{''.join(f'<td>{_cell(value)}</td>' for value in row)}</tr>" for row in rows[:limit])
    more = f"<p>{len(rows) - limit} more</p>" if len(rows) > limit else ""
    return f"<table><tr>{head}</tr>{body}</table>{more}"


def _cell(value: Any) -> str:
    """Return what stands in a cell: nothing for nothing, numbers to four digits."""
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else escape(str(value))
