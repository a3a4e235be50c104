"""Thirteen kinds of rigs that are not as models have them, each a function of a generator to y (T,) and u (T, k)."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from .kinds import kind
from .signals import excitation, linear, samples


@kind
def plain(rng):
    T = samples(rng)
    A, x, u = linear(rng, T, int(rng.integers(1, 4)), rng.choice(["prbs", "noise", "sines"]))
    e = rng.uniform(0.03, 0.5) * rng.standard_normal(T)
    return x + (lfilter([1], A, e) if rng.random() < 0.5 else e), u


@kind
def tank(rng):
    """Outflow by a square law; the valve has a dead zone."""
    T = samples(rng)
    u, y, h, a = np.abs(excitation(rng, T)), np.zeros(T), 1.0, rng.uniform(0.01, 0.2)
    b, dead = a * rng.uniform(0.5, 2), rng.uniform(0, 0.5)
    for t in range(T):
        y[t] = h
        h = max(h + b * max(u[t] - dead, 0) - a * np.sqrt(max(h, 0)), 0.0)
    return y + rng.uniform(0.002, 0.05) * y.std() * rng.standard_normal(T), u[:, None]


@kind
def stiction(rng):
    """Two channels move a mass that sticks; rests are exact, or nearly."""
    T = samples(rng)
    u = np.stack([excitation(rng, T, rng.choice(["rare steps", "pulses", "steps"])) for _ in range(2)], 1)
    x, v, y = 0.0, 0.0, np.zeros(T)
    k, d, stick, c = rng.uniform(0.02, 0.6), rng.uniform(0.2, 1.0), rng.uniform(0, 0.3), rng.uniform(0, 0.6)
    for t in range(T):
        y[t] = x
        f = k * (u[t, 0] + c * u[t, 1] * abs(u[t, 1]) - x) - d * v
        v = 0.0 if abs(v) < 1e-3 and abs(f) < stick * k else v + f - 0.3 * k * stick * np.sign(v or f)
        x += v
    q = y.std() * 10 ** rng.uniform(-3.5, -1.5)
    e = q * rng.standard_normal(T)
    y = y + e * (rng.random() < 0.7)
    return (np.round(y / q) * q if rng.random() < 0.5 else y), u


@kind
def rain(rng):
    """A rare violent input, a soil that fills, two storages."""
    T = samples(rng) + 1000
    r = rng.exponential(1, T) ** 2 * (rng.random(T) < rng.uniform(0.02, 0.15))
    wet, flood, f = 0.0, np.zeros(T), rng.uniform(0.97, 0.999)
    for t in range(T):
        wet = f * wet + (1 - f) * r[t] * 8
        flood[t] = r[t] * wet ** rng.choice([0.5, 1.0])
    q = lfilter([1], [1, -rng.uniform(0.5, 0.95)], flood) * rng.uniform(0.05, 0.4)
    q = q + lfilter([1], [1, -rng.uniform(0.97, 0.998)], flood) * 0.02
    d = rng.integers(0, 4)
    q = np.r_[np.zeros(d), q[: T - d]] + 0.05 * q.std()
    q *= np.exp(rng.uniform(0.002, 0.03) * rng.standard_normal(T))
    s = q.std() * 10 ** rng.uniform(-3.5, -2)
    return np.round(q / s) * s, r[:, None]


@kind
def battery(rng):
    """Rounded, at rest between pulses, slow resistances."""
    T = samples(rng) + 1500
    u = excitation(rng, T, rng.choice(["pulses", "rare steps"]))
    x = lfilter([1 - 0.98], [1, -0.98], u) * rng.uniform(0.2, 1)
    x = x + lfilter([0.001], [1, -0.999], u) * rng.uniform(0.2, 1) + rng.uniform(0.2, 1) * u
    x = x - np.cumsum(np.abs(u)) * 1e-4 * rng.uniform(0, 2)
    y = x + 0.3 * rng.uniform(0, 1) * np.maximum(u, 0) ** 2 * 0.3
    q = y.std() * 10 ** rng.uniform(-3, -1.3)
    return np.round((y + q * rng.uniform(0.05, 0.7) * rng.standard_normal(T)) / q) * q, u[:, None]


@kind
def loud(rng):
    """Noise whose level falls, follows the output, switches, or wanders."""
    T = samples(rng)
    A, x, u = linear(rng, T)
    how = rng.integers(4)
    if how == 0:
        s = np.exp(-rng.uniform(0.5, 3) * np.minimum(np.arange(T) / (rng.uniform(0.1, 0.6) * T), 1.0))
    elif how == 1:
        s = np.exp(rng.uniform(0.3, 1.0) * x)
    elif how == 2:
        is_loud, s, high, p = 0, np.ones(T), rng.uniform(2, 10), rng.uniform(1 / 200, 1 / 20)
        for t in range(T):
            is_loud ^= int(rng.random() < p)
            s[t] = high if is_loud else 1.0
    else:
        s = np.exp(lfilter([1], [1, -rng.uniform(0.95, 0.999)], rng.standard_normal(T)) * rng.uniform(0.05, 0.2))
    e = s / np.sqrt(np.mean(s**2)) * rng.uniform(0.05, 0.5) * rng.standard_normal(T)
    return x + (lfilter([1], A, e) if rng.random() < 0.6 else e), u


@kind
def heavy(rng):
    """Student's noise, and spikes."""
    T = samples(rng)
    A, x, u = linear(rng, T, int(rng.integers(1, 4)))
    s = rng.uniform(0.03, 0.3)
    e = s * rng.standard_t(rng.choice([2.5, 3, 4]), T) * 0.6
    if rng.random() < 0.4:
        e += s * 20 * rng.standard_normal(T) * (rng.random(T) < rng.uniform(0.001, 0.01))
    return x + (lfilter([1], A, e) if rng.random() < 0.6 else e), u


