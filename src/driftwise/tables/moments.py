"""Times that somebody says: a number in the unit of the clock, or a date."""

from __future__ import annotations

from driftwise.engine.errors import CommandError
from driftwise.tables.cells import seconds
from driftwise.tables.clock import DAY, Clock
from driftwise.tables.source import Source


def moment(clock: Clock, name: str | None, source: Source, option: str, said: float | str, is_end: bool) -> float:
    """Return the time that an option says: a number as it is, a date since the first stamp, written as the file's.

    ``is_end``: a date without a time of day is the end of its day.
    """
    import pyarrow as pa

    try:
        return float(said)
    except ValueError:
        values, bad, is_stamp = seconds(pa.array([said]), source.decimal, source.day_first)
    if bad[0] or not is_stamp:
        raise CommandError(f"{option} takes a number, or a date such as 2024-03-30 or 2024-03-30T12:00; got {said!r}.")
    if name is None:
        raise CommandError(f"{option} {said} is a date; which column holds the time stamps (--time)?")
    if clock.origin is None:
        raise CommandError(
            f"{option} {said} is a date, and column {name!r} holds numbers: give a number in their unit."
        )
    return float(clock.stamps(values)[0]) + (DAY - 1e-9) * (is_end and ":" not in str(said))
