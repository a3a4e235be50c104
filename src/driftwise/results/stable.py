"""Is the model stable? The largest pole, and how sure that is."""

from __future__ import annotations

import math

import numpy as np

from .verdicts import Verdict

NEAR = 0.05  # to one, within which an uncertain pole is called an integrator
SEEN = 4.0  # time constants that a record must hold, for the end of an answer to be seen


def is_integrator(p: complex, std: float) -> bool:
    """Say whether a pole cannot be told from one, and is near it: far away that only says how little is known."""
    return abs(p - 1) < min(max(2 * std, 1e-6), NEAR) if math.isfinite(std) else False


def is_endless(size: float, std: float, count: int) -> bool:
    """Say whether ``count`` samples leave open that a mode of this modulus never ends: it has no gain, then.

    Its modulus cannot be told from one, or so little of it dies out within the record that the end was not seen.
    """
    return is_integrator(size, std) or 1 - size < SEEN / max(count, 1)


def runs_away(size: float, std: float) -> bool:
    """Say whether a mode of this modulus surely grows: it has no gain, either."""
    return size - 2 * std > 1


def swings(p: complex) -> bool:
    """Say whether a mode is seen to swing: a twentieth is left of it, at least, half a period later."""
    return abs(p.imag) > 1e-9 and abs(p) ** (math.pi / abs(math.atan2(p.imag, p.real))) > 0.05


def moduli(model, dt) -> tuple[np.ndarray, np.ndarray]:
    """Return the modulus of each pole in discrete time and its standard deviation: that of the radial direction."""
    poles, C = np.asarray(model.poles), np.asarray(model.poles_covariance)
    if getattr(model, "is_continuous", False):
        size = np.exp(poles.real * dt)
        return size, size * dt * np.sqrt(C[:, 0, 0])
    size = np.abs(poles)
    way = np.where(size > 0, poles, 1.0) / np.where(size > 0, size, 1.0)
    radial = np.column_stack([way.real, way.imag])
    with np.errstate(invalid="ignore"):
        variance = np.einsum("ia,iab,ib->i", radial, C, radial)
    return size, np.sqrt(np.where(np.isfinite(variance), np.maximum(variance, 0.0), math.inf))


def turns(model, dt) -> np.ndarray:
    """Return the standard deviation of the angle of each pole in discrete time, in radians a sample."""
    poles, C = np.asarray(model.poles), np.asarray(model.poles_covariance)
    if getattr(model, "is_continuous", False):
        return dt * np.sqrt(C[:, 1, 1])
    size = np.abs(poles)
    with np.errstate(invalid="ignore", divide="ignore"):
        across = np.column_stack([-poles.imag, poles.real]) / size[:, None] ** 2
        variance = np.einsum("ia,iab,ib->i", across, C, across)
    return np.sqrt(np.where(np.isfinite(variance), np.maximum(variance, 0.0), math.inf))


def stability(s, level: float) -> Verdict:
    """Return the verdict on the largest pole of a `Summary`'s model: inside the circle at that level, or not."""
    from scipy.special import ndtri

    if not s.is_enough or not len(s.model.poles):
        return Verdict("stability", math.nan, (0.0, 1.0), True, "too few samples to tell whether the model is stable")
    size, std = moduli(s.model, s.estimator.dt)
    z = float(ndtri(level))
    reach = size + z * np.where(np.isfinite(std), std, 1e9)
    worst = int(np.argmax(reach if reach.max() >= 1 else size))
    p, spread = float(size[worst]), float(std[worst])
    limits, said = (0.0, 1 - z * spread), f"{p:.4g} \u00b1 {spread:.2g}"
    whose = "largest pole modulus" if worst == int(np.argmax(size)) else "modulus of the least known pole"
    if not math.isfinite(spread):
        return Verdict("stability", p, (0.0, 1.0), p < 1, f"largest pole modulus {p:.4g}, of which no bound is known")
    if p < limits[1]:
        return Verdict("stability", p, limits, True, f"largest pole modulus {said}: stable")
    if p - z * spread > 1:
        advice = f"the model is unstable, its largest pole modulus is {said}: forecasts far ahead run away"
        return Verdict("stability", p, limits, False, advice)
    at, model = complex(s.model.poles[worst]), s.model
    what = "an oscillation that never dies out" if at.imag or at.real < 0 else "an integrator"
    what = f" ({what})" if 1 - p < NEAR else ", so little is known of it"
    advice = f"the {whose}, {said}, cannot be told from 1{what}: where the plant settles, record longer"
    gains = np.atleast_1d(getattr(model, "dc_gain_std", ())) if s.estimator.model.inputs else np.empty(0)
    if gains.size and not np.isfinite(gains).all():
        advice += " or take the offset off; the steady-state gain has no bound"
    return Verdict("stability", p, limits, False, advice)
