"""One coordinate of a target that may manoeuvre: two poles at 1, and a third that is learnt (position form)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.special import stdtrit

from ...detect.gate import InnovationGate, resolve_gate
from ...detect.watch import Silent
from ...engine import validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...models import noise as noises
from ...models.canonical import Canonical, power_of_two
from ...models.scale import InverseGamma, resolve_scale
from ..common.posterior import Posterior
from ..common.priors import WIDTH, factors_of
from ..common.settings import arguments
from ..joint.row import Form, scratch_size
from . import step as _step  # noqa: F401  (registers the step)
from .row import MANOEUVRE, ManoeuvreForm

ALONG = np.array([-1.0, 2.0, -1.0])  # a1, a2, a3 per unit of phi
STILL = np.array([-2.0, 1.0, 0.0])  # and where phi is zero
SPREAD = 25.0  # variance of the state after two plots, in units of the noise
STATE = np.ndarray | np.void  # anything else is a trace
FIRST = 10  # plots that tell the noise


class Manoeuvre(Posterior):
    """Track one coordinate on a regular scan: constant velocity, and an acceleration whose memory is learnt.

    The model is (1 - phi q)(1 - q)^2 y = C(q) v with q the delay by one scan: two poles are held at 1, so position and
    velocity go on for ever, and phi, the pole of the manoeuvre, is estimated together with the state. phi =
    exp(-alpha dt) is Singer's model with an unknown time constant 1/alpha; phi = 0 is a plain random acceleration. The
    joint filter of `Joint` runs in it, so a missed scan (NaN) has its exact moments, and the noise scale is learnt.

    Parameters
    ----------
    rho, m : float, int
        The noise polynomial C(q) = (1 - rho q)^m, m = 2 or 3. Larger rho trusts the track more than the plot.
    d : (3,), optional
        Instead: d_0, d_1, d_2 of C(z) = z^3 + d_2 z^2 + d_1 z + d_0, as `Singer.canonical` gives them.
    variance : float, optional
        Variance of v; learnt if omitted.
    pole, pole_std : float
        What is believed of phi beforehand.
    walk : float
        Variance of the step that phi takes each scan (relative to sigma^2 where that is learnt).
    limit : float
        phi is kept within -limit..limit.
    gate : InnovationGate, optional
        Treat outliers as missed.
    scale : InverseGamma, optional
        Prior of the noise variance, relative to y_scale^2.
    y_scale : float
        Roughly the standard deviation of a plot; `scaled_to` sets it from the first ten.
    dt : float
        Seconds from scan to scan.

    Raises
    ------
    InputError
        Where a number does not fit; the message says which and why.

    Notes
    -----
    Two plots start it (status SKIPPED): position and velocity have no prior. Bad at: irregular scans (times must be
    multiples of dt, NaN where nothing was seen), noise that grows with range (its scale is that of the whole
    track), the wrong rho (a flat optimum between .35 and .75, a cliff above for m = 3), and tracks of fewer than
    fifteen plots.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng, time = np.random.default_rng(1), 4.0 * np.arange(300)
    >>> east = 200 * time + 4000 * np.sin(time / 30) + 30 * rng.standard_normal(300)
    >>> est = dw.tracking.Manoeuvre(dt=4.0).scaled_to(east)
    >>> trace = est.scan(east)
    >>> print("phi {:.2f} +- {:.2f}".format(*est.pole(trace.state)))
    phi 0.97 +- 0.10
    >>> print("{:.0f} +- {:.0f} m/s".format(*est.velocity(trace.state)))
    86 +- 15 m/s
    """

    holds_poles = True
    remedy = "another rho, or TrackEstimator"

    def __init__(
        self,
        rho: float = 0.5,
        m: int = 2,
        *,
        d=None,
        variance: float | None = None,
        pole: float = 0.0,
        pole_std: float = 0.45,
        walk: float = 1e-4,
        limit: float = 0.98,
        gate: InnovationGate | None = None,
        scale: InverseGamma | None = None,
        y_scale: float = 1.0,
        dt: float = 1.0,
    ):
        self.options = arguments(locals())
        self.model = model = Canonical(3)
        self._set_units(dt, y_scale)
        limit, pole, pole_std, walk = _pole(limit, pole, pole_std, walk)
        d = coefficients(rho, m) if d is None else validation.vector("d", d, 3)
        noise: Any = noises.resolve(noises.NoisePolynomial(d, variance), 3, 6, model.salut, self.y_scale**2)
        if not noise.R > 0:
            raise InputError(f"variance must be positive, got {variance!r}: a plot without noise is no radar's")
        self.scale = resolve_scale(scale, variance is None, model.N)
        if scale is None and variance is None:
            self.scale = InverseGamma(1.5, 1.5)
        P = np.diag(np.repeat([WIDTH * self.y_scale**2, 0.0], 3))
        P[3:, 3:] = pole_std**2 * np.outer(ALONG, ALONG)
        self._s0 = np.concatenate([np.zeros(3), STILL + pole * ALONG])
        (self._U0, self._D0), self.prior_covariance = factors_of(P), P
        form = Form(3, 0, 0, 0, 3, 0, 1e-12, P[0, 0], 1e-60 * noise.R, np.inf, Silent().state_size(0), *7 * (0,))
        self.policies = (
            ManoeuvreForm(*form, walk, pole_std**2, limit, SPREAD),
            noise, Constant(), resolve_gate(gate, model.N), self.scale, Silent(),
        )  # fmt: skip
        self.scratch_size = scratch_size(form)
        self.dtype = MANOEUVRE.dtype(self.policies[0])

    def scaled_to(self, y, u=None) -> Manoeuvre:
        """Return the same estimator with ``y_scale`` from the second differences of the first ten plots."""
        y, _ = validation.record(y, u, 0)
        return Manoeuvre(**{**self.options, "y_scale": power_of_two([_noise_of(y)])})

    # --- reading a state -----------------------------------------------------------------------------------

    def pole(self, of):
        """Return the manoeuvre pole phi and its standard deviation, of a state or at every sample of a trace.

        Parameters
        ----------
        of : a state, or a trace of this estimator (kept with "std")
        """
        if not isinstance(of, STATE):
            return -of.parameters[:, 2], of.parameters_std[:, 2]
        return -float(of["theta"][2]), math.sqrt(self.sigma2(of) * self._theta_covariance(of)[2, 2])

    def time_constant(self, of, level: float = 0.95):
        """Return (low, value, high) of the manoeuvre's time constant -dt / ln phi in seconds.

        Zero where phi is not positive (an acceleration without memory), infinite where it is not below one. ``level``
        is the share that the band from low to high should hold.

        Parameters
        ----------
        of : a state, or a trace of this estimator (kept with "std")
        level : share between 0 and 1
        """
        if not 0 < level < 1:
            raise InputError(f"level is a share between 0 and 1, got {level!r}. Is it a percentage? 95 % is 0.95")
        phi, std = self.pole(of)
        dof = of.dof if not isinstance(of, STATE) else 2 * self.scale_posterior(of)[0]
        dof = np.minimum(dof, 1e8)
        half = stdtrit(dof, 0.5 + level / 2) * std
        return tuple(self._seconds(value) for value in (phi - half, phi, phi + half))

    def _seconds(self, phi):
        with np.errstate(divide="ignore"):
            found = -self.dt / np.log(np.clip(phi, 0.0, 1.0))
        return np.abs(found) if np.ndim(found) else abs(float(found))

    def velocity(self, state) -> tuple[float, float]:
        """Return the mean velocity expected from the next scan to the one after it, and its standard deviation.

        In units of y per second, given all plots so far.
        """
        if state["track"][0] < 2:
            return math.nan, math.inf
        x, phi, P = state["x"], -float(state["theta"][2]), self._covariance(state)
        g = np.array([1 + phi, 1.0, 0.0, 0.0, 0.0, -x[0]])  # of E y(t+2) - E y(t+1) = x_2 + (1 + phi) x_3
        mean, s2 = x[1] + (1 + phi) * x[0] - self.sigma2(state) * P[0, 5], self.sigma2(state)
        return float(mean) / self.dt, math.sqrt(max(s2 * float(g @ P @ g), 0.0)) / self.dt

    def mean(self, state) -> np.ndarray:
        """Return E s(t+1 | t) in Salut's order [x_1, x_2, x_3 ; a_0, a_1, a_2]."""
        return np.concatenate([state["x"], state["theta"]], axis=-1)[..., self.model.kernel]

    def _theta_units(self) -> np.ndarray:
        """Return the squared units of a: none."""
        return np.ones(3)


