"""The Kalman filter of the user's own matrices."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...detect.gate import InnovationGate, resolve_gate
from ...detect.resolve import resolve_detector
from ...detect.watch import Silent
from ...engine import ud, validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...memory.likelihood_drift import LikelihoodDrift
from ...memory.settings import state_size
from ...models.scale import InverseGamma, KnownScale, resolve_scale
from ...models.state_space import LinearSystem, units
from ..base import Step
from ..common.observer import Observed, Observer, check_names
from ..common.priors import factors_of
from ..common.settings import arguments
from . import step as _step  # noqa: F401  (registers the step)
from .given import with_matrices
from .noise_factor import learnt as learnt_of
from .noise_factor import noise_factor
from .row import SCRATCH, STATE_SAMPLE, STATE_SPACE, StateSpaceForm
from .settings import effective, fading, scale_fading
from .summary import StateSummary
from .trace import StateTrace

WIDE = 1e8  # default prior variance in squared units of the data
SETTLE = 20.0  # outputs before a detector watches


class StateSpace(Observer):
    """State of a linear system with the user's own matrices: the Kalman filter, in U D U'.

        x(t) = F x(t-1) + G u(t-1) + w,  w ~ N(0, Q)        y(t) = H x(t) + D u(t) + v,  v ~ N(0, R)

    Each matrix is constant, or handed over with every sample: ``scan(y, u, F=..)`` takes (T, n, n), `update` (n, n).
    Those of sample t bring the state from sample t - 1 to t, and say how y(t) measures it. F, G and Q may be functions
    of the seconds between samples; or they are those of x' = F x + G u + w, and ``continuous=True``.

    Parameters
    ----------
    F : (n, n), or a number for a single state; or a function that returns it
        Transition over one sample; a function is given the seconds since the sample before.
    G : (n, k), optional
        How inputs act on the state one sample later; no input if omitted.
    H : (p, n), optional
        How outputs measure the state; the first state is measured if omitted. One row: y is (T,).
    D : (p, k), optional
        How inputs act on outputs at once.
    Q, R : (n, n) and (p, p), or diagonals, or variances
        Covariances of the noise on the state, over one sample, and on the outputs. R may be singular, and zero.
    x0 : (n,), optional
        State expected at the first sample; zero if omitted.
    P0 : (n, n), (n,) or a number, optional
        Its covariance. By default wide: 1e8 times the square of what shows as `y_scale` in an output within n samples.
    memory : Constant, ExponentialForgetting or LikelihoodDrift
        ``ExponentialForgetting(lam)`` divides the state's covariance by lam at each step, before Q is added: the fading
        filter of Sorenson and Sacks (1971), for matrices that are not quite right. ``LikelihoodDrift()``: Q is known up
        to a factor, learnt as samples come, up the likelihood (`noise_factor`). It may change, begins at 1, and lies
        between ``least/start`` and ``most/start``.
    gate : InnovationGate, optional
        Treat outliers of each output as missing.
    detector : optional
        What watches the whitened innovations, such as ``PageHinkley()``; an alarm is told (status JUMP), and changes
        nothing.
    scale : InverseGamma, optional
        Q, R and P0 are relative to an unknown sigma^2 with this prior: it is learnt, bands are Student's.
    scale_samples : float
        By how many samples sigma^2 is known: older ones fade, and it may change. All of them by default.
    states, inputs, outputs : names, optional
    y_scale : float or (p,)
        Typical size of the outputs, for the default prior; `scaled_to` sets it.
    dt : float
        Seconds between samples.
    continuous : bool
        F and G are of a differential equation and Q is the spectral density of its noise (per second): steps of any
        length, inputs held, are exact (Van Loan, 1978), ``time=`` gives the instants, and one may come again.

    Raises
    ------
    InputError
        Where sizes do not fit, Q, R or P0 is no covariance, or a matrix has NaN; the message says which and why.

    Notes
    -----
    NaN in y is a missing output, in part or in whole; a missing input is held, which the bars do not know. ``notes``
    says which states no output shows. Bad at: matrices that are wrong (see NIS: ``trace.nis`` is p on average), noise
    that is not white, and a default prior that decides: the evidence depends on P0.

    References
    ----------
    Bierman (1977), *Factorization Methods for Discrete Sequential Estimation*, chapters V-VI.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> speeds = 1 + 0.1 * np.cumsum(rng.standard_normal(200))
    >>> y = np.cumsum(speeds) + 2 * rng.standard_normal(200)
    >>> est = dw.StateSpace([[1, 1], [0, 1]], H=[1, 0], Q=[0, 0.01], R=4.0, states=("way", "speed"))
    >>> speed, std = est.scan(y).of("speed")
    >>> print(f"{speed[-1]:.1f} +- {std[-1]:.1f}, the truth is {speeds[-1]:.1f}")
    -0.4 +- 0.3, the truth is -0.5
    """

    trace_kind = StateTrace
    for_instants = "give F, G, Q in continuous time (continuous=True), or as functions of dt"
    sample_layout = STATE_SAMPLE
    window = math.inf
    is_growing, hold = True, "zoh"

    def __init__(
        self,
        F,
        G=None,
        H=None,
        D=None,
        Q=None,
        R=None,
        *,
        x0=None,
        P0=None,
        memory: Any = Constant(),
        gate: InnovationGate | None = None,
        detector: Any = None,
        scale: InverseGamma | None = None,
        scale_samples: float = math.inf,
        states=None,
        inputs=None,
        outputs=None,
        y_scale=1.0,
        dt: float = 1.0,
        continuous: bool = False,
    ):
        self.options = arguments(locals())
        self.dt = validation.size("dt", dt)
        self.functions: dict[str, Any] = {}
        F, G, Q = (self._now(name, value) for name, value in (("F", F), ("G", G), ("Q", Q)))
        self.irregular = validation.yes("continuous", continuous) or bool(self.functions)
        self.given = given = LinearSystem(F, G, H, D, Q, R, states, inputs, outputs)
        self.system = system = given.sampled(self.dt) if continuous else given
        if continuous and self.functions:
            raise InputError("continuous=True takes the matrices of x' = F x + G u + w, which are no functions of dt")
        n, k, p = system.n, system.inputs, system.outputs
        self.outputs = p if p > 1 else None
        self.plant: Any = system  # which observers call their plant
        self.noise_std = np.sqrt(np.diag(system.R))  # of each output
        self.model: Any = Observed(n, n, n, k, p, system.names, [], system.input_names, system.output_names)
        check_names(self.model)
        self._set_units(dt, y_scale)
        self._x0 = np.zeros(n) if x0 is None else validation.vector("x0", np.atleast_1d(x0), n)
        P = WIDE * np.diag(units(system, np.atleast_1d(self.y_scale)))
        self.prior_covariance = P if P0 is None else validation.covariance("P0", P0, n)
        self._U0, self._D0 = factors_of(self.prior_covariance)
        self.scale = resolve_scale(scale, scale is not None, n)
        self.scale_fade = scale_fading(scale_samples, scale)
        learnt: Any = noise_factor(memory, scale is not None) if isinstance(memory, LikelihoodDrift) else Constant()
        found = Silent() if detector is None else resolve_detector(detector)
        q, D_q = ud.factor(system.Q)
        A, B, W = (M.ravel() if continuous else np.zeros(0) for M in (given.F, given.G, given.Q))
        self.policies = (
            StateSpaceForm(
                float(n), float(k), float(p), float(state_size(learnt, n)), float(found.state_size(0)),
                self.dt, SETTLE, fading(memory), self.scale_fade, float(np.linalg.matrix_rank(system.R) < p),
                system.F.ravel(), system.G.ravel(), system.H.ravel(), system.D.ravel(),
                q[ud.packed_indices(n)], D_q, system.R.ravel(),
                A, B, W, self._x0, self._U0, self._D0,
            ),
            KnownScale(), learnt, resolve_gate(gate, n), self.scale, found,
        )  # fmt: skip
        self.dtype = STATE_SPACE.dtype(self.policies[0])
        self.scratch_size = SCRATCH.size(self.policies[0])

    @property
    def notes(self) -> list[str]:
        """What to know of the system before it is believed: sentences, none where every state is observable."""
        return self.system.notes

    @property
    def is_single_step(self) -> bool:
        """Whether a sample is one compiled step: matrices that are functions of dt are made in Python."""
        return not self.functions

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = super().start(series)
        state["x"], state["D"], state["U"] = self._x0, self._D0, self._U0
        return state

    def _now(self, name: str, value):
        """Return a matrix; of a function, which is kept, that over dt."""
        if not callable(value):
            return value
        self.functions[name] = value
        return value(self.dt)

    # --- running -------------------------------------------------------------------------------------------

    def update(self, state, y, u=None, *, time: float | None = None, **matrices) -> tuple[np.ndarray, Step]:
        """Return the next state and what this sample showed; NaN means missing.

        Parameters
        ----------
        state : from `start`, `update`, or a trace
        y : the output; with several (p,)
        u : the input, or a sequence of k inputs
        time : instant in seconds; dt after the sample before if omitted
        **matrices : F, G, H, D, Q, R of this sample, where they are not those of the constructor
        """
        if not matrices:
            return super().update(state, y, u, time=time)
        return self._update(self._rows(state), y, u, time, state, **matrices)

    def scan(self, y, u=None, *, state=None, keep: str = "std", time=None, **matrices):
        """Run over a record and return its trace; ``trace.state`` continues where it ended.

        Parameters
        ----------
        y : (T,) outputs, with several (T, p); NaN where missing
        u : (T,) or (T, k) inputs; NaN where missing (the last one is held on)
        state : state to start from; a fresh one if omitted
        keep : "innovations", "means" or "std": how much of each sample the trace holds
        time : (T,) increasing instants in seconds; steps of dt if omitted
        **matrices : F, G, H, D, Q, R of each sample, (T, n, n) and so on, or (n, n) for all
        """
        return self._scan(y, u, state, keep, time, **matrices)

    def update_batch(self, states, y, u=None, *, time=None):
        """Advance a fleet: one state, and one sample or a stretch of samples, per series; as of every estimator."""
        if time is not None and self.functions:
            raise InputError("a fleet goes by instants where continuous=True, not by functions of dt: give F, G, Q so")
        return super().update_batch(states, y, u, time=time)

    def _driving(self, u, time, state, **matrices) -> np.ndarray:
        if not matrices and (time is None or not self.functions):
            return super()._driving(u, time, state)
        return with_matrices(self, u, state, time, matrices)

    def tune(self, y, u=None, *, time=None, which=None) -> StateSpace:
        """Return the same estimator with Q and R as large as makes a record most likely, their shapes as given.

        ``found.tuned`` has the factors, the deviations of their logarithms, how much likelier that is, and a sentence.

        Parameters
        ----------
        y, u, time : as for `scan`
        which : "Q", "R" or both; both if omitted (where `scale` learns the common factor, Q)

        Notes
        -----
        Bad at: shapes that are wrong, matrices F and H that are wrong (their error is taken for noise), a history
        unlike what is to come, and records whose noise and wandering look alike; the deviations tell.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> rng = np.random.default_rng(1)
        >>> y = np.cumsum(0.1 * rng.standard_normal(2000)) + rng.standard_normal(2000)
        >>> found = dw.StateSpace(1.0, Q=1.0, R=0.1).tune(y)
        >>> print(f"Q = {found.system.Q[0, 0]:.4f}, R = {found.system.R[0, 0]:.2f}; the truth is 0.01 and 1")
        Q = 0.0100, R = 0.99; the truth is 0.01 and 1
        """
        from .tuning import check, tune

        which, measured = check(self, which), np.count_nonzero(np.isfinite(validation.numbers("y", y)))
        if measured <= self.model.n + len(which):
            raise InputError(f"y has {measured} measured values: too few to say how loud the noise is")
        return tune(self, y, u, time, which)

    # --- looking ahead, and at a record ---------------------------------------------------------------------

    def predict(self, state, u=None, horizon: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation of the next h outputs, (h,) or (h, p), given the inputs to come.

        It is a gap at the end of the record: exact, the noise of the outputs to come included.

        Parameters
        ----------
        state : one state, as `update` or a trace leaves it
        u : (h,) or (h, k) inputs to come; omitted where there are none
        horizon : int, optional
            h; the length of ``u`` if omitted.

        Examples
        --------
        >>> import driftwise as dw
        >>> est = dw.StateSpace([[1, 1], [0, 1]], H=[1, 0], Q=[0, 0.1], R=1.0)
        >>> mean, std = est.predict(est.scan([1.0, 2.0, 3.0, 4.0, 5.0]).state, horizon=3)
        >>> print(mean.round(2), std.round(2))
        [6. 7. 8.] [1.56 1.97 2.49]
        """
        u = validation.inputs_to_come(u, horizon, self.model.inputs)
        missing = np.full(len(u) if self.outputs is None else (len(u), self.outputs), np.nan)
        ahead = self.scan(missing, u if self.model.inputs else None, state=state, keep="innovations")
        return ahead.prediction, np.sqrt(ahead.variance)

    # --- looking back --------------------------------------------------------------------------------------

    def smooth(self, y, u=None, *, state=None, lag: int | None = None, keep: str = "std", time=None, **matrices):
        """Return the state at every sample given the whole record, or the samples up to ``lag`` later.

        The modified Bryson-Frazier recursion (1963) in the coordinates of the filter's factors: F, Q and P may be
        singular. What the gate rejects, it does not use either.

        Parameters
        ----------
        y, u, state, time, **matrices : as for `scan`
        lag : samples to look ahead; None: to the end
        keep : "means", "std" or "covariance"

        Returns
        -------
        Smoothed
            ``x`` and ``x_std`` (T, n), ``of(name)``, ``covariance`` (T, n, n).

        Notes
        -----
        Bad at: long lags, whose cost grows with them; fading memories, whose forgetting counts as noise on the state.

        Examples
        --------
        >>> import driftwise as dw
        >>> est = dw.StateSpace(1.0, Q=0.1, R=1.0, P0=10.0, states=("level",))
        >>> level, std = est.smooth([1.0, float("nan"), 2.0, 1.5]).of("level")
        >>> print(level.round(2), std.round(2))
        [1.38 1.44 1.49 1.49] [0.63 0.62 0.6  0.62]
        """
        from ...results.smoothed import Smoothed, width
        from .smoother import smooth

        y, u = validation.record(y, u, self.model.inputs, self.outputs)
        if not len(y):
            raise InputError("y is empty: there is nothing to smooth")
        lag = None if lag is None else validation.count("lag", lag)
        start = self.start() if state is None else np.array(state)
        us = u
        if matrices or (time is not None and self.functions):
            us = with_matrices(self, u, start, time, matrices)
        elif time is not None:
            us = np.column_stack([u, self._instants(time, len(y), start)])
        outs = np.empty((len(y), width(keep, self.model.N)))
        end = smooth(self, y.reshape(len(y), -1), us, start, lag, outs)
        return Smoothed(self, y, u, outs, keep, end, lag, self._clock(start, end, len(y)) if time is None else time)

    # --- reading a state -----------------------------------------------------------------------------------

    def mean(self, state) -> np.ndarray:
        """Return E x(t | t)."""
        return np.array(state["x"])

    def covariance(self, state) -> np.ndarray:
        """Return the covariance of x(t | t)."""
        return np.asarray(self.sigma2(state))[..., None, None] * ud.unpack(state["U"], state["D"])

    def estimate(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return x(t | t) and its standard deviations."""
        P = self.covariance(state)
        return self.mean(state), np.sqrt(np.diagonal(P, axis1=-2, axis2=-1))

    def sigma2(self, state):
        """Return the scale of Q, R and P0 learnt so far; 1 where it is known."""
        if not isinstance(self.scale, InverseGamma):
            return np.ones(np.shape(state["chi2"]))[()]
        alpha, beta = self.scale
        return (beta + 0.5 * state["chi2"]) / np.maximum(alpha + 0.5 * state["observed"], 0.5)

    def summary(self) -> StateSummary:
        """Return an empty summary of runs, to which traces are added."""
        return StateSummary(self)

    def noise_factor(self, state) -> tuple[float, float]:
        """Return what multiplies Q by now, and the deviation of its logarithm; 1 and 0 where it is not learnt."""
        memory = self.policies[2]
        return (1.0, 0.0) if isinstance(memory, Constant) else learnt_of(memory, state["memory_state"], self.model.n)

    def loglik(self, state) -> float:
        """Return log p(y) of all samples so far: the evidence of the model."""
        return float(state["score"])

    def degrees_of_freedom(self, is_used, observed) -> np.ndarray:
        """Return those of each prediction: infinite where the scale is known."""
        if not isinstance(self.scale, InverseGamma):
            return np.full(is_used.shape, np.inf)
        used = is_used.reshape(len(is_used), -1)
        each = used.sum(axis=1)
        before = effective(each, float(observed), self.scale_fade)
        found = np.maximum(2 * self.scale.alpha + before, 1.0)
        return np.broadcast_to(found.reshape(-1, *[1] * (is_used.ndim - 1)), is_used.shape).copy()
