"""A bank of Kalman filters, one for each speed of drift, weighted by how well they predict.

Each mode has its own weight, theta, P = U D U' in units of its own sigma^2, and that sigma^2 as chi2/freedom. What the
estimator shows as theta and P is the mean and covariance of the mixture, what it shows as sigma^2 their mean.
"""

import math

from ..engine.dense import add_square
from ..engine.dispatch import kernel, rare
from ..engine.elementary import exp, lgamma, log, log1p
from ..engine.layout import Field, Layout, numbers
from ..engine.ud import correct, covariances, expand, factor_within, predicted_variance, project, widen_along

WEIGHT, FREEDOM, CHI2, OWN = range(4)  # a mode's own numbers, and how many
FADE = 0.995  # per sample, of what each sigma^2 rests on
FAINTEST = 1e-6  # least weight of a mode
WIDER = 400.0  # how many times the noise variance that of outliers is
TURN = 0.5 / math.pi
WIDE = 1e3  # psi' P psi in units of R: more digits than these are not given away by subtracting from P


MODE = Layout(
    *numbers("own", weight="its probability", freedom="samples behind its sigma^2", chi2="sum of e^2/T over them"),
    Field("theta", ("N",)),
    Field("D", ("N",), "P = U D U' in units of its own sigma^2: the diagonal"),
    Field("U", ("N * (N - 1) // 2",), "and the factor above it, column by column"),
    given=("N",),
)
size_of, ModeRow = kernel(MODE.size), MODE.Row


@kernel
def mode(bank, m, N):
    """Return the views of mode m: `MODE.open` of its part, cut once.

    A slice of a slice hides from the compiler how long it is: a fleet would take a quarter longer.
    """
    size = size_of(N)
    own = m * size
    theta = own + OWN
    D = theta + N
    U = D + N
    return ModeRow(bank[own:theta], bank[theta:D], bank[D:U], bank[U : own + size])


@kernel
def count_of(bank, N):
    """Return how many modes there are."""
    return bank.size // size_of(N)


@kernel
def own_sigma2(memory, own):
    """Return the sigma^2 of a mode: 1 where it is known, and until it has a degree of freedom."""
    return own[CHI2] / own[FREEDOM] if memory.learns > 0.0 and own[FREEDOM] >= 1.0 else 1.0


@kernel
def bound(own, least):
    """Let the sigma^2 that a mode has learnt be ``least`` at least."""
    if least > 0.0 and own[FREEDOM] >= 1.0:
        own[CHI2] = max(own[CHI2], least * own[FREEDOM])


@kernel
def own_noise(memory, s2, R, shown):
    """Return the variance of the noise relative to the sigma^2 of a mode; R is relative to that which is shown.

    Beyond ``memory.R`` R is what regressors are wrong by: so much in y, whatever a mode thinks of its noise.
    """
    if R != memory.R:  # else nothing waits for sigma^2
        R = memory.R + (R - memory.R) * (shown / s2)
    return R


@kernel
def begin_modes(memory, bank, theta, U, D):
    """Let every mode begin as the estimator does; the weights are equal."""
    M = count_of(bank, D.size)
    for m in range(M):
        one = mode(bank, m, D.size)
        one.own[WEIGHT], one.own[FREEDOM], one.own[CHI2] = 1.0 / M, memory.freedom, memory.chi2
        for i in range(D.size):
            one.theta[i], one.D[i] = theta[i], D[i]
        for i in range(U.size):
            one.U[i] = U[i]


@kernel
def copy_mode(one, of):
    """Let a mode be what another is."""
    for i in range(OWN):
        one.own[i] = of.own[i]
    for i in range(one.D.size):
        one.theta[i], one.D[i] = of.theta[i], of.D[i]
    for i in range(one.U.size):
        one.U[i] = of.U[i]


@rare
def hand_over(bank, dense, one, P):
    """Let every mode be ``one``, but for its weight; their P in ``dense`` are ``P`` (packed)."""
    N = one.theta.size
    for m in range(count_of(bank, N)):
        to = mode(bank, m, N)
        to.own[FREEDOM], to.own[CHI2] = one.own[FREEDOM], one.own[CHI2]
        for i in range(N):
            to.theta[i] = one.theta[i]
        for i in range(P.size):
            dense[m * P.size + i] = P[i]


