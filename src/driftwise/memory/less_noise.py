"""Has the noise another level than what is shown says? A filter that thinks so predicts better, and takes over.

*As small as most rows say.* Some wrong numbers in a row look like louder noise. If that is believed sigma^2 is a
hundred times too large, the next ones are not seen, stay among the regressors of an `ARX` and are fitted, and so it
stays. The mean logarithm of the squared errors hardly minds them. Where sigma^2 is several times what it says, the
likeliest filter of the bank goes on beside it with that: its parameters, and what is known of them, are the same. What
it predicts competes with what all others do. Quieter noise looks alike, but no error is an outlier then: of that a
trial tells.

*Louder.* Of that a trial tells, too, but among outliers it hardly can: every one is a surprise, which begins another
trial, and what the last had heard is lost. Meanwhile the fast filter follows the noise, and wins. So where squared
errors are suspicious enough, the filter that never forgets goes on with a sigma^2 that is unknown, whatever trials do.

It has the place of the second start, which is over by then.
"""

import math

from ..engine.dispatch import kernel, rare
from ..engine.elementary import exp, log
from ..engine.layout import numbers
from ..engine.ud import expand
from .auto_constants import (
    HARDLY_FAST,
    HAS_SEEN,
    KEPT,
    KNOWN,
    LEVEL_ODDS,
    LONGEST,
    LOUD,
    LOUD_AGE,
    LOUD_FREEDOM,
    OF_SQUARES,
    QUIETER,
    ROWS,
    SMALLEST,
    UNLIKELY,
)
from .gauss_markov import relax
from .likelihood_drift import begin_again
from .modes import CHI2, FAINTEST, FREEDOM, WEIGHT, copy_mode, error_of, hand_over, mode, own_sigma2, take
from .second_start import AGE, SCORE, STRUCK_SO_FAR, share_of
from .trial_state import is_told

LOGARITHMS, COUNTED, HEARD = range(3)  # of what is kept, and how many
MOST = numbers("most", logarithms="sum of log e^2/T of the last rows without a doubtful regressor", rows="how many")


@kernel
def hear(most, e, T, s2):
    """Take a row into what most of the last ones say."""
    most[LOGARITHMS] = KEPT * most[LOGARITHMS] + log(max(e * e / T, SMALLEST * s2))
    most[COUNTED] = KEPT * most[COUNTED] + 1.0


@kernel
def say_most(most):
    """Return the sigma^2 that most of the last rows say, infinity while they are few."""
    return exp(most[LOGARITHMS] / most[COUNTED] + OF_SQUARES) if most[COUNTED] > ROWS else math.inf


@rare
def begin_quiet(memory, second, bank, M, s2):
    """Begin as the likeliest filter of the bank, with this sigma^2; what is known of the parameters stays the same."""
    N, leader = memory.cap.size, 0
    for m in range(1, M):
        if mode(bank, m, N).own[WEIGHT] > mode(bank, leader, N).own[WEIGHT]:
            leader = m
    one, of = mode(second.row, 0, N), mode(bank, leader, N)
    change = own_sigma2(memory, of.own) / s2
    copy_mode(one, of)
    for i in range(N):
        one.D[i] *= change
    one.own[WEIGHT], one.own[FREEDOM], one.own[CHI2] = 1.0, KNOWN, KNOWN * s2
    second.head[AGE], second.head[SCORE], second.head[STRUCK_SO_FAR] = 1.0, 0.0, 0.0


@rare
def begin_if_quiet(memory, second, most, bank, M, s2):
    """Begin, where none runs and sigma^2 is several times what most rows say."""
    said = say_most(most)
    if second.head[AGE] == 0.0 and QUIETER * said < s2:
        begin_quiet(memory, second, bank, M, said)


@rare
def go_on_beside(memory, second, e, R, evidence, outliers, theta, P, view, least):
    """Let it see a sample; say whether it has won. ``outliers`` is their share to all others."""
    head, one = second.head, mode(second.row, 0, theta.size)
    error = error_of(one, e, view.psi, theta)
    share = max(outliers, share_of(memory, head[STRUCK_SO_FAR], head[AGE]))
    log_p, factor, rho, _, before = take(memory, one, P, error, R, view, share, False, True, least)
    change = before / own_sigma2(memory, one.own)
    for i in range(one.D.size):
        one.D[i] *= change
    relax(one.theta, one.U, one.D, memory.phi, view.b)
    head[AGE] += 1.0
    head[STRUCK_SO_FAR] += rho
    head[SCORE] += log_p + log(factor / one.own[WEIGHT]) - evidence
    if head[SCORE] < UNLIKELY or head[AGE] > LONGEST:
        head[AGE] = 0.0
    if head[SCORE] <= LEVEL_ODDS:
        return False
    if is_louder(memory, second, view.s2):
        return head[AGE] > LOUD_AGE
    return head[STRUCK_SO_FAR] > HAS_SEEN


@kernel
def is_louder(memory, second, s2):
    """Say whether it thinks that the noise is louder than what is shown says."""
    return own_sigma2(memory, mode(second.row, 0, memory.cap.size).own) > s2


@rare
def begin_if_loud(memory, second, trial, bank):
    """Begin as the filter that never forgets, with a sigma^2 that is larger and hardly known, where none runs.

    A jump that is told has this rival anyway.
    """
    if second.head[AGE] == 0.0 and not is_told(trial):
        N = memory.cap.size
        one, of = mode(second.row, 0, N), mode(bank, 0, N)
        copy_mode(one, of)
        for i in range(N):
            one.D[i] /= LOUD
        one.own[FREEDOM], one.own[CHI2] = LOUD_FREEDOM, LOUD_FREEDOM * LOUD * own_sigma2(memory, of.own)
        second.head[AGE], second.head[SCORE], second.head[STRUCK_SO_FAR] = 1.0, 0.0, 0.0


@rare
def take_over(second, bank, dense, learner, P):
    """Let every filter of the bank be that one; ``P`` is scratch."""
    one = mode(second.row, 0, learner.eta.size)
    expand(one.U, one.D, P)
    hand_over(bank, dense, one, P)
    for j in range(learner.eta.size):
        begin_again(learner, j)
    second.head[AGE] = 0.0


@rare
def weigh_as_before(second, bank, N, M):
    """Let the filter that never forgets have the weight of when that one began; fast ones little, the learnt one more.

    What the fast ones have won since was noise.
    """
    fast = (M - 2) * HARDLY_FAST
    slow = min(mode(second.row, 0, N).own[WEIGHT], 1.0 - fast - FAINTEST)
    for m in range(1, M - 1):
        mode(bank, m, N).own[WEIGHT] = HARDLY_FAST
    mode(bank, 0, N).own[WEIGHT], mode(bank, M - 1, N).own[WEIGHT] = slow, 1.0 - slow - fast
