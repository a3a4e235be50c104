"""The mean of a model average: four ways to weigh the members, and how far each of these is trusted.

    weights      log w_i <- phi log w_i - eta (y - mu_i)^2/s       s: mean squared error of the mean that w makes
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
WORST = 1e100  # regret, in y_scale^2: of who ran away
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
def weigh_by_squares(k, phi, rate, share, y, mu, w, logs, mean, spread, seen, floor):
    """Let the weights of one way follow the squared errors; who said nothing counts as all do on average."""
    sharpness, is_silent = 1.0 / max(spread[k], floor), False
    for i in range(logs.size):
        w[i] = -rate * min(square(y - mu[i]) * sharpness, MOST) if math.isfinite(mu[i]) else math.nan
        is_silent = is_silent or not math.isfinite(mu[i])
    all_alike = usual(logs, w) if is_silent else 0.0
    for i in range(logs.size):
        logs[i] += w[i] if math.isfinite(w[i]) else all_alike
    faded(logs, w, phi, share)
    spread[k] += (square(y - mean) - spread[k]) / (min(seen, SPREAD) + 1.0)


@kernel
def raised(x):
    """Return exp(x); of the best, whose x is zero, at once."""
    return exp(x) if x != 0.0 else 1.0


@kernel
def usual(logs, scores):
    """Return the mean of the scores, by weight; of who has one."""
    mean, present = 0.0, 0.0
    for i in range(logs.size):
        if math.isfinite(scores[i]):
            weight = exp(logs[i])
            mean += weight * scores[i]
            present += weight
    return mean / present


@kernel
def faded(logs, w, phi, share):
    """Let the evidence in log weights fade and give a share of the weights to all alike; ``w`` is scratch."""
    M, best, total = logs.size, -math.inf, 0.0
    for i in range(M):
        best = max(best, logs[i])
    for i in range(M):
        logs[i] = phi * (logs[i] - best)
        w[i] = raised(logs[i])
        total += w[i]
    part = (1.0 - share) / total
    for i in range(M):
        logs[i] = log(part * w[i] + share / M)


@kernel
def regret_of(e, mean, means, said, unit, counts, regret, squares, most):
    """Learn from an error e of the mean, which counts so much, who was better, of all that are finite in ``said``."""
    whole = 2.0 * (e / unit)
    for k in range(means.size):
        if math.isfinite(said[k]):
            r = min(max(whole * (means[k] - mean), -WORST), WORST)
            regret[k] += counts * r
            squares[k] += counts * r * r
            most[k] = max(most[k], abs(r))
