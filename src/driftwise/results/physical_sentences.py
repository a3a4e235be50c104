"""What is said of physical parameters: values with units, jumps, what a record cannot tell, and what not to believe."""

from __future__ import annotations

import math

from .numbers import count_of, instant, number, percent, plus_minus


def valued(value: float, std: float, unit: str) -> str:
    """Return a value with its deviation and its unit.

    >>> valued(12.31, 0.42, "s")
    '12.31 ± 0.42 s'
    """
    return f"{plus_minus(value, std)} {unit}".strip()


def within(name: str, value: float, ends: tuple[float, float], unit: str) -> str:
    """Return a parameter with the ends of its interval.

    >>> within("R0", 0.0201, (0.0199, 0.0203), "Ohm")
    'R0 = 0.0201 Ohm (0.0199 … 0.0203)'
    """
    low, high = ends
    digits = 3 if not high > low else min(max(3, 1 - math.floor(math.log10((high - low) / abs(value or 1.0)))), 9)
    return f"{name} = {number(value, digits)} {unit}".strip() + f" ({number(low, digits)} … {number(high, digits)})"


def moved_words(name: str, before: float, after: float, unit: str, is_positive: bool) -> str:
    """Return which parameter jumped, and by how much: positive ones in percent.

    >>> moved_words("R0", 0.02, 0.0262, "Ohm", True), moved_words("k", -1.0, 0.5, "N", False)
    ('R0 rose by 31 % to 0.0262 Ohm', 'k rose by 1.5 to 0.5 N')
    """
    way = "rose" if after > before else "fell"
    size = percent(abs(after / before - 1)) if is_positive and before else number(abs(after - before), 3)
    return f"{name} {way} by {size} to {number(after, 3)} {unit}".strip()


def unclear_jump_words() -> str:
    """Return what is said of a jump that no parameter shows."""
    return "something jumped, and no parameter shows by itself which"


def jump_at_words(moved: str, time: float, origin: str | None = None, unit: str = "s") -> str:
    """Return a jump with its instant."""
    return f"{moved} at {instant(time, origin, unit)}"


def unlearnt_words(name: str) -> str:
    """Return what is said of a parameter of which a record says nothing."""
    return f"{name} cannot be told from this record so far: what is said of it is what was believed beforehand."


def confused_words(names: list[str], what: str = "", value: float = 0.0, std: float = 0.0, unit: str = "") -> str:
    """Return what is said of parameters that only act together.

    >>> confused_words(["R1", "C1"], "product", 12.3, 0.4, "s")
    'R1 and C1 cannot be told apart from this input; their product is 12.30 ± 0.40 s.'
    """
    known = f"; their {what} is {valued(value, std, unit)}" if what else ""
    return f"{', '.join(names[:-1])} and {names[-1]} cannot be told apart from this input{known}."


def modes_words(modes: int, samples: str, found: list[str], odds: float) -> str:
    """Return what is said where several sets of parameters explain the first samples."""
    sets = "; or ".join(found)
    return (
        f"{count_of(modes, 'set')} of parameters explained the first {samples} almost equally well: {sets} "
        f"(odds {max(1.0, odds):.1f}:1). The filter goes on from the former."
    )


CURVED_WORDS = (
    "The plant bends within the error bars of its parameters, so these bars are not to be believed: more excitation, "
    "a narrower prior, or a longer start would help."
)
EDGE_WORDS = (
    "A parameter has been at the edge of what its prior, or its bounds, allow for long: the bounds, the start, or a "
    "formula may be wrong."
)
UNDEFINED_WORDS = (
    "A formula gave no number, and nothing was learnt there: where a root may meet what is not positive, write "
    "sqrt(max(h, 1e-9))."
)
STIFF_WORDS = "The plant is far faster than the time between samples, and was not taken in steps short enough."
