"""Columns whose numbers are very large or very small, counted in a power of ten."""

from __future__ import annotations

USUAL = 30  # powers of ten: sizes of numbers beyond, either way, are counted in a unit of their own


def ten_of(values) -> int:
    """Return the power of ten that the numbers of a column are counted in: 0 unless they are beyond `USUAL`.

    Fourth powers, and the inverse of products of them, then stay within doubles whatever the unit of a file is.
    """
    import numpy as np

    sizes = np.abs(values[np.isfinite(values) & (values != 0)])
    ten = int(np.floor(np.log10(np.median(sizes)))) if sizes.size else 0
    return ten if abs(ten) > USUAL else 0


def in_tens(values, ten: int):
    """Return numbers in units of a power of ten."""
    half = ten // 2
    return values / 10.0**half / 10.0 ** (ten - half) if ten else values
