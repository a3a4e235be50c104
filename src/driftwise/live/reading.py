"""Sections of a configuration become dataclasses: every option is checked, and a complaint names its line."""

from __future__ import annotations

import dataclasses
import math
import re
import types
import typing
from difflib import get_close_matches
from typing import Any, NamedTuple

from ..engine.errors import InputError

HEADER = re.compile(r"^\s*\[\[?\s*([\w.-]+)\s*\]\]?")
OPTION = re.compile(r"^\s*([\w-]+)\s*=")


class Section(NamedTuple):
    """A section of a file: its name, options, and lines (of itself under "")."""

    name: str
    options: dict[str, Any]
    lines: dict[str, int]
    file: str = ""

    def where(self, option: str = "") -> str:
        """Return file and line of an option, "" where it came from elsewhere."""
        line = self.lines.get(option, self.lines.get(""))
        return f"{self.file}:{line}: " if line and self.file else ""

    def refuse(self, option: str, words: str) -> InputError:
        """Return the error about an option."""
        return InputError(f"{self.where(option)}{option} in [{self.name}] {words}")


def lines_of(text: str) -> dict[tuple[str, int], dict[str, int]]:
    """Return the lines of options by section and its number among those of that name; the section itself under ""."""
    found: dict[tuple[str, int], dict[str, int]] = {("", 0): {}}
    here = ("", 0)
    for number, line in enumerate(text.splitlines(), 1):
        if header := HEADER.match(line):
            name = header[1]
            here = (name, sum(1 for other, _ in found if other == name))
            found[here] = {"": number}
        elif option := OPTION.match(line):
            found[here].setdefault(option[1], number)
    return found


def nearest(name: str, known) -> str:
    """Return a question with the nearest known word, or all of them."""
    close = get_close_matches(name, list(known), 1)
    return f"was {close[0]!r} meant?" if close else f"there are {', '.join(sorted(known))}"


def read(section: Section, kind: type) -> Any:
    """Return a dataclass with the options of a section; those left out have its defaults."""
    fields = {field.name: field for field in dataclasses.fields(kind) if field.init}
    hints = typing.get_type_hints(kind)
    given = {}
    for option, value in section.options.items():
        if option not in fields:
            raise InputError(
                f"{section.where(option)}there is no option {option!r} in [{section.name}]; {nearest(option, fields)}"
            )
        given[option] = _fitting(section, option, value, hints[option])
    for name, field in fields.items():
        if name not in given and field.default is field.default_factory is dataclasses.MISSING:
            raise InputError(f"{section.where()}[{section.name}] needs {name} = .. ({_words(hints[name])})")
    try:
        return kind(**given)
    except InputError as error:
        named = next((option for option in given if str(error).startswith(option)), "")
        raise InputError(f"{section.where(named)}{error}") from None


def _fitting(section: Section, option: str, value: Any, hint: Any) -> Any:
    """Return a value as its type asks, or raise with what was expected and what came."""
    kinds = typing.get_args(hint) if typing.get_origin(hint) in (types.UnionType, typing.Union) else (hint,)
    for kind in kinds:
        origin, of = typing.get_origin(kind), typing.get_args(kind)
        if kind is float and isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(value):
            return float(value)
        if origin is tuple and isinstance(value, list):
            return tuple(_fitting(section, option, item, of[0]) for item in value)
        if origin is dict and isinstance(value, dict):
            return {str(name): _fitting(section, option, item, of[1]) for name, item in value.items()}
        if origin is None and kind not in (float, type(None)) and type(value) is kind:
            return value
    raise section.refuse(option, f"must be {_words(hint)}, got {value!r}")


def _words(hint: Any) -> str:
    """Return a type in words."""
    kinds = typing.get_args(hint) if typing.get_origin(hint) in (types.UnionType, typing.Union) else (hint,)
    plain = {str: "text in quotes", float: "a number", int: "a whole number", bool: "true or false"}
    found = []
    for kind in kinds:
        if kind is not type(None):
            of = typing.get_args(kind)
            listed = (
                f"a list of {_words(of[0])}"
                if typing.get_origin(kind) is tuple
                else f"a table of {_words(of[-1])}"
                if of
                else ""
            )
            found.append(listed or plain.get(kind, str(kind)))
    return " or ".join(found)
