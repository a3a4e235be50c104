"""What a notebook shows of a result: its sentences, and a small table."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

HEAD = "<tr><th>parameter</th><th>value</th><th>standard deviation</th></tr>"


def markup(words: str, parameters: Sequence[tuple[str, float, float]] = ()) -> str:
    """Return sentences, line by line, and a table of (name, value, standard deviation); names are no tags."""
    text = "".join(f"<p>{escape(line)}</p>" for line in words.splitlines() if line)
    rows = "".join(f"<tr><td>{escape(n)}</td><td>{v:.6g}</td><td>{s:.2g}</td></tr>" for n, v, s in parameters)
    return text + f"<table>{HEAD}{rows}</table>" if rows else text
