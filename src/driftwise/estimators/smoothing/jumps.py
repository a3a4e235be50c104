"""Jumps of the parameters in a record, found by the smoother: interventions (Young; de Jong and Penzer 1998).

r_i(k)^2 / (sigma^2 N_ii(k)) is the square of the smoothed step of parameter i between samples k and k + 1 over its own
deviation, whatever the drift was taken to be: chi2 on one degree of freedom as long as the model holds. The largest one
frees all parameters at that sample, the drift is learnt anew, and so on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .fit import Fit, given, most_likely
from .likelihood import Likelihood

THRESHOLD = 30.0  # by chance once in 10^4 records of 600 samples and four parameters
MOST = 6
APART = 3  # samples between two jumps
NEAR = 6  # samples by which the first date of a jump may be wrong

Learn = Callable[..., Fit]  # learn(likelihood, starts=None, constant=())


class Step(NamedTuple):
    """A jump between ``sample`` - 1 and ``sample``: size of each parameter's step, deviation, and log of the odds."""

    sample: int
    size: np.ndarray
    std: np.ndarray
    log_odds: float


def statistic(fit: Fit) -> np.ndarray:
    """Return, for each sample k, the largest r_i^2/(sigma^2 N_ii) of a step of a parameter from k - 1 to k, (T,)."""
    r, N = (of_each[:-1] for of_each in fit.likelihood.disturbances(fit.nvr))
    is_seen = N > 1e-12 * N.max(axis=0, initial=0.0)
    return np.append(0.0, np.max(np.divide(r * r, fit.s2 * N, out=np.zeros_like(r), where=is_seen), axis=1))


def next_jump(fit: Fit) -> int | None:
    """Return the sample at which the parameters jumped most surely, if any did."""
    found, edge = statistic(fit), fit.likelihood.n
    found[: fit.likelihood.head] = 0.0
    found[len(found) - edge :] = 0.0
    for k in fit.likelihood.jumps:
        found[max(k - APART, 0) : k + APART + 1] = 0.0
    k = int(np.argmax(found))
    return k if found[k] >= THRESHOLD else None


def detect(fit: Fit, learn: Learn) -> Fit:
    """Return the fit with interventions at the jumps found, one after the other."""
    for _ in range(MOST):
        k = next_jump(fit)
        if k is None:
            break
        fit = freed(fit, sorted((*fit.likelihood.jumps, k)), learn)
    fit = dated(fit, learn)
    while fit.likelihood.jumps:  # one that a later one explains is taken back
        odds = [log_odds(fit, k, learn) for k in fit.likelihood.jumps]
        least = int(np.argmin(odds))
        if odds[least] > 0:
            break
        fit = freed(fit, [k for k in fit.likelihood.jumps if k != fit.likelihood.jumps[least]], learn)
    return fit


def dated(fit: Fit, learn: Learn) -> Fit:
    """Return the fit with each jump where the record is most likely, a few samples from where it was found."""
    jumps = list(fit.likelihood.jumps)
    for i, k in enumerate(jumps):
        near = [at for at in range(k - NEAR, k + NEAR + 1) if at == k or (fit.likelihood.head <= at not in jumps)]
        near = [at for at in near if at < len(fit.likelihood.rows)]
        moved = [
            Likelihood(fit.likelihood.record, fit.likelihood.drift, [*jumps[:i], at, *jumps[i + 1 :]]) for at in near
        ]
        jumps[i] = near[int(np.argmax([given(other, fit.nvr).loglik for other in moved]))]
    return fit if tuple(jumps) == fit.likelihood.jumps else freed(fit, sorted(jumps), learn)


def freed(fit: Fit, jumps, learn: Learn) -> Fit:
    """Return the fit with these jumps instead: the drift between them is learnt from a tenth of what it was."""
    old = fit.likelihood
    return learn(Likelihood(old.record, old.drift, jumps), [np.maximum(fit.nvr / 10, 1e-8)])


def log_odds(fit: Fit, jump: int, learn: Learn) -> float:
    """Return the log of the odds that the parameters jumped just there, to no jump and the drift that explains it best.

    Prior odds: one jump in the record, anywhere. Its size is integrated out, with the variance given to it.
    """
    without = freed(fit, [k for k in fit.likelihood.jumps if k != jump], learn)
    return fit.loglik - without.loglik - math.log(len(fit.likelihood.counted))


def steps(fit: Fit, learn: Learn) -> list[Step]:
    """Return what happened at each jump of a fit."""
    found = []
    q, (r, N) = fit.likelihood.variances(fit.nvr), fit.likelihood.disturbances(fit.nvr)
    for k in fit.likelihood.jumps:
        free = q[k - 1, : fit.likelihood.n]
        std = np.sqrt(fit.s2 * np.maximum(free - free**2 * N[k - 1], 0.0))
        found.append(Step(k, free * r[k - 1], std, log_odds(fit, k, learn)))
    return found


def learner(shared: bool, nvr=None) -> Learn:
    """Return what finds the drift of a likelihood: the most likely one, or the one given."""

    def learn(likelihood, starts=None, constant=()):
        if nvr is not None:
            return given(likelihood, np.where(np.isin(np.arange(likelihood.n), constant), 0.0, nvr))
        if shared and starts:
            starts = [start.max() for start in starts]
        return most_likely(likelihood, shared, starts, constant)

    return learn
