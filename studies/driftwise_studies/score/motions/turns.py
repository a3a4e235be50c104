"""Turns at a rate, as an aircraft flies them: how many are told, and how soon, by scan and by the radar's error.

Run: python -m driftwise_studies.score.motions.turns
Options: --seed 0 --flights 12 --speeds (the same of changes of the speed)
"""

from __future__ import annotations

import argparse

import numpy as np

from driftwise.tracking import TrackEstimator

from .field import table
from .measured import AFTER, WARY, within

SCANS, DEVIATIONS, RATES = (1.0, 2.0, 4.0), (10.0, 30.0, 50.0), (1.5, 3.0)  # s, m, degrees a second
SPEEDS, STRAIGHT, TURNING, TURNS = (120.0, 240.0), (60.0, 120.0), (20.0, 60.0), 4  # m/s, s, s, of a flight
BRAKING, CHANGES = (1.0, 3.0), (40.0, 80.0)  # m/s^2, m/s
STEP = 0.25  # s, of the truth
HEAD = "scan, s", "deviation, m", "degrees a second", "told", "delay, s, median of all", "false onsets, of 1000"


def fly(rng: np.random.Generator, scan: float, deviation: float, rate: float, is_speed: bool = False):
    """Return times (T,), plots (T, 2) and the turns of a flight: straight, then turning, each way as likely.

    ``is_speed``: it brakes and hurries in turn, by ``rate``, m/s^2, and goes straight on.
    """
    speed, rates, edges = rng.uniform(*SPEEDS), list[float](), list[float]()
    least, most = (change / rate for change in CHANGES) if is_speed else TURNING
    for number in range(TURNS):
        way = (-1.0, 1.0)[number % 2] if is_speed else rng.choice([-1.0, 1.0])
        for low, high, w in ((*STRAIGHT, 0.0), (least, most, way * (rate if is_speed else np.radians(rate)))):
            edges.append(len(rates) * STEP)
            rates += [w] * int(rng.uniform(low, high) / STEP)
    course, changed = rng.uniform(0, 2 * np.pi), np.cumsum(rates) * STEP
    courses, speeds = (course + 0.0 * changed, speed + changed) if is_speed else (course + changed, speed)
    place = np.cumsum(speeds * STEP * np.stack([np.cos(courses), np.sin(courses)]), axis=1).T
    seen = np.arange(0, len(place), int(scan / STEP))
    ends = [*edges[2::2], len(rates) * STEP]
    return seen * STEP, place[seen] + deviation * rng.standard_normal((len(seen), 2)), list(zip(edges[1::2], ends))


def told(seed: int, flights: int, scan: float, deviation: float, rate: float, is_speed: bool = False) -> list[str]:
    """Return the row of a table."""
    delays, false, quiet = list[float](), 0, 0
    for number in range(flights):
        time, plots, turns = fly(np.random.default_rng([seed, number]), scan, deviation, rate, is_speed)
        onset = TrackEstimator("aircraft").scan(time, plots).onset
        for begin, end in turns:
            hits = time[onset & (time >= begin) & (time <= end + AFTER * scan)]
            delays.append(float(hits[0] - begin) if len(hits) else np.inf)
        calm = ~within(time, [(begin, end + WARY * scan) for begin, end in turns])
        false, quiet = false + int(np.sum(onset & calm)), quiet + int(calm.sum())
    median = float(np.median(delays))
    return [
        f"{scan:g}", f"{deviation:g}", f"{rate:g}", f"{np.mean(np.isfinite(delays)):.2f}",
        f"{median:.1f}" if np.isfinite(median) else "most are not told", f"{1000 * false / max(quiet, 1):.2f}",
    ]  # fmt: skip


def main(arguments=None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--flights", type=int, default=12)
    parser.add_argument("--speeds", action="store_true", help="of changes of the speed")
    asked = parser.parse_args(arguments)
    rates = BRAKING if asked.speeds else RATES
    every = [(scan, deviation, rate) for scan in SCANS for deviation in DEVIATIONS for rate in rates]
    head = (*HEAD[:2], "m/s^2", *HEAD[3:]) if asked.speeds else HEAD
    print(table([told(asked.seed, asked.flights, *one, asked.speeds) for one in every], head))


if __name__ == "__main__":
    main()
