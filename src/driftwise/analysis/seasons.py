"""Which seasons a clock suggests: a day and a week of hours, a week of days, a year of months."""

from __future__ import annotations

import math

import numpy as np

from ..estimators.seasonal.estimator import season_lengths
from ..results.numbers import listed
from ..tables.clock import DAY
from ..tables.recognise import Table

SEASONS = (
    ("day", DAY, 4, 288),
    ("week", 7 * DAY, 7, 672),
    ("year", 365.2425 * DAY, 4, 12),
)  # what comes again, its seconds, and the fewest and most samples that it may be
NEAR = 0.005  # of a season, by which it may be no whole number of samples
SEEN = 3  # seasons that a record must hold


def of_clock(dt: float) -> tuple[int, ...]:
    """Return the seasons that are usual at such a distance of samples, in samples.

    >>> of_clock(3600.0), of_clock(86_400.0), of_clock(900.0), of_clock(1.0)
    ((24, 168), (7,), (96, 672), ())
    """
    return tuple(s for _, s in _named(dt))


def of_table(table: Table) -> tuple[int, ...]:
    """Return those of a table's clock; none without a unit, or where samples are no equal parts of a week."""
    is_even = table.sampling.kind != "irregular" and table.sampling.rest is None
    return of_clock(table.dt) if table.timed and is_even else ()


def checked(season) -> tuple[int, ...] | None:
    """Return seasons that a user says, in samples, as they are kept; None: the clock says."""
    return None if season is None else season_lengths(season) if season != () else ()


def held(seasons, samples: int) -> tuple[int, ...]:
    """Return those that so many measured outputs hold several times."""
    return tuple(s for s in seasons if SEEN * s <= samples)


def unseasoned(x, seasons) -> np.ndarray:
    """Return a column (T,) without the seasons that it has: means about the mean of a season, by BIC.

    >>> t, rng = np.arange(240), np.random.default_rng(0)
    >>> x = rng.normal(size=240)
    >>> left = unseasoned(x + 5 * np.cos(2 * np.pi * t / 12), (12,))
    >>> float(np.std(left - x)) < 0.4, unseasoned(x, (12,)) is x
    (True, True)
    """
    for season in held(seasons, int(np.isfinite(x).sum())):
        there = np.flatnonzero(np.isfinite(x))
        if len(np.unique(there % season)) < season:  # of some phase nothing is known
            continue
        from scipy.ndimage import uniform_filter1d  # a sixth of what a table's first answer imports

        whole = np.interp(np.arange(len(x)), there, x[there])
        about = whole - uniform_filter1d(whole, season, mode="nearest")
        means = np.array([about[there[there % season == phase]].mean() for phase in range(season)])
        means -= means.mean()
        again = means[np.arange(len(x)) % season]
        rows = len(there)
        before, after = (float(np.sum(part[there] ** 2)) for part in (about, about - again))
        if rows * math.log(max(after, 1e-300) / max(before, 1e-300)) + season * math.log(rows) < 0.0:
            x = x - again
    return x


def season_words(seasons, table: Table) -> str:
    """Return seasons by their samples, and by their names where a clock has them: a season of 12 samples (a year)."""
    names = {s: name for name, s in _named(table.dt)} if table.timed else {}
    said = [f"{s} samples" + (f" (a {names[s]})" if s in names else "") for s in seasons]
    return f"{'A season' if len(said) == 1 else 'Seasons'} of {listed(said)}"


def _named(dt: float) -> list[tuple[str, int]]:
    """Return name and samples of each usual season."""
    found = [(name, round(span / dt), span / dt, least, most) for name, span, least, most in SEASONS]
    return [(name, s) for name, s, exact, least, most in found if least <= s <= most and abs(exact - s) <= NEAR * s]
