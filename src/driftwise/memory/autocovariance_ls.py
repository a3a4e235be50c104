"""Drift by correlations: a filter that is not the right one has correlated innovations.

A design filter, of fixed forgetting, has innovations e with E e(k) e(k-l) = c_l' x for x = (q_1 ms_1/R .. q_n ms_n/R,
sigma^2/R): least squares over lags 0..L, fading, within bounds.
M_j = dP/dx_j of that filter, V_l,j = d cov(error, e(k-l))/dx_j, as in `sensitivity`.
"""

import math
from typing import Any, NamedTuple

from ..engine import validation
from ..engine.dispatch import PerParameter, kernel
from ..engine.errors import InputError
from ..engine.layout import Field, Layout, each
from ..engine.ud import correct, project
from .gauss_markov import relax
from .questions import resolve
from .registry import register
from .sensitivity import add_variance, follow_covariance
from .settings import LARGEST, more_than_one
from .unknown_drift import START, common, drift_state_size, learns_drift, revise
from .wind_up import hold_within


@register("autocovariance", about="the ratio is learnt from correlations of the innovations", lags=3)
class AutocovarianceLS(NamedTuple):
    """The speed of drift of each parameter by autocovariance least squares over ``lags``, fading in ``memory`` samples.

    It reads the innovations of a design filter beside the estimator, which forgets 5 % a sample and knows nothing of
    the result: there is no start to choose. ``phi`` is that of `Drift`. Sources: Mehra (1970); Odelson, Rajamani and
    Rawlings (2006), in a form that varies in time. Bad at: changes (it answers late, to a jump as to a new speed),
    few samples (it begins after 60), bars, which are short as a rule, and cost: it is the costliest of its kind.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> slope = np.cumsum(0.05 * rng.standard_normal(500))  # it walks
    >>> phi = rng.standard_normal((500, 1))
    >>> y = phi[:, 0] * slope + 0.1 * rng.standard_normal(500)
    >>> trace = dw.Regression(1, memory=dw.memory.AutocovarianceLS()).scan(y, phi)
    >>> f"{trace.parameters[-1, 0]:.2f} ± {trace.parameters_std[-1, 0]:.2f}, the truth is {slope[-1]:.2f}"
    '-0.76 ± 0.10, the truth is -0.89'
    """

    lags: int = 10
    memory: float = 300.0
    phi: Any = 1.0


class AutocovarianceLSKernel(NamedTuple):
    """What the kernel sees of a `AutocovarianceLS`."""

    R: float
    phi: PerParameter
    cap: PerParameter
    floor: float
    moving: float
    discount: float
    learns: float  # whether sigma^2 is learnt
    lags: float
    samples: float
    prior: PerParameter  # variances at the start

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters, design_size(parameters, int(self.lags)))


FORGETTING = 0.95  # of the design filter
SUMS, SOLVES, SWEEPS = 30, 60, 8  # samples before sums begin, and before they are solved; sweeps a sample
RIDGE, LEAST, MOST, WIDEST = 1e-6, 1e-4, 1e4, 10.0  # bounds of the noise variance, of ratios


DESIGN = Layout(
    *each("N", theta="of the design filter", D="its covariance U D U'", f="scratch", b="scratch", v="scratch"),
    Field("U", ("N * (N - 1) // 2",)),
    *each("m", x="unknowns", g="right-hand side of the sums", c="scratch: how they make a correlation"),
    Field("G", ("m", "m"), "the sums"),
    Field("M", ("m", "N * (N + 1) // 2"), "dP/dx"),
    Field("V", ("lags", "m", "N"), "d cov(error, e(k - l))/dx"),
    *each("lags", e="past innovations over their deviations", T="and their variances"),
    given=("N", "lags"),
    m="N + 1",
)
open_design, design_size = kernel(DESIGN.open), kernel(DESIGN.size)


learns_drift(AutocovarianceLSKernel)


@resolve.on(AutocovarianceLS)
def resolve_autocovariance_ls(memory, setting):
    lags, samples = validation.count("lags", memory.lags, least=1), more_than_one("memory", memory.memory)
    found = AutocovarianceLSKernel(
        **common(setting, memory.phi), learns=float(setting.is_learnt), lags=lags, samples=samples, prior=setting.cap
    )
    if found.state_size(setting.N) > LARGEST:
        raise InputError(
            f"{lags} lags of {setting.N} parameters keep {found.state_size(setting.N):.2g} numbers, more than "
            f"{LARGEST:.0e}: "
            f"take fewer "
            "lags, or LikelihoodDrift(shared=True), which keeps few"
        )
    return found


