"""How far apart samples are, as instruments write it above the rows: Delta_X 0.001, Sample Rate: 100 Hz."""

from __future__ import annotations

import re
from collections.abc import Iterable

from .column_roles import SECONDS

# What it is called, without blanks. Of the plain ones a number without a unit is in seconds.
PLAIN = "deltax xincrement increment sampleinterval sampleperiod sampletime hresolution tinterval timestep".split()
INTERVALS = (
    "interval datainterval samplinginterval samplingperiod samplingtime scaninterval logginginterval loginterval "
    "recordinterval abtastintervall abtastzeit messintervall".split()
)
RATES = "samplerate samplingrate samplingfrequency samplefrequency scanrate abtastrate abtastfrequenz".split()
HERTZ = {"Hz": 1.0, "hz": 1.0, "HZ": 1.0, "kHz": 1e3, "MHz": 1e6, "GHz": 1e9, "S/s": 1.0, "Sa/s": 1.0}
_NUMBER = re.compile(r"([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*([A-Za-zµ/]*)$")
_SENTENCE = re.compile(r"(.*?interval|.*?rate)\s+([\d.]+\s*[A-Za-z/]+)$", re.I)
_NAMED = re.compile(r"\W*([^(\[]*?)\s*(?:[(\[](.*?)[)\]])?\W*$")


def interval_of(lines: Iterable[list[str]], decimal: str = ".") -> float | None:
    """Return the seconds between samples that lines above the rows give, cut into cells; None where they do not.

    >>> interval_of([["Model", "MSO44"], ["Sample Interval", "4.0e-08"]]), interval_of([["Sampling Rate (Hz) =", "50"]])
    (4e-08, 0.02)
    >>> interval_of([["X", "CH1", "Start", "Increment"], ["Sequence", "Volt", "-1e-3", "5e-06"]])
    5e-06
    >>> interval_of([["# interval: 500 ms"]]), interval_of([["data interval 2 s"]]), interval_of([["interval", "5"]])
    (0.5, 2.0, None)
    """
    found, above = set[float](), list[str]()
    for line in lines:
        cells = [cell.strip() for cell in line]
        told = [part for cell in cells for part in re.split(r"\s*[:=]+\s*", cell) if part]
        if len(told) == 1 and (sentence := _SENTENCE.match(told[0])):
            told = [*sentence.groups()]
        if told:
            found |= {step for value in told[1:] if (step := _seconds(told[0], value, decimal))}
        for name, value in zip(above[1:], cells[1:]):
            if (step := _seconds(name, value, decimal)) is not None:
                found.add(step)
        above = cells
    return found.pop() if len(found) == 1 else None


def _seconds(name: str, value: str, decimal: str) -> float | None:
    """Return the seconds between samples where a name and its value say them."""
    named, number = _NAMED.match(name), _NUMBER.match(value.replace(",", ".") if decimal == "," else value)
    if not named or not number:
        return None
    word, unit = re.sub(r"[^a-z]", "", named[1].lower()), number[2] or named[2] or ""
    try:
        size = float(number[1])
    except ValueError:
        return None
    if not 0 < size < float("inf"):
        return None
    if word in RATES and unit in {"", *HERTZ}:
        return 1.0 / (size * HERTZ.get(unit, 1.0))
    if (word in PLAIN and not unit) or (word in PLAIN + INTERVALS and unit in SECONDS):
        return size * SECONDS.get(unit, 1.0)
    return None
