"""Kinds where what decides is written nowhere: modes that hardly fade, noise that is another, a switch, rests."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from .kinds import kind
from .signals import excitation, linear, samples


@kind
def arm(rng):
    """A light arm that swings in two to four modes, almost without noise, with friction; small models are far off."""
    T, n = int(np.exp(rng.uniform(np.log(500), np.log(2000)))), int(rng.integers(2, 5))
    u = excitation(rng, T, rng.choice(["sines", "noise", "prbs"]))
    u = np.tile(u[: T // 3], 4)[:T] if rng.random() < 0.4 else u
    drive, x = u - rng.uniform(0, 0.3) * np.tanh(5 * lfilter([1], [1, -0.9], u)), np.zeros(T)
    for _ in range(n):
        z = np.exp(-(10 ** rng.uniform(-2.5, -0.8)) + 1j * rng.uniform(0.05, 1.8))
        x = x + rng.standard_normal() * lfilter([0, 1.0, rng.uniform(-1, 1)], np.real(np.poly([z, z.conj()])), drive)
    x = x / x.std() if rng.random() < 0.5 else np.diff(x / x.std(), prepend=0.0)
    noise = x.std() * 10 ** rng.uniform(-4.5, -2)
    return x + noise * lfilter([1], [1, -rng.uniform(0, 0.9)], rng.standard_normal(T)), u[:, None]


@kind
def shift(rng):
    """Noise that is once and for all another: a sensor is changed, a pump started; three to thirty times up or down."""
    T = samples(rng)
    A, x, u = linear(rng, T, int(rng.integers(1, 3)))
    s = np.where(np.arange(T) < rng.uniform(0.3, 0.9) * T, 1.0, 3 * 10 ** rng.uniform(0, 1))
    s = s if rng.random() < 0.5 else 1 / s
    e = s / s.max() * 10 ** rng.uniform(-2, -0.3) * rng.standard_normal(T)
    return x + (lfilter([1], A, e) if rng.random() < 0.5 else e), u


@kind
def switched(rng):
    """A switch that nobody writes down: level, gain or pole is another for a while."""
    T, n = samples(rng) + 600, int(rng.integers(1, 3))
    u = np.stack([excitation(rng, T) for _ in range(n)], 1)
    stays, is_on, t = np.exp(rng.uniform(np.log(40), np.log(800))), np.zeros(T, bool), 0
    while t < T:
        t += int(rng.exponential(stays)) + 5
        is_on[t : t + int(rng.exponential(stays * rng.uniform(0.2, 1))) + 3] = True
        t += int(rng.exponential(stays)) + 5
    b, a0 = rng.standard_normal(n), rng.uniform(0.5, 0.98)
    what = [(rng.uniform(-2, 2), 1.0, a0), (0.0, rng.uniform(0.2, 2.5), a0), (0.0, 1.0, a0 ** rng.uniform(0.3, 3))]
    level, gain, a1 = what[rng.integers(3)]
    x, y = 0.0, np.zeros(T)
    for t in range(1, T):
        a = a1 if is_on[t] else a0
        x = a * x + (1 - a) * (gain ** is_on[t] * (b @ u[t - 1]) + level * is_on[t])
        y[t] = x
    return y + y.std() * 10 ** rng.uniform(-3, -0.7) * rng.standard_normal(T), u


@kind
def drowsy(rng):
    """A cell between pulses, rounded, whose logger writes seldom at rest; answers fade long before the next pulse."""
    T, n = int(np.exp(rng.uniform(np.log(5000), np.log(60000)))), int(rng.integers(6, 25))
    u, rest = np.zeros(T), T // n
    for k in range(n):
        start, lasts = k * rest + int(rng.integers(rest // 4)), int(np.exp(rng.uniform(np.log(5), np.log(60))))
        u[start : start + lasts] = rng.choice([-1.0, -0.3, 0.3, 0.75, 1.0])
        u[start + 2 * lasts : start + 3 * lasts] = rng.choice([0.0, -0.75, 0.5])
    charge = np.cumsum(u) * 10 ** rng.uniform(-4.5, -3.5)
    ages = np.exp(rng.uniform(0, 1) * np.cumsum(rng.standard_normal(n)) * 0.3)[np.minimum(np.arange(T) // rest, n - 1)]
    drive = np.sign(u) * np.abs(u) ** rng.uniform(0.6, 1) * ages  # resistances differ from pulse to pulse
    y = charge + rng.uniform(0.2, 1) * drive
    for lasts in np.exp(np.linspace(np.log(1), np.log(0.5 * rest), 6)):  # diffusion: no answer is one exponential
        a = np.exp(-1 / lasts)
        y = y + rng.uniform(0.02, 0.2) * lfilter([0, 1 - a], [1, -a], drive * lasts**0.5)
    q = 10 ** rng.uniform(-3.5, -1.5)
    y = np.round((y + q * rng.uniform(0.02, 0.3) * rng.standard_normal(T)) / q) * q
    since = np.arange(T) - np.maximum.accumulate(np.where(np.diff(u, prepend=0.0) != 0, np.arange(T), 0))
    wakes, every = np.exp(rng.uniform(np.log(3), np.log(60))), int(np.exp(rng.uniform(np.log(5), np.log(120))))
    y[(since > wakes) & (np.arange(T) % every > 0)] = np.nan
    return y, u[:, None]
