"""What `AutoMemory` shows: the mixture of its filters, and while a trial runs of what else may have happened.

The mean is weighed by what is at stake. Who takes a plant at rest for one that moves errs by many times what could be
known of it, the other way round it costs a share; so drift has a smaller say in the mean than its probability, the
smaller the faster it is (Bayes' estimate where errors count relative to those of who knows). P is about that mean.
"""

from ..engine.dense import at
from ..engine.dispatch import kernel, rare
from ..engine.elementary import exp
from ..engine.ud import factor_within, predicted_variance, project
from .auto_constants import SHY_OF_DRIFT, SHY_OF_FAST
from .auto_state import MODES
from .bank import FREEDOM_NOW, SIGMA2_NOW, mixture_of_modes
from .gauss_markov import relax, widen_within
from .lone_jump import alone, move_alone
from .mixing import add_spread, merge, shrink
from .modes import FREEDOM, WEIGHT, mode, own_sigma2, unfold
from .sensitivity import pass_time
from .trial_state import AGE, COPIES, LEVEL, SAME, is_told


@kernel
def say_of_drift(memory, own, learner):
    """Return the say of the learnt filter in the mean over its probability: the less, the faster it moves.

    Its speed stands for a world's only where the filter that never forgets is as likely: else it is drift.
    """
    N, eta = learner.eta.size, 0.0
    slow, learnt = mode(own.bank, 0, N).own[WEIGHT], mode(own.bank, MODES - 1, N).own[WEIGHT]
    for i in range(N):
        eta += learner.eta[i]
    pace = exp(0.5 * (memory.start + eta / N))
    return 1.0 - slow * pace / ((slow + learnt) * (SHY_OF_DRIFT + pace))


@kernel
def merge_shy(memory, own, learner, theta, U, D):
    """Let theta and U D U' be mean and covariance of the bank, the mean weighed by what is at stake.

    Returned and left behind is what `mixing.merge` returns and leaves.
    """
    bank, dense, logs, P, N = own.bank, own.dense, own.logs, own.P, D.size
    size, freedom, s2, total = P.size, 0.0, 0.0, 0.0
    for i in range(N):
        theta[i] = 0.0
    for i in range(size):
        P[i] = 0.0
    for m in range(MODES):
        one = mode(bank, m, N)
        w = say = one.own[WEIGHT]
        if m == MODES - 1:
            say *= say_of_drift(memory, own, learner)
        elif m > 0:
            say *= SHY_OF_FAST
        logs[m] = own_sigma2(memory, one.own)
        freedom += w * one.own[FREEDOM]
        s2 += w * logs[m]
        total += say
        for i in range(N):
            theta[i] += say * one.theta[i]
    part, inverse = 1.0 / total, 1.0 / s2
    for i in range(N):
        theta[i] *= part
    for m in range(MODES):
        one = mode(bank, m, N)
        w = one.own[WEIGHT] * inverse
        add_spread(P, w * logs[m], dense[m * size : (m + 1) * size], w, one.theta, theta)
    shrink(P, memory.cap[:N])
    for i in range(size):
        dense[MODES * size + i] = P[i]
    factor_within(P, U, D)
    return freedom, s2


@rare
def know_as_the_bank(memory, parts):
    """Let the copy of another level know of parameters what the bank shows, no more: it is told for all its filters.

    The likeliest filter knows not what the others know better: of a slow walk the one that never forgets is too sure.
    Where the mean is weighed by what is at stake it stays: what rests is known to it alone.
    """
    own, level = parts.own, mode(parts.trial.copies, LEVEL, parts.drift.unit.size)
    unfold(own.bank, own.dense, level.theta.size)
    _, s2 = merge(memory, own, level.theta, level.U, level.D)
    share = s2 / own_sigma2(memory, level.own)
    for i in range(level.D.size):
        level.D[i] *= share


