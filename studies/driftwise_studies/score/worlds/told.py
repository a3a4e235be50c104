"""What a memory is measured against: filters that are told what it must find out, and who could have told a jump.

All of them are the package's own filter of the same equation with known drift (`Drift`) and known noise, so that a
ratio shows the memory alone. An outlier of the sensor is a missing output to them; one of the process a sample whose
noise is as loud as that, and what the next outputs go on from.

* `reference`: the noise level of every sample and the variance of every walk are told. Where parameters jump there is
  no true constant Q: then it is the best in hindsight, per system, of a grid of speeds for those that jump, or for all.
* `oracle`: told besides when which parameters jump, and how far they may (as a variance). No filter can have its error.
* `tellable`: which jumps that oracle itself would tell within `SOON` samples, at 20:1 of the jump against none.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

import driftwise as dw

from .simulation import Records
from .system import System

SKIP = 50  # samples that do not count
SOON, ODDS = 30, 20.0
GRID = (0.0, *(m * 10.0**d for d in range(-5, -1) for m in (1, 3)), 0.1)  # NVRs
WIDE = 1e3  # prior variance, in the larger of ones and deviations


class Told(NamedTuple):
    """What the references of a system came to."""

    reference: float  # error
    oracle: float
    which: str  # which filter the reference is
    tellable: np.ndarray  # (S, J)


def estimator(system: System, memory, **options):
    """Return the estimator of a system's equation with some memory."""
    if system.na < 0:
        return dw.Regression(len(system.theta), memory=memory, **options)
    return dw.ARX(system.na, system.nb, memory=memory, **options)


@lru_cache(200)
def knowing(system: System, sigma: float, q: tuple[float, ...]):
    """Return the estimator that knows the noise and the variance of the walks."""
    prior = WIDE * np.maximum(np.array(system.deviations) ** 2, 1.0)
    return estimator(system, dw.memory.Drift(q=q), variance=sigma**2, P0=prior)


def follow(system: System, y, u, sigma, q, first: int = 0, state=None):
    """Return theta, innovations, their variances and the last state; ``sigma`` (T,) and ``q`` (T, n) from ``first``.

    q[k] acts from k to k + 1.
    """
    cuts = np.flatnonzero((np.diff(sigma) != 0) | (np.diff(q, axis=0) != 0).any(axis=1)) + 1
    kept: list[tuple] = []
    for a, b in pairwise([0, *cuts, len(sigma)]):
        est = knowing(system, float(sigma[a]), tuple(q[a].tolist()))
        part = slice(first + a, first + b)
        trace = est.scan(y[part], u[part] if u.shape[1] else None, state=state, keep="means")
        state = trace.state
        kept.append((trace.parameters, trace.innovation, trace.variance))
    return *(np.concatenate(each) for each in zip(*kept)), state


def walk(system: System, samples: int) -> np.ndarray:
    """Return the variance of each walk's step, (T, n)."""
    nvr = np.array(system.nvr or np.zeros(len(system.theta)))
    return np.tile(nvr * np.array(system.deviations) ** 2, (samples, 1))


def error(system: System, theta, truth) -> float:
    """Return the mean square error in deviations, from sample `SKIP` on."""
    return float(np.mean(((theta - truth)[..., SKIP:, :] / np.array(system.deviations)) ** 2))


def without_outliers(system: System, r: Records):
    """Return outputs and sigma (S, T) as who is told of the outliers takes them."""
    if system.of_process:
        return r.y, np.where(r.outliers, np.hypot(1.0, system.outliers[1]), 1.0) * r.sigma
    return np.where(r.outliers, np.nan, r.y), r.sigma


def told(system: System, r: Records) -> Told:
    """Run every reference over the records of a system."""
    (y, sigma), q = without_outliers(system, r), walk(system, r.y.shape[1])

    def rms(more) -> float:
        """Return the error of the filter whose walks are faster by ``more``."""
        paths = [follow(system, y[s], r.u[s], sigma[s], q + more)[0] for s in range(len(y))]
        return float(np.sqrt(np.mean([error(system, path, true) for path, true in zip(paths, r.theta)])))

    if not system.jumps:
        found = rms(0.0)
        return Told(found, found, "true Q", np.zeros((len(y), 0), bool))
    own = np.array(system.deviations) ** 2
    moving = np.isin(np.arange(len(own)), [i for _, who in system.jumps for i in who])
    tried = {f"all {v:g}": v * own for v in GRID}
    tried |= {} if moving.all() else {f"some {v:g}": v * own * moving for v in GRID[1:]}
    errors = {name: rms(more) for name, more in tried.items()}
    best = min(errors, key=lambda name: errors[name])
    rows = [oracle(system, y[s], r.u[s], sigma[s], r.jumps[s], r.moved[s], q) for s in range(len(y))]
    known = np.mean([error(system, theta, true) for (theta, _), true in zip(rows, r.theta)])
    return Told(errors[best], float(np.sqrt(known)), best, np.array([can for _, can in rows]))


def oracle(system: System, y, u, sigma, jumps, moved, q) -> tuple[np.ndarray, list[bool]]:
    """Return theta of the filter that is told the jumps, and which of them it would tell by itself."""
    jumping, kept, can = q.copy(), [], []
    for k, step in zip(jumps, moved):
        jumping[k - 1] += step**2
    state, start = None, 0
    for k, end in pairwise([*jumps.tolist(), len(y)]):
        theta, *_, state = follow(system, y, u, sigma[start : k - 1], q[start : k - 1], start, state)
        soon = slice(k - 1, min(k + SOON, end - 1))  # from the sample before, after which theta jumps
        logs = [evidence(system, y, u, sigma[soon], how[soon], k - 1, state) for how in (jumping, q)]
        can.append(bool(np.max(logs[0] - logs[1]) >= np.log(ODDS)))
        kept.append(theta)
        theta, *_, state = follow(system, y, u, sigma[k - 1 : k], jumping[k - 1 : k], k - 1, state)
        kept.append(theta)
        start = k
    kept.append(follow(system, y, u, sigma[start:], q[start:], start, state)[0])
    return np.concatenate(kept), can


def evidence(system: System, y, u, sigma, q, first, state) -> np.ndarray:
    """Return the log likelihood of the outputs up to each sample, but for the first."""
    _, e, v, _ = follow(system, y, u, sigma, q, first, state)
    return np.nancumsum(-0.5 * (np.log(v) + e**2 / v)[1:])
