"""Dates as spreadsheets, loggers and statistics packages write them, brought to ISO 8601."""

from __future__ import annotations

import re
from itertools import pairwise

MONTHS = (
    "jan|janv|ene|gen|sty|january|januar|janvier|enero|gennaio|januari|janeiro",
    "feb|fev|febr|fevr|lut|february|februar|fevrier|febrero|febbraio|februari|fevereiro",
    "mar|mars|mrz|mrt|maerz|march|marz|marzo|maart|marco",
    "apr|avr|abr|kwi|april|avril|abril|aprile",
    "may|mai|maj|mei|mag|mayo|maggio|maio",
    "jun|juin|giu|cze|june|juni|junio|giugno|junho",
    "jul|juil|lug|lip|july|juli|juillet|julio|luglio|julho",
    "aug|aout|ago|sie|august|agosto|augustus",
    "sep|sept|set|wrz|september|septembre|septiembre|settembre|setembro",
    "oct|okt|ott|out|paz|october|oktober|octobre|octubre|ottobre|outubro",
    "nov|lis|november|novembre|noviembre|novembro",
    "dec|dez|dic|gru|december|dezember|decembre|diciembre|dicembre|dezembro",
)
NAMED = "|".join(MONTHS)
TIME = r"[T :]+\d\d?:\d\d(:\d\d([.,]\d+)?)?\s*([AaPp]\.?[Mm]\.?)?\s*(Z|UTC|GMT|[+-]\d\d:?(\d\d)?)?"
CENTURY = 978_307_200, 4_102_444_800  # seconds since 1970 of 2001 and of 2100
DAYS, EPOCH = (20_000, 80_000), 25_569  # of a spreadsheet: from 1954 to 2119, and 1970
COMPACT = r"(1[89]|20)\d\d(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])"  # 20180131

# What a cell looks like that is a date, alone or before a time of day.
DATES = (
    r"\d{4}-\d\d?-\d\d?", r"\d{4}/\d\d?/\d\d?", r"\d{4}\.\d\d?\.\d\d?",
    r"\d\d?\.\d\d?\.(\d{4}|\d\d)", r"\d\d?/\d\d?/(\d{4}|\d\d)", r"\d\d?[ -]\d\d?[ -]\d{4}", r"\d{4} \d\d? \d\d?",
    rf"\d\d?[- /.]?({NAMED})\.?[- /,]?\s?(\d{{4}}|\d\d)", rf"({NAMED})\.?[- /]\d\d?,?[- /]\d{{4}}",
    rf"\d{{4}}[- ]({NAMED})[- ]\d\d?",
)  # fmt: skip
# Months and quarters: no time of day follows.
PERIODS = (
    r"\d{4}[-/](0[1-9]|1[0-2])", r"(0?[1-9]|1[0-2])/\d{4}", r"\d{4}m(1[0-2]|[1-9])", r"\d{4}M(0[1-9]|1[0-2])",
    r"\d{4}[ :-]?[Qq][1-4]", r"[Qq][1-4][ /-]?\d{4}", rf"({NAMED})\.?[- /]?\d{{4}}", rf"\d{{4}}[- ]?({NAMED})",
)  # fmt: skip
_WITH_TIME = rf"{COMPACT}[ T_-]\d\d:?\d\d(:?\d\d)?Z?"
STAMP = re.compile(rf"(({'|'.join(DATES)})({TIME})?|{'|'.join(PERIODS)}|{_WITH_TIME})$", re.I)
ORDERED = re.compile(r"(\d\d?)[/ .-](\d\d?)[/ .-](\d{4}|\d\d)(?!\d)")  # by day or month first
REGULAR = 0.9  # share of the steps that are alike, where months are dates
_MONTH = re.compile(r"(1[5-9]|20)\d\d(0[1-9]|1[0-2])$")
_DIGITS = re.compile(rf"{COMPACT}(([01]\d|2[0-3])([0-5]\d){{0,2}})?$")


def are_compact(cells: list[str]) -> bool:
    """Whether cells of digits are dates, 20180131 or 201801311345: of one length, and they go by; or months, 201801.

    >>> are_compact(["20180131", "20180201"]), are_compact(["20180131", "20181301"])
    (True, False)
    >>> are_compact(["201811", "201812", "201901"]), are_compact(["201811", "201812", "201813"])
    (True, False)
    """
    if len(cells) > 2 and all(map(_MONTH.match, cells)):
        months = [12 * int(cell[:4]) + int(cell[4:]) for cell in cells]
        steps = [b - a for a, b in pairwise(months)]
        return steps.count(steps[0]) >= REGULAR * len(steps) and 0 < abs(steps[0]) <= 12
    return (
        len(set(cells)) > 1
        and len({len(cell) for cell in cells}) == 1
        and all(map(_DIGITS.match, cells))
        and (sorted(cells) == cells or sorted(cells, reverse=True) == cells or len(cells[0]) > 8)
    )


