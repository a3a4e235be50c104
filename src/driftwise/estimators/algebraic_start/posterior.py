"""What a fit says of a recursive filter's state: mean and covariance of [x(M); theta], whatever the noise."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter
from scipy.special import chdtri

from ...engine.errors import InputError
from ...engine.holding import held
from ...models.canonical import Canonical
from ...models.noise import Coloured, Sensor, White
from .discrete import canonical, slopes
from .search import Found, find
from .verdict import BLIND

CHANCE = 1e-3  # of refusing the right model because its errors look coloured, or too large
ROUNDING = 1e-8  # errors so small beside y are no noise, and need not look like it


class Task(NamedTuple):
    """What a start needs to know of its estimator."""

    samples: int
    form: Canonical  # of its parameters; the last input is the constant behind an offset, if there is one
    select: np.ndarray  # takes the parameters of ``form`` to the estimator's
    has_offset: bool
    states: int  # how many of x it keeps: order, or none
    zeros: int
    hold: str
    disturbance: int
    dt: float
    noise: Any  # the kernel's: White, Sensor, or Coloured
    R: float  # variance of the noise, relative to sigma^2
    is_known: bool  # where sigma^2 is one


class Start(NamedTuple):
    """Posterior of [x; theta] relative to sigma^2: its mean, a root of its covariance; sigma^2 by the errors alone."""

    mean: np.ndarray
    root: np.ndarray
    sigma2: float


def posterior(task: Task, y, u, prior_mean, prior_root) -> Start | None:
    """Return what M samples say of [x(M); theta], the prior of theta included; None where that is not worth having.

    y (M,) begins with a measured sample, NaN where missing; u (M, k).
    """
    u = _filled(u)
    if task.has_offset:
        u = np.column_stack([u, np.ones(len(y))])
    still = [l for l in range(u.shape[1]) if np.ptp(u[:, l]) == 0 and u[0, l] != 0]
    moving = [l for l in range(u.shape[1]) if l not in still]
    degree = max(task.disturbance, 0 if still else -1)
    n, measured = task.form.n, np.flatnonzero(np.isfinite(y))
    unknowns = 2 * n + len(moving) * (task.zeros + 1) + degree + 1
    if len(still) > 1 or len(measured) <= unknowns:
        return None
    t = task.dt * np.arange(len(y))
    try:
        found = find(t, y, u[:, moving], n, task.zeros, task.hold, degree, (), last=int(measured[-1]) + 1)
        if found.singular[-1] <= BLIND * found.singular[0]:
            return None
        with np.errstate(all="ignore"):
            start = _carried(task, found, _lift(task, found, moving, still, u), y, u)
            start = start and with_prior(start, prior_mean, prior_root)
    except (InputError, np.linalg.LinAlgError, ValueError):
        return None  # nothing finite fits these samples
    return start if start and all(np.isfinite(part).all() for part in start) else None


def _filled(u) -> np.ndarray:
    """Return inputs with each missing one held at the last known (the first known, before that; else zero)."""
    first = u[np.isfinite(u).argmax(axis=0), range(u.shape[1])]
    return np.nan_to_num(held(u, first), nan=0.0, posinf=0.0, neginf=0.0)


def _lift(task, found: Found, moving, still, u) -> np.ndarray:
    """Return what takes the unknowns of a fit to a and b of all inputs; one that never changes is a disturbance."""
    n, m, k = task.form.n, task.zeros, task.form.inputs
    lift = np.zeros((n * (k + 1), len(found.units)))
    lift[range(n), range(n)] = 1.0
    for i, l in enumerate(moving):
        lift[range(n * (l + 2) - m - 1, n * (l + 2)), range(n + i * (m + 1), n + (i + 1) * (m + 1))] = 1.0
    for l in still:
        lift[n * (l + 2) - 1, -found.plan.drifts] = 1 / u[0, l]
    return lift


def _carried(task, found: Found, lift, y, u) -> Start | None:
    """Return the fit in the filter's terms, its covariance that of the filter's noise; None where its errors are none.

    The fit is J^+ times the noise on y, whose colour H the filter's noise says: the covariance is J^+ H H' J^+' R,
    which is (J'J)^-1 R where that noise is white.
    """
    n = task.form.n
    values = lift @ (found.units * np.concatenate([found.fit.a, found.fit.linear]))
    theta = canonical(task.form, values, task.dt, task.hold)
    J = slopes(task.form, values, task.dt, task.hold) @ lift
    fitted = found.y_unit * found.fit.outputs
    errors = np.where(found.is_measured, y - fitted, 0.0)
    sources, shaped = _sources(task.noise, theta[:n])
    W = found.units[:, None] * found.inverse / found.y_unit
    spread = np.concatenate([lfilter(c, shaped, W[:, ::-1])[:, ::-1] for c in sources], axis=1) * math.sqrt(task.R)

    at_once = np.zeros(len(y))
    at_once[0] = 1.0
    loudness = np.sum([np.cumsum(lfilter(c, shaped, at_once) ** 2) for c in sources], axis=0)  # of y's noise, over R
    if len(sources) == 1:
        white, is_whole = lfilter(shaped, sources[0], errors), _is_whole(found.is_measured, len(shaped))
    else:
        white, is_whole = errors / np.sqrt(loudness), found.is_measured
    spare = np.count_nonzero(is_whole) - len(W)
    size = float(white[is_whole] @ white[is_whole]) / task.R
    if spare < 1 or not _is_noise(task, white, is_whole, size, spare, errors, y, len(sources)):
        return None
    x, Jx, extra = _state(task, theta, J, fitted, found.y_unit * found.fit.slopes / found.units, y, u, loudness[-1])
    root = np.concatenate([Jx, task.select @ J]) @ spread
    extra = np.concatenate([extra, np.zeros((len(task.select), extra.shape[1]))])
    return Start(np.concatenate([x, task.select @ theta]), np.concatenate([root, extra], axis=1), size / spare)


def _sources(noise, a):
    """Return the numerators of each source of noise in y, and their denominator: sum_k numerator_k/denominator e_k."""
    n = len(a)
    if isinstance(noise, Sensor):
        return [np.ones(1)], np.ones(1)
    A = np.append(1.0, a)
    if isinstance(noise, White):
        return [np.ones(1)], A
    assert isinstance(noise, Coloured)
    rows = len(noise.kappa)
    more = [np.append(0.0, g[:n]) / math.sqrt(noise.R) for g in noise.G.reshape(-1, rows)]
    return [np.append(1.0, noise.kappa[:n]), *more], A


def _is_whole(is_measured, length) -> np.ndarray:
    """Say which samples have all of the ``length`` latest, themselves included, measured."""
    return np.convolve(is_measured, np.ones(length))[: len(is_measured)] > length - 0.5


def _is_noise(task, white, is_whole, size, spare, errors, y, sources) -> bool:
    """Say whether the errors look like the noise: smaller than y's own spread, white, and no larger than it may be."""
    if not np.isfinite(size):
        return False
    measured = y[np.isfinite(y)]
    total = float(errors @ errors)
    if total <= ROUNDING**2 * float(measured @ measured):
        return True
    if total >= float(np.sum((measured - measured.mean()) ** 2)):
        return False
    if sources > 1:
        return True
    if task.is_known and size > chdtri(spare, CHANCE):
        return False
    whole, lags = np.where(is_whole, white, 0.0), range(1, task.form.n + 3)
    power = float(whole @ whole) / np.count_nonzero(is_whole)
    pairs = [max(int(np.count_nonzero(is_whole[k:] & is_whole[:-k])), 1) for k in lags]
    statistic = sum(float(whole[k:] @ whole[:-k]) ** 2 / (pair * power**2) for k, pair in zip(lags, pairs))
    return bool(statistic <= chdtri(len(lags), CHANCE))


def _state(task, theta, J, fitted, slopes_y, y, u, loudness):
    """Return x(M), its slopes in the unknowns, and a root of what else is unknown of it (relative to sigma^2).

    x_j(M) = sum_i>=j -a_i y(M-1-(i-j)) + b_i u(M-1-(i-j)) + w_i(M-1-(i-j)), y being the model's own output where the
    noise is on the measurement alone, else the measured one (the model's, where that is missing). Nothing is said of w
    but its covariance.
    """
    n, k = task.form.n, task.form.inputs
    if not task.states:
        return np.zeros(0), np.zeros((0, J.shape[1])), np.zeros((0, 0))
    is_model = np.ones(n, bool) if isinstance(task.noise, Sensor) else ~np.isfinite(y[: -n - 1 : -1])
    past = np.where(is_model, fitted[: -n - 1 : -1], y[: -n - 1 : -1])  # newest first
    slope = np.where(is_model[:, None], slopes_y[: -n - 1 : -1], 0.0)
    x, Jx, extra = np.zeros(n), np.zeros((n, J.shape[1])), []
    for r in range(n):
        hit = slice(r, n)  # coefficients i = j + r of the sample r before the last one
        rows = slice(0, n - r)
        x[rows] -= theta[:n][hit] * past[r]
        Jx[rows] -= J[:n][hit] * past[r] + theta[:n][hit][:, None] * slope[r]
        for l in range(k):
            b = slice(n * (l + 1) + r, n * (l + 2))
            x[rows] += theta[b] * u[-1 - r, l]
            Jx[rows] += J[b] * u[-1 - r, l]
        if not isinstance(task.noise, Sensor):
            wave = [math.sqrt(loudness * task.R) * theta[:n]] if is_model[r] else []
            if isinstance(task.noise, Coloured):
                rows_of = len(task.noise.kappa)
                wave += [math.sqrt(task.R) * task.noise.kappa[:n], *task.noise.G.reshape(-1, rows_of)[:, :n]]
            extra += [np.append(w[hit], np.zeros(r)) for w in wave]
    return x, Jx, np.array(extra).reshape(-1, n).T


def with_prior(start: Start, mean, root) -> Start:
    """Return the posterior with a prior of theta (a root of its covariance, relative to sigma^2) taken in.

    In units of the prior's deviations, so that data in other units give the same digits; roots, so that it stays one.
    """
    n = len(start.mean) - len(mean)
    size = np.linalg.norm(root, axis=1)
    size = np.where(size > 0, size, 1.0)
    own, prior = start.root[n:] / size[:, None], root / size[:, None]
    S = own @ own.T + prior @ prior.T
    K = np.linalg.solve(S, own @ start.root.T).T
    off = (mean - start.mean[n:]) / size
    return Start(start.mean + K @ off, np.concatenate([start.root - K @ own, K @ prior], axis=1), start.sigma2)
