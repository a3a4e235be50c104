"""Rigs that are not as models have them, drawn from a seed: what a forecast is judged on before any recording."""

from __future__ import annotations

import numpy as np

from . import lasting, loops, plants, runs, unwritten
from .kinds import KINDS

__all__ = ["KINDS", "draw", "lasting", "loops", "plants", "runs", "unwritten"]


def draw(name: str, seed: int, number: int):
    """Return y (T,) and u (T, k) of a record of a kind, by its number."""
    return KINDS[name](np.random.default_rng([seed, number, sum(map(ord, name))]))
