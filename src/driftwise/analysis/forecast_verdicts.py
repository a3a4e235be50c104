"""Are the error bars right, and is anything predictable left? Verdicts on the forecasts alone."""

from __future__ import annotations

import math

import numpy as np

from ..models.quantities import NORMAL_95
from ..results.numbers import chance
from ..results.sentences import off
from ..results.verdicts import Diagnosis, Verdict
from ..results.whiteness import LEAST, Correlations, Nis, Whiteness, nis
from .remedies import for_bars, for_colour

LEVEL = 0.99  # of each threshold that a chance can cross
RIGHT, HELD = (0.8, 1.25), (0.92, 0.975)  # so far off, NIS and coverage are right for all practical purposes
FAINT = 0.01  # of the variance: less is too little to predict
DIGIT = 0.1  # per cent of the movement, to which it is said how much is predicted
BAND = 0.95


def calibration(normal_score, settle: int = 0) -> Diagnosis:
    """Return NIS, coverage and whiteness of forecasts, as verdicts.

    Parameters
    ----------
    normal_score : (T,)
        What the forecast distributions make of the outputs: their probability as a standard normal deviate, in time
        order; of Gaussian forecasts (y - mean)/std. NaN where y is missing.
    settle : int
        Samples at the beginning that are left out.

    Notes
    -----
    Under the right forecasts the scores are independent and N(0, 1): n NIS is chi-square, the count inside the band is
    binomial, Ljung-Box is chi-square. Each threshold is crossed by chance once in a hundred records.

    Examples
    --------
    >>> import numpy as np
    >>> z = np.random.default_rng(0).standard_normal(500)
    >>> print(calibration(2 * z))
      verdict    value  fine
    ! NIS         4.11  0.8 to 1.25    the error bars are 103 % too narrow: let the parameters drift or jump, or
                                       the variance of the noise: try memory=AutoMemory()
    ! coverage   0.656  0.92 to 0.975  the 95 % bands hold 66 % of the samples: they are too narrow
      whiteness      0  0 to 0.035     nothing is left to predict that would matter
    """
    from ..engine import validation

    z = validation.floats("normal_score", normal_score)[settle:]
    seen = z[np.isfinite(z)]
    held = int(np.count_nonzero(abs(seen) <= NORMAL_95))
    lags = Correlations().add(np.where(np.isfinite(z), z, np.nan).clip(-4, 4))
    return Diagnosis(
        [
            nis_verdict(nis(np.where(np.isfinite(z), z, np.nan), 1.0, level=LEVEL)),
            coverage_verdict(held / max(len(seen), 1), len(seen)),
            whiteness_verdict(lags.whiteness, lags.count),
        ]
    )


def of_summary(s, label: str = "", is_white: bool = True) -> list[Verdict]:
    """Return the same of a `Summary`; ``label`` tells outputs apart, ``is_white`` says whether they should be white."""
    nis, coverage, white = s.nis_within(LEVEL), s.coverage, s.whiteness
    found = [nis_verdict(nis, s), coverage_verdict(coverage, nis.samples)]
    found += [whiteness_verdict(white, nis.samples, s)] if is_white else []
    return [verdict._replace(name=verdict.name + label) for verdict in found]


def nis_verdict(found: Nis, s=None, is_tunable: bool = True) -> Verdict:
    """Return the verdict on the mean normalised innovation squared; a remedy only where there is something to tune."""
    limits = min(found.low, RIGHT[0]), max(found.high, RIGHT[1])
    if found.samples < LEAST:
        return Verdict("NIS", math.nan, RIGHT, True, "too few samples to tell whether the error bars are right")
    if limits[0] <= found.value <= limits[1]:
        return Verdict("NIS", found.value, limits, True, "the error bars have the right size")
    advice = f"the error bars are {off(found.value)}"
    advice += f": {for_bars(found.value, s)}" if is_tunable else ", on average"
    return Verdict("NIS", found.value, limits, False, advice)


def coverage_verdict(share: float, samples: int) -> Verdict:
    """Return the verdict on the share of samples in their 95 % bands."""
    from scipy.special import bdtrik

    if samples < LEAST:
        return Verdict("coverage", math.nan, HELD, True, "too few samples to tell what the 95 % bands hold")
    tail = (1 - LEVEL) / 2
    low, high = math.floor(bdtrik(tail, samples, BAND)) / samples, math.ceil(bdtrik(1 - tail, samples, BAND)) / samples
    limits = min(low, HELD[0]), max(high, HELD[1])
    if limits[0] <= share <= limits[1]:
        return Verdict("coverage", share, limits, True, "the 95 % bands hold what they should")
    way = "too narrow" if share < BAND else "too wide"
    return Verdict(
        "coverage", share, limits, False, f"the 95 % bands hold {100 * share:.0f} % of the samples: they are {way}"
    )


def unsaid(fit: float) -> float:
    """Return the share of the squared errors that may be predictable without a digit more of the ``fit`` that is said.

    Of what predicts 99.9 % nothing that is left matters, and of what predicts 90 % two hundredths.

    >>> round(unsaid(90.0), 3), unsaid(99.95)
    (0.02, inf)
    """
    left = 100 - fit
    return math.inf if left <= DIGIT else 1 - (1 - DIGIT / left) ** 2


def whiteness_verdict(white: Whiteness, samples: int, s=None, least: float = FAINT) -> Verdict:
    """Return the verdict on what is left to predict: the squares of the autocorrelations together, chance taken off.

    That is the Ljung-Box statistic beyond its degrees of freedom, by the number of samples: of a faint colour, the
    share of the variance that past innovations predict. A hundredth is no matter, nor what is below ``least``.
    """
    from scipy.special import gammaincinv

    if math.isnan(white.p_value):
        limits = (0.0, FAINT)
        return Verdict("whiteness", math.nan, limits, True, "too few samples to tell whether the innovations are white")
    share = max(white.statistic - white.lags, 0.0) / (samples + 2)
    chance_alone = (2 * float(gammaincinv(white.lags / 2, LEVEL)) - white.lags) / (samples + 2)
    limits = 0.0, max(chance_alone, FAINT, least)
    if share <= limits[1]:
        return Verdict("whiteness", share, limits, True, "nothing is left to predict that would matter")
    advice = f"the noise is not white ({chance(white.p_value)}): {for_colour(s, share)}"
    return Verdict("whiteness", share, limits, False, advice)
