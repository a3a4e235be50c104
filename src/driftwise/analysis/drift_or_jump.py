"""Did the parameters of a record drift, or jump, or neither? Odds, and a test where there are none to be had."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..engine.errors import InputError
from ..estimators.smoothing.fit import Fit, given, most_likely
from ..estimators.smoothing.jumps import detect, learner, steps
from ..estimators.smoothing.likelihood import FREED, Likelihood
from ..estimators.smoothing.smoother import readable

PARTS = 8  # of a record; after 2 to 6 of them the estimates are compared with the last ones
CLEAR = 0.3  # of a deviation must have been learnt since


class Odds(NamedTuple):
    """Log odds of a drift and of jumps, each against parameters that stay; and in words what moved."""

    drift: float
    jump: float
    drifted: str
    jumped: str

    @property
    def most(self) -> float:
        """Log odds of the likelier of the two."""
        return max(self.drift, self.jump)


class Constancy(NamedTuple):
    """The estimate that moved most, in deviations, after which sample, and how many comparisons were made."""

    deviations: float
    name: str
    sample: int
    tried: int


def odds(estimator, y, u=None) -> Odds | None:
    """Return the odds of drift and of jumps to constant parameters; None where the model is no regression on data.

    Constant parameters, random walks (each parameter at its most likely speed, at a price of log(T)/2 for each) and
    constant parameters that jump, all or one of the n (at a price of log T for each date, log n for each choice of one)
    explain the record in turn. The odds exceed 100:1 by chance in less than one record of a hundred.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> a = np.where(np.arange(800)[:, None] < 400, [-1.5, 0.7], [-1.3, 0.6])
    >>> y, u = dw.simulate(a, [1.0, 0.5], samples=800, noise_std=0.1, seed=1)
    >>> odds(dw.ARX(2, 2), y, u).jumped
    'a1 by +0.19 at sample 402'
    """
    est = estimator.as_regression()
    if est is None:
        return None
    try:
        record = readable(est, y, u if est.model.inputs else None)
    except InputError:  # too few complete rows
        return None
    plain = Likelihood(record, "walk")
    if len(plain.counted) < 2 * plain.n:
        return None
    constant, many = given(plain, np.zeros(plain.n)), math.log(len(plain.counted))
    walk = most_likely(plain)
    moving = [(nvr, name) for nvr, name in zip(walk.nvr, est.names) if nvr > 0]
    learn = learner(False, np.zeros(plain.n))
    jumped = detect(constant, learn)
    found = steps(jumped, learn)
    return Odds(
        walk.loglik - constant.loglik - 0.5 * many * len(moving) if moving else -math.inf,
        _best(jumped) - constant.loglik - many * len(found) if found else -math.inf,
        max(moving)[1] if moving else "",
        ", ".join(_step(step, est.names) for step in found),
    )


def _best(fit: Fit) -> float:
    """Return the log-likelihood where each jump is one of all parameters, or, at a price, of the likeliest one."""
    old, best = fit.likelihood, fit.loglik
    freed: dict[int, int] = {}  # the one parameter that each jump frees
    for k in old.jumps:
        found = {i: _freeing(old, freed | {k: i}) for i in np.flatnonzero(old.record.is_live).tolist()}
        i = max(found, key=lambda i: found[i])
        if found[i] > best:
            best, freed[k] = found[i], i
    return best


def _freeing(old: Likelihood, freed: dict[int, int]) -> float:
    """Return the log-likelihood where some jumps free one parameter, less log n for each of them."""
    likelihood, n = Likelihood(old.record, old.drift, old.jumps), old.n
    for k, i in freed.items():
        likelihood.extra[k - 1, :n] = FREED * old.unit * (np.arange(n) == i)
    return given(likelihood, np.zeros(n)).loglik - len(freed) * math.log(n)


def _step(step, names) -> str:
    """Return the parameter that jumped most, by how much and when."""
    which = int(np.argmax(np.abs(step.size) / np.maximum(step.std, 1e-300)))
    return f"{names[which]} by {step.size[which]:+.2g} at sample {step.sample}"


def constancy(trace) -> Constancy | None:
    """Return how far early estimates lie from the last ones, in deviations; None where the trace kept too little.

    Estimates that never forget are a martingale: theta(T) - theta(k) has the covariance sigma^2 (P(k) - P(T)), sigma^2
    the last one. Bad at: changes that are taken back, and models whose bars are approximate.
    """
    if not trace.has_bars:
        return None
    used = np.cumsum(trace.is_used)
    at = np.flatnonzero(used > 2 * trace.estimator.model.N)
    if len(at) < 4 * PARTS:
        return None
    at = np.unique([at[len(at) * i // PARTS] for i in range(2, PARTS - 1)])
    theta, std = trace.parameters, trace.parameters_std
    if not np.isfinite(std[-1]).all():  # a gradient has no bars
        return None
    std = std / scale(trace)[:, None]
    spread = np.sqrt(np.maximum(std[at] ** 2 - std[-1] ** 2, 0.0))
    is_clear = spread > CLEAR * std[at]
    z = np.divide(theta[at] - theta[-1], spread, out=np.zeros(spread.shape), where=is_clear)
    i, j = np.unravel_index(int(np.argmax(np.abs(z))), z.shape)
    return Constancy(float(abs(z[i, j])), trace.names[j], int(at[i]), max(int(is_clear.sum()), 1))


def scale(trace) -> np.ndarray:
    """Return the learnt sigma at each sample over the last one, (T,), from the trace of a memory that never forgets.

    sigma^2 is chi2/dof, and a sample adds e^2/T sigma^2 to chi2. A thinned trace is too long for it to matter: ones.
    """
    before, found = trace.dof, np.ones(len(trace))
    if not np.isfinite(before).all() or np.any(np.diff(before) > 1):
        return found
    share = np.where(trace.is_used & (trace.variance > 0), trace.innovation**2 / trace.variance, 1.0)
    more = np.append(np.diff(before), 1.0)
    found = np.cumsum(np.log((before + more * share) / (before + more)))
    return np.exp(0.5 * (found - found[-1]))
