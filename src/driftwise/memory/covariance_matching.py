"""Drift by covariance matching: innovations larger than expected say that the parameters wander faster."""

from typing import Any, NamedTuple

from ..engine import validation
from ..engine.dispatch import PerParameter, kernel
from .questions import resolve
from .registry import register
from .unknown_drift import START, common, drift_state_size, learns_drift, revise, starts


@register(
    "matching",
    "matching:RULE",
    about="the ratio is learnt by covariance matching; RULE is scalar, gain, myers-tapley or em",
    read=lambda words: CovarianceMatching(words.rest),
)
class CovarianceMatching(NamedTuple):
    """The speed of drift that makes innovations as large as expected, over the last 1/``gain`` samples.

    ``rule``: "scalar", one noise variance ratio a for all, e^2 - S explained by a sum psi_i^2 R/ms_i; "gain", q the
    mean of (K e)^2, each parameter its own; "myers-tapley", the mean of (K e)^2 + P(k) - Phi P(k-1) Phi', never
    negative; "em", one step of expectation-maximisation a sample. The window is exponential. ``phi`` is that of
    `Drift`. Sources: Jazwinski (1969); Sage and Husa (1969); Myers and Tapley (1976). Bad at: parameters of unequal
    speed, and their bars: every rule is driven by e^2 - S alone, one number, and only the gain shares it out;
    parameters that rest ("scalar" and "gain": errors twice those of least squares); "em" hardly leaves its start, and
    "myers-tapley" follows too slowly. A noise variance told wrong is taken for drift; learnt besides, it competes for
    the same number, and costs less than that.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> slope = np.cumsum(0.05 * rng.standard_normal(500))  # it walks
    >>> phi = rng.standard_normal((500, 1))
    >>> y = phi[:, 0] * slope + 0.1 * rng.standard_normal(500)
    >>> trace = dw.Regression(1, memory=dw.memory.CovarianceMatching()).scan(y, phi)
    >>> f"{trace.parameters[-1, 0]:.2f} ± {trace.parameters_std[-1, 0]:.2f}, the truth is {slope[-1]:.2f}"
    '-0.79 ± 0.08, the truth is -0.89'
    """

    rule: str = "scalar"
    gain: float = 0.02
    phi: Any = 1.0


RULES = ("scalar", "gain", "myers-tapley", "em")
SCALAR, GAIN, MYERS, EM = range(4)
LEAST, MOST = 1e-8, 10.0  # noise variance ratios


class CovarianceMatchingKernel(NamedTuple):
    """What the kernel sees of a `CovarianceMatching`."""

    R: float
    phi: PerParameter
    cap: PerParameter
    floor: float
    moving: float
    discount: float
    rule: float
    gain: float

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters, UNIT + parameters)


# own numbers: of the scalar rule the ratio, the means of what it is to explain and of what it explains it by, and the
# units q was in; of Myers and Tapley the mean, which may be negative
RATIO, TODO, BY, UNIT = range(4)


learns_drift(CovarianceMatchingKernel)


@resolve.on(CovarianceMatching)
def resolve_covariance_matching(memory, setting):
    rule = RULES.index(validation.one_of("rule", memory.rule, RULES))
    return CovarianceMatchingKernel(
        **common(setting, memory.phi), rule=rule, gain=validation.share("gain", memory.gain)
    )


@revise.on(CovarianceMatchingKernel)
def revise_covariance_matching(policy, own, sample, theta, U, D, q):
    if starts(sample, q):
        own[RATIO] = START
        for i in range(q.size):
            own[UNIT + i] = sample.unit[i]
    elif policy.rule == SCALAR:
        match_scalar(policy, own, sample, q)
    elif policy.rule == GAIN:
        match_gain(policy, sample, q)
    elif policy.rule == MYERS:
        match_myers_tapley(policy, own, sample, q)
    else:
        climb_em(policy, sample, q)


@kernel
def excess(sample):
    """Return e^2/(s2 T) - 1."""
    return sample.e / sample.T * (sample.e / sample.s2) - 1.0


@kernel
def within(q, unit, least, most):
    """Return q within these noise variance ratios."""
    return min(max(q, least * unit), most * unit)


@kernel
def match_scalar(policy, own, sample, q):
    """One ratio a: e^2 - R - psi' Phi P Phi' psi = a h, h = sum psi_i^2 R/ms_i."""
    h = 0.0
    for i in range(q.size):
        h += sample.psi[i] * own[UNIT + i] * sample.psi[i]
        own[UNIT + i] = sample.unit[i]
    own[TODO] += policy.gain * (sample.T * excess(sample) + own[RATIO] * h - own[TODO])
    own[BY] += policy.gain * (h - own[BY])
    if own[BY] > 1e-12 * sample.R:
        own[RATIO] = min(max(own[TODO] / own[BY], 0.0), MOST)
    for i in range(q.size):
        q[i] = own[RATIO] * sample.unit[i]


@kernel
def match_gain(policy, sample, q):
    """Set q to the mean of (Phi K e)^2."""
    for i in range(q.size):
        step = policy.phi[i] * sample.b[i] / sample.T * sample.e
        q[i] = within(q[i] + policy.gain * (step / sample.s2 * step - q[i]), sample.unit[i], LEAST, MOST)


@kernel
def match_myers_tapley(policy, own, sample, q):
    """Set q to the mean of (K e)^2 + P(k) - Phi P(k-1) Phi', which is that of K (e^2 - T) K' + q."""
    for i in range(q.size):
        if own[RATIO] > 0.0:  # the first time
            own[UNIT + i] = START * sample.unit[i]
        more = sample.b[i] / sample.T * sample.b[i] * excess(sample)
        own[UNIT + i] += policy.gain * (more + q[i] - own[UNIT + i])
        q[i] = within(own[UNIT + i], sample.unit[i], 0.0, MOST)
    own[RATIO] = 0.0


@kernel
def climb_em(policy, sample, q):
    """One lag of on-line expectation-maximisation: q + g q^2 psi^2 (e^2 - T)/T^2."""
    for i in range(q.size):
        share = q[i] * sample.psi[i] / sample.T * sample.psi[i]
        q[i] = within(q[i] + policy.gain * q[i] * share * excess(sample), sample.unit[i], LEAST, 1.0)
