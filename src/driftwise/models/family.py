"""The general family of difference equations with one output: sizes, names and order of its parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .equation import Equation


@dataclass(frozen=True)
class Family(Equation):
    """A(q) y = sum_l B_l(q)/F_l(q) u_l + offset + C(q)/D(q) e (Ljung 1999, eq. 4.33; several inputs).

    The parameters, in order: a1.., b of the first input.., of the second.., c1.., d1.., f of the first input.., of the
    second.., offset. All polynomials but B are monic.
    """

    nc: int = 0
    nd: int = 0
    nf: tuple[int, ...] = ()

    @property
    def kept(self) -> int:  # type: ignore[override]  # a number that is worked out
        """Number of coefficients that multiply what is not measured: c, d and f."""
        return self.nc + self.nd + sum(self.nf)

    @property
    def plain(self) -> int:
        """Number of coefficients before them: a and b."""
        return self.na + sum(self.nb)

    @property
    def N(self) -> int:
        """Number of parameters."""
        return super().N + self.kept

    @property
    def order(self) -> int:
        """Number of poles of the fullest channel."""
        return self.na + max([self.nd, *self.nf, *(nb + nk - 1 - self.na for nb, nk in zip(self.nb, self.nk))])

    @cached_property
    def names(self) -> list[str]:
        """Names of the parameters; f2.1 is the second coefficient of the first input's F."""
        of = [f".{l + 1}" if self.inputs > 1 else "" for l in range(self.inputs)]
        f = [f"f{j + 1}{of[l]}" for l, nf in enumerate(self.nf) for j in range(nf)]
        free = [f"c{j + 1}" for j in range(self.nc)] + [f"d{j + 1}" for j in range(self.nd)] + f
        plain = super().names
        return plain[: self.plain] + free + plain[self.plain :]

    @property
    def words(self) -> str:
        """The equation as one reads it."""
        of = [str(l + 1) if self.inputs > 1 else "" for l in range(self.inputs)]
        right = [f"B{i}(q){f'/F{i}(q)' if nf else ''} u{i}(t)" for i, nf in zip(of, self.nf)]
        noise = ("C(q)" if self.nc else "1" if self.nd else "") + ("/D(q)" if self.nd else "")
        right += ["offset"] * self.has_offset + [f"{noise} e(t)".strip()]
        return f"{'A(q) ' if self.na else ''}y(t) = {' + '.join(right)}"

    def split(self, theta) -> tuple[np.ndarray, list[np.ndarray], np.ndarray, np.ndarray, list[np.ndarray]]:
        """Return A, [B of each input], C, D, [F of each input] in powers of q^-1; leading axes of theta are kept."""
        theta = np.asarray(theta, float)
        one = np.ones((*theta.shape[:-1], 1))
        ends = np.cumsum([self.na, *self.nb, self.nc, self.nd, *self.nf])
        a, *b, c, d, f = np.split(theta, ends[: len(self.nb) + 3], axis=-1)
        zero = [np.zeros((*theta.shape[:-1], nk)) for nk in self.nk]
        fs = np.split(f, np.cumsum(self.nf), axis=-1)[: len(self.nf)]

        def monic(p):
            return np.concatenate([one, p], axis=-1)

        B = [np.concatenate(pair, axis=-1) for pair in zip(zero, b)]
        return monic(a), B, monic(c), monic(d), [monic(p) for p in fs]