def coefficients(rho, m) -> np.ndarray:
    """Return d_0, d_1, d_2 of C(q) = (1 - rho q)^m."""
    if m not in (2, 3):
        raise InputError(f"m must be 2 or 3, the power of C(q) = (1 - rho q)^m, got {m!r}; for another C give d")
    if not (isinstance(rho, int | float | np.number) and 0 <= rho < 1):
        raise InputError(f"rho must be at least 0 and below 1, got {rho!r}: C(q) = (1 - rho q)^m must be invertible")
    c = [-3 * rho, 3 * rho**2, -(rho**3)] if m == 3 else [-2 * rho, rho**2, 0.0]
    return np.array(c[::-1], float)


def _pole(limit, pole, pole_std, walk):
    """Return what is said of phi, checked."""
    limit = validation.positive("limit", limit)
    if limit >= 1:
        raise InputError(f"limit must be below 1, got {limit!r}: with phi at 1 the acceleration would never fade")
    numbers = [validation.each(name, v, 1)[0] for name, v in (("pole", pole), ("pole_std", pole_std), ("walk", walk))]
    if abs(numbers[0]) > limit:
        raise InputError(f"pole must lie within -limit..limit, {limit:g}, got {pole!r}")
    if numbers[1] < 0 or numbers[2] < 0:
        raise InputError(f"pole_std and walk must not be negative, got {pole_std!r} and {walk!r}")
    return limit, *map(float, numbers)


def _noise_of(y) -> float:
    """Return the standard deviation of the plots from the second differences of the first ten, or of all."""
    for part in (y[:FIRST], y):
        second = np.abs(np.diff(part, n=2))
        second = second[np.isfinite(second)]
        if second.size and np.median(second) > 0:
            return 1.4826 * float(np.median(second)) / math.sqrt(6)
    return 0.0