@kernel
def height(nu):
    """Return the log of the density of Student's t where it is highest, times sqrt(2 pi V), V its squared scale."""
    if nu == math.inf:
        return 0.0
    if nu < 50.0:
        return lgamma(0.5 * (nu + 1.0)) - lgamma(0.5 * nu) - 0.5 * log(0.5 * nu)
    part = 1.0 / nu  # the same to 1e-13 (Stirling)
    return (-0.25 + (1.0 / 24.0 - 0.05 * part * part) * (part * part)) * part


@kernel
def fall(nu, z):
    """Return by how much the logarithm is less at z = e^2/V (normal: nu is inf)."""
    return -0.5 * z if nu == math.inf else -0.5 * (nu + 1.0) * log1p(z / nu)


@kernel
def outlier(nu, z, narrow, share):
    """Return p of an error that is an outlier this ``share`` of the time, and the probability that this one is.

    The first as a logarithm and a factor, times sqrt(2 pi V), V the squared scale of one that is none; ``narrow`` is V
    over that of an outlier.
    """
    far, odds = fall(nu, z * narrow), share / (1.0 - share) * math.sqrt(narrow)
    both = exp(fall(nu, z) - far) + odds
    return height(nu) + far, (1.0 - share) * both, odds / both


@kernel
def take(memory, one, P, error, R, view, outliers, is_unexcited, is_apart, least):
    """Let one mode learn from its error; return p of mode and error, the probability of an outlier, T, sigma^2.

    p is a logarithm and a factor, so that nobody waits for the logarithm of what is never far from one.
    ``outliers`` is their share of the samples, 0 where there are none.
    An error that is an outlier with probability rho is taken in with the gain (1 - rho) K + rho K2, K2 that of a noise
    WIDER times as large, or of the error's own square where that is larger: sizes of outliers beyond all have the same
    chance a decade, so that however wrong one number is, it is no sign of something else. P is that of the two
    outcomes together (moment matching): a rank-one change along P psi. It is left in ``P`` (packed) for the modes to
    be mixed; a mode that ``is_apart`` has it in U and D. Its sigma^2 is ``least`` at least.
    """
    D, U, own, f, b = one.D, one.U, one.own, view.f, view.b
    bound(own, least)
    s2, nu = own_sigma2(memory, own), math.inf
    inverse, is_ready = 1.0 / s2, memory.learns == 0.0 or own[FREEDOM] >= 1.0
    if memory.learns > 0.0:
        nu, R = max(own[FREEDOM], 1.0), own_noise(memory, s2, R, view.s2)
    project(U, view.psi, f)
    p = predicted_variance(f, D, 0.0)
    T = p + R
    square = error * error * inverse
    k, k2 = 1.0 / T, 1.0 / (T + max((WIDER - 1.0) * R, square - R))
    z, log_p, factor, rho = square * k, 0.0, own[WEIGHT], 0.0
    if is_ready and outliers > 0.0:
        log_p, both, rho = outlier(nu, z, k2 * T, outliers)
        factor *= both * math.sqrt(memory.R * TURN * (k * inverse))
    elif is_ready:
        log_p = height(nu) + fall(nu, z)
        factor *= math.sqrt(memory.R * TURN * (k * inverse))
    gain = (1.0 - rho) * k + rho * k2
    less = gain - rho * (1.0 - rho) * z * T * (k - k2) * (k - k2)
    if is_apart or p > WIDE * R:
        lessen(U, D, f, less, p, T, b, view.c)
        if not is_apart:
            expand(U, D, P)
    else:
        covariances(U, D, f, b)
        expand(U, D, P)
        add_square(P, -less, b)
    for i in range(D.size):
        one.theta[i] += b[i] * (gain * error)
    if memory.learns > 0.0 and not is_unexcited:
        part = 1.0 - (R - memory.R) * k  # d log V/d log sigma^2: what regressors are wrong by says nothing of sigma^2
        if memory.has_state > 0.0:  # nor does what a wrong state has taught
            part = memory.R / R
        part *= part * (1.0 - rho)
        own[FREEDOM] = FADE * own[FREEDOM] + part
        own[CHI2] = FADE * own[CHI2] + part * error * error * k
        bound(own, least)
    return log_p, factor, rho, T, s2


