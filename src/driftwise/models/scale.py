"""The scale sigma^2 that multiplies every variance: known to be one, or learnt (normal-inverse-gamma)."""

import math
from typing import NamedTuple

from ..engine.dispatch import choice


class KnownScale(NamedTuple):
    """Variances are what they say: Gaussian bands."""


class InverseGamma(NamedTuple):
    """sigma^2 ~ IG(alpha, beta), everything else relative to it: Student-t bands with 2 alpha degrees.

    The conjugate case: means and gains do not change, alpha gains 1/2 and beta e^2/(2T) at every sample.
    A negative ``alpha`` is the reference prior that spends one half on each of the N unknowns first; the
    scale then counts alpha as at least 1/2.
    """

    alpha: float
    beta: float


@choice
def sigma2(scale, observed, chi2):
    """Return the current estimate beta / alpha of sigma^2 (1 where it is known)."""


@choice
def freedom(scale, observed):
    """Return the degrees of freedom of that estimate (infinite where it is known)."""


@sigma2.on(KnownScale)
def sigma2_known_scale(scale, observed, chi2):
    return 1.0


@sigma2.on(InverseGamma)
def sigma2_inverse_gamma(scale, observed, chi2):
    return (scale.beta + 0.5 * chi2) / max(scale.alpha + 0.5 * observed, 0.5)


@freedom.on(KnownScale)
def freedom_known_scale(scale, observed):
    return math.inf


@freedom.on(InverseGamma)
def freedom_inverse_gamma(scale, observed):
    return max(2.0 * scale.alpha + observed, 1.0)
