"""The difference equations of several outputs: which lags of what each has, what their coefficients are called."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .structure import Block, Structure

Table = tuple[tuple[int, ...], ...]


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
