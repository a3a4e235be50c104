"""One sample of a model average: the members' predictions become one density; then y says who was right.

    density at   m = sum w_i mu_i                                  (Raftery, Karny and Ettler 2010)
    prediction   sum v_i mu_i + v_0 m                              v: by regrets, `blend`
    base         s = sum w_i (c_i S_i + (mu_i - m)^2)              c_i: running mean of e_i^2/S_i, the noise now
    density      y ~ sum q_j N(m, v_j), v_j = kappa_j s, and rho_j times the long-run mean of e^2: tails are learnt
    weights      w_i <- (w_i p_i(y)^eta)^phi                         Student-t: one outlier does not decide
    variance     sum p_k v_k, v_k = c_k (s_k + d_k D)              D: upper quartile of (mu_i - prediction)^2
    c_k          times 1 + m_k (e^2/v_k - 1)                       s_k: s, or the long-run mean of e^2
    p_k          ~ p_k v_k^-r exp(-r e^2/v_k)

The variance is that of the prediction's errors. Their centre is not the density's, and they are largest where members
disagree, whatever those claim that were right so far: after a rest, in a flood. How much of the disagreement is error
differs from plant to plant: three answers and the long-run mean of e^2, each with a running mean of its own, compete.
These, and the regrets, are of forecasts of the next sample; a forecast across a gap of y is the density's: m, and its
variance, sum q_j v_j. There m is by precision, and by what came across gaps before (`across`). S of the last value and
of the line grows with the gap, as that of a random walk does.

In the prediction nobody is heard who claims a variance sixteen times the least: after a gap, or where nothing has
moved for long, members that forget fast know that they know little, and have won their weight on easier samples.

No variance falls below what the resolution of y, its smallest step so far, allows: step^2/12. Members whose weight is
below a hundredth of the best do not speak (Occam's window, Madigan and Raftery 1994), nor does one that claims to know
nothing: a hundred times the variance of y about its mean, or of its scale.
"""

import math
from typing import NamedTuple

import numpy as np

from ...engine.dispatch import kernel, pass_over
from ...engine.elementary import exp, log, square
from ...engine.layout import Field, Layout, each, numbers
from ...engine.normal import ROOT_2PI
from ...engine.status import BAD_VALUE, MISSING_OUTPUT
from .across import ACROSS, FAR, LENGTHS, UNTRIED, across_gap, follow_noise, judge_across, known, proven, within
from .blend import regret_of, trust, usual, weigh
from .variances import VARIANCES, disagreement, learn_variances, variances_of

NAIVE = ("last value", "straight line", "mean")
FAST = tuple(4.0**k for k in range(-2, 6))  # scales of the tails, in s
SLOW = (0.25, 1.0, 4.0, 16.0)  # in the long-run mean of e^2: what may come after a quiet time
SCALES = len(FAST) + len(SLOW)
# samples that each scale is worth beforehand: two the plain one, less the further from it; the larger ones so little
# that all of them together, unseen, add less than one sample of s to the variance
PRIOR = tuple(2.0 if kappa == 1.0 else 0.5 * min(kappa, 1.0 / (kappa * kappa)) for kappa in FAST) + (0.01,) * len(SLOW)
SEEN, LAST, BEFORE, STEP, MEAN, LONG, LONG_COUNT = range(7)  # of the head of a state
PREDICTION, INNOVATION, VARIANCE, STATUS = range(4)  # of a trace's row
SCORE, OFFSET, BASE, LEVEL, FLOOR, TOLD = range(4, 10)
PEAK, FAINTEST = 1.0 / ROOT_2PI, math.exp(-700.0)
VAGUE = 100.0  # times the variance of y about its mean: a member that claims more says nothing
UNSURE = 16.0  # times the least variance that anyone claims, over eta: in the prediction, who claims more is not heard
TINY, ABSURD = 1e-12, 1e60  # of y_scale^2 the least variance; of y_scale what no y can be
LONG_MEMORY, SETTLE = 1000.0, 60  # samples of the long-run mean, and those it leaves out at first
FARTHEST = 1e30  # of D, in y_scale^2
YOUNG, TENTH = 10.0, 0.1  # tails remember 10 samples and a tenth of the record, up to their full memory


class Averaging(NamedTuple):
    """The numbers of a model average; ``members`` without the naive forecasters, which follow them."""

    members: float
    forgetting: float  # phi, of the weights
    rate: float  # eta, what the evidence of a sample counts
    memory: float  # samples, of the noise variances
    tails: float  # samples, of the shape of the density
    share: float  # of the weights is given back to all alike, so that none is lost for ever
    window: float  # Occam's: a weight below this times the best is none
    settle: float  # measured samples before evidence counts
    unit: float  # y_scale^2


