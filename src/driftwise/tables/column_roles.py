"""What the name of a column says: its unit, and the part that it plays. General words only, English and German."""

from __future__ import annotations

import re
from typing import NamedTuple

TIME = "time t date datetime timestamp stamp ts zeit datum uhrzeit zeitstempel year jahr elapsed epoch seconds sec"
LABEL = (
    "anomaly anomalous changepoint fault faulty label labels class flag alarm truth mode status step indicator "
    "regime valid quality event stufe modus storung fehler"
)
COUNTER = "index idx id no nr sample samples row counter unnamed cycle record seq lfd zyklus"
SETPOINT = "setpoint sp set target reference ref desired soll sollwert"
ACTUATOR = (
    "u input inp command cmd drive control controller ctrl heater valve ventil damper klappe pwm duty actuator torque "
    "force kraft moment excitation throttle pump pumpe fan feed manipulated mv dose stellgrosse stell stellwert "
    "heizung eingang steering brake op"
)
DISTURBANCE = (
    "rain rainfall regen prec precip precipitation evap evaporation pet wind solar irradiance irradiation sun sunshine "
    "ambient outdoor outside weather amb ta tamb toa forecast fc aussen aussentemperatur disturbance inlet"
)
OUTPUT = "y output out response ist istwert measured pv ausgang actual"
QUANTITY = (
    "temperature temp temperatur speed velocity rpm drehzahl geschwindigkeit position pos angle winkel acceleration "
    "level fullstand head concentration composition heatload thermocouple displacement tachometer deflection soc "
    "outlet vorlauf ph co co2 no2 nox o3 so2 nh3 ch4 benzene pm10"
)
SOURCE = "current strom gas"  # more often a cause than an effect
SCORES = {"setpoint": -3.0, "actuator": -3.0, "disturbance": -3.0, "source": -1.0, "quantity": 2.0, "output": 3.0}

SECONDS = {
    "ns": 1e-9,
    "us": 1e-6,
    "µs": 1e-6,
    "ms": 1e-3,
    "s": 1.0,
    "sec": 1.0,
    "seconds": 1.0,
    "min": 60.0,
    "minutes": 60.0,
    "h": 3600.0,
    "hours": 3600.0,
    "d": 86400.0,
    "days": 86400.0,
}
WRITTEN = {"degC": "°C", "degF": "°F", "percent": "%", "pct": "%", "Wm2": "W/m²", "mps": "m/s", "degc": "°C"}
_UNITS = frozenset(
    "V mV kV uV A mA uA W mW kW MW Wh kWh Ah mAh Wm2 degC degF K Hz kHz rpm m mm cm km um m2 m3 l lpm kg g N kN Nm "
    "bar mbar Pa kPa MPa hPa psi percent pct ppm ppb rad deg mps kmh Ohm mOhm s ms us ns min h d sec days lux dB "
    "C F".split()
)
_BRACKETS = re.compile(r"^(.*?)\s*[\[({]\s*([^\])}]*?)\s*[\])}]\s*$")
_SLASH = re.compile(r"^(.+?)(?:\s+/\s*|\s+in\s+|,\s*)(\S{1,8})$")
_STEMS = ("temp", "soll")  # short words that begin longer ones
_FOLD = str.maketrans({"ä": "a", "ö": "o", "ü": "u", "ß": "s"})


class Name(NamedTuple):
    """A column's name taken apart: what is left without the unit, the unit, its words, the kind and its score.

    kind : "time", "label", "counter", "setpoint", "actuator", "disturbance", "source", "quantity", "output" or ""
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


def parse(name: str, unit: str = "") -> Name:
    """Take a column's name apart; `unit` is what a row of units says of it.

    Examples
    --------
    >>> parse("air temp [degC]")[:3]
    ('air temp', '°C', ('air', 'temp'))
    >>> parse("u_V").unit, sorted(parse("u_V").kinds), parse("PT08.S1(CO)").unit
    ('V', ['actuator'], '')
    """
    base, found = _unit(name)
    unit = unit or found
    words = _words(base)
    kinds = frozenset(kind for kind, known in _KNOWN.items() if any(_is_one_of(word, known) for word in words))
    if words and words[-1] == "t" and (len(words) > 1 or base == "T"):  # T is a temperature, t the time
        kinds = (kinds - {"time"}) | {"quantity"}
    if not kinds & SCORES.keys() and unit in ("°C", "°F", "K", "rpm", "1/min"):
        kinds |= {"quantity"}
    if unit == "W/m²":
        kinds |= {"disturbance"}
    scores = [SCORES[kind] for kind in kinds & SCORES.keys()]
    score = min(scores) if min(scores, default=0.0) < -2.0 else max(scores, default=0.0, key=abs)
    return Name(base, WRITTEN.get(unit, unit), words, kinds, score)


def is_unit(text: str) -> bool:
    """Whether a word is a unit of measurement: V, [degC], m/s, 1/min, % ..."""
    bare = text.strip("[](){} ")
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


def _words(base: str) -> tuple[str, ...]:
    """Return the words of a name, in lower case without umlauts; u1 is u, tempIn is temp and in."""
    split = re.sub(r"([a-zäöüß])([A-Z])", r"\1 \2", base)
    return tuple(word.translate(_FOLD) for word in re.findall(r"[^\W_]+", split.lower()))


def _is_one_of(word: str, known: tuple[str, ...]) -> bool:
    plain = word.rstrip("0123456789") or word
    for one in known:
        if word == one or plain == one:
            return True
        if (len(one) > 4 and one in word) or (one in _STEMS and word.startswith(one)):
            return True
    return False


_KNOWN = {
    "time": tuple(TIME.split()),
    "label": tuple(LABEL.split()),
    "counter": tuple(COUNTER.split()),
    "setpoint": tuple(SETPOINT.split()),
    "actuator": tuple(ACTUATOR.split()),
    "disturbance": tuple(DISTURBANCE.split()),
    "source": tuple(SOURCE.split()),
    "quantity": tuple(QUANTITY.split()),
    "output": tuple(OUTPUT.split()),
}
