"""When did parameters beside a state jump, and how far? Copies compete, set free at other samples and by other sizes.

A copy that is set free before the jump has learnt the old parameters again when it comes, and one that is set free
much farther than it goes is improbable. So beside a state a trial sets two copies free, a little and far; at another
surprise those that explain no more than parameters at rest are set free again, from then on. What was one copy of the
trial is their mixture. They stand where the first samples' rows stood, until no other start is looked for any more.
"""

from ..engine.dense import at
from ..engine.dispatch import kernel, rare
from ..engine.elementary import exp, log
from ..engine.layout import Field, Layout, each
from ..engine.ud import factor_within
from .auto_constants import FAR, KNOWN_FREEDOM, LITTLE, POLE_JUMP, RAREST, SETS, WIDER_STILL, WIDEST, YOUNG_ENOUGH
from .gauss_markov import relax, widen_within
from .mixing import amount, shrink
from .modes import CHI2, FREEDOM, WEIGHT, error_of, mode, own_sigma2, size_of, take
from .robust_start import rows_size
from .sensitivity import pass_time
from .trial_state import BEFORE, FREED, GAP, IMPOSSIBLE, SAME
from .unknown_drift import SEEN

AT_ONCE, MILDLY = 1.0, 2.0  # how a trial that sets several free began


