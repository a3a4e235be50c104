"""Simulate a system: records with their truth, any number at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .system import System, stays

SAMPLES = 2000
FIRST, APART = 200, 100  # samples before the first jump or step of the noise, and between two
ESCAPED, AGAIN = 1000.0, 20  # times the rms of its first samples; how often such a record is drawn anew at most
QUIET, DECAY = 0.01, 50  # what is left of the noise in a rest that is quiet, from so many samples after its begin


@dataclass(frozen=True)
class Records:
    """Records of one system, a row for each seed, with the truth."""

    y: np.ndarray  # (S, T), NaN where missing
    u: np.ndarray  # (S, T, k): inputs, or the regressors
    theta: np.ndarray  # (S, T, n), in the order of psi
    sigma: np.ndarray  # (S, T)
    outliers: np.ndarray  # (S, T), whether y, or e, is one
    jumps: np.ndarray  # (S, J), the first samples with new parameters, in order
    moved: np.ndarray  # (S, J, n), by how much


def record(system: System, seed: int, samples: int = SAMPLES) -> Records:
    """Return one record (a batch of one) of a system; a seed gives the same whatever the others are."""
    return records(system, [seed], samples)


def records(system: System, seeds, samples: int = SAMPLES) -> Records:
    """Return records of a system, one for each seed; one whose output escapes is drawn anew, `AGAIN` times at most."""
    found = drawn(system, [[seed, system.number, 22] for seed in seeds], samples)
    for again in range(AGAIN):
        lost = np.flatnonzero(escapes(found.y))
        if not len(lost):
            break
        other = drawn(system, [[seeds[s], system.number, 22, again] for s in lost], samples)
        for name, rows in vars(found).items():
            rows[lost] = getattr(other, name)
    return found


def escapes(y) -> np.ndarray:
    """Say whose output exceeds what it was at first: a loop that holds missing samples may lose its grip."""
    start = np.sqrt(np.nanmean(y[:, :FIRST] ** 2, axis=1))
    return np.nanmax(np.abs(y), axis=1) > ESCAPED * start


def drawn(system: System, streams, samples: int) -> Records:
    """Return a record for each stream of chance."""
    rngs = [np.random.default_rng(stream) for stream in streams]
    theta, at, moved = path(system, rngs, samples)
    sigma, resting = noise(system, rngs, samples)
    e = sigma * np.stack([rng.standard_normal(samples) for rng in rngs])
    r = np.stack([source(system, rng, samples) for rng in rngs])
    r[resting] = 0.0
    glitch = np.stack([glitches(system, rng, samples) for rng in rngs]) * sigma
    gone = np.stack([gaps(system, rng, samples) for rng in rngs])
    felt, unfelt = (glitch, 0.0 * glitch) if system.of_process else (0.0, glitch)
    y, u = run(system, theta, e + felt, r, unfelt, gone)
    return Records(y, u, theta, sigma, glitch != 0, at, moved)


def moments(rng, count: int, samples: int) -> np.ndarray:
    """Return when ``count`` things happen, in order and apart."""
    first = min(FIRST, samples // 4)
    slot = (samples - first) / max(count, 1)
    return np.array([int(first + slot * i + rng.uniform() * max(slot - APART, 1)) for i in range(count)], int)


def path(system: System, streams, samples: int):
    """Return theta (S, T, n), when it jumps (S, J) and by how much (S, J, n)."""
    n, count, own = len(system.theta), len(system.jumps), np.array(system.deviations)
    at = np.stack([moments(rng, count, samples) for rng in streams])
    moved = np.zeros((len(streams), count, n))
    for j, (size, who) in enumerate(system.jumps):
        for s, rng in enumerate(streams):
            moved[s, j, list(who)] = size * own[list(who)] * rng.choice([-1.0, 1.0], len(who) if len(who) == 1 else 1)
    steps = np.zeros((len(streams), samples, n))
    if system.nvr:
        drawn = np.stack([rng.standard_normal((samples, n)) for rng in streams])
        steps[:, 1:] = (np.sqrt(system.nvr) * own * drawn)[:, 1:]
    rows = np.arange(len(streams))
    for j in range(count):
        steps[rows, at[:, j]] += moved[:, j]
    theta = np.array(system.theta) + np.cumsum(steps, axis=1)
    lost = ~stays(system, theta).all(axis=1)
    if lost.any():
        theta[lost], moved[lost] = kept_stable(system, steps[lost], at[lost], moved[lost])
    return theta, at, moved


def kept_stable(system: System, steps, at, moved):
    """Return theta and its jumps where no step leaves what is stable: a jump turns back, or is halved; a walk waits."""
    theta, now = np.empty_like(steps), np.tile(np.array(system.theta), (len(steps), 1))
    moved, rows = moved.copy(), np.arange(len(steps))
    for k in range(steps.shape[1]):
        after = now + steps[:, k]
        bad = ~stays(system, after)
        if bad.any():
            after[bad] = now[bad]
            for s, j in zip(*np.nonzero((at == k) & bad[:, None])):
                while not stays(system, now[s] + moved[s, j]):
                    moved[s, j] = -moved[s, j] if stays(system, now[s] - moved[s, j]) else moved[s, j] / 2
                after[s] = now[s] + moved[s, j]
        theta[rows, k] = now = after
    return theta, moved


def noise(system: System, streams, samples: int):
    """Return sigma (S, T), and where the plant rests; noise that rests waits until what was excited has died away."""
    sigma, resting = np.full((len(streams), samples), system.sigma), np.zeros((len(streams), samples), bool)
    for s, rng in enumerate(streams):
        for k, step in zip(moments(rng, len(system.steps), samples), system.steps):
            sigma[s, k:] *= step
        if system.rest[0]:
            k = int(rng.integers(FIRST, max(samples - system.rest[0] - APART, FIRST + 1)))
            resting[s, k : k + system.rest[0]] = True
            if system.rest[1]:
                sigma[s, k + DECAY : k + system.rest[0]] *= QUIET
    return sigma, resting


def source(system: System, rng, samples: int) -> np.ndarray:
    """Return inputs (T, k) of variance one, or what is asked of the loop."""
    (kind, value), k = system.input, len(system.nb)
    if kind == "signs":
        return rng.choice([-1.0, 1.0], (samples, k))
    white = rng.standard_normal((samples, k))
    pole = value if kind == "coloured" else 0.9 if kind == "quantised" else 0.0
    for t in range(1, samples if pole else 0):
        white[t] = pole * white[t - 1] + np.sqrt(1 - pole**2) * white[t]
    if kind != "quantised":
        return white
    half = (value - 1) / 2  # so many levels between -2 and 2
    return (np.clip(np.round(white / 2 * half + half), 0, 2 * half) - half) / half * 2


def glitches(system: System, rng, samples: int) -> np.ndarray:
    """Return what is added to the outputs, or to e, in deviations of the noise."""
    share, size = system.outliers
    wrong = rng.random(samples) < share
    return wrong * size * rng.choice([-1.0, 1.0], samples) * rng.uniform(0.7, 1.3, samples)


def gaps(system: System, rng, samples: int) -> np.ndarray:
    """Return where the output is missing: runs of geometric length."""
    share, length = system.missing
    if not share:
        return np.zeros(samples, bool)
    begin, go_on = share / ((1 - share) * length), 1 - 1 / length
    drawn, gone = rng.random(samples), np.zeros(samples, bool)
    for t in range(1, samples):
        gone[t] = drawn[t] < (go_on if gone[t - 1] else min(begin, 1.0)) if length > 1 else drawn[t] < share
    return gone


def run(system: System, theta, e, r, glitch, gone):
    """Return measured outputs and the inputs that were applied."""
    if system.na < 0:
        return np.where(gone, np.nan, np.einsum("stn,stn->st", r, theta) + e + glitch), r
    (S, T), na, u = e.shape, system.na, r.copy()
    gain = system.input[1] if system.input[0] == "closed loop" else 0.0
    lags = max([na, *system.nb])
    y, seen, held = np.zeros((S, T + lags)), np.empty((S, T)), np.zeros(S)
    padded = np.concatenate([np.zeros((S, lags, r.shape[2])), u], axis=1)  # u(k) is padded[:, k + lags]
    terms = [(i, lag) for i, n in enumerate(system.nb) for lag in range(1, n + 1)]
    forced = np.zeros((S, T))
    for j, (i, lag) in enumerate(terms):
        if not gain or i:
            forced += theta[:, :, na + j] * padded[:, lags - lag : lags - lag + T, i]
    a = -theta[:, :, na - 1 :: -1] if na == theta.shape[2] else -theta[:, :, :na][:, :, ::-1]
    for k in range(T):
        now = np.einsum("sn,sn->s", a[:, k], y[:, k + lags - na : k + lags]) + forced[:, k] + e[:, k]
        if gain:
            for j in range(system.nb[0]):
                now = now + theta[:, k, na + j] * padded[:, k + lags - 1 - j, 0]
        y[:, k + lags] = now
        seen[:, k] = np.where(gone[:, k], np.nan, now + glitch[:, k])
        if gain:
            held = np.where(gone[:, k], held, seen[:, k])
            padded[:, k + lags, 0] -= gain * held
    return seen, padded[:, lags:]


def regressors(system: System, y, u) -> np.ndarray:
    """Return psi (S, T, n) of measured outputs and inputs, zero before the record."""
    if system.na < 0:
        return u
    psi = np.zeros((*y.shape, len(system.theta)))
    for lag in range(1, system.na + 1):
        psi[:, lag:, lag - 1] = -y[:, :-lag]
    terms = [(i, lag) for i, n in enumerate(system.nb) for lag in range(1, n + 1)]
    for j, (i, lag) in enumerate(terms):
        psi[:, lag:, system.na + j] = u[:, :-lag, i]
    return psi
