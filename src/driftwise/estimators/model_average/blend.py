"""The mean of a model average: four ways to weigh the members, and how far each of these is trusted.

    weights      w_i <- (w_i exp(-eta (y - mu_i)^2/s))^phi         s: mean squared error of the mean that w makes
    regret       r_k = 2 (y - m)(m_k - m),  R_k = sum r_k,  Q_k = sum r_k^2; of members, eta (sum ..)
    trust        v_k ~ eta_k exp(eta_k R_k - eta_k^2 Q_k),  eta_k = min(1/(2 max |r_k|), sqrt(log K/Q_k))

Likelihood is right for a density, and wrong for a mean where noise has tails: who is sharp between outliers wins, and
is far off after each. By squared errors it is the other way round; but after a rest the first error is a thousand times
what was usual, and decides alone. The fourth mean is Bernstein's online aggregation (Wintenberger 2017, eq. 5) of the
members: squared errors count as they are, the largest no more than all others, and who earned trust where it mattered
keeps it, however long ago. By the same rule all four make the forecast: it is hardly worse than the best combination
of them, whatever y.
"""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import exp, log, square

BLENDS = 4  # by likelihood; by squared errors, remembered as long as likelihood is, and for ever; by regrets
LOG_BLENDS = math.log(BLENDS)
HASTE = (1.0, 0.0)  # of forgetting, beside that of likelihood
ETA = (0.2, 0.3)  # what a squared error counts
SPREAD = 200.0  # samples of the mean squared errors
MOST = 1e4  # that one squared error counts, in s
UNHEARD = -37.0  # log share, beside the largest, that no sum would show
LOST = -90.0  # log weight, beside the largest, that the share of all alike covers
WORST = 1e100  # regret, in y_scale^2: of who ran away
ROUNDED = 1e-12  # of a mean, by which it is no other: who earned no regret would be trusted for a last digit
NO_RATE = math.exp(-700.0)  # where nothing was ever to regret


@kernel
def rate_of(squares, most, crowd):
    """Return eta of one of so many; ``crowd`` is the logarithm of their number."""
    if most > 0.0:
        return 0.5 / most if squares < 4.0 * crowd * square(most) else math.sqrt(crowd / squares)
    return NO_RATE


@kernel
def trust(regret, squares, most, v, rates, crowd):
    """Fill v, the shares of all whose regrets these are; zero of who is NaN there, for he says nothing."""
    top, total = -math.inf, 0.0
    for k in range(v.size):
        if math.isfinite(v[k]):
            rates[k] = rate_of(squares[k], most[k], crowd)
            v[k] = rates[k] * (regret[k] - rates[k] * squares[k])
            top = max(top, v[k])
    for k in range(v.size):
        v[k] = rates[k] * raised(v[k] - top) if v[k] - top > UNHEARD else 0.0
        total += v[k]
    part = 1.0 / total
    for k in range(v.size):
        v[k] *= part


@kernel
def weigh_by_squares(k, phi, rate, share, y, mu, scores, weights, mean, spread, seen, floor):
    """Let the weights of one way follow the squared errors; who said nothing counts as all do on average."""
    sharpness, is_silent = 1.0 / max(spread[k], floor), False
    for i in range(mu.size):
        scores[i] = -rate * min(square(y - mu[i]) * sharpness, MOST) if math.isfinite(mu[i]) else math.nan
        is_silent = is_silent or not math.isfinite(mu[i])
    if is_silent:
        all_alike = usual(weights, scores)
        for i in range(mu.size):
            scores[i] = scores[i] if math.isfinite(scores[i]) else all_alike
    weigh(weights, scores, phi, share)
    spread[k] += (square(y - mean) - spread[k]) / (min(seen, SPREAD) + 1.0)


@kernel
def raised(x):
    """Return exp(x); of the best, whose x is zero, and of who is lost, at once."""
    if x < LOST:
        return 0.0
    return exp(x) if x != 0.0 else 1.0


@kernel
def usual(weights, scores):
    """Return the mean of the scores, by weight; of who has one."""
    mean, present = 0.0, 0.0
    for i in range(weights.size):
        if math.isfinite(scores[i]):
            mean += weights[i] * scores[i]
            present += weights[i]
    return mean / present


@kernel
def weigh(weights, scores, phi, share):
    """w <- (w exp score)^phi, over their sum, and of that a share to all alike; ``scores`` is scratch.

    None is below that share over their number, so that no logarithm is of zero, and the sum is none where phi is 1:
    who scored best weighs what he did.
    """
    best, total, least = -math.inf, 0.0, share / weights.size
    for i in range(weights.size):
        scores[i] += log(weights[i]) if phi < 1.0 else 0.0
        best = max(best, scores[i])
    for i in range(weights.size):
        scores[i] = raised(phi * (scores[i] - best)) * (1.0 if phi < 1.0 else weights[i])
        total += scores[i]
    part = (1.0 - share) / total
    for i in range(weights.size):
        weights[i] = part * scores[i] + least


@kernel
def regret_of(e, mean, means, said, unit, counts, regret, squares, most):
    """Learn from an error e of the mean, which counts so much, who was better, of all that are finite in ``said``."""
    whole = 2.0 * (e / unit)
    for k in range(means.size):
        if math.isfinite(said[k]):
            apart = means[k] - mean
            r = min(max(whole * apart, -WORST), WORST) if abs(apart) > ROUNDED * abs(mean) else 0.0
            regret[k] += counts * r
            squares[k] += counts * r * r
            most[k] = max(most[k], abs(r))
