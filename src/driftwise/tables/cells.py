"""Columns of cells into float64, whole columns at a time: numbers, switches, time stamps, times of day."""

from __future__ import annotations

import re

from driftwise.engine.errors import InputError
from driftwise.tables.cell_kinds import MINUS, MISSING
from driftwise.tables.dates import are_compact, counted, iso

LARGEST = 1e100  # whose square is a number yet
LOOK = 2000  # cells by which the kind of a column is settled
MANY = 10  # different numbers, from which on they are of a quantity, however many cells beside them are one word
UTC = ("", "UTC", "GMT", "ETC/UTC", "ZULU")  # as data frames call it
NAT = -(2**63)  # nanoseconds of a missing time stamp: what NumPy calls NaT
OF_DAY = {"time of day": 86_400.0, "minutes and seconds": 3600.0}  # kinds that begin anew after so many seconds
PER_SECOND = {"s": 1e0, "ms": 1e3, "us": 1e6, "ns": 1e9}
ON, OFF = {"on", "true", "yes", "ein", "an", "ja", "wahr"}, {"off", "false", "no", "aus", "nein", "falsch"}

_GROUPED = r"^[+-]?[1-9]\d{0,2}(\.\d{3})+(,\d*)?$"  # 1.234,5 with thousands dots
_NUMBER = r"^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$"
_CLOCK = r"^(\d+ days?,? )?\d{1,5}:\d\d(:\d\d([.,]\d+)?|[.,]\d+)?$"  # of the day, or since a beginning
_MINUTES = re.compile(r"(?<![a-z:])m+(in)?:s+(ec)?(?![a-z:])", re.I)  # said of 75:30


def numbers(column, decimal: str = "."):
    """Return (values, bad): float64, NaN where missing, and a mask of the cells that are no number, or beyond 1e100.

    Parameters
    ----------
    column : pyarrow Array of numbers, booleans or text
    decimal : decimal mark of the text cells
    """
    import numpy as np

    values, bad = _any_size(column, decimal)
    beyond = np.abs(values) > LARGEST
    if beyond.any():
        values = np.where(beyond, np.nan, values)
    return values, bad | beyond


def are_beyond(column, decimal: str = ".") -> bool:
    """Say whether most cells are numbers, and beyond 1e100; of the first ones, which settle what a column is.

    >>> import pyarrow as pa
    >>> [are_beyond(pa.array(cells)) for cells in (["1e120", "-1e400", "x"], ["1", "2e120", "x"])]
    [True, False]
    """
    import numpy as np

    column = column.slice(0, LOOK)
    try:
        return 2 * int((np.abs(_any_size(column, decimal)[0]) > LARGEST).sum()) > len(column) - column.null_count
    except InputError:
        return False


def _any_size(column, decimal: str):
    """Return (values, bad), however large the numbers are."""
    import numpy as np
    import pyarrow as pa

    kind = column.type
    if pa.types.is_dictionary(kind):
        column, kind = column.dictionary_decode(), kind.value_type
    if is_text(kind):
        values, bad = _parse(column, decimal)
    elif pa.types.is_null(kind):
        values, bad = np.full(len(column), np.nan), np.zeros(len(column), bool)
    elif (
        pa.types.is_floating(kind)
        or pa.types.is_integer(kind)
        or pa.types.is_boolean(kind)
        or pa.types.is_decimal(kind)
    ):
        column = column.cast(pa.uint8()) if pa.types.is_boolean(kind) else column
        column = column.cast(pa.float64(), safe=False)
        values, bad = plain(column), np.zeros(len(column), bool)
    else:
        raise InputError(f"a column of type {kind} cannot be used as numbers")
    return values, bad


def plain(column):
    """Return a column of numbers, or of truths without a missing one, as an array: float64 has NaN where missing.

    The buffer itself, not `to_numpy`: that loads pandas where it is installed, half a second, and a Ctrl-C meanwhile
    is lost there.
    """
    import numpy as np
    import pyarrow as pa

    column = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    if pa.types.is_boolean(column.type):
        return plain(column.cast(pa.uint8())).view(bool)
    kind = np.dtype(str(column.type).replace("double", "float64"))
    if not len(column):
        return np.zeros(0, kind)
    found = np.frombuffer(column.buffers()[1], kind, len(column), column.offset * kind.itemsize)
    return np.where(plain(column.is_valid()), found, np.nan) if column.null_count else found


def is_text(kind) -> bool:
    import pyarrow as pa

    return pa.types.is_string(kind) or pa.types.is_large_string(kind) or str(kind) == "string_view"