AVERAGE = Layout(
    *numbers(
        "head",
        seen="samples taken",
        last="last y",
        before="the one before",
        step="the smallest step of y so far",
        mean="mean of y",
        long="long-run mean of e^2",
        long_count="samples behind it",
    ),
    Field("tails", ("SCALES",), "q_j: samples that each scale of the tails is worth"),
    *each(
        "all",
        likely="each member, and each naive forecaster: weight by likelihood",
        evidence="log density that it gave to all outputs that count",
        squares="its squared errors",
        ratio="c: mean of e^2/S",
        behind="samples behind c",
    ),
    *each(
        "heard",
        regret="of the prediction, to each member, each naive forecaster and their mean by likelihood, in y_scale^2",
        regret_squares="the squares of what it is the sum of",
        regret_most="the largest of them of late",
    ),
    Field("silent", about="samples since y was there"),
    *each(
        "LENGTHS",
        "heard",
        across="of short gaps and of long ones: weight across them of each of these",
        across_ratio="c across gaps: mean of e^2 beside the variance claimed there",
        across_behind="gaps behind it",
    ),
    *each(
        "LENGTHS",
        "ACROSS",
        across_regret="of a forecast across a gap, to each of the three that it is made of, in y_scale^2",
        across_regret_squares="the squares of what it is the sum of",
        across_regret_most="the largest of them of late",
    ),
    *numbers("reach", lowest="y so far", highest="y so far"),
    *each(
        "VARIANCES",
        width="c: mean of what e^2 of the prediction is beside each variance that it may have",
        worth="how likely each of these is",
        gained="sum of e^2 beside it, since that was asked",
        volume="product of it beside the variance that was told, since then",
    ),
    given=("members",),
    SCALES=SCALES,
    VARIANCES=VARIANCES,
    ACROSS=len(ACROSS),
    LENGTHS=LENGTHS,
    all=f"members + {len(NAIVE)}",
    heard=f"members + {len(NAIVE) + 1}",
)
open_average = kernel(AVERAGE.open)
AVERAGE_SAMPLE = Layout(
    *each(
        prediction="y(t) given everything before t",
        innovation="y(t) less that; NaN where y is missing",
        variance="of the innovation",
        status="bits",
        log_score="log density given to y",
        offset="where the density is, less the prediction",
        base="s: variance of the mixture, before its tails",
        level="long-run mean of e^2",
        floor="least variance",
    ),
    Field("shares", ("SCALES",), "q_j of the density"),
    Field("weights", ("all",), "of each member, and of each naive forecaster"),
    given=("members",),
    SCALES=SCALES,
    all=f"members + {len(NAIVE)}",
)


def fresh(task: Averaging) -> np.ndarray:
    """Return the state before the first sample: equal weights, a density near the normal one."""
    state = np.zeros((), AVERAGE.dtype(int(task.members)))
    state["last"] = state["before"] = state["step"] = np.nan
    state["long"], state["ratio"], state["likely"] = task.unit, 1.0, 1.0 / state["likely"].size
    state["width"], state["worth"], state["volume"] = 1.0, 1.0 / VARIANCES, 1.0
    state["tails"] = PRIOR
    state["lowest"] = state["highest"] = np.nan
    state["across"], state["across"][:, -1], state["across_ratio"] = UNTRIED / state["likely"].size, 1.0, 1.0
    return state


@kernel
def scale_of(j, s, long, floor):
    """Return the variance v_j."""
    return max(FAST[j] * s if j < len(FAST) else SLOW[j - len(FAST)] * long, floor)


@kernel
def naive(row, i):
    """Return the forecast of naive member i, in the order of ``NAIVE``."""
    if i == 2 or row[SEEN] == 0.0:
        return row[MEAN]
    if i == 0 or not math.isfinite(row[BEFORE]):
        return row[LAST]
    return 2.0 * row[LAST] - row[BEFORE]


@kernel
def floor_of(task, row):
    """Return the least variance: that of a number rounded to the smallest step y has made so far."""
    step = row[STEP] if math.isfinite(row[STEP]) else 0.0
    return max(step * step / 12.0, TINY * task.unit)


@kernel
def claim(mu, S, ratio, claims):
    """Fill the variance that each claims; NaN of who makes no forecast, or none that is worth it.

    The last member forecasts the mean.
    """
    most = VAGUE * max(ratio[-1], 1.0) * S[-1]
    for i in range(mu.size):
        variance = ratio[i] * S[i]
        claims[i] = variance if math.isfinite(mu[i]) and 0.0 < variance <= most else math.nan


