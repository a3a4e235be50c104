"""What this machine can do at most, measured by ``peaks.c``."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import NamedTuple

import numpy as np

from .compiler import NATIVE, library, pointer

KINDS = ("sum", "product", "division", "root", "logarithm")
SLOW = KINDS[2:]
SIZES = {"L1": 20_000, "L2": 400_000, "L3": 6_000_000, "memory": 400_000_000}  # bytes of three arrays
ROUNDS = 3  # the best of them counts: a limit is what the machine did once


class Peaks(NamedTuple):
    """Limits of one core."""

    scalar: float  # products and sums per second, one number at a time, not fused
    vector: float  # the same, as many numbers as a register takes, fused
    latency: dict[str, float]  # seconds until the result of an operation may be used
    interval: dict[str, float]  # seconds until the next slow operation may begin
    lane: float  # the same of a division, eight at once, over eight
    bandwidth: dict[str, float]  # bytes per second, by where the numbers lie


@cache
def peaks() -> Peaks:
    """Return the limits, or raise what compiling raises."""
    c = library("peaks.c", NATIVE, "-ffp-contract=off")
    for name in ("scalar_rate", "vector_rate", "latency", "interval", "lane_interval", "triad_rate"):
        getattr(c, name).restype = ctypes.c_double
    many, few = ctypes.c_long(3_000_000), ctypes.c_long(300_000)
    return Peaks(
        max(c.scalar_rate(many) for _ in range(ROUNDS)),
        max(c.vector_rate(many) for _ in range(ROUNDS)),
        {name: min(c.latency(i, many) for _ in range(ROUNDS)) for i, name in enumerate(KINDS)},
        {name: min(c.interval(KINDS.index(name), few) for _ in range(ROUNDS)) for name in SLOW},
        min(c.lane_interval(few) for _ in range(ROUNDS)),
        {name: max(_triad(c, size // 24) for _ in range(ROUNDS)) for name, size in SIZES.items()},
    )


def _triad(c, n: int) -> float:
    a, b, s = np.zeros(n), np.ones(n), np.ones(n)
    return c.triad_rate(*map(pointer, (a, b, s)), ctypes.c_long(n), ctypes.c_long(max(2, 40_000_000 // n)))
