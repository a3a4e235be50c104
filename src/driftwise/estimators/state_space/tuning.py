"""How large Q and R are, of the shapes that were given: by the likelihood of a record."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import scipy  # scipy.optimize loads where it is used

from ...engine.errors import InputError

DECADES = 4  # that a factor may be away from 1
COARSE = 9  # factors tried on the way to a start
FLAT = 1e-3  # of a log factor: the step of second differences


class Tuned(NamedTuple):
    """What a record says of the noise: its factors, and how sure it is.

    factors : by matrix, what multiplies the one that was given
    deviations : of their logarithms; infinite where the record sets no limit
    loglik, gain : log likelihood, and how much higher it is than with the matrices as given
    words : a sentence
    """

    factors: dict[str, float]
    deviations: dict[str, float]
    loglik: float
    gain: float
    words: str


def tune(est, y, u, time, which) -> Any:
    """Return the estimator with Q and R times the factors under which the record is most likely."""
    most = DECADES * math.log(10.0)

    def made(logs):
        changed = {name: scaled(est.options[name], math.exp(v)) for name, v in zip(which, logs)}
        return est.replace(**changed)

    def cost(logs):
        model = made(np.clip(logs, -most, most))
        loglik = model.loglik(model.scan(y, u, time=time, keep="innovations").state)
        return -loglik if math.isfinite(loglik) else 1e300

    start = np.zeros(len(which))
    for i in range(len(which)):  # along one axis after the other
        tried = [np.where(np.arange(len(start)) == i, v, start) for v in np.linspace(-most, most, COARSE)]
        start = min([start, *tried], key=cost)
    bounds = [(-most, most)] * len(which)
    found = scipy.optimize.minimize(
        cost, start, method="Nelder-Mead", bounds=bounds, options=dict(xatol=1e-4, fatol=1e-6, maxiter=400)
    )
    logs = np.clip(found.x, -most, most)
    deviations = dict(zip(which, _deviations(cost, logs, most)))
    factors = {name: math.exp(v) for name, v in zip(which, logs)}
    gain = cost(np.zeros(len(which))) - found.fun
    tuned = made(logs)
    tuned.tuned = Tuned(factors, deviations, -float(found.fun), float(gain), _words(factors, deviations, gain, most))
    return tuned


def scaled(matrix, factor: float) -> Any:
    """Return a covariance, or the function of dt that returns it, times a factor."""
    if callable(matrix):
        return lambda dt: factor * np.asarray(matrix(dt), float)
    return factor * np.asarray(matrix, float)


def _deviations(cost, logs, most) -> np.ndarray:
    """Return deviations by the curvature of the likelihood; infinite at a limit, and where it is flat."""
    m, steps = len(logs), FLAT * np.eye(len(logs))
    is_free = np.abs(logs) < most - 0.05
    J = np.zeros((m, m))
    for i in range(m):
        for j in range(i + 1):
            a, b = steps[i], steps[j]
            J[i, j] = J[j, i] = cost(logs + a + b) - cost(logs + a - b) - cost(logs - a + b) + cost(logs - a - b)
    J /= 4.0 * FLAT**2
    found, free = np.full(m, math.inf), np.flatnonzero(is_free)
    if len(free) and np.linalg.eigvalsh(J[np.ix_(free, free)])[0] > 0.1:  # less: a factor of twenty says the same
        found[free] = np.sqrt(np.diag(np.linalg.inv(J[np.ix_(free, free)])))
    return found


def _words(factors, deviations, gain, most) -> str:
    parts = []
    for name, factor in factors.items():
        if math.log(factor) < 0.05 - most:
            parts.append(f"of {name} the record shows nothing ({factor:.0e} of it, the least tried)")
        elif math.log(factor) > most - 0.05:
            parts.append(f"{name} is more than {factor:.0e} times as large, the most tried")
        else:
            sure = math.exp(min(deviations[name], 700.0))
            within = f", within a factor of {sure:.3g}" if sure < 20 else ", and hardly that"
            parts.append(f"{name} is {factor:.3g} times what was given{within}")
    said = "; ".join(parts)
    return f"{said[0].upper()}{said[1:]}. The log likelihood is {gain:.4g} higher."


def check(est, which) -> tuple[str, ...]:
    """Return the names of the covariances to tune, checked."""
    known = ("Q", "R") if est.has_known_scale else ("Q",)
    which = known if which is None else (which,) if isinstance(which, str) else tuple(which)
    if not which or any(name not in ("Q", "R") for name in which):
        raise InputError(f"which names what is tuned: Q, R or both, got {which!r}")
    if "R" in which and not est.has_known_scale:
        raise InputError("scale=.. learns what multiplies Q and R, so of the two tune Q alone: which='Q'")
    for name in which:
        if not np.any(getattr(est.system, name)):
            raise InputError(f"{name} is zero, and a factor of it as well: give the shape that it may have")
    return which
