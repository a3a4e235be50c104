"""Does the plant of an `AutoMemory` rest? Then it teaches nothing about speeds and noise.

It does where its regressors are far smaller than they were, or where its output has never moved. Without inputs they
also are where the noise is quieter, and then say as much of the parameters as before: a row brings psi psi'/r, r the
variance of the noise. So whether such a plant rests is asked in units of the noise that there is lately, over that
which there was when its regressors had their size. The first is told by the mean logarithm of squared errors, which
hardly minds wrong numbers. Where inputs rest the plant does, however quiet its noise: that may rest as well. And a
plant without any whose noise all but ends is switched off.
"""

from ..engine.dispatch import kernel
from ..engine.elementary import exp, log
from ..engine.layout import numbers
from .auto_constants import KEPT, OF_SQUARES, SILENCE
from .trial_state import AGE
from .unknown_drift import SEEN, SLOWEST, UNEXCITED, WAKING, WILD

LATELY, USUALLY, HEARD_BOTH = range(3)  # of what is kept, and how many
LOUDNESS = numbers(
    "loudness",
    lately="mean of log e^2/T over the last samples",
    usually="mean of e^2/T over those that the mean squares of the regressors are of; 0: none yet",
)


@kernel
def noise_left(loudness, head, square):
    """Take a squared innovation in; return how much of the usual variance of the noise there is lately, 1 at most.

    Of a plant that is switched off all of it: that is how loud it was.
    """
    if loudness[USUALLY] == 0.0:
        loudness[LATELY], loudness[USUALLY] = log(square), square
    loudness[LATELY] += max(1.0 / (head[SEEN] + 1.0), 1.0 - KEPT) * (log(square) - loudness[LATELY])
    left = exp(loudness[LATELY] + OF_SQUARES) / loudness[USUALLY]
    return min(left, 1.0) if left > SILENCE else 1.0


@kernel
def get_used(loudness, head, square):
    """Take a squared innovation into what is usual, as fast as its row is into the mean squares of the regressors."""
    gain = SLOWEST * WAKING if head[UNEXCITED] > 0.0 else max(1.0 / head[SEEN], SLOWEST)
    loudness[USUALLY] += gain * (min(square, WILD * loudness[USUALLY]) - loudness[USUALLY])


@kernel
def is_awake(memory, drift, trial, is_surprise):
    """Say whether a sample of a plant at rest counts as any other, and let it.

    A constant acts at rest as ever: where one is estimated a surprise is one, and the trial that it begins goes on.
    """
    if memory.moving == drift.ms.size or (trial.head[AGE] == 0.0 and not is_surprise):
        return False
    drift.head[UNEXCITED] = 0.0
    drift.head[SEEN] += 1.0
    return True
