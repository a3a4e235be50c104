"""A nominal drift, and a posterior of noise variance and P around it, by variational Bayes."""

from typing import Any, NamedTuple

import numpy as np

from ..engine import validation
from ..engine.dispatch import PerParameter, kernel
from ..engine.errors import InputError
from ..engine.ud import correct, covariances, predicted_variance, widen_along
from .questions import adapt, count, least_squares, resolve
from .registry import register
from .unknown_drift import (
    SEEN,
    UNEXCITED,
    common,
    count_unless_at_rest,
    drift_state_size,
    excite,
    learns_drift,
    open_drift_state,
)
from .wind_up import hold_within


@register(
    "variational",
    "variational:RULE",
    about="variational Bayes; RULE is drift, noise or both",
    read=lambda words: VariationalBayes(words.rest),
)
class VariationalBayes(NamedTuple):
    """Noise variance, P, or both, by variational Bayes around a drift of nominal noise variance ratio ``nvr``.

    ``rule``: "noise", sigma^2 alone, fading in 50 samples (Sarkka and Nummenmaa 2009); "both", sigma^2 and P (Huang,
    Zhang, Wu, Li and Chambers 2018); "drift", P alone, sigma^2 known or learnt as everywhere. Under the first two the
    nominal q is an absolute variance: the ratio times the noise variance of the prior (``scale``), or of the first 6 N
    samples. ``phi`` is that of `Drift`. Bad at: drift, which none of them learns: where the nominal one is too small,
    "noise" and "both" call it noise, widen the one and follow the other too slowly (errors two to seven times those of
    a known q, bars far too short). They are here for comparison.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> slope = np.cumsum(0.05 * rng.standard_normal(500))  # it walks
    >>> phi = rng.standard_normal((500, 1))
    >>> y = phi[:, 0] * slope + 0.1 * rng.standard_normal(500)
    >>> trace = dw.Regression(1, memory=dw.memory.VariationalBayes(nvr=0.25)).scan(y, phi)
    >>> f"{trace.parameters[-1, 0]:.2f} ± {trace.parameters_std[-1, 0]:.2f}, the truth is {slope[-1]:.2f}"
    '-0.76 ± 0.08, the truth is -0.89'
    """

    rule: str = "drift"
    nvr: float = 1e-3
    phi: Any = 1.0


RULES = ("noise", "both", "drift")
NOISE, BOTH, DRIFT = range(3)
FADING = {"noise": 0.98, "both": 1.0 - float(np.exp(-4.0))}  # of what sigma^2 rests on
TAU, TURNS, FEWER = 3.0, 5, 3  # weight of the nominal P, turns of the iterations


class VariationalBayesKernel(NamedTuple):
    """What the kernel sees of `VariationalBayes`."""

    R: float
    phi: PerParameter
    cap: PerParameter
    floor: float
    moving: float
    discount: float
    rule: float
    nvr: float
    settle: float
    weight: float  # of the prior of sigma^2
    chi2: float

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters, OWN)


WEIGHT, CHI2, FIRST, OWN = range(4)  # own numbers: sigma^2 is CHI2/WEIGHT; FIRST: the one that q is meant for


learns_drift(VariationalBayesKernel)


@resolve.on(VariationalBayes)
def resolve_variational_bayes(memory, setting):
    name, nvr = validation.one_of("rule", memory.rule, RULES), validation.positive("nvr", memory.nvr)
    numbers, weight, chi2 = common(setting, memory.phi), 0.0, 0.0
    if name != "drift":
        if not setting.is_learnt:
            raise InputError(
                f"VariationalBayes(rule={name!r}) learns the variance of the noise, and variance=.. says it is known: "
                "leave variance out, add a prior (scale=InverseGamma(alpha, beta)), or take rule='drift'"
            )
        numbers["discount"], (weight, chi2) = FADING[name], setting.prior_counts
    return VariationalBayesKernel(
        **numbers, rule=RULES.index(name), nvr=nvr, settle=0.0 if weight >= 1 else 6.0 * setting.N,
        weight=weight, chi2=chi2,
    )  # fmt: skip


