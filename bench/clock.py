"""Honest clocks: CPU time, alternated, medians."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np


def cpu(function: Callable[[], object]) -> float:
    """Return the CPU seconds of one call."""
    start = time.process_time()
    function()
    return time.process_time() - start


def alternate(*functions: Callable[[], object], rounds: int = 15) -> np.ndarray:
    """Return CPU seconds (rounds, functions), run A B A B after one call of each to warm up."""
    from driftwise.engine import objects

    for function in functions:
        function()
    objects.wait()  # what an optimising compiler makes takes over
    return np.array([[cpu(function) for function in functions] for _ in range(rounds)])


def ratio(ours: Callable[[], object], theirs: Callable[[], object], rounds: int = 15) -> tuple[float, float, float]:
    """Return the median ratio ours / theirs of alternated rounds, and both medians in seconds."""
    seconds = alternate(ours, theirs, rounds=rounds)
    mine, other = np.median(seconds, axis=0)
    return float(np.median(seconds[:, 0] / seconds[:, 1])), float(mine), float(other)
