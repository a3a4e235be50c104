"""Salut's canonical form: sizes, names and orders of its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Canonical:
    """Order n, k inputs, with direct terms or not, with unknown noise polynomial or not, with an offset or not.

    Two orders of the same numbers: the *kernel's*, measured state first and parameters by lag (a1..an, b1..bn, c1..cn,
    b0), and *Salut's*, [x_1..x_n ; a_0..a_{n-1}, b_0..b_{n-1}, d_0..d_{n-1}, b_n] with a_{n-i} = ai, d_{n-i} = ci.
    """

    n: int
    inputs: int = 0
    direct: bool = False
    coloured: bool = False
    has_offset: bool = False
    labels = ()  # no names replace those of b

    @cached_property
    def blocks(self) -> int:
        """Number of blocks of n numbers: state, a, b of each input, c."""
        return 2 + self.inputs + self.coloured

    @cached_property
    def direct_terms(self) -> int:
        """Number of direct terms."""
        return self.inputs if self.direct else 0

    @cached_property
    def direct_at(self) -> int:
        """Index of the first direct term among the parameters."""
        return self.n * (self.blocks - 1)

    @cached_property
    def N(self) -> int:
        """Number of unknowns, state and parameters."""
        return self.n * self.blocks + self.direct_terms + int(self.has_offset)

    @cached_property
    def salut(self) -> np.ndarray:
        """Index that takes numbers in Salut's order to the kernel's: ``kernel = salut_ordered[salut]``."""
        order = np.arange(self.N)
        end = self.n * self.blocks
        order[:end] = order[:end].reshape(-1, self.n)[:, ::-1].ravel()
        return order

    @property
    def kernel(self) -> np.ndarray:
        """The way back (every block is reversed, so it is the same index)."""
        return self.salut

    @property
    def state_names(self) -> list[str]:
        """Names of the states, the measured one, Salut's x_n, first."""
        return [f"x{self.n - i}" for i in range(self.n)]

    @cached_property
    def names(self) -> list[str]:
        """Names of the parameters: a1..an, b1..bn of each input (b1.2 is the second input's), c1..cn, b0."""
        lags = range(1, self.n + 1)

        def of(i: int) -> str:
            return f".{i + 1}" if self.inputs > 1 else ""

        return (
            [f"a{k}" for k in lags]
            + [f"b{k}{of(i)}" for i in range(self.inputs) for k in lags]
            + [f"c{k}" for k in lags if self.coloured]
            + [f"b0{of(i)}" for i in range(self.direct_terms)]
            + ["offset"] * self.has_offset
        )

    def polynomials(self, theta):
        """Return A (.., n + 1) and B (.., k, n + 1) in powers of q^-1 for parameters (.., N) in kernel order."""
        n, k = self.n, self.inputs
        theta = np.asarray(theta, float)
        each = theta.shape[:-1]
        A, B = np.ones((*each, n + 1)), np.zeros((*each, k, n + 1))
        A[..., 1:] = theta[..., :n]
        B[..., 1:] = theta[..., n : n + n * k].reshape(*each, k, n)
        if self.direct:
            B[..., 0] = theta[..., self.direct_at : self.direct_at + self.direct_terms]
        return A, B

    def noise_polynomial(self, theta):
        """Return C (n + 1,) in powers of q^-1 for a parameter vector in kernel order; 1 where it is not a parameter."""
        n, k = self.n, self.inputs
        c = np.asarray(theta, float)[n * (k + 1) : n * (k + 2)] if self.coloured else np.zeros(n)
        return np.concatenate([[1.0], c])


def power_of_two(values) -> float:
    """Return the power of two nearest to the typical size of the finite values; 1 where all are zero, or absurd."""
    values = np.abs(np.asarray(values, float))
    values = values[(values > 1e-100) & (values < 1e100)]
    if not values.size:
        return 1.0
    exponent = int(np.frexp(values.max())[1])
    rms = np.sqrt(np.mean(np.ldexp(values, -exponent) ** 2))
    return float(np.ldexp(1.0, exponent + round(float(np.log2(rms)))))
