"""Delimited text, block by block: any length in the memory of one block."""

from __future__ import annotations

import re
from codecs import getincrementaldecoder
from collections.abc import Iterator
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.tables.cell_kinds import MISSING
from driftwise.tables.dialect import Dialect, sniff, split
from driftwise.tables.growing import refuse_long
from driftwise.tables.labelled import written_as
from driftwise.tables.marks import plain
from driftwise.tables.source import Source

BLOCK = 1 << 21
HEAD = 1 << 18
PROBES, PROBE = 32, 4096  # places all over a file, and bytes at each, where dates are looked at
LEAST_LINES = 4  # whole lines by which a table is known
LABELLED = 50  # lines by which it is known that each repeats the names of its values
_CLOSING = re.compile(
    r"(average|avg|mean|mittelwert|moyenne|media|median|minimum|min|maximum|max|total|sum|summe|count|std|stdev"
    r"|std\.? ?dev|standard deviation|range|end of (file|data)|eof)[.:]?$",
    re.I,
)
_COMMENT_LINE = re.compile(rb"(?m)^[ \t]*[#%][^\n]*(?:\n|\Z)")


class CsvSource(Source):
    """Rows of a delimited text file or stream, as batches of pyarrow columns.

    Blank lines are skipped (in a file of one column they are missing values), lines that begin with # or %
    are comments. A line with too many or too few cells becomes a row of missing values, counted in `ragged`:
    a sample was taken, only its values are lost. Lines of averages and extremes below the rows are no samples: what
    they begin with is in `closing`.
    """

    def __init__(self, stream, size: int | None = None):
        super().__init__()
        self.size = size
        self._stream = stream
        self._utf16: Any = None  # the decoder of what Excel calls Unicode text
        head = self._bytes(HEAD)
        if head.startswith((b"\xff\xfe", b"\xfe\xff")):
            self._utf16 = getincrementaldecoder("utf-16")("replace")
            head = self._utf16.decode(head).encode()
        if not head.strip(b"\xef\xbb\xbf \t\r\n"):
            raise InputError(
                "the table is empty: it holds no characters. Was the recording ever started, or the pipe cut?"
            )
        _refuse_binary(head)
        while head.count(b"\n") + head.count(b"\r") < LEAST_LINES and (more := self._bytes(len(head))):
            head += more  # a header of many columns is longer than a head
            refuse_long(len(head) - max(head.rfind(b"\n"), head.rfind(b"\r")))
        head = head.removeprefix(b"\xef\xbb\xbf")
        self._old_mac = b"\n" not in head and b"\r" in head
        head = self._line_ends(head)
        lines = head.split(b"\n")
        first = [line.decode("latin-1") for line in lines[:-1][:LABELLED]]
        self._written, named, shown = written_as(first)
        if self._written:
            pattern, plainly = self._written
            lines = [pattern.sub(plainly, line) for line in lines[shown:]]
            lines = [named.encode("latin-1"), *lines] if named else lines  # a row of names, then rows without
        complete = lines[:-1] if len(head) >= HEAD // 2 and len(lines) > 1 else lines
        self.dialect: Dialect = sniff([_decode(line).rstrip("\r") for line in complete])
        if not self.dialect.is_day_known and self.size and self.size > len(head):
            self.dialect = sniff([_decode(line).rstrip("\r") for line in complete], self._probes(len(head), self.size))
        self._rest = b"\n".join(lines[self.dialect.skip :])
        self.names, self.units = self.dialect.names, self.dialect.units
        self.decimal, self.day_first = self.dialect.decimal, self.dialect.day_first
        self.interval = self.dialect.interval
        if not self.dialect.is_day_known:
            order = "day" if self.day_first else "month"
            self.notes = (f"Dates are read with the {order} first: no date of the table tells days from months.",)

    def _read(self, columns):
        for block in self._blocks():
            block = self._tidy(block)
            if block:
                yield self._parse(block, columns)

    def _probes(self, start: int, size: int) -> list[str]:
        """Return lines from all over the file behind its head."""
        if not self._stream.seekable() or self._utf16:
            return []
        place, lines = self._stream.tell(), list[bytes]()
        for k in range(1, PROBES + 1):
            self._stream.seek(max(start + (size - start) * k // PROBES - PROBE, 0))
            lines += self._line_ends(bytes(self._stream.read(PROBE))).split(b"\n")[1:-1]
        self._stream.seek(place)
        return [_decode(line).rstrip("\r") for line in lines]

    def _bytes(self, size: int) -> bytes:
        """Read until `size` bytes or the end: a pipe hands over less at a time."""
        parts = []
        while size > 0:
            part = bytes(self._stream.read(size))
            if not part:
                break
            parts.append(part)
            size -= len(part)
            self.position += len(part)
        whole = b"".join(parts)
        return self._utf16.decode(whole).encode() if self._utf16 else whole

    def _line_ends(self, block: bytes) -> bytes:
        return block.replace(b"\r", b"\n") if self._old_mac else block

    def _blocks(self) -> Iterator[bytes]:
        """Yield blocks of whole lines; blank lines at its end go with the next; the last are dropped."""
        rest, self._rest = self._rest, b""
        while True:
            fresh = self._line_ends(self._bytes(BLOCK))
            buffer = rest + fresh
            if not fresh:
                self._rest = b""
                yield buffer.rstrip(b"\r\n")
                return
            cut = _cut(buffer)
            block = buffer[:cut].rstrip(b"\r\n")
            rest = buffer[len(block) :]
            refuse_long(len(rest))
            if block and rest:  # the line end that belongs to the block
                rest = rest.removeprefix(b"\r").removeprefix(b"\n")
            self._rest = rest
            yield block

    def _tidy(self, block: bytes) -> bytes:
        if self._written:
            block = self._written[0].sub(self._written[1], block)
        block = self._without_closing(block)
        if block.lstrip(b" \t")[:1] in (b"#", b"%") or re.search(rb"\n[ \t]*[#%]", block):
            block = _COMMENT_LINE.sub(b"", block).rstrip(b"\r\n")
        if block.count(b'"') % 2:  # a stray quote would swallow every line up to the next one
            block = b"\n".join(line.replace(b'"', b"") if line.count(b'"') % 2 else line for line in block.split(b"\n"))
        if self.dialect.delimiter == " ":
            block = re.sub(rb"(?m)^[ \t]+|[ \t\r]+$", b"", re.sub(rb"[ \t]+", b" ", block))
        return block

    def _without_closing(self, block: bytes) -> bytes:
        """Return a block without the lines at its end that a spreadsheet works out below the rows."""
        end = cut = len(block)
        found: list[str] = []
        while end > 0:
            start = block.rfind(b"\n", 0, end) + 1
            cells = split(_decode(block[start:end]).strip(), self.dialect.delimiter)
            at = next((j for j, cell in enumerate(cells) if cell), None)
            if at is not None:
                has_words = at >= len(self.names) or self.names[at] in self.dialect.texts | self.dialect.marks.keys()
                if has_words or not _CLOSING.match(cells[at]):
                    break
                found.insert(0, cells[at])
            end, cut = start - 1, start
        if not found:
            return block
        self.closing += tuple(found)
        return block[:cut].rstrip(b"\r\n")

    def _parse(self, block, columns):
        import pyarrow as pa

        block = _utf8(block)
        try:
            return self._table(block, columns, pa.float64())
        except (pa.ArrowInvalid, pa.ArrowKeyError):  # some cell is no number: read text, convert column by column
            return self._table(block, columns, pa.string())

    def _table(self, block, columns, kind):
        import numpy as np
        import pyarrow as pa
        from pyarrow import csv

        bad: list[int] = []

        def skip(row):
            bad.append(row.number - 1)
            return "skip"

        marks = self.dialect.marks
        words = self.dialect.stamps | self.dialect.texts | marks.keys()
        kinds = {name: pa.string() if name in words else kind for name in columns}
        table = csv.read_csv(
            pa.BufferReader(block),
            csv.ReadOptions(column_names=list(self.names), use_threads=False, block_size=len(block) + 1),
            csv.ParseOptions(
                delimiter=self.dialect.delimiter,
                newlines_in_values=b'"' in block,
                ignore_empty_lines=len(self.names) > 1,
                invalid_row_handler=skip,
            ),
            csv.ConvertOptions(
                include_columns=columns,
                column_types=kinds,
                null_values=sorted(MISSING),
                decimal_point=self.decimal,
                check_utf8=False,
            ),
        )
        self.ragged += len(bad)
        arrays = [table[name].combine_chunks() for name in columns]
        arrays = [plain(a, marks[name]) if name in marks else a for name, a in zip(columns, arrays)]
        ragged = np.zeros(table.num_rows + len(bad), bool)
        if bad:  # rows that lost their cells are rows of nulls
            ragged[bad] = True
            where = pa.array(np.cumsum(~ragged) - 1, mask=ragged)
            arrays = [array.take(where) for array in arrays]
        return arrays, ragged


def _cut(buffer: bytes) -> int:
    """Return the length of the part made of whole lines; a line end inside quotes does not count."""
    cut = end = buffer.rfind(b"\n") + 1
    quotes = buffer.count(b'"', 0, cut)
    while quotes % 2 and cut:
        before = buffer.rfind(b"\n", 0, cut - 1) + 1
        quotes -= buffer.count(b'"', before, cut)
        cut = before
    return cut or end


def _decode(line: bytes) -> str:
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")


def _utf8(block: bytes) -> bytes:
    """Return a block in UTF-8; what is not, is Latin-1 (pyarrow decodes the rows it complains of)."""
    if block.isascii():
        return block
    try:
        block.decode()
    except UnicodeDecodeError:
        return block.decode("latin-1").encode()
    return block


def _refuse_binary(head: bytes) -> None:
    if head.startswith(b"PAR1"):
        raise InputError("the table is Parquet, which is read from its end: give the file itself, not a pipe.")
    if head.startswith(b"PK\x03\x04"):
        raise InputError("the table is a zip archive or an Excel workbook; export the sheet as CSV and pass that file.")
    if re.match(rb"\s*(\{|\[\s*[\[{])", head):
        raise InputError("the table is JSON: write its records as CSV (pandas: read_json, then to_csv), a row each.")
    if b"\x00" in head:
        raise InputError(
            "the table is not text: it holds zero bytes. CSV and Parquet can be read; is it another format?"
        )
