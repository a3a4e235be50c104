"""What it costs to let a window estimate a line of known frequency, and what it costs not to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..engine.errors import InputError
from ..estimators.window_observer.gains import WORST
from ..estimators.window_observer.horizon import Horizon
from ..models.plant import Augmented, Sinusoid

LIES = 1.5  # error over standard deviation that is worth a word


@dataclass(frozen=True)
class Price:
    """What it costs to let a window have a sinusoid of known frequency, and what it costs to leave it out.

    Attributes
    ----------
    w : frequency in rad/s
    amplitude : of q, as given, or sqrt(2) times its prior deviation; NaN where neither is known
    in_output : (p,) the amplitude it makes in each output
    break_even : seconds. Shorter windows lose more by estimating the line than by leaving it out
    added : (K, n) standard deviation that the line adds to each state of the plant, for each window
    lost : (n,) error of each state, as an amplitude, where the line is left out
    error : (K, n) root mean square error of each state at this amplitude, with the prior as stated. Above the standard
        deviation where the prior is too tight: the deviation then lies
    prior_std : as stated, the larger of two
    """

    w: float
    amplitude: float
    in_output: np.ndarray
    break_even: float
    added: np.ndarray
    lost: np.ndarray
    error: np.ndarray
    prior_std: float

    def notes(self, windows, std, names) -> list[str]:
        """Return what to beware of, in words."""
        line = f"{self.w:g} rad/s"
        if math.isnan(self.amplitude):
            return [f"{line}: how large may it be? Say amplitudes={{{self.w:g}: ..}}"]
        found, short = [], windows[windows < self.break_even]
        if len(short) and math.isinf(self.prior_std):
            which = "every window here" if len(short) == len(windows) else f"windows up to {short.max():g} s"
            found.append(
                f"{line} costs more than it removes in {which} (break-even {self.break_even:.4g} s): "
                "leave it out, or state a finite prior_std"
            )
        known = np.isfinite(std[:, : self.error.shape[1]])
        lies = np.where(known, self.error / np.where(known, std[:, : self.error.shape[1]], 1.0), 0.0)
        k, i = np.unravel_index(np.argmax(lies), lies.shape)
        if lies[k, i] > LIES:
            found.append(
                f"{line}: prior_std {self.prior_std:g} is too tight for an amplitude of {self.amplitude:g}; "
                f"{names[i]} is {lies[k, i]:.2g} times as wrong as its deviation says ({windows[k]:g} s)"
            )
        return found


def prices(horizon, std, samples, amplitudes) -> list[Price]:
    """Return what each sinusoid costs: the same table without it."""
    whole, n = horizon.augmented, horizon.augmented.n
    lines = [q for q in whole.disturbances if isinstance(q, Sinusoid)]
    unknown = set(amplitudes) - {q.w for q in lines}
    if unknown:
        raise InputError(f"amplitudes names {sorted(unknown)} rad/s, but the sinusoids are {[q.w for q in lines]}")
    sizes = [2 if isinstance(q, Sinusoid) else q.degree + 1 for q in whole.disturbances]
    firsts = n + np.cumsum([0, *sizes])
    places = [(int(first), q) for first, q in zip(firsts, whole.disturbances) if isinstance(q, Sinusoid)]
    return [_price(horizon, line, first, std, samples, amplitudes.get(line.w)) for first, line in places]


def _price(horizon, line, first, std, samples, amplitude) -> Price:
    """Return what one sinusoid costs, whose states begin at ``first``: the table without it, and what it does."""
    whole, n, prior = horizon.augmented, horizon.augmented.n, float(np.max(line.prior_std))
    without = Augmented(whole.plant, [q for q in whole.disturbances if q is not line])
    bare = Horizon(without, horizon.dt, horizon.noise_std)
    less = np.array([bare.std(L)[:n] for L in samples])
    with np.errstate(invalid="ignore"):
        added = np.where(np.isfinite(std[:, :n]), np.sqrt(np.maximum(std[:, :n] ** 2 - less**2, 0)), np.inf)
    alone = Augmented(whole.plant, line)
    states = np.linalg.solve(1j * line.w * np.eye(n) - alone.A[:n, :n], alone.A[:n, n])
    if amplitude is None:
        amplitude = math.sqrt(2) * prior if 0 < prior < math.inf else math.nan
    seen = amplitude * np.abs(alone.H[:, :n] @ states + alone.H[:, n])
    power = float(np.sum((seen / horizon.noise_std) ** 2))
    break_even = 2 * horizon.dt / power if power > 0 else math.nan if math.isnan(power) else math.inf
    lost = amplitude * np.abs(states)
    error = [s[:n] ** 2 + _beyond(horizon, line, first, amplitude, lost, L) for s, L in zip(std, samples)]
    return Price(line.w, float(amplitude), seen, break_even, added, lost, np.sqrt(error), prior)


def _beyond(horizon, line, first, amplitude, lost, samples) -> np.ndarray:
    """Return the mean square error (n,) that a sinusoid of this amplitude makes beyond what its prior allows for."""
    system, n = horizon.augmented, horizon.augmented.n
    prior = np.broadcast_to(line.prior_std, 2).astype(float)
    if np.all(prior == 0):
        return lost**2 / 2
    if np.any((prior == 0) | np.isinf(prior)) or horizon.condition(samples) > WORST:
        return np.full(n, 0 * amplitude)
    soft = np.flatnonzero(np.isfinite(system.prior_std) & (system.prior_std > 0))
    K = horizon.errors(samples)[1][:n, np.isin(soft, [first, first + 1])]
    return (K**2) @ (amplitude**2 / 2 / prior**2 - 1)
