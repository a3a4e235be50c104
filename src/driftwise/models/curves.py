"""Curves of an estimated model with their bands: step response, Bode, Nyquist; poles with damping and frequency."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .filtering import many_filters
from .quantities import NORMAL_95

DRAWN = 400  # of the posterior, for the band of a step response
SETTLED, MOST = 5.0, 400  # time constants that a step response lasts; samples at most
FREQUENCIES = 160
SLOW = 0.999  # a pole nearer the circle counts as that


class Mode(NamedTuple):
    """A pole, or a pair of them, in time; NaN where there is no such number.

    ``damping`` is that of the pole ln(p)/dt in continuous time, ``hertz`` its undamped frequency |ln p|/(2 pi dt).
    """

    pole: complex
    modulus: float
    modulus_std: float
    time_constant: float
    time_constant_std: float
    damping: float
    damping_std: float
    hertz: float
    hertz_std: float


class Curve(NamedTuple):
    """A curve over x with its 95 % band."""

    x: np.ndarray
    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Frequencies(NamedTuple):
    """The frequency response from one input at ``hertz``: gain and phase (degrees) with bands, and the points G."""

    hertz: np.ndarray
    gain: Curve
    phase: Curve
    response: np.ndarray
    covariance: np.ndarray  # (F, 2, 2) of real and imaginary part


def _deviation(direction: np.ndarray, P: np.ndarray) -> float:
    """Return the deviation of direction' x, x of covariance P; infinite where no accuracy is claimed."""
    return math.sqrt(max(direction @ P @ direction, 0.0)) if np.isfinite(P).all() else math.inf


def modes(model, dt: float) -> list[Mode]:
    """Return the poles of a model in time, first order; the lower one of a pair, and what only delays, left out."""
    found = []
    for p, P in zip(model.poles, model.poles_covariance):
        if p.imag < 0:
            continue
        r = abs(p)
        if r < 1e-9:  # a delay
            continue
        s = complex(np.log(complex(p))) / dt
        turn = np.array([[p.real, p.imag], [-p.imag, p.real]]) / (r * r * dt)  # ds of dp, as real and imaginary part
        w = abs(s)
        radial = np.array([p.real, p.imag]) / r
        tau = -1 / s.real if s.real < 0 else math.inf
        tau_std = _deviation(turn[0], P) / s.real**2 if s.real else math.inf
        along = np.array([s.real, s.imag]) / w if w else np.zeros(2)
        damping = -s.real / w if w else math.nan
        slope = np.array([-1 / w + s.real**2 / w**3, s.real * s.imag / w**3]) if w else np.zeros(2)
        is_pair = p.imag > 0 or p.real < 0
        hertz = w / (2 * math.pi)
        found.append(
            Mode(
                p, r, _deviation(radial, P), tau, tau_std,
                damping if is_pair else math.nan, _deviation(slope @ turn, P) if is_pair else math.nan,
                hertz, _deviation(along @ turn, P) / (2 * math.pi),
            )
        )  # fmt: skip
    return found


def step_response(model, input: int, dt: float) -> Curve:
    """Return what the output does after a step of one in an input; the band is made of draws from the posterior."""
    one, at = (model.channel(input), 0) if hasattr(model, "channel") else (model, input)
    sizes = np.abs(model.poles[np.isfinite(model.poles)])
    slow = min(float(sizes.max(initial=0.0)), SLOW)
    dead = int(np.argmax(np.append(np.abs(one.form.polynomials(one.values)[1][at]), 1.0) > 0))
    size = min(max(int(SETTLED / -math.log(max(slow, 0.05))) + dead, 12), MOST)
    a, b = one.form.polynomials(np.vstack([one.values, one.samples[:DRAWN]]))
    with np.errstate(over="ignore", invalid="ignore"):
        value, *drawn = many_filters(b[:, at], a, np.ones(size))
    low, high = np.quantile(np.nan_to_num(drawn, nan=0.0, posinf=1e300, neginf=-1e300), [0.025, 0.975], axis=0)
    return Curve(dt * np.arange(size), value, low, high)


def frequency_response(model, input: int, dt: float) -> Frequencies:
    """Return gain, phase and their bands between a thousandth of the Nyquist frequency and it; first order."""
    hertz = np.geomspace(5e-4, 0.5, FREQUENCIES) / dt
    G, C = (part[input] for part in model.frequency_response(2 * math.pi * hertz))
    size = np.abs(G)
    radial = np.stack([G.real, G.imag], axis=1) / np.where(size > 0, size, 1.0)[:, None]
    across = np.stack([-radial[:, 1], radial[:, 0]], axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        along_std, across_std = (np.sqrt(np.einsum("fi,fij,fj->f", v, C, v).clip(0)) / size for v in (radial, across))
        band = np.exp(np.minimum(NORMAL_95 * along_std, 700.0))
        angle = np.degrees(np.unwrap(np.angle(G)))
        turn = np.minimum(np.degrees(NORMAL_95 * across_std), 180.0)
        gain = Curve(hertz, size, size / band, size * band)
    return Frequencies(hertz, gain, Curve(hertz, angle, angle - turn, angle + turn), G, C)
