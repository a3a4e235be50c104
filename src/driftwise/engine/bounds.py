"""The largest numbers that settings take, each declared once; whatever is beyond is refused in a sentence.

They are far beyond what anybody estimates, and keep a slip of a finger, or a settings file of a stranger, from taking
the memory of a machine.
"""

from __future__ import annotations

import re

ORDER, UNKNOWNS, CHANNELS = 1000, 2000, 1000
MOST = {
    "order": 200,  # of a state
    "na": ORDER, "nb": ORDER, "nc": ORDER, "nd": ORDER, "nf": ORDER, "nk": ORDER, "zeros": ORDER,
    "inputs": CHANNELS, "outputs": CHANNELS, "regressors": CHANNELS,
    "degree": 20,  # of a polynomial in time
    "frequencies": 20,  # how many
    "hypotheses": 10_000,
    "capacity": 1_000_000,  # samples that a window holds
    "threads": 1024,
    "samples": 10**8, "series": 10**7, "chunk": 10**8, "batch": 10**8,  # in memory at a time
}  # fmt: skip
FORMULA = {  # of a plant in formulas
    "bytes": 1 << 20, "names": 300, "lines": 1000, "points": 10_000,
    "characters": 10_000, "depth": 100,  # of one formula
    "operations": 20_000,  # of all, those of their slopes included
}  # fmt: skip
COUNT = 10**12  # of whatever has no bound of its own
WHY = {
    "order": "an order is how many past samples matter; is the record sampled too fast?",
    "degree": "what needs more is no polynomial: a walk, or a frequency",
    "inputs": "was the record itself given?",
    "samples": "take a shorter one",
}
DIGITS = 18  # that a whole number is written with


def why(name: str) -> str:
    """Return what to think of, behind a bound that was passed."""
    hint = WHY.get("order" if MOST.get(name) == ORDER and name[0] == "n" else name)
    return f"; {hint}" if hint else ""


def whole(text: str) -> int | None:
    """Return the whole number that a text is, one beyond every bound where it is longer than any; None: it is none."""
    text = text.strip()
    if not re.fullmatch("[0-9]+", text):
        return None
    return int(text) if len(text) <= DIGITS else 10**DIGITS