def switched(column):
    """Return (values, bad) of a column of words such as on and off: 1 and 0, NaN where missing.

    >>> import pyarrow as pa
    >>> switched(pa.array(["on", "OFF", None, "?!"]))
    (array([ 1.,  0., nan, nan]), array([False, False, False,  True]))
    """
    import numpy as np
    import pyarrow as pa
    import pyarrow.compute as pc

    cells = pc.utf8_lower(trimmed(column))
    on, off = (plain(pc.is_in(cells, value_set=pa.array(sorted(words)))) for words in (ON, OFF))
    bad = plain(pc.is_valid(cells)) & ~on & ~off
    return np.where(on, 1.0, np.where(off, 0.0, np.nan)), bad


def _parse(column, decimal):
    import pyarrow as pa
    import pyarrow.compute as pc

    cells = trimmed(column)
    for written, read in MINUS:
        cells = pc.replace_substring_regex(cells, written, read)
    if decimal == ",":
        grouped = pc.fill_null(pc.match_substring_regex(cells, _GROUPED), False)
        if pc.any(grouped).as_py():
            cells = pc.if_else(grouped, pc.replace_substring(cells, ".", ""), cells)
        cells = pc.replace_substring(cells, ",", ".")
    cells = pc.replace_substring_regex(cells, r"^\+", "")
    cells = pc.replace_substring_regex(cells, "[dD]([+-]?[0-9]+)$", r"e\1")
    good = pc.fill_null(pc.match_substring_regex(cells, _NUMBER), False)
    bad = pc.and_(pc.is_valid(cells), pc.invert(good))
    values = pc.if_else(good, cells, pa.scalar(None, cells.type)).cast(pa.float64())
    return plain(values), plain(bad)


def trimmed(column):
    """Return the text cells without blanks around them, markers of a missing value as nulls."""
    import pyarrow as pa
    import pyarrow.compute as pc

    cells = pc.utf8_trim_whitespace(column.cast(pa.string()))
    missing = pc.is_in(cells, value_set=pa.array(sorted(MISSING), pa.string()))
    return pc.if_else(missing, pa.scalar(None, pa.string()), cells)


def seconds(column, decimal: str = ".", day_first: bool = True, are_dates: bool = False):
    """Return (values, bad, is_stamp): time in its own unit, or int64 nanoseconds since 1970 for time stamps.

    A missing stamp is the smallest int64 (what NumPy calls NaT); one that nanoseconds cannot count, before 1678 or
    after 2261 (9999-12-31 stands for none in many a data base), is bad. Text is read as ISO 8601 or a date with dots
    or slashes; `day_first` says whether 1/2/2024 is in February. Numbers that count time on a calendar are stamps, too
    (`dates.counted`); ``are_dates``: other rows were.
    """
    import numpy as np
    import pyarrow as pa

    kind = column.type
    if pa.types.is_dictionary(kind):
        column, kind = column.dictionary_decode(), kind.value_type
    if pa.types.is_date(kind) or pa.types.is_timestamp(kind):
        stamps = _nanoseconds(column if pa.types.is_timestamp(kind) else column.cast(pa.timestamp("s")))
        return stamps, plain(column.is_valid()) & (stamps == NAT), True
    if pa.types.is_duration(kind):
        values = column.cast(pa.duration("ns")).cast(pa.int64()).cast(pa.float64(), safe=False)
        return plain(values) / 1e9, np.zeros(len(column), bool), False
    if not is_text(kind):
        values, bad = numbers(column)
        return _dated(values, bad, are_dates)
    if are_compact(trimmed(column.slice(0, LOOK)).drop_null().to_pylist()):
        return (*_stamps(column, day_first), True)
    values, bad = numbers(column, decimal)
    if np.isfinite(values).any() or not bad.any():
        return _dated(values, bad, are_dates)
    return (*_stamps(column, day_first), True)


def zone_of(column) -> str:
    """Return the zone that stamps are written in, by the first of them; "" where there is none, or it is UTC.

    >>> import pyarrow as pa
    >>> zone_of(pa.array(["2019-01-01 00:00:00-07:00"])), zone_of(pa.array(["2019-01-01 00:00Z"]))
    ('-07:00', '')
    """
    import pyarrow as pa

    if pa.types.is_timestamp(column.type):
        zone = column.type.tz or ""
    else:
        cells = trimmed(column.slice(0, LOOK)).drop_null().to_pylist() if is_text(column.type) else []
        found = re.search(r"\d\d:\d\d(?::\d\d)?(?:[.,]\d+)?\s*([+-]\d\d:?(?:\d\d)?)$", cells[0]) if cells else None
        zone = found[1] if found else ""
    return "" if zone.upper() in UTC or not zone.strip("+-0:") else zone


