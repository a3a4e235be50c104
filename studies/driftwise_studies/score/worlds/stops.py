"""Outputs that rest at a level and then leave it at once: a pump stops, a valve closes.

A plant of order 1 to 3 about its level, with inputs or without. A few times in a record the level is another within one
to three samples, 10 to 50 noise deviations away, and often it comes back. While it rests, nothing but the noise tells
what a lag counts for. Outputs are about the mean of their first samples, as `driftwise run` has them.

Run: python -m driftwise_studies.score.worlds.stops
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np

import driftwise as dw

from .field import geometric, table

SETTLED = 100  # samples before the first stop, at least
SCORED = 50  # samples that are not scored
ORDERS = 1, 3, 8  # of the models
MEMORIES = dw.memory.AutoMemory(), dw.memory.Constant()


class Stops(NamedTuple):
    """A record: y (T,), u (T, k), when its level began to leave (J,), and the deviation of its noise."""

    y: np.ndarray
    u: np.ndarray
    stops: np.ndarray
    sigma: float


class Errors(NamedTuple):
    """What a model's predictions came to."""

    ratio: float  # rms error, over that of the last value
    after: float  # the same, of the ten samples from each stop on
    outside: float  # farthest that a prediction was outside the range of y up to its sample, over the width of that


def draw(seed: int, number: int, samples: int = 800) -> Stops:
    """Return a record that rests, goes elsewhere at once, and rests."""
    rng = np.random.default_rng((seed, number))
    order, inputs, sigma = int(rng.integers(1, 4)), int(rng.integers(0, 3)), 10 ** rng.uniform(-1, 1)
    a, b = -np.poly(rng.uniform(-0.3, 0.8, order))[1:], sigma * rng.uniform(-3, 3, inputs)
    level, stops, t = np.zeros(samples), list[int](), SETTLED + int(rng.integers(0, 200))
    while t < samples - 20:
        stops.append(t)
        here = there = level[t - 1]
        if here == 0.0 or rng.random() < 0.3:
            there = rng.choice([-1, -1, 1]) * sigma * rng.uniform(10, 50)
        else:
            there = 0.0
        width = int(rng.integers(1, 4))
        level[t : t + width] = here + (there - here) * np.arange(1, width + 1) / width
        level[t + width :] = there
        t += int(rng.integers(10, 250))
    u, e, about = rng.standard_normal((samples, inputs)), sigma * rng.standard_normal(samples), np.zeros(samples)
    for t in range(samples):
        past = [about[t - 1 - i] if t > i else 0.0 for i in range(order)]
        about[t] = a @ past + (u[t - 1] @ b if t else 0.0) + e[t]
    y = level + about
    return Stops(y - y[:SCORED].mean(), u, np.array(stops), sigma)


def predictions(record: Stops, order: int, memory) -> np.ndarray:
    """Return what an `ARX` with an offset predicts."""
    inputs = record.u.shape[1]
    estimator = dw.ARX(order, [1] * inputs, offset=True, memory=memory)
    return estimator.scan(record.y, record.u if inputs else None).prediction


def errors(record: Stops, prediction: np.ndarray) -> Errors:
    """Return what predictions came to."""
    y, rows = record.y, np.arange(len(record.y)) >= SCORED
    after = np.zeros(len(y), bool)
    for t in record.stops:
        after[t : t + 10] = True
    last = np.append(y[0], y[:-1])
    low, high = np.minimum.accumulate(y), np.maximum.accumulate(y)
    outside = np.maximum(low - prediction, prediction - high) / np.maximum(high - low, record.sigma)
    e2, last2 = (y - prediction) ** 2, (y - last) ** 2
    ratio, close = (float(np.sqrt(e2[some].mean() / last2[some].mean())) for some in (rows, after))
    return Errors(ratio, close, max(float(outside[rows].max()), 0.0))


def main(arguments=None) -> None:
    """Print what memories come to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--records", type=int, default=60)
    asked = parser.parse_args(arguments)
    records, rows = [draw(asked.seed, k) for k in range(asked.records)], []
    for order in ORDERS:
        for memory in MEMORIES:
            found = [errors(one, predictions(one, order, memory)) for one in records]
            ratio, after, outside = (np.array(values) for values in zip(*found))
            numbers = geometric(ratio), ratio.max(), geometric(after), np.mean(outside > 0.3), outside.max()
            rows.append([f"{order}", type(memory).__name__, *(f"{v:.2f}" for v in numbers)])
    head = "order", "memory", "rms over last value's", "worst", "after a stop", "outside by .3", "farthest outside"
    print(table(head, rows))


if __name__ == "__main__":
    main()
