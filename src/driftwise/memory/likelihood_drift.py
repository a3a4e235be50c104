"""Drift by recursive maximum likelihood: the speed of each parameter climbs the likelihood of what was predicted."""

import math
from typing import Any, NamedTuple

import numpy as np

from ..engine import validation
from ..engine.dense import at, solve
from ..engine.dispatch import PerParameter, kernel
from ..engine.elementary import exp
from ..engine.errors import InputError
from ..engine.layout import Field, Layout, each
from ..engine.ud import variances
from .questions import adapt, least_squares, resolve, time_update
from .registry import register
from .sensitivity import add_variance, follow_covariance, follow_mean, pass_time, stays
from .settings import more_than_one
from .unknown_drift import SEEN, common, drift_state_size, excite, learns_drift, open_drift_state, wander


@register("likelihood", about="the ratio of each parameter is learnt, up the likelihood")
class LikelihoodDrift(NamedTuple):
    """The speed of drift of each parameter, by a Gauss-Newton step up the likelihood at every sample.

    The coordinates are logarithms of noise variance ratios; the derivatives of theta and P are exact. The last
    ``samples`` count; ratios lie between ``least`` and ``most``, begin at ``start`` (high: the slope vanishes with q),
    are shrunk to their common mean by a prior deviation ``tau`` of their logarithms, and to the start by one of
    ``prior``. ``shared``: one ratio for all, for two thirds of the time. ``phi`` is that of `Drift`. Source: Ljung and
    Soderstrom (1983), chapter 3, for the recursion. Bad at: jumps (errors are 1.7 times those of the best constant q),
    single outliers, whose wake it takes for drift (use a gate), and a noise variance told wrong; learning that besides
    costs next to nothing.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> slope = np.cumsum(0.05 * rng.standard_normal(500))
    >>> phi = rng.standard_normal((500, 2))
    >>> y = phi[:, 0] * slope + 2 * phi[:, 1] + 0.1 * rng.standard_normal(500)
    >>> trace = dw.Regression(2, memory=dw.memory.LikelihoodDrift()).scan(y, phi)
    >>> (trace.parameters[-1] - [slope[-1], 2.0]).round(2).tolist(), trace.parameters_std[-1].round(2).tolist()
    ([-0.02, 0.02], [0.06, 0.03])
    """

    shared: bool = False
    start: float = 1e-2
    samples: float = 150.0
    tau: float = 1.5
    prior: float = 4.0
    least: float = 1e-6
    most: float = 10.0
    phi: Any = 1.0


class LikelihoodDriftKernel(NamedTuple):
    """What the kernel sees of a `LikelihoodDrift`; ``ratios`` are N, or 1 where they are shared."""

    R: float
    phi: PerParameter
    cap: PerParameter
    floor: float
    moving: float
    discount: float
    learns: float  # whether sigma^2 is learnt
    has_state: float  # 1: parameters act through a state, and sigma^2 may be known late
    ratios: float
    start: float  # logarithms, as the next two
    least: float
    most: float
    samples: float
    tau: float
    prior: float
    home: float  # where the ratios begin and are shrunk to, less ``start``

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters, learner_size(parameters, int(self.ratios)))


STEEP = 10.0  # deviations that a prediction moves by for a ratio e times as large; more is the wake of an outlier


LEARNER = Layout(
    *each(
        "m",
        eta="logarithms of the ratios, less that of the start",
        score="their score",
        share="the last dT/T",
        shares="information shared with log sigma^2: half their sum",
        slope="the last de/sqrt(s2 T)",
    ),
    Field("known", ("1",), "information on log sigma^2"),
    *each("m * (m + 1) // 2", J="information, less the prior's; packed", A="scratch, packed"),
    Field("dtheta", ("m * N",), "N of each ratio, one behind the other"),
    Field("dP", ("m * N * (N + 1) // 2",), "packed, of each ratio"),
    given=("N", "m"),
)
open_learner, learner_size = kernel(LEARNER.open), kernel(LEARNER.size)


@kernel
def derivatives(learner, j):
    """Return dtheta and dP of ratio j."""
    m = learner.eta.size
    N, size = learner.dtheta.size // m, learner.dP.size // m
    return learner.dtheta[j * N : (j + 1) * N], learner.dP[j * size : (j + 1) * size]


@kernel
def follow(learner, psi, b, e, T, s2, part, v):
    """Take one sample of a filter into the derivatives: its row, b = P psi, innovation, T; ``v`` is scratch.

    ``part`` is the share of the correction that the filter took (less than 1: the sample may be an outlier). What is
    left in b is the gain b/T.
    """
    inverse, steep = 1.0 / T, 1.0 / math.sqrt(s2 * T)
    for i in range(psi.size):
        b[i] *= inverse
    for j in range(learner.eta.size):
        dtheta, dP = derivatives(learner, j)
        dT = follow_covariance(dP, psi, b, 0.0, part, v)
        de = follow_mean(dtheta, psi, b, e * inverse, dT, part, v)
        if not abs(dT) <= 2.0 * T:  # at most T, all of them together: round-off ate the digits, begin again
            begin_again(learner, j)
            dT = de = 0.0
        learner.share[j] = dT * inverse
        learner.slope[j] = min(max(de * steep, -STEEP), STEEP)


