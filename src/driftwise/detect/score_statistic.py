"""Do the parameters still fit a stretch of data? One chi-square test of a regression, and which parameter does not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..engine.errors import InputError
from .brownian import positive


@dataclass(frozen=True)
class ScoreTest:
    """Outcome of `score_test`.

    Attributes
    ----------
    statistic, degrees, p_value : chi-square statistic, its degrees of freedom, and the chance of more by accident
    scores : (s,) standardised score of each parameter, N(0, 1) without a change
    which, direction : the parameter with the largest score, and the sign of its change
    names : of the parameters
    """

    statistic: float
    degrees: int
    p_value: float
    scores: np.ndarray
    which: int
    direction: int
    names: tuple[str, ...] = ()

    def __repr__(self):
        way = "up" if self.direction > 0 else "down"
        name = self.names[self.which] if self.names else f"#{self.which}"
        return (
            f"chi2 = {self.statistic:.1f} on {self.degrees} degrees of freedom (p = {self.p_value:.2g}); "
            f"most of all {name} {way} ({self.scores[self.which]:+.1f} sd)"
        )


def score_test(regressors, innovations, variance, names=()) -> ScoreTest:
    """Return whether the parameters that made these innovations fit them, and which one does not.

    With q = sum of nu e over the m samples, R the mean of nu nu' and c the noise variance,

        chi2 = q' R^-1 q / (c m),   score of parameter i:  q_i / sqrt(c m R_ii)

    Parameters
    ----------
    regressors : (m, s) nu of each sample (of a pseudo-linear regression or a gradient: psi); NaN where missing
    innovations : (m,) prediction errors with the parameters that are tested; NaN where missing
    variance : float, c
    names : of the parameters, for the words; numbers if omitted

    Notes
    -----
    The **raw** score names the parameter more often than the Newton step R^-1 q does, which passes a change on to all
    regressors that are alike. Chi-square where the parameters tested were not fitted to these very samples. Bad at:
    a regressor that hardly varied (its parameter cannot show), and several parameters that changed at once.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(0)
    >>> nu = rng.standard_normal((100, 3))
    >>> e = rng.standard_normal(100) + 0.5 * nu[:, 1]          # parameter 1 is 0.5 higher than believed
    >>> dw.detect.score_test(nu, e, variance=1.0)
    chi2 = 15.1 on 3 degrees of freedom (p = 0.0017); most of all #1 up (+3.6 sd)
    """
    from scipy.stats import chi2

    nu, e, c = np.asarray(regressors, float), np.asarray(innovations, float), positive("variance", variance)
    if nu.ndim != 2 or e.shape != nu.shape[:1]:
        raise InputError(f"regressors must be (m, s) and innovations (m,), got {nu.shape} and {e.shape}. Transposed?")
    there = np.isfinite(e) & np.isfinite(nu).all(axis=1)
    nu, e = nu[there], e[there]
    moved = np.any(nu != 0, axis=0)
    if not moved.any():
        raise InputError("no sample has its innovation and a regressor other than zero: there is nothing to test")
    size = np.sqrt(np.sum(nu**2, axis=0))
    unit = nu[:, moved] / size[moved]
    U, singular, _ = np.linalg.svd(unit, full_matrices=False)
    U = U[:, singular > len(e) * np.finfo(float).eps * singular[0]]  # q' R^-1 q / m = |U'e|^2
    scores = np.zeros(nu.shape[1])
    scores[moved] = unit.T @ e / np.sqrt(c)
    statistic, degrees = float(np.sum((U.T @ e) ** 2) / c), U.shape[1]
    which = int(np.argmax(np.abs(scores)))
    way = 1 if scores[which] >= 0 else -1
    return ScoreTest(statistic, degrees, float(chi2.sf(statistic, degrees)), scores, which, way, tuple(names))