def counted(values, is_known: bool = False):
    """Return seconds since 1970 of numbers that count time on a calendar; None where they may be numbers of any kind.

    Milli-, micro- or nanoseconds since 1970 of this century, whole; days of a spreadsheet with times of day, which are
    whole seconds and no short decimals. ``is_known``: that they are dates was seen in other rows.

    >>> [None if found is None else found.tolist()
    ...  for found in (counted([1.7e12, 1.700000001e12]), counted([45000.041667, 45000.083333]), counted([45000.5]))]
    [[1700000000.0, 1700000001.0], [1678842000.0, 1678845600.0], None]
    """
    import numpy as np

    values = np.asarray(values, float)
    seen = values[np.isfinite(values)]
    if not seen.size:
        return None
    low, high = seen.min(), seen.max()
    for unit in (1e3, 1e6, 1e9):
        if CENTURY[0] * unit <= low and high < CENTURY[1] * unit and (seen % 1 == 0).all():
            return values / unit
    if not (DAYS[0] <= low and high < DAYS[1]):
        return None
    rest = np.abs(np.rint(seen * 86400) - seen * 86400)
    is_short = np.abs(np.rint(seen * 1e3) - seen * 1e3) < 1e-6
    if (rest < 0.06).all() and (is_known or np.mean(is_short) < 0.5):
        return np.rint((values - EPOCH) * 86400)
    return None


def iso(cells, day_first: bool):
    """Return text cells of dates, a pyarrow array, as ISO 8601 text; ``day_first``: 1/2/2024 is in February.

    A month stands for its first day, a quarter for that of its first month.

    >>> import pyarrow as pa
    >>> iso(pa.array(["31.12.2024 9:45", "01JAN2018:00:00:00", "2018Q2", "01 02 2018 00:00"]), True).to_pylist()
    ['2024-12-31 09:45', '2018-01-01 00:00:00', '2018-04-01', '2018-02-01 00:00']
    """
    import pyarrow.compute as pc

    def change(pairs):
        nonlocal cells
        for old, new in pairs:
            cells = pc.replace_substring_regex(cells, old, new)

    if pc.any(pc.match_substring_regex(cells, r"(?i)[a-z]{3}|[0-9][mqQ][0-9]|[Qq][1-4]")).as_py():
        change(_NAMED)
    if pc.any(pc.match_substring_regex(cells, "^[0-9]{6,8}")).as_py():
        change(_COMPACTED)
    day, month = (1, 2) if day_first else (2, 1)
    change(_PLAIN)
    change(
        [
            (r"^(\d\d?)[/ .-](\d\d?)[/ .-](\d{4})", rf"\3-\{month}-\{day}"),
            (r"^(\d\d?)[/.](\d\d?)[/.](\d\d)([ :]|$)", rf"20\3-\{month}-\{day}\4"),
            (r"^(\d{4})-(\d)-", r"\1-0\2-"),
            (r"^(\d{4}-\d\d)-(\d)([^\d]|$)", r"\1-0\2\3"),
            (r"^(\d{4}-\d\d-\d\d)[ T:]+(\d):", r"\1 0\2:"),
            (r"^(\d{4}-\d\d-\d\d):+", r"\1 "),
            (r"^(\d{4}-\d\d-\d\d)  +", r"\1 "),
            (r"\s*(UTC|GMT)$", "Z"),
        ]
    )
    if pc.any(pc.match_substring_regex(cells, r"[AaPp]\.?[Mm]\.?$")).as_py():
        change(_HALVES)
    return cells


_NAMED = [
    pair
    for number, names in enumerate(MONTHS, 1)
    for pair in (
        (rf"(?i)^(\d\d?)[- /.]?({names})\.?[- /,]?\s?(\d{{4}})", rf"\3-{number:02d}-\1"),
        (rf"(?i)^(\d\d?)[- /.]?({names})\.?[- /,]?\s?(\d\d)([^\d]|$)", rf"20\3-{number:02d}-\1\4"),
        (rf"(?i)^({names})\.?[- /](\d\d?),?[- /](\d{{4}})", rf"\3-{number:02d}-\2"),
        (rf"(?i)^(\d{{4}})[- ]({names})[- ](\d\d?)", rf"\1-{number:02d}-\3"),
        (rf"(?i)^({names})\.?[- /]?(\d{{4}})$", rf"\2-{number:02d}-01"),
        (rf"(?i)^(\d{{4}})[- ]?({names})$", rf"\1-{number:02d}-01"),
    )
] + [(r"^(\d{4})[mM]0?(\d{1,2})$", r"\1-\2-01")]
_NAMED += [(rf"^(\d{{4}})[ :-]?[Qq]{q}$", rf"\1-{3 * q - 2:02d}-01") for q in range(1, 5)]
_NAMED += [(rf"^[Qq]{q}[ /-]?(\d{{4}})$", rf"\1-{3 * q - 2:02d}-01") for q in range(1, 5)]
_COMPACTED = [
    (r"^(\d{4})(\d\d)(\d\d)([ T_-])?(\d\d):?(\d\d):?(\d\d)?(Z?)$", r"\1-\2-\3 \5:\6:\7\8"),
    (r"^(\d{4})(\d\d)(\d\d)(\d\d)$", r"\1-\2-\3 \4:00"),
    (r":(Z?)$", r"\1"),
    (r"^(\d{4})(\d\d)(\d\d)$", r"\1-\2-\3"),
    (r"^(\d{4})(\d\d)$", r"\1-\2-01"),
]
_PLAIN = [
    (r"^(\d{4})[/. ](\d+)[/. ](\d+)", r"\1-\2-\3"),
    (r"^(\d{4})[-/](\d\d)$", r"\1-\2-01"),
    (r"^(\d{1,2})/(\d{4})$", r"\2-\1-01"),
]
_HALVES = [
    (r"\.?\s*([AaPp])\.?[Mm]\.?$", r" \1M"),
    (r"[ T]12(:[0-9:.]+)\s*[Aa]M$", r" 00\1"),
    (r"\s*[Aa]M$", ""),
    *((rf"[ T]{hour:02d}(:[0-9:.]+)\s*[Pp]M$", rf" {hour + 12}\1") for hour in range(1, 12)),
    (r"\s*[Pp]M$", ""),
]
