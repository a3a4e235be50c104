"""Did the parameters of a record drift, or jump, or neither? Odds, and a test where there are none to be had."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError
from ..estimators.hindsight.fit import given, most_likely
from ..estimators.hindsight.jumps import detect, learner, steps
from ..estimators.hindsight.likelihood import Likelihood
from ..estimators.hindsight.smoother import readable
from ..estimators.joint.estimator import Joint
from ..estimators.recursive.estimator import ARX
from ..models.noise import EquationError

__all__ = ["Constancy", "Odds", "constancy", "odds", "regression"]

PARTS = 8  # of a record, after each of which the estimates are compared with the last ones


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


def regression(estimator) -> Any:
    """Return the estimator as a regression on data: itself, or an ARX of the same lags; None where it is none."""
    if isinstance(estimator, ARX):  # AR, Regression too
        return estimator if estimator.options["method"] == "ls" else None
    if not isinstance(estimator, Joint) or not isinstance(estimator.options["noise"], EquationError):
        return None
    form = estimator.model
    lags = (form.n + form.direct,) * form.inputs
    return ARX(form.n, lags, (1 - form.direct,) * form.inputs)


def odds(estimator, y, u=None) -> Odds | None:
    """Return the odds of drift and of jumps to constant parameters; None where the model is no regression on data.

    Constant parameters, random walks (each parameter at its most likely speed, at a price of log(T)/2 for each) and
    constant parameters that jump (at a price of log T for each date) explain the record in turn. The odds exceed 100:1
    by chance in less than one record of a hundred, whatever the model.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> a = np.where(np.arange(800)[:, None] < 400, [-1.5, 0.7], [-1.3, 0.6])
    >>> y, u = dw.simulate(a, [1.0, 0.5], samples=800, noise_std=0.1, seed=1)
    >>> odds(dw.ARX(2, 2), y, u).jumped
    'a1 by +0.19 at sample 402'
    """
    est = regression(estimator)
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
        jumped.loglik - constant.loglik - many * len(found) if found else -math.inf,
        max(moving)[1] if moving else "",
        ", ".join(_step(step, est.names) for step in found),
    )


def _step(step, names) -> str:
    """Return the parameter that jumped most, by how much and when."""
    which = int(np.argmax(np.abs(step.size) / np.maximum(step.std, 1e-300)))
    return f"{names[which]} by {step.size[which]:+.2g} at sample {step.sample}"


def constancy(trace) -> Constancy | None:
    """Return how far early estimates lie from the last ones, in deviations; None where the trace kept too little.

    Estimates that never forget are a martingale: theta(T) - theta(k) has the covariance P(k) - P(T). Bad at: changes
    that are taken back, and models whose bars are approximate.
    """
    if not trace.has_bars:
        return None
    used = np.cumsum(trace.is_used)
    at = np.flatnonzero(used > 2 * trace.estimator.model.N)
    if len(at) < 4 * PARTS:
        return None
    at = np.unique([at[len(at) * i // PARTS] for i in range(1, PARTS)])
    theta, std = trace.parameters, trace.parameters_std
    spread = np.sqrt(np.maximum(std[at] ** 2 - std[-1] ** 2, 0.0))
    is_clear = spread > 0.1 * std[at]  # what was learnt since counts
    z = np.divide(theta[at] - theta[-1], spread, out=np.zeros(spread.shape), where=is_clear)
    i, j = np.unravel_index(int(np.argmax(np.abs(z))), z.shape)
    return Constancy(float(abs(z[i, j])), trace.names[j], int(at[i]), max(int(is_clear.sum()), 1))
