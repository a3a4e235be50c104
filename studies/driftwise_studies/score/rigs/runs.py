"""Kinds that are recorded only while they run: each run ends where the next one does not begin."""

from __future__ import annotations

import numpy as np

from .kinds import kind

BREAK = 20  # rows without a reading between two runs


@kind
def batches(rng):
    """A cell that is emptied again and again to a limit, and wears out; between two runs it is filled, unrecorded."""
    runs, step = int(rng.integers(12, 60)), float(rng.uniform(5, 30))
    capacity, wear = np.exp(rng.uniform(np.log(1500), np.log(6000))), rng.uniform(0, 0.4) / runs
    currents = [1.0] if rng.random() < 0.5 else [1.0, rng.uniform(0.3, 0.8)]
    ohm, knee, slope = rng.uniform(0.03, 0.3), rng.uniform(0.02, 0.2), rng.uniform(0.1, 0.8)
    fades, ohms = np.exp(-step / np.exp(rng.uniform(np.log(10), np.log(1500), 2))), rng.uniform(0.01, 0.15, 2)
    noise, limit = 10 ** rng.uniform(-4, -2.3), rng.uniform(-1.0, -0.4) - slope
    y, u = list[float](), list[float]()
    for k in range(runs):
        full = capacity * (1 - wear * k) * np.exp(0.01 * rng.standard_normal())
        current, idle, after = float(rng.choice(currents)), int(rng.integers(1, 4)), int(rng.integers(0, 15))
        used, slow, is_on = 0.0, np.zeros(2), True
        while is_on or after > 0:
            i = current * (is_on and idle <= 0)
            left = used / full
            v = -slope * left - knee * np.exp(min((left - 0.9) / 0.04, 5.0)) - ohm * i - slow.sum()
            y.append(v + noise * rng.standard_normal())
            u.append(i + 1e-3 * rng.standard_normal())
            is_on, after, idle = is_on and v > limit, after - (not is_on), idle - 1
            used, slow = used + i * step, fades * slow + (1 - fades) * ohms * i
        y += [np.nan] * BREAK
        u += [0.0] * BREAK
    return np.round(np.array(y), 4), np.round(np.array(u), 4)[:, None]


@kind
def skipped(rng):
    """A cell as of `batches`, whose logger leaves out a reading now and then, or two."""
    y, u = batches(rng)
    lost = rng.random(len(y)) < rng.uniform(0.01, 0.05)
    lost[1:] |= lost[:-1] & (rng.random(len(y) - 1) < 0.5)
    return np.where(lost, np.nan, y), u
