"""Kinds that stand for rigs that run: controllers, actuators that stick, seasons, and readings that are not there."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from .kinds import kind
from .signals import excitation, linear, samples


@kind
def winder(rng):
    """A web between rolls under control: a tension that follows two drives, rolls out of round, slack now and then."""
    T, k = samples(rng) + 600, int(rng.integers(2, 5))
    want = np.stack([excitation(rng, T, rng.choice(["rare steps", "steps", "prbs"])) for _ in range(k)], 1)
    p, i, stiff = rng.uniform(0.02, 0.4), rng.uniform(0, 0.05), rng.uniform(0.05, 0.6)
    pull, drag = rng.uniform(-0.5, 1, k), rng.uniform(0.3, 0.95, k)
    turn = 2 * np.pi * np.cumsum(rng.uniform(0.005, 0.12) * (1 + rng.uniform(-0.5, 0.5) * np.arange(T) / T))
    round_, noise = 10 ** rng.uniform(-2.5, -0.5), 10 ** rng.uniform(-3, -1.3)
    slack, bump = rng.uniform(-3, -0.3), rng.random(T) < rng.choice([0, 1 / 300, 1 / 1000])
    speed, total, x, y, u = np.zeros(k), np.zeros(k), 0.0, np.zeros(T), np.zeros((T, k))
    for t in range(T):
        y[t] = max(x, slack) + noise * rng.standard_normal() * (1 + 3 * round_ * abs(np.sin(turn[t])))
        seen = speed.copy()
        seen[0] = y[t]
        total += want[t] - seen
        u[t] = np.clip(p * (want[t] - seen) + i * total, -3, 3)
        total -= i * total * (np.abs(u[t]) >= 3)
        speed = drag * speed + (1 - drag) * (u[t] + 0.3 * want[t])
        x += stiff * (pull @ speed + round_ * np.sin(turn[t]) - 0.5 * x)
        x += 0.3 * rng.standard_normal() if bump[t] else 0.0
    q = y.std() * 10 ** rng.uniform(-3.5, -2)
    return np.round(y / q) * q, u


@kind
def damper(rng):
    """A supply of air by a controlled valve that sticks; a fan that is off at night; outside, days."""
    T, day = int(np.exp(rng.uniform(np.log(2500), np.log(9000)))), int(rng.choice([96, 288, 720, 1440]))
    hour = np.arange(T) % day / day
    outside = 12 + 6 * np.sin(2 * np.pi * hour) + lfilter([1], [1, -0.995], 0.08 * rng.standard_normal(T))
    fan = (hour > rng.uniform(0.2, 0.4)) & (hour < rng.uniform(0.6, 0.9)) if rng.random() < 0.8 else np.ones(T, bool)
    want = 14 + np.repeat(rng.choice([0.0, 1, 2], T // day + 1), day)[:T]
    p, i, band = rng.uniform(0.02, 0.4), rng.uniform(1e-4, 0.02), rng.uniform(0, 0.15)
    pole, gain, still = rng.uniform(0.6, 0.97), rng.uniform(5, 25), rng.uniform(0.98, 0.999)
    shut = rng.random() < 0.5
    y, u, valve, total, x = np.zeros(T), np.zeros((T, 3)), 0.3, 0.0, 16.0
    e, q = 10 ** rng.uniform(-2.5, -0.7), 10 ** rng.uniform(-2, -0.7)
    for t in range(T):
        y[t] = x + e * rng.standard_normal()
        total = np.clip(total + i * (y[t] - want[t]), 0, 1) if fan[t] else total
        asked = np.clip(p * (y[t] - want[t]) + total, 0, 1) if fan[t] or not shut else 0.0
        if abs(asked - valve) > band:
            valve = asked
        u[t] = asked, outside[t], fan[t]
        flow = 0.05 + 0.95 * valve**2
        target = outside[t] + 8 - gain * flow * (1 if valve > 0.02 else 0) if fan[t] else 20.0
        a = pole if fan[t] else still
        x = a * x + (1 - a) * target
    return np.round(y / q) * q, u


@kind
def wall(rng):
    """Heat through a wall of layers: slow; a heater, sun behind clouds; a contact that is loose at times."""
    T, n = samples(rng) + 600, int(rng.integers(4, 9))
    heat = np.abs(excitation(rng, T, rng.choice(["prbs", "steps", "sines", "rare steps"])))
    sky = np.maximum(np.sin(2 * np.pi * np.arange(T) / rng.choice([48, 96, 288])), 0)
    sun = sky * np.clip(0.6 + lfilter([1], [1, -0.9], 0.3 * rng.standard_normal(T)), 0, 1)
    air = lfilter([1], [1, -0.99], 0.05 * rng.standard_normal(T)) + 2 * sky
    a, film, x, y = rng.uniform(0.02, 0.3), rng.uniform(0.02, 0.3), np.zeros(n), np.zeros(T)
    shine, at = rng.uniform(0.1, 1), int(rng.integers(0, n - 1))
    for t in range(T):
        y[t] = x[at]
        flow = a * np.diff(x)
        x[:-1] += flow
        x[1:] -= flow
        x[0] += film * (heat[t] - 0.3 * x[0])
        x[-1] += film * (air[t] + shine * sun[t] - x[-1])
    loose = lfilter([1], [1, -0.8], rng.standard_normal(T) * (rng.random(T) < rng.choice([0, 0.01]))) * 0.3
    q = y.std() * 10 ** rng.uniform(-3.5, -2)
    return np.round((y + loose * y.std() + q * rng.uniform(0, 3) * rng.standard_normal(T)) / q) * q, np.stack(
        [heat, air], 1
    )


@kind
def seasons(rng):
    """A flow with a heavy season: floods of long tails on a slow base, later years wetter or drier than the first."""
    T, year = int(np.exp(rng.uniform(np.log(2500), np.log(9000)))), int(rng.choice([365, 365, 1460]))
    wet = 0.5 + 0.5 * np.sin(2 * np.pi * np.arange(T) / year + rng.uniform(0, 6))
    trend = np.exp(rng.uniform(-1, 1) * np.arange(T) / T)
    rain = rng.exponential(1, T) ** rng.uniform(1, 2) * (rng.random(T) < 0.1 + 0.35 * wet) * trend
    soil, run, keep = 0.3, np.zeros(T), rng.uniform(0.95, 0.995)
    for t in range(T):
        soil = min(keep * soil + (1 - keep) * rain[t] * 3, 3.0)
        run[t] = rain[t] * soil ** rng.uniform(1, 2)
    flow = lfilter([1], [1, -rng.uniform(0.3, 0.9)], run) + lfilter([0.02], [1, -rng.uniform(0.97, 0.995)], run)
    flow = (flow + 0.05) * np.exp(rng.uniform(0.005, 0.05) * rng.standard_normal(T))
    seen = rain * np.exp(rng.uniform(0.05, 0.6) * rng.standard_normal(T))  # a gauge is not a catchment
    q = np.median(flow) * 10 ** rng.uniform(-3, -1.5)
    return np.round(flow / q) * q, seen[:, None]


@kind
def gaps(rng):
    """A plant whose output is read every so many samples, or is away for spells; a slow disturbance besides."""
    T = samples(rng) + 1500
    _, x, u = linear(rng, T, int(rng.integers(1, 3)))
    s = 10 ** rng.uniform(-2, -0.3)
    y = x + s * rng.standard_normal(T) * rng.uniform(0.2, 1)
    y = y + lfilter([s], [1, -rng.uniform(0.9, 0.999)], rng.standard_normal(T)) * rng.uniform(0, 1)
    if rng.random() < 0.4:
        every = int(rng.integers(2, 9))
        away = np.arange(T) % every > 0
    elif rng.random() < 0.5:
        away = rng.random(T) < rng.uniform(0.1, 0.6)
    else:
        away, t = np.zeros(T, bool), 0
        lasts, busy = np.exp(rng.uniform(np.log(5), np.log(300))), np.exp(rng.uniform(np.log(20), np.log(300)))
        while t < T:
            t += int(rng.exponential(busy)) + 2
            n = int(rng.exponential(lasts)) + 1
            away[t : t + n] = True
            t += n
    y[away] = np.nan
    return y, u
