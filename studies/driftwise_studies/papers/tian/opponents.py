"""Who else can watch the motor: Kalman filters well and badly tuned, observers of Luenberger, Savitzky-Golay.

Every one is a function of y (S, T) and u (T,) that returns [x1, x2, x3] (S, T, 3), NaN where it has no estimate. Gains
do not depend on the data, so they are computed once and all seeds run together. The input is a straight line between
its samples: 2e-6 V from 24 sin t. Filters start from zero. Poles and the walks of the steady-state observer were found
by hand, so that each does about as well as its kind can.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import solve_discrete_are
from scipy.signal import oaconvolve, place_poles

from driftwise.models.plant import Augmented

from .motor import K1, RATE, SIGMA, J, Told, constant, cosine, modes, motor

PRIOR = (10.0, 10.0, 30.0, 2.0, 2.0, 2.0)  # honest standard deviations of x and of the disturbances at t = 0
HONEST, TIGHT, TRUSTING, IGNORING = (
    "Kalman, honest prior",
    "Kalman, overconfident prior",
    "Kalman, R 100 times too small",
    "Kalman, ignoring the disturbance",
)
WALKING, STEADY = "Kalman, q1 walks 10/sqrt(s)", "steady-state Kalman observer"

Run = Callable[[np.ndarray, np.ndarray], np.ndarray]


def observe(model: Augmented, gain: np.ndarray, y: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the first three states of z <- zp + gain (y - zp_1), zp = Phi z + what the input does; gain (T, m)."""
    Phi, G0, G1 = model.discretise(1 / RATE, "foh")
    pushed = np.outer(u[:-1], G0) + np.outer(u[1:], G1)
    z, kept = np.zeros((len(y), model.m)), np.empty((*y.shape, 3))
    for k in range(y.shape[1]):
        if k:
            z = z @ Phi.T + pushed[k - 1]
        z = z + np.outer(y[:, k] - z[:, 0], gain[k])
        kept[:, k] = z[:, :3]
    return kept


@dataclass(frozen=True)
class Kalman:
    """The Kalman filter of a model from a prior (standard deviations at t = 0); Q from the model's walks."""

    model: Augmented
    prior_std: tuple[float, ...]
    variance: float = SIGMA**2

    def __call__(self, y: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the states (S, T, 3)."""
        return observe(self.model, gains(self, y.shape[1]), y, u)


@lru_cache(maxsize=8)
def gains(kalman: Kalman, samples: int) -> np.ndarray:
    """Return the gains (samples, m) of a Kalman filter, by the covariance form of Joseph."""
    model, variance = kalman.model, kalman.variance
    Phi, _, _ = model.discretise(1 / RATE, "foh")
    Q, P, H = model.noise(1 / RATE), np.diag(np.square(kalman.prior_std)), model.H[0]
    kept = np.empty((samples, model.m))
    for k in range(samples):
        if k:
            P = Phi @ P @ Phi.T + Q
        gain = kept[k] = P @ H / (H @ P @ H + variance)
        keep = np.eye(model.m) - np.outer(gain, H)
        P = keep @ P @ keep.T + variance * np.outer(gain, gain)
    return kept


@dataclass(frozen=True)
class Observer:
    """An observer with one gain (m,) for ever."""

    model: Augmented
    gain: np.ndarray

    def __call__(self, y: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the states (S, T, 3)."""
        return observe(self.model, np.broadcast_to(self.gain, (y.shape[1], self.model.m)), y, u)


def steady(model: Augmented, variance: float = SIGMA**2) -> Observer:
    """Return the observer with the gain at which the Kalman filter of a model with walks comes to rest."""
    Phi, _, _ = model.discretise(1 / RATE, "foh")
    H = model.H[0]
    P = solve_discrete_are(Phi.T, H[:, None], model.noise(1 / RATE), np.array([[variance]]))
    return Observer(model, P @ H / (H @ P @ H + variance))


def luenberger(model: Augmented, pole: float) -> Observer:
    """Return the observer of which the error has the poles ``pole``, 1.15 ``pole``, 1.3 ``pole``, .. (1/s)."""
    Phi, _, _ = model.discretise(1 / RATE, "foh")
    poles = pole * (1 + 0.15 * np.arange(model.m))
    placed = place_poles(Phi.T, (model.H @ Phi).T, np.exp(poles / RATE))
    return Observer(model, placed.gain_matrix[0])


def polynomial_weights(points: int, degree: int, at: float) -> np.ndarray:
    """Return weights (3, points), oldest first, of y, y', y'' of the best polynomial; ``at``: 1 its end, 0 its centre.

    Legendre polynomials on [-1, 1], made orthogonal on the points: powers of the index lose their digits here.
    """
    half = (points - 1) / 2
    Q, triangle = np.linalg.qr(legendre.legvander(np.linspace(-1, 1, points), degree))
    here = [[legendre.legval(at, legendre.legder(c, m)) for c in np.eye(degree + 1)] for m in range(3)]
    return np.linalg.solve(triangle.T, np.transpose(here)).T @ Q.T * (RATE / half) ** np.arange(3)[:, None]


@dataclass(frozen=True)
class SavitzkyGolay:
    """x1 = y, x2 = y', x3 = (J/K1) y'' of a polynomial over the last points; no model. Centred: half a window late."""

    points: int
    degree: int
    centred: bool = False

    def __call__(self, y: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the states (S, T, 3); the centred one where they belong in time, NaN at both ends."""
        weights = polynomial_weights(self.points, self.degree, 0.0 if self.centred else 1.0)
        first = self.points // 2 if self.centred else self.points - 1
        kept = np.full((*y.shape, 3), np.nan)
        for m, row in enumerate(weights):
            smooth = oaconvolve(y, row[None, ::-1], mode="valid", axes=1)
            kept[:, first : first + smooth.shape[1], m] = smooth
        kept[..., 2] *= J / K1
        return kept


@lru_cache(maxsize=8)
def filters(told: Told = Told()) -> dict[str, Run]:
    """Return the two filters that are compared under model errors: memory for ever, and a memory that fades."""
    return {
        HONEST: Kalman(modes(6, told), PRIOR),
        WALKING: Kalman(motor(told, constant(walk=10.0)), PRIOR[:4]),
    }


def opponents(told: Told = Told()) -> dict[str, Run]:
    """Return all of them."""
    six, four = modes(6, told), modes(4, told)
    return {
        **filters(told),
        TIGHT: Kalman(six, (0.01,) * 6),
        TRUSTING: Kalman(six, PRIOR, SIGMA**2 / 100),
        IGNORING: Kalman(modes(3, told), PRIOR[:3]),
        STEADY: steady(motor(told, constant(walk=1.0), cosine(told, walk=0.03))),
        "Luenberger, 4 states, poles from -8": luenberger(four, -8.0),
        "Luenberger, 4 states, poles from -4": luenberger(four, -4.0),
        "Luenberger, 6 states, poles from -2": luenberger(six, -2.0),
        "Luenberger, 6 states, poles from -8": luenberger(six, -8.0),
        "Savitzky-Golay, 501 points, degree 3": SavitzkyGolay(501, 3),
        "Savitzky-Golay, 1001 points, degree 4": SavitzkyGolay(1001, 4),
        "Savitzky-Golay, centred (offline), 1001 points, degree 4": SavitzkyGolay(1001, 4, centred=True),
    }
