"""Has something jumped? One question, asked after every sample; each detector answers it in its own way."""

from typing import NamedTuple

from ..engine.dispatch import kernel, listens, watch

# What every detector keeps first; its own numbers follow.
STATISTIC, SINCE, WHICH, OWN = range(4)


class Silent(NamedTuple):
    """No detector: nothing ever alarms."""

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return OWN


@kernel
def accumulate(g, since, i, ratio):
    """Let sum i grow by one sample's log likelihood ratio, g <- max(0, g + ratio), and count since it was 0.

    Page (1954). Where E exp(ratio) <= 1 given the past, h = log(m T) lets m such sums run T samples or more on
    average before the first reaches h (Lorden 1971, with the martingale of the Shiryaev-Roberts sums).
    """
    g[i] = max(0.0, g[i] + ratio)
    since[i] = since[i] + 1.0 if g[i] > 0.0 else 0.0


@kernel
def conclude(detector_state, g, since, h):
    """Compare each sum with its threshold; return the index of the one that alarms, or -1. An alarm clears all."""
    best, most = 0, -1.0
    for i in range(g.size):
        if g[i] / h[i] > most:
            best, most = i, g[i] / h[i]
    detector_state[STATISTIC] = most
    if most < 1.0:
        return -1
    detector_state[SINCE], detector_state[WHICH] = since[best], -1.0
    for i in range(g.size):
        g[i] = since[i] = 0.0
    return best


@kernel
def side(best):
    """Return the direction of a pair of sums (up, down): +1, -1, or 0 without alarm."""
    return 0.0 if best < 0 else 1.0 - 2.0 * (best % 2)


@watch.on(Silent)
def watch_silent(detector, detector_state, z, slope):
    return 0.0


@listens.on(Silent)
def listens_silent(detector):
    return False
