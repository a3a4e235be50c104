"""Series as a store keeps them, and back."""

from __future__ import annotations

import numpy as np

from ..engine.errors import InputError
from .rows import Rows
from .series import Series
from .store.base import Group, Member, RowBytes


def packed(rows: Rows, members: list[int], codes: set[int]) -> list[RowBytes]:
    """Return the series of these codes, of those that have shown a sample; ``members`` are their numbers by code."""
    at = np.array(sorted(code for code in codes if code < len(rows.fleet)), np.int64)
    if not len(at):
        return []
    numbers, held = rows.rows(at)
    none = np.zeros(0)
    return [
        RowBytes(members[code], numbers[i].tobytes(), held.get(code, none).tobytes())
        for i, code in enumerate(at.tolist())
    ]


def listed(series: Series) -> Member:
    """Return a series as a store lists it."""
    return Member(series.number, series.key, series.group, series.code)


def unpacked(group: Group, members: list[Series], kept: dict[int, RowBytes]) -> Rows:
    """Return a group as it was kept; series that have shown no sample yet wait behind the others."""
    there = [one for one in members if one.number in kept]
    packed = [kept[one.number] for one in there]
    options = group.options
    numbers = (
        np.frombuffer(b"".join(row.row for row in packed)).reshape(len(packed), -1) if packed else np.zeros((0, 1))
    )
    held = {i: np.frombuffer(row.held) for i, row in enumerate(packed) if row.held}
    rows = Rows.restored(group.settings, [one.key for one in there], numbers, held, **options)
    for one in members[len(there) :]:
        rows.add(one.key)
    if rows.fields != group.fields:
        raise InputError(f"the states of {group.words} were written by another version, and cannot be gone on with")
    return rows
