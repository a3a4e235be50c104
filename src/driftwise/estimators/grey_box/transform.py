"""Parameters as they are estimated: positive ones as logarithms, those between two bounds on a logistic scale."""

from __future__ import annotations

import numpy as np

from ...engine.dispatch import kernel
from ...engine.elementary import exp

LINEAR, LOG, LOGISTIC = 0.0, 1.0, 2.0
KINDS = {"linear": LINEAR, "log": LOG, "logistic": LOGISTIC}


@kernel
def in_units(form, theta, values, rates):
    """Fill the parameters in their units, and their slopes by the transformed ones."""
    for j in range(theta.size):
        if form.kinds[j] == LINEAR:
            values[j], rates[j] = theta[j], 1.0
        elif form.kinds[j] == LOG:
            rates[j] = exp(theta[j])
            values[j] = form.low[j] + rates[j]
        else:
            share = 1.0 / (1.0 + exp(-theta[j]))
            width = form.high[j] - form.low[j]
            values[j], rates[j] = form.low[j] + width * share, width * share * (1.0 - share)


def to_units(parameters, theta) -> tuple[np.ndarray, np.ndarray]:
    """Return transformed parameters (.., m) in their units, and the slopes; all `Parameter`s in their order."""
    theta = np.asarray(theta, float)
    values, rates = np.empty_like(theta), np.empty_like(theta)
    for j, one in enumerate(parameters):
        z = theta[..., j]
        if one.kind == "linear":
            values[..., j], rates[..., j] = z, 1.0
        elif one.kind == "log":
            rates[..., j] = np.exp(z)
            values[..., j] = one.origin + rates[..., j]
        else:
            share, width = 1 / (1 + np.exp(-z)), one.high - one.low
            values[..., j], rates[..., j] = one.low + width * share, width * share * (1 - share)
    return values, rates


def transformed(one, value: float) -> float:
    """Return what a parameter of this value is estimated as."""
    if one.kind == "linear":
        return float(value)
    if one.kind == "log":
        return float(np.log(value - one.origin))
    return float(np.log((value - one.low) / (one.high - value)))


def deviation(one) -> float:
    """Return the deviation of what is believed of a transformed parameter beforehand."""
    if one.kind == "linear":
        return float(one.std)
    if one.kind == "log":
        return float(np.log(one.factor or FACTOR) / NORMAL_95)
    return ANYWHERE


FACTOR = 5.0  # within which a positive parameter lies about its start, with 95 %, where nothing is said
NORMAL_95 = 1.959963984540054
ANYWHERE = 1.8  # deviation on the logistic scale of what may lie anywhere between its bounds