@revise.on(AutocovarianceLSKernel)
def revise_autocovariance_ls(policy, own, sample, theta, U, D, q):
    N = q.size
    design = open_design(own, N, int(policy.lags))
    if sample.seen == 1.0:
        for i in range(N):
            design.D[i], design.x[i] = policy.prior[i], START
        design.x[N] = 1.0
    e = sample.e
    for i in range(N):
        e += sample.psi[i] * (theta[i] - sample.b[i] / sample.T * sample.e - design.theta[i])
    project(design.U, sample.psi, design.f)
    T = correct(design.U, design.D, design.f, sample.R, design.b)
    correlate(policy, design, sample, e / math.sqrt(sample.s2 * T), T, sample.seen > SUMS)
    for i in range(N):
        design.theta[i] += design.b[i] / T * e
        design.D[i] /= FORGETTING
    relax(design.theta, design.U, design.D, policy.phi, design.v)
    hold_within(design.U, design.D, policy.cap, design.v, design.f, design.b)
    if sample.seen > SOLVES:
        sweep(policy, design)
    scale = design.x[N] if policy.learns > 0.0 else 1.0
    for i in range(N):
        q[i] = min(design.x[i] / scale, WIDEST) * sample.unit[i]


@kernel
def correlate(policy, design, sample, z, T, counts):
    """Take z = e/sqrt(s2 T) into the sums, and M, V to the next sample."""
    N, lags, psi, b, K, phi = sample.psi.size, design.e.size, sample.psi, design.b, design.f, policy.phi
    if counts:
        fade(policy, design)
        for l in range(lags):
            for j in range(N + 1):
                design.c[j] = 0.0
                for i in range(N):
                    design.c[j] += psi[i] * design.V[l, j, i] / T
            if design.T[l] > 0.0:
                add(design, 1.0, math.sqrt(T / design.T[l]), z * design.e[l])
    for l in range(lags - 1, 0, -1):
        design.e[l], design.T[l] = design.e[l - 1], design.T[l - 1]
        for j in range(N + 1):
            push(design.V[l - 1, j], design.V[l, j], psi, b, T, phi)
    for i in range(N):
        K[i] = b[i] / T
    for j in range(N + 1):
        c = follow_covariance(design.M[j], psi, K, sample.R if j == N else 0.0, 1.0, design.v)
        design.c[j] = c / T
        for i in range(N):
            design.V[0, j, i] = phi[i] * (design.v[i] - K[i] * c)
        at = 0
        for i in range(N):
            for k in range(i + 1):
                design.M[j, at] *= phi[i] * phi[k]
                at += 1
    for i in range(N):
        add_variance(design.M[i], i, sample.unit[i])
    design.e[0], design.T[0] = z, T
    if counts:
        add(design, 0.5, 1.0, z * z)


@kernel
def push(old, new, psi, b, T, phi):
    """new = Phi (I - K psi') old."""
    inner = 0.0
    for i in range(psi.size):
        inner += psi[i] * old[i] / T
    for i in range(psi.size):
        new[i] = phi[i] * (old[i] - b[i] * inner)


@kernel
def fade(policy, design):
    """Let the sums fade by one sample."""
    keep = 1.0 - 1.0 / policy.samples
    for j in range(design.g.size):
        design.g[j] *= keep
        for i in range(design.g.size):
            design.G[i, j] *= keep


@kernel
def add(design, weight, scale, product):
    """Add one equation, (scale c)' x = product."""
    for j in range(design.g.size):
        design.g[j] += weight * scale * design.c[j] * product
        for i in range(design.g.size):
            design.G[i, j] += weight * scale * design.c[i] * (scale * design.c[j])


@kernel
def sweep(policy, design):
    """Solve the sums for x within its bounds: coordinate descent, from the last solution."""
    x, g, G, m, trace = design.x, design.g, design.G, design.x.size, 0.0
    for j in range(m):
        trace += G[j, j]
    ridge = RIDGE * trace / m
    if not ridge > 0.0:
        return
    for _ in range(SWEEPS):
        for i in range(m if policy.learns > 0.0 else m - 1):
            rest = g[i] + G[i, i] * x[i]
            for j in range(m):
                rest -= G[i, j] * x[j]
            low, high = (LEAST, MOST) if i == m - 1 else (0.0, WIDEST)
            x[i] = min(max(rest / (G[i, i] + ridge), low), high)
