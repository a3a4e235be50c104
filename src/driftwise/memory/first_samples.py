"""What the first samples taught counts less, where a state has a past of its own.

There the slopes of a prediction are those of a state that wrong parameters have made. Along them a filter learns what
no data have said, a common pole and zero for one, and is sure of it before parameters are right. So it forgets a little
at first, as recursive prediction error methods do: lambda = 1 - RASH e^(-t/RASH_SAMPLES), in all a factor e^3 for the
first sample and 1.2 for the 280th. Source: Ljung and Soderstrom (1983), "Theory and practice of recursive
identification", section 5.6, lambda(t) = .99 lambda(t - 1) + .01.
"""

from ..engine.dispatch import kernel, rare
from ..engine.elementary import exp
from .auto_constants import RASH, RASH_SAMPLES, UNSETTLED
from .auto_state import MODES
from .modes import mode
from .trial_state import COPIES
from .unknown_drift import SEEN, UNEXCITED


@kernel
def is_unsettled(drift, view):
    """Say whether the sample just taken in may have taught too much: not at rest, nor in a gap, which would add up."""
    return view.first > 0 and view.surprise >= 0.0 and drift.head[SEEN] < UNSETTLED and drift.head[UNEXCITED] == 0.0


@rare
def forget_a_little(parts, view, waits):
    """P <- P/lambda of every filter, and of what is shown; ``waits``: that of the filters stands in ``dense``."""
    own, trial, learner, N = parts.own, parts.trial, parts.learner, view.D.size - view.first
    lam = 1.0 - RASH * exp(-parts.drift.head[SEEN] / RASH_SAMPLES)
    if waits:
        for i in range(own.dense.size):
            own.dense[i] /= lam
        for i in range(trial.dense.size):
            trial.dense[i] /= lam
    else:
        for m in range(MODES):
            one = mode(own.bank, m, N)
            for i in range(N):
                one.D[i] /= lam
        for k in range(COPIES):
            one = mode(trial.copies, k, N)
            for i in range(N):
                one.D[i] /= lam
    for i in range(learner.dP.size):
        learner.dP[i] /= lam
    for i in range(N):
        view.D[view.first + i] /= lam