@kernel
def sets_of(N):
    """Return how many copies there is room for, three at least."""
    return min(SETS, (rows_size(N) - 2) // (5 + size_of(N) + N * (N + 1) // 2))


SET_FREE = Layout(
    *each(
        "K",
        found="log evidence of each",
        age="samples since it was set free",
        wide="variance of its jump, in units",
        odds="scratch",
        sigma2="scratch",
    ),
    Field("began", ("1",), "0: none is free; 2: the trial began at what is no surprise elsewhere"),
    Field("copies", ("K * size_of(N)",), "the filters"),
    Field("dense", ("K * half",), "their P, packed, between a sample and the time update"),
    given=("N",),
    K="sets_of(N)",
    half="N * (N + 1) // 2",
    sets_of=sets_of,
    size_of=size_of,
)
open_set_free, set_free_size = kernel(SET_FREE.open), kernel(SET_FREE.size)


@kernel
def sets_in(parts):
    """Return the copies that may be free, once no rows are kept in their place."""
    return open_set_free(parts.spare, parts.drift.unit.size)


@kernel
def outputs_tell(memory, view):
    """Say whether outputs and inputs give the state: it has no past of its own."""
    return memory.has_state > 0.0 and view.fresh.size == 0


@kernel
def are_to_compete(memory, drift, view):
    """Say whether a trial that begins now is to set several copies free: the first samples' rows need the place."""
    return outputs_tell(memory, view) and drift.head[SEEN] >= YOUNG_ENOUGH


@kernel
def compete(memory, parts):
    """Say whether the trial that runs, if any does, has set several copies free."""
    return memory.has_state > 0.0 and parts.drift.head[SEEN] >= YOUNG_ENOUGH and sets_in(parts).began[0] > 0.0


@rare
def make_room(parts):
    """Let the last rows go: no other start is looked for any more."""
    parts.rows.taken[0] = sets_in(parts).began[0] = 0.0


@kernel
def least_likely(sets):
    """Return which copy is the least likely."""
    least = 0
    for k in range(sets.found.size):
        if sets.found[k] < sets.found[least]:
            least = k
    return least


@kernel
def how_wide(memory, trial, wide, unit, i):
    """Return the variance of a jump of parameter i, over sigma^2: ``wide`` units, or what a stable plant leaves."""
    most = POLE_JUMP / trial.head[BEFORE]
    return min(wide * unit[i], most) if i < memory.poles else wide * unit[i]


@rare
def set_free_once(memory, trial, sets, k, wide, found, unit, b):
    """Let copy k be the first of the trial with its parameters set free, of this log evidence till now."""
    N, size = unit.size, size_of(unit.size)
    for i in range(size):
        sets.copies[k * size + i] = trial.copies[SAME * size + i]
    one = mode(sets.copies, k, N)
    one.own[WEIGHT] = 1.0
    if one.own[FREEDOM] > KNOWN_FREEDOM:
        one.own[CHI2] *= KNOWN_FREEDOM / one.own[FREEDOM]
        one.own[FREEDOM] = KNOWN_FREEDOM
    for i in range(N):
        widen_within(one.U, one.D, i, how_wide(memory, trial, wide, unit, i), memory.cap[i], b)
    sets.found[k], sets.age[k], sets.wide[k] = found, 0.0, wide


@rare
def set_free(memory, trial, sets, unit, surprise, is_mild, b):
    """Set two copies free as a trial begins, before it has seen the sample."""
    sets.began[0] = MILDLY if is_mild else AT_ONCE
    for k in range(sets.found.size):
        sets.found[k] = IMPOSSIBLE
    set_both_free(memory, trial, sets, unit, surprise, 0.0, b)


@rare
def set_both_free(memory, trial, sets, unit, surprise, found, b):
    """Set the two least likely free, by a little and far."""
    far = max(WIDER_STILL, min(surprise, WIDEST) / unit.size)
    rarer = max(min(0.5 * log(FAR / far), 0.0), RAREST)
    set_free_once(memory, trial, sets, least_likely(sets), LITTLE, found + log(0.5), unit, b)
    set_free_once(memory, trial, sets, least_likely(sets), far, found + log(0.5) + rarer, unit, b)


@rare
def set_free_again(memory, trial, sets, unit, surprise, b):
    """At another surprise set two more free, in place of those that explain no more than none."""
    count, worse = sets.found.size, 0
    for k in range(count):
        if sets.found[k] < trial.found[SAME]:
            worse += 1
    if worse >= 2:
        set_both_free(memory, trial, sets, unit, surprise, trial.found[SAME] - log(trial.head[GAP]), b)


@kernel
def see_set_free(memory, trial, sets, e, R, theta, outliers, view, unit, least):
    """Let each see the sample, and the trial's copy be their mixture; return the probability of an outlier to it."""
    N, top, total, rho = theta.size, IMPOSSIBLE, 0.0, 0.0
    half = N * (N + 1) // 2
    for k in range(sets.found.size):
        if sets.found[k] > IMPOSSIBLE:
            noise, one = R, mode(sets.copies, k, N)
            for i in range(N):
                if memory.lags[i] > sets.age[k]:  # this one may be the old one still, or not
                    noise += how_wide(memory, trial, sets.wide[k], unit, i) * view.psi[i] * view.psi[i]
            P = sets.dense[k * half : (k + 1) * half]
            error = error_of(one, e, view.psi, theta)
            log_p, factor, struck, _, _ = take(memory, one, P, error, noise, view, outliers, False, False, least)
            sets.found[k] += log_p + log(factor)
            sets.age[k] += 1.0
            sets.odds[k] = struck
            top = max(top, sets.found[k])
    for k in range(sets.found.size):
        if sets.found[k] > IMPOSSIBLE:
            w = exp(sets.found[k] - top)
            rho += w * sets.odds[k]
            sets.odds[k] = w
            total += w
        else:
            sets.odds[k] = 0.0
        sets.sigma2[k] = own_sigma2(memory, mode(sets.copies, k, N).own)
    for k in range(sets.found.size):
        sets.odds[k] /= total
    freed = mode(trial.copies, FREED, N)
    P = trial.dense[FREED * half : (FREED + 1) * half]
    freedom, chi2, s2 = amount(sets.copies, sets.odds, sets.sigma2, sets.dense, freed.theta, P)
    freed.own[FREEDOM], freed.own[CHI2] = freedom, s2 * freedom if freedom >= 1.0 else chi2
    trial.found[FREED] = top + log(total)
    return rho / total


@kernel
def time_update_set_free(memory, trial, sets, q, first, waits, b):
    """Take them one sample on; ``q[first:]`` are the variances that each gains."""
    N = trial.score.size
    half = N * (N + 1) // 2
    for k in range(sets.found.size):
        if sets.found[k] > IMPOSSIBLE:
            one, P = mode(sets.copies, k, N), sets.dense[k * half : (k + 1) * half]
            if waits:
                pass_time(one.theta, P, memory.phi[:N])
                for i in range(N):
                    P[at(i, i)] += q[first + i]
                shrink(P, memory.cap[:N])
                factor_within(P, one.U, one.D)
            else:
                relax(one.theta, one.U, one.D, memory.phi, b)
                for i in range(N):
                    widen_within(one.U, one.D, i, q[first + i], memory.cap[i], b)
