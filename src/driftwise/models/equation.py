"""The difference equation of a recursive estimator: which lags it has, what their coefficients are called."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .canonical import Canonical


@dataclass(frozen=True)
class Equation:
    """A(q) y = sum_l B_l(q) u_l + offset + e, A with ``na`` coefficients, B_l with ``nb[l]`` from lag ``nk[l]`` on.

    The parameters, in order: a1.., b of the first input.., of the second.., offset, disturbance. There is no state.
    """

    na: int
    nb: tuple[int, ...] = ()
    nk: tuple[int, ...] = ()
    has_offset: bool = False
    labels: tuple[str, ...] = ()  # names that replace those of b
    has_disturbance: bool = False  # the last parameter is a disturbance: a second constant regressor

    n = 0  # no state
    coloured = False

    @property
    def inputs(self) -> int:
        """Number of inputs."""
        return len(self.nb)

    @property
    def reach(self) -> int:
        """How many samples back the regressors go."""
        return max([self.na, *(nb + nk - 1 for nb, nk in zip(self.nb, self.nk) if nb)])

    @property
    def order(self) -> int:
        """Number of poles."""
        return self.reach

    @property
    def N(self) -> int:
        """Number of parameters."""
        return self.na + sum(self.nb) + self.constants

    @property
    def constants(self) -> int:
        """Number of parameters whose regressor is 1: the offset, the disturbance."""
        return int(self.has_offset) + int(self.has_disturbance)

    @property
    def deep(self) -> int:
        """Lags kept of each input, lag 0 included."""
        return max((nb + nk for nb, nk in zip(self.nb, self.nk)), default=0)

    @property
    def salut(self) -> np.ndarray:
        """Index that takes numbers in the user's order to the kernel's; they are the same here."""
        return np.arange(self.N)

    kernel = salut

    @cached_property
    def names(self) -> list[str]:
        """Names of the parameters; b3.2 is the coefficient of the second input, three samples ago."""
        of = [f".{l + 1}" if self.inputs > 1 else "" for l in range(self.inputs)]
        b = [f"b{nk + j}{of[l]}" for l, (nb, nk) in enumerate(zip(self.nb, self.nk)) for j in range(nb)]
        return [f"a{i + 1}" for i in range(self.na)] + list(self.labels or b) + self._constant_names

    @property
    def _constant_names(self) -> list[str]:
        return ["offset"] * self.has_offset + ["disturbance"] * self.has_disturbance

    @property
    def words(self) -> str:
        """The equation as one reads it."""
        left = " + ".join(["y(t)", *_short([f"{name} y(t\u2212{name[1:]})" for name in self.names[: self.na]])])
        right = self.names[self.na : self.N - self.constants]
        if self.labels:
            terms = _short([f"\u03b8({name}) {name}(t)" for name in right])
        else:
            lags = [(lag, l) for l, (nb, nk) in enumerate(zip(self.nb, self.nk)) for lag in range(nk, nk + nb)]
            of = [str(l + 1) if self.inputs > 1 else "" for _, l in lags]
            past = [f"\u2212{lag}" if lag else "" for lag, _ in lags]
            terms = _short([f"{name} u{i}(t{lag})" for name, i, lag in zip(right, of, past)])
        return f"{left} = {' + '.join([*terms, *self._constant_names, 'noise'])}"

    @property
    def direct(self) -> bool:
        """Whether an input acts at once."""
        return any(nk == 0 and nb > 0 for nb, nk in zip(self.nb, self.nk))

    def canonical(self) -> tuple[Canonical, np.ndarray]:
        """Return the canonical form that holds this equation, and where in it each parameter (not the offset) goes."""
        form = Canonical(max(self.order, 1), self.inputs, self.direct)
        at = list(range(self.na))
        for l, (nb, nk) in enumerate(zip(self.nb, self.nk)):
            at += [form.n * (l + 1) + lag - 1 if lag else form.direct_at + l for lag in range(nk, nk + nb)]
        return form, np.array(at, int)


def _short(terms: list[str], most: int = 4) -> list[str]:
    """Return a long list of terms by its ends."""
    return terms if len(terms) <= most else [terms[0], "\u2026", terms[-1]]
