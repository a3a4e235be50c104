"""Single precision: what thresholds chosen for doubles are there, what it is not for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..engine.errors import InputError
from ..engine.translate.formats import SINGLE

LEAST, MOST = 1.17549435e-38, 3.4028235e38  # numbers with all their digits
WIDEST = 1e7  # prior variance of a typical output over the noise's, from which digits are lost

# Constants of the kernels that are about doubles, and what they are in single precision, by what they mean.
VALUES = {
    1e60: 1e9,  # beyond it a product of four would overflow
    1e100: 1e18,  # beyond it a product of two would
    1e-300: 1e-36,  # a variance that is as good as none, but is not none; a pivot whose inverse would overflow
    -1e300: -1e37,  # a log probability below all others
    2.2250738585072014e-308: LEAST,  # the smallest with all its digits
    1.7976931348623157e308: MOST,  # and the largest
    6755399441055744.0: 12582912.0,  # numbers beside it have no digits after the point
    708.0: 87.0,  # up to it an exponential is an ordinary number
    709.782712893384: 88.72283,  # beyond it an exponential overflows
    -746.0: -104.0,  # and below it is none
    6.93147180369123816490e-01: 0.693359375,  # log 2, as many digits as leave its products exact
    1.90821492927058770002e-10: -2.12194440e-4,  # and the rest
}
SETTINGS = {  # of policies: how small each may be
    "floor": 1e-6,  # relative error that every y carries
    "least": 1e-30,  # variance that counts as none
}
# Policies whose errors against double precision were measured: below 1e-3 of a standard deviation.
KINDS = set(
    "Lags Polynomials Form LeastSquares White KnownScale InverseGamma Always InnovationGate Silent VarianceSums "
    "TwoSums Windowed Constant RandomWalk ExponentialForgettingKernel VariableForgettingKernel "
    "DirectionalForgettingKernel CovarianceInflationKernel GainResetKernel".split()
)


def rounded(number: float) -> float:
    """Return the number that stands for a constant of a kernel."""
    number = VALUES.get(number, number)
    if number != 0.0 and math.isfinite(number) and not LEAST <= abs(number) <= MOST:
        raise InputError(f"this estimator needs the number {number:g}, which single precision does not have")
    return float(np.float32(number)) if math.isfinite(number) else number


def settled(est) -> tuple[Any, ...]:
    """Return the policies of an estimator as they are in single precision, refused where that is not sound."""
    name = type(est).__name__
    for policy in est.policies:
        kind = type(policy)
        if kind.__name__ not in KINDS or not kind.__module__.startswith("driftwise."):
            raise InputError(
                f"{name} with {kind.__name__.removesuffix('Kernel')} is not exported in single precision: it was not "
                "shown to be sound there (docs/export.md says what was); export it in double precision"
            )
    units = np.concatenate([np.full(est.model.n, est.y_scale**2), est._theta_units()])
    widest = float(np.max(np.diag(est.prior_covariance) / units)) * est.y_scale**2 / est.policies[1].R
    if widest > WIDEST:
        raise InputError(
            f"the prior is {widest:.0e} times as wide as the noise, and single precision has seven digits: give P0 "
            f"below {WIDEST:.0e} times the noise variance, or export in double precision"
        )
    policies = [
        policy._replace(**{k: max(getattr(policy, k), v) for k, v in SETTINGS.items() if k in policy._fields})
        for policy in est.policies
    ]
    return tuple(policies)


TEXTS = {
    "dw_sqrt": """\
#if defined(__GNUC__) || defined(__clang__)
#define dw_sqrt(x) __builtin_sqrtf(x)
#else
float sqrtf(float x);
#define dw_sqrt(x) sqrtf(x)
#endif""",
    **SINGLE.texts(),
}
