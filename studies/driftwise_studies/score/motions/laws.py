"""How drawn objects move, as laws: what a leg does, when it ends, what follows; see `simulation.itinerary`.

`Law` is that by which they are drawn. Who knows less of it is `Forgetful` or a `Stranger`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwise.estimators.track.courses import BEGINS, STRENGTHS, WOBBLES
from driftwise.estimators.track.judging import GENTLE

from .scene import Kind
from .simulation import LEAST_LEG, WOBBLE

STRAIGHT, ALONG, ACROSS = range(3)
ALONGS = 0.3  # of manoeuvres
STOPS = 0.7  # .. of those along the path that end at rest, where objects rest
RESTING, SLOWEST = 1e-6, 1e-5  # m/s, at rest: a way it has yet; and who is slower is at rest
HEADING = 0.02  # rad, to which each particle knows the way of what rests
STRATA = 8  # of the sharpness of a manoeuvre, each a Gaussian


class Legs(NamedTuple):
    """Of each particle: what it does, and since when."""

    mode: np.ndarray
    age: np.ndarray  # s, of a straight leg; turned so far, rad, of a turn
    sign: np.ndarray
    times: np.ndarray  # half circles that a turn goes on for, at most; 0: what goes along the path ends at rest
    calm: np.ndarray

    def take(self, which) -> Legs:
        """Return some of them."""
        return Legs(*(column[which] for column in self))


class Law:
    """How a class moves."""

    def __init__(self, kind: Kind, scan: float, rests: bool = False):
        self.kind, self.scan, self.rests = kind, scan, rests
        self.wobble = WOBBLE * kind.acceleration[0] * np.sqrt(min(scan, kind.leg[0]))
        self.speed, self.leg, self.sharp = (np.log(span) for span in (kind.speed, kind.leg, kind.acceleration))

    def span(self, legs: Legs, x: np.ndarray):
        """Return the span of what ends a leg (log time, log speed, angle) if it lasts yet; speed, sharpness."""
        v, a = np.maximum(np.hypot(x[:, 1], x[:, 3]), 1e-9), np.exp(x[:, 4])
        low, high = np.empty(len(v)), np.empty(len(v))
        s, l, t = (legs.mode == m for m in range(3))
        low[s], high[s] = np.log(np.maximum(legs.age[s], self.kind.leg[0])), self.leg[1]
        up = legs.sign > 0
        low[l] = np.where(up[l], np.maximum(np.log(v[l]), self.speed[0]), self.speed[0])
        high[l] = np.where(up[l], self.speed[1], np.minimum(np.log(v[l]), self.speed[1]))
        low[t], high[t] = np.maximum(legs.age[t], 0.35 * legs.times[t]), np.pi * legs.times[t]
        return low, np.maximum(high, low + 1e-12), v, a

    def remaining(self, legs: Legs, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the time that each leg still lasts, at quantile u of what is possible."""
        low, high, v, a = self.span(legs, x)
        left = np.empty(len(u))
        s, l, t = (legs.mode == m for m in range(3))
        at = low + u * (high - low)
        left[s] = np.maximum(np.exp(at[s]), LEAST_LEG * self.scan) - legs.age[s]
        falling = np.exp(high - u * (high - low))
        goal = np.where(legs.sign > 0, np.exp(np.where(l, at, 0.0)), np.where(l, falling, 1.0))
        left[l] = (np.abs(np.where(legs.times > 0, goal, 0.0) - v) / a)[l]
        left[t] = ((at - legs.age) * v / a)[t]
        left[legs.calm & (v > SLOWEST)] = np.inf
        return np.maximum(left, 0.0)

    def share_ending(self, legs: Legs, x: np.ndarray, d: float) -> np.ndarray:
        """Return the probability that each leg ends within d seconds."""
        low, high, v, a = self.span(legs, x)
        s, l, t = (legs.mode == m for m in range(3))
        share = np.zeros(len(v))
        share[s] = (np.log(np.maximum(legs.age[s] + d, 1e-300)) - low[s]) / (high - low)[s]
        share[s] = np.where(legs.age[s] + d <= LEAST_LEG * self.scan, 0.0, share[s])
        up, down = np.log(v + a * d), np.log(np.maximum(v - a * d, 1e-300))
        share[l] = np.where(legs.sign > 0, up - low, high - down)[l] / (high - low)[l]
        share[t] = ((legs.age + a * d / v - low) / (high - low))[t]
        share[l & (legs.times == 0)] = (a * d >= v)[l & (legs.times == 0)]
        share[legs.calm & (v > SLOWEST)] = 0.0
        return np.clip(share, 0.0, 1.0)

    def begin(self, rng, legs: Legs, x: np.ndarray, P: np.ndarray, which: np.ndarray) -> None:
        """Let a manoeuvre follow on a straight leg, and a straight leg or a rest on a manoeuvre."""
        n = len(which)
        was = legs.mode[which]
        halt(x, P, which[(was == ALONG) & (legs.times[which] == 0)])
        v = np.maximum(np.hypot(x[which, 1], x[which, 3]), 1e-9)
        dice = rng.random(n)
        new = np.where(was != STRAIGHT, STRAIGHT, np.where((dice < ALONGS) | (v < SLOWEST), ALONG, ACROSS))
        legs.mode[which], legs.age[which] = new, 0.0
        rising = np.clip((self.speed[1] - np.log(v)) / (self.speed[1] - self.speed[0]), 0.0, 1.0)
        either = np.where(rng.random(n) < np.where(new == ALONG, rising, 0.5), 1.0, -1.0)
        legs.sign[which] = either
        goes_round = self.kind.circles & (dice < 0.7) & (new == ACROSS)
        legs.times[which] = np.where(goes_round, rng.integers(2, 8, n), 1)
        if self.rests:
            stops = (new == ALONG) & (v > SLOWEST) & (rng.random(n) < STOPS)
            legs.times[which[stops]], legs.sign[which[stops]] = 0, -1.0
        width = (self.sharp[1] - self.sharp[0]) / STRATA
        moved = new != STRAIGHT
        at = which[moved]
        x[at, 4] = self.sharp[0] + width * (rng.integers(0, STRATA, len(at)) + 0.5)
        P[at, 4, :], P[at, :, 4] = 0.0, 0.0
        P[at, 4, 4] = width**2 / 12
        still = which[~moved]
        P[still, 4, :], P[still, :, 4] = 0.0, 0.0