@kind
def exact(rng):
    """Almost no noise, a static nonlinearity behind the plant."""
    T = samples(rng)
    _, x, u = linear(rng, T, 1, rng.choice(["prbs", "noise", "sines"]))
    x = x + rng.uniform(0, 0.1) * x**2 + rng.uniform(0, 0.05) * x**3
    return x + x.std() * 10 ** rng.uniform(-4, -1.7) * rng.standard_normal(T), u


@kind
def heating(rng):
    """A relay, walls, day and night, rounded."""
    T = samples(rng) + 300
    outside = 5 * np.sin(2 * np.pi * np.arange(T) / rng.choice([48, 96, 288]))
    outside = outside + lfilter([1], [1, -0.99], 0.3 * rng.standard_normal(T))
    y, u, room, wall, is_on, p = np.zeros(T), np.zeros(T), 20.0, 20.0, 0, rng.uniform(0.002, 0.03)
    for t in range(T):
        wanted = 21 if (t // rng.choice([40])) % 2 else 17
        is_on = 1 if room < wanted - 0.5 else 0 if room > wanted + 0.5 else is_on
        u[t], y[t] = is_on, room
        wall += 0.1 * p * (outside[t] - wall) + 0.1 * (room - wall) * p
        room += p * (wall - room) * 3 + p * (outside[t] - room) * 0.5 + p * 30 * is_on * rng.uniform(0.95, 1.05)
    q = rng.choice([0.01, 0.1, 0.5])
    return np.round((y + rng.uniform(0.01, 0.2) * rng.standard_normal(T)) / q) * q, np.stack([u, outside], 1)


@kind
def scheduled(rng):
    """Gain and pole follow the output, or the gain wanders, or it switches."""
    T = samples(rng)
    u, y, how, a0 = excitation(rng, T), np.zeros(T), rng.integers(3), rng.uniform(0.5, 0.97)
    bend = rng.uniform(0.3, 1.0)
    wander = np.exp(np.cumsum(rng.standard_normal(T)) * rng.uniform(0.3, 1.2) / np.sqrt(T))
    switch, x, g = np.repeat(rng.uniform(0.3, 2, T // 200 + 1), 200)[:T], 0.0, 1.0
    for t in range(1, T):
        g = [1 + bend * np.tanh(x), wander[t], switch[t]][how]
        a = a0 ** (1 / max(g, 0.3)) if how == 0 else a0
        x = a * x + (1 - a) * g * u[t - 1]
        y[t] = x
    return y + y.std() * rng.uniform(0.005, 0.2) * rng.standard_normal(T), u[:, None]


@kind
def kicked(rng):
    """Rare shocks, of the plant or of the reading, far above a quiet noise."""
    T = samples(rng) + 1000
    A, x, u = linear(rng, T, int(rng.integers(1, 3)))
    s = 10 ** rng.uniform(-3, -0.7)
    e = s * rng.standard_normal(T)
    is_kicked = rng.random(T) < 1 / np.exp(rng.uniform(np.log(100), np.log(3000)))
    w = np.where(is_kicked, s * np.exp(rng.uniform(np.log(5), np.log(100))) * rng.standard_normal(T), 0.0)
    if rng.random() < 0.5:
        return x + e + lfilter([1], A, w), u
    return x + (lfilter([1], A, e) if rng.random() < 0.5 else e) + w, u


@kind
def visited(rng):
    """Quiet, and now and then moved for a while by what nobody measures."""
    T = samples(rng) + 1000
    A, x, u = linear(rng, T, int(rng.integers(1, 3)), rng.choice(["rare steps", "pulses", "steps", "noise"]))
    s, w, t = 10 ** rng.uniform(-3, -1.3), np.zeros(T), 0
    every, lasts = np.exp(rng.uniform(np.log(60), np.log(800))), np.exp(rng.uniform(0, np.log(30)))
    while t < T:
        t += int(rng.exponential(every)) + 5
        n = int(rng.exponential(lasts)) + 1
        size = s * np.exp(rng.uniform(np.log(5), np.log(300)))
        w[t : t + n] = size * (rng.standard_normal(len(w[t : t + n])) if rng.random() < 0.5 else rng.choice([-1, 1]))
        t += n
    y = x + s * rng.standard_normal(T) * (rng.random() < 0.7) + lfilter([1], A if rng.random() < 0.7 else [1], w)
    return (np.round(y / s) * s if rng.random() < 0.5 else y), u


@kind
def resting(rng):
    """Rounded, and at rest for hundreds of samples between programmes of pulses and steps."""
    T = int(np.exp(rng.uniform(np.log(3000), np.log(12000))))
    u, t = np.zeros(T), 0
    rest, busy = np.exp(rng.uniform(np.log(100), np.log(1500))), np.exp(rng.uniform(np.log(30), np.log(600)))
    while t < T:
        t += int(rng.exponential(rest)) + 20
        end = t + int(rng.exponential(busy)) + 5
        while t < min(end, T):
            n = int(rng.integers(1, 40))
            u[t : t + n] = rng.uniform(-2, 2)
            t += n
        u[t:] = 0.0
    a, b = rng.uniform(0.9, 0.995), rng.uniform(0.3, 0.9)
    x = lfilter([1 - a], [1, -a], u) * rng.uniform(0.2, 1) + lfilter([1 - b], [1, -b], u) * rng.uniform(0.2, 1)
    if rng.random() < 0.5:
        x = x + rng.uniform(0, 1) * u
    if rng.random() < 0.5:
        x = x - rng.uniform(0, 3) * 1e-3 * np.cumsum(u)
    x = x + rng.uniform(0, 0.3) * np.maximum(x, 0) ** 2
    q = x.std() * 10 ** rng.uniform(-3.2, -1.5)
    return np.round(x / q + rng.uniform(0, 0.4) * rng.standard_normal(T)) * q, u[:, None]
