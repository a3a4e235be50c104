"""What may have happened a moment ago: nothing, a jump of all parameters or of one, another level of the noise.

A trial begins at a surprise or a suspicion and goes on until it has nothing to tell. Copies of the likeliest filter of
the bank go on from there: one as it is (or with one parameter that jumped, `lone_jump`), one whose parameters were set
free, one whose sigma^2 is unknown again. Each collects the evidence of its predictions. A jump that is told makes the
bank what jumped; what stood against it goes on for a while, and may take it back.
"""

from ..engine.dense import at
from ..engine.dispatch import bulky, kernel, rare
from ..engine.elementary import log
from ..engine.ud import factor_within
from .additive import exchange
from .auto_constants import (
    DEAD,
    DOUBTLESS,
    FAR,
    FREED_FREEDOM,
    FRESH,
    HOPELESS,
    LAG_JUMP,
    LOUD,
    LOUD_FREEDOM,
    OLD,
    OLDEST,
    PLAIN_FREEDOM,
    RAREST,
    RATE,
    SURPRISE,
    SURPRISE_OF_STATE,
    WIDE,
    WIDEST,
    WINDOW,
)
from .gauss_markov import relax, widen_within
from .lone_jump import weigh_alone
from .mixing import shrink
from .modes import CHI2, FREEDOM, WEIGHT, error_of, mode, own_sigma2, size_of, take
from .sensitivity import pass_time
from .set_free import (
    MILDLY,
    are_to_compete,
    compete,
    open_set_free,
    see_set_free,
    set_free,
    set_free_again,
    sets_in,
    time_update_set_free,
)
from .trial_state import (
    AGE,
    ALONE,
    BEFORE,
    BESIDE,
    COPIES,
    FREED,
    GAP,
    IMPOSSIBLE,
    LEADER,
    LEVEL,
    SAME,
    is_told,
    show_none,
)


@kernel
def limit_of(memory, drift, view):
    """Return how many times the variance of a prediction is a surprise; fewer where several are to be set free."""
    return SURPRISE_OF_STATE if are_to_compete(memory, drift, view) else SURPRISE


@kernel
def best_of(trial):
    """Return the log evidence of the best explanation other than none, over that of none."""
    found = trial.found
    return max(max(found[FREED], found[SAME] + trial.head[ALONE]), found[LEVEL]) - found[SAME]


@kernel
def is_hopeless(trial, odds):
    """Say whether no explanation but none has come to these log odds."""
    return best_of(trial) + log(RATE * trial.head[GAP]) < odds


@kernel
def is_to_begin(trial, parts, surprise, limit, is_suspicious, is_alone):
    """Say whether a trial is to begin: at a surprise or a suspicion; only the first ends another, a fruitless one.

    That is one with nothing to tell; or nothing that the bank does not know, if the surprise ``is_alone`` no more.
    """
    head = trial.head
    if head[AGE] == 0.0:
        return is_suspicious or surprise >= limit
    if is_told(trial):
        return False
    if limit < SURPRISE and sets_in(parts).began[0] == MILDLY and is_suspicious and is_hopeless(trial, HOPELESS):
        return True
    if surprise >= SURPRISE and (head[GAP] > 1.0 or head[AGE] >= trial.score.size + FRESH):
        known = 0.0 if is_alone else max(head[BESIDE] - trial.found[SAME], 0.0)
        return is_hopeless(trial, HOPELESS + known)
    return False


@kernel
def is_to_end(trial):
    """Say whether a trial has nothing to tell any more."""
    head = trial.head
    if head[AGE] >= OLDEST:
        return True
    if is_told(trial):
        return max(trial.found[SAME], trial.found[LEVEL] + log(RATE * head[GAP])) - head[BESIDE] < DOUBTLESS
    if head[AGE] >= OLD:
        return is_hopeless(trial, HOPELESS)
    return head[AGE] >= trial.score.size + FRESH and is_hopeless(trial, DEAD)


