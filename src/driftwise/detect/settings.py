"""What the settings of every detector have in common: checked, complete, and in words."""

from __future__ import annotations

import numpy as np

from ..errors import InputError

SIDES = {"both": (True, True), "up": (True, False), "down": (False, True)}


def each(name, value, size: int = 2) -> np.ndarray:
    """Return positive finite numbers, one for each (up and down), from one for all or one for each."""
    try:
        numbers = np.broadcast_to(np.asarray(value, float), (size,)).copy()
    except (TypeError, ValueError):
        numbers = np.array([np.nan])
    if not (np.isfinite(numbers).all() and np.all(numbers > 0)):
        raise InputError(f"{name} must be positive and finite, one number or {size} of them, got {value!r}")
    return numbers


def watched(sides) -> np.ndarray:
    """Return which of (up, down) are watched."""
    if sides not in SIDES:
        raise InputError(f"sides must be 'both', 'up' or 'down', got {sides!r}")
    return np.array(SIDES[sides])


def together(run_lengths) -> float:
    """Return the mean run length of several sums: their rates add up (the sums hardly ever alarm together)."""
    return float(1.0 / np.sum(1.0 / np.asarray(run_lengths, float)))


def rate_words(run_length, how: str) -> str:
    """Return a mean number of samples between false alarms as words."""
    return f"one false alarm per {_round(run_length)} samples on average ({how})"


def delay_words(jump, delay) -> str:
    """Return how soon a shift is found as words."""
    return f"a shift of {jump:g} sd is found after {delay:.1f} samples"


def _round(number: float) -> str:
    return f"{float(f'{number:.3g}'):,.0f}".replace(",", " ") if number < 1e15 else f"{number:.1e}"
