"""How an estimator of parameters takes a sample, counts it, forgets, and answers an alarm: one choice each, by memory.

P = U D U' is relative to s2 and belongs to the next sample, as in every state of the package.
"""

from ..engine.dispatch import choice, kernel
from ..engine.status import CAPPED, JUMP
from ..engine.ud import correct
from .drift import Constant, Matched, RandomWalk, widen_within


@choice
def learn(memory, cells, e, R, s2, theta, U, D, work):
    """Take the innovation e of the row ``work.psi`` into theta and P (``work.f`` = U' psi); return T = psi' P psi + R.

    ``cells`` are the numbers the memory keeps, ``work`` has the scratch vectors b, c, f.
    """


@choice
def reckon(memory, cells, count, chi2, weight, gain):
    """Count the sample just learnt: return the new count and chi2 (of sigma^2) and the effective number of samples.

    ``gain`` is its e^2/T.
    """


@choice
def notice(memory, cells, marks):
    """Say whether the memory itself found, at the sample just learnt, that the parameters had jumped: 1, otherwise 0.

    ``marks`` are those of a detector: statistic over threshold, and at an alarm since when and which parameter.
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


@choice
def distrust(memory, cells):
    """Return the probability that the sample just learnt was an outlier: then it is no regressor to rely on."""


@choice
def begin(memory, cells, theta, U, D):
    """Write into ``cells`` what the memory starts with, before the first sample, from the prior."""


@choice
def tell(memory, cells, R, s2, theta, work, out):
    """Write into ``out`` what a mixture's prediction is made of: weight, mean less the whole's, squared scale of each.

    ``work.psi`` is the row. Memories that are no mixtures have nothing to tell.
    """


# --- what most memories do: learn by least squares, count one more, leave alarms alone --------------------------


def plain(*kinds: type):
    """Give memories the usual answer to every choice but `age`, in which they differ."""
    learn.on(*kinds)(by_least_squares)
    reckon.on(*kinds)(one_more)
    notice.on(*kinds)(nothing)
    respond.on(*kinds)(unmoved)
    tell.on(*kinds)(silent)
    begin.on(*kinds)(from_nothing)
    distrust.on(*kinds)(trust)


@kernel
def by_least_squares(memory, cells, e, R, s2, theta, U, D, work):
    """Bierman's update of P, and theta by its gain."""
    T = correct(U, D, work.f, R, work.b)
    if T > 0.0:
        for i in range(D.size):
            theta[i] += work.b[i] * (e / T)
    return T


@kernel
def one_more(memory, cells, count, chi2, weight, gain):
    """Count one sample more."""
    return count + 1.0, chi2 + gain, weight + 1.0


@kernel
def nothing(memory, cells, marks):
    """Leave it to the detector."""
    return 0.0


@kernel
def unmoved(memory, way, which, cells, weight, s2, U, D, work):
    """Report the alarm, change nothing."""
    return weight, JUMP


@kernel
def trust(memory, cells):
    """Rely on every sample."""
    return 0.0


@kernel
def from_nothing(memory, cells, theta, U, D):
    """Start with zeros."""


@kernel
def silent(memory, cells, R, s2, theta, work, out):
    """Tell nothing."""


@kernel
def stay(memory, cells, weight, surprise, share, s2, theta, U, D, work):
    """Forget nothing."""
    return 1.0, 0


plain(Constant, RandomWalk, Matched)
age.on(Constant)(stay)


@age.on(RandomWalk)
def _(memory, cells, weight, surprise, share, s2, theta, U, D, work):
    return 1.0, wander(memory, 1.0, U, D, work)


@age.on(Matched)
def _(memory, cells, weight, surprise, share, s2, theta, U, D, work):
    return 1.0, wander(memory, s2, U, D, work)


@kernel
def wander(memory, s2, U, D, work):
    """P <- P + diag(q)/s2, within its cap; return status bits."""
    status = 0
    for i in range(D.size):
        if not widen_within(U, D, i, memory.q[i] / s2, memory.cap[i], work.b):
            status = CAPPED
    return status
