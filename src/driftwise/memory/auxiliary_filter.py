"""Drift by an auxiliary filter: a second Kalman filter whose state is q."""

from typing import Any, NamedTuple

import numpy as np

from ..engine import validation
from ..engine.dispatch import PerParameter, kernel
from ..engine.elementary import square
from ..engine.layout import Field, Layout, each
from ..engine.ud import correct, project
from .gauss_markov import relax
from .questions import resolve
from .registry import register
from .unknown_drift import START, common, drift_state_size, learns_drift, revise, starts
from .wind_up import hold_within


@register("auxiliary", about="the ratio is learnt by a second filter")
class AuxiliaryFilter(NamedTuple):
    """The speed of drift of each parameter by a Kalman filter of its own, e^2 its measurement.

    e^2 - S is explained by the q_i times psi_i^2, with the variance 2 S^2 that a square of a Gaussian has; q forgets
    by ``forgetting`` a sample. ``start`` is the deviation of the noise variance ratios at the beginning, ``most`` the
    largest of them. ``phi`` is that of `Drift`. Source: after Maitelli and Yoneyama (1997), as Abid and Kamoun (2008)
    compare it; reconstructed. Bad at: parameters that rest (it hears drift in the noise, errors are three times those
    of least squares and bars too wide), unequal speeds where regressors are alike, and a noise variance told too small.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> slope = np.cumsum(0.05 * rng.standard_normal(500))  # it walks
    >>> phi = rng.standard_normal((500, 1))
    >>> y = phi[:, 0] * slope + 0.1 * rng.standard_normal(500)
    >>> trace = dw.Regression(1, memory=dw.memory.AuxiliaryFilter()).scan(y, phi)
    >>> f"{trace.parameters[-1, 0]:.2f} ± {trace.parameters_std[-1, 0]:.2f}, the truth is {slope[-1]:.2f}"
    '-0.77 ± 0.08, the truth is -0.89'
    """

    forgetting: float = 0.995
    start: float = 0.1
    most: float = 10.0
    phi: Any = 1.0


class AuxiliaryFilterKernel(NamedTuple):
    """What the kernel sees of an `AuxiliaryFilter`; ``widest`` are the largest variances of the ratios."""

    R: float
    phi: PerParameter
    cap: PerParameter
    floor: float
    moving: float
    discount: float
    forgetting: float
    start: float
    most: float
    widest: PerParameter

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters, FILTER.size(parameters))


LOUDER = 1e6  # times its mean square so far, the largest jump of a regressor that counts


FILTER = Layout(
    *each(
        "N",
        nvr="ratios",
        unit="the units they were in",
        D="their covariance U D U'",
        h="scratch",
        f="scratch",
        b="scratch",
    ),
    Field("U", ("N * (N - 1) // 2",)),
    given=("N",),
)
open_filter = kernel(FILTER.open)


learns_drift(AuxiliaryFilterKernel)


@resolve.on(AuxiliaryFilter)
def resolve_auxiliary_filter(memory, setting):
    most = validation.positive("most", memory.most)
    return AuxiliaryFilterKernel(
        **common(setting, memory.phi), forgetting=validation.share("forgetting", memory.forgetting),
        start=validation.positive("start", memory.start), most=most, widest=np.full(setting.N, most**2),
    )  # fmt: skip


@revise.on(AuxiliaryFilterKernel)
def revise_auxiliary_filter(policy, own, sample, theta, U, D, q):
    second, N = open_filter(own, q.size), q.size
    if starts(sample, q):
        for i in range(N):
            second.nvr[i], second.D[i] = START, square(policy.start)
        return
    z = sample.e / sample.T * (sample.e / sample.s2) - 1.0
    for i in range(N):  # q is what stays: a ratio changes with its unit
        is_seen = second.unit[i] > 0.0 and sample.unit[i] > 0.0
        second.f[i] = min(second.unit[i] / sample.unit[i], LOUDER) if is_seen else 1.0
        second.unit[i] = sample.unit[i]
        second.h[i] = sample.psi[i] * sample.unit[i] / sample.T * sample.psi[i]
        z += sample.psi[i] * q[i] / sample.T * sample.psi[i]
    relax(second.nvr, second.U, second.D, second.f, second.b)
    listen(policy, second, z)
    for i in range(N):
        q[i] = second.nvr[i] * sample.unit[i]


@kernel
def listen(policy, second, z):
    """Take z = h' nvr + v, var v = 2, into the ratios; forget. (z: what e^2/S holds besides R and Phi P Phi'.)"""
    for i in range(second.nvr.size):
        z -= second.h[i] * second.nvr[i]
    project(second.U, second.h, second.f)
    S = correct(second.U, second.D, second.f, 2.0, second.b)
    for i in range(second.nvr.size):
        second.nvr[i] = min(max(second.nvr[i] + second.b[i] / S * z, 0.0), policy.most)
        second.D[i] /= policy.forgetting
    hold_within(second.U, second.D, policy.widest, second.h, second.f, second.b)
