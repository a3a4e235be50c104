"""Drift of known speed: a Gauss-Markov process, theta <- Phi theta + w."""

from typing import Any, NamedTuple

import numpy as np

from ..engine import ud, validation
from ..engine.dispatch import PerParameter, Vector
from ..engine.errors import InputError
from ..engine.status import CAPPED
from ..engine.ud import entry, orthogonalise
from .gauss_markov import relax, widen_within
from .questions import resolve, time_update
from .registry import register
from .settings import variances
from .unknown_drift import ROOM, common, diagonal, drift_state_size, learns_drift, revise


def _read(words):
    nvr, slash, phi = words.rest.partition("/")
    phis = words.each(phi, "NVR/") if slash else 1.0
    return Drift(phi=phis, nvr=words.each(nvr))


@register(
    "drift:NVR",
    "drift:NVR/PHI",
    about="they wander with that noise variance ratio, a memory of 1/sqrt(NVR) samples, and relax by PHI",
    read=_read,
    nvr=1e-3,
)
class Drift(NamedTuple):
    """Each parameter relaxes and wanders: theta(k+1) = phi theta(k) + w(k), var w = q (a Gauss-Markov process).

    ``phi`` is one number, one per parameter, or a matrix; 1 is a random walk. How fast they wander is said either as
    ``nvr``, the noise variance ratio q ms/sigma^2 (ms: the mean square of the regressor so far), which has no units
    and means a memory of about 1/sqrt(nvr) samples; or as ``q``, variances per sample (or a covariance matrix) in
    the units of `RandomWalk`: relative to sigma^2 where that is learnt. Source: Abid and Kamoun (2008), eqs. 7-12, with
    the gain L = Phi P psi/S that their (9) and (11) print without Phi. Between the samples a state holds theta and P of
    the next sample; a trace shows those given its own. No variance exceeds twice its prior. Bad at: a speed that is
    not known (use a policy that learns it), and |phi| < 1 with little q, which pulls the parameters to zero with bars
    that soon call them known.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> slope = np.cumsum(0.05 * rng.standard_normal(500))  # it walks
    >>> phi = rng.standard_normal((500, 1))
    >>> y = phi[:, 0] * slope + 0.1 * rng.standard_normal(500)
    >>> trace = dw.Regression(1, memory=dw.memory.Drift(nvr=0.25)).scan(y, phi)
    >>> f"{trace.parameters[-1, 0]:.2f} ± {trace.parameters_std[-1, 0]:.2f}, the truth is {slope[-1]:.2f}"
    '-0.76 ± 0.08, the truth is -0.89'
    """

    phi: Any = 1.0
    q: Any = ()
    nvr: Any = ()


class DriftKernel(NamedTuple):
    """What the kernel sees of a `Drift` with diagonal phi and given variances."""

    phi: PerParameter
    q: PerParameter
    cap: PerParameter


class DriftMatrixKernel(NamedTuple):
    """What the kernel sees of a `Drift` whose phi or q is a matrix: Phi (N N numbers), q = G diag(d) G'."""

    phi: Vector
    G: Vector
    d: Vector
    first: float  # unknowns of a state that stand before the parameters

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: Phi U, Phi's and G's columns; scratch."""
        unknowns = parameters + int(self.first)
        return (unknowns + 2) * (unknowns + parameters)


class DriftRatioKernel(NamedTuple):
    """What the kernel sees of a `Drift` of given noise variance ratios."""

    R: float
    phi: PerParameter
    cap: PerParameter
    floor: float
    moving: float
    discount: float
    nvr: PerParameter

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters)


learns_drift(DriftRatioKernel)


@resolve.on(Drift)
def resolve_drift(memory, setting):
    has_q, has_nvr = np.size(memory.q) > 0, np.size(memory.nvr) > 0
    if has_q == has_nvr:
        raise InputError(
            "Drift(phi, q) or Drift(phi, nvr=..) needs its speed, in one of the two: q, variances per sample, or nvr, "
            f"q ms/sigma^2; got q = {memory.q!r} and nvr = {memory.nvr!r}. Is it not known? Some policies learn it"
        )
    N = setting.N
    if np.ndim(memory.phi) == 2 or np.ndim(memory.q) == 2:
        if has_nvr:
            raise InputError("nvr goes with a diagonal phi: say q where phi is a matrix")
        return _coupled(memory, setting)
    if has_nvr:
        return DriftRatioKernel(**common(setting, memory.phi), nvr=variances("nvr", memory.nvr, N))
    q = variances("q", memory.q, N) * setting.units
    return DriftKernel(diagonal(memory.phi, N), q, ROOM * setting.cap)


def _coupled(memory, setting):
    """Return the kernel's drift of full matrices."""
    N, root = setting.N, np.sqrt(setting.units)
    phi = np.asarray(memory.phi, float)
    phi = phi if phi.ndim == 2 else np.diag(diagonal(memory.phi, N))
    if phi.shape != (N, N) or not np.isfinite(phi).all():
        raise InputError(f"phi must be a number, {N} numbers or a {N} x {N} matrix, got shape {phi.shape}")
    if max(abs(np.linalg.eigvals(phi))) > 1 + 1e-9:
        raise InputError(f"phi has an eigenvalue outside the unit circle: the parameters would run away; got {phi!r}")
    q = np.asarray(memory.q, float)
    q = q if q.ndim == 2 else np.diag(variances("q", memory.q, N))
    try:
        G, d = ud.factor(validation.covariance("q", q, N))
    except ValueError:
        raise InputError("q must be a covariance: it has a negative eigenvalue") from None
    # in units of the prior: theta = root * theta'
    return DriftMatrixKernel((phi * root[:, None] / root).ravel(), (G * root[:, None]).ravel(), d, setting.first)


@time_update.on(DriftKernel)
def time_update_drift(memory, state, elapsed, view):
    U, D, status = view.U, view.D, 0
    relax(view.theta, U, D, memory.phi, view.b)
    for i in range(D.size - view.first):
        if not widen_within(U, D, view.first + i, memory.q[i], memory.cap[i], view.b):
            status = CAPPED
    return 1.0, status


@time_update.on(DriftMatrixKernel)
def time_update_drift_matrix(memory, state, elapsed, view):
    theta, U, D, N, first, rows = view.theta, view.U, view.D, memory.d.size, view.first, view.D.size
    columns, Phi, G = rows + N, memory.phi.reshape(N, N), memory.G.reshape(N, N)
    Y, d, g = (
        state[: rows * columns].reshape(rows, columns),
        state[rows * columns : (rows + 1) * columns],
        state[(rows + 1) * columns :],
    )
    for i in range(N):
        view.b[i] = theta[first + i]
        d[rows + i] = memory.d[i]
    for j in range(rows):
        d[j] = D[j]
    for i in range(first):
        for j in range(rows):
            Y[i, j] = entry(U, i, j) if i <= j else 0.0
        for j in range(N):
            Y[i, rows + j] = 0.0
    for i in range(N):
        theta[first + i] = 0.0
        for j in range(first):
            Y[first + i, j] = 0.0
        for j in range(N):
            theta[first + i] += Phi[i, j] * view.b[j]
            Y[first + i, first + j], Y[first + i, rows + j] = 0.0, G[i, j]
            for k in range(j + 1):
                Y[first + i, first + j] += Phi[i, k] * entry(U, first + k, first + j)
    orthogonalise(Y, d, g, rows, columns, U, D, False)
    return 1.0, 0


@revise.on(DriftRatioKernel)
def revise_drift_ratio(policy, own, sample, theta, U, D, q):
    for i in range(q.size):
        q[i] = policy.nvr[i] * sample.unit[i]
