"""What could be known at best: the Cramér-Rao bound of somebody who is told columns, delays, structure and times.

The parameters are those of the plant, its level, and the sizes of what changed; noise, rounding and outliers are known.
Of inputs it knows the rows of the file and how they move: what they did between the rows of an irregular clock moves y
as a noise does. Of the noise it knows what the samples that are there say. Nothing of the library is used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular, toeplitz
from scipy.signal import lfilter

from .hidden_inputs import expected, spread
from .plant import Plant
from .simulation import Record, disturbance, numerator, response, shaped, slope, step

SURE = 1.96


@dataclass(frozen=True)
class Oracle:
    """Truth at the end of the record, the half-widths of its 95 % intervals, and the odds of each change."""

    gains: tuple[float, ...]
    spreads: tuple[tuple[float, float], ...]  # of the local gain, where a nonlinearity bends it: 10 and 90 % quantile
    gain_bars: tuple[float, ...]
    slowest: tuple[float, float]  # the largest time constant, in steps of the grid, and its half-width
    times: tuple[tuple[float, float], ...]  # the same of 63 % of the answer to a step of each input
    log_odds: tuple[float, ...]  # of each jump of the plant, in this record
    named_odds: tuple[float, ...]  # of a gain against a level that moves then


def ask(plant: Plant, record: Record) -> Oracle:
    """Return what the oracle knows of a record."""
    theta, names = _parameters(plant)
    sizes, u = [jump.size for jump in plant.jumps], record.u
    record, seen, spread_of_y = sight(plant, record)
    base = _clean(plant, record, theta, sizes)
    whiten = whitener(plant, record, seen, spread_of_y)
    slopes = [whiten(_slope(plant, record, theta, sizes, j)) for j in range(len(theta))]
    slopes += [whiten(column) for column in _of_level(plant)]
    marks = [_of_jump(plant, record, theta, sizes, k, base) for k in range(len(sizes))]
    shifts = [None if mark is None else whiten(mark) for mark in marks]
    whitened = [
        whiten(_of_lag(plant, record, theta, sizes, k)) if jump.what == "lag" else shift
        for k, (jump, shift) in enumerate(zip(plant.jumps, shifts))
    ]
    psi = np.column_stack([*slopes, *(w for w in whitened if w is not None)])
    P = np.linalg.pinv(psi.T @ psi, rcond=1e-13, hermitian=True)
    noise = whiten(np.nan_to_num(record.y) - plant.level - disturbance(plant, record.unit) - base)
    odds, named = [], []
    for k, jump in enumerate(plant.jumps):
        direction, shift = whitened[k], shifts[k]
        if direction is None or shift is None:
            odds.append(_noise_odds(plant, record, seen, jump.at, noise, spread_of_y))
            named.append(odds[-1])
            continue
        others = [w for j, w in enumerate(whitened) if w is not None and j != k]
        turn = [whiten(column) for column in _of_turn(plant, jump)]
        instead = turn or [whiten(column) for column in _of_gains(plant, u, jump)]
        without = [*sizes[:k], 1.0, *sizes[k + 1 :]]  # the slopes of who takes the plant for unchanged
        plain = slopes if jump.what == "level" else [
            whiten(_slope(plant, record, theta, without, j)) for j in range(len(theta))
        ] + slopes[len(theta) :]  # fmt: skip
        with_it = _misfit(noise, [*slopes, *others, direction, *turn])
        moved = noise + shift * _moved(plant, k, record.unit)
        number = 0.5 * np.log(plant.samples)
        odds.append(_misfit(moved, [*plain, *others]) - with_it - (1 + len(turn)) * number)
        more = len(instead) if jump.what == "lag" else 0  # numbers that gains have
        named.append(_misfit(moved, [*plain, *others, *instead]) - with_it - (1 - more) * number)
    gains, bars, spreads = [], [], []
    for i in range(len(plant.gains)):
        wanted = _gradient(lambda v, i=i: _gain(plant, names, v, i), theta)
        factor = np.prod([jump.size for jump in plant.jumps if jump.what == "gain" and jump.input == i])
        local = slope(plant, u[:, i]) * plant.gains[i] * factor
        gains.append(float(plant.gains[i] * factor * _linear(plant, u[:, i])))
        low, high = np.sort(np.quantile(local, [0.1, 0.9])).tolist()
        spreads.append((low, high))
        g = np.append(wanted * factor, np.zeros(len(P) - len(theta)))
        own = [j for j, jump in enumerate(plant.jumps) if jump.what == "gain" and jump.input == i]
        for j in own:  # its factor is not known, either
            at = len(slopes) + sum(w is not None for w in whitened[:j])
            g[at] = plant.gains[i] * factor / plant.jumps[j].size
        bars.append(SURE * float(np.sqrt(max(g @ P @ g, 0.0))))
    lags = [k for k, jump in enumerate(plant.jumps) if jump.what == "lag"]
    every = [*range(len(theta)), *(len(slopes) + sum(w is not None for w in whitened[:k]) for k in lags)]
    P = P[np.ix_(every, every)]

    def known(read: Callable[[Any, list[float]], float]) -> tuple[float, float]:
        def of(value) -> float:
            now = list(sizes)
            for k, size in zip(lags, value[len(theta) :]):
                now[k] = float(size)
            return read(value[: len(theta)], now)

        here = np.append(theta, [sizes[k] for k in lags])
        g = _gradient(of, here)
        return of(here), SURE * float(np.sqrt(max(g @ P @ g, 0.0)))

    slowest = known(partial(_slowest, plant))
    times = [known(partial(_risen, plant, i=i)) for i in range(len(plant.gains))]
    return Oracle(tuple(gains), tuple(spreads), tuple(bars), slowest, tuple(times), tuple(odds), tuple(named))


def sight(plant: Plant, record: Record) -> tuple[Record, np.ndarray, np.ndarray | None]:
    """Return the record with inputs as they are expected, which samples of y are seen, and the variance of y then."""
    seen = np.isfinite(record.y) & ~record.outliers & np.isin(np.arange(plant.samples), record.rows)
    first, length = plant.stuck
    seen[first : first + length] = False
    if not plant.is_irregular:
        return record, seen, None
    return replace(record, u=expected(plant, record)), seen, spread(plant, record, seen)


def _parameters(plant: Plant) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Return a1 .. and the coefficients of every B that are not zero, and where the latter stand: (input, lag)."""
    places = [(i, int(lag)) for i in range(len(plant.gains)) for lag in np.flatnonzero(numerator(plant, i))]
    return np.concatenate([plant.a[1:], [numerator(plant, i)[lag] for i, lag in places]]), places