@kernel
def set_level(memory, level, freedom, sigma2):
    """Let sigma^2 be this, known by so many samples; what is known of the parameters stays what it was."""
    share = own_sigma2(memory, level.own) / sigma2
    level.own[FREEDOM], level.own[CHI2] = freedom, freedom * sigma2
    for i in range(level.D.size):
        level.D[i] *= share


@rare
def begin_trial(memory, trial, spare, bank, unit, M, surprise, limit, is_suspicious, b):
    """Copy the likeliest filter of the bank, set the parameters of one copy free and sigma^2 of another."""
    N, head, size = unit.size, trial.head, size_of(unit.size)
    leader, most, is_surprise = 0, 0.0, surprise >= (SURPRISE if is_suspicious else limit)
    for m in range(M):
        trial.weights[m] = mode(bank, m, N).own[WEIGHT]
        if trial.weights[m] > most:
            leader, most = m, trial.weights[m]
    for k in range(COPIES):
        for i in range(size):
            trial.copies[k * size + i] = bank[leader * size + i]
        mode(trial.copies, k, N).own[WEIGHT] = 1.0
        trial.found[k] = trial.shown[k] = trial.moved[k] = 0.0
    freed, level = mode(trial.copies, FREED, N), mode(trial.copies, LEVEL, N)
    head[BEFORE] = own_sigma2(memory, level.own)
    if is_surprise:
        set_level(memory, level, LOUD_FREEDOM, LOUD * head[BEFORE])
    else:
        set_level(memory, level, PLAIN_FREEDOM, head[BEFORE])
    if freed.own[FREEDOM] > FREED_FREEDOM:
        freed.own[FREEDOM], freed.own[CHI2] = FREED_FREEDOM, FREED_FREEDOM * head[BEFORE]
    spread = max(WIDE, min(surprise, WIDEST) / N)
    trial.found[FREED] = max(min(0.5 * log(FAR / spread), 0.0), RAREST)
    narrower = 1.0
    for i in range(N):
        widen = spread * unit[i]
        if i < memory.past and widen * head[BEFORE] > LAG_JUMP:
            narrower = max(narrower, widen * head[BEFORE] / LAG_JUMP)
            widen = LAG_JUMP / head[BEFORE]
        widen_within(freed.U, freed.D, i, widen, memory.cap[i], b)
        trial.score[i] = trial.known[i] = 0.0
    trial.found[FREED] += max(-0.5 * log(narrower), RAREST)
    for i in range(N * N):
        trial.F[i] = 1.0 if i % (N + 1) == 0 else 0.0
    head[GAP] = 1.0 if is_surprise else WINDOW
    head[AGE], head[LEADER], head[BESIDE], head[ALONE] = 0.0, leader, 0.0, 0.0
    if limit < SURPRISE:
        is_mild = is_surprise and surprise < SURPRISE and not is_suspicious
        set_free(memory, trial, open_set_free(spare, N), unit, surprise, is_mild, b)


@rare
def begin_anew(memory, trial, spare, unit, surprise, b):
    """At another surprise begin what explains no more than none from here on, beside a state."""
    N, head = unit.size, trial.head
    set_free_again(memory, trial, open_set_free(spare, N), unit, surprise, b)
    if head[GAP] == 1.0 and trial.found[LEVEL] < trial.found[SAME]:
        set_level(memory, mode(trial.copies, LEVEL, N), LOUD_FREEDOM, LOUD * head[BEFORE])
        trial.found[LEVEL] = trial.found[SAME] - log(head[GAP])
    if head[ALONE] == 0.0:
        for i in range(N):
            trial.score[i] = trial.known[i] = 0.0
        for i in range(N * N):
            trial.F[i] = 1.0 if i % (N + 1) == 0 else 0.0


@kernel
def copy_sees(memory, trial, k, e, R, theta, outliers, view, least):
    """Let a copy, its sigma^2 ``least`` at least, see the sample; return error, probability of an outlier, and T."""
    N = theta.size
    half = N * (N + 1) // 2
    one = mode(trial.copies, k, N)
    error = error_of(one, e, view.psi, theta)
    P = trial.dense[k * half : (k + 1) * half]
    log_p, factor, rho, T, _ = take(memory, one, P, error, R, view, outliers, False, False, least)
    trial.found[k] += log_p + log(factor)
    return error, rho, T


