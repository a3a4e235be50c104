"""Is there a sinusoidal disturbance, and at which frequency? Least squares over w, and a test against the noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from ..engine import validation
from ..engine.errors import InputError
from ..estimators.window_observer.gains import Design
from ..models.plant import Augmented, Plant, Sinusoid

STEP = 1 / 8  # of the grid, in widths 2 pi/T of a line
SPANNED = 1e-6  # what is left of a line, relative, that plant and other disturbances can make as well


@dataclass(frozen=True)
class Line:
    """The most visible sinusoid in a band, and whether it beats the noise.

    Attributes
    ----------
    w, w_std : frequency in rad/s, and its standard deviation (NaN where no line is visible)
    amplitude, amplitude_std : of the disturbance q, in its units (NaN where no line is visible)
    in_output : (p,) its amplitude in each output
    statistic : how much the line lowers the sum of squared errors, in noise variances; chi-square of 2 degrees at a
        given frequency where there is none
    threshold : what the largest statistic in the band exceeds with probability ``risk`` where there is none
    probability : of a statistic as large anywhere in the band where there is none
    candidate : frequency of the largest statistic, visible or not
    frequencies, statistics : (M,) the scan
    smallest : (M,) amplitude of q that would just reach the threshold at each of the frequencies
    """

    w: float
    w_std: float
    amplitude: float
    amplitude_std: float
    in_output: np.ndarray
    statistic: float
    threshold: float
    probability: float
    candidate: float
    frequencies: np.ndarray
    statistics: np.ndarray
    smallest: np.ndarray

    @property
    def is_visible(self) -> bool:
        """Whether the line beats the noise."""
        return self.statistic > self.threshold

    @property
    def words(self) -> str:
        """The verdict in a sentence."""
        if not self.is_visible:
            return (
                f"not identifiable: no line beats the noise (largest statistic {self.statistic:.1f} at "
                f"{self.candidate:.4g} rad/s, {self.threshold:.1f} needed); an amplitude of {self.smallest[0]:.3g} "
                f"could be seen at {self.frequencies[0]:.4g} rad/s, one of {self.smallest[-1]:.3g} at "
                f"{self.frequencies[-1]:.4g} rad/s"
            )
        return (
            f"a line at {self.w:.5g} ± {self.w_std:.2g} rad/s, amplitude {self.amplitude:.3g} ± "
            f"{self.amplitude_std:.2g} (statistic {self.statistic:.1f}, {self.threshold:.1f} needed)"
        )

    def __repr__(self):
        return f"Line({self.words})"


def find_frequency(
    plant: Plant,
    y,
    u=None,
    *,
    dt: float,
    noise_std,
    band,
    into=0.0,
    outputs=0.0,
    disturbances=(),
    window: float | None = None,
    hold: str | None = None,
    risk: float = 1e-3,
) -> Line:
    """Return the sinusoidal disturbance that the last ``window`` seconds of a record show best, and whether they do.

    For each w, least squares on the window with [x; q] and a sinusoid of unknown amplitude and phase; then w itself
    by the same least squares. A line is visible where it lowers the sum of squares by more than chance does anywhere
    in the band (Davies 1987, as Baluev 2008 has it for a scan over frequencies): with z = statistic/2 and
    W = (band/2 pi) T sqrt(pi/3),

        P(largest > statistic) <= (1 + W sqrt(z)) exp(-z)

    Parameters
    ----------
    plant : Plant
    y : (T,) or (T, p) outputs; NaN where missing
    u : (T,) or (T, k) inputs
    dt : seconds between samples
    noise_std : standard deviation of the noise, of each output
    band : (lowest, highest) frequency in rad/s
    into, outputs : how the sinusoid enters each x', and each output, as in `Sinusoid`
    disturbances : what else disturbs the plant
    window : seconds; the whole record if omitted
    hold : "zoh" or "foh", what the inputs do between samples; required with inputs
    risk : probability of seeing a line where there is none

    Notes
    -----
    The noncentrality of the statistic is L A^2/(2 sigma^2), A the line's amplitude in y: see `Line.smallest`. Bad at:
    two lines closer than 2 pi/T, noise that is not white (it looks like lines), frequencies that drift.
    The closed form that is linear in w^2 is not offered: with noise it is biased, the more so the more data.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> t, rng = np.arange(1000) * 0.01, np.random.default_rng(0)
    >>> y = 3.0 + 0.5 * np.sin(7.0 * t + 1.0) + rng.standard_normal(1000)
    >>> drifting = dw.Plant([[0.0]])                                       # an unknown constant
    >>> print(dw.analysis.find_frequency(drifting, y, dt=0.01, noise_std=1.0, band=(1, 100), outputs=1.0).words)
    a line at 6.9581 ± 0.033 rad/s, amplitude 0.477 ± 0.045 (statistic 114.7, 26.6 needed)
    """
    augmented = Augmented(plant, disturbances)
    y, u = _record(augmented, y, u)
    dt = validation.size("dt", dt)
    sigma = validation.sizes("noise_std", noise_std, augmented.outputs)
    low, high = _band(band, dt)
    if not (isinstance(risk, float) and 0 < risk < 1):
        raise InputError(f"risk must be a probability between 0 and 1, got {risk!r}")
    count = len(y) if window is None else round(validation.positive("window", window) / dt)
    if count > len(y):
        raise InputError(f"window is {window:g} s but the record has {len(y) * dt:g} s")
    line = Augmented(plant, Sinusoid(low, into, math.inf, outputs=outputs))
    hold = validation.hold(hold, augmented.inputs)
    seen = _Seen(augmented, line, y[-count:] - forced(augmented, u[-count:], dt, hold)[1], dt, sigma)
    width = 2 * math.pi / (count * dt)
    grid = np.linspace(low, high, 2 + math.ceil((high - low) / (STEP * width)))
    found = [seen.line(w) for w in grid]
    statistics, sizes = np.array([(one.statistic, one.size) for one in found]).T
    at = grid[statistics.argmax()]
    near = max(low, at - STEP * width), min(high, at + STEP * width)
    best = minimize_scalar(
        lambda w: -seen.line(w).statistic, bounds=near, method="bounded", options={"xatol": 1e-6 * width}
    )
    w = float(best.x) if -best.fun > statistics.max() else float(at)
    trials = (high - low) / (2 * math.pi) * count * dt * math.sqrt(math.pi / 3)
    return _verdict(seen, w, risk, trials, grid, statistics, sizes)


class _Found(NamedTuple):
    statistic: float
    k: complex  # q = Re(k exp(i w t)), t = 0 at the last sample
    size: float  # root of the statistic that |k| = 1 makes, on average over its phase


class _Seen:
    """A window of data, what the inputs do taken out, beside what plant and disturbances can do."""

    def __init__(self, augmented, line, y, dt, sigma):
        augmented.require_observable()
        n = augmented.n
        self.A, self.C, self.sigma = augmented.A[:n, :n], augmented.H[:, :n], sigma
        self.into, self.direct = line.A[:n, n], line.H[:, n]  # how q enters
        design = Design(augmented, dt, len(y), sigma)
        there = np.isfinite(y)
        rows = np.vstack([design.rows[there], design.prior])
        if len(rows) < rows.shape[1] + 4:
            raise InputError(f"{int(there.sum())} measured values are too few for {rows.shape[1]} unknowns and a line")
        self.t = np.repeat((np.arange(len(y)) - len(y) + 1.0) * dt, augmented.outputs)[there.ravel()]
        self.channel = np.tile(np.arange(augmented.outputs), len(y))[there.ravel()]
        self.Q = np.linalg.qr(rows / np.maximum(np.linalg.norm(rows, axis=0), 1e-300))[0]
        self.priors = len(design.prior)
        self.r = self.without(np.concatenate([(y / sigma)[there], np.zeros(self.priors)]))

    def without(self, v):
        """Return what the plant and the other disturbances leave of v."""
        return v - self.Q @ (self.Q.T @ v)

    def response(self, w, slope=False):
        """Return g of q = Re(k exp(i w t)), y = Re(k g exp(i w t)), or dg/dw."""
        pencil = 1j * w * np.eye(len(self.A)) - self.A
        x = np.linalg.solve(pencil, self.into)
        return self.C @ np.linalg.solve(pencil, -1j * x) if slope else self.C @ x + self.direct

    def wave(self, w, slope=False):
        """Return g exp(i w t) as each value shows it, complex; or with dg/dw."""
        return (self.response(w, slope) / self.sigma)[self.channel] * np.exp(1j * w * self.t)

    def columns(self, *waves):
        """Return real columns, the others taken out."""
        stacked = np.stack(waves, axis=1)
        return self.without(np.concatenate([stacked, np.zeros((self.priors, len(waves)))]))

    def line(self, w):
        """Return what a sinusoid of frequency w explains."""
        wave = self.wave(w)
        norm = np.linalg.norm(wave) or 1.0
        X = self.columns(wave.real, -wave.imag) / norm
        U, values, V = np.linalg.svd(X, full_matrices=False)
        kept = values > SPANNED
        found = U[:, kept].T @ self.r
        real, imag = V[kept].T @ (found / values[kept]) / norm
        return _Found(float(found @ found), complex(real, imag), float(norm * np.linalg.norm(values) / math.sqrt(2)))

    def spread(self, w, k):
        """Return the standard deviations of |k| and of w (Cramer and Rao)."""
        wave = self.wave(w)
        turn = (k * (self.wave(w, slope=True) + 1j * self.t * wave)).real
        wave = wave * k / abs(k)
        X = self.columns(wave.real, -wave.imag, turn)
        size = np.linalg.norm(X, axis=0)
        root = np.linalg.norm(np.linalg.pinv(X / size), axis=1) / size
        return float(root[0]), float(root[2])


def _verdict(seen, w, risk, trials, grid, statistics, sizes) -> Line:
    statistic, k, _ = seen.line(w)
    threshold = 2 * brentq(lambda z: chance(z, trials) - risk, 0.0, 1e4)
    gain = np.abs(seen.response(w))
    amplitude_std, w_std = seen.spread(w, k) if abs(k) > 0 else (np.nan, np.nan)
    hidden = np.nan if statistic <= threshold else 1.0
    return Line(
        w=w * hidden,
        w_std=w_std * hidden,
        amplitude=abs(k) * hidden,
        amplitude_std=amplitude_std * hidden,
        in_output=abs(k) * gain * hidden,
        statistic=statistic,
        threshold=threshold,
        probability=min(1.0, chance(statistic / 2, trials)),
        candidate=w,
        frequencies=grid,
        statistics=statistics,
        smallest=math.sqrt(threshold) / np.maximum(sizes, 1e-300),
    )


def chance(z: float, trials: float) -> float:
    """Return a bound of the probability that the largest statistic of pure noise exceeds 2 z."""
    return (1 + trials * math.sqrt(z)) * math.exp(-z)


def forced(augmented: Augmented, u, dt: float, hold: str):
    """Return z (T, m) and y (T, p) of a plant at rest under the inputs u (T, k) alone."""
    Phi, G0, G1 = augmented.discretise(dt, hold)
    z = np.zeros((len(u), augmented.m))
    for t in range(1, len(u)):
        z[t] = Phi @ z[t - 1] + G0 @ u[t - 1] + G1 @ u[t]
    return z, z @ augmented.H.T + u @ augmented.D.T


def _record(augmented, y, u):
    y, u = validation.record(y, u, augmented.inputs, augmented.outputs)
    if np.isnan(u).any():
        raise InputError("u is missing (NaN) somewhere: what it does to the plant cannot be taken out. Fill it first")
    return y, u


def _band(band, dt):
    try:
        low, high = (float(w) for w in band)
    except (TypeError, ValueError):
        low = high = math.nan
    if not 0 < low < high <= math.pi / dt:
        raise InputError(
            f"band must be (lowest, highest) in rad/s, positive and up to pi/dt = {math.pi / dt:.4g}, got {band!r}"
        )
    return low, high
