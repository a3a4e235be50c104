"""Boats beside each other, whose plots a study gives to the nearest: what the mean NIS of such a track can be.

Two boats go side by side, 8 to 28 m apart; a marine radar sees each of them in most scans. Each boat is given the plot
of the scan that is nearest to its truth, as with recordings: in a scan that misses it, that is its neighbour's.

A track of n plots, one of them z squared deviations off, has a mean NIS of (1 + z/n)/f under forecasts f times as wide.
Whoever wants at most 3 of it has f = (1 + z/n)/3 on every plot, since nobody knows which it will be, and 1/f where no
such plot comes. The last two columns are this f for .95 of the series, and the median NIS of all other plots then.

Run: python -m driftwise_studies.score.motions.neighbours [--seed 0] [--scenes 60]
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...papers import fixed_filters as filters
from ...papers.recordings import NEAR, Series
from ..board import SKIP
from ..ours import tracked
from .drawing import asked, between
from .field import MOST_NIS, number, table
from .scene import KINDS

BOAT = KINDS["boat"]
SCAN, DEVIATION, SEEN, PLOTS = (1.5, 3.5), (0.5, 4.0), (0.6, 0.95), (40, 90)
APART = 8.0, 28.0  # m
SWAY, SLIP = 20.0, 0.3  # s, by which a course wanders by what a boat accelerates; m/s, of one boat along the other
HEAD = (
    "who forecasts", "series", "NIS, median", "above 3", "without plots of the neighbour", "without the farthest plot",
    "wider by", "NIS of the others then",
)  # fmt: skip


class Given(NamedTuple):
    """One coordinate of a boat's plots."""

    series: Series
    others: np.ndarray  # (T,) which are its neighbour's


def draw(seed: int, number: int) -> list[Given]:
    """Return both coordinates of both boats of scene ``number``: four series."""
    rng = np.random.default_rng([seed, number, 33])
    scan, deviation = between(rng, SCAN), between(rng, DEVIATION)
    n = int(rng.integers(*PLOTS))
    time, speed = scan * np.arange(n), between(rng, BOAT.speed)
    turn = between(rng, BOAT.acceleration) / speed * np.sqrt(scan / SWAY)
    course = rng.uniform(0, 2 * np.pi) + np.cumsum(turn * scan * rng.standard_normal(n))
    ahead = np.stack([np.sin(course), np.cos(course)], axis=1)
    first = np.cumsum(speed * scan * ahead, axis=0)
    beside = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1) * rng.uniform(*APART)
    second = first + beside + ahead * (SLIP * rng.standard_normal() * (time - time[n // 2]))[:, None]
    truth = np.stack([first, second], axis=1)  # (T, boat, coordinate)
    plots = truth + deviation * rng.standard_normal(truth.shape)
    plots[rng.random((n, 2)) >= rng.uniform(*SEEN)] = np.nan
    found = []
    for k in range(2):
        off = np.hypot(*np.moveaxis(plots - truth[:, k : k + 1], 2, 0))
        off[~np.isfinite(off)] = np.inf
        which, given = off.argmin(axis=1), off.min(axis=1) <= NEAR
        whose, where = which[given], plots[given, which[given]]
        found += [Given(Series(f"{number}, boat {k}", time[given], y), whose != k) for y in where.T]
    return found


def row(name: str, drawn: list[Given], squares: list[np.ndarray]) -> list[str]:
    """Return the cells of one who forecasts; ``squares`` are e^2/variance of each series."""
    late = [z[SKIP:] for z in squares]
    means = np.array([np.mean(z) for z in late])
    own = np.array([np.mean(z[~one.others[SKIP:]]) for one, z in zip(drawn, late)])
    most = np.array([np.mean(np.sort(z)[:-1]) for z in late])
    wider = max(float(np.quantile(means, 0.95)) / MOST_NIS, 1.0)
    shares = (float(np.mean(part > MOST_NIS)) for part in (means, own, most))
    return [
        name, f"{len(drawn)}", number(float(np.median(means)), 2), *map(number, shares), number(wider, 2),
        number(float(np.median(own)) / wider, 2),
    ]  # fmt: skip


def main(arguments=None) -> None:
    """Print the table: ours, and the fixed filters that are tuned on these very series."""
    seed, scenes = asked(__doc__, arguments, scenes=60)
    drawn = [one for k in range(scenes) for one in draw(seed, k)]
    series = [one.series for one in drawn]
    ours = [one for pair in zip(series[::2], series[1::2]) for one in tracked(*pair, BOAT.told)]
    rows = [row("ours", drawn, [(s.y - o.prediction) ** 2 / o.variance for s, o in zip(series, ours)])]
    for method in ("constant velocity", "IMM"):
        logs = filters.tuned(method, series, BOAT.told, BOAT.acceleration[1])
        said = [filters.forecast(method, logs, s, BOAT.told, BOAT.acceleration[1]) for s in series]
        squares = [(s.y - f.prediction) ** 2 / f.variance for s, f in zip(series, said)]
        rows.append(row(f"{method}, tuned on all of them", drawn, squares))
    alone = []
    for pair in zip(series[::2], series[1::2]):
        logs = filters.tuned("constant velocity", list(pair), BOAT.told, BOAT.acceleration[1])
        said = [filters.forecast("constant velocity", logs, s, BOAT.told, BOAT.acceleration[1]) for s in pair]
        alone += [(s.y - f.prediction) ** 2 / f.variance for s, f in zip(pair, said)]
    rows.append(row("constant velocity, tuned on each boat", drawn, alone))
    print(table(rows, HEAD))


if __name__ == "__main__":
    main()
