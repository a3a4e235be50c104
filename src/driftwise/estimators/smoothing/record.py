"""A record as rows of a regression, with the units and the prior in which drifts of its parameters are learnt."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...engine import ud
from ...engine.errors import InputError

WIDE = 1e3  # default prior variance of a parameter: what it would take to explain the record so many times over
LEAST_NOISE = 1e-20  # of the mean square of y: below it nobody can tell noise from round-off


@dataclass(frozen=True)
class Record:
    """Rows y = psi' theta + e. Variances are relative to that of e, and ``prior`` is that of theta."""

    y: np.ndarray  # (T,), NaN where the row teaches nothing
    psi: np.ndarray  # (T, n), 0 there
    prior: tuple[np.ndarray, np.ndarray]  # mean, covariance
    phi: np.ndarray  # theta(k+1) = phi theta(k) + w(k)
    variance: float | None = None  # of e, where it is known
    skip: int | None = None  # rows that only settle the prior and do not count; 2n if omitted

    @property
    def n(self) -> int:
        """Number of parameters."""
        return self.psi.shape[1]

    @property
    def known(self) -> np.ndarray:
        """Which rows teach something, (T,)."""
        return ~np.isnan(self.y)

    @property
    def power(self) -> np.ndarray:
        """Mean squares of the regressors, (n,); one whose regressor is zero throughout counts one."""
        ms = np.mean(self.psi[self.known] ** 2, axis=0)
        return np.where(ms > 0, ms, 1.0)

    @property
    def is_live(self) -> np.ndarray:
        """Which regressors are ever other than zero, (n,)."""
        return np.any(self.psi != 0, axis=0)

    @property
    def least_variance(self) -> float:
        """Noise variance below which it is round-off."""
        return LEAST_NOISE * float(np.mean(self.y[self.known] ** 2)) or 1e-300


def regressors(equation, y, u, at_rest: bool) -> np.ndarray:
    """Return psi (T, n) of a difference equation: -y of the past, u of the past, a constant; NaN where not known."""

    def lagged(values, lag):
        before = np.zeros(lag) if at_rest else np.full(lag, np.nan)
        return np.concatenate([before, values])[: len(values)]

    columns = [-lagged(y, i + 1) for i in range(equation.na)]
    for l, (nb, nk) in enumerate(zip(equation.nb, equation.nk)):
        columns += [lagged(u[:, l], lag) for lag in range(nk, nk + nb)]
    return np.column_stack([*columns, *[np.ones(len(y))] * equation.has_offset])


def record_of(est, y, u, phi) -> Record:
    """Return the record of an estimator: what its prior, variance and ``at_rest`` say is kept."""
    options = est.options
    psi = regressors(est.model, y, u, options["at_rest"])
    y = np.where(np.isnan(psi).any(axis=1), np.nan, y)
    known, n = ~np.isnan(y), psi.shape[1]
    if known.sum() < 4 * n + 1:
        raise InputError(
            f"{known.sum()} samples of y have a complete row of regressors, and {n} drifting parameters need at least "
            f"{4 * n + 1}; is much of y or u missing (NaN)?"
        )
    psi = np.where(known[:, None], psi, 0.0)
    variance = options["variance"]
    mean, P = est._s0.copy(), est.prior_covariance / (est.y_scale**2 if variance is None else variance)
    rows = Record(y, psi, (mean, P), np.asarray(phi, float), variance)
    return rows if options["P0"] is not None else rows_with_wide_prior(rows, mean)


def rows_with_wide_prior(rows: Record, mean) -> Record:
    """Return the record with a prior so wide that it says nothing, in units of the data."""
    y, psi, size = rows.y[rows.known], rows.psi[rows.known], np.sqrt(rows.power)
    error = y - psi @ (np.linalg.lstsq(psi / size, y)[0] / size)
    noise = rows.variance or max(float(np.mean(error**2)), 1e-10 * float(np.mean(y**2)), rows.least_variance)
    ratio = max(float(np.mean(y**2)) / noise, 1.0)
    return replace(rows, prior=(mean, np.diag(WIDE * ratio / rows.power)))


def factors(P) -> tuple[np.ndarray, np.ndarray]:
    """Return D and packed U of a covariance."""
    U, D = ud.factor(P)
    return D, U[ud.packed_indices(len(P))]
