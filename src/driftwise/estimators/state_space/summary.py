"""What a run with the user's matrices amounts to: how well they predict, and what was learnt of the noise."""

from __future__ import annotations

import math
from typing import Any

from ...results.numbers import finite
from ...results.observer_summary import ObserverSummary


class StateSummary(ObserverSummary):
    """Numbers of a run of `StateSpace`; add one trace after the other, memory does not grow."""

    too_small = "Q or R is too small, or F and H are not those of the plant"
    too_large = "Q or R is too large"

    @property
    def learnt(self) -> list[str]:
        """What was learnt of the noise, in sentences; none where Q and R were given."""
        est, said = self.estimator, []
        if not est.has_known_scale:
            said.append(f"Q and R are {est.sigma2(self.state):.3g} times what was given.")
        factor, deviation = est.noise_factor(self.state)
        if deviation:
            besides = "" if est.has_known_scale else " besides"
            said.append(
                f"Q is {factor:.3g} times what was given{besides}, within a factor of {math.exp(deviation):.2g}."
            )
        return said

    @property
    def words(self) -> str:
        """The run in a few plain sentences."""
        if not self.samples:
            return super().words
        fit = super().words.removeprefix("The first estimate was ready after 0 s. ")
        return " ".join([fit, *self.learnt, *self.estimator.notes])

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, ready for JSON (NaN becomes None)."""
        est = self.estimator
        factor, deviation = est.noise_factor(self.state)
        more = {"sigma2": float(est.sigma2(self.state)), "noise_factor": factor, "noise_factor_std": deviation}
        return super().as_dict() | finite({**more, "learnt": self.learnt, "notes": est.notes})
