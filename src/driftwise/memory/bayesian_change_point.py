"""How long since the last jump? One Kalman filter for every answer, mixed by how well each predicts."""

import math
from typing import Any, NamedTuple

from ..detect.watch import SINCE, STATISTIC, WHICH
from ..engine import validation
from ..engine.dispatch import PerParameter, kernel, rare
from ..engine.elementary import exp, log, log1p
from ..engine.layout import Field, Layout, numbers
from ..engine.status import CAPPED
from ..engine.ud import correct, marginal, predicted_variance, project, widen_along
from .gauss_markov import widen_within
from .questions import adapt, count, found_jump, resolve, take_along, time_update
from .registry import register
from .settings import jump_size, more_than_one
from .wind_up import hold_within

COUNT, NEWEST, TOLD = range(3)  # of the head
LOG, RUN, CHI2 = range(3)  # of a hypothesis
ODDS = 100.0  # a jump is told when it is so many times likelier than none


HYPOTHESIS = Layout(
    *numbers("own", log="log weight", run="samples since its jump", chi2="of sigma^2, less what the row has"),
    Field("theta", ("N",)),
    Field("D", ("N",), "P = U D U': the diagonal"),
    Field("U", ("N * (N - 1) // 2",), "and the factor above it, column by column"),
    given=("N",),
)
open_hypothesis, hypothesis_size = kernel(HYPOTHESIS.open), kernel(HYPOTHESIS.size)
CHANGE_POINT = Layout(
    *numbers(
        "head",
        count="how many hypotheses there are",
        newest="which one is the newest",
        told="samples since the last jump that was told",
    ),
    Field("hypotheses", ("hypotheses", "hypothesis_size(N)"), "each that may be"),
    given=("N", "hypotheses"),
    hypothesis_size=hypothesis_size,
)
open_change_point = kernel(CHANGE_POINT.open)


@register(
    "change-point:JUMP/EVERY",
    about="jumps of that size every so many samples, all instants considered",
    read=lambda words: BayesianChangePoint(*words.jump_every()),
    jump=0.3,
    every=50,
    hypotheses=4,
)
class BayesianChangePoint(NamedTuple):
    """Jumps of size ``jump``, one every so many samples on average: all instants are considered, the likely ones kept.

    The ``hypotheses`` most likely answers to "when was the last jump?" each have their own Kalman filter; theta and P
    are mean and covariance of the mixture, the weight of a trace is how many samples ago the last jump was, on average
    over it. It re-learns as far as the data ask for it; besides, it tells (``JUMP``) when a new jump is 100 times
    likelier than none, and since when. A sample costs more than ``hypotheses`` updates. ``jump`` is one number or one
    per parameter, in the units of `y_scale` and `u_scale`. Source: Adams and MacKay (2007); here the least likely run
    is dropped. Bars of the prediction hold the jump that may come: where it would be large they are too wide until it
    does (NIS below 1). Bad at: jumps below half the noise (dropping hurts there: use `RandomWalk`), drift, noise that
    grows, speed.

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.memory.BayesianChangePoint(1.0, 500)).scan(y, u)
    >>> [jump.sample for jump in trace.jumps()], trace.parameters[-1].round(1).tolist()
    ([401], [-0.8, 2.0])
    """

    jump: Any
    every: float
    hypotheses: int = 20

    @property
    def odds(self) -> float:
        """The odds at which a jump is told: a statistic of 1."""
        return ODDS


class BayesianChangePointKernel(NamedTuple):
    """What the kernel sees of `BayesianChangePoint`: a jump has probability ``rate`` and variances q (absolute)."""

    rate: float
    hypotheses: float
    settle: float
    q: PerParameter
    cap: PerParameter

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return CHANGE_POINT.size(parameters, int(self.hypotheses))


