"""Which reader a table takes; what a long one is made of: files of a folder, what its folders' names say, frames."""

from __future__ import annotations

import os
import re
import sys
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from driftwise.engine.errors import InputError
from driftwise.tables.csvfile import CsvSource
from driftwise.tables.jsonfile import is_json, json_source
from driftwise.tables.parquetfile import MemorySource, ParquetSource, ScannedSource
from driftwise.tables.source import Source, damaged, is_stream, refuse_missing, title_of

PARQUET = (".parquet", ".parq", ".pq")
TEXT = (".csv", ".tsv", ".txt", ".dat")
PACKED = (".gz", ".bz2", ".xz", ".zst")
HEAD_BYTES = 64  # by which JSON is known
NO_VALUE = "__HIVE_DEFAULT_PARTITION__"


@dataclass
class Part:
    """A file or frame with rows.

    reader : returns a fresh one; given the column of keys, a file says what is written there, not a number it reads
    fixed : columns that are the same for all rows, which the names of the folders say
    size : bytes or rows, for progress
    """

    title: str
    reader: Callable[[str | None], Any]
    fixed: dict[str, Any] = field(default_factory=dict)
    size: int = 1


def parts_of(source) -> tuple[list[Part], list[str]]:
    """Return what a source is made of, in order, and the files of its folder that are passed over."""
    import pyarrow.dataset as ds

    if isinstance(source, str | Path):
        return _of_folder(Path(source)) if os.path.isdir(source) else ([_of_file(source)], [])
    if isinstance(source, list | tuple):
        if not source:
            raise InputError("the list of files is empty. Did a pattern match nothing?")
        return [_of_file(path) for path in source], []
    if isinstance(source, ds.Dataset):
        return [Part("the dataset", lambda by: ScannedSource(source))], []
    table = MemorySource(source)
    what = "mapping" if isinstance(source, Mapping) else "data frame"

    def rewound(by):
        table.position = 0
        return table

    return [Part(f"the {what}", rewound)], []


def source_of(data) -> Source:
    """Return the reader of a file ("-" for standard input), of a data frame, or of a mapping from name to array."""
    if not isinstance(data, str | Path):
        return MemorySource(data)
    source = _opened(data)
    source.title = title_of(data)
    return source


def _opened(data) -> Source:
    """Return the reader of a file; what is wrong with it is told by its name."""
    import pyarrow as pa

    try:
        if str(data) == "-":
            if sys.stdin is None:
                raise InputError("standard input is closed: nothing can be read from it.")
            peek = getattr(sys.stdin.buffer, "peek", None)
            is_records = peek is not None and is_json(peek(HEAD_BYTES))
            return json_source(sys.stdin.buffer) if is_records else CsvSource(sys.stdin.buffer)
        refuse_missing(data)
        if is_stream(data):
            stream = open(data, "rb", buffering=0)
            source = CsvSource(stream)
            weakref.finalize(source, stream.close)
            return source
        if _is_parquet(data):
            return ParquetSource(data)
        with pa.input_stream(str(data)) as first:
            if is_json(bytes(first.read(HEAD_BYTES))):
                return json_source(pa.input_stream(str(data)))
        packed = pa.input_stream(str(data))
        is_packed = type(packed).__name__ == "CompressedInputStream"
        return CsvSource(packed, None if is_packed else os.path.getsize(data))
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(str(data)) else f"{title_of(data)}: {text}") from None
    except OSError as error:
        raise InputError(f"{title_of(data)}: {damaged(error)}") from None


def _is_parquet(path) -> bool:
    with open(path, "rb") as file:
        return file.read(4) == b"PAR1"


def _of_file(path, fixed=None) -> Part:
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"a list of files holds file names, got {path!r}. Give one data frame, or files")
    if is_stream(path):
        raise InputError(f"a fleet reads its table more than once: {title_of(path)} will not do, give a file")
    refuse_missing(path)
    is_parquet = str(path).lower().endswith(PARQUET)
    return Part(str(path), lambda by: _reader(path, by, is_parquet), fixed or {}, max(os.path.getsize(path), 1))


def _reader(path, by, is_parquet):
    """Return a reader of a file, keys as they are written."""
    if _is_parquet(path):
        return ParquetSource(path, words=[by] if by else (), least=0)
    if is_parquet:
        raise InputError("it is called Parquet but is none. Was the copy cut short?")
    source = source_of(path)
    if isinstance(source, CsvSource) and by:
        source.dialect = replace(source.dialect, texts=source.dialect.texts | {by})
    return source


def _of_folder(folder: Path) -> tuple[list[Part], list[str]]:
    """Return the tables of a folder and all below it, names with numbers in them in the order of these."""
    files = [
        Path(root, name)
        for root, folders, names in os.walk(folder, followlinks=True)
        if not any(part.startswith((".", "_")) for part in Path(root).relative_to(folder).parts)
        for name in names
        if not name.startswith((".", "_"))
    ]
    files.sort(key=lambda path: _natural(path.relative_to(folder)))
    for endings in (PARQUET, TEXT):
        tables = [path for path in files if _bare(path).endswith(endings)]
        if tables:
            fixed = _fixed(folder, tables)
            others = [str(path) for path in files if path not in set(tables)]
            return [_of_file(*pair) for pair in zip(tables, fixed)], others
    there = ", ".join(path.name for path in files[:5]) or "nothing"
    raise InputError(f"{folder} holds no table: files called {', '.join(PARQUET + TEXT)} are read, there is {there}.")


def _bare(path: Path) -> str:
    """Return a file's name in small letters without the ending of a packed one."""
    name = path.name.lower()
    return next((name[: -len(ending)] for ending in PACKED if name.endswith(ending)), name)


def _natural(path: Path):
    """Return what sorts part-2 before part-10."""
    return [
        [(int(piece), "") if piece.isdigit() else (-1, piece) for piece in re.split(r"(\d+)", step)]
        for step in path.parts
    ]


def _fixed(folder: Path, tables: list[Path]) -> list[dict[str, Any]]:
    """Return what the folders between say of each file, asset=7: whole numbers where all values are."""
    fixed: list[dict[str, Any]] = []
    for path in tables:
        steps = [step.partition("=") for step in path.relative_to(folder).parts[:-1]]
        fixed.append({unquote(name): unquote(value) for name, equals, value in steps if equals})
    for name in {name for pairs in fixed for name in pairs}:
        values = {pairs[name] for pairs in fixed if name in pairs} - {NO_VALUE}
        is_whole = all(re.fullmatch(r"-?(0|[1-9]\d{0,17})", value) for value in values)
        for pairs in fixed:
            if name in pairs:
                value = pairs[name]
                pairs[name] = None if value == NO_VALUE else int(value) if is_whole else value
    return fixed
