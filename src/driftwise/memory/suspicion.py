"""Is a trial worth its cost? Two sums over the last sixteen innovations say so.

While nothing has happened innovations are white. A parameter off by d makes them psi_i d on average, so that
(sum psi_i e/T)^2 over sum psi_i^2/T is large; another level of the noise makes their squares large, or small. What is
suspected need not be so: the trial decides.
"""

import math

from ..engine.dispatch import kernel
from ..engine.layout import Layout, each, numbers
from .auto_constants import CLIP, KEPT, SUSPECT_JUMP, SUSPECT_LOUD, SUSPECT_QUIET

SUSPICION = Layout(
    *each("N", score="sum of psi_i e/T", known="sum of psi_i^2/T"),
    *numbers("energy", energy="sum of e^2/(s2 T) - 1"),
    given=("N",),
)
open_suspicion, suspicion_size = kernel(SUSPICION.open), kernel(SUSPICION.size)


@kernel
def suspect(sums, psi, e, T, s2):
    """Take an innovation into the sums, CLIP deviations of it at most; say whether they are suspicious."""
    inverse, is_suspicious, energy = 1.0 / math.sqrt(T), False, sums.energy
    z = min(max(e * inverse / math.sqrt(s2), -CLIP), CLIP)
    for i in range(psi.size):
        x = psi[i] * inverse
        sums.score[i] = KEPT * sums.score[i] + x * z
        sums.known[i] = KEPT * sums.known[i] + x * x
        if sums.score[i] * sums.score[i] > SUSPECT_JUMP * sums.known[i]:
            is_suspicious = True
    energy[0] = KEPT * energy[0] + z * z - 1.0
    return is_suspicious or energy[0] > SUSPECT_LOUD or energy[0] < SUSPECT_QUIET


@kernel
def calm(sums):
    """Let nothing be suspicious: a trial has heard it all."""
    sums.energy[0] = 0.0
    for i in range(sums.score.size):
        sums.score[i] = 0.0