def _stamps(column, day_first):
    """Return (int64 nanoseconds, bad) of time stamps in text."""
    import pyarrow as pa
    import pyarrow.compute as pc

    cells = trimmed(column)
    cells = pc.replace_substring_regex(cells, r"(:\d\d),(\d+)", r"\1.\2")
    if not pc.all(pc.match_substring_regex(cells, r"^\d{4}-\d\d-\d\d[T ]\d\d:[\d:.]+Z?$")).as_py():
        cells = iso(cells, day_first)
    for kind in (pa.timestamp("ns"), pa.timestamp("ns", "UTC")):
        try:
            stamps = _nanoseconds(cells.cast(kind))
            break
        except pa.ArrowInvalid:
            continue
    else:
        stamps = _one_by_one(cells)
    bad = plain(pc.is_valid(cells)) & (stamps == NAT)
    return stamps, bad


def _one_by_one(cells):
    """Read each stamp by itself: slow, for batches where one cell is not a time stamp or the zones differ."""
    from datetime import UTC, datetime

    import numpy as np

    def nanoseconds(cell):
        try:
            stamp = datetime.fromisoformat(re.sub(r"(\.\d{6})\d+", r"\1", cell.replace(" ", "T", 1).replace(" ", "")))
        except (ValueError, AttributeError):
            return NAT
        stamp = stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)
        delta = stamp - datetime(1970, 1, 1, tzinfo=UTC)
        found = ((delta.days * 86_400 + delta.seconds) * 1_000_000 + delta.microseconds) * 1000
        return found if abs(found) < -NAT else NAT

    return np.array([nanoseconds(cell) for cell in cells.to_pylist()], np.int64)


def _nanoseconds(stamps):
    """Return int64 nanoseconds of time stamps in any unit, NAT where missing or beyond what they can count."""
    import numpy as np
    import pyarrow as pa
    import pyarrow.compute as pc

    values = plain(pc.fill_null(stamps.cast(pa.int64()), NAT))
    factor = int(1e9 / PER_SECOND[stamps.type.unit])
    within = np.abs(values.astype(float)) < -NAT / factor * (1.0 - 1e-15)
    return np.where(within, np.where(within, values, 0) * factor, NAT)


def _dated(values, bad, are_dates: bool):
    """Return what `seconds` does of numbers: stamps, where they are dates."""
    import numpy as np

    found = counted(values, are_dates)
    if found is None:
        return values, bad, False
    is_number = np.isfinite(found)
    microseconds = np.rint(np.where(is_number, found, 0) * 1e6).astype(np.int64)
    return np.where(is_number, 1000 * microseconds, NAT), bad, True


def converted(column, kind: str, decimal: str = ".", day_first: bool = True):
    """Return (values, bad) of a column of that kind, as `kind_of` says it; of time stamps int64 nanoseconds."""
    import numpy as np

    if kind == "stamp":
        values, bad, is_stamp = seconds(column, decimal, day_first)
        return values if is_stamp else np.full(len(values), NAT), bad
    if kind in OF_DAY:
        return of_day(column, kind == "minutes and seconds")[0], np.zeros(len(column), bool)
    return switched(column) if kind == "switch" else numbers(column, decimal)


def kind_of(column, decimal: str = ".", day_first: bool = True, said: str = "") -> str:
    """Return what a column holds, by its first cells: "number", "stamp", "switch", "text", or a key of `OF_DAY`.

    ``said``: its name and unit.

    >>> import pyarrow as pa
    >>> [kind_of(pa.array(cells)) for cells in (["1", "x", "2"], ["on", "off"], ["13:45", "13:46"], ["", "", "a"])]
    ['number', 'switch', 'time of day', 'text']
    """
    import numpy as np
    import pyarrow as pa

    kind = column.type.value_type if pa.types.is_dictionary(column.type) else column.type
    if pa.types.is_date(kind) or pa.types.is_timestamp(kind):
        return "stamp"
    column = (trimmed(column) if is_text(kind) else column).drop_null().slice(0, LOOK)  # blank cells settle nothing
    if 2 * of_day(column)[1] > len(column):
        return "minutes and seconds" if are_minutes(column, said) else "time of day"
    if is_text(column.type) and len(column) and not switched(column)[1].any():
        return "switch"
    try:
        stamps, bad, is_stamp = seconds(column, decimal, day_first)
        values, not_numbers = numbers(column, decimal)
        is_count = is_stamp and bool(np.isfinite(values).any()) and counted(values) is not None
        if is_stamp and not (is_count and (np.diff(stamps[stamps != NAT]) < 0).any()):  # what falls is no clock
            return "stamp" if 2 * bad.sum() < len(column) else "text"
        bad = not_numbers
    except InputError:
        return "text"
    is_number = bad.sum() <= np.isfinite(values).sum() or are_gaps(column, bad, values)
    return "number" if is_number else "text"


