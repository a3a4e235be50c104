"""Priors, as estimators take them: a mean and a covariance by name or in the user's order, checked, factored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...engine import ud, validation
from ...engine.errors import InputError

# Default prior variance in units of the data: a ridge of 1e-4. Much wider priors let directions that the inputs do
# not excite run away on measured records, and spoil a learnt scale while the first samples stand still.
WIDTH = 1e4
SHOWN = 12  # names that a message lists


def mean_of(name: str, given, order, names, several: bool = False) -> np.ndarray:
    """Return a prior mean, zero where none is given; ``order`` takes the user's order to the kernel's, of the names."""
    N = len(order)
    given = in_order(name, given, users(order, names), np.zeros(N), several)
    return (np.zeros(N) if given is None else validation.vector(name, given, N))[order]


def covariance_of(P0, order, units, names, several: bool = False) -> np.ndarray:
    """Return a prior covariance; where none is given a wide one, ``units`` being its squared units."""
    N = validation.unknowns(len(order))
    P0 = in_order("P0", P0, users(order, names), WIDTH * users(order, units), several)
    return WIDTH * np.diag(units) if P0 is None else validation.covariance("P0", P0, N)[np.ix_(order, order)]


def users(order, values) -> np.ndarray:
    """Return values that are in the kernel's order in the user's."""
    found = np.empty_like(values := np.asarray(values))
    found[order] = values
    return found


def in_order(name: str, given, names, default, several: bool = False) -> Any:
    """Return what was given, numbers by name put into the order of ``names``; what is not named is as by default.

    Numbers without names stay as they are, but not where ``several`` outputs have their parameters one after the other:
    nobody sees whether the order is the right one.
    """
    if hasattr(given, "to_dict"):
        raise InputError(f"{name} is a {type(given).__name__}, whose labels would be lost: give {name}.to_dict()")
    if isinstance(given, Mapping):
        at = {str(label): i for i, label in enumerate(names)}
        is_matrix = any(isinstance(value, Mapping) for value in given.values())
        unknown = [k for k in given if k not in at]
        unknown += [k for row in given.values() if isinstance(row, Mapping) for k in row if k not in at]
        if unknown:
            raise InputError(f"{name} has {unknown[0]!r}, which is no name here: they are {_listed(names)}")
        found = np.diag(default) if is_matrix else np.array(default, float)
        for label, value in given.items():
            if is_matrix:
                for other, number in (value if isinstance(value, Mapping) else {label: value}).items():
                    found[at[label], at[other]] = number
                    if other not in given or label not in given[other]:
                        found[at[other], at[label]] = number
            else:
                found[at[label]] = value
        return found
    if several and np.ndim(given) > 0:
        raise InputError(
            f"{name} of several outputs is given by name, as numbers in a row do not say whose they are: "
            f"{name}={{{str(names[0])!r}: .., ..}}, or {name}=dict(zip(names, values)) with the names {_listed(names)}"
        )
    return given


def _listed(names) -> str:
    more = f", .. ({len(names)} in all)" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more


def factors_of(P) -> tuple[np.ndarray, np.ndarray]:
    """Return U, as the kernel packs it, and D of P = U D U'."""
    try:
        U, D = ud.factor(P)
    except ValueError:
        raise InputError("P0 must be a covariance: it has a negative eigenvalue. Was a precision given?") from None
    return U[ud.packed_indices(len(D))], D
