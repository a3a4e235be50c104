"""Whether dates such as 1/2/2024 begin with the day or with the month."""

from __future__ import annotations

import re
from datetime import date
from itertools import pairwise
from statistics import median

from .dates import ORDERED

ALIKE = 0.1  # of the usual step, by which another may differ: months have 28 to 31 days


def day_order(rows: list[list[str]], later: list[list[str]]) -> tuple[bool, bool]:
    """Return whether the day stands first in dates such as 1/2/2024, and whether anything says so.

    What exceeds 12 is the day, in any of the cells. Where nothing does, dates with dots begin with it, and others of
    ``rows``, which follow each other, are as far apart from each other by the right reading as they can be alike: it
    never goes back, and steps as usual. Of two readings that are alike what changes more often is the day; else those
    with am and pm are American.

    >>> day_order([[f"01/{month:02d}/{year}"] for year in (2020, 2021) for month in range(1, 13)], [])
    (True, True)
    >>> day_order([["02/01/2020"], ["02/02/2020"]], [["02/13/2020"]]), day_order([["02/01/2020 10:00"]], [])
    ((False, True), (True, False))
    >>> day_order([["01.02.2020"], ["01.03.2020"]], []), day_order([["01.02.2020"], ["01.03.2020"]], [["01.13.2020"]])
    ((True, True), (False, True))
    """
    dates = [[(j, match) for j, cell in enumerate(row) if (match := ORDERED.match(cell))] for row in (*rows, *later)]
    every = [match for row in dates for _, match in row]
    first, second = ({int(match[j]) for match in every} for j in (1, 2))
    if max(first | {0}) > 12 or max(second | {0}) > 12:
        return max(first) > 12, True
    cells = [match.string for match in every]
    if all("." in cell.split()[0] for cell in cells):
        return True, True
    column = next((j for row in dates[: len(rows)] for j, _ in row), 0)
    said = [match for row in dates[: len(rows)] for j, match in row if j == column]
    by_day, by_month = (_alike(said, day_first) for day_first in (True, False))
    if by_day != by_month:
        return by_day > by_month, True
    if len(first) != len(second):
        return len(first) > len(second), True
    is_american = any(cell[-1] in "mM" for cell in cells)
    return not is_american, is_american or not cells


def _alike(dates: list[re.Match[str]], day_first: bool) -> tuple[int, float]:
    """Return less the steps from date to date that go back, and the share of those that are the usual one.

    Those to the same date are none.
    """
    days = []
    for match in dates:
        a, b, year = (int(part) for part in match.groups())
        try:
            days.append(date(year + 2000 * (year < 100), *((b, a) if day_first else (a, b))).toordinal())
        except ValueError:  # 0/0/2024: no date either way
            continue
    steps = [after - before for before, after in pairwise(days) if after != before]
    if not steps:
        return 0, 0.0
    way = 1 if sum(steps) > 0 else -1
    usual = median(way * step for step in steps)
    alike = sum(abs(way * step - usual) <= ALIKE * abs(usual) for step in steps)
    return -sum(way * step < 0 for step in steps), alike / len(steps)