def are_gaps(column, bad, values) -> bool:
    """Say whether cells that are no numbers are one word, beside numbers of a quantity: it stands for a missing one.

    A sensor that is read every fifth row has "Bad" in the others.
    """
    import numpy as np

    words = {cell for cell, is_word in zip(column.to_pylist(), bad.tolist()) if is_word}
    return len(words) == 1 and len(np.unique(values[np.isfinite(values)])) >= MANY


def instants(column, decimal: str = ".", day_first: bool = True, are_stamps: bool | None = None):
    """Return (seconds, bad, whether they are stamps) of a clock's column; stamps count from 1970.

    Where ``are_stamps`` is known already, cells of the other kind are bad.
    """
    import numpy as np
    import pyarrow as pa

    kind = column.type
    if pa.types.is_timestamp(kind):  # in their own unit: nanoseconds end in the year 2262
        values = plain(column.cast(pa.int64()).cast(pa.float64(), safe=False))
        found, bad, is_stamp = values / PER_SECOND[kind.unit], np.zeros(len(column), bool), True
    else:
        found, bad, is_stamp = seconds(column, decimal, day_first, bool(are_stamps))
        if is_stamp:
            found = np.where(found == NAT, np.nan, found / 1e9)
    if are_stamps is not None and is_stamp != are_stamps:
        wrong = np.ones(len(column), bool) if is_stamp else bad | np.isfinite(found)
        return np.full(len(column), np.nan), wrong, is_stamp
    return found, bad, is_stamp


def of_day(column, are_minutes: bool = False):
    """Return (seconds since midnight, NaN where missing or no time of day; how many cells are one).

    Time since a beginning is counted as a data frame writes it, days before hours; 26:53.1 is minutes and seconds, and
    26:53 is if ``are_minutes``.

    >>> import pyarrow as pa
    >>> of_day(pa.array(["13:45", "0 days 00:00:01.5", "1 day, 0:00:02", "noon"]))
    (array([4.9500e+04, 1.5000e+00, 8.6402e+04,        nan]), 3)
    """
    import numpy as np
    import pyarrow as pa
    import pyarrow.compute as pc

    if pa.types.is_time(column.type):
        values = column.cast(pa.time64("ns")).cast(pa.int64()).cast(pa.float64(), safe=False)
        return plain(values) / 1e9, len(column) - column.null_count
    if pa.types.is_duration(column.type):
        return seconds(column)[0], len(column) - column.null_count
    if not is_text(column.type):
        return np.full(len(column), np.nan), 0
    cells = pc.utf8_trim_whitespace(column.cast(pa.string()))
    good = pc.fill_null(pc.match_substring_regex(cells, _CLOCK), False)
    cells = pc.if_else(good, pc.replace_substring(cells, ",", "."), pa.scalar(None, pa.string()))
    cells = pc.replace_substring_regex(cells, r"^(\d+:)", r"0 \1")
    cells = pc.replace_substring_regex(cells, r"^(\d+)[a-z, ]+(\d+:\d\d\.\d+)$", r"\1 0:\2")
    whole = r"\1 0:\2" if are_minutes else r"\1 \2:00"
    cells = pc.replace_substring_regex(cells, r"^(\d+)[a-z, ]+(\d+:\d\d)$", whole)
    total = np.zeros(len(column))
    parts = (r"^(\d+) .*$", 86400.0), (r"^.* (\d+):.*$", 3600.0), (r"^.* \d+:(\d+):.*$", 60.0), (r"^.*:([\d.]+)$", 1.0)
    for part, unit in parts:
        number = pc.replace_substring_regex(cells, part, r"\1").cast(pa.float64())
        total += unit * plain(number)
    return total, int(pc.sum(good).as_py() or 0)


def are_minutes(column, said: str) -> bool:
    """Whether times of two parts are minutes and seconds: 26:53.1, or by name and unit, or as no day has as many hours.

    >>> import pyarrow as pa
    >>> [are_minutes(pa.array([cell]), said) for cell, said in (("23:59", "t"), ("23:59", "t mm:ss"), ("75:30", ""))]
    [False, True, True]
    """
    import pyarrow.compute as pc

    cells = trimmed(column).drop_null() if is_text(column.type) else column.slice(0, 0)
    if not len(cells) or not pc.all(pc.match_substring_regex(cells, r"^\d+:\d\d([.,]\d+)?$")).as_py():
        return False
    is_said = bool(_MINUTES.search(said)) or pc.any(pc.match_substring_regex(cells, "[.,]")).as_py()
    return is_said or max(int(cell.partition(":")[0]) for cell in cells.to_pylist()) > 24