@resolve.on(BayesianChangePoint)
def resolve_bayesian_change_point(memory, setting):
    q = jump_size("jump", memory.jump, setting.N) ** 2 * setting.units
    rate = 1 / more_than_one("every", memory.every)
    hypotheses = validation.count("hypotheses", memory.hypotheses, least=2)
    settle = 3 * setting.settle  # six times the number of unknowns, as long as detectors wait
    return BayesianChangePointKernel(rate, hypotheses, settle, q, setting.cap)


@kernel
def hypothesis(state, i, N):
    """Return the views of hypothesis i: its own numbers, theta, D, U."""
    return open_hypothesis(open_change_point(state, N, i + 1).hypotheses[i], N)


@kernel
def averages(state, N):
    """Return what the hypotheses' run and chi2 are on average."""
    run, chi2 = 0.0, 0.0
    for i in range(int(state[COUNT])):
        own = hypothesis(state, i, N)[0]
        w = exp(own[LOG])
        run += w * own[RUN]
        chi2 += w * own[CHI2]
    return run, chi2


@kernel
def settle_in(state, i, log_weight, view, N):
    """Write hypothesis i, of run 0, and make it the newest."""
    own, m, d, u = hypothesis(state, i, N)
    own[LOG], own[RUN], own[CHI2] = log_weight, 0.0, 0.0
    for j in range(N):
        m[j], d[j] = view.theta[view.first + j], view.D[view.first + j]
    marginal(view.U, view.first, N, u)
    state[NEWEST] = i


@adapt.on(BayesianChangePointKernel)
def adapt_bayesian_change_point(memory, state, e, R, view):
    theta, U, D, s2 = view.theta, view.U, view.D, view.s2
    N, T, top = D.size, predicted_variance(view.f, D, R), -math.inf
    if state[COUNT] == 0.0:
        settle_in(state, 0, 0.0, view, N)
        state[COUNT] = 1.0
    for i in range(int(state[COUNT])):
        own, m, d, u = hypothesis(state, i, N)
        error = e
        for j in range(N):
            error += view.psi[j] * (theta[j] - m[j])
        project(u, view.psi, view.f)
        S = correct(u, d, view.f, R, view.b)
        for j in range(N):
            m[j] += view.b[j] * (error / S)
        own[LOG] -= 0.5 * (error * error / (s2 * S) + log(S / T))
        own[RUN] += 1.0
        own[CHI2] += error * error / S
        top = max(top, own[LOG])
    total = 0.0
    for i in range(int(state[COUNT])):
        total += exp(hypothesis(state, i, N)[0][LOG] - top)
    mix(state, top + log(total), s2, theta, U, D, view.c)
    return T