@rare
def blend(memory, parts, view):
    """Let theta and P be those of the mixture of bank and copies, about a mean that is slower to believe in jumps."""
    own, trial, theta, N = parts.own, parts.trial, view.theta, view.theta.size
    half, P, mean, shown, moved = N * (N + 1) // 2, own.P, view.c, trial.shown, trial.moved
    bank = own.dense[MODES * half : (MODES + 1) * half]
    is_alone = shown[SAME] > 0.0 and not is_told(trial)
    if is_alone:
        move_alone(trial, parts.drift.unit, 1.0)
    rest, stays = 1.0 - shown[0] - shown[1] - shown[2], 1.0 - moved[0] - moved[1] - moved[2]
    s2 = own_s2 = rest * own.head[SIGMA2_NOW]
    freedom = rest * own.head[FREEDOM_NOW]
    for i in range(N):
        mean[i] = stays * theta[i]
    for k in range(COPIES):
        one = mode(trial.copies, k, N)
        s2 += shown[k] * own_sigma2(memory, one.own)
        freedom += shown[k] * one.own[FREEDOM]
        for i in range(N):
            mean[i] += moved[k] * one.theta[i]
    for i in range(half):
        P[i] = 0.0
    add_spread(P, own_s2 / s2, bank, rest / s2, theta, mean)
    for k in range(COPIES):
        one, w = mode(trial.copies, k, N), shown[k] / s2
        if w > 0.0:
            add_spread(P, w * own_sigma2(memory, one.own), trial.dense[k * half : (k + 1) * half], w, one.theta, mean)
    if is_alone:
        move_alone(trial, parts.drift.unit, -1.0)
    shrink(P, memory.cap[:N])
    for i in range(N):
        theta[i] = mean[i]
    for i in range(half):
        bank[i] = P[i]
    factor_within(P, view.U, view.D)
    own.head[SIGMA2_NOW], own.head[FREEDOM_NOW] = s2, freedom


@kernel
def drift_together(memory, own, waits, theta, U, D, view):
    """Take what is shown on by the Q of the modes on average, no variance beyond its cap, without mixing it again."""
    N, M, total = D.size, MODES, 0.0
    for m in range(M):
        one = mode(own.bank, m, N).own
        own.logs[m] = one[WEIGHT] * own_sigma2(memory, one)
        total += own.logs[m]
    inverse = 1.0 / total
    for i in range(N):
        view.c[i] = 0.0
        for m in range(M):
            view.c[i] += own.logs[m] * own.q[m * N + i]
        view.c[i] *= inverse
    if waits:
        P = own.dense[M * own.P.size :]
        pass_time(theta, P, memory.phi[:N])
        for i in range(N):
            P[at(i, i)] += view.c[i]
        shrink(P, memory.cap[:N])
        factor_within(P, U, D)
    else:
        relax(theta, U, D, memory.phi, view.b)
        for i in range(N):
            widen_within(U, D, i, view.c[i], memory.cap[i], view.b)


@kernel
def mixture_with_copies(memory, parts, R, view, out):
    """Write weight, mean less the mixture's, and squared scale of each prediction."""
    N = view.theta.size
    trial, rest = parts.trial, 1.0
    mixture_of_modes(memory, parts.own.bank, R, view, out)
    for k in range(COPIES):
        place, one, w = 3 * (MODES + k), mode(trial.copies, k, N), trial.shown[k] if trial.head[AGE] > 0.0 else 0.0
        offset, variance = 0.0, R
        if w > 0.0:
            for i in range(N):
                offset += view.psi[i] * (one.theta[i] - view.theta[i])
            project(one.U, view.psi, view.b)
            variance = predicted_variance(view.b, one.D, R)
            if k == SAME and not is_told(trial):
                more, spread = alone(trial, view.psi, parts.drift.unit)
                offset += more
                variance += spread
        out[place], out[place + 1], out[place + 2] = w, offset, own_sigma2(memory, one.own) * variance
        rest -= w
    for m in range(MODES):
        out[3 * m] *= rest
