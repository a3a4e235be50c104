"""What a record can teach, said in words: identifiability, and whether a can be trusted beside an unknown noise."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..engine.errors import InputError
from .identifiable import ROWS, WEAK, taught


@dataclass(frozen=True)
class Study:
    """The answers of `identifiability` and `cramer_rao`; None where they could not be given.

    ``rows`` of the record were looked at, ``centered`` says what was subtracted first.
    """

    identifiability: Any
    bound: Any
    rows: int
    centered: str = "none"
    order: int = 1  # 0: a regression, about which the Gramian of a plant says nothing

    @cached_property
    def is_poor(self) -> bool:
        """Whether the record leaves something out."""
        return self.identifiability is not None and self.identifiability.worst < WEAK

    @cached_property
    def words(self) -> str:
        """What the record can tell apart."""
        found = self.identifiability
        if not self.order:
            return ""
        if found is None:
            return "No row of the record is complete, so it is not known what it can tell apart."
        if self.centered == "none":
            return found.words
        return re.sub(r"(nput(?: \d+)?) is zero:", rf"\1 is zero once its {self.centered} is subtracted:", found.words)

    @cached_property
    def trust(self) -> str:
        """Whether to trust a where the noise polynomial is unknown; nothing where it is not."""
        return "" if self.bound is None else re.sub(r"\bd\b", "c", self.bound.words)  # what a user sees is c1, c2, ..

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers."""
        found, bound = self.identifiability, self.bound
        data: dict[str, Any] = {"rows": self.rows, "words": self.words}
        if found is not None:
            data |= {
                "rank": found.rank, "unknowns": found.unknowns, "is_identifiable": found.is_identifiable,
                "worst": found.worst, "directions": [{"words": d.words, "value": d.eigenvalue} for d in found.unseen],
            }  # fmt: skip
        if bound is not None:
            data["cramer_rao"] = {"ratio": bound.ratio[::-1].tolist(), "words": bound.words}
        return data


def study(estimator, state, y, u, centered: str = "none") -> Study:
    """Return what the first rows of a record, y (T,) and u (T, k), can teach the estimator that was run over it."""
    form = estimator.model
    order = estimator.order
    y, u = y[:ROWS], u[:ROWS]
    bound = _bound(estimator.model_of(state), y, u) if form.coloured else None
    return Study(taught(estimator, y, u) if order else None, bound, len(y), centered, order)


def _bound(model, y, u):
    """Return the Cramer-Rao bound at the estimates: from the record, or for white noise in where there is no input."""
    from ..models.information import cramer_rao, cramer_rao_of_record

    form = model.form
    A, B = form.polynomials(model.values)
    a, d = A[:0:-1], model.noise_polynomial[:0:-1]
    try:
        if not form.inputs:
            return cramer_rao(a, d, samples=len(y))
        part = _longest_complete(y, u)
        direct = B[:, 0] if form.direct else None
        return cramer_rao_of_record(y[part], u[part], a=a, d=d, b=B[:, :0:-1], direct=direct)
    except InputError:  # a pole or a zero of C on or outside the circle, or too little that is complete
        return None


def _longest_complete(y, u) -> slice:
    """Return the longest stretch without a missing value."""
    holes = np.flatnonzero(np.isnan(np.column_stack([y, u])).any(axis=1))
    edges = np.concatenate([[-1], holes, [len(y)]])
    k = int(np.argmax(np.diff(edges)))
    return slice(int(edges[k]) + 1, int(edges[k + 1]))
