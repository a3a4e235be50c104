"""The mean of a model average: how far each of those is trusted that say what comes next, by their regrets.

    regret       r_k = 2 (y - m)(m_k - m),  R_k = eta sum r_k,  Q_k = eta sum r_k^2,  E_k = max(|r_k|, fade E_k)
    trust        v_k ~ exp(eta_k R_k - eta_k^2 Q_k),  eta_k = min(1/(2 E_k), sqrt(log K/Q_k))

Those are the members, and the mean that likelihood makes of them, which is right for a density, and wrong for a mean
where noise has tails: who is sharp between outliers wins, and is far off after each. By squared errors beside those of
late it is the other way round; but after a rest the first error is a thousand times what was usual, and decides alone.
This is Bernstein's online aggregation (Wintenberger 2017, eq. 5): squared errors count as they are, the largest no more
than all others, and who earned trust where it mattered keeps it, however long ago. Two things differ. There the rate
is a factor of v_k as well; but who makes the forecast alone has nothing to regret and so the largest rate, and would
make it alone after its first error too. And the largest regret is forgotten, over a thousand samples: a flood of long
ago would be the measure of all that followed.
"""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import exp, log, square

FADE = 0.999  # of the largest regret, a sample
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
def trust(regret, squares, most, v, crowd):
    """Fill v, the shares of all whose regrets these are; zero of who is NaN there, for he says nothing."""
    top, total = -math.inf, 0.0
    for k in range(v.size):
        if math.isfinite(v[k]):
            rate = rate_of(squares[k], most[k], crowd)
            v[k] = rate * (regret[k] - rate * squares[k])
            top = max(top, v[k])
    for k in range(v.size):
        v[k] = raised(v[k] - top) if v[k] - top > UNHEARD else 0.0
        total += v[k]
    part = 1.0 / total
    for k in range(v.size):
        v[k] *= part


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
            most[k] = max(FADE * most[k], abs(r))
