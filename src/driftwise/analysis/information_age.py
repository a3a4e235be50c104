"""How old is what is known of each parameter? A record that stopped moving teaches nothing new."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..engine import validation
from ..estimators.smoothing.record import regressors
from ..models.equation import Equation

BLOCKS = 100  # of the record, by which ages are counted
NEW = 0.01  # of the information about a parameter


class News(NamedTuple):
    """The parameter that waits longest for news: samples since then, and whether all wait about as long."""

    age: int
    name: str
    is_all: bool


def last_news(estimator, y, u=None) -> News | None:
    """Return since when hardly anything was learnt of some parameter; None where there is nothing to tell.

    The information about theta_i in the first t samples is J_i(t) = 1/[(sum psi psi')^-1]_ii, psi the regressors and
    the other parameters unknown too. The last news is as old as the youngest hundredth of J_i. Bad at: colour of the
    noise (the regressors are those of an ARX of the same lags), and at telling less than a hundredth of the record.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> u = np.random.default_rng(1).standard_normal(1000)
    >>> u[600:] = 0.0
    >>> y, u = dw.simulate([-0.8], [1.0], u=u, samples=1000, noise_std=0.1, seed=2)
    >>> last_news(dw.ARX(1, 1), y, u)
    News(age=400, name='b1', is_all=True)
    """
    form = equation(estimator.model)
    if form is None:
        return None
    y, u = validation.record(y, u if form.inputs else None, form.inputs)
    psi = regressors(form, y, u, False)
    is_whole = np.isfinite(psi).all(axis=1) & np.isfinite(y)
    if is_whole.sum() < 2 * form.N:
        return None
    psi = np.where(is_whole[:, None], psi, 0.0)
    size = np.sqrt(np.sum(psi**2, axis=0))
    psi = psi / np.where(size > 0, size, 1.0)
    edges = np.linspace(0, len(y), min(BLOCKS, len(y)) + 1).astype(int)
    grams = np.cumsum([psi[a:b].T @ psi[a:b] for a, b in pairwise(edges)], axis=0)
    own = np.diagonal(np.linalg.inv(grams + 1e-9 * np.eye(form.N)), axis1=1, axis2=2)
    J = np.where(size > 0, 1 / own, 0.0)
    since = np.array([edges[1 + np.argmax(column >= (1 - NEW) * column[-1])] for column in J.T])
    seen = J[-1] > 1e-6  # the others, nothing was ever known of
    if not seen.any():
        return None
    ages = np.where(seen, len(y) - since, -1)
    worst = int(np.argmax(ages))
    return News(int(ages[worst]), form.names[worst], bool((ages[seen] >= 0.9 * ages[worst]).all()))


def equation(form) -> Equation | None:
    """Return the difference equation of a model of one output: its own, or that of an ARX of the same order."""
    if type(form) is Equation:
        return form
    order = getattr(form, "order", form.n)
    if not order or getattr(form, "outputs", 1) != 1:
        return None
    if isinstance(form, Equation):  # of a polynomial model, without what is not measured
        return Equation(order, form.nb, form.nk, form.has_offset)
    direct = bool(getattr(form, "direct", False))
    return Equation(order, (order + direct,) * form.inputs, (1 - direct,) * form.inputs)
