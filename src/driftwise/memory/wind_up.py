"""No wind-up: a variance that forgetting has blown up is brought back to what the data once knew."""

import numpy as np

from ..engine.dispatch import kernel
from ..engine.elementary import exp, log
from ..engine.status import CAPPED
from ..engine.ud import correct, entry, variance, variances

MEMORIES = 100.0  # "typical" is an average over so many memories
E = 2.718281828459046  # the logarithm of more is above 1


@kernel
def hold_within(U, D, cap, p, f, b):
    """Bring the last ``cap.size`` variances down to their caps; say whether any was above. p, f, b are scratch."""
    is_held, first = False, max(D.size - cap.size, 0)
    variances(U, D, p)
    for i in range(D.size - first):
        if p[first + i] > cap[i]:
            is_held |= hold_one(U, D, first + i, cap[i], f, b)
    return is_held


@kernel
def hold_one(U, D, i, cap, f, b):
    """Let element i be "observed" without news, just well enough; what the data teach stays untouched."""
    v = variance(U, D, i)
    if not v > cap > 0.0:
        return False
    for j in range(D.size):
        f[j] = entry(U, i, j) if j >= i else 0.0
    correct(U, D, f, v * cap / (v - cap), b)
    return True


def precisions(cap: np.ndarray) -> np.ndarray:
    """Return one over each prior variance, as `shrink` wants it: a product takes less time than a quotient."""
    with np.errstate(divide="ignore"):
        return 1.0 / cap


@kernel
def shrink(lam, horizon, precision, state, view):
    """P <- P / lambda, each variance held at that of one typical sample and at the prior's; return status bits.

    That is the P of the parameters; a state before them stays what it is, given them.

    weight P_ii is the variance that a single sample of the past leaves. ``state`` holds how many entered, and the mean
    of its logarithm (relative to the prior's) over the last ``horizon`` samples, which a burst moves little. While a
    variance is held its ceiling rises, e-fold in ``horizon`` samples: weaker excitation is accepted in the end.
    """
    U, D, weight, p, first, status = view.U, view.D, view.weight, view.c, view.first, 0
    variances(U, D, p)
    state[0] = min(state[0] + 1.0, horizon)
    kept, grown, share = weight * lam, 1.0 / lam, 1.0 / state[0]
    for j in range(first, D.size):
        D[j] *= grown
    for i in range(D.size - first):
        if p[first + i] > 0.0:
            one = log(weight * (p[first + i] * precision[i]))
            most = min(state[1 + i], 0.0) if state[0] > 1.0 else 0.0
            if (one <= most + 1.0 and kept > E) or one - log(kept) <= most:
                state[1 + i] += (one - state[1 + i]) * share
            elif hold_one(U, D, first + i, exp(most) / precision[i], view.f, view.b):
                state[1 + i] = min(most + 1.0 / horizon, 0.0)
                status = CAPPED
    return status
