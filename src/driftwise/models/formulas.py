"""A plant in formulas: states, inputs, outputs and named physical parameters, from a few lines of TOML.

    [states]
    v1 = {unit = "V", std = 0.1}

    [inputs]
    i = {unit = "A"}

    [outputs]
    v = {unit = "V"}

    [parameters]
    R0 = {unit = "Ohm", start = 0.05}
    R1 = {unit = "Ohm", start = 0.02}
    C1 = {unit = "F", start = 1000}

    [formulas]
    dv1 = "(i - v1 / R1) / C1"
    v = "R0 * i + v1"

``dv1`` is the derivative of v1 by time in seconds; with ``time = "discrete"`` it is v1 one sample later. Other names
on the left are outputs, or steps on the way that later lines use.
"""

from __future__ import annotations

import ast
import itertools
import math
import tomllib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from ..engine import bounds
from ..engine.errors import InputError
from .derivatives import Tape, Value, parsed
from .formula_checks import check, check_number

SECTIONS = ("states", "inputs", "outputs", "parameters", "tables", "formulas")
HEAD = ("name", "about", "source", "example", "time")
PLANTS = Path(__file__).parent / "plants"


@dataclass(frozen=True)
class State:
    """A state: what it is at first, and how sure that is; ``walk`` is the deviation it gains by itself in a second."""

    name: str
    unit: str = ""
    start: float = 0.0
    std: float | None = None
    walk: float = 0.0
    about: str = ""


@dataclass(frozen=True)
class Signal:
    """An input or an output, with the deviation of its noise where that is known."""

    name: str
    unit: str = ""
    noise: float | None = None
    about: str = ""


@dataclass(frozen=True)
class Parameter:
    """A physical parameter and what is believed of it beforehand.

    Positive ones (the default) are estimated as logarithms: ``factor`` says within what factor of ``start`` they lie,
    with 95 %. Those with ``low`` and ``high`` on a logistic scale between these; ``free`` ones, of any sign, as they
    are, within ``std`` of the start. ``fixed`` ones are not estimated.
    """

    name: str
    unit: str = ""
    start: float = math.nan
    factor: float | None = None
    std: float | None = None
    low: float = -math.inf
    high: float = math.inf
    free: bool = False
    fixed: bool = False
    about: str = ""

    @property
    def kind(self) -> str:
        """How it is estimated: "log", "logistic" or "linear"."""
        if math.isfinite(self.low) and math.isfinite(self.high):
            return "logistic"
        return "linear" if self.free else "log"

    @property
    def origin(self) -> float:
        """What its logarithm is taken from: 0, or the one bound that it has."""
        return self.low if math.isfinite(self.low) else 0.0


