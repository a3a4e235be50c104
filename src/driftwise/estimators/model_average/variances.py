"""How far a prediction errs: variances that it may have compete, and the likelier ones of late are heard more.

Each is c_k times a base and a share of the members' disagreement, c_k so that the squared errors are of its size.
"""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import log, square
from ...engine.order import smallest
from .blend import weigh

DOUBT = (1e-4, 0.003, 0.3, 0.03)  # d_k: what members' disagreement counts; the last is beside the long-run mean of e^2
HASTY = (2.0, 2.0, 2.0, 1.0)  # m_k, over that of the tails
VARIANCES = len(DOUBT)
MOST_WIDTH, LEAST_WIDTH = 1000.0, 0.02  # most that one e^2/v counts; the least c
WORTH, LEAST_WORTH = 0.05, 1e-30  # r; of all together, so that none is lost for ever
PATIENCE = 4  # samples after which it is asked who is likelier
LEAST_SHARE = 1e-60  # of one v beside the variance told


@kernel
def disagreement(mu, prediction, far):
    """Return the upper quartile of the squared distances of members from the prediction, the lower one of two."""
    n = 0
    for i in range(mu.size):
        far[n] = square(mu[i] - prediction)
        n += 1 if math.isfinite(far[n]) else 0
    return smallest(far, n, 3 * (n - 1) // 4) if n > 0 else 0.0


@kernel
def variances_of(base, long, far, floor, width, worth, v):
    """Fill v, the variances that the prediction may have beside members that are so far from it; return their mean."""
    mean = 0.0
    for k in range(VARIANCES):
        v[k] = width[k] * max((long if k == VARIANCES - 1 else base) + DOUBT[k] * far, floor)
        mean += worth[k] * v[k]
    return mean


@kernel
def learn_variances(seen, e2, variance, v, tails, width, worth, gained, volume, scores):
    """Let each follow the squared errors; every so many samples, the likelier ones win."""
    per_variance, gain = 1.0 / variance, 1.0 / tails
    for k in range(VARIANCES):
        z2 = min(e2 / v[k], MOST_WIDTH)
        gained[k] += z2
        volume[k] *= max(v[k] * per_variance, LEAST_SHARE)
        width[k] = max(width[k] * (1.0 + HASTY[k] * gain * (z2 - 1.0)), LEAST_WIDTH)
    if int(seen) % PATIENCE == 0:
        for k in range(VARIANCES):
            scores[k] = -WORTH * (gained[k] + log(volume[k]))
            gained[k], volume[k] = 0.0, 1.0
        weigh(worth, scores, 1.0, LEAST_WORTH)
