"""Columns of numbers and words in a Parquet file: every bit survives, or the file is refused."""

from __future__ import annotations

import hashlib
import json
from typing import Any

import numpy as np

from ..engine.atomic import replaced
from ..engine.errors import InputError
from ..engine.saved import reading

HEADER, CHECKSUM = b"driftwise.header", b"driftwise.sha256"
SLICE = 1 << 22  # bytes written and read at a time
OPTIONS: Any = dict(compression="none", use_dictionary=False, write_statistics=False, write_page_checksum=True)

Words = dict[str, list[str]]
Numbers = dict[str, np.ndarray]


def write(path, header: dict, words: Words, numbers: Numbers, loose: Numbers | None = None) -> str:
    """Write columns of equal length, numbers (S,) or (S, c), in place of what was there; return the checksum.

    The header (JSON) has a ``schema``. Arrays of any other shape are ``loose``: dealt out over the rows, which must
    then be. Needs the memory of a slice besides what is handed over.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    loose = loose or {}
    text = json.dumps(header | {"loose": {name: [v.dtype.str, v.shape] for name, v in loose.items()}})
    checksum = _digest(text, words, numbers | loose)
    types = [(name, pa.string()) for name in words] + [(name, _type(values)) for name, values in numbers.items()]
    types += [(name, pa.list_(pa.from_numpy_dtype(_plain(values).dtype))) for name, values in loose.items()]
    schema = pa.schema(types).with_metadata({HEADER: text, CHECKSUM: checksum})
    size = len(next(iter(numbers.values())))
    step = _rows_a_slice(size, numbers | loose)
    with replaced(path) as beside, pq.ParquetWriter(beside, schema, **OPTIONS) as writer:
        for first in range(0, size, step):
            part = slice(first, min(first + step, size))
            arrays = [pa.array(values[part], pa.string()) for values in words.values()]
            arrays += [_arrow(values[part]) for values in numbers.values()]
            arrays += [_dealt(_plain(values), part, size) for values in loose.values()]
            writer.write_batch(pa.record_batch(arrays, schema=schema))
    return checksum


def read(path, newest: int) -> tuple[dict, Words, Numbers, Numbers]:
    """Return what was written; refuse a file that is not whole, or of a later schema than ``newest``."""
    import pyarrow.parquet as pq

    with reading(path, "Fleet.save"):
        with pq.ParquetFile(path, pre_buffer=False, buffer_size=1 << 20, page_checksum_verification=True) as file:
            text, checksum = _facts(file)
            header = json.loads(text)
            _readable(header["schema"], newest)
            words, numbers, loose = _columns(file, header.pop("loose", {}))
        if _digest(text, words, numbers | loose) != checksum:
            raise InputError("it is not as it was written, its checksum differs. Was it altered, or is the disk bad?")
    return header, words, numbers, loose


def _facts(file) -> tuple[str, str]:
    """Return header and checksum of an open file."""
    facts = file.schema_arrow.metadata or {}
    if HEADER not in facts or CHECKSUM not in facts:
        raise InputError("it is a Parquet file, but not one that Fleet.save wrote. Is it the data?")
    return facts[HEADER].decode(), facts[CHECKSUM].decode()


def _readable(schema, newest) -> None:
    """Refuse a file of a later schema."""
    if schema > newest:
        raise InputError(f"it was written with schema {schema}, this version reads up to {newest}: update driftwise")


def _columns(file, shapes) -> tuple[Words, Numbers, Numbers]:
    """Return all columns of an open file, read slice by slice; ``shapes`` are types and shapes of the loose ones."""
    import pyarrow as pa

    size = file.metadata.num_rows
    words: Words = {}
    numbers: Numbers = {}
    loose = {name: np.empty(shape, dtype) for name, (dtype, shape) in shapes.items()}
    for field in file.schema_arrow:
        kind = field.type
        if kind == pa.string():
            words[field.name] = []
        elif pa.types.is_fixed_size_list(kind):
            numbers[field.name] = np.empty((size, kind.list_size), kind.value_type.to_pandas_dtype())
        elif field.name not in loose:
            numbers[field.name] = np.empty(size, kind.to_pandas_dtype())
    at, dealt = 0, dict.fromkeys(loose, 0)
    for batch in file.iter_batches(_rows_a_slice(size, numbers | loose), use_threads=False):
        for name, texts in words.items():
            texts += batch.column(name).to_pylist()
        for name, column in numbers.items():
            found, part = batch.column(name), column[at : at + len(batch)]
            part[...] = (found.flatten() if column.ndim > 1 else found).to_numpy().reshape(part.shape)
        for name, values in loose.items():
            flat = batch.column(name).flatten().to_numpy()
            _plain(values)[dealt[name] : dealt[name] + len(flat)] = flat
            dealt[name] += len(flat)
        at += len(batch)
    return words, numbers, loose


def _plain(values) -> np.ndarray:
    """Return a contiguous array as one line of numbers; truth values as integers, which Arrow takes as they are."""
    return values.reshape(-1).view(np.uint8) if values.dtype == bool else values.reshape(-1)


def _dealt(values, part: slice, size: int):
    """Return the share of a loose array that belongs to the rows of a slice, out of so many."""
    import pyarrow as pa

    ends = np.arange(part.start, part.stop + 1) * len(values) // size
    share = pa.array(np.ascontiguousarray(values[ends[0] : ends[-1]]))
    return pa.ListArray.from_arrays(pa.array((ends - ends[0]).astype(np.int32)), share)


def _rows_a_slice(size: int, columns: Numbers) -> int:
    return max(1, SLICE * size // max(1, sum(column.nbytes for column in columns.values())))


def _type(column):
    """Return the type of a column in the file."""
    import pyarrow as pa

    kind = pa.from_numpy_dtype(column.dtype)
    return kind if column.ndim == 1 else pa.list_(kind, column.shape[1])


def _arrow(column):
    """Return a stretch of a column as the file takes it; nothing is copied."""
    import pyarrow as pa

    flat = pa.array(np.ascontiguousarray(column).reshape(-1))
    return flat if column.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, column.shape[1])


def _digest(text: str, words: Words, numbers: Numbers) -> str:
    """Return the SHA-256 of all that a file says."""
    total = hashlib.sha256(json.dumps([text, words]).encode())
    for name, column in numbers.items():
        total.update(f"{name} {column.dtype.str} {column.shape}".encode())
        column = np.atleast_1d(column)
        step = _rows_a_slice(len(column), {name: column})
        for first in range(0, len(column), step):
            total.update(np.ascontiguousarray(column[first : first + step]).data)
    return total.hexdigest()
