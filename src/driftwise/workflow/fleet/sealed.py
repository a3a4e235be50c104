"""Columns of numbers and words in a Parquet file that knows whether it is whole: every bit survives, or it is refused."""

from __future__ import annotations

import hashlib
import json
from typing import Any

import numpy as np

from ...errors import InputError
from ..atomic import replaced

HEADER, CHECKSUM = b"driftwise.header", b"driftwise.sha256"
SLICE = 1 << 22  # bytes written and read at a time
OPTIONS: Any = dict(compression="none", use_dictionary=False, write_statistics=False, write_page_checksum=True)

Words = dict[str, list[str]]
Numbers = dict[str, np.ndarray]


def write(path, header: dict, words: Words, numbers: Numbers) -> str:
    """Write columns of equal length, numbers (S,) or (S, c), in place of what was there; return the checksum.

    The header (JSON) has a ``schema``. Needs the memory of a slice besides the columns.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    text = json.dumps(header)
    checksum = _digest(text, words, numbers)
    types = [(name, pa.string()) for name in words] + [(name, _type(values)) for name, values in numbers.items()]
    schema = pa.schema(types).with_metadata({HEADER: text, CHECKSUM: checksum})
    size, step = len(next(iter(numbers.values()))), _rows_a_slice(numbers)
    with replaced(path) as beside, pq.ParquetWriter(beside, schema, **OPTIONS) as writer:
        for first in range(0, size, step):
            part = slice(first, first + step)
            arrays = [pa.array(values[part], pa.string()) for values in words.values()]
            arrays += [_arrow(values[part]) for values in numbers.values()]
            writer.write_batch(pa.record_batch(arrays, schema=schema))
    return checksum


def read(path, newest: int) -> tuple[dict, Words, Numbers]:
    """Return header, words and numbers; refuse a file that is not whole, or of a later schema than ``newest``."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(path, pre_buffer=False, buffer_size=1 << 20, page_checksum_verification=True) as file:
            text, checksum = _facts(file, path)
            _readable(json.loads(text)["schema"], newest, path)
            words, numbers = _columns(file)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file. Was it saved elsewhere?") from None
    except InputError:
        raise
    except (pa.ArrowException, OSError, ValueError, LookupError, MemoryError) as error:
        raise InputError(f"{path} cannot be read ({error}). Was the copy cut short, or is it another file?") from None
    if _digest(text, words, numbers) != checksum:
        raise InputError(f"{path} is not as it was written: its checksum differs. Was it altered, or is the disk bad?")
    return json.loads(text), words, numbers


def _facts(file, path) -> tuple[str, str]:
    """Return header and checksum of an open file."""
    facts = file.schema_arrow.metadata or {}
    if HEADER not in facts or CHECKSUM not in facts:
        raise InputError(f"{path} is a Parquet file, but not one that Fleet.save wrote. Is it the data?")
    return facts[HEADER].decode(), facts[CHECKSUM].decode()


def _readable(schema, newest, path) -> None:
    """Refuse a file of a later schema."""
    if schema > newest:
        raise InputError(f"{path} was written with schema {schema}, this version reads up to {newest}: update driftwise")


def _columns(file) -> tuple[Words, Numbers]:
    """Return all columns of an open file, read slice by slice."""
    import pyarrow as pa

    size, words, numbers = file.metadata.num_rows, {}, {}
    for field in file.schema_arrow:
        kind = field.type
        if kind == pa.string():
            words[field.name] = []
        elif pa.types.is_fixed_size_list(kind):
            numbers[field.name] = np.empty((size, kind.list_size), kind.value_type.to_pandas_dtype())
        else:
            numbers[field.name] = np.empty(size, kind.to_pandas_dtype())
    at = 0
    for batch in file.iter_batches(_rows_a_slice(numbers), use_threads=False):
        for name, values in words.items():
            values += batch.column(name).to_pylist()
        for name, column in numbers.items():
            found, part = batch.column(name), column[at : at + len(batch)]
            part[...] = (found.flatten() if column.ndim > 1 else found).to_numpy().reshape(part.shape)
        at += len(batch)
    return words, numbers


def _rows_a_slice(numbers) -> int:
    return max(1, SLICE // sum(column.itemsize * int(np.prod(column.shape[1:])) for column in numbers.values()))


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
        total.update(np.ascontiguousarray(column).data)
    return total.hexdigest()