def _built(plant: Plant, theta):
    n = len(plant.poles)
    _, places = _parameters(plant)
    b = [np.zeros_like(numerator(plant, i)) for i in range(len(plant.gains))]
    for (i, lag), value in zip(places, theta[n:]):
        b[i][lag] = value
    return np.append(1.0, theta[:n]), b


def _clean(plant: Plant, record: Record, theta, sizes) -> np.ndarray:
    a, b = _built(plant, theta)
    return response(plant, record.u, b, a, sizes)


def _slope(plant: Plant, record: Record, theta, sizes, j: int) -> np.ndarray:
    h = np.zeros(len(theta))
    h[j] = 1e-6 * max(abs(theta[j]), 1e-3)
    up, down = (_clean(plant, record, theta + side * h, sizes) for side in (1, -1))
    return (up - down) / (2 * h[j])


def _of_level(plant: Plant) -> list[np.ndarray]:
    """Return what moves the level: a constant, and ramp and season where they are."""
    t = np.arange(plant.samples)
    found = [np.ones(plant.samples)]
    found += [t / plant.samples] if plant.ramp else []
    if plant.season[1]:
        found += [np.sin(2 * np.pi * t / plant.season[1]), np.cos(2 * np.pi * t / plant.season[1])]
    return found


def _of_jump(plant: Plant, record: Record, theta, sizes, k: int, base):
    """Return the slope by the size of a jump: a step, or what a gain does per unit of its factor."""
    jump = plant.jumps[k]
    if jump.what == "noise":
        return None
    if jump.what == "level":
        return (np.arange(plant.samples) >= jump.at).astype(float)
    other = list(sizes)
    other[k] = 1.0
    return (base - _clean(plant, record, theta, other)) / (jump.size - 1.0)


def _of_lag(plant: Plant, record: Record, theta, sizes, k: int) -> np.ndarray:
    """Return the slope by the factor of a lag, as it is."""
    up, down = ([*sizes[:k], sizes[k] + side, *sizes[k + 1 :]] for side in (1e-5, -1e-5))
    return (_clean(plant, record, theta, up) - _clean(plant, record, theta, down)) / 2e-5


def _of_gains(plant: Plant, u, jump) -> list[np.ndarray]:
    """Return what a jump of each gain would do instead of a lag's, and what the level moved with it."""
    if jump.what != "lag":
        return []
    step = (np.arange(plant.samples) >= jump.at).astype(float)
    driven = [lfilter(numerator(plant, i), [1.0], shaped(plant, u[:, i])) * step for i in range(u.shape[1])]
    return [lfilter([1.0], plant.a, x) for x in (*driven, step)]


def _of_turn(plant: Plant, jump) -> list[np.ndarray]:
    """Return what the level moves with a gain: about which value of its input that turns is in no file."""
    step = (np.arange(plant.samples) >= jump.at).astype(float)
    return [lfilter([1.0], plant.a, step)] if jump.what == "gain" else []