@kernel
def begin_again(learner, j):
    """Take what theta and P are now for independent of ratio j."""
    for numbers in derivatives(learner, j):
        for i in range(numbers.size):
            numbers[i] = 0.0


@kernel
def climb(policy, learner, z, part):
    """Take one step up the likelihood, z = e/sqrt(s2 T), as far as the sample counts (``part``).

    What another sigma^2 explains as well is no information on a speed. Beside a state it has no part in the score,
    either: with gaps, or a state that nobody knows, sigma^2 is too large for tens of samples, and z^2 says so alone.
    """
    eta, g, r, w, J, A = learner.eta, learner.score, learner.share, learner.slope, learner.J, learner.A
    m, fade, mean, known = eta.size, 1.0 / policy.samples, 0.0, learner.known
    tight, loose = 1.0 / (policy.tau * policy.tau), 1.0 / (policy.prior * policy.prior)
    common = tight / m
    known[0] += 0.5 - known[0] * fade
    nuisance = 1.0 / (known[0] + loose) if policy.learns > 0.0 else 0.0  # what log sigma^2 explains as well
    for j in range(m):
        learner.shares[j] += 0.5 * r[j] - learner.shares[j] * fade
        mean += eta[j]
    mean /= m
    for j in range(m):
        shrunk = (eta[j] - policy.home) * loose + (eta[j] - mean) * tight
        shared = learner.shares[j] * nuisance
        alone = r[j] - shared if policy.has_state > 0.0 else r[j]
        g[j] = -0.5 * part * (alone * (1.0 - z * z) + 2.0 * z * w[j]) - shrunk * fade
        for i in range(j + 1):
            J[at(i, j)] += part * (0.5 * r[i] * r[j] + w[i] * w[j]) - J[at(i, j)] * fade
            A[at(i, j)] = J[at(i, j)] - common - learner.shares[i] * shared
        A[at(j, j)] += tight + loose
    solve(A, g)
    for j in range(m):
        moved = policy.start + eta[j] + min(max(g[j], -1.0), 1.0)
        eta[j] = min(max(moved, policy.least), policy.most) - policy.start


@kernel
def ratio(policy, learner, i):
    """Return the noise variance ratio of parameter i."""
    return exp(policy.start + learner.eta[i if learner.eta.size > 1 else 0])


@kernel
def carry(learner, phi, q, p, cap):
    """Take the derivatives to the next sample; a variance p of theta at its cap grows no further."""
    m = learner.eta.size
    if not stays(phi):
        for j in range(m):
            dtheta, dP = derivatives(learner, j)
            pass_time(dtheta, dP, phi)
    for i in range(q.size):
        if p[i] < cap[i]:
            _, dP = derivatives(learner, i if m > 1 else 0)
            add_variance(dP, i, min(q[i], cap[i]))


learns_drift(LikelihoodDriftKernel)


@resolve.on(LikelihoodDrift)
def resolve_likelihood_drift(memory, setting):
    least, start, most = (validation.positive(name, getattr(memory, name)) for name in ("least", "start", "most"))
    if not least <= start <= most:
        raise InputError(f"start lies between least and most, got {start!r}, {least!r} and {most!r}")
    return LikelihoodDriftKernel(
        **common(setting, memory.phi), learns=float(setting.is_learnt),
        has_state=float(setting.lags.size > 0),
        ratios=1 if validation.yes("shared", memory.shared) else setting.N,
        start=np.log(start), least=np.log(least), most=np.log(most),
        samples=more_than_one("samples", memory.samples), tau=validation.positive("tau", memory.tau),
        prior=validation.positive("prior", memory.prior), home=0.0,
    )  # fmt: skip


@adapt.on(LikelihoodDriftKernel)
def adapt_likelihood_drift(memory, state, e, R, view):
    N, s2 = view.D.size, view.s2
    drift = open_drift_state(state, N)
    learner = open_learner(drift.own, N, int(memory.ratios))
    is_unexcited = excite(memory, drift, view.row, True)
    T = least_squares(e, R, view)
    if T > 0.0:
        follow(learner, view.psi, view.b, e, T, s2, 1.0, view.c)
        if not is_unexcited:
            if drift.head[SEEN] > 2 * N:
                climb(memory, learner, e / math.sqrt(s2 * T), 1.0)
            for i in range(N):
                drift.q[i] = ratio(memory, learner, i) * drift.unit[i]
    return T


@time_update.on(LikelihoodDriftKernel)
def time_update_likelihood_drift(memory, state, elapsed, view):
    lam, status = wander(memory, state, elapsed, view)
    N = memory.cap.size
    drift = open_drift_state(state, N)
    learner = open_learner(drift.own, N, int(memory.ratios))
    variances(view.U, view.D, view.c)
    carry(learner, memory.phi, drift.q, view.c[view.first :], memory.cap)
    return lam, status
