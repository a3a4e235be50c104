"""Numbers, odds, counts and instants as people write them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from math import floor, isfinite, log10
from typing import Any

SECONDS, SAMPLES = "s", "samples"  # what time is counted in: the latter where there is no clock
MOST_ODDS = 1e6  # beyond them odds are no longer told apart


def number(value: float, digits: int = 6) -> str:
    """Return `value` with at most `digits` significant digits, no needless zeros, and no power of ten below a million.

    >>> number(1559.6, 3), number(0.12345, 2)
    ('1560', '0.12')
    """
    text = f"{float(value):z.{digits}g}"
    return _minus(f"{float(text):.0f}" if "e+" in text and abs(value) < 1e6 else text)


def plain(value: float, places: int) -> str:
    """Return `value` with so many decimals, with three digits where it is large, and in words where nobody reads it.

    >>> plain(0.928, 2), plain(26_843.7, 2), plain(-218606731.3, 1), plain(3.1e6, 2)
    ('0.93', '26800', 'far below 0', '> 1 million')
    """
    if abs(value) >= 999_500:
        return "> 1 million" if value > 0 else "far below 0"
    return f"{value:z.{places}f}" if abs(value) < 10_000 else f"{float(f'{value:.3g}'):.0f}"


def fixed(value: float, places: int) -> str:
    """Return `value` as `plain` does, with a real minus sign; a dash where it is not known."""
    return "\u2013" if value != value else _minus(plain(value, places))


def plus_minus(value: float, std: float) -> str:
    """Return "value ± std" with the digits that the standard error leaves meaningful.

    >>> plus_minus(1.694538, 0.02041)
    '1.695 ± 0.020'
    """
    spec = _spec(value, std)
    if spec.endswith("f") or not (isfinite(value) and isfinite(std) and std > 0):
        return _minus(f"{value:{spec}} \u00b1 {std:{spec if spec.endswith('f') else '.2g'}}")
    digits = floor(log10(max(abs(value), std))) - floor(log10(std)) + 1  # as many after the point as std has two of
    return _minus(f"{value:z.{digits}e} \u00b1 {std:.1e}")


def interval(value: float, std: float) -> str:
    """Return the ends of two standard errors either side of `value`."""
    spec = _spec(value, std)
    return _minus(f"{value - 2 * std:{spec}} \u2026 {value + 2 * std:{spec}}")


def bound(std: float) -> str:
    """Return a standard deviation with two digits, in words where it is infinite."""
    return number(std, 2) if isfinite(std) else "no bound"


def complex_number(value: complex) -> str:
    """Return a root with four digits; one with an imaginary part stands for its conjugate, too."""
    real = number(value.real, 4)
    return real if abs(value.imag) < 1e-12 else f"{real} ± {number(abs(value.imag), 4)} j"


def near_one(low: float, high: float, between: str) -> str:
    """Return an interval about 1 with the decimals it takes to tell its ends apart."""
    places = 2 if high - low > 0.02 else 4
    return f"{fixed(low, places)}{between}{fixed(high, places)}"


def percent(share: float) -> str:
    """Return a share in percent, two digits where that is less than all.

    >>> percent(0.333), percent(0.0012), percent(0.997)
    ('33 %', '0.12 %', '100 %')
    """
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"


# --- probabilities and odds ----------------------------------------------------------------------------------


def probable(p: float) -> str:
    """Return a probability with the digits that matter."""
    return "0" if p < 1e-12 else f"{p:.0e}" if p < 1e-3 else f"{p:.3f}"


def chance(p: float, digits: int = 1) -> str:
    """Return a p-value as one says it.

    >>> chance(0.0123, 2), chance(3e-154)
    ('p = 0.012', 'p below 0.0001')
    """
    return f"p = {p:.{digits}g}" if p >= 1e-4 else "p below 0.0001"


def odds_words(odds: float) -> str:
    """Return odds as one writes them."""
    return "beyond a million to one" if odds > MOST_ODDS else f"{odds:.0f}:1"


# --- counts and lists ----------------------------------------------------------------------------------------


def grouped(count: float, least: int = 0, space: str = "\u2009") -> str:
    """Return a count with thin spaces between thousands, from ``least`` on.

    >>> grouped(1234567, space=" "), grouped(1000, 10_000)
    ('1 234 567', '1000')
    """
    return f"{count:,.0f}".replace(",", space) if count >= least else f"{count:.0f}"


def ordinal(n: int) -> str:
    """Return "first", "second", "third", "4th", .. "11th", "63rd"."""
    if n in (1, 2, 3):
        return ("first", "second", "third")[n - 1]
    last = "th" if 10 < n % 100 < 14 else {1: "st", 2: "nd", 3: "rd"}.get(n % 10, "th")
    return f"{n}{last}"


def article(n: int) -> str:
    """Return "A", or "An" before eight, eleven, eighteen and eighty of something."""
    return "An" if n in (8, 11, 18) or 80 <= n < 90 else "A"


def count_of(count: int, what: str) -> str:
    """Return how many there are of something.

    >>> count_of(1, "gap"), count_of(3, "gap")
    ('1 gap', '3 gaps')
    """
    return f"{count} {what}{'' if count == 1 else 's'}"


def with_unit(name: str, unit: str | None) -> str:
    """Return a name, its unit behind it where it has one."""
    return f"{name} ({unit})" if unit else name


def often(count: int) -> str:
    """Return how often something happened: once, twice, 3 times."""
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def listed(items: Sequence[str]) -> str:
    """Return things in a row: a, b and c."""
    return items[0] if len(items) == 1 else ", ".join(items[:-1]) + " and " + items[-1]


def capital(text: str) -> str:
    """Return the text with a capital at its beginning."""
    return text[:1].upper() + text[1:]


def sentence(text: str) -> str:
    """Return the text with a capital at its beginning and a full stop at its end."""
    return capital(text).rstrip(".") + "."


# --- time ----------------------------------------------------------------------------------------------------


def lasting(seconds: float, unit: str = SECONDS) -> str:
    """Return a time span in the unit one would use; of a span in another unit than seconds, that one.

    >>> lasting(1.7994), lasting(86400), lasting(0.002), lasting(86400, SAMPLES)
    ('1.8 s', '1 d', '0.002 s', '8.64e+04 samples')
    """
    if unit != SECONDS:
        return f"{seconds:.3g} {unit}"
    name, size = usual_unit(seconds)
    return f"{seconds / size:.3g} {name}"


def usual_unit(seconds: float) -> tuple[str, float]:
    """Return the unit one would use for a time span, and its seconds.

    >>> usual_unit(1.8), usual_unit(7200)
    (('s', 1), ('h', 3600))
    """
    units = ("a", 365.25 * 86400, 2), ("d", 86400, 1), ("h", 3600, 2), ("min", 60, 5)
    return next(((name, size) for name, size, least in units if seconds >= least * size), ("s", 1))


def reading(time: float) -> str:
    """Return what a clock shows: of a long one all digits before the point, for the last are what tells times apart."""
    return f"{time:.6g}" if abs(time) < 1e6 else f"{time:.0f}"


def instant(seconds: float, origin: str | None, unit: str = SECONDS) -> str:
    """Return a time as it is written: seconds, or a date where the time stamp of second 0 is known, or a sample.

    >>> instant(86400 * 30.5, "2011-11-26"), instant(2.5, None), instant(1144130060.0, None)
    ('2011-12-26 12:00:00', '2.5 s', '1144130060 s')
    """
    if origin is None:
        return f"{reading(seconds)} s" if unit == SECONDS else f"sample {seconds:.0f}"
    import numpy as np

    stamp = np.datetime64(origin, "ms") + np.timedelta64(round(1000 * seconds), "ms")
    return str(stamp).replace("T", " ").removesuffix(".000").removesuffix(" 00:00:00")


# --- digits --------------------------------------------------------------------------------------------------


def _spec(value: float, std: float) -> str:
    if not (isfinite(value) and isfinite(std) and std > 0):
        return "z.6g"
    places = 1 - floor(log10(std))
    return f"z.{max(places, 0)}f" if -3 <= places <= 7 else "z.6g"


def _minus(text: str) -> str:
    """Return the text with real minus signs before numbers (exponents keep the hyphen)."""
    return " ".join("\u2212" + word[1:] if word.startswith("-") else word for word in text.split(" "))


def finite(value: Any) -> Any:
    """Return what JSON can hold: None for each number that is not finite."""
    if isinstance(value, dict):
        return {name: finite(one) for name, one in value.items()}
    if isinstance(value, list):
        return [finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
