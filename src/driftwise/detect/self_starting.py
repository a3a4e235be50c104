"""Has something changed? For innovations whose tails and colour nobody has told: a self-starting CUSUM."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..engine.dispatch import Vector, kernel
from ..engine.elementary import exp, log, square
from ..engine.errors import InputError
from ..engine.normal import deviate, tail
from .alarms import Alarms, scan
from .average_run_length import rate
from .brownian import positive
from .hinkley import PageHinkley
from .registry import register
from .settings import each, rate_words
from .variance import VarianceCUSUM
from .watch import OWN, accumulate, conclude, watch

LEVEL_MEMORY, TAIL_MEMORY = 0.995, 0.9995  # of noise level and tails, a sample
AFTER, STEADY = 5.0, 8.0  # samples that the noise level counts for after an alarm; from which on outliers are clipped
SHARES = {"given": 0.6, "learnt": 1.0}  # the sums rise together, and learnt tails slow them: of the promise, simulated
SCALES = 8  # of the mixture of normals: variances 4^-2 ... 4^5 times the level
HIGH, PEAKS = 2.0, 10.0  # from where an excursion counts; how many such the exponential law is trusted like
STARTS, PAUSE = 4.0, 10.0  # samples of an estimator's start that are left out; without alarm after an alarm
CLIP = 9.0  # the largest square that enters the noise level, in units of it
LEAST, HUGE = 1e-200, 1e50  # the lowest noise level, the largest innovation
SEEN, LEVEL, WEIGHT, TAILS = range(OWN, OWN + 4)  # own marks: samples, noise level, samples behind it, mixture


@register()
class SelfStarting(NamedTuple):
    """Alarms where innovations change in mean or grow, their tails and colour (and noise level) learnt on the way.

    What breaks the promise of a plain CUSUM on real data is learnt from the innovations themselves:

    * their tails, a mixture of normals with 4^-2 ... 4^5 times the variance stated. The probability of an innovation
      under that mixture, as a standard normal deviate z, goes into the sums (Hawkins 1987, who so uses Student's law);
    * how high the sums rise when nothing happens. Each is a log likelihood ratio,

          mean:   g <- max(0, g + d z - d^2 / 2)          for each shift d, up and down
          noise:  g <- max(0, g - 1/2 log(ratio) + 1/2 z^2 (1 - 1/ratio))

      whose excursions have peaks with P(peak > x) ~ exp(-x) for independent N(0, 1) deviates (Lundberg's exponent 1).
      Coloured innovations rise higher: exp(-x/b), with b >= 1 estimated from the peaks above 2, to which 10 of the
      exponential law are added. The threshold is b times the designed one, so a false alarm makes the next one rarer.

    After an alarm the tails are normal again, because what came before belongs to another regime. A direction of +1 may
    mean louder noise: one shift of 3 sd in thirty is told so.

    Parameters
    ----------
    false_alarms : str or float
        Promised rate: "1 per 1000", or a mean number of samples.
    shifts : float or tuple of float
        Shifts of the mean to be found soonest, in standard deviations; both directions are watched.
    ratio : float
        Variance after over before to be found soonest.
    noise : "given" or "learnt"
        Whether the innovations come with variance 1 (those of an estimator that follows its noise level do), or
        their level is learnt too: the mean of squares, later a running one over some 200 samples.
    warm : int
        Samples that are only learnt from, at the start.

    Notes
    -----
    Simulated false alarms over promised, at 1 per 1000, noise given (learnt): Gaussian 0.6 (0.3), Student's t with 3
    degrees of freedom 0.5 (0.6), Laplace 0.9 (0.5), rounded to whole standard deviations 0.5 (0.3). An AR(1) with
    coefficient 0.6 left in the innovations: 0.8 (0.3) in the long run, but 8 (4) in a record of a thousand samples,
    before it is known. A shift of 1.5 sd is found after 6.4 (7.1) samples on average, 5.7 where `PageHinkley` is told
    it. Its constants were chosen with sight of labelled records (SKAB, Nile, a heat exchanger, a motor, groundwater),
    so what it reaches on those is no independent evidence; that the promise is kept was simulated.

    Bad at: single outliers and short bursts, which are tails to it (that is meant); shifts well below the smallest of
    ``shifts``; noise whose variance comes in clusters (GARCH: up to four times the promised 1 per 10 000); several true
    changes in a row, which raise b like false alarms; changes during the first ``warm`` samples and the 10 after an
    alarm; changes that the estimator absorbs within a few samples (let it forget slowly, or restart: `RestartOnChange`,
    with ``noise="learnt"``); naming the parameter (`ScoreCUSUM`).

    References
    ----------
    Page (1954), Biometrika 41, 100-115; Hawkins (1987), The Statistician 36, 299-315; Asmussen and Albrecher (2010),
    Ruin Probabilities, chapter XIII, for the exponent.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> e = 7.0 * np.random.default_rng(0).standard_t(3, 620)  # neither level nor tails are told
    >>> e[600:] += 20.0
    >>> dw.detect.SelfStarting("1 per 1000", noise="learnt").scan(e)
    1 alarm in 620 samples: up at 604 since 600
    >>> dw.PageHinkley("1 per 1000").scan(e, std=7.0 * 3.0**0.5)
    3 alarms in 620 samples: up at 603 since 600, up at 610 since 604, up at 616 since 611
    """

    false_alarms: Any = "1 per 1000"
    shifts: Any = (1.5, 3.0)
    ratio: float = 4.0
    noise: str = "given"
    warm: int = 20

    def resolve(self, parameters: int = 0) -> Learning:
        """Return what the kernel sees."""
        d = each("shifts", self.shifts, max(np.size(self.shifts), 1))
        ratio = float(positive("ratio", self.ratio))
        if ratio <= 1:
            raise InputError(f"ratio > 1 is expected (variance after over before), got {self.ratio!r}")
        if not isinstance(self.noise, str) or self.noise not in SHARES:
            raise InputError(f"noise must be 'given' (the innovations have variance 1) or 'learnt', got {self.noise!r}")
        if isinstance(self.warm, bool) or not isinstance(self.warm, int | np.integer) or self.warm < 10:
            raise InputError(f"warm must be a whole number of samples, at least 10, got {self.warm!r}")
        wanted = rate(self.false_alarms) * (2 * d.size + 1) * SHARES[self.noise]
        means = [x * PageHinkley(wanted, jump=x, sides="up").resolve().h[0] for x in np.repeat(d, 2).tolist()]
        h = np.array([*means, VarianceCUSUM(ratio, wanted).resolve().h[0]])
        signs = np.tile([1.0, -1.0], d.size)
        return Learning(np.repeat(d, 2) * signs, ratio, h, float(self.noise == "learnt"), float(self.warm))

    @property
    def run_length(self) -> float:
        """Mean number of samples between false alarms that is designed for."""
        return rate(self.false_alarms)

    @property
    def words(self) -> str:
        """What the settings promise, as a sentence."""
        return "at most " + rate_words(self.run_length, "tails and colour of the innovations are learnt")

    def scan(self, signal, *, mean: float = 0.0, std: float = 1.0, state=None) -> Alarms:
        """Return the alarms in a signal (T,) of known mean; ``std`` is that before the change, unless learnt."""
        return scan(self.resolve(), signal, mean, std, state)


class Learning(NamedTuple):
    """What the kernel sees of `SelfStarting`: shifts (m,) with their signs, thresholds (m + 1,)."""

    d: Vector
    ratio: float
    h: Vector
    learns: float  # 1: the noise level too
    warm: float

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: level and tails; of each sum its value, length, peak, excess, count."""
        return TAILS + SCALES + 6 * self.h.size


@kernel
def scale(j):
    """Return the variance of part j of the mixture, in units of the noise level."""
    return math.ldexp(1.0, 2 * (j - 2))


@kernel
def at_first(j):
    """Return the weight of part j at the start: a normal law, as sure of it as after a hundred samples."""
    return 100.0 if j == 2 else 0.05 if j < 2 else 4.0 / scale(j)


@kernel
def forget_tails(q):
    """Begin again with a normal law."""
    for j in range(SCALES):
        q[j] = at_first(j)


@kernel
def normal_score(q, level, e):
    """Return the standard normal deviate that is as improbable as e under the mixture with weights q."""
    area, whole = 0.0, 0.0
    for j in range(SCALES):
        area += q[j] * tail(abs(e) / math.sqrt(level * scale(j)))
        whole += q[j]
    z = deviate(area / whole)
    return z if e > 0.0 else -z


@kernel
def density(j, surprise):
    """Return how dense part j is where e^2/level is ``surprise``, but for a factor that all parts share."""
    exponent = 0.5 * surprise * (1.0 / scale(j) - 1.0 / scale(SCALES - 1))
    return exp(-min(exponent, 700.0)) / math.sqrt(scale(j))


@kernel
def learn_tails(q, level, e):
    """Add to each weight the probability that e came from its part; what is older fades towards the start."""
    total = 0.0
    for j in range(SCALES):
        total += q[j] * density(j, e * e / level)
    for j in range(SCALES):
        q[j] += (1.0 - TAIL_MEMORY) * (at_first(j) - q[j]) + q[j] * density(j, e * e / level) / total


@kernel
def learn_level(detector_state, e):
    """Follow the noise level: the mean of squares at first, then a running one that no outlier moves far."""
    square = min(e * e, CLIP * detector_state[LEVEL]) if detector_state[WEIGHT] > STEADY else e * e
    detector_state[WEIGHT] = LEVEL_MEMORY * detector_state[WEIGHT] + 1.0
    detector_state[LEVEL] = max(
        detector_state[LEVEL] + (square - detector_state[LEVEL]) / detector_state[WEIGHT], LEAST
    )


@kernel
def log_ratio(detector, i, z):
    """Return the log likelihood ratio of what sum i looks for: a shifted mean, or, the last, louder noise."""
    if i < detector.d.size:
        return detector.d[i] * z - 0.5 * square(detector.d[i])
    return 0.5 * z * z * (1.0 - 1.0 / detector.ratio) - 0.5 * log(detector.ratio)


@kernel
def count_peak(peak, excess, count, i, top):
    """Put the peak of an excursion that has ended, cut at ``top``, to the others."""
    if peak[i] > HIGH:
        excess[i] += min(peak[i], top) - HIGH
        count[i] += 1.0
    peak[i] = 0.0


@watch.on(Learning)
def watch_learning(detector, detector_state, z, slope):
    m, q, own = detector.h.size, detector_state[TAILS : TAILS + SCALES], detector_state[TAILS + SCALES :]
    g, since, peak = own[:m], own[m : 2 * m], own[2 * m : 3 * m]
    excess, count, h = own[3 * m : 4 * m], own[4 * m : 5 * m], own[5 * m :]
    e, level, best = max(min(z, HUGE), -HUGE), detector_state[LEVEL], -1
    if detector_state[SEEN] == 0.0:
        forget_tails(q)
        level = detector_state[LEVEL] = 1.0
    detector_state[SEEN] += 1.0
    if detector_state[SEEN] > detector.warm:
        z = normal_score(q, level, e)
        for i in range(m):
            accumulate(g, since, i, log_ratio(detector, i, z))
            if g[i] == 0.0:
                count_peak(peak, excess, count, i, h[i])
            peak[i] = max(peak[i], g[i])
            h[i] = detector.h[i] * max(1.0, (PEAKS + excess[i]) / (PEAKS + count[i]))
        best = conclude(detector_state, g, since, h)
    if detector_state[SEEN] > 0.5 * detector.warm:
        learn_tails(q, level, e)
    if best >= 0:
        for i in range(m):
            count_peak(peak, excess, count, i, h[i])
        forget_tails(q)
        detector_state[SEEN] = detector.warm - min(PAUSE, 0.5 * detector.warm)
        detector_state[WEIGHT] = min(detector_state[WEIGHT], AFTER)
    if detector.learns > 0.0 and detector_state[SEEN] > STARTS:
        learn_level(detector_state, e)
    return -1.0 if best >= 0 and best < m - 1 and best % 2 else 1.0 if best >= 0 else 0.0
