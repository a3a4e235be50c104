"""Has the variance of the innovations grown? A cumulative sum of likelihood ratios (Page 1954)."""

import math
from typing import NamedTuple

from ..kernel.compose import kernel


class CUSUM(NamedTuple):
    """Alarm when the innovations look ``ratio`` times wider in variance than predicted.

    g <- max(0, g + 1/2 log(1/ratio) + 1/2 (e^2/T) (1 - 1/ratio)) grows by the log likelihood ratio of each sample; it
    alarms beyond ``threshold``. Parameters that jump make exactly this: a predictor that is suddenly wrong. Bad at
    outliers, which look the same (put a `Gate` before it), and at small jumps hidden in the noise.
    """

    ratio: float = 4.0
    threshold: float = 12.0


@kernel
def accumulate(g, surprise, ratio):
    """Return the next cumulative sum; ``surprise`` is e^2/T."""
    return max(0.0, g - 0.5 * math.log(ratio) + 0.5 * surprise * (1.0 - 1.0 / ratio))
