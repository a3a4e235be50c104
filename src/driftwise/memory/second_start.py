"""Was the start wrong? Another filter begins a little later, and takes over if it predicts better.

A wrong number among the first samples is fitted, since nothing is known yet that it could contradict; it stays among
the regressors of an `ARX`, and what it taught is as certain as all that is right. So in the first samples a filter
with a wide prior begins again and again. It is not weighed by what it says while it learns: from then on what it
predicts competes with what all others do, who have seen more, and are better unless what they have seen misleads them.
A row with a regressor that has rested since it began teaches it and says nothing: no wrong number is a surprise there.
Where some of the last rows contradict the others it begins with those that agree, and knows as much as they say. Early
rows may hold too many wrong numbers for that: so where it is not ahead it does so again, as soon as those that agree
are so near each other that they pay for those left out.
"""

from ..engine.dense import dot
from ..engine.dispatch import kernel, rare
from ..engine.elementary import log
from ..engine.layout import Field, Layout, numbers
from ..engine.ud import expand
from .auto_constants import (
    A_ROW,
    AHEAD,
    AT_ONCE,
    BETTER,
    BETWEEN,
    BEYOND,
    CHANCES,
    FAMILIAR,
    FARTHEST,
    LEARNING,
    OF_LEFT_OUT,
    OFTEN,
    STRUCK,
    TRUSTED,
    UNFIT,
    YOUTH,
)
from .gauss_markov import relax
from .modes import CHI2, FREEDOM, WEIGHT, error_of, hand_over, mode, size_of, take
from .robust_start import fit_trimmed, says_enough
from .trial import best_of
from .trial_state import AGE as TRIAL_AGE
from .trial_state import BESIDE, FREED, LEVEL, SAME
from .unknown_drift import ROOM

AGE, SCORE, STRUCK_SO_FAR = range(3)  # of the head

SECOND = Layout(
    *numbers(
        "head",
        age="samples it has seen; 0: none runs",
        score="its log evidence over that of all others",
        struck="outliers among them, to it",
    ),
    Field("row", ("size_of(N)",), "the filter that begins later"),
    given=("N",),
    size_of=size_of,
)
open_second, second_size = kernel(SECOND.open), kernel(SECOND.size)


@kernel
def share_of(memory, struck, counted):
    """Return how many samples in one are outliers, if ``struck`` of ``counted`` have been some."""
    return memory.outliers * min((struck + STRUCK) / (counted + CHANCES), OFTEN)


@kernel
def begin_second(memory, second, theta, unit):
    """Begin from here on, with a wide prior and nothing known of sigma^2."""
    one = mode(second.row, 0, theta.size)
    one.own[WEIGHT], one.own[FREEDOM], one.own[CHI2] = 1.0, memory.freedom, memory.chi2
    for i in range(theta.size):
        one.theta[i], one.D[i] = theta[i], min(memory.cap[i] / ROOM, FARTHEST * unit[i])
    for i in range(one.U.size):
        one.U[i] = 0.0
    second.head[AGE] = second.head[SCORE] = second.head[STRUCK_SO_FAR] = 0.0


@kernel
def do_they_pay(left, kept, before, sigma2):
    """Say whether rows that agree to this sigma^2 pay for those left out; it was ``before`` (0: they need not)."""
    return before == 0.0 or (sigma2 < before and 0.5 * kept * log(before / sigma2) > A_ROW * left)


@kernel
def least_sigma2(shown, own):
    """Return the sigma^2 that rows have to be better than: what is shown, or that of the start that runs."""
    return min(shown, own[CHI2] / own[FREEDOM]) if own[FREEDOM] >= 1.0 else shown


