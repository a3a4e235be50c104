"""Which column of a table is which input and output of a plant: by name, or the only one of its unit."""

from __future__ import annotations

import re
from typing import Any

from driftwise.engine.errors import CommandError

TIME = ("t", "time", "seconds", "timestamp", "datetime", "date")


def match(file: str, plant: Any, outputs: list[str], inputs: list[str], time: str | None):
    """Return the columns of outputs and inputs, in the plant's order, and the clock's.

    Columns that were named stand for outputs and inputs in the plant's order, and must be as many.
    """
    from driftwise.tables.parts import source_of
    from driftwise.tables.source import is_stream

    source = None if is_stream(file) else source_of(file)
    names, units = (list(source.names), dict(source.units)) if source else ([], {})
    found: dict[str, list[str]] = {}
    for what, things, given in (("output", plant.outputs_, outputs), ("input", plant.inputs_, inputs)):
        wanted = [one.name for one in things]
        if given and len(given) != len(wanted):
            raise CommandError(
                f"the plant {plant.name} has {len(wanted)} {what}s ({', '.join(wanted)}), and --{what} names "
                f"{len(given)}: name one column for each, in this order"
            )
        taken = {*outputs, *inputs, *found.get("output", []), time}
        found[what] = given or [_column(one, names, units, taken, what, plant) for one in things]
    own = [*found["output"], *found["input"]]
    if time is None:
        time = next((name for name in names if _without_unit(name)[0] in TIME and name not in own), None)
    return found["output"], found["input"], time


def _column(one, names, units, taken, what, plant) -> str:
    """Return the column of an input or output."""
    words = {one.name.lower(), *re.findall(r"[a-z]{3,}", one.about.lower())}
    bare = {name: _without_unit(name) for name in names}
    unit_of = {name: units.get(name) or bare[name][1] for name in names}
    for candidates in (
        [name for name in names if bare[name][0] == one.name.lower()],
        [name for name in names if one.unit and unit_of[name] == one.unit and name not in taken],
        [name for name in names if bare[name][0] in words and name not in taken],
    ):
        if len(candidates) == 1:
            return candidates[0]
    unit = f" in {one.unit}" if one.unit else ""
    about = f" ({one.about})" if one.about else ""
    raise CommandError(
        f"which column is {one.name}{unit}, an {what} of the plant {plant.name}{about}? The columns are "
        f"{', '.join(names) or 'those of a stream, read once'}: say --{what} COLUMN for each {what}"
    )


def _without_unit(name: str) -> tuple[str, str]:
    """Return a column's name in small letters, and the unit behind it in brackets.

    >>> _without_unit("Current [A]"), _without_unit("v")
    (('current', 'A'), ('v', ''))
    """
    found = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]\s*", name)
    return (found[1].lower(), found[2]) if found else (name.strip().lower(), "")
