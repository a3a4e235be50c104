"""Difference equations of one output and of several: which lags they have, what their coefficients are called."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .canonical import Canonical
from .structure import Block, Structure

Table = tuple[tuple[int, ...], ...]


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
    kept = 0  # coefficients that multiply what is not measured: `Family` has some

    @cached_property
    def inputs(self) -> int:
        """Number of inputs."""
        return len(self.nb)

    @cached_property
    def reach(self) -> int:
        """How many samples back the regressors go."""
        return max([self.na, *(nb + nk - 1 for nb, nk in zip(self.nb, self.nk) if nb)])

    @cached_property
    def order(self) -> int:
        """Number of poles."""
        return self.reach

    @cached_property
    def N(self) -> int:
        """Number of parameters."""
        return self.na + sum(self.nb) + self.constants

    @cached_property
    def constants(self) -> int:
        """Number of parameters whose regressor is 1: the offset, the disturbance."""
        return int(self.has_offset) + int(self.has_disturbance)

    @cached_property
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


@dataclass(frozen=True)
class Equations:
    """y_i = -sum_j A_ij(q) y_j + sum_l B_il(q) u_l + offset_i + e_i, of past outputs only, for i = 1..p.

    A_ij has ``na[i][j]`` coefficients from lag 1 on, B_il has ``nb[i][l]`` from lag ``nk[i][l]`` on. The parameters, in
    order: equation by equation a_i1.., a_i2.., b_i1.., offset_i. There is no state.

    Examples
    --------
    >>> Equations(((2, 1), (0, 1)), ((1,), (2,)), ((1,), (0,))).names
    ['a1.11', 'a2.11', 'a1.12', 'b1.11', 'a1.22', 'b0.21', 'b1.21']
    """

    na: Table
    nb: Table
    nk: Table
    has_offset: bool = False

    n = 0  # no state
    coloured = False

    @property
    def outputs(self) -> int:
        """Number of outputs p."""
        return len(self.na)

    @property
    def inputs(self) -> int:
        """Number of inputs k."""
        return len(self.nb[0])

    @property
    def sizes(self) -> list[int]:
        """Number of parameters of each equation."""
        return [sum(a) + sum(b) + int(self.has_offset) for a, b in zip(self.na, self.nb)]

    def reach(self, output: int) -> int:
        """How many samples back the regressors of an equation go."""
        b = [nb + nk - 1 for nb, nk in zip(self.nb[output], self.nk[output]) if nb]
        return max([*self.na[output], *b])

    @property
    def theta_at(self) -> list[int]:
        """Where the parameters of each equation begin, and one past the last."""
        return [0, *np.cumsum(self.sizes).tolist()]

    @property
    def N(self) -> int:
        """Number of parameters."""
        return sum(self.sizes)

    @property
    def past(self) -> int:
        """Lags kept of each output."""
        return max(max(row) for row in self.na)

    @property
    def deep(self) -> int:
        """Lags kept of each input, lag 0 included."""
        return max((b + k for nb, nk in zip(self.nb, self.nk) for b, k in zip(nb, nk)), default=0)

    @property
    def salut(self) -> np.ndarray:
        """Index that takes numbers in the user's order to the kernel's; they are the same here."""
        return np.arange(self.N)

    kernel = salut

    def canonical(self) -> tuple[Lagged, np.ndarray]:
        """Return the form with a state that holds these equations, and which parameters are in it (offsets are not)."""
        form = Lagged(
            tuple(
                max([1, *a, *(b + k - 1 for b, k in zip(nb, nk) if b)]) for a, nb, nk in zip(self.na, self.nb, self.nk)
            ),
            self.inputs,
            any(k == 0 and b > 0 for nb, nk in zip(self.nb, self.nk) for b, k in zip(nb, nk)),
            equations=self,
        )
        ends = [end - 1 for end in self.theta_at[1:]] if self.has_offset else []
        return form, np.delete(np.arange(self.N), ends)

    @cached_property
    def names(self) -> list[str]:
        """Names of the parameters: those of `Structure`, and offset.{output}."""
        form, at = self.canonical()
        found = [
            f"offset.{i + 1}" if self.outputs > 1 else "offset" for i, N in enumerate(self.sizes) for _ in range(N)
        ]
        for place, name in zip(at, form.names):
            found[place] = name
        return found

    def units(self, y_scale, u_scale) -> np.ndarray:
        """Return the squared units of theta for outputs and inputs of these sizes, (N,)."""
        form, at = self.canonical()
        found = np.repeat(np.square(y_scale), self.sizes)
        found[at] = form.units(y_scale, u_scale)[form.n :]
        return found


@dataclass(frozen=True)
class Lagged(Structure):
    """The states that `Equations` need: output i has as many as its equation has lags; some a, b are zero for good."""

    equations: Equations = Equations(((0,),), ((),), ((),))

    @cached_property
    def blocks(self) -> list[Block]:
        """The parameters, block by block in their order."""
        p, at, found = self.outputs, 0, []
        for i, (na, nb, nk) in enumerate(zip(self.equations.na, self.equations.nb, self.equations.nk)):
            parts = [(j, 1, size) for j, size in enumerate(na)]
            parts += [(p + l, first, size) for l, (first, size) in enumerate(zip(nk, nb))]
            for source, lag, size in parts:
                if size:
                    found.append(Block(i, source, lag, at, size))
                    at += size
        return found
