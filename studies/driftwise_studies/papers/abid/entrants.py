"""Every memory that is ranked, and how one is run over a test system."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

import driftwise as dw

from . import plain
from .systems import RANKED, System

SKIP = 50  # samples that do not count
KNOWN, TOLD, PRIOR, LEARNT = "known", "told", "prior", "learnt"


class Entrant(NamedTuple):
    """A memory (of the parameters' Phi) and what it is told of sigma^2: it is known, where to begin (two ways), or "
    "nothing."""

    name: str
    memory: Callable[[np.ndarray], Any]
    sigma2: str = KNOWN


class Outcome(NamedTuple):
    """What came out on one system: errors from sample 50 on, bars, status of every sample, last sigma^2, cost."""

    rmse: float
    inside: float  # share of the true parameters within 1.96 deviations
    nis: float
    status: np.ndarray  # (S, T)
    sigma2: np.ndarray  # (S,), of the last sample
    ns: float  # of processor time, a sample of a record, everything included


def each(name, memory, *sigma2) -> list[Entrant]:
    """Return the memory with sigma^2 known and learnt, or as given."""
    return [Entrant(name, memory, how) for how in sigma2 or (KNOWN, LEARNT)]


def matching(rule):
    """Return covariance matching by a rule."""
    return lambda phi: dw.memory.CovarianceMatching(rule, phi=phi)


def automatic(expect):
    """Return the default memory."""
    return lambda phi: dw.AutoMemory(expect, phi=phi)


KNOWN_Q = "known Q"
AUTO = "AutoMemory"
ENTRANTS = [
    Entrant(KNOWN_Q, lambda phi: None),
    *each("Constant (RLS)", lambda phi: dw.Constant(), LEARNT),
    *each("Drift, NVR 1e-3", lambda phi: dw.memory.Drift(phi, nvr=1e-3), LEARNT),
    *each("ExponentialForgetting .98", lambda phi: dw.ExponentialForgetting(0.98), LEARNT),
    *each("ExponentialForgetting .95", lambda phi: dw.ExponentialForgetting(0.95), LEARNT),
    *each("VariableForgetting", lambda phi: dw.memory.VariableForgetting(), LEARNT),
    *each("FuzzyDrift", lambda phi: dw.memory.FuzzyDrift(phi=phi)),
    *each("FuzzyDrift, as published", lambda phi: dw.memory.FuzzyDrift(as_published=True, phi=phi), KNOWN),
    *each("CovarianceMatching, scalar", matching("scalar")),
    *each("CovarianceMatching, gain", matching("gain")),
    *each("CovarianceMatching, Myers-Tapley", matching("myers-tapley")),
    *each("CovarianceMatching, EM", matching("em"), KNOWN),
    *each("AuxiliaryFilter", lambda phi: dw.memory.AuxiliaryFilter(phi=phi)),
    *each("AutocovarianceLS", lambda phi: dw.memory.AutocovarianceLS(phi=phi)),
    *each("LikelihoodDrift, shared", lambda phi: dw.memory.LikelihoodDrift(shared=True, phi=phi)),
    *each("LikelihoodDrift, each", lambda phi: dw.memory.LikelihoodDrift(phi=phi)),
    *each("VariationalBayes, noise", lambda phi: dw.memory.VariationalBayes("noise", phi=phi), PRIOR),
    *each("VariationalBayes, both", lambda phi: dw.memory.VariationalBayes("both", phi=phi), PRIOR),
    *each("VariationalBayes, drift", lambda phi: dw.memory.VariationalBayes("drift", phi=phi), KNOWN),
    *each("MultipleModel", lambda phi: dw.memory.MultipleModel(phi=phi)),
    *each("IMM", lambda phi: dw.memory.IMM(phi=phi)),
    *each("IMM, no jump mode", lambda phi: dw.memory.IMM(jumps=0.0, phi=phi), KNOWN),
    *each(AUTO, automatic("both"), KNOWN, TOLD, LEARNT),
    *each("AutoMemory, expect jumps", automatic("jumps"), KNOWN, LEARNT),
    *each("AutoMemory, expect outliers", automatic("outliers"), LEARNT),
]


def options(s: System, sigma2: str) -> dict[str, Any]:
    """Return what an estimator is told of the noise and of its start.

    Told: sigma^2 with the weight of one sample, beside a vague prior of theta in its own units. As P is relative to
    sigma^2, such a prior takes N/2 from alpha, like the reference prior: else N innovations that it makes small pass
    for N samples of little noise. Prior: both relative to sigma^2, and it counts as data.
    """
    if sigma2 == LEARNT:
        return {}
    if sigma2 in (TOLD, PRIOR):
        alpha = 0.5 - s.psi.shape[2] / 2 if sigma2 == TOLD else 0.5
        return dict(scale=dw.models.InverseGamma(alpha, 0.5 * s.told), P0=1000.0 / s.told)
    return dict(variance=s.told, P0=1000.0)


def scans(s: System, entrant: Entrant) -> list:
    """Return what scans a record: the regression on psi, one for each stretch of constant Q where Q is known."""
    if entrant.name != KNOWN_Q:
        est = dw.Regression(s.psi.shape[2], memory=entrant.memory(s.phi), **options(s, entrant.sigma2))
        return [(slice(0, s.y.shape[1]), est)]
    ends = [0, *(1 + np.flatnonzero(np.any(np.diff(s.q, axis=0) != 0, axis=1))), len(s.q)]
    return [
        (slice(a, b), dw.Regression(s.psi.shape[2], memory=dw.memory.Drift(s.phi, s.q[a]), **options(s, KNOWN)))
        for a, b in pairwise(ends)
    ]


def run(s: System, entrant: Entrant) -> Outcome:
    """Run a memory over every record of a system."""
    parts, kept, final = scans(s, entrant), [], []
    parts[0][1].scan(s.y[0, :5], s.psi[0, :5])  # compiles
    began = time.thread_time()
    for y, psi in zip(s.y, s.psi):
        state = None
        for part, est in parts:
            trace = est.scan(y[part], psi[part], state=state)
            state = trace.state
            kept.append((trace.parameters, trace.parameters_std, trace.innovation**2 / trace.variance, trace.status))
        final.append(est.sigma2(state))
    ns = 1e9 * (time.thread_time() - began) / s.y.size
    theta, std, nis, status = (np.concatenate(each).reshape(*s.y.shape, *each[0].shape[1:]) for each in zip(*kept))
    error, std = (theta - s.theta)[:, SKIP:], std[:, SKIP:]
    return Outcome(
        float(np.sqrt((error**2).mean())),
        float((np.abs(error) < 1.96 * std).mean()),
        float(nis[:, SKIP:].mean()),
        status,
        np.array(final),
        ns,
    )


def run_all(s: dict[str, System], entrant: Entrant) -> dict[str, Outcome]:
    """Run a memory over all ranked systems; one that is told nothing of sigma^2 cannot tell c, f10 and f01 apart."""
    found = {name: run(s[name], entrant) for name in RANKED if entrant.sigma2 != LEARNT or name not in ("f10", "f01")}
    return {name: found.get(name) or found["c"] for name in RANKED}


def reference(s: System) -> float:
    """Return the parameter RMSE of the filter that knows Q and sigma^2 (b, d: with the best constant Q)."""
    path = plain.follow(s, plain.Known(s.q), sigma2=s.sigma2)
    return float(np.sqrt(((path.filtered - s.theta)[:, SKIP:] ** 2).mean()))
