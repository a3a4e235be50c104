"""Which parameters the record so far can tell, from what is known of them against what was believed beforehand."""

from __future__ import annotations

import numpy as np

from ...models.units import BASE, kind_of
from ...results.physical_sentences import confused_words, unlearnt_words
from ..common.posterior import directions

WEAK = 0.25  # posterior over prior variance from which a direction counts as not told
SHARE = 0.3  # of a direction's length that makes a parameter one of those concerned


def weak_directions(est, state) -> list[tuple[float, np.ndarray]]:
    """Return (ratio, direction) of what the record does not tell: posterior over prior variance, in prior deviations.

    The posterior is the inverse of the Gramian of the sensitivities and the prior's information, with the state, and
    the noise on it, taken account of; a memory that forgets forgets of it, too.
    """
    n = est.model.n
    found = directions(est.covariance(state)[n:, n:], np.diag(est.prior_covariance)[n:])
    return [(ratio, vector) for ratio, vector in found if ratio > WEAK]


def unlearnt(est, state) -> list[str]:
    """Return in sentences what the record so far does not tell."""
    if not state["observed"]:
        return []
    said: list[str] = []
    for _, vector in weak_directions(est, state):
        concerned = [j for j in np.argsort(-abs(vector)) if abs(vector[j]) > SHARE]
        if len(concerned) == 1:
            said.append(unlearnt_words(est.names[concerned[0]]))
        elif len(concerned) == 2:
            said.append(_pair(est, state, *sorted(concerned)))
        else:
            said.append(confused_words([est.names[j] for j in sorted(concerned)]))
    return said


def _pair(est, state, i: int, j: int) -> str:
    """Return what is said of two parameters that only act together: of positive ones their product or ratio is told."""
    one, two = (est.formulas.free[l] for l in (i, j))
    names = [one.name, two.name]
    if one.kind != "log" or two.kind != "log" or one.origin or two.origin:
        return confused_words(names)
    n, theta = est.model.n, state["theta"]
    P = est.covariance(state)[n:, n:][np.ix_([i, j], [i, j])]
    std, sign, what = min(
        (np.sqrt(P[0, 0] + P[1, 1] + 2 * s * P[0, 1]), s, w) for s, w in ((1, "product"), (-1, "ratio"))
    )
    value = float(np.exp(theta[i] + sign * theta[j]))
    return confused_words(names, what, value, value * float(std), joint_unit(one.unit, two.unit, sign))


def joint_unit(one: str, two: str, sign: int) -> str:
    """Return the unit of a product (sign 1) or ratio (-1), under one name where it has one.

    >>> joint_unit("Ohm", "F", 1), joint_unit("N", "s", -1)
    ('s', '(N)/(s)')
    """
    first, second = kind_of(one), kind_of(two)
    if first is not None and second is not None:
        total = tuple(a + sign * b for a, b in zip(first, second))
        if not any(total):
            return ""
        for name, kind in BASE.items():
            if kind == total and name in ("s", "m", "kg", "A", "K", "V", "W", "N", "J", "Hz"):
                return name
    return f"{one} {two}".strip() if sign > 0 else f"({one})/({two})" if two else one