@kernel
def heard(mu, claims, w, weights, window):
    """Fill w, the weights by likelihood of those who speak; return the mean they make."""
    M, best = mu.size, 0.0
    for i in range(M):
        if claims[i] > 0.0:
            best = max(best, weights[i])
    total, mean, least = 0.0, 0.0, window * best
    for i in range(M):
        w[i] = weights[i] if claims[i] > 0.0 and weights[i] >= least else 0.0
        total += w[i]
    part = 1.0 / total
    for i in range(M):
        w[i] *= part
        if w[i] > 0.0:
            mean += w[i] * mu[i]
    return mean


@kernel
def trusted(means, claims, most_claimed, regret, squares, most, v, crowd):
    """Fill v, the trust in those who claim no more than that; return the mean they make."""
    mean = 0.0
    for k in range(means.size):
        v[k] = claims[k] if claims[k] <= most_claimed else math.nan
    trust(regret, squares, most, v, crowd)
    for k in range(means.size):
        if v[k] > 0.0:
            mean += v[k] * means[k]
    return mean


@kernel
def least_claim(claims, floor):
    """Return the least variance that anyone who speaks claims."""
    least = math.inf
    for i in range(claims.size):
        if claims[i] > 0.0:
            least = min(least, max(claims[i], floor))
    return least


@kernel
def base_of(mu, claims, w, mean, floor):
    """Return the base of the density, by those who speak."""
    base = 0.0
    for i in range(mu.size):
        if w[i] > 0.0:
            base += w[i] * (max(claims[i], floor) + square(mu[i] - mean))
    return max(base, floor)


@kernel
def judge(task, row, y, mu, S, weights, evidence, squares, ratio, behind, scores, floor):
    """Give each member the log density it had for y, let its noise variance follow, and forget."""
    is_silent = follow_noise(task, y, mu, S, ratio, behind, scores, floor)
    all_alike = usual(weights, scores) if is_silent else 0.0
    for i in range(mu.size):  # who said nothing neither wins nor loses
        score = scores[i] if math.isfinite(scores[i]) else all_alike
        if row[SEEN] >= task.settle:
            squares[i] += square(y - mu[i]) if math.isfinite(scores[i]) else 0.0
            evidence[i] += score if y != row[LAST] else 0.0  # a plant at rest tells nothing apart
        scores[i] = task.rate * score
    weigh(weights, scores, task.forgetting, task.share)


@kernel
def learn_tails(task, row, q, densities, e, base):
    """Share the sample out among the scales that may have made it, and follow the long-run mean of e^2."""
    fade = min(1.0 - 1.0 / task.tails, 1.0 - 1.0 / (YOUNG + TENTH * row[SEEN]))
    total = 0.0
    for j in range(SCALES):
        total += q[j] * densities[j]
    share = 1.0 / total
    for j in range(SCALES):
        part = q[j] * densities[j] * share
        q[j] = fade * q[j] + (1.0 - fade) * PRIOR[j] + part
    if row[SEEN] < SETTLE:
        row[LONG], row[LONG_COUNT] = base, 0.5 * SETTLE
    else:
        row[LONG_COUNT] = (1.0 - 1.0 / LONG_MEMORY) * row[LONG_COUNT] + 1.0
        row[LONG] += (e * e - row[LONG]) / (row[LONG_COUNT] + 1.0)


@kernel
def note(row, reach, y):
    """Keep what the naive forecasters, the resolution of y, and forecasts across gaps need."""
    reach[0] = y if not reach[0] <= y else reach[0]  # NaN at first
    reach[1] = y if not reach[1] >= y else reach[1]
    step = abs(y - row[LAST])
    if step > 0.0 and not row[STEP] <= step:  # NaN at first
        row[STEP] = step
    row[BEFORE], row[LAST] = row[LAST], y
    row[SEEN] += 1.0
    row[MEAN] += (y - row[MEAN]) / row[SEEN]


@kernel
def tell(row, q, y, prediction, mean, base, floor, densities, out):
    """Write the density, and what y has of it; fill that of y under each scale; return the density's variance."""
    weight, variance, p, e = 0.0, 0.0, 0.0, y - mean
    for j in range(SCALES):
        weight += q[j]
    whole, wider, sharpness, bell = 1.0 / weight, 0.0, 0.0, 0.0
    for i in range(SCALES):
        j = SCALES - 1 - i
        v, share = scale_of(j, base, row[LONG], floor), q[j] * whole
        is_quarter = 4.0 * v == wider
        sharpness = 2.0 * sharpness if is_quarter else 1.0 / math.sqrt(v)
        z = e * sharpness
        if is_quarter and j % 4 < 3:  # exp(-z^2/2) to the fourth: an exponential for four of them
            bell = max(square(square(bell)), FAINTEST)
        else:
            bell = exp(-0.5 * min(z * z, 1400.0))
        wider, densities[j], out[TOLD + j] = v, bell * (sharpness * PEAK), share
        variance += share * v
        p += share * densities[j]
    out[PREDICTION], out[INNOVATION] = prediction, y - prediction
    out[SCORE], out[OFFSET] = log(max(p, 1e-300)), mean - prediction
    out[BASE], out[LEVEL], out[FLOOR] = base, row[LONG], floor
    return variance