@rare
def begin_with_rows(memory, second, rows, theta, unit, P, view, least, before):
    """Let it begin with those of the last rows that agree, if some do not; say whether it did.

    It has seen the present one, which is kept by now, and counts from the next sample on. ``before`` as in
    `do_they_pay`.
    """
    N, count, head = unit.size, rows.y.size, second.head
    limit, many = fit_trimmed(rows, unit, P)
    if many == count or not do_they_pay(count - many, many - N, before, limit / BEYOND) or not says_enough(rows, limit):
        return False
    begin_second(memory, second, theta, unit)
    for i in range(N):
        rows.x[i] = view.psi[i]  # the present row, of which one in doubt is not kept
    one, last = mode(second.row, 0, N), int(rows.taken[0]) - 1
    for k in range(last + 1, last + 1 + count):  # the oldest first
        psi = rows.psi[k % count]
        for i in range(N):
            view.psi[i] = psi[i]
        if rows.square[k % count] <= limit:
            error = rows.y[k % count] - dot(psi, one.theta)
            take(memory, one, P, error, memory.R, view, 0.0, False, True, least)
    for i in range(N):
        view.psi[i] = rows.x[i]
    head[AGE], head[STRUCK_SO_FAR] = N + LEARNING, OF_LEFT_OUT * (count - many)
    return True


@kernel
def is_time(memory, more, R):
    """Say whether to look at the last rows again: now and then, as one is kept; ``more`` have been than find room."""
    return more > 0.0 and R <= TRUSTED * memory.R and int(more) % BETWEEN == 0


@rare
def start_again(memory, second, rows, e, R, evidence, unit, theta, P, view, least):
    """Let it see a sample; say whether it has won."""
    N, head = theta.size, second.head
    is_ahead = head[SCORE] > AHEAD
    is_over = head[AGE] == 0.0 or head[SCORE] < UNFIT or (head[AGE] >= N + LEARNING + YOUTH and not is_ahead)
    more = rows.taken[0] - rows.y.size
    if is_over:
        begin_second(memory, second, theta, unit)
    if memory.outliers > 0.0 and ((more == 0.0 and head[SCORE] <= 0.0) or (is_over and more > 0.0)):
        if begin_with_rows(memory, second, rows, theta, unit, P, view, least, 0.0):
            return False
    elif memory.outliers * memory.learns > 0.0 and not is_ahead and is_time(memory, more, R):
        before = least_sigma2(view.s2, mode(second.row, 0, N).own)
        if begin_with_rows(memory, second, rows, theta, unit, P, view, least, before):
            head[SCORE] = -AHEAD
            return False
    one = mode(second.row, 0, N)
    error = error_of(one, e, view.psi, theta)
    share = share_of(memory, head[STRUCK_SO_FAR], head[AGE])
    log_p, factor, rho, T, _ = take(memory, one, P, error, R, view, share, False, True, least)
    relax(one.theta, one.U, one.D, memory.phi, view.b)
    head[AGE] += 1.0
    head[STRUCK_SO_FAR] += rho
    if head[AGE] > N + LEARNING and T < FAMILIAR * R:
        head[SCORE] += min(log_p + log(factor) - evidence, AT_ONCE)
    return head[SCORE] > BETTER


@kernel
def is_explained(trial, second):
    """Say whether a trial knows another explanation that does as well: another level of the noise, or a jump."""
    head, found = trial.head, trial.found
    best = max(found[FREED], found[LEVEL]) - head[BESIDE]
    return head[TRIAL_AGE] > 0.0 and second.head[SCORE] < best + BETTER


@kernel
def concede(trial, second):
    """Weigh it from now on against what a trial has decided: by so much that predicted better than the bank did."""
    second.head[SCORE] -= best_of(trial) + trial.found[SAME] - trial.head[BESIDE]


@kernel
def let_start(memory, second, bank, dense, learner, P):
    """Let every filter of the bank be the one that began later, and know no speed yet; ``P`` is scratch."""
    one = mode(second.row, 0, learner.eta.size)
    expand(one.U, one.D, P)
    hand_over(bank, dense, one, P)
    for known in (learner.eta, learner.shares, learner.known, learner.J, learner.dtheta, learner.dP):
        for i in range(known.size):
            known[i] = 0.0
    for i in range(learner.eta.size):
        learner.eta[i] = memory.home
    second.head[AGE] = 0.0