def _misfit(target, columns) -> float:
    """Return half the squares that are left of a whitened signal beside columns: minus its log likelihood."""
    X = np.column_stack(columns)
    left = target - X @ np.linalg.lstsq(X, target, rcond=None)[0]
    return float(0.5 * left @ left)


def _moved(plant: Plant, k: int, unit: float) -> float:
    """Return the size of a jump in the unit of `_of_jump`."""
    jump = plant.jumps[k]
    return unit * jump.size if jump.what == "level" else jump.size - 1.0


def _variance(plant: Plant, record: Record) -> np.ndarray:
    """Return the variance of the white noise and of the rounding, (T,)."""
    rounding = (step(plant, record.unit) ** 2 / 12) if plant.levels else 0.0
    return record.sigma**2 + rounding


def whitener(plant: Plant, record: Record, seen, spread_of_y=None):
    """Return what makes the noise of a series white and of variance one, given the samples that are seen alone."""
    colour = np.array({"white": [1.0], "equation": [*plant.a], "coloured": [1.0, -plant.rho]}[plant.noise])
    if spread_of_y is None and (len(colour) == 1 or (seen.all() and not plant.levels)):
        return lambda x: (lfilter(colour, [1.0], x) / np.sqrt(_variance(plant, record)))[seen]
    way = toeplitz(lfilter([1.0], colour, np.eye(1, plant.samples)[0]), np.zeros(plant.samples))[seen]
    rounding = _variance(plant, record)[seen] - record.sigma[seen] ** 2
    spread_of_noise = lfilter([1.0], colour, (way * record.sigma**2).T, axis=0)[seen] + np.diag(rounding)
    root = np.linalg.cholesky(spread_of_noise if spread_of_y is None else spread_of_noise + spread_of_y)
    return lambda x: solve_triangular(root, x[seen], lower=True)


def _noise_odds(plant: Plant, record: Record, seen, at: int, noise, spread_of_y=None) -> float:
    """Return the log odds of two variances against one, by the ``noise`` as it was, whitened."""
    s2, after = _variance(plant, record)[seen], np.flatnonzero(seen) >= at
    parts = [part for part in (noise[~after] ** 2 * s2[~after], noise[after] ** 2 * s2[after]) if len(part)]
    gained = 0.5 * (len(s2) * np.log(np.mean(np.concatenate(parts))) - sum(len(v) * np.log(v.mean()) for v in parts))
    if spread_of_y is not None:
        one, two = (np.linalg.cholesky(np.diag(v) + spread_of_y) for v in (np.full(len(s2), s2.mean()), s2))
        alike = solve_triangular(one, two @ noise, lower=True)
        gained = np.log(np.diag(one)).sum() - np.log(np.diag(two)).sum() + 0.5 * (alike @ alike - noise @ noise)
    return float(gained - 0.5 * np.log(max(int(after.sum()), 1)))


def _gain(plant: Plant, places, theta, i: int) -> float:
    n = len(plant.poles)
    total = sum(value for (input_, _), value in zip(places, theta[n:]) if input_ == i)
    return total / (1 + theta[:n].sum())


def _linear(plant: Plant, u) -> float:
    """Return the slope of the straight line that is nearest to the nonlinearity over what the input did."""
    x = u - u.mean()
    return float(x @ shaped(plant, u) / (x @ x))


def _last(plant: Plant, theta, sizes) -> np.ndarray:
    """Return 1, a1, .. as they are at the end."""
    n = len(plant.poles)
    return np.append(1.0, theta[:n] - plant.a[1:] + np.real(np.poly(plant.poles_at(sizes)[-1][1]))[1:])


def _slowest(plant: Plant, theta, sizes) -> float:
    return float(-1 / np.log(abs(np.roots(_last(plant, theta, sizes))).max()))


def _risen(plant: Plant, theta, sizes, i: int) -> float:
    """Return when the answer to a step of input i is 63 % done, between samples on a straight line."""
    a, (_, b) = _last(plant, theta, sizes), _built(plant, theta)
    x = np.ones(int(plant.delays[i] + 10 * plant.slowest + 20))
    y = lfilter(b[i], a, x) / (b[i].sum() / a.sum())
    at = int(np.argmax(y >= 1 - np.exp(-1)))
    return at - (y[at] - (1 - np.exp(-1))) / (y[at] - y[at - 1] if at else y[at])


def _gradient(f, theta) -> np.ndarray:
    found = np.zeros(len(theta))
    for j in range(len(theta)):
        h = np.zeros(len(theta))
        h[j] = 1e-6 * max(abs(theta[j]), 1e-3)
        found[j] = (f(theta + h) - f(theta - h)) / (2 * h[j])
    return found