@pass_over.on(Averaging)
def pass_over_averaging(task, rows, q, kept, out, state):
    """Average over a record: y in ``rows``, the members' predictions in ``q``, their variances in ``kept``.

    ``q`` and ``kept`` have columns for the naive members, which are filled here.
    """
    M = q.shape[1]
    (
        row, tails, likely, evidence, squares, ratio, behind, regret, regrets, most, silent,
        across, across_ratio, across_behind, across_regret, across_regrets, across_most, reach,
        width, worth, gained, volume,
    ) = open_average(state, M - len(NAIVE))  # fmt: skip
    scratch = state[state.size - scratch_size(M) :]
    w, precise, rest = scratch[:M], scratch[M : 2 * M], scratch[2 * M :]
    K = M + 1
    scores, means, claims, v = rest[:K], rest[K : 2 * K], rest[2 * K : 3 * K], rest[3 * K : 4 * K]
    three, share, rest = rest[4 * K : 4 * K + 3], rest[4 * K + 3 : 4 * K + 6], rest[4 * K + 6 :]
    wide, densities, crowd = rest[:VARIANCES], rest[VARIANCES:], log(1.0 * K)
    for t in range(rows.shape[0]):
        y, mu, S, weights = rows[t, 0], q[t], kept[t], out[t, TOLD + SCALES :]
        is_next, g = silent[0] == 0.0, int(silent[0] >= FAR)
        for i in range(len(NAIVE)):
            mu[M - len(NAIVE) + i], S[M - len(NAIVE) + i] = naive(row, i), task.unit
            if i < len(NAIVE) - 1:  # a walk since the last output; how far y is from its mean does not grow
                S[M - len(NAIVE) + i] *= 1.0 + silent[0]
        floor = floor_of(task, row)
        claim(mu, S, ratio, claims)
        mean = heard(mu, claims[:M], w, likely, task.window)
        for i in range(M):
            precise[i] = w[i]
            means[i] = mu[i] if is_next else within(mu[i], reach)
        means[M] = mean if is_next else known(means[:M], claims, w, floor, precise)
        base = base_of(means[:M], claims, w, means[M], floor)
        if is_next:
            claims[M] = UNSURE / task.rate * least_claim(claims[:M], floor)
            prediction = trusted(means, claims, claims[M], regret, regrets, most, v, crowd)
        else:  # what errors of the next sample taught says little of a forecast across a gap
            claims[M] = base
            three[0], three[1], three[2] = (
                means[M],
                proven(means, claims, across[g], across_ratio[g], floor, v),
                naive(row, 0),
            )
            mean = prediction = across_gap(three, across_regret[g], across_regrets[g], across_most[g], share, v)
        for i in range(M):
            weights[i] = v[i] + v[M] * precise[i]
        is_absurd = abs(y) > ABSURD * math.sqrt(task.unit)
        variance = tell(row, tails, math.nan if is_absurd else y, prediction, mean, base, floor, densities, out[t])
        if is_next:
            apart = min(disagreement(mu[: M - len(NAIVE)], prediction, scores), FARTHEST * task.unit)
            variance = variances_of(base, row[LONG], apart, floor, width, worth, wide)
        out[t, VARIANCE] = variance
        out[t, STATUS] = BAD_VALUE if is_absurd else 0.0 if math.isfinite(y) else MISSING_OUTPUT
        if out[t, STATUS] != 0.0:
            out[t, SCORE] = math.nan
            silent[0] += 1.0
            continue
        silent[0] = 0.0
        if is_next and row[SEEN] >= task.settle:
            e = y - prediction
            learn_variances(row[SEEN], square(e), variance, wide, task.tails, width, worth, gained, volume, scores)
            regret_of(e, prediction, means, claims, task.unit, task.rate, regret, regrets, most)
        elif not is_next:
            regret_of(
                y - mean, mean, three, three, task.unit, task.rate, across_regret[g], across_regrets[g], across_most[g]
            )
            if y != row[LAST]:
                judge_across(task, y, means, claims, across[g], across_ratio[g], across_behind[g], scores, floor)
        judge(task, row, y, mu, S, likely, evidence, squares, ratio, behind, scores, floor)
        learn_tails(task, row, tails, densities, y - mean, base)
        note(row, reach, y)


@kernel
def scratch_size(M):
    """Return how many numbers behind a state one sample needs, of so many forecasts."""
    return 6 * M + 4 + 2 * len(ACROSS) + VARIANCES + SCALES
