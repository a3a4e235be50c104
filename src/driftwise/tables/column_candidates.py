"""Which column is proposed as the output and which as the inputs: by name, then by what helps to predict."""

from __future__ import annotations

import itertools

import numpy as np

from ..results.numbers import percent
from .column_roles import SCORES, Name, parse
from .derived import is_part
from .screening import screen

MOST_INPUTS = 4
LEAK = 1e-4  # share of the output left, where a drive is computed from it and its set point in the same row
ACTING = frozenset({"command", "device", "drive"})  # kinds of what somebody sets
HELPS = 0.002  # share of the residual variance that an input must take away to be proposed
HELPS_MUCH = 0.05  # the same for a column whose name says nothing, beside inputs whose names do


def propose_output(free: list[str], names: dict[str, Name], taken, switches=()) -> tuple[str, str, tuple[str, ...]]:
    """Return the column that looks most like an effect, why, and those that may be it as well, as far as names go.

    ``switches`` have two values: they are inputs where anything else could be the output.
    """
    free = [name for name in free if name not in taken]
    free = [name for name in free if name not in switches or names[name].score > 0] or free
    aimed = {name for name in free if names[name].score > -2 and _has_setpoint(name, names)}
    scores = {name: names[name].score + 2.0 * (name in aimed) for name in free}
    best = max(scores.values())
    leading = [name for name in free if scores[name] == best]
    is_caused = bool(taken) or any(name.score <= -2 for name in names.values())
    electric = [name for name in free if "voltage" in names[name].kinds]
    if best > 0:
        one = leading[0]
        rivals: list[str] = []
        if not is_caused and not all(names[name].stem == names[one].stem for name in leading):
            rivals = [*leading, *(name for name in free if scores[name] == 0)]  # of which one may be the effect as well
        elif not is_caused and electric and all(names[name].unit in ("°C", "°F", "K") for name in leading):
            rivals = [*leading, *electric]  # a cell: its voltage follows the current, and so does its temperature
        return one, "a set point is named after it" if one in aimed else because(names[one], "output"), tuple(rivals)
    if best < 0 and electric and len(electric) < len(free):  # a current and its voltage
        return electric[-1], "the voltage beside a current", ()
    if len(leading) == 1:
        return leading[0], "the only one that names no cause", ()
    return leading[-1], "the last column of numbers that could be one", tuple(leading)


def _has_setpoint(name: str, names: dict[str, Name]) -> bool:
    """Whether another column is a set point for it, by its name."""
    mine = set(names[name].words)
    return any(mine < set(other.words) for other in names.values() if "setpoint" in other.kinds)


def propose_inputs(output: str, free: list[str], names: dict[str, Name], clean):
    """Return (the inputs proposed, why per name, how much each helps): by name, then by how much they help."""
    y = clean[output]
    why: dict[str, str] = {}
    causes = [n for n in free if names[n].score <= -1 and because(names[n], "input", names[output].kinds)]
    weather = _weather(output, free, causes, names)
    causes += weather
    setpoints = [name for name in causes if "setpoint" in names[name].kinds]
    acting = [name for name in causes if names[name].kinds & ACTING and name not in setpoints]
    for name in list(acting) if setpoints else ():
        if _is_computed(y, [clean[name], *(clean[s] for s in setpoints)], clean[setpoints[0]]):
            acting.remove(name)
            causes.remove(name)
            free = [other for other in free if other != name]
            why[name] = "computed from the output and the set point in the same row"
    if acting:
        for name in setpoints:
            causes.remove(name)
            free = [other for other in free if other != name]
            why[name] = "a set point, which acts through the drive that is recorded"
    for part, whole in itertools.permutations(causes, 2):
        if part not in why and whole not in why and is_part(clean[part], clean[whole]):
            why[part] = f"contained in {whole!r}, which jumps by as much in the same row"
    causes = [name for name in causes if name not in why]
    free = [name for name in free if name not in why]
    others = [name for name in free if name not in causes]
    if causes:
        others = [name for name in others if names[name].words and not name.startswith("column")]
        for name in others:
            if names[name].stem == names[output].stem:
                why[name] = f"an output like {output!r}, by its name"
        others = [name for name in others if name not in why]
    certain = causes if len(causes) <= MOST_INPUTS else []  # few enough: names decide
    helps = dict(_screened(y, [*causes, *others], clean, 2 * MOST_INPUTS))
    least = {name: HELPS_MUCH if causes and name in others else HELPS for name in helps}
    more = [name for name in helps if name not in certain and helps[name] >= least[name]]
    chosen = [*certain, *more[: MOST_INPUTS - len(certain)]] or causes[:1]
    for name in chosen:
        by_name = (
            "weather, as other inputs are" if name in weather else because(names[name], "input", names[output].kinds)
        )
        reason = by_name or "its past helps"
        why[name] = reason + (f", {percent(helps[name])}" if name in helps else "")
    for name in free:
        if name not in chosen:
            why.setdefault(name, "helps too little to predict the output" if name in [*causes, *others] else "no name")
    return tuple(name for name in clean if name in chosen), why, helps


def _weather(output: str, free: list[str], causes: list[str], names: dict[str, Name]) -> list[str]:
    """Return the quantities of the air outside: where nobody acts, and no disturbance measures the same."""
    if names[output].is_weather or not causes or not all("disturbance" in names[name].kinds for name in causes):
        return []
    told = {word for name in causes for word in names[name].words}
    return [name for name in free if name not in causes and names[name].is_weather and not told & {*names[name].words}]


def _screened(y, candidates: list[str], clean, most: int) -> list[tuple[str, float]]:
    if not candidates:
        return []
    return [(candidates[j], gain) for j, gain in screen(y, np.column_stack([clean[n] for n in candidates]), most)]


def _is_computed(y, columns, setpoint) -> bool:
    """Whether the output is a linear function of these columns in the same row, and not of the set point alone."""
    rows = np.isfinite(y) & np.all([np.isfinite(c) for c in columns], axis=0)
    if np.count_nonzero(rows) < 20:
        return False
    y = y[rows] - y[rows].mean()

    def left(regressors) -> float:
        A = np.column_stack([c[rows] - c[rows].mean() for c in regressors])
        theta = np.linalg.lstsq(A, y, rcond=None)[0]
        return float(np.sum((y - A @ theta) ** 2))

    total = float(np.sum(y**2))
    return total > 0 and left(columns) < LEAK * total and left(columns) < 0.1 * left([setpoint])


def because(name: Name, part: str, others: frozenset[str] = frozenset()) -> str:
    """Return why a column plays its part, in a few words; of a unit that ``others`` share nothing is learnt.

    >>> because(parse("heater [%]"), "input"), because(parse("CH1 [A]"), "input")
    ('an actuator, by its name', 'a cause, by its unit')
    >>> because(parse("CH1 [A]"), "input", parse("CH2 [A]").kinds)
    ''
    """
    kinds = sorted(kind for kind in name.kinds if (SCORES.get(kind, 0.0) > 0) == (part == "output") and kind in SCORES)
    called = parse(name.base).kinds
    if kinds := [kind for kind in kinds if kind in called or kind not in others]:
        return f"{_CALLED[kinds[0]]}, by its {'name' if kinds[0] in called else 'unit'}"
    return "the only one left" if part == "output" else ""


_CALLED = {
    "setpoint": "a set point",
    "command": "an actuator",
    "device": "an actuator",
    "drive": "an actuator",
    "voltage": "a voltage",
    "disturbance": "a disturbance",
    "source": "a cause",
    "quantity": "a measured quantity",
    "output": "an output",
}
