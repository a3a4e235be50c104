"""What a plant in formulas must be: names that are free, starts within bounds, a line for each state and output."""

from __future__ import annotations

import math
from typing import Any

from ..engine.errors import InputError
from .derivatives import CONSTANTS, FUNCTIONS
from .units import check_units

RESERVED = {"t", "dt", "time", "prediction", "innovation", "variance", "status", *FUNCTIONS, *CONSTANTS}


def check(plant: Any) -> None:
    """Raise InputError where a line of a plant does not fit, naming the line."""
    names = [thing.name for thing in plant.things()] + list(plant.tables)
    seen: set[str] = set()
    for name in names:
        if not name.isidentifier() or name in RESERVED:
            raise InputError(f"{name!r} cannot be a name here: letters, digits and _, and no word that formulas have")
        if name in seen:
            raise InputError(f"{name!r} is named twice: states, inputs, outputs, parameters and tables share one set")
        seen.add(name)
    if not plant.free:
        raise InputError("all parameters are fixed: for a plant that is known take WindowObserver")
    for state in plant.states:
        if state.std is None or not state.std >= 0 or not math.isfinite(state.start):
            raise InputError(
                f"[states] {state.name} needs std, how far from its start ({state.start:g}) it may be at first "
                f"(not negative), got {state.std!r}"
            )
        if not state.walk >= 0:
            raise InputError(f"[states] {state.name}: walk must not be negative, got {state.walk!r}")
    for output in plant.outputs_:
        if output.noise is not None and not output.noise > 0:
            raise InputError(f"[outputs] {output.name}: noise must be positive, got {output.noise!r}")
    for one in plant.all_parameters:
        _check_parameter(one)
    _check_lines(plant)
    check_units(plant)


def check_number(what: str, value: Any, may_be_infinite: bool = False) -> None:
    """Raise InputError where a value is no number of a size that data have."""
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise InputError(f"{what} must be a number, got {value!r}")
    if 0 < abs(value) < 1e-100 or (abs(value) > 1e100 and not (may_be_infinite and math.isinf(value))):
        raise InputError(f"{what} must lie between 1e-100 and 1e100, got {str(value)[:20]}. Is the unit right?")


def _check_parameter(one: Any) -> None:
    where = f"[parameters] {one.name}"
    if not math.isfinite(one.start):
        raise InputError(f"{where} needs start, a number to begin with")
    if one.fixed:
        return
    if not one.low < one.high:
        raise InputError(f"{where}: low = {one.low:g} must lie below high = {one.high:g}")
    if not one.low < one.start < one.high:
        raise InputError(
            f"{where}: its bounds {one.low:g} .. {one.high:g} exclude its start {one.start:g}: a start lies between"
        )
    if math.isfinite(one.high) and not math.isfinite(one.low):
        raise InputError(f"{where} has high without low: give both, or estimate its negative")
    if one.kind == "log" and not one.start > one.origin:
        raise InputError(f"{where} is positive unless it says free = true, and starts at {one.start:g}")
    if one.kind == "linear" and not (one.std is not None and one.std > 0):
        raise InputError(f"{where} is free, so it needs std, how far from its start it may be, got {one.std!r}")
    if one.factor is not None and (one.kind != "log" or not one.factor > 1):
        raise InputError(f"{where}: factor is for positive parameters, and above 1, got {one.factor!r}")
    if one.kind == "log" and one.std is not None:
        raise InputError(f"{where} is positive: say how sure it is by factor (or free = true with std)")


def _check_lines(plant: Any) -> None:
    """Every state and output has a line, no other name is a known one, and every parameter is used."""
    wanted = {f"d{s}" for s in plant.state_names} | set(plant.output_names)
    lefts = [left for left, _ in plant.lines]
    for name in wanted:
        if name not in lefts:
            what = f"state {name[1:]}: {name} = .." if name[1:] in plant.state_names else f"output: {name} = .."
            raise InputError(f"[formulas] has no line for the {what}")
    taken = {thing.name for thing in plant.things()} - set(plant.output_names)
    for left in lefts:
        if left in taken or left in RESERVED or left in plant.tables:
            raise InputError(
                f"[formulas] {left} = ..: {left} is a name already; on the left stand d(state) and outputs"
            )
    derivatives, outputs = (plant.written(which, True)[1] for which in ("states", "outputs"))
    n, k = plant.n, plant.inputs
    used = frozenset().union(*(v.uses for v in (*derivatives, *outputs)))
    for i, name in enumerate(plant.names):
        if str(n + k + i) not in used:
            raise InputError(f"[parameters] {name} is in no formula: nothing would tell it; take it out, or fix it")
    seen = {int(z) for v in outputs for z in v.slopes if int(z) < n}
    while more := {int(z) for i in seen for z in derivatives[i].slopes if int(z) < n} - seen:
        seen |= more
    for i, state in enumerate(plant.state_names):
        if i not in seen:
            raise InputError(
                f"[states] {state} reaches no output, directly or through other states: nothing would tell it "
                "(unobservable)"
            )
