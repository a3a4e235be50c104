"""Numbers as people write them."""

from __future__ import annotations

from math import floor, isfinite, log10

__all__ = ["fixed", "interval", "number", "plus_minus"]


def number(value: float, digits: int = 6) -> str:
    """Return `value` with at most `digits` significant digits and no needless zeros."""
    return _minus(f"{float(value):.{digits}g}")


def fixed(value: float, places: int) -> str:
    """Return `value` with so many decimals, or in powers of ten where that would be long."""
    return _minus(f"{value:.{places}f}" if abs(value) < 10_000 else f"{value:.2g}")


def plus_minus(value: float, std: float) -> str:
    """Return "value ± std" with the digits that the standard error leaves meaningful.

    >>> plus_minus(1.694538, 0.02041)
    '1.695 ± 0.020'
    """
    spec = _spec(value, std)
    return _minus(f"{value:{spec}} \u00b1 {std:{spec if spec.endswith('f') else '.2g'}}")


def interval(value: float, std: float) -> str:
    """Return the ends of two standard errors either side of `value`."""
    spec = _spec(value, std)
    return _minus(f"{value - 2 * std:{spec}} \u2026 {value + 2 * std:{spec}}")


def _spec(value: float, std: float) -> str:
    if not (isfinite(value) and isfinite(std) and std > 0):
        return ".6g"
    places = 1 - floor(log10(std))
    return f".{max(places, 0)}f" if -3 <= places <= 7 else ".6g"


def _minus(text: str) -> str:
    """Return the text with real minus signs before numbers (exponents keep the hyphen)."""
    return " ".join("\u2212" + word[1:] if word.startswith("-") else word for word in text.split(" "))