@dataclass(frozen=True)
class Formulas:
    """A plant in formulas, checked; `read` makes one.

    Attributes
    ----------
    text : the TOML that says all of it
    names, state_names, input_names, output_names : of what is estimated, and of the columns of a record
    is_linear : whether it is linear in its states, given parameters and inputs
    """

    text: str
    name: str = "plant"
    about: str = ""
    source: str = ""
    is_continuous: bool = True
    states: tuple[State, ...] = ()
    inputs_: tuple[Signal, ...] = ()
    outputs_: tuple[Signal, ...] = ()
    all_parameters: tuple[Parameter, ...] = ()
    tables: dict[str, tuple[list[float], list[float]]] = field(default_factory=dict)
    lines: tuple[tuple[str, str], ...] = ()

    @cached_property
    def free(self) -> list[Parameter]:
        """The parameters that are estimated."""
        return [p for p in self.all_parameters if not p.fixed]

    @cached_property
    def fixed(self) -> list[Parameter]:
        """The parameters that are known."""
        return [p for p in self.all_parameters if p.fixed]

    @property
    def n(self) -> int:
        """Number of states."""
        return len(self.states)

    @property
    def inputs(self) -> int:
        """Number of inputs."""
        return len(self.inputs_)

    @property
    def p(self) -> int:
        """Number of outputs."""
        return len(self.outputs_)

    @property
    def N(self) -> int:
        """Number of unknowns: states and parameters."""
        return self.n + len(self.free)

    @property
    def names(self) -> list[str]:
        """Names of the parameters that are estimated."""
        return [p.name for p in self.free]

    @property
    def units(self) -> dict[str, str]:
        """Units by name."""
        return {thing.name: thing.unit for thing in self.things()}

    @property
    def state_names(self) -> list[str]:
        """Names of the states."""
        return [s.name for s in self.states]

    @property
    def input_names(self) -> list[str]:
        """Names of the inputs."""
        return [s.name for s in self.inputs_]

    @property
    def output_names(self) -> list[str]:
        """Names of the outputs."""
        return [s.name for s in self.outputs_]

    def things(self) -> list[Any]:
        """All that has a name and a unit."""
        return [*self.states, *self.inputs_, *self.outputs_, *self.all_parameters]

    # --- what kernels see ----------------------------------------------------------------------------------

    @cached_property
    def places(self) -> dict[str, tuple[int, int]]:
        """Where in `points` each table begins, and how many arguments it has."""
        found, at = {}, 0
        for name, (xs, _) in self.tables.items():
            found[name] = at, len(xs)
            at += 2 * len(xs)
        return found

    @property
    def points(self) -> list[float]:
        """The numbers of all tables: arguments, then values."""
        return [float(v) for xs, ys in self.tables.values() for part in (xs, ys) for v in part]

    @property
    def constants(self) -> list[float]:
        """What is known."""
        return [p.start for p in self.fixed]

    def written(self, which: str, with_slopes: bool) -> tuple[list[str], list[Value]]:
        """Return the lines of one function, ``which`` being "states" or "outputs", and what they come to."""
        known, lines = {}, []
        groups = [
            ("x", self.state_names, 0), ("u", self.input_names, self.n), ("theta", self.names, self.n + self.inputs)
        ]  # fmt: skip
        for array, names, first in groups:
            for i, name in enumerate(names):
                own = f"{array}_{i}"
                lines.append(f"{own} = {array}[{i}]")
                slopes = {str(first + i): "1.0"} if with_slopes else {}
                known[name] = Value(own, slopes, frozenset([str(first + i)]))
        for i, one in enumerate(self.fixed):
            lines.append(f"constant_{i} = plant.constants[{i}]")
            known[one.name] = Value(f"constant_{i}", {})
        wanted = [f"d{s}" for s in self.state_names] if which == "states" else self.output_names
        tape, found = Tape(known, self.places), {}
        for left, right in self.lines:
            if which == "states" and left in self.output_names and left not in self._later:
                continue
            if which == "outputs" and left in (f"d{s}" for s in self.state_names):
                continue
            tape.where = f"{self.name}: {left} = {right}"
            value = tape.value(parsed(right, tape.where))
            found[left] = value
            if not left.startswith("d") or left[1:] not in self.state_names:
                known[left] = value
        return lines + tape.lines, [found[name] for name in wanted]

    @cached_property
    def _later(self) -> set[str]:
        """Names of outputs that other lines use."""
        used = {
            n.id
            for left, right in self.lines
            for n in ast.walk(parsed(right, f"{self.name}: {left} = {right}"))
            if isinstance(n, ast.Name)
        }
        return used & set(self.output_names)

    @cached_property
    def is_linear(self) -> bool:
        """Whether the states' derivatives are linear in the states, given parameters and inputs."""
        own = {str(i) for i in range(self.n)}
        return all(not v.bent & own for v in self.written("states", True)[1])


# --- reading -----------------------------------------------------------------------------------------------------


def read(plant: Any) -> Formulas:
    """Return a plant in formulas: of a name of the library, a path of a TOML file, or its text.

    Raises
    ------
    InputError
        Where something does not fit; the message names the line.

    Examples
    --------
    >>> from driftwise.models.formulas import read
    >>> read("battery").names
    ['R0', 'R1', 'C1']
    """
    if isinstance(plant, Formulas):
        return plant
    text = _text_of(plant)
    try:
        table = tomllib.loads(text)
    except RecursionError:
        raise InputError("the plant is nested without end") from None
    except ValueError as error:  # a number of thousands of digits is one, too
        raise InputError(f"the plant is no TOML: {error}. It looks like this:\n{_example()}") from None
    plant = _read(table, text)
    check(plant)
    return plant


def library() -> list[str]:
    """Return the names of the plants that come with the package."""
    return sorted(path.stem for path in PLANTS.glob("*.toml"))


def _text_of(plant) -> str:
    if not isinstance(plant, str | Path):
        raise InputError(f"plant is a name ({', '.join(library())}), a TOML file or its text; got {plant!r}")
    if isinstance(plant, str) and "\n" in plant:
        return _bounded(plant)
    try:
        path = PLANTS / f"{plant}.toml"
        with open(path if path.exists() else plant, encoding="utf-8") as file:
            text = file.read(bounds.FORMULA["bytes"] + 1)
    except (OSError, ValueError) as error:
        raise InputError(
            f"there is no plant {str(plant)!r} ({error}): known are {', '.join(library())}, and any TOML file"
        ) from None
    return _bounded(text)


