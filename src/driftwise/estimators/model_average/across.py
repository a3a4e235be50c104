"""The mean of a model average across a gap of y, where what errors of the next sample taught says little.

    mu_i         what member i says, no further beyond the range of y so far than that is wide
    precise      sum w_i mu_i/S_i, over the same without mu_i: w by likelihood, S the variance that each claims there
    proven       sum a_k m_k/(c_k S_k), over the same without m_k, of all members and the precise mean
    a_k, c_k     by Student's likelihood, and running mean of e^2/S_k: of forecasts across gaps alone
    prediction   of these two and the last value, by the regrets that came across gaps (`blend`)

Who forgets fast has won his weight without a gap, and knows nothing of sixty steps; he says so himself. What nobody
says shows when y is back: one run ended where the next does not begin, a logger slept while a valve was shut. So at
first the precise mean is all, and each gap teaches: likelihood who is right as a rule, regrets who it is where it
matters, for after a rest one error is all errors. Evidence fades three times as fast as that of the next sample, for
gaps differ; where y has not moved there is none. Short gaps and long ones teach apart: a sample that a logger leaves
out here and there says nothing of the break between two runs, and what breaks taught would be forgotten meanwhile.
The last value is among the three so that no record is forecast much worse than by it.
"""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import log, square
from .blend import trust, usual, weigh

ACROSS = ("precise", "proven", "last value")
LENGTHS, FAR = 2, 5.0  # of gaps, each of which teaches its own; samples without y from which one is long
CROWD = math.log(1.0 * len(ACROSS))
RARELY = 0.02  # share beforehand of the last value, that of the others is equal
UNTRIED = 0.01  # of the weight have all members together until y is back the first time
FREEDOM, WILD = 6.0, 25.0  # degrees of freedom by which members are judged; most that one e^2/S counts


@kernel
def within(mu, reach):
    """Return a forecast, no further beyond all that y has been so far than from its least to its largest."""
    span = reach[1] - reach[0]
    if mu > reach[1] + span:
        return reach[1] + span
    return reach[0] - span if mu < reach[0] - span else mu


@kernel
def shared(mu, v, total):
    """Divide v by its total, so that it is shares; return the mean they make."""
    part, mean = 1.0 / total, 0.0
    for i in range(mu.size):
        v[i] *= part
        if v[i] > 0.0:
            mean += v[i] * mu[i]
    return mean


@kernel
def known(mu, claims, w, floor, v):
    """Fill v, the shares of those who speak by the precision that they claim as well; return the mean they make."""
    total = 0.0
    for i in range(mu.size):
        v[i] = w[i] / max(claims[i], floor) if w[i] > 0.0 else 0.0
        total += v[i]
    return shared(mu, v, total)


@kernel
def proven(means, claims, weights, ratio, floor, v):
    """Fill v, the shares by what came across gaps before and by precision; return the mean they make."""
    total = 0.0
    for k in range(means.size):
        v[k] = weights[k] / max(ratio[k] * claims[k], floor) if claims[k] > 0.0 else 0.0
        total += v[k]
    return shared(means, v, total)


@kernel
def across_gap(three, regret, squares, most, share, v):
    """Return the mean of the three by their regrets; make v, shares of who is proven, those of all in this mean."""
    last, mean, precise = v.size - 4, 0.0, v.size - 1  # behind the members three that are naive, and the precise mean
    for k in range(three.size):
        share[k] = three[k]
    trust(regret, squares, most, share, CROWD)
    share[2] *= 2.0 * RARELY / (1.0 - RARELY)
    part = 1.0 / (share[0] + share[1] + share[2])
    for k in range(three.size):
        share[k] *= part
        mean += share[k] * three[k]
    for k in range(v.size):
        v[k] *= share[1]
    v[precise] += share[0]
    v[last] += share[2]
    return mean


@kernel
def log_of_both(v, far):
    """Return log(v far^7), which is twice what Student's density of 6 degrees is below its largest in log."""
    whole = v * square(far * square(far)) * far
    return log(whole) if whole < 1e300 else log(v) + (FREEDOM + 1.0) * log(far)


@kernel
def follow_noise(task, y, mu, S, ratio, behind, scores, floor):
    """Fill the log density that each had for y, NaN of who said nothing; let its noise follow; say whether any did."""
    is_silent, fade, per_unit = False, 1.0 - 1.0 / task.memory, 1.0 / task.unit
    for i in range(mu.size):
        scores[i] = math.nan
        if not (math.isfinite(mu[i]) and S[i] > 0.0):
            is_silent = True
            continue
        v = max(ratio[i] * S[i], floor)
        z2 = square(y - mu[i]) * (1.0 / v)
        scores[i] = -0.5 * log_of_both(v * per_unit, 1.0 + z2 * (1.0 / FREEDOM))
        behind[i] = fade * behind[i] + 1.0
        gain = 1.0 / (behind[i] + 1.0)
        ratio[i] *= 1.0 - gain + gain * min(z2, WILD)
        if ratio[i] * S[i] < floor:
            ratio[i] = floor / S[i]
    return is_silent


@kernel
def judge_across(task, y, means, claims, weights, ratio, behind, scores, floor):
    """Learn who was right across the gap that ended with y, and by how much each was wrong there."""
    is_silent = follow_noise(task, y, means, claims, ratio, behind, scores, floor)
    all_alike = usual(weights, scores) if is_silent else 0.0
    for k in range(means.size):  # who said nothing neither wins nor loses
        scores[k] = task.rate * (scores[k] if math.isfinite(scores[k]) else all_alike)
    weigh(weights, scores, task.forgetting * square(task.forgetting), task.share)
