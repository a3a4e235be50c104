"""Kinds where a long model that forgets nothing is right: what is seldom violent, and never changes."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from .kinds import kind
from .signals import samples


@kind
def catchment(rng):
    """A river fed by gauges through storages that never change; floods are rare, and most of the errors."""
    T, k = samples(rng) + 1500, int(rng.integers(2, 4))
    common = rng.exponential(1, T) ** rng.uniform(1, 2) * (rng.random(T) < rng.uniform(0.05, 0.4))
    gauges = [common * np.exp(rng.uniform(0.1, 0.8) * rng.standard_normal(T)) for _ in range(k)]
    flow = np.full(T, 0.05)
    for rain in gauges:
        fast, slow, base = rng.uniform(0.2, 0.7), rng.uniform(0.8, 0.95), rng.uniform(0.98, 0.998)
        late = np.r_[np.zeros(2), rain ** rng.uniform(1, 1.3)][:T]
        for pole, share in ((fast, 1.0), (slow, rng.uniform(0.05, 0.5)), (base, rng.uniform(0.01, 0.1))):
            flow = flow + rng.uniform(0.2, 1) * share * lfilter([1 - pole], [1, -pole], lfilter([0.6, 0.4], [1], late))
    flow *= np.exp(rng.uniform(0.005, 0.08) * rng.standard_normal(T))
    q = np.median(flow) * 10 ** rng.uniform(-3, -1.5)
    return np.round(flow / q) * q, np.stack(gauges, 1)


@kind
def piston(rng):
    """A piston moved by a valve and its load: pressure that builds up, friction, rests that are exact, restarts."""
    T = samples(rng) + 600
    u, t = np.zeros((T, 2)), 0
    busy, rest = np.exp(rng.uniform(np.log(20), np.log(300))), np.exp(rng.uniform(np.log(20), np.log(600)))
    while t < T:
        end = t + int(rng.exponential(busy)) + 10
        while t < min(end, T):
            n = int(rng.integers(3, 40))
            u[t : t + n, 0] = rng.uniform(-2, 2)
            t += n
        u[min(end, T) :, 0] = 0.0
        t = end + int(rng.exponential(rest)) + 10
    u[:, 1] = lfilter([0.05], [1, -0.95], np.abs(u[:, 0]) + 0.2 * rng.standard_normal(T) * (u[:, 0] != 0))
    fill, leak, mass = rng.uniform(0.05, 0.6), rng.uniform(0.01, 0.3), rng.uniform(0.1, 0.9)
    stick, slide, dead = rng.uniform(0, 0.5), rng.uniform(0, 0.3), rng.uniform(0, 0.3)
    heat, warm = rng.uniform(0, 0.5), 0.0
    p, v, y = 0.0, 0.0, np.zeros(T)
    for t in range(T):
        y[t] = v
        valve = np.sign(u[t, 0]) * max(abs(u[t, 0]) - dead, 0.0)
        warm += 0.003 * (abs(v) - warm)
        p += fill * valve * np.sqrt(max(1.2 - 0.3 * abs(p), 0.1)) - leak * p
        force = p - rng.uniform(0.1, 0.2) * u[t, 1] * np.sign(v)
        v = (
            0.0
            if abs(v) < 1e-3 and abs(force) < stick
            else mass * v + (1 - mass) * (force - slide / (1 + heat * warm) * np.sign(v or force))
        )
    q = y.std() * 10 ** rng.uniform(-3, -1.5)
    return np.round((y + q * rng.uniform(0, 2) * rng.standard_normal(T)) / q) * q, u
