"""Lines of text become samples: JSON, plain numbers, InfluxDB's line protocol, or CSV under a header."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator

from ...engine.errors import InputError
from ..decode import Chunk, Shape, influx_lines, instant, json_lines, number

FORMATS = "auto", "csv", "json", "influx"


class Lines:
    """Reads lines of one kind; that of ``auto`` is told by the first line, and what heads a CSV is remembered."""

    def __init__(self, form: str = "auto", key: str = "", shape: Shape = Shape(), header: list[str] | None = None):
        if form not in FORMATS:
            raise InputError(f"format is one of {', '.join(FORMATS)}, got {form!r}")
        self.form, self.key, self.shape, self.header = form, key, shape, header

    def read(self, data: bytes, begins: bool = False) -> tuple[list[Chunk], tuple[str, ...]]:
        """Return the samples of complete lines, and why each line that cannot be used was refused."""
        if begins:
            self.header = None
        if self.form == "auto" and data.strip():
            self.form = _recognised(data.lstrip().split(b"\n", 1)[0])
        kinds = {"json": self._json, "influx": self._influx, "csv": self._csv}
        found = list(kinds.get(self.form, self._json)(data))
        chunks = _gathered(chunk for chunk in found if isinstance(chunk, Chunk))
        return chunks, tuple(str(error) for error in found if not isinstance(error, Chunk))

    def _json(self, data: bytes) -> Iterator[Chunk | InputError]:
        return json_lines(data, self.key, self.shape)

    def _influx(self, data: bytes) -> Iterator[Chunk | InputError]:
        return influx_lines(data, self.shape.unit)

    def _csv(self, data: bytes) -> Iterator[Chunk | InputError]:
        rows = csv.reader(data.decode("utf-8", "replace").splitlines())
        for cells in rows:
            if not cells:
                continue
            if self.header is None:
                self.header = [cell.strip() for cell in cells]
                continue
            try:
                yield self._row(self.header, cells)
            except InputError as error:
                yield error

    def _row(self, header: list[str], cells: list[str]) -> Chunk:
        if len(cells) != len(header):
            raise InputError(f"{len(cells)} cells under {len(header)} names: {','.join(cells)[:60]}")
        row = dict(zip(header, (cell.strip() for cell in cells)))
        key, when = row.pop(self.shape.key, self.key), row.pop(self.shape.time, None)
        if not key:
            raise InputError("a row without a key")
        fields = {name: [number(cell, name) if cell else math.nan] for name, cell in row.items()}
        return Chunk(key, [instant(when or None, self.shape.unit)], fields)


def _recognised(line: bytes) -> str:
    """Return what kind of lines begins so."""
    text = line.strip()
    if text[:1] in (b"{", b"["):
        return "json"
    try:
        float(text)
        return "json"
    except ValueError:
        return "influx" if b"=" in text and b" " in text else "csv"


def _gathered(found) -> list[Chunk]:
    """Join samples of equal key and fields; those of a series stay in order."""
    open_chunks: dict[str, Chunk] = {}
    chunks: list[Chunk] = []
    for chunk in found:
        last = open_chunks.get(chunk.key)
        if last is not None and last.fields.keys() == chunk.fields.keys():
            last.time.extend(chunk.time)
            for name, values in chunk.fields.items():
                last.fields[name].extend(values)
        else:
            open_chunks[chunk.key] = chunk
            chunks.append(chunk)
    return chunks
