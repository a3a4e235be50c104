"""Which parameter of a regression has jumped, by however much? A mixture over the sizes of a jump, and when it was."""

from __future__ import annotations

from typing import NamedTuple

from ..engine.dispatch import Size, kernel
from ..engine.elementary import exp, log
from .watch import OWN, SINCE, STATISTIC, WHICH, side, watch

SMALLEST, SIZES = 0.13, 4  # jumps .13, .39, 1.17 and 3.51: sd by which z moves where the slope has its mean size
CLIP, STEEPEST = 3.0, 2.0  # the largest z that enters, and the largest shift that one sample is asked about, sd
EXCESS = 1.8  # mean run length over exp(threshold)/(2 m), by simulation: what goes beyond the threshold at an alarm
HIGHEST = 600.0  # threshold whose exponential doubles can tell from infinity


class SizeMixture(NamedTuple):
    """What the kernel sees of `ScoreCUSUM` without a size: smallest of K sizes, threshold (a logarithm)."""

    smallest: float
    K: Size
    h: float

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: samples, the slopes' sums, and of each ratio two values and its length."""
        return OWN + 1 + parameters + 6 * parameters * int(self.K)


@kernel
def follow(R, W, since, c, q, ratio):
    """Let likelihood ratio c grow by one sample's: summed over when the jump was, and of the likeliest time.

    R <- (R + q) ratio  weighs every start of the jump, by q;  W <- max(1, W) ratio  takes the best (Page 1954).
    """
    since[c] = since[c] + 1.0 if W[c] > 1.0 else 1.0
    W[c] = max(1.0, W[c]) * ratio
    R[c] = (R[c] + q) * ratio
    return R[c]


@kernel
def follow_sizes(R, W, since, first, K, a, v, largest, q):
    """Let the ratios of one parameter grow, K sizes up from ``first``, then K down; return the sums of both.

    Sizes are a, 3 a, 9 a, ..: exp(3 a v) = exp(a v)^3 and exp(-(3 a)^2/2) = exp(-a^2/2)^9, two exponentials in all.
    ``largest`` is exp(STEEPEST v), for those that are cut.
    """
    up, down, way, fall = 0.0, 0.0, exp(a * v), exp(-0.5 * a * a)
    for k in range(K):
        if abs(a) > STEEPEST:
            way, fall = largest if a > 0.0 else 1.0 / largest, FALL
        up += follow(R, W, since, first + k, q, way * fall)
        down += follow(R, W, since, first + K + k, q, fall / way)
        a, way, square = 3.0 * a, way * way * way, fall * fall
        fall *= square * square * square * square
    return up, down


FALL = exp(-0.5 * STEEPEST * STEEPEST)


@watch.on(SizeMixture)
def watch_size_mixture(detector, detector_state, z, slope):
    m, K = slope.size, int(detector.K)
    slopes, own, N = detector_state[OWN + 1 : OWN + 1 + m], detector_state[OWN + 1 + m :], 2 * m * K
    R, W, since = own[:N], own[N : 2 * N], own[2 * N :]
    detector_state[OWN] += 1.0
    v, total, best, most = max(min(z, CLIP), -CLIP), 0.0, 0, -1.0
    largest = exp(STEEPEST * v)
    for i in range(m):
        slopes[i] += abs(slope[i])
        s = slope[i] * detector_state[OWN] / slopes[i] if slopes[i] > 0.0 else 0.0
        up, down = follow_sizes(R, W, since, 2 * i * K, K, s * detector.smallest, v, largest, abs(s))
        total += up + down
        if max(up, down) > most:
            best, most = 2 * i + (1 if down > up else 0), max(up, down)
    level = log(max(total / K, 1.0))
    detector_state[STATISTIC] = level / detector.h
    if level < detector.h:
        return 0.0
    likeliest = best * K
    for c in range(best * K, (best + 1) * K):
        if R[c] > R[likeliest]:
            likeliest = c
    detector_state[SINCE], detector_state[WHICH] = since[likeliest], best // 2
    for c in range(N):
        R[c] = W[c] = since[c] = 0.0
    return side(best)


def size_mixture(threshold: float) -> SizeMixture:
    """Return the kernel's mixture with this threshold."""
    return SizeMixture(SMALLEST, float(SIZES), min(float(threshold), HIGHEST))
