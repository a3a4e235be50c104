"""Which parameter of a regression has jumped, by however much? A mixture over the sizes of a jump, and when it was."""

from __future__ import annotations

from typing import NamedTuple

from ..engine.dispatch import Size, abreast, kernel, rare
from ..engine.elementary import exp, log
from .watch import OWN, SINCE, STATISTIC, WHICH, side, watch

SMALLEST, SIZES = 0.13, 4  # jumps .13, .39, 1.17 and 3.51: sd by which z moves where the slope has its mean size
CLIP, STEEPEST = 3.0, 2.0  # the largest z that enters, and the largest shift that one sample is asked about, sd
EXCESS = 1.8  # mean run length over exp(threshold)/(2 m), by simulation: what goes beyond the threshold at an alarm
HIGHEST = 600.0  # threshold whose exponential doubles can tell from infinity
TINY = 1e-300  # a slope that is none
THIRD = 1 / 3
FALL = exp(-0.5 * STEEPEST * STEEPEST)

# cosh x = 1 + x^2/2 + C2 x^4 + .., sinh x = x (1 + x^2/6 + S2 x^4 + ..), |x| <= WIDE/4; exp(-y) = 1 - y + F2 y^2 + ..,
# y <= SMALL^2/4: by interpolation at Chebyshev's points, in 50 digits; the error is below 1e-15
WIDE, SMALL = 1.4, 0.7
C2, C3, C4, C5 = 0.04166666666666299, 0.0013888888898495868, 2.4801548093882144e-05, 2.760851464371394e-07
S1, S2, S3, S4, S5 = 1 / 6, 0.00833333333333305, 0.0001984126984865852, 2.75572890690845e-06, 2.5091484617339137e-08
F2, F3, F4 = 0.4999999999999557, -0.1666666666411357, 0.041666664281387315
F5, F6, F7 = -0.008333251746925577, 0.0013876251328472416, -0.00018934979979903498


class SizeMixture(NamedTuple):
    """What the kernel sees of `ScoreCUSUM` without a size: smallest of K sizes, threshold (a logarithm).

    Of each ratio R, W and the length are kept: of the smallest size up, for each parameter, down, the next size up, ..
    """

    smallest: float
    K: Size
    h: float

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: samples, the slopes' sums, the last slopes and what they said, ratios."""
        return OWN + 1 + (4 + 6 * int(self.K)) * parameters

    def parameters(self, size: int) -> int:
        """Return of how many parameters it keeps so many numbers."""
        return (size - OWN - 1) // (4 + 6 * int(self.K))


@kernel
def near_ratios(a, v):
    """Return exp(a v - a^2/2) and exp(-a v - a^2/2), where |a v| is below WIDE and |a| below SMALL.

    exp(x) = (cosh(x/4) + sinh(x/4))^4 and one over it have all but a sum in common; nothing waits for anything long.
    """
    x, y = 0.25 * a * v, 0.25 * a * a
    z, w = x * x, y * y
    far = z * z
    even = (1.0 + 0.5 * z) + far * ((C2 + C3 * z) + far * (C4 + C5 * z))
    odd = x * ((1.0 + S1 * z) + far * ((S2 + S3 * z) + far * (S4 + S5 * z)))
    fall = ((1.0 - y) + w * (F2 + F3 * y)) + w * w * ((F4 + F5 * y) + w * (F6 + F7 * y))
    up, down = even + odd, even - odd
    up, down = up * up * fall, down * down * fall
    return up * up, down * down


@rare
def far_ratios(s, up, down, smallest, v):
    """Put the same into up and down, wherever slopes are; the shift is cut beyond STEEPEST."""
    for i in range(s.size):
        a = min(max(s[i] * smallest, -STEEPEST), STEEPEST)
        up[i], down[i] = exp(a * v - 0.5 * a * a), exp(-a * v - 0.5 * a * a)


