"""Between two samples: theta <- Phi theta, P <- Phi P Phi' + Q."""

from typing import Any, NamedTuple

from ..engine.dispatch import Vector, kernel
from ..engine.status import CAPPED
from ..engine.ud import entry, orthogonalise, widen_along
from .adapt import plain, time_update
from .drift import widen_within


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
    """

    phi: Any = 1.0
    q: Any = ()
    nvr: Any = ()


class Drifting(NamedTuple):
    """What the kernel sees of a `Drift` with diagonal phi and given variances."""

    phi: Vector
    q: Vector
    cap: Vector


class Coupled(NamedTuple):
    """What the kernel sees of a `Drift` whose phi or q is a matrix: Phi (N N numbers), q = G diag(d) G'."""

    phi: Vector
    G: Vector
    d: Vector


FORGOTTEN = 1e-280  # a variance that relaxed to nothing: the column of U, relative to it, would overflow

plain(Drifting, Coupled)


@kernel
def relax(theta, U, D, phi, a):
    """theta <- Phi theta, P <- Phi P Phi' for a diagonal Phi; ``a`` is scratch."""
    at = 0
    for j in range(D.size):
        theta[j] *= phi[j]
        column, before = U[at : at + j], D[j]
        D[j] *= phi[j] * phi[j]
        for i in range(j):
            a[i] = phi[i] * column[i]
            column[i] = a[i] / phi[j] if D[j] > FORGOTTEN else 0.0
        if D[j] <= FORGOTTEN:  # what the others shared with this parameter is theirs alone now
            widen_along(U, D, a, before, j - 1)
        at += j


@time_update.on(Drifting)
def time_update_drifting(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    status = 0
    relax(theta, U, D, memory.phi, scratch.b)
    for i in range(D.size):
        if not widen_within(U, D, i, memory.q[i], memory.cap[i], scratch.b):
            status = CAPPED
    return 1.0, status


@time_update.on(Coupled)
def time_update_coupled(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    N = D.size
    Phi, G = memory.phi.reshape(N, N), memory.G.reshape(N, N)
    Y, d, g = (
        memory_state[: 2 * N * N].reshape(N, 2 * N),
        memory_state[2 * N * N : 2 * N * N + 2 * N],
        memory_state[2 * N * N + 2 * N :],
    )
    for i in range(N):
        scratch.b[i] = theta[i]
        d[i], d[N + i] = D[i], memory.d[i]
    for i in range(N):
        theta[i] = 0.0
        for j in range(N):
            theta[i] += Phi[i, j] * scratch.b[j]
            Y[i, j], Y[i, N + j] = 0.0, G[i, j]
            for k in range(j + 1):
                Y[i, j] += Phi[i, k] * entry(U, k, j)
    orthogonalise(Y, d, g, N, 2 * N, U, D, False)
    return 1.0, 0
