"""Drawn ships that say where they are: moored, at anchor, under way, as often as AIS has it, on a lattice of degrees.

A ship rests at its berth, swings about its anchor, casts off, and goes from leg to leg: speed and turn rate follow what
is ordered by time constants of their own (Nomoto 1957). The time to its next report depends on speed and turn (ITU-R
M.1371: three minutes at rest to two seconds), and reports are lost. Errors of its receiver stay for a minute or two.

Ours are told the class alone; the opponents are the fixed filters of the recorded tracks, tuned on all drawn ships in
hindsight.

Run: python -m driftwise_studies.score.motions.ships [--seed 0] [--scenes 60]
"""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

import numpy as np

from driftwise.estimators.track.estimator import TrackEstimator
from driftwise.tracking.frames import east_north, geographic

from ...papers import fixed_filters as filters
from ...papers.recordings import Series
from .drawing import asked, between
from .field import mean, number, table
from .measured import NORMAL_95
from .simulation import PLACE

TOLD = 8.0  # m/s, what is fast for a boat
SKIP = 10  # plots that are not scored
V0, A0 = 8.0, 5.0  # what fixed filters may assume of speed and acceleration, as of recorded ships
KNOT = 0.514
AT_REST, SLOW, FAST = 2.0 * KNOT, 14.0 * KNOT, 23.0 * KNOT
TURNS = np.radians(0.2)  # rad/s, beyond which a ship reports that it changes course
REPORTS = {  # s between two: at rest, slow, faster, fastest; and what of that remains while it turns
    "A": ((180.0, 10.0, 6.0, 2.0), 1 / 3),
    "B": ((180.0, 30.0, 15.0, 5.0), 1.0),
}
LATTICES = 1e-4 / 60, 1e-5, 1e-4, 1e-2 / 60  # degrees
MOORED, ANCHORED, WAY, TURN, SPEED = "moored", "anchored", "way", "turn", "speed"


class Ship(NamedTuple):
    """A drawn ship's reports with their truth."""

    time: np.ndarray  # (T,) s
    plots: np.ndarray  # (T, 2) m
    truth: np.ndarray
    velocity: np.ndarray
    leaves: np.ndarray  # (T,) whether it left its rest within the last ten reports
    turns: np.ndarray  # (T,) whether it turns


def draw(seed: int, number: int) -> Ship:
    """Return ship ``number`` of ``seed``.

    Examples
    --------
    >>> from driftwise_studies.score.motions import ships
    >>> ship = ships.draw(0, 28)
    >>> len(ship.time), int(ship.leaves.sum())
    (120, 10)
    """
    rng = np.random.default_rng([seed, number, 30])
    wanted = int(between(rng, (40.0, 400.0)))
    reports, remains = REPORTS["A" if rng.random() < 0.6 else "B"]
    lost = rng.uniform(0.0, 0.5)
    position, velocity, rate, phase = voyage(rng, wanted)
    stamps: list[float] = []
    k = float(rng.uniform(0, 10))
    while len(stamps) < wanted and k < len(position) - 1:
        i, speed = int(k), float(np.hypot(*velocity[int(k)]))
        if len(stamps) < 3 or rng.random() >= lost:
            stamps.append(k)
        waits = phase[i] in (MOORED, ANCHORED) or speed < AT_REST
        every = reports[0 if waits else int(np.searchsorted((SLOW, FAST), speed)) + 1]
        every *= remains if not waits and abs(rate[i]) > TURNS else 1.0
        k += every * rng.uniform(0.97, 1.03)
    time = np.array(stamps)
    clock = np.arange(len(position), dtype=float)
    truth, speeds = (np.stack([np.interp(time, clock, c) for c in table.T], 1) for table in (position, velocity))
    which = time.astype(int)
    wrong = receiver(rng, time)
    lattice = rng.choice(LATTICES)
    degrees = lattice * np.round(geographic(truth + wrong, PLACE) / lattice)
    plots = east_north(degrees[:, 0], degrees[:, 1], PLACE)
    rests = np.isin(phase[which], (MOORED, ANCHORED))
    since, n = np.empty(len(time), int), 99
    for j, r in enumerate(rests):
        n = since[j] = 0 if r else n + 1
    return Ship(time, plots, truth, speeds, (since > 0) & (since <= 10), ~rests & (np.abs(rate[which]) > TURNS))