@adapt.on(VariationalBayesKernel)
def adapt_variational_bayes(memory, state, e, R, view):
    drift, D, s2 = open_drift_state(state, view.D.size), view.D, view.s2
    own, seen = drift.own, drift.head[SEEN]
    if excite(memory, drift, view.row, True):
        return least_squares(e, R, view)
    own[WEIGHT] = memory.discount * own[WEIGHT] + 1.0 if seen > 0.0 else memory.discount * memory.weight + 1.0
    own[CHI2] = memory.discount * own[CHI2] if seen > 0.0 else memory.discount * memory.chi2
    p, is_relative = predicted_variance(view.f, D, 0.0), memory.rule == DRIFT
    if not is_relative and seen < memory.settle:
        own[CHI2] += e / (p + R) * e
        own[FIRST] = own[CHI2] / max(own[WEIGHT], 1.0)
        is_relative = True
    elif own[FIRST] == 0.0:
        own[FIRST] = s2
    if memory.rule == NOISE:
        if not is_relative:
            own[CHI2] += residual(own, p, R, e, s2)
        least_squares(e, R, view)
    else:
        adapt_covariance(memory, own, p, R, e, is_relative, view)
    nvr = memory.nvr
    if not is_relative:  # P and q are absolute: what they are relative to changes
        after = own[CHI2] / own[WEIGHT]
        nvr *= own[FIRST] / after
        for i in range(D.size):
            D[i] *= s2 / after
    for i in range(D.size):
        drift.q[i] = nvr * drift.unit[i]
    return p + R


@count.on(VariationalBayesKernel)
def count_variational_bayes(memory, state, count, chi2, weight, gain):
    drift = open_drift_state(state, memory.cap.size)
    count, chi2, weight = count_unless_at_rest(memory, state, count, chi2, weight, gain)
    if memory.rule != DRIFT and drift.head[UNEXCITED] == 0.0:
        return drift.own[WEIGHT], drift.own[CHI2], weight
    return count, chi2, weight


@kernel
def residual(own, p, R, e, s2):
    """Return E (y - psi' theta)^2 given y, in units of R, at the variance it leads to."""
    r, z = 1.0, 0.0
    for _ in range(FEWER):
        S = p + r * R
        z = (r * R / S) * (e / S) * (e * r) + s2 * r * (p / S)
        r = (own[CHI2] + z) / own[WEIGHT] / s2
    return z


@kernel
def adapt_covariance(memory, own, p, R, e, is_fixed, view):
    """Huang's iteration. All its covariances are P + a b b'/p with b = P psi, p = psi' b: a number is iterated.

    P <- (tau P + P_f + (K e)(K e)')/(tau + 1), where K = k b and P_f = P less the share of b b'/p that is learnt.
    """
    theta, U, D, s2, a, r, z = view.theta, view.U, view.D, view.s2, 0.0, 1.0, 0.0
    for _ in range(TURNS):
        S = p * (1.0 + a) + r * R
        k, left = (1.0 + a) / S, r * R / S
        learnt = 1.0 - (1.0 + a) * left
        a = ((k * e) * (p / s2) * (k * e) - learnt) / (TAU + 1.0)
        if not is_fixed:
            z = left * e / R * (left * e) + s2 * (p / R) * (1.0 - learnt)
            r = (own[CHI2] + z) / own[WEIGHT] / s2
    S = p * (1.0 + a) + r * R
    k, room = (1.0 + a) / S, p + a * (p - r * R)
    if not is_fixed:
        own[CHI2] += z
    if room > 0.0:  # as if the noise had another variance
        correct(U, D, view.f, r * R * (1.0 + a) * (p / room), view.b)
    else:
        covariances(U, D, view.f, view.b)
    for i in range(D.size):
        theta[i] += k * view.b[i] * e
    if p > 0.0 and not room > 0.0:
        widen_along(U, D, view.b, ((1.0 + a) * (r * R / S) - 1.0) / p, D.size - 1)
        hold_within(U, D, memory.cap, view.c, view.f, view.b)