@kernel
def argue(memory, parts, e, R, is_right, theta, evidence, outliers, view, unit, least):
    """Let the trial see the sample; return the probability that it is an outlier, to each copy.

    ``is_right``: regressors are, if parameters jumped: only what looked like an outlier makes them doubtful. Then those
    of ``past`` which did so since the trial began were none, and stand among the regressors as measured.
    ``evidence`` is that of the bank.
    """
    trial, past, N, head = parts.trial, parts.past, theta.size, parts.trial.head
    half, are_several = N * (N + 1) // 2, compete(memory, parts)
    freed_e, same = e, mode(trial.copies, SAME, N)
    for i in range(view.fresh.size - 1):
        freed_e += (view.psi[i] - view.fresh[i]) * (theta[i] - same.theta[i])
    error, rho, T = copy_sees(memory, trial, SAME, e, R, theta, outliers, view, least)
    weigh_alone(trial, error, rho, T, view, unit, own_sigma2(memory, mode(trial.copies, SAME, N).own))
    noise = memory.R if is_right else R
    for i in range(N):
        if not are_several and memory.lags[i] > head[AGE]:  # this one may be the old one still, or not
            noise += WIDE * unit[i] * view.psi[i] * view.psi[i]
    since = head[AGE] if is_right else 0.0
    for i in range(view.fresh.size - 1):
        view.psi[i], view.fresh[i] = view.fresh[i], view.psi[i]
    freed_e = exchange(memory, past, view.psi, theta, freed_e, since)
    freed_rho = 0.0
    if not are_several:
        _, freed_rho, _ = copy_sees(memory, trial, FREED, freed_e, noise, theta, outliers, view, least)
    elif not is_told(trial):
        freed_rho = see_set_free(memory, trial, sets_in(parts), freed_e, noise, theta, outliers, view, unit, least)
    exchange(memory, past, view.psi, theta, e, since)
    for i in range(view.fresh.size - 1):
        view.psi[i], view.fresh[i] = view.fresh[i], view.psi[i]
    level_rho, level = 0.0, mode(trial.copies, LEVEL, N).own
    if memory.learns > 0.0:
        before = own_sigma2(memory, level)
        _, level_rho, _ = copy_sees(memory, trial, LEVEL, e, R, theta, outliers, view, least)
        change = before / own_sigma2(memory, level)
        for i in range(half):  # what it knows of the parameters stays what it was, whatever the noise is
            trial.dense[LEVEL * half + i] *= change
    else:
        trial.found[LEVEL] = IMPOSSIBLE
    head[AGE] += 1.0
    head[BESIDE] += evidence
    return rho, freed_rho, level_rho


@bulky
def time_update_copies(memory, trial, spare, are_several, q, waits, b):
    """Take the copies one sample on; ``q`` are the variances that every filter of the bank gains, N of each."""
    N = trial.score.size
    half, first = N * (N + 1) // 2, int(trial.head[LEADER]) * N
    if are_several:
        time_update_set_free(memory, trial, open_set_free(spare, N), q, first, waits, b)
    for k in range(COPIES):
        one, P = mode(trial.copies, k, N), trial.dense[k * half : (k + 1) * half]
        share = trial.head[BEFORE] / own_sigma2(memory, one.own) if k == LEVEL else 1.0
        if waits:
            pass_time(one.theta, P, memory.phi[:N])
            for i in range(N):
                P[at(i, i)] += share * q[first + i]
            shrink(P, memory.cap[:N])
            factor_within(P, one.U, one.D)
        else:
            relax(one.theta, one.U, one.D, memory.phi, b)
            for i in range(N):
                widen_within(one.U, one.D, i, share * q[first + i], memory.cap[i], b)
    for i in range(N):
        for j in range(N):
            trial.F[i * N + j] *= memory.phi[j]


@kernel
def end_trial(trial):
    """Let no trial run."""
    trial.head[AGE] = 0.0
    show_none(trial)
