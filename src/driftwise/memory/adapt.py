"""How an estimator of parameters takes a sample, counts it, forgets, and answers an alarm: one choice each, by memory.

P = U D U' is relative to s2 and belongs to the next sample, as in every state of the package.
"""

from ..engine.dispatch import choice, kernel
from ..engine.status import CAPPED, JUMP
from ..engine.ud import correct
from .drift import Constant, Matched, RandomWalk, widen_within


@choice
def adapt(memory, memory_state, e, R, s2, theta, U, D, scratch):
    """Take the innovation e of the row ``scratch.psi`` into theta and P (``scratch.f`` = U' psi); return T = psi' P psi
    + R.

    ``memory_state`` are the numbers the memory keeps, ``scratch`` has the scratch vectors b, c, f.
    """


@choice
def count(memory, memory_state, count, chi2, weight, gain):
    """Count the sample just learnt: return the new count and chi2 (of sigma^2) and the effective number of samples.

    ``gain`` is its e^2/T.
    """


@choice
def found_jump(memory, memory_state, detector_state):
    """Say whether the memory itself found, at the sample just learnt, that the parameters had jumped: 1, otherwise 0.

    ``detector_state`` are those of a detector: statistic over threshold, and at an alarm since when and which
    parameter.
    """


@choice
def time_update(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    """Forget, between two samples; return lambda, by which all sums over the past are to shrink, and status bits.

    ``weight`` is the effective number of samples taken in, ``surprise`` is e^2/(s2 T) of the last one (NaN where it
    taught nothing) and ``share`` its R/T.
    """


@choice
def on_alarm(memory, way, which, memory_state, weight, s2, U, D, scratch):
    """Answer an alarm of direction ``way`` about parameter ``which`` (-1: any); return the new weight, status bits."""


@choice
def outlier_probability(memory, memory_state):
    """Return the probability that the sample just learnt was an outlier: then it is no regressor to rely on."""


@choice
def begin(memory, memory_state, theta, U, D):
    """Write into ``memory_state`` what the memory starts with, before the first sample, from the prior."""


@choice
def mixture(memory, memory_state, R, s2, theta, scratch, out):
    """Write into ``out`` what a mixture's prediction is made of: weight, mean less the whole's, squared scale of each.

    ``scratch.psi`` is the row. Memories that are no mixtures have nothing to tell.
    """


# --- what most memories do: learn by least squares, count one more, leave alarms alone --------------------------


def plain(*kinds: type):
    """Give memories the usual answer to every choice but `time_update`, in which they differ."""
    adapt.on(*kinds)(by_least_squares)
    count.on(*kinds)(one_more)
    found_jump.on(*kinds)(nothing)
    on_alarm.on(*kinds)(unmoved)
    mixture.on(*kinds)(silent)
    begin.on(*kinds)(from_nothing)
    outlier_probability.on(*kinds)(trust)


@kernel
def by_least_squares(memory, memory_state, e, R, s2, theta, U, D, scratch):
    """Bierman's update of P, and theta by its gain."""
    T = correct(U, D, scratch.f, R, scratch.b)
    if T > 0.0:
        for i in range(D.size):
            theta[i] += scratch.b[i] * (e / T)
    return T


@kernel
def one_more(memory, memory_state, count, chi2, weight, gain):
    """Count one sample more."""
    return count + 1.0, chi2 + gain, weight + 1.0


@kernel
def nothing(memory, memory_state, detector_state):
    """Leave it to the detector."""
    return 0.0


@kernel
def unmoved(memory, way, which, memory_state, weight, s2, U, D, scratch):
    """Report the alarm, change nothing."""
    return weight, JUMP


@kernel
def trust(memory, memory_state):
    """Rely on every sample."""
    return 0.0


@kernel
def from_nothing(memory, memory_state, theta, U, D):
    """Start with zeros."""


@kernel
def silent(memory, memory_state, R, s2, theta, scratch, out):
    """Tell nothing."""


@kernel
def stay(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    """Forget nothing."""
    return 1.0, 0


plain(Constant, RandomWalk, Matched)
time_update.on(Constant)(stay)


@time_update.on(RandomWalk)
def time_update_random_walk(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    return 1.0, wander(memory, 1.0, U, D, scratch)


@time_update.on(Matched)
def time_update_matched(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    return 1.0, wander(memory, s2, U, D, scratch)


@kernel
def wander(memory, s2, U, D, scratch):
    """P <- P + diag(q)/s2, within its cap; return status bits."""
    status = 0
    for i in range(D.size):
        if not widen_within(U, D, i, memory.q[i] / s2, memory.cap[i], scratch.b):
            status = CAPPED
    return status
