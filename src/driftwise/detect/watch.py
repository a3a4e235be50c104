"""Has something jumped? One question, asked after every sample; each detector answers it in its own way."""

from typing import NamedTuple

from ..kernel.compose import choice

# What every detector keeps first; its own numbers follow.
STATISTIC, SINCE, WHICH, OWN = range(4)


class Silent(NamedTuple):
    """No detector: nothing ever alarms."""

    def marks(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return OWN


@choice
def watch(detector, marks, z, slope):
    """Take one whitened innovation z = e/sqrt(T); return 0, or +1 or -1 where it alarms (the direction).

    ``marks`` are the numbers the detector keeps. It leaves in them, at every sample, the largest ``STATISTIC`` relative
    to its threshold (1 and more: alarm); at an alarm, ``SINCE``, the number of samples since the change by its own
    estimate (this one included), and ``WHICH``, the index of the parameter that changed (-1: cannot say). It starts
    afresh after an alarm. ``slope`` (m,) says how the mean of z would move per unit of each parameter,
    -dz/dtheta = psi/sqrt(T); it is empty where the estimator cannot tell.
    """


@watch.on(Silent)
def _(detector, marks, z, slope):
    return 0.0
