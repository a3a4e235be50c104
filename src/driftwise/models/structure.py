"""Several outputs in canonical form: the tables that structure indices stand for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..engine.bounds import UNKNOWNS
from ..engine.errors import InputError


class Block(NamedTuple):
    """A run of parameters that multiply one datum, by lag: a_ij of the lags from ``lag`` on, or b_il."""

    output: int  # whose equation
    source: int  # which datum of z = [-y_1 .. -y_p, u_1 .. u_k]
    lag: int  # lag of the first parameter; 0: it acts at once, and the block has one parameter
    first: int  # where the block begins in theta
    size: int


def indices(structure, inputs: int) -> tuple[int, ...]:
    """Return the structure indices nu_1 .. nu_p as whole numbers; raise InputError where they are none."""
    whole = int | np.integer
    values: Any = [structure] if isinstance(structure, whole) else structure
    if not isinstance(values, Sequence | np.ndarray) or isinstance(values, str) or np.ndim(values) != 1:
        raise InputError(f"structure lists the order nu_i of each output, such as (2, 1); got {structure!r}")
    for value in values:
        if isinstance(value, bool) or not isinstance(value, whole) or value < 1:
            raise InputError(
                f"structure indices must be whole numbers of at least 1, got {structure!r}. "
                "An output without dynamics of its own is an input, or no output"
            )
    nu = tuple(int(v) for v in values)
    if not nu:
        raise InputError("structure is empty: it lists the order nu_i of each output, such as (2, 1)")
    size = sum(nu) * (len(nu) + inputs + 1) + len(nu) * inputs
    if size > UNKNOWNS:
        raise InputError(
            f"structure {nu} with {inputs} input(s) has about {size} unknowns; the limit is {UNKNOWNS}. "
            "Indices are orders, not lengths of records: were data given instead?"
        )
    return nu


@dataclass(frozen=True)
class Structure:
    """Structure indices nu_1..nu_p, k inputs, with direct terms or not; n = sum nu_i states, N unknowns.

    The canonical form of several outputs: with nu_ij = nu_i (i = j), min(nu_i + 1, nu_j) (i > j), min(nu_i, nu_j)
    (i < j), and a_ijk, k < nu_ij, b_ilk, k <= nu_i,

        x^i_{k+1}(t+1) = x^i_k(t) - sum_j a_ijk y_j + sum_l b_ilk u_l + w
        y_i = x^i_{nu_i} - sum_{j<i, nu_ij=nu_i+1} a_{ij,nu_i} y_j + sum_l b_{il,nu_i} u_l + w_n,i

    Two orders of the same numbers. *Salut's*: [x^1_1..x^1_nu1; x^2; ..; r^1; r^2; ..] with r^i = [a_i1 by k; a_i2; ..;
    b_i1 by k; ..; the a_{ij,nu_i}; the b_{il,nu_i}]. The *kernel's*: the same blocks, each by lag nu_i - k: the
    measured state first, and a1, a2, .. With one output both are those of `Canonical`.

    Examples
    --------
    >>> form = Structure((2, 1), 1)
    >>> form.n, form.N, form.names
    (3, 12, ['a1.11', 'a2.11', 'a2.12', 'b1.11', 'b2.11', 'a1.21', 'a1.22', 'b1.21', 'a0.21'])
    """

    nu: tuple[int, ...]
    inputs: int = 0
    direct: bool = False

    @property
    def outputs(self) -> int:
        """Number of outputs p."""
        return len(self.nu)

    @property
    def n(self) -> int:
        """Number of states."""
        return sum(self.nu)

    @property
    def N(self) -> int:
        """Number of unknowns, states and parameters."""
        return self.n + self.theta_at[-1]

    def length(self, i: int, j: int) -> int:
        """Return nu_ij, the number of parameters by which y_j acts on y_i."""
        nu = self.nu
        return nu[i] if i == j else min(nu[i] + (i > j), nu[j])

    @cached_property
    def blocks(self) -> list[Block]:
        """The parameters, block by block in their order."""
        p, found, at = self.outputs, [], 0
        for i, nu in enumerate(self.nu):
            parts = []
            for j in range(p):
                size = min(self.length(i, j), nu)
                parts.append((j, nu - size + 1, size))
            parts += [(p + l, 1, nu) for l in range(self.inputs)]
            parts += [(j, 0, 1) for j in range(i) if self.length(i, j) == nu + 1]
            parts += [(p + l, 0, 1) for l in range(self.inputs * self.direct)]
            for source, lag, size in parts:
                found.append(Block(i, source, lag, at, size))
                at += size
        return found

    @cached_property
    def x_at(self) -> list[int]:
        """Where the state of each output begins, and one past the last."""
        return [0, *np.cumsum(self.nu).tolist()]

    @cached_property
    def theta_at(self) -> list[int]:
        """Where the parameters of each output's equation begin, and one past the last."""
        sizes = [sum(b.size for b in self.blocks if b.output == i) for i in range(self.outputs)]
        return [0, *np.cumsum(sizes).tolist()]

    @cached_property
    def salut(self) -> np.ndarray:
        """Index that takes numbers in Salut's order to the kernel's: ``kernel = salut_ordered[salut]``."""
        order = np.arange(self.N)
        runs = [(self.x_at[i], nu) for i, nu in enumerate(self.nu)]
        runs += [(self.n + b.first, b.size) for b in self.blocks]
        for first, size in runs:
            order[first : first + size] = order[first : first + size][::-1]
        return order

    @property
    def kernel(self) -> np.ndarray:
        """The way back (every block is reversed, so it is the same index)."""
        return self.salut

    @cached_property
    def names(self) -> list[str]:
        """Names of the parameters: a{lag}.{output}{from output}, b{lag}.{output}{input}.

        a2.12 multiplies -y_2(t-2) in the equation of y_1, a0.21 multiplies -y_1(t) in that of y_2; a comma stands
        between the two where there are ten or more (a2.1,12). One output has the names of `Canonical`: a2, b1, b1.2.
        """
        p, found = self.outputs, []
        comma = "," if max(p, self.inputs) > 9 else ""
        for b in self.blocks:
            letter, number = ("a", b.source) if b.source < p else ("b", b.source - p)
            if p > 1:
                tail = f".{b.output + 1}{comma}{number + 1}"
            else:
                tail = f".{number + 1}" if letter == "b" and self.inputs > 1 else ""
            found += [f"{letter}{b.lag + i}{tail}" for i in range(b.size)]
        return found

    @cached_property
    def state_names(self) -> list[str]:
        """Names of the states, measured first: x{k}.{output} with Salut's k (x{k} for one output)."""
        tail = (lambda i: f".{i + 1}") if self.outputs > 1 else (lambda i: "")
        return [f"x{nu - k}{tail(i)}" for i, nu in enumerate(self.nu) for k in range(nu)]

    @cached_property
    def sources(self) -> np.ndarray:
        """Which datum of z = [-y_1 .. -y_p, u_1 .. u_k] each parameter multiplies, (m,)."""
        return np.repeat([b.source for b in self.blocks], [b.size for b in self.blocks])

    @cached_property
    def targets(self) -> np.ndarray:
        """Which output's equation each parameter belongs to, (m,)."""
        return np.repeat([b.output for b in self.blocks], [b.size for b in self.blocks])

    @cached_property
    def lags(self) -> np.ndarray:
        """Lag of each parameter, (m,)."""
        return np.concatenate([b.lag + np.arange(b.size) for b in self.blocks])

    def polynomials(self, theta):
        """Return A (max nu + 1, p, p) and B (max nu + 1, p, k) by lag: sum_h A_h y(t-h) = sum_h B_h u(t-h)."""
        p, theta = self.outputs, np.asarray(theta, float)
        both = np.zeros((max(self.nu) + 1, p, p + self.inputs))
        both[0, :, :p] = np.eye(p)
        both[self.lags, self.targets, self.sources] += theta
        return both[..., :p], both[..., p:]

    def units(self, y_scale, u_scale) -> np.ndarray:
        """Return the squared units of [x ; theta] for outputs and inputs of these sizes, (N,)."""
        data = np.concatenate([y_scale, u_scale])
        return np.concatenate([np.repeat(y_scale, self.nu), y_scale[self.targets] / data[self.sources]]) ** 2
