"""Least squares on the samples themselves: Gauss-Newton over a, everything else by linear regression inside it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...engine.errors import InputError
from .responses import Plan, responses

SWEEPS = 60  # corrections at most
SHORT = 1e-13  # a correction that does nothing
FASTEST = 40.0  # a pole times the longest step: beyond it every sample is at rest
LARGEST = 1e60  # responses beyond it have overflowed as good as


class Fit(NamedTuple):
    """Where the search ended: ``linear`` are b of each input, x(0), and the disturbance's amplitudes."""

    a: np.ndarray
    linear: np.ndarray
    outputs: np.ndarray  # (T,) the model's
    slopes: np.ndarray  # (T, n + c) in a and ``linear``
    Z: np.ndarray  # responses at the last sample, (d, c)
    error: np.ndarray  # (T,) of the measured samples, 0 elsewhere

    @property
    def rss(self) -> float:
        """Sum of squared errors."""
        return float(self.error @ self.error)


def at(plan: Plan, a, y, is_measured, b=None) -> Fit | None:
    """Return the best fit of these a (and b, where given); None where they overflow, or no sample would show them."""
    n, fixed = plan.n, 0 if b is None else b.size
    if not np.all(abs(a) < LARGEST) or max(abs(np.roots(np.append(1.0, a)))) * plan.steps.max() > FASTEST:
        return None
    Z, _ = responses(plan, a)
    if not np.all(abs(Z) < LARGEST):
        return None
    Y = Z[:, 0, :]
    free, target = Y[is_measured, fixed:], y[is_measured]
    if fixed:
        target = target - Y[is_measured, :fixed] @ b.ravel()
    size = lengths(free)
    linear = np.linalg.lstsq(free / size, target, rcond=1e-14)[0] / size
    if fixed:
        linear = np.concatenate([b.ravel(), linear])
    outputs = Y @ linear
    slope = -(Z[:, -n:] @ linear)[:, ::-1]
    return Fit(a, linear, outputs, np.concatenate([slope, Y], axis=1), Z[-1], np.where(is_measured, y - outputs, 0.0))


def begin(plan: Plan, a, y, is_measured) -> Fit:
    """Return the fit at a; where there is none, at its poles mirrored; else at poles as slow as the record."""
    poles = np.roots(np.append(1.0, a)) if np.isfinite(a).all() else np.full(plan.n, np.inf)
    mirrored = np.poly(-abs(poles.real) + 1j * poles.imag)[1:].real
    fits = (at(plan, start, y, is_measured) for start in (a, mirrored, np.poly(-np.ones(plan.n))[1:]))
    fit = next((fit for fit in fits if fit is not None), None)
    if fit is None:
        raise InputError("no plant has a finite response at these instants: is time in seconds?")
    return fit


def refine(plan: Plan, a, y, is_measured) -> Fit:
    """Return the fit of least squares nearest to a: variable projection (Kaufman), damped where a step fails."""
    n, best, damping = plan.n, begin(plan, a, y, is_measured), 0.0
    for _ in range(SWEEPS):
        J = best.slopes[is_measured]
        Q = np.linalg.qr(J[:, n:] / lengths(J[:, n:]))[0]
        own = J[:, :n] - Q @ (Q.T @ J[:, :n])
        size = lengths(own)
        rows = np.concatenate([own / size, np.sqrt(damping) * np.eye(n)])
        step = np.linalg.lstsq(rows, np.append(best.error[is_measured], np.zeros(n)), rcond=1e-12)[0] / size
        found = at(plan, best.a + step, y, is_measured)
        if found is not None and found.rss < best.rss:
            is_done = best.rss - found.rss <= 1e-14 * best.rss and damping == 0
            best, damping = found, damping / 10 if damping > 1e-6 else 0.0
        else:
            is_done = damping > 1e6 or bool(np.all(abs(step) <= SHORT * (1 + abs(best.a))))
            damping = max(10 * damping, 1e-3)
        if is_done:
            break
    return best


def lengths(X) -> np.ndarray:
    """Return the lengths of the columns, 1 for one that is zero."""
    size = np.linalg.norm(X, axis=0)
    return np.where(size > 0, size, 1.0)
