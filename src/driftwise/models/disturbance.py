"""A disturbance beside a regression: what moves y for a while and then goes by itself."""

from __future__ import annotations

import math
from typing import NamedTuple


class Disturbance(NamedTuple):
    """d(t+1) = pole d(t) + w(t), added to y: the coloured part of the noise, estimated as a state of its own.

    ``pole`` is what remains of it after a sample; a pole of 0.8 is forgotten in four or five samples. ``ratio`` is its
    variance over that of the white noise. `Regression` estimates it beside its parameters, so that these need not
    follow what is gone tomorrow.

    Examples
    --------
    >>> import driftwise as dw
    >>> dw.models.Disturbance(pole=0.8).lasts
    4.48
    """

    pole: float = 0.8
    ratio: float = 100.0

    @property
    def lasts(self) -> float:
        """Samples until it has fallen to a share of 1/e."""
        return round(-1 / math.log(self.pole), 2) if self.pole > 0 else 0.0

    @property
    def nvr(self) -> float:
        """Variance it gains in a sample, over that of the white noise."""
        return self.ratio * (1 - self.pole**2)
