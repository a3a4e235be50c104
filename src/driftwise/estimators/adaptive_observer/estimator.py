"""An adaptive observer: parameters and state of a plant from filtered data."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...models.equation import Equation
from ..arx.recursive import Recursive
from .step import Filtered

LONGEST = 100_000  # samples that the filter is waited for


class AdaptiveObserver(Recursive):
    """Parameters and state of a plant of which the observer's poles are chosen, by recursive least squares.

    The observer of Luenberger (1964) and Kudva and Narendra (1973), in the form of Kreisselmeier (1977). With the
    filter Lambda(q) = 1 + lambda_1 q^-1 + .. of the chosen poles, w_y = y/Lambda and w_u = u/Lambda,

        y(t) = sum_k (lambda_k - a_k) w_y(t-k) + sum_k b_k w_u(t-k) + e(t),      A(q) y = B(q) u + Lambda(q) e

    so this is ARMAX with the known noise polynomial C = Lambda. Poles at zero make it `ARX`; poles near the plant's own
    suit noise on the measurement. (`Joint` with ``NoisePolynomial`` is the exact posterior of the same model; this one
    starts the filter at zero, and learns nothing until that has faded to a thousandth.)

    Parameters
    ----------
    order : int
        Order n of the plant.
    poles : number, or (n,)
        Poles of the observer, inside the unit circle, complex ones with their conjugates; one number: n of it.
    inputs : int
        Number of inputs, each delayed by a sample.
    **options
        memory, gate, offset, variance, scale, missing, at_rest, theta0, P0, y_scale, u_scale and dt, as in `ARX`.

    Raises
    ------
    InputError
        Where a number does not fit; the message says which and why.

    Notes
    -----
    Bad at: noise whose colour is not Lambda (biased, like `ARX` under coloured noise), and poles near the unit circle
    (a long start; what a gap leaves in the filter dies slowly).

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=500, noise_std=0.1, seed=1)
    >>> est = dw.estimators.AdaptiveObserver(2, [0.5, 0.4], inputs=1)
    >>> trace = est.scan(y, u)
    >>> [f"{name} {value:.1f}" for name, value in zip(trace.names, trace.parameters[-1])]
    ['a1 -1.5', 'a2 0.7', 'b1 1.0', 'b2 0.5']
    >>> x, P = est.state_of(trace.state)
    >>> x.shape, P.shape
    ((2,), (2, 2))
    """

    def __init__(self, order: int = 2, poles=0.5, inputs: int = 1, **options):
        super().__init__(**options)
        given = poles.tolist() if isinstance(poles, np.ndarray) else poles
        self.options = {"order": order, "poles": given, "inputs": inputs, **self.options}
        n, k = validation.count("order", order, least=1), validation.count("inputs", inputs)
        offset = validation.yes("offset", self.options["offset"])
        self.model = Equation(n, (n,) * k, (1,) * k, offset)
        self.filter = _polynomial(poles, n)
        self._prepare(
            Filtered(
                N=0.0, na=1.0, inputs=k, deep=1.0, registers=(1 + k) * n * (1 + n), memory_size=0.0,
                detector_size=0.0, missing=0.0,
                settle=0.0, fill=_fading(self.filter), offset=float(offset), mixture_columns=0.0, noise=0.0,
                lam=self.filter[1:],
            ), n
        )  # fmt: skip

    def _kernel_form(self, form, R, memory) -> Filtered:
        return form._replace(noise=R)

    @cached_property
    def _shapes(self) -> np.ndarray:
        """N_k = sum_i lambda_{k-i} F^i: x = sum_k N_k ((lambda - a) w_y(t-k) + b w_u(t-k)), F the observer's matrix."""
        lam, n = self.filter, self.model.na
        F = np.eye(n, k=1)
        F[:, 0] -= lam[1:]
        powers = [np.linalg.matrix_power(F, i) for i in range(n)]
        return np.array([sum(lam[k - i] * powers[i] for i in range(k + 1)) for k in range(n)])

    def state_of(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return x(t+1 | t) (n,) in observer canonical form, measured state first, and its covariance (n, n).

        x(t+1) = shift_up(x) - a y + b u + lambda (y - x_1), y = x_1 + offset + e. The covariance is that of the
        parameters; what a gap left in the filter is not in it.
        """
        n, k = self.model.na, self.model.inputs
        w = np.asarray(state["registers"])[: (1 + k) * n].reshape(1 + k, n)
        Xi = np.einsum("lk,kij->lij", w, self._shapes)
        J = np.hstack([-Xi[0], *Xi[1:]])
        theta, P = self.mean(state), self.sigma2(state) * self.covariance(state)
        real = (1 + k) * n
        return Xi[0] @ self.filter[1:] + J @ theta[:real], J @ P[:real, :real] @ J.T


def _fading(lam) -> int:
    """Return after how many samples a number has faded to a thousandth in 1/Lambda, and left the lags."""
    from scipy.signal import lfilter

    h = np.abs(lfilter([1.0], lam, np.eye(1, LONGEST)[0]))
    return int(np.flatnonzero(h > 1e-3 * h.max())[-1]) + len(lam) - 1


def _polynomial(poles, n) -> np.ndarray:
    """Return 1, lambda_1 .. lambda_n of the poles."""
    try:
        values = np.asarray(poles, complex)
    except (TypeError, ValueError):
        raise InputError(f"poles must be numbers, got {poles!r}") from None
    if values.shape not in ((), (n,)) or not np.isfinite(values).all():
        raise InputError(f"poles must be a finite number, or {n} of them (one for each order), got {poles!r}")
    values = np.full(n, values) if values.ndim == 0 else values
    if np.any(abs(values) >= 1):
        raise InputError(f"poles must lie inside the unit circle, or the filter is unstable, got {poles!r}")
    lam = np.poly(values)
    if np.iscomplexobj(lam):
        raise InputError(f"complex poles come with their conjugates, got {poles!r}")
    return lam