def voyage(rng, wanted: int):
    """Return position, velocity, turn rate and phase of a ship, second by second."""
    small = rng.random() < 0.5
    fastest = between(rng, (4.0, 14.0))
    yaws, gathers = between(rng, (3.0, 15.0) if small else (10.0, 60.0)), between(rng, (10.0, 120.0))
    sharpest = np.radians(between(rng, (1.0, 6.0) if small else (0.2, 1.2)))
    ordered, phases = [], []
    at, speed, phase = 0.0, between(rng, (2.0, fastest)), WAY
    if rng.random() < 0.5:
        phase = MOORED if rng.random() < 0.6 else ANCHORED
    limit = 120.0 * wanted
    while at < limit:
        turn = 0.0
        if phase in (MOORED, ANCHORED):
            lasts, speed = between(rng, (600.0, 7200.0)), 0.0
        elif phase == TURN:
            turn = rng.choice([-1.0, 1.0]) * between(rng, (0.2 * sharpest, sharpest))
            lasts = between(rng, (0.3, 2 * np.pi)) / abs(turn)
        else:
            if speed == 0.0 or phase == SPEED:
                speed = between(rng, (1.0, fastest))
            lasts = between(rng, (30.0, 1200.0))
        ordered.append((int(lasts), speed, turn))
        phases += [phase] * int(lasts)
        at += lasts
        if phase in (MOORED, ANCHORED):
            phase = WAY
        else:
            phase = str(rng.choice([WAY, TURN, SPEED, MOORED, ANCHORED], p=[0.25, 0.45, 0.2, 0.06, 0.04]))
    n, phased = len(phases), np.array(phases)
    goal, wheel = (np.repeat([o[i] for o in ordered], [o[0] for o in ordered]) for i in (1, 2))
    speeds, rate = follow(goal, gathers, goal[0]), follow(wheel, yaws, 0.0)
    rests = np.isin(phased, (MOORED, ANCHORED)) & (speeds < 0.3)
    speeds[rests] = rate[rests] = 0.0
    heading = rng.uniform(0, 2 * np.pi) + np.cumsum(rate)
    heading += np.radians(0.2) * np.cumsum(rng.standard_normal(n)) * ~rests
    velocity = speeds[:, None] * np.stack([np.sin(heading), np.cos(heading)], axis=1)
    position = np.cumsum(velocity, axis=0)
    swings = rests & (phased == ANCHORED)
    chain, period = between(rng, (15.0, 120.0)), between(rng, (300.0, 1200.0))
    angle = np.radians(rng.uniform(5, 40)) * np.sin(2 * np.pi * np.arange(n) / period)
    angle += np.cumsum(np.radians(0.03) * rng.standard_normal(n))
    bow = chain * np.stack([np.sin(angle), np.cos(angle)], axis=1)
    moved = np.where(swings[1:, None], np.diff(bow, axis=0), 0.0)
    position[1:] += np.cumsum(moved, axis=0)
    velocity[1:] += moved
    return position, velocity, rate, phased


def follow(goal: np.ndarray, lasts: float, first: float) -> np.ndarray:
    """Return what follows its goal by a time constant, second by second."""
    share = 1.0 - np.exp(-1.0 / lasts)
    return np.array(list(accumulate(goal.tolist(), lambda x, to: x + share * (to - x), initial=first))[1:])


def receiver(rng, time: np.ndarray) -> np.ndarray:
    """Return a receiver's errors: half of them stay for a while."""
    size, lasts = between(rng, (0.5, 5.0)), between(rng, (20.0, 300.0))
    noise, slow = rng.standard_normal((len(time), 2)), np.empty((len(time), 2))
    slow[0] = noise[0]
    for k, d in enumerate(np.diff(time), 1):
        kept = np.exp(-d / lasts)
        slow[k] = kept * slow[k - 1] + np.sqrt(1 - kept**2) * noise[k]
    return size * np.sqrt(0.5) * (slow + rng.standard_normal((len(time), 2)))


