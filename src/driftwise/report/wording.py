"""Numbers as people write them."""

from __future__ import annotations

from math import floor, isfinite, log10

from driftwise.results.verdicts import plain

__all__ = ["fixed", "interval", "near_one", "number", "plus_minus", "probable", "zeros_told"]


def number(value: float, digits: int = 6) -> str:
    """Return `value` with at most `digits` significant digits, no needless zeros, and no power of ten below a million.

    >>> number(1559.6, 3), number(0.12345, 2)
    ('1560', '0.12')
    """
    text = f"{float(value):z.{digits}g}"
    return _minus(f"{float(text):.0f}" if "e+" in text and abs(value) < 1e6 else text)


def fixed(value: float, places: int) -> str:
    """Return `value` with so many decimals as far as that is read; a dash where it is not known."""
    return "\u2013" if value != value else _minus(plain(value, places))


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


def near_one(low: float, high: float, between: str) -> str:
    """Return an interval about 1 with the decimals it takes to tell its ends apart."""
    places = 2 if high - low > 0.02 else 4
    return f"{fixed(low, places)}{between}{fixed(high, places)}"


def probable(p: float) -> str:
    """Return a probability with the digits that matter."""
    return "0" if p < 1e-12 else f"{p:.0e}" if p < 1e-3 else f"{p:.3f}"


def zeros_told(model, input: int) -> list[tuple[complex, float]]:
    """Return (zero, std) of an input, without those that the orders themselves put at 0 or at infinity."""
    pairs = zip(model.zeros(input), model.zeros_std(input))
    return [(z, std) for z, std in pairs if isfinite(abs(z)) and (z != 0 or std > 0)]


def _spec(value: float, std: float) -> str:
    if not (isfinite(value) and isfinite(std) and std > 0):
        return "z.6g"
    places = 1 - floor(log10(std))
    return f"z.{max(places, 0)}f" if -3 <= places <= 7 else "z.6g"


def _minus(text: str) -> str:
    """Return the text with real minus signs before numbers (exponents keep the hyphen)."""
    return " ".join("\u2212" + word[1:] if word.startswith("-") else word for word in text.split(" "))