@kernel
def lessen(U, D, f, less, p, T, b, c):
    """P <- P - less b b', b = P psi; f = U' psi, p = psi' P psi; no digit is lost however wide P is."""
    if less * T > 1e-12:
        correct(U, D, f, 1.0 / less - p, b)
    else:
        covariances(U, D, f, b)
    if less < 0.0:
        for i in range(D.size):
            c[i] = b[i]
        widen_along(U, D, c, -less, D.size - 1)


@kernel
def error_of(one, e, psi, theta):
    """Return the innovation of a mode; e is that of ``theta``."""
    for i in range(theta.size):
        e += psi[i] * (theta[i] - one.theta[i])
    return e


@kernel
def update(memory, own, e, R, theta, view, outliers, is_unexcited, is_apart, least):
    """Let every mode of a bank learn, and the weights; return the log evidence and the probability of an outlier.

    e is the innovation of ``theta``, R the variance of the noise, ``least`` the least sigma^2. The P of each mode is
    left in ``dense``, packed one behind the other, or in its U and D where they stay apart. In ``logs`` stays, of the
    last mode, what `likelihood.follow` wants: innovation, T, sigma^2, share that is no outlier. At rest the weights
    stay: all modes expect the same there, and what is quieter than usual would be best known to the smallest sigma^2.
    """
    bank, dense, logs, N = own.bank, own.dense, own.logs, theta.size
    M, half, top = count_of(bank, N), N * (N + 1) // 2, -math.inf
    for m in range(M):
        one, P = mode(bank, m, N), dense[m * half : (m + 1) * half]
        error = error_of(one, e, view.psi, theta)
        if is_unexcited:
            mode(own.old, m, N).own[WEIGHT] = one.own[WEIGHT]
        logs[m], one.own[WEIGHT], share, T, s2 = take(
            memory, one, P, error, R, view, outliers, is_unexcited, is_apart, least
        )
        logs[M + 4 + m] = share
        top = max(top, logs[m])
        if m == M - 1:
            logs[M], logs[M + 1], logs[M + 2], logs[M + 3] = error, T, s2, 1.0 - share
    total = rho = 0.0
    for m in range(M):
        logs[m] = mode(bank, m, N).own[WEIGHT] * exp(logs[m] - top)
        total += logs[m]
        rho += logs[m] * logs[M + 4 + m]
    if is_unexcited:
        for m in range(M):
            mode(bank, m, N).own[WEIGHT] = mode(own.old, m, N).own[WEIGHT]
    else:
        normalise(bank, logs, total, N)
    return top + log(total), rho / total


@kernel
def normalise(bank, weights, total, N):
    """Let the weights of the modes be these, whose sum is ``total``, over their sum, none of them below FAINTEST."""
    M, inverse, again = count_of(bank, N), 1.0 / total, 0.0
    for m in range(M):
        weights[m] = max(weights[m] * inverse, FAINTEST)
        again += weights[m]
    inverse = 1.0 / again
    for m in range(M):
        mode(bank, m, N).own[WEIGHT] = weights[m] * inverse


@kernel
def unfold(bank, dense, N):
    """Fill ``dense`` with the P of every mode."""
    size = N * (N + 1) // 2
    for m in range(count_of(bank, N)):
        one = mode(bank, m, N)
        expand(one.U, one.D, dense[m * size : (m + 1) * size])


@rare
def fold(bank, dense, N):
    """Let U and D of every mode be the factors of its P in ``dense``, which is destroyed."""
    size = N * (N + 1) // 2
    for m in range(count_of(bank, N)):
        one = mode(bank, m, N)
        factor_within(dense[m * size : (m + 1) * size], one.U, one.D)
