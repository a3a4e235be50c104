"""One series as bytes: its row, when it was last heard of, what was counted; versioned, checked, for any machine."""

from __future__ import annotations

import hashlib
import struct
import zlib
from typing import NamedTuple

import numpy as np

from ...engine.errors import InputError

MAGIC, VERSION = b"dws", 1
HEAD = struct.Struct("<3sB8sII")  # magic, version, settings, numbers of the row, samples that wait
COUNTS = "samples", "measured", "late", "duplicate", "bad", "timeless"


class Parcel(NamedTuple):
    """What is known of one series."""

    row: np.ndarray  # (W,) the state
    last: float  # time of the last sample taken, in seconds; -inf before the first
    counts: np.ndarray  # (6,) of COUNTS
    waiting: np.ndarray  # (n, 2 + p + k) samples not yet taken: time, bad, y, u


def digest(estimator) -> bytes:
    """Return eight bytes that tell estimators of other settings, or of another layout of states, apart."""
    kinds = [f"{type(policy).__module__}.{type(policy).__qualname__}" for policy in estimator.policies]
    text = f"{kinds} {estimator.dtype.descr}".encode()
    return hashlib.sha256(text + np.ascontiguousarray(estimator.spec, "<f8").tobytes()).digest()[:8]


def pack(settings: bytes, parcel: Parcel) -> bytes:
    """Return the bytes of a series of an estimator whose `digest` is ``settings``; every bit survives."""
    head = HEAD.pack(MAGIC, VERSION, settings, len(parcel.row), len(parcel.waiting))
    parts = parcel.row, [parcel.last], parcel.counts, parcel.waiting.ravel()
    body = head + b"".join(np.asarray(part, "<f8").tobytes() for part in parts)
    return body + struct.pack("<I", zlib.crc32(body))


def unpack(settings: bytes, blob: bytes) -> Parcel:
    """Return the series that `pack` packed.

    Raises
    ------
    InputError
        Where the bytes are damaged, of a newer version, or of an estimator of other settings.
    """
    blob = bytes(blob)
    if len(blob) < HEAD.size + 4 or blob[:3] != MAGIC:
        raise InputError(f"{len(blob)} bytes are no state of a series. Is it the column `state` of scan_states?")
    _, version, found, width, waiting = HEAD.unpack_from(blob)
    if version > VERSION:
        raise InputError(
            f"a state of version {version}, this driftwise reads up to {VERSION}: update it on all machines"
        )
    if zlib.crc32(blob[:-4]) != struct.unpack("<I", blob[-4:])[0]:
        raise InputError("a state is damaged: its checksum does not fit")
    if found != settings:
        raise InputError("a state belongs to an estimator of other settings: continue with the one it was made by")
    numbers = np.frombuffer(blob, "<f8", offset=HEAD.size, count=(len(blob) - HEAD.size - 4) // 8).astype(np.float64)
    row, rest = numbers[:width], numbers[width:]
    counts, samples = rest[1 : 1 + len(COUNTS)], rest[1 + len(COUNTS) :]
    columns = len(samples) // waiting if waiting else 0
    return Parcel(row, rest[0], counts, samples.reshape(waiting, columns))
