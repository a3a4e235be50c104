"""Continuous time: the parameters of a differential equation from samples at any instants."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...detect.gate import InnovationGate, resolve_gate
from ...engine import validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...memory.random_walk import RandomWalk
from ...memory.settings import Setting, resolve_watch, state_size
from ...models import noise as noises
from ...models.canonical import Canonical
from ...models.continuous import ContinuousModel
from ...models.continuous import observer as filters
from ...models.scale import InverseGamma, resolve_scale
from ..common.fading import FadingPosterior
from ..common.memories import memory_of_joint, prior_of_parameters
from ..common.priors import covariance_of, factors_of, mean_of
from ..common.settings import arguments, floor_of
from ..common.times import instants
from .step import CONTINUOUS, Continuous, scratch_size

RATE = 0.2  # default observer rate times dt: 6 % of the Nyquist rate (docs/continuous.md has the trade)


class ContinuousJoint(FadingPosterior):
    """Posterior of A(p) y = B(p) u, p = d/dt, from samples at regular or irregular instants, sample by sample.

    A(p) = p^n + a1 p^(n-1) + .. + an, B(p) = b1 p^(n-1) + .. + bn. Both sides pass the filter 1/(p + c)^n, whose
    response to an input that is held and to an output on straight lines between *measured* samples has a closed form
    over any gap. What is left is linear in the parameters and in the state x(t0) at the first measured sample:

        y_k = sum_i (lam_i - a_i) phi_i[y] + b_i phi_i[u] + x_i(t0) phi_i[impulse] + v_k,   phi_i = p^(n-i)/(p + c)^n

    Regularised least squares in it is exact, on U D U' factors, O(N^2) a sample. y_k ends its own straight line,
    so the estimate uses it on both sides; the prediction solves for it (``docs/continuous.md``).

    Parameters
    ----------
    order : int
        Order n of the differential equation, at least 1.
    inputs : int
        Number of inputs k, each held from its sample to the next.
    observer : float, optional
        Rate c of the filter in rad/s, best near the plant's bandwidth. Default 0.2/dt, for plants that move in some
        five to fifty samples.
    noise : EquationError
        White v_k; without a variance its scale is learnt.
    memory : policy
        How the past of the parameters is forgotten, as in `Joint`. The q of a `RandomWalk` is a variance per *second*;
        all other memories count samples, however far apart.
    gate : InnovationGate, optional
        Treat outliers as missing: the straight line passes them by.
    scale : InverseGamma, optional
        All variances relative to an unknown sigma^2 with this inverse-gamma prior.
    s0, P0 : (N,), and scalar, (N,) or (N, N), optional
        Prior mean and covariance in Salut's order [x_1..x_n ; a_0.., b_0..], x being x(t0). The default is wide, in
        units of `y_scale`, `u_scale` and c.
    y_scale, u_scale : float, (k,)
        Typical size of the data, for the default prior; `scaled_to` sets them.
    dt : float
        Typical seconds between samples: the interval where no time is given, and what the default observer goes by.
    floor : float
        Relative round-off carried by y.

    Raises
    ------
    InputError
        Where a number does not fit; the message says which and why.

    Notes
    -----
    Source: Salut et al. (1979), eq. 2, in the discretisation of Young (1981) and Garnier and Wang (2008), by filters.

    Bad at: measurement noise (it enters the regressors: the bias of a grows with its variance; a lower c softens it,
    and on regular samples `Joint` with `OutputError` has none), plants faster than the samples and gaps longer than the
    plant's time constants (a straight line is then not what y did), dead time, parameters that change within 1/c.
    Its error bars know nothing of these biases, however well the predictions hold: on precise data the bias of the
    straight lines exceeds them. Compare two observer rates before trusting a digit.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> time = np.cumsum(np.random.default_rng(0).uniform(0.02, 0.18, 600))
    >>> y, u = dw.models.simulate_continuous([0.3, 1.0], [0.0, 2.0], time=time, noise_std=0.005, seed=1)
    >>> trace = dw.ContinuousJoint(2, inputs=1, dt=0.1).scan(y, u, time=time)
    >>> [f"{name} {value:.2f}" for name, value in zip(trace.names, trace.parameters[-1])]
    ['a1 0.29', 'a2 1.00', 'b1 -0.01', 'b2 1.99']
    """

    takes_instants = True
    _x = "x0"

    def __init__(
        self,
        order: int,
        inputs: int = 0,
        *,
        observer: float | None = None,
        noise: Any = noises.EquationError(),
        memory: Any = Constant(),
        gate: InnovationGate | None = None,
        scale: InverseGamma | None = None,
        s0=None,
        P0=None,
        y_scale: float = 1.0,
        u_scale=1.0,
        dt: float = 1.0,
        floor: float = 1e-12,
    ):
        self.options = arguments(locals())
        self.model = model = Canonical(validation.count("order", order, least=1), validation.count("inputs", inputs))
        n, N = model.n, model.N
        if n > 12:
            raise InputError(f"order must be at most 12, got {order}: beyond, the filters' binomials eat the digits")
        self._set_units(dt, y_scale, u_scale)
        self.observer = RATE / self.dt if observer is None else validation.positive("observer", observer)
        if not isinstance(noise, noises.EquationError):
            raise InputError(
                f"noise must be EquationError(variance) in continuous time, got {noise!r}; for noise on the sensor "
                "alone use Joint on regular samples"
            )
        relative = scale is not None or noise.variance is None
        kernel_noise = noises.resolve(noise, n, N, model.salut, self.y_scale**2)
        self.scale = resolve_scale(scale, relative, N)
        self._set_prior(s0, P0)
        lam, V = filters(n, self.observer)
        detector, settle = resolve_watch(memory, N)
        found, fades, learns = self._resolve_memory(memory, kernel_noise.R)
        shape = Continuous(
            n, inputs, self.observer, self.dt, floor_of(floor), settle, detector.state_size(0),
            state_size(found, N - n), float(getattr(found, "per_second", False)), fades, learns, lam, V.ravel(),
        )  # fmt: skip
        self.policies = (
            shape,
            kernel_noise,
            found,
            resolve_gate(gate, self.model.N),
            # where samples fade the row keeps 2 alpha and 2 beta, and they fade with the memory
            InverseGamma(0.0, 0.0) if fades and relative else self.scale,
            detector,
        )
        self.scratch_size = scratch_size(n, inputs)
        self.dtype = CONTINUOUS.dtype(shape)

    # --- prior ---------------------------------------------------------------------------------------------

    def _set_prior(self, s0, P0):
        n, order = self.model.n, self.model.salut
        names = [*self.model.state_names, *self.model.names]
        self._s0 = mean_of("s0", s0, order, names)
        x = self.y_scale**2 * self.observer ** (2.0 * np.arange(n))
        self.prior_covariance = covariance_of(P0, order, np.concatenate([x, self._theta_units()]), names)
        self._U0, self._D0 = factors_of(self.prior_covariance)

    def _theta_units(self):
        """Return the squared units of theta: powers of the observer's rate, times y over u for b."""
        rate = self.observer ** (2.0 * np.arange(1, self.model.n + 1))
        return np.concatenate([rate, np.outer((self.y_scale / self.u_scale) ** 2, rate).ravel()])

    def _resolve_memory(self, memory, R):
        n, N = self.model.n, self.model.N
        setting = Setting(
            self._theta_units(), np.diag(self.prior_covariance)[n:], self.scale, R, N - n,
            prior_of_parameters(self._s0, self._U0, self._D0, n), n,
        )  # fmt: skip
        found, fades, learns = memory_of_joint(memory, setting)
        if isinstance(found, RandomWalk) and found.is_absolute:
            raise InputError(f"in continuous time a walk has q, a variance per second: RandomWalk(q), got {memory!r}")
        return found, fades, learns

    def scaled_to(self, y, u=None, *, time=None) -> ContinuousJoint:
        """Return the same estimator with its default prior in units of the data (powers of two).

        With ``time``, dt becomes its median step, and the default observer follows. Scaling y or u by a power of two
        then scales every result exactly.
        """
        scaled = super().scaled_to(y, u)
        if time is None or len(y) < 2:
            return scaled
        return ContinuousJoint(**scaled.options | {"dt": float(np.median(np.diff(instants(time, (len(y),)))))})

    # --- running -------------------------------------------------------------------------------------------

    def _instants(self, time, samples, state) -> np.ndarray:
        """Return the instants of samples; a stream's next one has a short way in."""
        if samples == 1 and isinstance(time[0], float) and math.isfinite(time[0]) and state is not None:
            if time[0] > state["time"] and state["samples"] > 0:
                return np.array([time[0]])
        return instants(time, (samples,), state)

    def _clock(self, start, end, samples) -> np.ndarray:
        return float(end["time"]) - self.dt * np.arange(samples)[::-1]

    def smooth(self, *args, **options):
        """Refuse (InputError): x(t0) and the parameters do not move here, and the last state knows them."""
        raise InputError(
            "there is nothing to smooth in continuous time: x(t0) and the parameters are constants, and the last state "
            "knows them given the whole record (trace.model(), trace.state)"
        )

    # --- reading a state -----------------------------------------------------------------------------------

    def mean(self, state) -> np.ndarray:
        """Return E s in Salut's order [x_1..x_n ; a_0.., b_0..], x being x(t0)."""
        s = np.concatenate([state["x0"], state["theta"]], axis=-1)
        return s[..., self.model.kernel]

    def model_at(self, values, covariance) -> ContinuousModel:
        """Return the model of given parameters and covariance."""
        return ContinuousModel(self.model, values, covariance)
