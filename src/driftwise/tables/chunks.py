"""Chunks of exactly so many rows, however a file hands its rows over: results do not depend on the file."""

from __future__ import annotations

from collections.abc import Iterator

CHUNK_ROWS = 65_536


def rechunked(parts, rows: int) -> Iterator[tuple]:
    """Yield tuples of arrays in chunks of exactly so many rows (the last axis), the last shorter, however they came."""
    import numpy as np

    waiting: list[tuple] = []
    held = 0
    for part in parts:
        waiting.append(part)
        held += part[0].shape[-1]
        if held < rows:
            continue
        whole = tuple(np.concatenate(arrays, axis=-1) for arrays in zip(*waiting)) if len(waiting) > 1 else part
        for start in range(0, held - rows + 1, rows):
            yield tuple(array[..., start : start + rows] for array in whole)
        rest = held // rows * rows
        waiting, held = [tuple(array[..., rest:] for array in whole)], held - rest
    if held:
        yield tuple(np.concatenate(arrays, axis=-1) for arrays in zip(*waiting))
