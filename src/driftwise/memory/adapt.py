"""How an estimator of parameters takes a sample, forgets, and answers an alarm: one choice each, by memory.

P = U D U' is relative to s2 and belongs to the next sample, as in every state of the package.
"""

from typing import NamedTuple

from ..kernel.compose import Vector, choice, kernel
from ..kernel.status import CAPPED, JUMP
from ..kernel.ud import correct, entry, variance, variances
from .drift import Never, Walk, widen_within


class LimitedGain(NamedTuple):
    """The gain falls like 1/n and stops at 1/``samples``: then the past fades with that many samples of memory.

    Source: Perriot-Mathonna (1981), eq. 6. ``cap`` is filled in from the prior: without excitation the covariance
    stays bounded. Bad at: both ends, as every constant gain is (slow after a jump, restless without one).
    """

    samples: float
    cap: Vector = ()


class Weighted(NamedTuple):
    """A sample of age k counts ``p`` to the power k: exponential forgetting, gain (1 - p)/(1 - p^n).

    Source: Perriot-Mathonna (1981), eqs. 7-9; the memory is 1/(1 - p) samples. ``cap`` is filled in from the prior.
    Bad at: directions that stay unexcited; they are forgotten until their variance is the prior's again.
    """

    p: float
    cap: Vector = ()


class Fade(NamedTuple):
    """What the kernel sees of `LimitedGain` and `Weighted`: lambda = max(least, 1 - 1/weight) where that is below 1."""

    p: float
    samples: float
    cap: Vector


@kernel
def hold_within(U, D, cap, p, f, b):
    """Bring every variance down to its cap and say whether any was above it.

    Such an element is "observed" without news, just well enough; what the data teach stays untouched.
    """
    is_held = False
    variances(U, D, p)
    for i in range(D.size):
        if p[i] > cap[i]:
            v = variance(U, D, i)
            if v > cap[i] and cap[i] > 0.0:
                for j in range(D.size):
                    f[j] = entry(U, i, j) if j >= i else 0.0
                correct(U, D, f, v * cap[i] / (v - cap[i]), b)
                is_held = True
    return is_held


@kernel
def fade(U, D, lam, cap, work):
    """P <- P / lambda, within its cap; return status bits."""
    for j in range(D.size):
        D[j] /= lam
    return CAPPED if hold_within(U, D, cap, work.c, work.f, work.b) else 0


# --- the three choices -------------------------------------------------------------------------------------


@choice
def learn(memory, cells, e, R, s2, theta, U, D, work):
    """Take the innovation e of the row ``work.psi`` into theta and P (``work.f`` = U' psi); return T = psi' P psi + R.

    ``cells`` are the numbers the memory keeps, ``work`` has the scratch vectors b, c, f.
    """


@choice
def age(memory, cells, weight, surprise, share, s2, theta, U, D, work):
    """Forget, between two samples; return lambda, by which all sums over the past are to shrink, and status bits.

    ``weight`` is the effective number of samples taken in, ``surprise`` is e^2/(s2 T) of the last one (NaN where it
    taught nothing) and ``share`` its R/T.
    """


@choice
def respond(memory, way, which, cells, weight, s2, U, D, work):
    """Answer an alarm of direction ``way`` about parameter ``which`` (-1: any); return the new weight, status bits."""


@learn.on(Never, Walk, Fade)
def _(memory, cells, e, R, s2, theta, U, D, work):
    T = correct(U, D, work.f, R, work.b)
    if T > 0.0:
        for i in range(D.size):
            theta[i] += work.b[i] * (e / T)
    return T


@age.on(Never)
def _(memory, cells, weight, surprise, share, s2, theta, U, D, work):
    return 1.0, 0


@age.on(Walk)
def _(memory, cells, weight, surprise, share, s2, theta, U, D, work):
    status = 0
    for i in range(D.size):
        if not widen_within(U, D, i, memory.q[i], memory.cap[i], work.b):
            status = CAPPED
    return 1.0, status


@age.on(Fade)
def _(memory, cells, weight, surprise, share, s2, theta, U, D, work):
    lam = memory.p
    if weight > 0.0:
        lam = min(lam, (memory.samples - 1.0) / weight)
    if not (surprise >= 0.0 and lam < 1.0):
        return 1.0, 0
    return lam, fade(U, D, lam, memory.cap, work)


@respond.on(Never, Walk, Fade)
def _(memory, way, which, cells, weight, s2, U, D, work):
    return weight, JUMP
