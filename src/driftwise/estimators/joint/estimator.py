"""The joint filter: state and parameters of one output's ARMAX equation, exactly (Salut et al. 1979)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ...detect.gate import InnovationGate, resolve_gate
from ...engine import validation
from ...engine.errors import InputError
from ...memory.auto import AutoMemoryKernel
from ...memory.constant import Constant
from ...memory.random_walk import RandomWalk
from ...memory.restart_on_change import CovarianceInflationKernel
from ...memory.settings import Setting, state_size
from ...models import noise as noises
from ...models.canonical import Canonical
from ...models.convert import Model
from ...models.scale import InverseGamma, resolve_scale
from ..algebraic_start.start import AlgebraicStart, prepare
from ..common.fading import FadingPosterior
from ..common.memories import forgets_state, memory_of_joint, prior_of_parameters, watch_of_joint
from ..common.priors import WIDTH, covariance_of, factors_of, mean_of
from ..common.settings import arguments, floor_of
from . import step as _step  # noqa: F401  (registers the step)
from .row import JOINT, Form, scratch_size


class Joint(FadingPosterior):
    """Posterior of state and parameters of A(q) y = B(q) u + offset + C(q) v, sample by sample.

    The model is Salut's canonical form (1979, eqs. 2, 17-20), here with the measured state first:

        x+ = shift_up(x) - a y + sum_l b_l u_l + w,    y = x[0] + sum_l b0_l u_l + offset + w_n

    Given data, it is linear in the state *and* the parameters, so the filter is the exact posterior (theorem
    3) when the noise (w, w_n) is Gaussian with the stated covariances; every sample costs O(N^2). (`OutputError` is the
    exception: there the posterior is approximate.) It runs on
    U D U' factors, so P stays symmetric and non-negative for ever, at any prior.

    Parameters
    ----------
    order : int
        Order n of the model, at least 1.
    inputs : int
        Number of inputs k.
    direct : bool
        Whether u(t) acts on y(t) at once (the term b0).
    offset : bool
        Whether a constant is estimated too, as the last parameter: what y and u are measured from does not matter then.
    noise : EquationError, OutputError, NoisePolynomial, UnknownPolynomial or NoiseCovariance
        What disturbs the plant. Without a variance, the scale is learnt (Student-t bands).
    memory : policy
        How the past of the parameters is forgotten; any of `driftwise.memory`. Whatever it does to what is known of
        them, the state *given* them stays what it is; a drift leaves the state itself where it is.
    gate : InnovationGate, optional
        Treat outliers as missing, before they enter F.
    scale : InverseGamma, optional
        All variances relative to an unknown sigma^2 with this inverse-gamma prior.
    s0, P0 : (N,), and scalar, (N,) or (N, N), optional
        Prior mean and covariance in Salut's order [x_1..x_n ; a_0.., b_0.., b_n], or by name, as ``{"a1": -0.8}``. The
        default is wide, in the units of `y_scale` and `u_scale`.
    y_scale, u_scale : float, (k,)
        Typical size of the data, for the default prior; `scaled_to` sets them.
    dt : float
        Seconds between samples.
    floor : float
        Relative round-off carried by y: R_t = R + (floor max|y recent|)^2, for signals that grow for ever.
    forget_state : bool
        Forget the state given the parameters as well, at the rate at which a memory that forgets does so.
    start : "algebraic" or AlgebraicStart, optional
        Identify the first samples at once and go on from there: for `OutputError`.

    Raises
    ------
    InputError
        Where a number does not fit; the message says which and why.

    Notes
    -----
    Bad at: white measurement noise under `EquationError` (biased), parameters that jump under `Constant`, orders far
    above the truth (nearly cancelling poles and zeros are not identifiable: see `information_ratio`), irregular
    sampling, offsets that nobody told (``offset=True``, or subtract them first).

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=400, noise_std=0.1, seed=1)
    >>> trace = dw.Joint(2, inputs=1).scan(y, u)
    >>> [f"{name} {value:.2f}" for name, value in zip(trace.names, trace.parameters[-1])]
    ['a1 -1.50', 'a2 0.70', 'b1 1.00', 'b2 0.48']
    """

    def __init__(
        self,
        order: int,
        inputs: int = 0,
        direct: bool = False,
        *,
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
        form: str | None = None,
        offset: bool = False,
        forget_state: bool = False,
        start: str | AlgebraicStart | None = None,
    ):
        self.options, floor = arguments(locals()), floor_of(floor)
        self.model = model = Canonical(
            validation.count("order", order, least=1),
            validation.count("inputs", inputs),
            bool(direct) and inputs > 0,
            isinstance(noise, noises.UnknownPolynomial),
            validation.yes("offset", offset),
        )
        self._set_units(dt, y_scale, u_scale)
        N, n = model.N, model.n

        relative = scale is not None or getattr(noise, "variance", 0.0) is None
        kernel_noise = noises.resolve(noise, n, N, model.salut, self.y_scale**2)
        self.scale = resolve_scale(scale, relative, N)
        units = self._theta_units()
        kernel_noise = self._set_prior(s0, P0, units, noise, kernel_noise, relative)
        kappa = getattr(kernel_noise, "kappa", ())
        self.form = form or ("array" if len(kappa) == N else "ud")
        rows = N if self.form == "array" else n
        if self.form not in ("ud", "array") or len(kappa) > rows:
            raise InputError(f"form must be 'ud' or 'array' ('array' where noise reaches the parameters), got {form!r}")
        if isinstance(kernel_noise, noises.Coloured):
            kernel_noise = _pad(kernel_noise, rows)
        columns = kernel_noise.G.size // rows if isinstance(kernel_noise, noises.Coloured) else 0
        detector, settle, slopes = watch_of_joint(memory, N, units)
        setting = Setting(
            units, np.diag(self.prior_covariance)[n:], self.scale, kernel_noise.R, N - n - int(model.has_offset),
            prior_of_parameters(self._s0, self._U0, self._D0, n), n, self._lags(), poles=n,
            rows_stay=isinstance(kernel_noise, noises.White),
        )  # fmt: skip
        memory, fades, learns = memory_of_joint(memory, setting)
        if learns and self.form == "array" and len(kappa) == N:
            raise InputError(
                f"noise that reaches the parameters is how they drift, and {type(self.options['memory']).__name__} is "
                "to find that out: take Constant() or RandomWalk(q), or leave that noise out"
            )
        memory_size = state_size(memory, N - n)
        shape = Form(
            n,
            inputs,
            model.direct_terms,
            float(model.coloured),
            rows,
            columns,
            floor,
            self.prior_covariance[0, 0],
            1e-60 * kernel_noise.R,
            settle,
            detector.state_size(N - n),
            memory_size,
            fades,
            learns,
            slopes,
            forgets_state(forget_state, memory),
            float(model.has_offset),
            float(isinstance(kernel_noise, noises.Sensor) and isinstance(memory, AutoMemoryKernel)),
        )
        # where samples fade the row keeps 2 alpha and 2 beta, and they fade with the memory
        kernel_scale = InverseGamma(0.0, 0.0) if fades and relative else self.scale
        self.policies = (shape, kernel_noise, memory, resolve_gate(gate, N), kernel_scale, detector)
        self.scratch_size = scratch_size(shape)
        if start is not None and model.has_offset:
            raise InputError("start identifies the first samples without an offset: offset=False, or start=None")
        self.starting = None if start is None else prepare(self, start, kernel_noise, model, range(N - n), n)
        self.dtype = JOINT.dtype(shape, more=self.starting.fields if self.starting else [])

    # --- prior ---------------------------------------------------------------------------------------------

    def _set_prior(self, s0, P0, units, noise, kernel_noise, is_relative):
        """Set mean and factors of the prior; return the kernel's noise, which may wait for its part of it."""
        N, n, back = self.model.N, self.model.n, self.model.salut
        c = slice(n * (self.model.blocks - 1), n * self.model.blocks) if self.model.coloured else slice(0)
        names = [*self.model.state_names, *self.model.names]
        if s0 is None and self.model.coloured and noise.d is not None:
            s0 = np.zeros(N)
            s0[c] = noises.coefficients(noise.d, n)
        self._s0 = mean_of("s0", s0, back, names)
        P = covariance_of(P0, back, np.concatenate([np.full(n, self.y_scale**2), units]), names)
        if P0 is None and self.model.coloured and not is_relative:
            P[c, c] = noise.std**2 * np.eye(n)
        self._U0, self._D0 = factors_of(P)
        self.prior_covariance = P
        if self.model.coloured and P0 is None and is_relative:
            self._D0[c] = 0.0  # held until sigma^2 is known
            return kernel_noise._replace(settle=2.0 * N, most=WIDTH)
        return kernel_noise

    def _theta_units(self):
        """Return the squared units of theta: none for a, those of y over u for b, those of y for the offset."""
        n, gain = self.model.n, (self.y_scale / self.u_scale) ** 2
        c = np.ones(n * self.model.coloured)
        offset = np.full(int(self.model.has_offset), self.y_scale**2)
        return np.concatenate([np.ones(n), np.repeat(gain, n), c, gain[: self.model.direct_terms], offset])

    def _lags(self):
        """Return how many samples later than the first each parameter acts on y: one for each place of the state."""
        at_once = self.model.direct_terms + int(self.model.has_offset)
        lags = np.tile(np.arange(self.model.n) + float(at_once > 0), self.model.blocks + 1)
        return np.concatenate([lags, np.zeros(at_once)])

    # --- looking ahead ------------------------------------------------------------------------------------------

    def predict(self, state, u=None, horizon: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (h,) and standard deviation (h,) of the next h outputs, given the inputs to come.

        It is a gap at the end of the record: the exact moments of each step, which hold the noise still to come, the
        uncertainty of state and parameters, and what the memory lets them drift meanwhile.

        Parameters
        ----------
        state : one state, as `update` or a trace leaves it
        u : (h,) or (h, k) inputs to come; omitted where the model has none
        horizon : int, optional
            h; the length of ``u`` if omitted.

        Notes
        -----
        Bad at: far horizons of a model near the edge of stability, whose outputs are far from Gaussian.

        Examples
        --------
        >>> import driftwise as dw
        >>> y, u = dw.simulate([-0.8], [1.0], samples=500, noise_std=0.1, seed=1)
        >>> est = dw.Joint(1, inputs=1)
        >>> mean, std = est.predict(est.scan(y, u).state, [1.0, 1.0, 1.0])
        >>> std.round(2).tolist()
        [0.11, 0.14, 0.15]
        """
        u = validation.inputs_to_come(u, horizon, self.model.inputs)
        ahead = self.scan(np.full(len(u), np.nan), u if self.model.inputs else None, state=state, keep="innovations")
        return ahead.prediction, np.sqrt(ahead.variance)

    # --- looking back -------------------------------------------------------------------------------------------

    def smooth(self, y, u=None, *, state=None, lag: int | None = None, keep: str = "std", time=None):
        """Return state and parameters at every sample given the whole record, or the samples up to ``lag`` later.

        The modified Bryson-Frazier recursion in the coordinates of the filter's own factors (F and P are singular here,
        so neither may be inverted). Exact where the filter is; around missing samples it is the best linear smoother of
        the filter's moments. Constant parameters have one value for the whole record; `RandomWalk` and
        `RestartOnChange` are where smoothing pays. The record is held in memory, its covariances are not.

        Parameters
        ----------
        y, u, state, time : as for `scan`
        lag : samples to look ahead; None: to the end
        keep : "means", "std" or "covariance"

        Notes
        -----
        Bad at: a fixed lag, whose cost grows with it; and priors 1e14 times wider than what the record teaches, where a
        variance is no better than round-off of the prior's (its standard deviation is then too large, not too small);
        and the samples between a jump and its alarm (`RestartOnChange`), which count as the old parameters.

        Examples
        --------
        >>> import driftwise as dw
        >>> y, u = dw.simulate([-0.8], [1.0], samples=200, noise_std=0.1, seed=1)
        >>> smoothed = dw.Joint(1, inputs=1).smooth(y, u)
        >>> print(smoothed.parameters[0].round(2), smoothed.parameters_std[0].round(3))
        [-0.8   1.01] [0.003 0.007]
        """
        if not isinstance(self.policies[2], Constant | RandomWalk | CovarianceInflationKernel):
            raise InputError(
                "smooth runs the filter backwards under a memory that is given: Constant(), RandomWalk(q) or "
                f"RestartOnChange(); {type(self.options['memory']).__name__} goes by rules that have no such way back"
            )
        if self.starting:
            raise InputError(
                "smooth looks at the whole record, so a start from its first samples is of no use: start=None"
            )
        from ...results.smoothed import Smoothed, width
        from .smoother import smooth

        y, u = validation.record(y, u, self.model.inputs)
        if not len(y):
            raise InputError("y is empty: there is nothing to smooth")
        lag = None if lag is None else validation.count("lag", lag)
        outs = np.empty((len(y), width(keep, self.model.N)))
        final = smooth(self, y, u, self.start() if state is None else state, lag, outs)
        return Smoothed(self, y, u, outs, keep, final, lag, time)

    def batch(self, y, u=None, *, state=None):
        """Return the state after a complete record by one least squares: a second opinion on `scan`."""
        from .batch import batch

        return batch(self, y, u, state)

    # --- what else there is --------------------------------------------------------------------------------

    @property
    def for_colour(self) -> str:  # type: ignore[override]  # words that depend on options
        """What to try where the noise is not white."""
        is_free = isinstance(self.options["noise"], noises.UnknownPolynomial)
        return "a higher order" if is_free else "noise=UnknownPolynomial(), or a higher order"

    @property
    def automatic(self) -> str:
        """What to write for a memory that finds out by itself."""
        return "memory=AutoMemory()"

    def as_regression(self) -> Any:
        """Return an ARX of the same lags where the noise is that of an equation, else None."""
        from ..arx.estimator import ARX

        if not isinstance(self.options["noise"], noises.EquationError):
            return None
        form = self.model
        lags = (form.n + form.direct,) * form.inputs
        return ARX(form.n, lags, (1 - form.direct,) * form.inputs, offset=form.has_offset)

    # --- reading a state -----------------------------------------------------------------------------------

    def model_at(self, theta, P) -> Model:
        """Return the model of a parameter vector and its covariance; an offset belongs to none."""
        size = self.model.N - self.model.n - int(self.model.has_offset)
        return Model(replace(self.model, has_offset=False), theta[..., :size], P[..., :size, :size], self.dt)

    def mean(self, state) -> np.ndarray:
        """Return E s(t+1 | t) in Salut's order [x_1..x_n ; a_0.., b_0.., b_n]."""
        s = np.concatenate([state["x"], state["theta"]], axis=-1)
        return s[..., self.model.kernel]


def _pad(noise, rows):
    """Let constant noise on the state reach ``rows`` rows."""
    n = len(noise.kappa)
    if n == rows:
        return noise
    kappa = np.zeros(rows)
    kappa[:n] = noise.kappa
    G = noise.G.reshape(-1, n)
    full = np.zeros((len(G), rows))
    full[:, :n] = G
    return noise._replace(kappa=kappa, G=full.ravel())
