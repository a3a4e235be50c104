"""A difference equation of deviations from a season, whose profile is an input that nobody hands over."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .canonical import Canonical
from .equation import Equation


@dataclass(frozen=True)
class SeasonalEquation(Equation):
    """An `Equation` whose last inputs are the profiles of its ``seasons``, in samples.

    Examples
    --------
    >>> equation = SeasonalEquation(1, (1, 2), (1, 0), True, seasons=(12,))
    >>> equation.inputs, equation.names
    (1, ['a1', 'b1', 's12.0', 's12.1', 'offset'])
    """

    seasons: tuple[int, ...] = ()

    @property
    def remainder(self) -> Equation:
        """What is left when the season is known."""
        return Equation(self.na, self.nb[: self.inputs], self.nk[: self.inputs], self.has_offset)

    @cached_property
    def inputs(self) -> int:
        """Number of inputs that are handed over."""
        return len(self.nb) - len(self.seasons)

    @cached_property
    def names(self) -> list[str]:
        """Names of the parameters; s12.1 is the coefficient of the season of twelve samples, one sample ago."""
        own = [f"s{s}.{lag}" for s, nb in zip(self.seasons, self.nb[self.inputs :]) for lag in range(nb)]
        free = self.remainder.names
        return [*free[: len(free) - self.constants], *own, *self._constant_names]

    @property
    def words(self) -> str:
        """The equation as one reads it."""
        seasons = " + ".join(f"season of {s}" for s in self.seasons)
        return f"{self.remainder.words.removesuffix('noise')}{seasons} + noise"

    def canonical(self) -> tuple[Canonical, np.ndarray]:
        """Return the canonical form of the remainder, and where in it each parameter goes that is not of a season."""
        return self.remainder.canonical()
