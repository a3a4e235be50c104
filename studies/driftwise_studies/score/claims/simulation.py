"""The record of a plant: what happened on its grid, and which rows are seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter, lfiltic

from .plant import Plant

MEAN_GAP = 4.0  # steps of the grid between the rows of an irregular clock
COLOUR = 0.9  # of coloured inputs, from sample to sample


@dataclass(frozen=True)
class Record:
    """A record on the grid (T,), the truth behind it, and the rows that are written."""

    u: np.ndarray  # (T, k)
    y: np.ndarray  # (T,) NaN where nothing is measured
    clean: np.ndarray  # y without noise, outliers and what the sensor does
    sigma: np.ndarray  # (T,) of the white noise behind it
    unit: float  # standard deviation of what the inputs do to y: what sizes are in
    outliers: np.ndarray
    rows: np.ndarray  # which instants are written
    clean_fit: float  # per cent of the movement that somebody predicts who knows all


def shaped(plant: Plant, x, unit: float = 1.0):
    """Return an input after the static nonlinearity."""
    if plant.nonlinearity == "square":
        return x + 0.35 * x * abs(x)
    return np.tanh(1.2 * x) / 1.2 if plant.nonlinearity == "saturation" else x


def slope(plant: Plant, x):
    """Return the derivative of `shaped`."""
    if plant.nonlinearity == "square":
        return 1 + 0.7 * abs(x)
    return 1 / np.cosh(1.2 * x) ** 2 if plant.nonlinearity == "saturation" else np.ones_like(x)


def gain_factor(plant: Plant, i: int, sizes=None) -> np.ndarray:
    """Return by what the gain of input i is multiplied, (T,); ``sizes`` of the jumps where they are others."""
    factor = np.ones(plant.samples)
    for k, jump in enumerate(plant.jumps):
        if jump.what == "gain" and jump.input == i:
            factor[jump.at :] *= jump.size if sizes is None else sizes[k]
    return factor


def through(plant: Plant, x, a=None, sizes=None) -> np.ndarray:
    """Return what comes of a signal through 1/A, gains held where poles jump; ``a`` at the beginning if another."""
    stretches = plant.poles_at(sizes)
    a = plant.a if a is None else a
    if len(stretches) == 1:
        return lfilter([1.0], a, x)
    y = np.zeros(len(x))
    ends = [first for first, _ in stretches[1:]] + [len(x)]
    for (first, poles), end in zip(stretches, ends):
        now = a * 1.0
        now[1:] += np.real(np.poly(poles))[1:] - plant.a[1:]
        past = y[max(first - len(a) + 1, 0) : first][::-1]
        state = lfiltic([1.0], now, past) if len(a) > 1 else None
        y[first:end] = lfilter([1.0], now, x[first:end] * now.sum() / a.sum(), zi=state)[0]
    return y


def numerator(plant: Plant, i: int) -> np.ndarray:
    """Return B of an input with its delay."""
    b = plant.gains[i] * plant.a.sum() * np.array(plant.numerators[i])
    return np.concatenate([np.zeros(plant.delays[i]), b])


def response(plant: Plant, u, numerators=None, a=None, sizes=None) -> np.ndarray:
    """Return what the inputs do to y."""
    a = plant.a if a is None else a
    total = np.zeros(plant.samples)
    for i in range(u.shape[1]):
        b = numerator(plant, i) if numerators is None else numerators[i]
        x = lfilter(b, [1.0], shaped(plant, u[:, i])) * gain_factor(plant, i, sizes)
        total += through(plant, x, a, sizes)
    return total


def excitation(plant: Plant, rng) -> np.ndarray:
    """Return inputs about zero, (T, k)."""
    T, k = plant.samples, len(plant.gains)
    hold = int(max(2, min(plant.time_constants[0] * 1.5, T / 25)))
    if plant.excitation == "steps":
        u = np.empty((T, k))
        for i in range(k):
            lengths = rng.integers(hold, 4 * hold, T // hold + 1)
            u[:, i] = np.repeat(rng.choice([-1.5, -0.5, 0.5, 1.0, 1.5], len(lengths)), lengths)[:T]
        return u
    white = rng.standard_normal((T, k))
    return lfilter([0.44], [1, -COLOUR], white, axis=0) if plant.excitation == "coloured" else white


def record(plant: Plant, seed: int) -> Record:
    """Simulate a plant; the same plant and seed give the same record."""
    rng = np.random.default_rng([seed, plant.number, 23])
    T = plant.samples
    u = excitation(plant, rng)
    e = rng.standard_normal(T)
    free = response(plant, u)
    unit = float(free.std()) or 1.0
    shape = np.ones(T)
    for jump in plant.jumps:
        if jump.what == "noise":
            shape[jump.at :] *= jump.size
    a, rho = plant.a, plant.rho
    colour = {"white": ([1.0], [1.0]), "equation": ([1.0], a), "coloured": ([1.0], [1.0, -rho])}[plant.noise]
    sigma = shape * unit / plant.snr / (lfilter(*colour, rng.standard_normal(4000))[500:].std())
    noise = lfilter(*colour, sigma * e)
    extra = disturbance(plant, unit)
    if plant.loop:
        u, free = closed(plant, u, noise + extra)
    clean = plant.level + free + extra
    y = clean + noise
    y, hit = measured(plant, y, unit, rng)
    rows = np.arange(T)
    if plant.is_irregular:
        rows = rows[rng.random(T) < 1 / MEAN_GAP]
    predicted = sigma * e
    seen = np.isfinite(y) & ~hit
    fit = 100 * (1 - np.sqrt(np.mean(predicted[seen] ** 2)) / y[seen].std()) if seen.any() else 0.0
    return Record(u, y, clean, sigma, unit, hit, rows, float(fit))


def disturbance(plant: Plant, unit: float) -> np.ndarray:
    """Return what moves the level: jumps, a ramp, a season."""
    t = np.arange(plant.samples)
    found = unit * plant.ramp * t / plant.samples
    for jump in plant.jumps:
        if jump.what == "level":
            found = found + unit * jump.size * (t >= jump.at)
    amplitude, period = plant.season
    return found + unit * amplitude * np.sin(2 * np.pi * t / period) if period else found


def closed(plant: Plant, reference, noise) -> tuple[np.ndarray, np.ndarray]:
    """Return inputs and response with a controller from y to the first input; a loop that grows gets half the gain."""
    share = plant.loop
    while True:
        u, free = _loop(plant, reference, noise, share / plant.gains[0])
        if np.isfinite(free).all() and abs(free).max() < 50 * (
            abs(noise).max() + abs(response(plant, reference)).max()
        ):
            return u, free
        share /= 2


def _loop(plant: Plant, reference, noise, gain: float):
    T, k = reference.shape
    n, b, a = len(plant.poles), [numerator(plant, i) for i in range(k)], plant.a
    factors = [gain_factor(plant, i) for i in range(k)]
    u, free = reference.copy(), np.zeros(T)
    with np.errstate(over="ignore", invalid="ignore"):
        for t in range(T):
            value = -sum(a[j] * free[t - j] for j in range(1, n + 1) if t >= j)
            u[t, 0] = reference[t, 0] - (gain * (free[t - 1] + noise[t - 1]) if t else 0.0)
            for i in range(k):
                for lag in np.flatnonzero(b[i]):
                    if t >= lag:
                        value += factors[i][t] * b[i][lag] * shaped(plant, u[t - lag, i])
            free[t] = value
    return u, free


def measured(plant: Plant, y, unit: float, rng) -> tuple[np.ndarray, np.ndarray]:
    """Return what the sensor makes of the output, NaN where it gives nothing, and where outliers are."""
    share, size = plant.outliers
    hit = rng.random(len(y)) < share
    y = y + np.where(hit, size * unit * rng.choice([-1.0, 1.0], len(y)) * rng.uniform(0.7, 1.3, len(y)), 0.0)
    if plant.levels:
        y = np.round(y / step(plant, unit)) * step(plant, unit)
    first, length = plant.stuck
    if length:
        y[first : first + length] = y[first]
    y[rng.random(len(y)) < plant.missing] = np.nan
    if plant.every > 1:
        y[np.arange(len(y)) % plant.every > 0] = np.nan
    return y, hit


def step(plant: Plant, unit: float) -> float:
    """Return the step in which the output is written."""
    return float(f"{2 * unit / plant.levels:.1g}")