class Forgetful(Law):
    """How a class moves, to who does not know how long legs last: as long as any of the class yet, at any age."""

    knows_calm = True  # that some objects never manoeuvre

    def straight(self) -> float:
        """Return how long a straight leg lasts, s, in the mean."""
        return max(mean(self.kind.leg), LEAST_LEG * self.scan)

    def remaining(self, legs: Legs, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the time that each leg still lasts, at quantile u of what is possible."""
        rate, longest = self.ending(legs, x)
        return np.minimum(-np.log1p(-np.minimum(u, 1 - 1e-12)) / np.maximum(rate, 1e-300), longest)

    def share_ending(self, legs: Legs, x: np.ndarray, d: float) -> np.ndarray:
        """Return the probability that each leg ends within d seconds."""
        rate, longest = self.ending(legs, x)
        return np.where(longest <= d, 1.0, -np.expm1(-rate * d))

    def ending(self, legs: Legs, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return at what rate each leg ends, 1/s, and what it lasts at most: nothing slows beyond rest."""
        v, a = np.maximum(np.hypot(x[:, 1], x[:, 3]), 1e-9), np.exp(x[:, 4])
        among = np.exp(np.linspace(self.speed[0], self.speed[1], 200))
        change = np.mean(np.abs(among[:, None] - among))
        angle = 0.5 * (0.35 + np.pi) * (0.7 * 4.5 + 0.3 if self.kind.circles else 1.0)
        rate = np.select([legs.mode == ALONG, legs.mode == ACROSS], [a / change, a / (v * angle)], 1 / self.straight())
        stops = (legs.mode == ALONG) & (legs.times == 0)
        slows = (legs.mode == ALONG) & (legs.sign < 0) & ~stops
        rate[stops], longest = 0.0, np.full(len(v), np.inf)
        longest[stops] = (v / a)[stops]
        longest[slows] = (np.maximum(v - 0.5 * np.exp(self.speed[0]), 0.0) / a)[slows]
        if self.knows_calm:
            rate[legs.calm & (v > SLOWEST)] = 0.0
        return rate, longest


class Stranger(Forgetful):
    """How anything moves, to who is told of a class what is fast, and nothing else: as the courses of a track have it.

    Any speed up to a third more than fast, manoeuvres of any strength, one of a hundred plots begins one.
    """

    knows_calm = False

    def __init__(self, kind: Kind, scan: float, rests: bool = False):
        gentlest = kind.told / GENTLE
        sharp = gentlest * STRENGTHS[0] / 3, gentlest * STRENGTHS[-1] * 2
        speed = 0.02 * kind.told, 1.3 * kind.told
        super().__init__(kind._replace(speed=speed, acceleration=sharp, circles=False), scan, rests)
        self.wobble = WOBBLES * gentlest * np.sqrt(scan)

    def straight(self) -> float:
        """Return how long a straight leg lasts, s, in the mean."""
        return self.scan / BEGINS


def mean(span: tuple[float, float]) -> float:
    """Return the mean of a number whose logarithm is uniform."""
    return float((span[1] - span[0]) / np.log(span[1] / span[0]))


def halt(x: np.ndarray, P: np.ndarray, which: np.ndarray) -> None:
    """Let some rest: they keep a way and nothing else of their velocity."""
    v = np.maximum(np.hypot(x[which, 1], x[which, 3]), 1e-300)
    for h in (1, 3):
        x[which, h] *= RESTING / v
        P[which, h, :] = P[which, :, h] = 0.0
        P[which, h, h] = (HEADING * RESTING) ** 2


def move(legs: Legs, x: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Return where states are d seconds on, in the same leg."""
    made = x.copy()
    v, a = np.hypot(x[:, 1], x[:, 3]), np.exp(x[:, 4]) * legs.sign
    safe = np.maximum(v, 1e-12)
    along = np.where(legs.mode == ALONG, a, 0.0)
    gain = d + 0.5 * along * d * d / safe  # of the way, in units of the velocity
    turn = np.where(legs.mode == ACROSS, a / safe * d, 0.0)
    small = np.abs(turn) < 1e-6
    s = np.where(small, 1.0, np.sin(turn) / np.where(small, 1.0, turn))
    c = np.where(small, 0.5 * turn, (1 - np.cos(turn)) / np.where(small, 1.0, turn))
    vE, vN = x[:, 1], x[:, 3]
    made[:, 0] += gain * (s * vE + c * vN)  # to the right is positive
    made[:, 2] += gain * (s * vN - c * vE)
    k = np.maximum(1 + along * d / safe, 1e-9)  # nothing slows beyond rest
    made[:, 1] = k * (vE * np.cos(turn) + vN * np.sin(turn))
    made[:, 3] = k * (vN * np.cos(turn) - vE * np.sin(turn))
    return made
