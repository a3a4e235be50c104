"""What the settings of every detector have in common: checked, complete, and in words."""

from __future__ import annotations

import numpy as np

from ..engine.errors import InputError

NEVER = 1e12  # no sum gets so far
SIDES = {"both": (True, True), "up": (True, False), "down": (False, True)}


def each(name, value, size: int = 2) -> np.ndarray:
    """Return positive finite numbers, one for each (up and down), from one for all or one for each."""
    try:
        numbers = np.broadcast_to(np.asarray(value, float), (size,)).copy()
    except (TypeError, ValueError):
        numbers = np.array([np.nan])
    if not (np.isfinite(numbers).all() and np.all(numbers > 0)):
        count = f"one number or {size} of them" if size > 1 else "one number"
        raise InputError(f"{name} must be positive and finite, {count}, got {value!r}")
    return numbers


def reachable(threshold, size: int = 2) -> np.ndarray:
    """Return thresholds, one for each, that a signal can reach."""
    numbers = each("threshold", threshold, size)
    if np.any(numbers > NEVER):
        raise InputError(
            f"threshold must be at most {NEVER:g}, got {threshold!r}: it never alarms. Sums count standard deviations "
            "or logarithms of likelihoods, not units of the signal"
        )
    return numbers


def watched(sides) -> np.ndarray:
    """Return which of (up, down) are watched."""
    if not isinstance(sides, str) or sides not in SIDES:
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
