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
from .additive import as_expected
from .auto_constants import KEPT, OF_SQUARES, SILENCE, SMALLEST, SURPRISE
from .resolution import follow_resolution
from .trial_state import AGE
from .unknown_drift import SEEN, UNEXCITED, WILD, excite_by_noise, gain_of, rest

LATELY, USUALLY, HEARD_BOTH = range(3)  # of what is kept, and how many
LOUDNESS = numbers(
    "loudness",
    lately="mean of log e^2/T over the last samples",
    usually="mean of e^2/T over those that the mean squares of the regressors are of; 0: none yet",
)


@kernel
def is_driven_by_noise(memory):
    """Say whether all regressors that move are past outputs."""
    return memory.past > 0.0 and memory.past == memory.moving


@kernel
def noise_left(memory, loudness, drift, e, T, s2):
    """Take an innovation in; return how much of the usual variance of the noise there is lately, 1 at most.

    Inputs, or a plant that is switched off: then that is no question, and it is 1.
    """
    if not is_driven_by_noise(memory):
        return 1.0
    square = max(e * e / T, SMALLEST * s2)
    if loudness[USUALLY] == 0.0:
        loudness[LATELY], loudness[USUALLY] = log(square), square
    gain = max(1.0 / (drift.head[SEEN] + 1.0), 1.0 - KEPT)
    loudness[LATELY] += gain * (log(square) - loudness[LATELY])
    left = exp(loudness[LATELY] + OF_SQUARES) / loudness[USUALLY]
    return min(left, 1.0) if left > SILENCE else 1.0


@kernel
def get_used(memory, loudness, drift, e, T):
    """Take an innovation into what is usual, as fast as its row is into the mean squares of the regressors."""
    if is_driven_by_noise(memory):
        square = min(e * e / T, WILD * loudness[USUALLY])
        loudness[USUALLY] += gain_of(drift) * (square - loudness[USUALLY])


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


@kernel
def rests(memory, parts, view, e, R, T):
    """Take the row into the mean squares of the regressors; say whether the plant is at rest."""
    drift, s2 = parts.drift, view.s2
    is_first = drift.head[SEEN] == 0.0
    are_known = view.has_past > 0.0 or R <= memory.R  # beside a state with a past of its own R always is more
    left = noise_left(memory, parts.loudness, drift, e, T, s2)
    row = as_expected(memory, parts.past, view.row, view.c)
    is_unexcited = excite_by_noise(memory, drift, row, are_known, left)
    get_used(memory, parts.loudness, drift, e, T)
    if is_unexcited and is_awake(memory, drift, parts.trial, e * e > SURPRISE * s2 * T):
        is_unexcited = False
    if follow_resolution(parts.resolution, view.y, is_first) and not is_unexcited:
        is_unexcited = rest(drift)
    return is_unexcited