@rare
def mix(state, evidence, s2, theta, U, D, a):
    """Normalise the weights; let theta and U, D be mean and covariance of the mixture, by rank-one additions."""
    N = D.size
    for j in range(N):
        theta[j] = D[j] = 0.0
    for j in range(U.size):
        U[j] = 0.0
    for i in range(int(state[COUNT])):
        own, m, d, u = hypothesis(state, i, N)
        own[LOG] -= evidence
        w = exp(own[LOG])
        for j in range(N):
            theta[j] += w * m[j]
    for i in range(int(state[COUNT])):
        own, m, d, u = hypothesis(state, i, N)
        w = exp(own[LOG])
        for j in range(N):
            for k in range(j):
                a[k] = u[j * (j - 1) // 2 + k]
            a[j] = 1.0
            widen_along(U, D, a, w * d[j], j)
        for j in range(N):
            a[j] = m[j] - theta[j]
        widen_along(U, D, a, w / s2, N - 1)


@count.on(BayesianChangePointKernel)
def count_bayesian_change_point(memory, state, count, chi2, weight, gain):
    """E-step of EM: chi2 is what it is on average over the hypotheses, each with the errors e_i^2/T_i of its own run.

    e^2/T of the mixture will not do: its T holds the jump that hardly ever comes, so sigma^2 would come out too small.
    Runs that turn out unlikely take their errors away again, at most half of chi2 at a time: it stays positive.
    """
    N = memory.q.size
    run, own_chi2 = averages(state, N)
    added = max(own_chi2, -0.5 * chi2)
    for i in range(int(state[COUNT])):
        own = hypothesis(state, i, N)[0]
        own[CHI2] -= added
    return count + 1.0, chi2 + added, run


@found_jump.on(BayesianChangePointKernel)
def found_jump_bayesian_change_point(memory, state, detector_state):
    """Tell a jump when runs that began after the last one told are ODDS times likelier than all others.

    While nothing jumps these odds grow by 1/every a sample on average (a martingale, Shiryaev 1963), so that false
    events are ODDS * every samples apart, or more, where the noise is known.
    """
    N, new, old, best, top = memory.q.size, 0.0, 1e-300, 0.0, -math.inf
    state[TOLD] += 1.0
    for i in range(int(state[COUNT])):
        own = hypothesis(state, i, N)[0]
        if own[RUN] >= state[TOLD]:
            old += exp(own[LOG])
        else:
            new += exp(own[LOG])
            if own[LOG] > top:
                best, top = own[RUN], own[LOG]
    odds = new / old
    detector_state[STATISTIC] = log(odds) / log(ODDS) if odds > 1.0 else 0.0
    if odds < ODDS:
        return 0.0
    detector_state[SINCE], detector_state[WHICH], state[TOLD] = best, -1.0, 0.0
    return 1.0


@time_update.on(BayesianChangePointKernel)
def time_update_bayesian_change_point(memory, state, elapsed, view):
    U, D, N, count = view.U, view.D, memory.q.size, int(state[COUNT])
    is_learnt = view.surprise >= 0.0
    if count < 2 and (view.weight <= memory.settle or not is_learnt):
        return 1.0, 0
    is_held = hold_within(U, D, memory.cap, view.c, view.f, view.b)
    moved = memory.rate
    if is_learnt:
        branch(memory, state, count, view)
    else:  # the newest hypothesis has seen nothing yet: in a gap it takes later jumps in as well
        moved *= 1.0 - exp(hypothesis(state, int(state[NEWEST]), N)[0][LOG])
        stays = log1p(-memory.rate)
        for i in range(count):
            own = hypothesis(state, i, N)[0]
            own[LOG] += stays
            if i == int(state[NEWEST]):
                own[LOG] = log(exp(own[LOG]) + memory.rate)
    for i in range(N):  # the covariance of the mixture with a new member of the same mean
        is_held |= not widen_within(U, D, view.first + i, moved * memory.q[i] / view.s2, memory.cap[i], view.b)
    return 1.0, CAPPED if is_held else 0


@rare
def branch(memory, state, count, view):
    """Add the hypothesis that the parameters jump now; the least likely one goes where there is no room."""
    N, slot, least, stays = memory.q.size, count, math.inf, log1p(-memory.rate)
    for i in range(count):
        own = hypothesis(state, i, N)[0]
        if count == int(memory.hypotheses) and own[LOG] < least:
            slot, least = i, own[LOG]
        own[LOG] += stays
    settle_in(state, slot, log(memory.rate), view, N)
    state[COUNT] = max(state[COUNT], slot + 1.0)
    _, _, d, u = hypothesis(state, slot, N)
    for i in range(N):
        widen_within(u, d, i, memory.q[i] / view.s2, memory.cap[i], view.b)


@take_along.on(BayesianChangePointKernel)
def take_along_bayesian_change_point(memory, state, change, view):
    for i in range(int(state[COUNT])):
        _, m, d, u = hypothesis(state, i, view.D.size)
        for j in range(view.D.size):
            m[j] += change.moved[j]
            widen_within(u, d, j, change.freed[j], memory.cap[j], view.b)
        for j in range(view.D.size):
            d[j] /= change.lam
        if change.lam < 1.0:
            hold_within(u, d, memory.cap, view.c, view.f, view.b)
