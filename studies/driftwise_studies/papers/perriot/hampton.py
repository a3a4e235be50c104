"""Section 5's plant and Hampton's adaptive Kalman gain, for many records at once: every array is (records,).

    x+ = Phi x + w (variance Q),   y = x + e (variance R),   filter   nu = y - xp,   xp+ = Phi (xp + K nu)

A *way* turns the residuals into a gain: (4)-(5) with a sequence of gains, Fortescue's factor, a random walk. A
*detector* may restart it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

PHI = 0.99
LEVELS = (0.1, 0.3, 0.1, 0.3)
SEGMENT = 500
QUIET = 20  # samples before the first test


class Plant(NamedTuple):
    """Optimal gain and variances at every sample, each (T,)."""

    K: np.ndarray
    Q: np.ndarray
    R: np.ndarray


class Path(NamedTuple):
    """What a filter did: gain and filtered state (T, records), and alarms (T, records), +1 up and -1 down."""

    K: np.ndarray
    x: np.ndarray
    alarms: np.ndarray


def ratio(K):
    """Return Q/R at which K is the optimal gain."""
    return K / (1 - K) * (1 - PHI**2 * (1 - K))


def plant(levels, jumps="Q", length=SEGMENT) -> Plant:
    """Return a plant whose optimal gain has these levels: R = 1 and Q jumps, or Q stays at level 1 and R jumps."""
    K = np.repeat(np.asarray(levels, float), length)
    Q = ratio(K) if jumps == "Q" else np.full(K.shape, ratio(levels[0]))
    return Plant(K, Q, Q / ratio(K))


def mean_of_Z(K, K_opt):
    """Return the mean of Z at a gain K, R = 1: the gain that would suit the P which K causes, less K."""
    Q = ratio(K_opt)
    P = (Q + PHI**2 * K**2) / (1 - PHI**2 * (1 - K) ** 2)
    return P / (P + 1) - K


def records(plant: Plant, count, seed):
    """Return x and y (T, count); x(0) has the law of the first level."""
    rng = np.random.default_rng(seed)
    x, y = np.empty((2, len(plant.K), count))
    now = rng.standard_normal(count) * np.sqrt(plant.Q[0] / (1 - PHI**2))
    for n, (Q, R) in enumerate(zip(plant.Q, plant.R)):
        x[n], y[n] = now, now + np.sqrt(R) * rng.standard_normal(count)
        now = PHI * now + np.sqrt(Q) * rng.standard_normal(count)
    return x, y


def kalman(plant: Plant, y):
    """Return the filtered state (T, records) of the filter that knows Q and R."""
    x, P, found = np.zeros(y.shape[1]), plant.Q[0] / (1 - PHI**2), np.empty_like(y)
    for n, (Q, R) in enumerate(zip(plant.Q, plant.R)):
        K = P / (P + R)
        found[n] = x + K * (y[n] - x)
        x, P = PHI * found[n], PHI**2 * (1 - K) * P + Q
    return found


# --- ways ------------------------------------------------------------------------------------------------------


class Mean:
    """Mean of past values, exponential once ``memory`` samples are in it; ``prior`` = (samples, value)."""

    def __init__(self, memory, prior=(0.0, 0.0)):
        self.memory, self.weight, self.n = memory, prior[0], 0
        self.value: Any = prior[1]

    @property
    def known(self):
        """Whether there is a value."""
        return self.n + self.weight > 0

    def add(self, value):
        """Take one more value in, after use."""
        share = max(1 / self.memory, 1 / (self.n + 1 + self.weight))
        self.value, self.n = self.value + share * (value - self.value), self.n + 1


class Averaging:
    """(4)-(5) with gain(t), t counting the samples since the last start; ``score``: RPEM gradient instead of PLR."""

    def __init__(self, gain=lambda t: 1 / t, score=False, printed=False):
        self.gain, self.score, self.printed = gain, score, printed

    def start(self, count):
        """Forget everything."""
        self.t, self.R, self.Z = np.ones(count), np.zeros(count), np.zeros(count)

    def update(self, K, f, nu):
        """Return the next K; R before K. As printed, the variance lacks its own forgetting."""
        g = self.gain(self.t)
        self.R = self.R + g * (f * f - (0.0 if self.printed else self.R))
        self.Z = f * nu / self.R
        self.t = self.t + 1
        return K + g * self.Z

    def seen(self, nu):
        """Take nu into the noise variance; there is none here."""

    def restart(self, fired, N0):
        """Let the next gain be 1/N0."""
        self.t = np.where(fired, N0, self.t)


class Fortescue(Averaging):
    """Forgetting that follows the size of the residual (Fortescue, Kershenbaum, Ydstie 1981), memory 100."""

    def start(self, count):
        """Forget everything."""
        super().start(count)
        self.g, self.c, self.n = np.ones(count), Mean(100), 0

    def update(self, K, f, nu):
        """Return the next K."""
        if self.n:
            q = self.g * f * f / self.R
            lam = np.clip(1 - nu * nu / ((1 + q) * 100 * self.c.value), 0.9, 1)
            self.g = self.g / ((lam if self.n >= 50 else 1.0) + self.g)
        self.n += 1
        self.R = self.R + self.g * (f * f - self.R)
        self.Z = f * nu / self.R
        return K + self.g * self.Z

    def seen(self, nu):
        """Take nu into the noise variance."""
        self.c.add(nu * nu)


class Walk:
    """K as a random walk: P+ = P + q, noise variance c the mean of past nu^2; a restart lifts P to ``floor``."""

    def __init__(self, q, P0=0.04, score=True, memory=100, prior=(0.0, 0.0), floor=0.02):
        self.q, self.P0, self.score, self.memory, self.prior, self.floor = q, P0, score, memory, prior, floor

    def start(self, count):
        """Forget everything."""
        self.P, self.c = np.full(count, self.P0), Mean(self.memory, self.prior)

    def update(self, K, f, nu):
        """Return the next K."""
        P = self.P + self.q
        gain = f * P / (f * f * P + self.c.value)
        self.P = P - gain * f * P
        return K + gain * nu

    def seen(self, nu):
        """Take nu into the noise variance."""
        self.c.add(nu * nu)

    def restart(self, fired, _):
        """Widen P."""
        self.P = np.where(fired, np.maximum(self.P, self.floor), self.P)


class Sample(NamedTuple):
    """What a detector may look at; K is the gain before this sample."""

    n: int
    y: np.ndarray
    nu: np.ndarray
    f: np.ndarray
    psi: np.ndarray
    K: np.ndarray
    way: Any


def follow(y, way, detector=None, K0=0.0, limits=(0.0, 1.0)) -> Path:
    """Run the adaptive filter over y (T, records): nu, gain, K, test, limits, prediction."""
    T, count = y.shape
    K, xp, nu, psi = np.full(count, K0), np.zeros(count), np.zeros(count), np.zeros(count)
    gains, states, alarms = np.empty_like(y), np.empty_like(y), np.zeros(y.shape, np.int8)
    way.start(count)
    if detector is not None:
        detector.start(count)
    for n in range(T):
        f, nu = PHI * nu, y[n] - xp
        after = way.update(K, psi if way.score else f, nu) if n else K
        if detector is not None:
            alarms[n] = detector.look(Sample(n, y[n], nu, f, psi, K, way))
            if alarms[n].any():
                up, down = detector.N0
                way.restart(alarms[n] != 0, np.where(alarms[n] > 0, up, down))
        way.seen(nu)
        K = np.clip(after, *limits)
        gains[n], states[n] = K, xp + K * nu
        psi = PHI * (1 - K) * psi + PHI * nu
        xp = PHI * states[n]
    return Path(gains, states, alarms)


def bank(y, count=25, every=SEGMENT, memory=200) -> Path:
    """Return the weighted mean of filters with fixed gains .02 .. .98, weights that forget at the jump rate."""
    grid, (T, runs) = np.linspace(0.02, 0.98, count)[:, None], y.shape
    xp, w, c = np.zeros((count, runs)), np.full((count, runs), 1 / count), Mean(memory)
    gains, states = np.empty_like(y), np.empty_like(y)
    for n in range(T):
        nu = y[n] - xp
        if n:
            surprise = nu * nu - (nu * nu).min(axis=0)  # the least is taken off, so that not all weights underflow
            w = ((1 - 1 / every) * w + 1 / (count * every)) * np.exp(-surprise / (2 * c.value))
            w /= w.sum(axis=0)
        c.add((w * nu * nu).sum(axis=0))
        xp = xp + grid * nu
        gains[n], states[n] = (w * grid).sum(axis=0), (w * xp).sum(axis=0)
        xp = PHI * xp
    return Path(gains, states, np.zeros(y.shape, np.int8))
