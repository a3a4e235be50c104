"""State feedback from measured lags alone, designed for an estimated equation and for how unsure it is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..engine.errors import InputError

STEPS, SETTLED = 200, 1e-9  # of the Riccati recursion at most; relative change of the gain that ends it


@dataclass(frozen=True)
class Lagged:
    """A(q) y = B(q) u as z(t+1) = F z(t) + G u(t) whose state is measured, with the integral of the error in the end.

    z = [y(t).., u(t-1).., sum of (r - y)]: the non-minimal form of proportional-integral-plus control (Young, Behzadi,
    Wang and Chotai 1987). What the parameters multiply is ``rows`` z + ``row`` u; it enters y(t+1), and the
    integral with the other sign, along ``entry``.
    """

    na: int
    nb: int
    nk: int

    @classmethod
    def of(cls, est) -> Lagged:
        """Return the form of an `ARX` with one delayed input; raise InputError where it is something else."""
        if not (est.is_arx and est.model.inputs == 1 and est.model.nk[0] >= 1 and est.model.nb[0] >= 1):
            raise InputError(
                f"the controller is designed from an ARX with one input and a delay of at least 1, got {est!r}; "
                "create_adaptive_iosystem takes any estimator of one output"
            )
        return cls(est.model.na, est.model.nb[0], est.model.nk[0])

    @property
    def outputs(self) -> int:
        """How many outputs the state holds."""
        return max(self.na, 1)

    @property
    def inputs(self) -> int:
        """How many past inputs the state holds."""
        return self.nb + self.nk - 2

    @property
    def size(self) -> int:
        """Size of the state."""
        return self.outputs + self.inputs + 1

    @cached_property
    def entry(self) -> np.ndarray:
        """How y(t+1) enters the state."""
        h = np.zeros(self.size)
        h[0], h[-1] = 1.0, -1.0
        return h

    @cached_property
    def rows(self) -> np.ndarray:
        """What the parameters multiply, (na + nb, size) of the state; see ``row``."""
        M = np.zeros((self.na + self.nb, self.size))
        M[range(self.na), range(self.na)] = -1.0
        for j in range(self.nb):
            if self.nk + j > 1:
                M[self.na + j, self.outputs + self.nk + j - 2] = 1.0
        return M

    @cached_property
    def row(self) -> np.ndarray:
        """What the parameters multiply, (na + nb,) of the input."""
        m = np.zeros(self.na + self.nb)
        m[self.na] = 1.0 if self.nk == 1 else 0.0
        return m

    def matrices(self, theta) -> tuple[np.ndarray, np.ndarray]:
        """Return F and G for parameters a.., b..; F, G[:, None] are what `control.place` and `control.dlqr` take."""
        y, u, n = self.outputs, self.inputs, self.size
        F, G = np.zeros((n, n)), np.zeros(n)
        F[range(1, y), range(y - 1)] = 1.0
        F[range(y + 1, y + u), range(y, y + u - 1)] = 1.0
        F[-1, -1] = 1.0
        if u:
            G[y] = 1.0
        return F + np.outer(self.entry, theta @ self.rows), G + self.entry * (theta @ self.row)


def cautious_gain(form: Lagged, theta, P, tracking: float = 1.0, integral: float = 0.1, effort: float = 0.1):
    """Return the gain K (size,) of u = -K z that minimises the expected cost for parameters theta +- P.

    The cost is the sum of tracking y^2 + integral (sum of errors)^2 + effort u^2 over the next 200 samples, about the
    set point. Parameters are taken as drawn anew from N(theta, P) at each of them (Astrom and Wittenmark's caution), so
    that P = 0 is the linear-quadratic regulator, and a gain of the plant that is unknown makes K small. None where
    there is no such gain.

    Notes
    -----
    Bad at: an unstable plant that is poorly known: caution lets it go (the uncertainty threshold), since what is
    unknown now is taken to stay unknown; it does not see that acting teaches.

    Examples
    --------
    >>> import numpy as np
    >>> form = Lagged(na=1, nb=1, nk=1)
    >>> for deviation in (0.0, 0.2, 1.0):  # of b1
    ...     print(cautious_gain(form, np.array([-0.9, 0.5]), np.diag([0.0, deviation**2])).round(2))
    [ 1.47 -0.43]
    [ 1.33 -0.38]
    [ 0.36 -0.07]
    """
    F, G = form.matrices(theta)
    Q = np.diag([tracking, *[0.0] * (form.size - 2), integral])
    zz, zu, uu = form.rows.T @ P @ form.rows, form.row @ P @ form.rows, form.row @ P @ form.row
    V, K = Q, np.zeros(form.size)
    with np.errstate(all="ignore"):
        for step in range(STEPS):
            spread = form.entry @ V @ form.entry  # what an unforeseen y(t+1) costs
            before = K
            mixed = G @ V @ F + spread * zu
            K = mixed / (effort + G @ V @ G + spread * uu)
            V = Q + F.T @ V @ F + spread * zz - np.outer(K, mixed)
            V = (V + V.T) / 2
            if not np.isfinite(V).all():
                return None
            if step >= form.size and np.abs(K - before).max() <= SETTLED * np.abs(K).max():
                break
    return K