def opponents(ships: list[Ship]) -> list[np.ndarray]:
    """Return the forecasts of the fixed filter that is best in hindsight on all ships, one (T, 2) each."""
    series = [Series("", s.time - s.time[0], s.plots[:, i]) for s in ships for i in (0, 1)]
    found = {}
    for name in filters.STARTS:
        logs = filters.tuned(name, series, V0, A0)
        said = [filters.forecast(name, logs, s, V0, A0).prediction for s in series]
        off = [np.log(np.sqrt(np.mean((s.y - p)[SKIP:] ** 2))) for s, p in zip(series, said)]
        found[name] = float(np.mean(off)), said
    said = min(found.values(), key=lambda pair: pair[0])[1]
    return [np.stack(said[2 * k : 2 * k + 2], axis=1) for k in range(len(ships))]


class Followed(NamedTuple):
    """One ship by our tracker."""

    ratio: np.ndarray  # (2,) RMSE of each coordinate over the opponent's
    nis: float
    normal: float
    density: float
    position: float
    velocity: float
    parts: np.ndarray  # sums of squares of ours and of the opponent: leaving, turning, elsewhere


def judged(ship: Ship, other: np.ndarray) -> Followed:
    """Hold our tracker against the truth, and its forecasts against the opponent's."""
    trace = TrackEstimator(TOLD).scan(ship.time, ship.plots)
    late = slice(SKIP, None)
    ours, theirs = (ship.plots - trace.prediction)[late] ** 2, (ship.plots - other)[late] ** 2
    leaves, turns = ship.leaves[late], (ship.turns & ~ship.leaves)[late]
    parts = np.array([[e[w].sum() for e in (ours, theirs)] for w in (leaves, turns, ~leaves & ~turns)])
    held = np.abs(trace.position - ship.truth) <= NORMAL_95 * trace.position_sd
    held_v = np.abs(trace.velocity - ship.velocity) <= NORMAL_95 * trace.velocity_sd
    return Followed(
        np.sqrt(ours.mean(axis=0) / theirs.mean(axis=0)), mean(trace.nis[late]), mean(trace.normal_score[late] ** 2),
        mean(trace.log_score[late].sum(axis=1)), float(held[late].mean()), float(held_v[late].mean()), parts,
    )  # fmt: skip


def row(name: str, found: list[Followed]) -> list[str]:
    """Return the cells of a table's row."""
    ratio, parts = np.concatenate([f.ratio for f in found]), np.array([f.parts for f in found])
    nis = np.array([f.nis for f in found])
    some = (p[(p > 0).all(axis=1)] for p in np.moveaxis(parts, 1, 0))
    each = [float(np.exp(0.5 * mean(np.log(p[:, 0] / p[:, 1])))) for p in some]
    return [
        name, f"{len(found)}", number(np.exp(np.log(ratio).mean())), number(float(np.median(ratio))),
        number(ratio.max(), 2), number(mean(ratio > 1.25)), *(number(e) for e in each),
        number(mean((nis >= 0.5) & (nis <= 1.5))), number(mean(nis > 3)), number(nis.max(), 1),
        number(mean([0.5 <= f.normal <= 1.5 for f in found])), number(mean([f.density for f in found])),
        number(mean([f.position for f in found])), number(mean([f.velocity for f in found])),
    ]  # fmt: skip


HEAD = (
    "", "ships", "ratio", "median", "largest", "> 1.25", "leaving", "turning", "elsewhere", "NIS in .5 to 1.5",
    "NIS above 3", "largest", "normal score in", "density", "position", "velocity",
)  # fmt: skip


def main(arguments=None) -> None:
    """Print how drawn ships are followed."""
    seed, scenes = asked(__doc__, arguments, scenes=60)
    ships = [draw(seed, k) for k in range(scenes)]
    found = [judged(s, o) for s, o in zip(ships, opponents(ships))]
    leave = [bool(s.leaves[SKIP:].any()) for s in ships]
    rows = [("all", found), ("that leave a rest", [f for f, l in zip(found, leave) if l])]
    rows.append(("others", [f for f, l in zip(found, leave) if not l]))
    print(table([row(name, some) for name, some in rows if some], HEAD))


if __name__ == "__main__":
    main()