@kernel
def follow(R, W, since, c, q, ratio):
    """Let likelihood ratio c grow by one sample's: summed over when the jump was, and of the likeliest time.

    R <- (R + q) ratio  weighs every start of the jump, by q;  W <- max(1, W) ratio  takes the best (Page 1954).
    """
    since[c] = (since[c] if W[c] > 1.0 else 0.0) + 1.0
    W[c] = max(1.0, W[c]) * ratio
    R[c] = (R[c] + q) * ratio


@kernel
def follow_size(R, W, since, s, up, down, steepest, most, least):
    """Let the ratios of one size grow, of each parameter; leave in up and down those of a size three times as large.

    exp(3 x - 9 y) = (u^2 d)^3 where u = exp(x - y), d = exp(-x - y). Slopes beyond ``steepest`` are cut: ``most`` and
    ``least`` are their ratios.
    """
    m = s.size
    for i in abreast(m):
        q = abs(s[i])
        u, d = (
            up[i] if q <= steepest else (most if s[i] > 0.0 else least),
            down[i] if q <= steepest else (least if s[i] > 0.0 else most),
        )
        follow(R, W, since, i, q, u)
        follow(R, W, since, m + i, q, d)
        both = u * d
        u, d = u * both, d * both
        up[i], down[i] = u * u * u, d * d * d


@watch.on(SizeMixture)
def watch_size_mixture(detector, detector_state, z, slope):
    m, K, smallest = slope.size, int(detector.K), detector.smallest
    means, own, N = detector_state[OWN + 1 : OWN + 1 + m], detector_state[OWN + 1 + m :], 2 * m * K
    s, up, down, ratios = own[:m], own[m : 2 * m], own[2 * m : 3 * m], own[3 * m :]
    R, W, since = ratios[:N], ratios[N : 2 * N], ratios[2 * N :]
    count = detector_state[OWN] + 1.0
    detector_state[OWN] = count
    v, over = max(min(z, CLIP), -CLIP), -1.0
    most = exp(STEEPEST * v)
    least = FALL / most
    most *= FALL
    bound = count * smallest * max(abs(v) / WIDE, 1.0 / SMALL)
    for i in range(m):
        over = max(over, abs(slope[i]) * bound - (means[i] + abs(slope[i])))
    for i in abreast(m):
        means[i] += abs(slope[i])
        s[i] = slope[i] * count / max(means[i], TINY)
        up[i], down[i] = near_ratios(s[i] * smallest, v)
    if over > 0.0:
        far_ratios(s, up, down, smallest, v)
    steepest = STEEPEST / smallest
    for k in range(K):
        at, end = 2 * k * m, 2 * (k + 1) * m
        follow_size(R[at:end], W[at:end], since[at:end], s, up, down, steepest, most, least)
        steepest *= THIRD
    level = log(max(whole(R) / K, 1.0))
    detector_state[STATISTIC] = level / detector.h
    return 0.0 if level < detector.h else tell(detector_state, R, W, since, K, m)


@kernel
def whole(R):
    """Return the sum of all ratios; no sum waits for another."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    fours = R.size // 4
    for j in range(fours):
        a, b, c, d = a + R[4 * j], b + R[4 * j + 1], c + R[4 * j + 2], d + R[4 * j + 3]
    for i in range(4 * fours, R.size):
        a += R[i]
    return (a + b) + (c + d)


@rare
def tell(detector_state, R, W, since, K, m):
    """Say whose ratios are the largest together, and since when the likeliest of them; all begin anew."""
    best, most, likeliest = 0, -1.0, 0
    for i in range(m):
        for down in range(2):
            first, together = down * m + i, 0.0
            for k in range(K):
                together += R[2 * k * m + first]
            if together > most:
                best, most, likeliest = 2 * i + down, together, first
    first = likeliest
    for k in range(1, K):
        if R[2 * k * m + first] > R[likeliest]:
            likeliest = 2 * k * m + first
    detector_state[SINCE], detector_state[WHICH] = since[likeliest], best // 2
    for c in range(R.size):
        R[c] = W[c] = since[c] = 0.0
    return side(best)


def size_mixture(threshold: float) -> SizeMixture:
    """Return the kernel's mixture with this threshold."""
    return SizeMixture(SMALLEST, float(SIZES), min(float(threshold), HIGHEST))
