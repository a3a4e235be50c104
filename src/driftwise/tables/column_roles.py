"""What the name of a column says: its unit, and the part that it plays, by the words of `vocabulary`."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

from .vocabulary import MOTION, PLACES, PLAIN_UNITS, SECONDS, UNITS, WORDS, WRITTEN

__all__ = ["SCORES", "SECONDS", "Name", "is_unit", "of_motion", "parse"]

SCORES = {
    "setpoint": -3.0, "command": -3.0, "drive": -3.0, "device": -3.0, "disturbance": -3.0, "source": -1.0,
    "voltage": -1.0, "quantity": 2.0, "output": 3.0,
}  # fmt: skip
_MOVES = frozenset("position pos speed rpm angle posicion posizione posicao vitesse drehzahl".split())
_MOTION = frozenset(MOTION.split())
_ACTS = frozenset(kind for kind, score in SCORES.items() if score < 0) - {"voltage"}  # a tacho's is of a motion
_TURNS = "rpm", "1/min", "tr/min"  # units of what turns about an axle
_UNITS = frozenset(PLAIN_UNITS.split())
_BRACKETS = re.compile(r"^(.*?)[\s_]*[\[({]\s*([^\])}]*?)\s*[\])}]\s*$")
_SLASH = re.compile(r"^(.+?)(?:\s+/\s*|[ _]in[ _]|,\s*)(\S{1,8})$")


class Name(NamedTuple):
    """A column's name taken apart: what is left without the unit, the unit, its words, the kinds and their score.

    kinds : of `vocabulary.WORDS`: "time", "label", "counter", "setpoint", "device", "disturbance", "quantity", ..
    score : above 0 for what is usually an effect, below for what is usually a cause
    """

    base: str
    unit: str
    words: tuple[str, ...]
    kinds: frozenset[str]
    score: float

    @property
    def may_act(self) -> bool:
        """Whether a mark may be an input after all, as a step is, or a mode."""
        return bool({"step", "mode", "status", "stufe"} & set(self.words))

    @property
    def is_weather(self) -> bool:
        """Whether it is measured outside where weather is: air, and neither that of a room nor that of a duct."""
        return "weather" in self.kinds and all(_kinds(word) & {"weather", "quantity"} for word in self.words)

    @property
    def is_of_motion(self) -> bool:
        """Whether it may say where a body is or how it moves: no wind, and no speed of a pump or an axle."""
        return bool(_MOTION & set(self.words)) and not self.kinds & _ACTS and self.unit not in _TURNS

    @property
    def stem(self) -> tuple[str, ...]:
        """The words without numbers, and the unit: those of pos1 and pos2 are the same."""
        return (*(word.rstrip("0123456789") for word in self.words), self.unit)


def parse(name: str, unit: str = "") -> Name:
    """Take a column's name apart; `unit` is what a row of units says of it.

    A word counts as a whole: ``drivers`` are no drive. What a device does is a cause, what is measured at it is not:
    ``fan speed`` is set, ``pump pressure`` follows.

    Examples
    --------
    >>> parse("air temp [degC]")[:3]
    ('air temp', '°C', ('air', 'temp'))
    >>> parse("u_V").unit, sorted(parse("u_V").kinds), parse("PT08.S1(CO)").unit
    ('V', ['command'], '')
    >>> [parse(name).score for name in ("drivers", "fan speed", "pump pressure", "Raumtemperatur", "température ext")]
    [0.0, -3.0, 2.0, 2.0, 2.0]
    """
    base, found = _unit(name)
    unit = WRITTEN.get(unit or found, unit or found)
    words = _words(base)
    kinds = frozenset(kind for word in words for kind in _kinds(word))
    if "time" in kinds and re.search(r"(?<![^\W\d_])T(?![^\W\d_])", base):  # T is a temperature, t the time
        kinds = (kinds - {"time"}) | {"quantity"}
    elif words[-1:] == ("t",) and len(words) > 1 and not any("time" in _kinds(word) for word in words[:-1]):
        kinds = (kinds - {"time"}) | {"quantity"}
    elif words[:1] == ("t",) and re.match(r"T[A-Z][a-z]", base):  # TSup, or TV and more
        kinds -= {"time"}
    if unit and unit not in SECONDS and kinds & {"time", "calendar"}:  # "tempo" and "data" are words of their own
        kinds -= {"time", "calendar"}
    if "device" in kinds and "quantity" in kinds:
        kinds -= {"quantity"} if _MOVES & set(words) else {"device"}
    if "source" in kinds:
        kinds -= {"quantity"}
    if {"output", "quantity"} <= kinds and words[-1] == "out":  # the outlet, or outside
        kinds -= {"output"}
    if {"voltage", "quantity"} <= kinds:  # a tension
        is_motors = not unit and words[:1] == ("tension",) and len(words) > 1  # tension moteur, but strip tension
        kinds -= {"quantity"} if unit.endswith("V") or is_motors else {"voltage"}
    if not kinds & {*SCORES, "time"} or (kinds & SCORES.keys() == {"source"} and unit not in ("A", "mA")):
        kinds |= {kind for kind, units in UNITS.items() if unit and unit in units.split()}
    if unit == "W/m²":
        kinds |= {"disturbance"}
    scores = [SCORES[kind] for kind in kinds & SCORES.keys()]
    score = min(scores) if min(scores, default=0.0) < -2.0 else max(scores, default=0.0, key=abs)
    return Name(base, unit, words, kinds, score)


def of_motion(names: Iterable[tuple[str, str]]) -> frozenset[str]:
    """Return those of some columns (name and unit) that say how a body moves, where two of them say where it is.

    >>> sorted(of_motion([("east_m", ""), ("north_m", ""), ("roll_deg", ""), ("wind_speed_mps", "")]))
    ['east_m', 'north_m', 'roll_deg']
    >>> of_motion([("position_m", ""), ("speed_mps", "")])
    frozenset()
    """
    columns = {name: parse(name, unit) for name, unit in names}
    words = {word for one in columns.values() for word in one.words}
    if not any(words.issuperset(pair.split()) for pair in PLACES):
        return frozenset()
    return frozenset(name for name, one in columns.items() if one.is_of_motion)


def is_unit(text: str) -> bool:
    """Whether a word is a unit of measurement: V, [degC], m/s, 1/min, % ..."""
    bare = text.strip("[](){} ")
    if re.match(r"[\d.]+\s", bare):  # a range, 100 °C
        return False
    parts = re.split(r"[/*·]", bare)
    return any(mark in bare for mark in "°%²³µΩ") or all(
        part in _UNITS or part == "1" or part.rstrip("0123456789^-") in _UNITS for part in parts
    )


def _unit(name: str) -> tuple[str, str]:
    """Return the name without its unit, and the unit."""
    match = _BRACKETS.match(name)
    if match and match[1]:
        if name.rstrip()[-1] in "]}" or is_unit(match[2]):
            return match[1].strip(), WRITTEN.get(match[2], match[2])
        return match[1].strip(), ""  # a remark, as in PT08.S1(CO)
    match = _SLASH.match(name)
    if match and is_unit(match[2]):
        return match[1].strip(), WRITTEN.get(match[2], match[2])
    stem, _, last = name.rpartition("_")
    if stem and re.sub(r"^1e\d+", "", last) in _UNITS:
        return stem, WRITTEN.get(last, last)
    return name, ""


_PLAIN = str.maketrans({"ß": "ss", "ł": "l", "ø": "o", "æ": "ae"})


def _words(base: str) -> tuple[str, ...]:
    """Return the words of a name, in lower case without accents; u1 is u, tempIn is temp and in."""
    split = re.sub(r"([^\W\d_])([A-Z][a-z])|([^\W\d_A-Z]{2})([A-Z])", r"\1\3 \2\4", base).lower().translate(_PLAIN)
    bare = "".join(c for c in unicodedata.normalize("NFKD", split) if not unicodedata.combining(c))
    return tuple(re.findall(r"[^\W_]+", bare))


@cache
def _kinds(word: str) -> frozenset[str]:
    """Return the kinds that have this word; of words that only end or begin it the longest decides."""
    if word in _WHOLE:
        return _WHOLE[word]
    for one in (word.rstrip("0123456789"), word[:-1] if len(word) > 3 and word[-1] == "s" else ""):
        if one != word and one in _WHOLE:
            return _WHOLE[one] - {"time", "calendar"}  # u1 is u, and tag104 no day
    fitting = [end for end in _ENDS if word.endswith(end) and len(word) > len(end)]
    fitting += [begin for begin in _BEGINS if word.startswith(begin) and len(word) > len(begin)]
    begins = [begin for begin in fitting if begin in _BEGINS]
    return frozenset().union(*(_BEGINS[b] for b in begins)) or _ENDS[max(fitting, key=len)] if fitting else frozenset()


def _listed(mark) -> dict[str, frozenset[str]]:
    found: dict[str, set[str]] = {}
    for kind, words in WORDS.items():
        for word in words.split():
            if mark(word):
                found.setdefault(word.strip("~"), set()).add(kind)
    return {word: frozenset(kinds) for word, kinds in found.items()}


_WHOLE = _listed(lambda word: True)
_ENDS = _listed(lambda word: word.startswith("~"))
_BEGINS = _listed(lambda word: word.endswith("~"))
