"""The paper's DC motor, its signals and its noise: exact samples of the angle, one generator for each seed.

    x1' = x2,   J x2' = K1 x3 + torque,   L x3' = -R x3 - K2 x2 + u + (L J/K1) (q1 + q2 cos w t)
    y = x1 + noise at 1 kHz for 10 s,     u = 24 sin t,     x(0) = [1, 0, 3]

x1 is the angle (rad), x2 the speed (rad/s), x3 the current (A). A `Scenario` is what is true, and what estimators are
`Told`. Noise: "uniform" in +-0.015 (the paper's), "ar1" of the same variance with pole 0.99,
"hum" a 50 Hz interference of amplitude 0.015 and random phase instead of noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from driftwise.engine.errors import InputError
from driftwise.models.plant import Augmented, Plant, Polynomial, Sinusoid

K1, K2, L, R, J = 1.0, 1.0, 0.1, 1.0, 5.0
VOLTS = 24.0
START = (1.0, 0.0, 3.0)
RATE, SECONDS = 1000, 10.0
HALF = 0.015  # half width of the paper's noise
SIGMA = HALF / np.sqrt(3)
POLE = 0.99  # of the coloured noise
NOISES = ("uniform", "ar1", "hum")
INTO = (0.0, 0.0, J / K1)  # how a disturbance enters x'


class Told(NamedTuple):
    """What estimators are told of the motor and of its disturbance; the rest is told as it is."""

    R: float = R
    w: float = 50.0


class Scenario(NamedTuple):
    """What is true of one experiment, and what the estimators are told."""

    R: float = R
    R_end: float | None = None  # R drifts to this value at the end
    R_after: float | None = None  # R jumps to this value
    jump: float = 5.0  # when, s
    q1: float = 1.0
    q2: float = 1.0
    w: float = 50.0
    torque: float = 0.0
    told: Told = Told()
    since: float = 2.0  # errors count from here, s

    def resistance(self, t) -> np.ndarray:
        """Return R at the instants t."""
        t = np.asarray(t, dtype=float)
        found = self.R + (0.0 if self.R_end is None else (self.R_end - self.R) / SECONDS) * t
        return found if self.R_after is None else np.where(t >= self.jump, self.R_after, found)


NOMINAL = Scenario()
SCENARIOS = {
    "nominal": NOMINAL,
    "told w = 52, true 50": Scenario(told=Told(w=52.0)),
    "the same with q2 = 50": Scenario(q2=50.0, told=Told(w=52.0)),
    "told R 10 % too large": Scenario(told=Told(R=1.1 * R)),
    "told R 10 % too small": Scenario(told=Told(R=0.9 * R)),
    "R drifts 1 -> 1.3": Scenario(R_end=1.3),
    "R jumps 1 -> 1.5 at 5 s": Scenario(R_after=1.5, since=6.0),
}


@dataclass(frozen=True)
class Records:
    """Records of one scenario, a row for each seed, with the truth they share."""

    t: np.ndarray  # (T,), from 0 to 10 s
    u: np.ndarray  # (T,)
    y: np.ndarray  # (S, T)
    x: np.ndarray  # (T, 3)
    y3: np.ndarray  # (T,), y'''
    disturbance: np.ndarray  # (T,), q1 + q2 cos w t
    scenario: Scenario


def motor(told: Told = Told(), *disturbances) -> Augmented:
    """Return the motor as estimators are told it, with these disturbances."""
    A = [[0, 1, 0], [0, 0, K1 / J], [0, -K2 / L, -told.R / L]]
    names = dict(states=("angle", "speed", "current"), inputs="volts", outputs="angle")
    return Augmented(Plant(A, [0, 0, 1 / L], [1, 0, 0], **names), disturbances)


def constant(prior_std=np.inf, walk: float = 0.0) -> Polynomial:
    """Return the constant disturbance q1."""
    return Polynomial(INTO, prior_std, walk=walk, name="q1")


def cosine(told: Told = Told(), prior_std=np.inf, walk: float = 0.0) -> Sinusoid:
    """Return the disturbance q2 cos w t, of unknown phase."""
    return Sinusoid(told.w, INTO, prior_std, walk=walk, name="q2")


def modes(count: int, told: Told = Told()) -> Augmented:
    """Return the motor with 3 modes (its own), 4 (and the constant) or 6 (and the cosine)."""
    return motor(told, *{3: (), 4: (constant(),), 6: (constant(), cosine(told))}[count])


def truth(scenario: Scenario = NOMINAL, seconds: float = SECONDS):
    """Return t (T,), u (T,) and the exact states x (T, 3).

    The autonomous system [x, sin t, cos t, 1, cos w t, sin w t] goes from sample to sample by its exponential. R is
    held over a sample at its value in the middle: exact where it is constant, good to 1e-6 where it drifts.
    """
    t = np.arange(round(seconds * RATE) + 1) / RATE
    held, which = np.unique(scenario.resistance(t[:-1] + 0.5 / RATE), return_inverse=True)
    M = np.zeros((len(held), 8, 8))
    M[:, 0, 1], M[:, 1, 2], M[:, 1, 5] = 1, K1 / J, scenario.torque / J
    M[:, 2, 1], M[:, 2, 2], M[:, 2, 3] = -K2 / L, -held / L, VOLTS / L
    M[:, 2, 5], M[:, 2, 6] = J / K1 * scenario.q1, J / K1 * scenario.q2
    M[:, 3, 4], M[:, 4, 3], M[:, 6, 7], M[:, 7, 6] = 1, -1, -scenario.w, scenario.w
    steps = _exponentials(M / RATE)
    z = np.empty((len(t), 8))
    z[0] = [*START, 0, 1, 1, 1, 0]
    for k in range(len(t) - 1):
        z[k + 1] = steps[which[k]] @ z[k]
    return t, VOLTS * np.sin(t), z[:, :3]


def _exponentials(M):
    """Return exp(M) of many small matrices (., n, n), by its series: M is a step, and no eigenvalue is large."""
    term = found = np.broadcast_to(np.eye(M.shape[-1]), M.shape)
    for k in range(1, 60):
        term = term @ M / k
        found = found + term
        if np.abs(term).max() < 1e-20:
            break
    return found


def noise(kind: str, seeds: range, T: int) -> np.ndarray:
    """Return noise (S, T) of a kind, a row for each seed."""
    if kind not in NOISES:
        raise InputError(f"there is no noise called {kind!r}; there are: {', '.join(NOISES)}")
    streams = [np.random.default_rng(seed) for seed in seeds]
    if kind == "uniform":
        return np.stack([rng.uniform(-HALF, HALF, T) for rng in streams])
    if kind == "hum":
        phases = np.array([rng.uniform(0, 2 * np.pi) for rng in streams])
        return HALF * np.sin(2 * np.pi * 50 / RATE * np.arange(T) + phases[:, None])
    white = SIGMA * np.stack([rng.standard_normal(T) for rng in streams])
    white[:, 1:] *= np.sqrt(1 - POLE**2)  # the first is stationary
    return lfilter([1.0], [1.0, -POLE], white, axis=1)


def records(scenario: Scenario = NOMINAL, seeds: int | range = 200, kind: str = "uniform") -> Records:
    """Return the records of a scenario.

    Parameters
    ----------
    scenario : one of ``SCENARIOS``, or another
    seeds : how many, or which; a seed gives the same record whatever the others are
    kind : of noise, one of ``NOISES``

    Raises
    ------
    InputError
        Where there is no such noise, or no seed.

    Examples
    --------
    >>> from driftwise_studies.papers.tian.motor import SCENARIOS, records
    >>> r = records(SCENARIOS["R jumps 1 -> 1.5 at 5 s"], 2)
    >>> r.y.shape, r.x[0]
    ((2, 10001), array([1., 0., 3.]))
    """
    chosen = range(seeds) if isinstance(seeds, int) else seeds
    if len(chosen) == 0 or min(chosen) < 0:
        raise InputError(f"seeds must be a number of them, at least 1, or a range from 0 or later, got {seeds!r}")
    t, u, x = truth(scenario)
    pushed = scenario.q1 + scenario.q2 * np.cos(scenario.w * t)
    y3 = K1 / (L * J) * (u - K2 * x[:, 1] - scenario.resistance(t) * x[:, 2]) + pushed
    return Records(t, u, x[:, 0] + noise(kind, chosen, len(t)), x, y3, pushed, scenario)
