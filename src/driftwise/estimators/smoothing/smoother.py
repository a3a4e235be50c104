"""A record in hindsight: how its parameters drift, when they jumped, what they were at every sample."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...engine import ud, validation
from ...engine.errors import InputError
from ...engine.status import OUTLIER, REJECTED
from ...memory.auto import AutoMemory
from ..arx.row import HUGE
from . import jumps as found_jumps
from .average import average, points
from .fit import BOUNDS, Fit
from .jumps import Learn, Step, learner, steps
from .likelihood import Likelihood
from .passes import GAIN
from .record import record_of

DRIFTS = ("auto", "walk", "integrated")
BOTH = ("walk", "integrated")


class Hindsight(NamedTuple):
    """Filtered and smoothed moments of the parameters, (T, n) each, and what they follow from."""

    fit: Fit
    learn: Learn
    logliks: dict[str, float]  # of each drift, before any jump was looked for
    steps: list[Step]
    hyper: str  # "ml", "average" over the drifts that the record leaves open, or "given"
    is_used: np.ndarray
    filtered: np.ndarray
    filtered_std: np.ndarray
    parameters: np.ndarray
    packed: np.ndarray  # upper triangles of the smoothed covariances, by columns


def look_back(est, y, u=None, drift="auto", hyper="ml", jumps: Any = "detect", lag=None, shared=False) -> Hindsight:
    """Return the record in hindsight; everything a user hands over is checked here."""
    record = readable(est, y, u)
    drift = validation.one_of("drift", drift, DRIFTS)
    shared = validation.yes("shared", shared)
    lag = None if lag is None else validation.count("lag", lag)
    nvr = ratios(hyper, record.n)
    if drift == "auto" and (nvr is not None or np.any(record.phi != 1)):
        drift = "walk"  # ratios are given for a walk unless one says otherwise; a pull to zero is a walk's
    learn = learner(shared, nvr)
    known = given_jumps(jumps, record, drift)
    fits = [learn(Likelihood(record, kind, known)) for kind in (BOTH if drift == "auto" else [drift])]
    logliks = {fit.likelihood.drift: fit.loglik for fit in fits}
    fit = max(fits, key=lambda one: one.loglik)
    if isinstance(jumps, str):
        fit = found_jumps.detect(fit, learn)
    said = hyper if nvr is None else "given"
    return moments(fit, learn, logliks, lag, points(fit, shared) if said == "average" else [fit.nvr], said)


def moments(fit: Fit, learn: Learn, logliks, lag, nvrs, hyper) -> Hindsight:
    """Return the moments of a fit, averaged over several drifts where there are some."""
    parts = [of_one(fit.likelihood, nvr, lag) for nvr in nvrs]
    (filtered, P), (theta, packed) = (average(list(part)) for part in zip(*parts))
    at = diagonal(fit.likelihood.n)
    return Hindsight(
        fit, learn, logliks, steps(fit, learn), hyper, fit.likelihood.record.known,
        filtered, np.sqrt(P[:, at]), theta, packed,
    )  # fmt: skip


def of_one(likelihood: Likelihood, nvr, lag):
    """Return mean (T, n) and covariance (T, upper triangle by columns) under one drift, filtered and smoothed."""
    n, m, s2 = likelihood.n, likelihood.m, likelihood.at(nvr, with_gradient=False).s2
    kept, out = likelihood.moments(nvr, lag)
    states, (j, i) = kept[:, GAIN + m :], np.tril_indices(n)
    P = ud.unpack(states[:, 2 * m :], states[:, m : 2 * m])[:, i, j]
    return (states[:, :n].copy(), s2 * P), (out[:, :n], s2 * out[:, n:])


def diagonal(n: int) -> np.ndarray:
    """Return where the variances are in an upper triangle listed by columns."""
    at = np.arange(n)
    return at * (at + 3) // 2


def readable(est, y, u):
    """Return the record of an estimator; outliers that its gate rejects, or its memory finds, are missing."""
    if est.options["method"] != "ls":
        raise InputError(
            f"smooth and tune need a covariance and white noise, which method={est.options['method']!r} does without: "
            "use method='ls'"
        )
    y, u = validation.record(y, u, est.model.inputs)
    y, u = (np.where(np.abs(values) < HUGE, values, np.nan) for values in (y, u))
    if est.options["gate"] is not None or isinstance(est.options["memory"], AutoMemory):
        trace = est.scan(y, u if est.model.inputs else None, keep="innovations")
        y = np.where(trace.status & (REJECTED | OUTLIER), np.nan, y)
    return record_of(est, y, u, transition(est))


def transition(est) -> np.ndarray:
    """Return what remains of each parameter from one sample to the next, as the memory says: 1 unless it relaxes."""
    phi = getattr(est.options["memory"], "phi", 1.0)
    if np.ndim(phi) == 2:
        raise InputError("smooth and tune need a diagonal phi, got a matrix in memory")
    return validation.each("phi", phi, est.model.N)


def ratios(hyper, n: int) -> np.ndarray | None:
    """Return the NVR of each parameter, None where they are to be learnt."""
    if isinstance(hyper, str):
        validation.one_of("hyper", hyper, ("ml", "average"))
        return None
    nvr = validation.each("hyper", hyper, n)
    if np.any(nvr < 0) or np.any(nvr > 1 / BOUNDS["walk"][0]):
        raise InputError(
            "hyper must be 'ml', 'average', or noise-to-variance ratios q ms/sigma^2 that are not negative, "
            f"got {hyper!r}; is one a logarithm?"
        )
    return nvr


def given_jumps(jumps, record, drift) -> list[int]:
    """Return the samples at which all parameters are said to be new; the likelihood counts from the first on."""
    if jumps is None or isinstance(jumps, str):
        if jumps is not None:
            validation.one_of("jumps", jumps, ("detect",))
        return []
    first = Likelihood(record, "walk" if drift == "auto" else drift).head
    samples = sorted({validation.count("a sample of jumps", k) for k in np.atleast_1d(jumps).tolist()})
    if samples and not first <= samples[0] <= samples[-1] < len(record.y):
        raise InputError(
            f"jumps must be samples from {first} to {len(record.y) - 1}, got {samples}; the first ones only settle the "
            "prior. Are they times in seconds?"
        )
    return samples