def _bounded(text: str) -> str:
    if len(text) > (most := bounds.FORMULA["bytes"]):
        raise InputError(f"a plant has at most {most >> 20} MB of text; is it the right file?")
    return text


def _example() -> str:
    return (PLANTS / "battery.toml").read_text(encoding="utf-8")


def _read(table: dict[str, Any], text: str) -> Formulas:
    for key in table:
        if key not in (*SECTIONS, *HEAD):
            raise InputError(f"{key!r} is no section of a plant: they are {', '.join((*HEAD, *SECTIONS))}")
    for needed in ("outputs", "parameters", "formulas"):
        if not table.get(needed):
            raise InputError(f"the plant has no [{needed}]. It looks like this:\n{_example()}")
    most = bounds.FORMULA
    for section in SECTIONS:
        found = table.get(section, {})
        if not isinstance(found, dict):
            raise InputError(f"[{section}] is a section of the plant, got {section} = {found!r}")
        if len(found) > (largest := most["lines" if section == "formulas" else "names"]):
            raise InputError(f"[{section}] has at most {largest} entries, got {len(found)}; is it one plant?")
    if (count := sum(len(table.get(section, {})) for section in SECTIONS[:4])) > most["names"]:
        raise InputError(f"a plant has at most {most['names']} states, inputs, outputs and parameters, got {count}")
    time = table.get("time", "continuous")
    if time not in ("continuous", "discrete"):
        raise InputError(f'time is "continuous" or "discrete", got {time!r}')
    lines = table["formulas"]
    if not isinstance(lines, dict) or not all(isinstance(v, str) for v in lines.values()):
        raise InputError('[formulas] has a line for each name, a text: v = "R0 * i + v1"')
    return Formulas(
        text,
        str(table.get("name", "plant")),
        str(table.get("about", "")),
        str(table.get("source", "")),
        time == "continuous",
        _each(State, "states", table),
        _each(Signal, "inputs", table),
        _each(Signal, "outputs", table),
        _each(Parameter, "parameters", table),
        {name: _table(name, found) for name, found in table.get("tables", {}).items()},
        tuple(lines.items()),
    )


def _each(kind, section, table) -> tuple[Any, ...]:
    found = []
    known = [name for name in kind.__dataclass_fields__ if name != "name"]
    for name, given in table.get(section, {}).items():
        where = f"[{section}] {name}"
        if not isinstance(given, dict):
            raise InputError(f'{where} is a table such as {{unit = "V"}}, got {given!r}')
        for key, value in given.items():
            if key not in known:
                raise InputError(f"{where} has {key!r}, which is none of {', '.join(known)}")
            wanted = kind.__dataclass_fields__[key].type
            if "float" in wanted:
                check_number(f"{where}: {key}", value, may_be_infinite=key in ("low", "high"))
            if wanted == "str" and not isinstance(value, str):
                raise InputError(f"{where}: {key} is a text, got {value!r}")
            if wanted == "bool" and not isinstance(value, bool):
                raise InputError(f"{where}: {key} is true or false, got {value!r}")
        found.append(kind(name, **{k: float(v) if type(v) is int else v for k, v in given.items()}))
    return tuple(found)


def _table(name, found) -> tuple[list[float], list[float]]:
    where = f"[tables] {name}"
    if not isinstance(found, dict) or set(found) - {"x", "y", "unit", "x_unit"} or not {"x", "y"} <= set(found):
        raise InputError(f"{where} has x and y, numbers each: {{x = [0, 1], y = [3.0, 4.2]}}")
    for axis in ("x", "y"):
        if not isinstance(found[axis], list) or len(found[axis]) > bounds.FORMULA["points"]:
            raise InputError(f"{where}: {axis} is a list of numbers, at most {bounds.FORMULA['points']}")
        for value in found[axis]:
            check_number(f"{where}: {axis}", value)
    xs, ys = [float(v) for v in found["x"]], [float(v) for v in found["y"]]
    if len(xs) != len(ys) or len(xs) < 2:
        raise InputError(f"{where}: x has {len(xs)} and y {len(ys)} numbers; both need as many, and two at least")
    if any(b <= a for a, b in itertools.pairwise(xs)) or not all(map(math.isfinite, xs + ys)):
        raise InputError(f"{where}: x must increase, and all be finite")
    return xs, ys
