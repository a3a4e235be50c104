"""The scale sigma^2 that multiplies every variance: known to be one, or learnt (normal-inverse-gamma)."""

import math
from typing import Any, NamedTuple

import numpy as np

from ..engine.dispatch import choice
from ..engine.errors import InputError


class KnownScale(NamedTuple):
    """Variances are what they say: Gaussian bands."""


class InverseGamma(NamedTuple):
    """sigma^2 ~ IG(alpha, beta), everything else relative to it: Student-t bands with 2 alpha degrees.

    The conjugate case: means and gains do not change, alpha gains 1/2 and beta e^2/(2T) at every sample.
    A negative ``alpha`` is the reference prior that spends one half on each of the N unknowns first; the
    scale then counts alpha as at least 1/2.

    Parameters
    ----------
    alpha, beta : float
        The mean of sigma^2 is beta/(alpha - 1), its weight that of 2 alpha samples.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> est = dw.ARX(1, 1, scale=dw.models.InverseGamma(5.0, 0.05))
    >>> round(float(est.sigma2(est.scan(y, u).state)) ** 0.5, 2)
    0.1
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


def check_scale(scale, proper: bool = False) -> None:
    """Raise InputError unless ``scale`` is None or a prior; a proper one has a positive alpha."""
    if scale is None:
        return
    numbers = tuple(scale) if isinstance(scale, InverseGamma) else ()
    if not numbers or not all(isinstance(n, int | float | np.number) and math.isfinite(n) for n in numbers):
        raise InputError(f"scale must be InverseGamma(alpha, beta) of finite numbers or None, got {scale!r}")
    if scale.beta <= 0 or (proper and scale.alpha <= 0):
        which = "a positive alpha and a positive beta" if proper else "a finite alpha and a positive beta"
        raise InputError(f"InverseGamma needs {which}, got {scale!r}. It is the prior of a variance, beta/alpha")


def resolve_scale(scale, is_relative: bool, unknowns: int) -> Any:
    """Return the prior of sigma^2: the one given, or the reference prior that spends one half on each unknown."""
    check_scale(scale)
    return (scale or InverseGamma(0.5 - unknowns / 2, 1e-20)) if is_relative else KnownScale()
