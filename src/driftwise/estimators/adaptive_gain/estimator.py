"""The adaptive gain: a Kalman filter of a known plant that learns its gain from the innovations."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...detect.gain import GainProbes, PullTest
from ...detect.gate import resolve_gate
from ...detect.resolve import resolve_detector
from ...detect.watch import Silent
from ...engine import ud, validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...memory.directional_forgetting import DirectionalForgetting
from ...memory.exponential_forgetting import ExponentialForgetting
from ...memory.gain_floor import GainFloor
from ...memory.questions import on_alarm
from ...memory.random_walk import RandomWalk
from ...memory.settings import Setting, answers, resolve_memory, state_size
from ...memory.variable_forgetting import VariableForgetting
from ...models.convert import Model
from ...models.gain import GainPlant
from ...models.scale import InverseGamma, KnownScale, check_scale
from ..arx.methods import LeastSquares
from ..common.columns import GAIN_SAMPLE
from ..common.posterior import Posterior
from ..common.priors import factors_of
from ..common.refusals import check_taken
from ..common.settings import arguments
from . import step as _step  # noqa: F401  (registers the step)
from .row import GAIN, INNOVATION, PROBES, PULL, SCRATCH, GainForm

USUAL = 0.2  # Q/R of the gain to start from: .36 for a random walk
RADIUS = 1 - 1e-3
WAIT = 5  # innovations that make a variance, before K moves
SETTLE = 20  # measured samples before the detector counts
GRID = (0.05, 0.12, 0.25, 0.45, 0.75)  # probes of a scalar state
RATIOS = 10.0 ** np.arange(-4, 2)  # probes of several states: Q/R
SEQUENCES = Constant, GainFloor, ExponentialForgetting, VariableForgetting, DirectionalForgetting
UNTOLD = InverseGamma(0.0, 0.0)  # nothing is known of the innovation variance
NEAR = InverseGamma(5.0, 5.0)  # what the memory learns of it, as a share of the running mean: one, to ten samples
VAGUE = 1e10  # with a gain sequence the data alone speak, from the first sample


class AdaptiveGain(Posterior):
    """State of a known plant with unknown noise: a Kalman filter that learns its gain K from the innovations.

        x+ = Phi x + B u + w (variance Q unknown),   y = H x + e (variance R unknown)
        nu = y - H x(t|t-1),   x(t|t) = x(t|t-1) + K nu,   x(t+1|t) = Phi x(t|t) + B u

    K follows the prediction error's gradient; Q and R may jump or drift. The parameters are the entries of K.

    Parameters
    ----------
    Phi : (n, n), or a number for a scalar state
        Transition over one sample.
    H : (n,)
        Output row; the first state is measured if omitted. One output only.
    B : (n, k)
        Input matrix; no input if omitted.
    method : "rpem" or "plr"
        Gradient of the prediction with respect to K: whole, or (Hampton's) through the last innovation only, which
        can move a scalar K and no other.
    memory : policy
        How the past of K is forgotten; by default a `RandomWalk` matched to jumps of half the prior deviation every 400
        samples (q = P0/1600). q is in squared units of K. Fourteen of nineteen have a meaning: docs/adaptive-gain.md.
    detector : GainProbes, PullTest or any detector of innovations, optional
        Frees K when it alarms; an alarm never moves K itself.
    restart : float, or (up, down), optional
        What an alarm does: with `RandomWalk`, K regains at least this share of its prior standard deviation (0.5); with
        a gain sequence it is the number of samples N0 > 1 whose mean K then is: the next gain is 1/N0 (26.5).
    gate : InnovationGate, optional
        Treat outliers as missing.
    limits : (low, high), "stable" or None
        Limits of H K of a scalar state (by default 0 and 1), poles of the filter inside 1 - 1e-3 by halving the step
        (the default of several states and of unstable ones), or neither: then K may make the filter unstable.
    scale : InverseGamma, optional
        Prior of the innovation variance, relative to y_scale^2: 2 alpha samples of variance beta/alpha. Worth giving;
        without it K waits for five innovations (`RandomWalk`).
    scale_samples : int
        Memory of the innovation variance.
    K0, P0 : (n,), and scalar, (n,) or (n, n), optional
        Prior mean and covariance of K. By default the Kalman gain of a plant whose states all walk, with a variance
        of R/5 in y, give or take itself (no prior at all where the memory has a gain sequence: `Constant` and all that
        forget at a rate; P0 is then relative to y_scale^2).
    x0 : (n,), optional
        State predicted for the first sample; if omitted the first n outputs set it (dead beat).
    y_scale : float
        Typical size of y; `scaled_to` sets it.
    dt : float
        Seconds between samples.

    Raises
    ------
    InputError
        Where shapes do not fit, K cannot be learnt (an unobservable state, a singular Phi), or K0 is unstable.

    Notes
    -----
    Bad at: a plant that is wrong (the gain then hides it), short records (some hundred samples decide), the error of
    single states: from y alone only the gain is known, so `x_std` is exact for a scalar state and a lower bound for
    more. A gap in y is bridged by the steady gain. A missing input is held, and the next output teaches nothing.

    References
    ----------
    Hampton's filter as in Perriot-Mathonna (1981), with the forgetting that its variance lacks as printed; gradient
    as in Ljung and Soderstrom (1983), section 3.8.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> x = np.cumsum(0.5 * rng.standard_normal(2000))     # a random walk, seen with noise of variance 1
    >>> trace = dw.AdaptiveGain(1.0).scan(x + rng.standard_normal(2000))
    >>> print(f"{trace.parameters[-1, 0]:.2f} +- {trace.parameters_std[-1, 0]:.2f}, the best is 0.39")
    0.38 +- 0.08, the best is 0.39
    """

    sample_layout = GAIN_SAMPLE

    def __init__(
        self,
        Phi=1.0,
        H=None,
        B=None,
        *,
        method: str = "rpem",
        memory: Any = None,
        detector: Any = None,
        restart: Any = None,
        gate: Any = None,
        limits: Any = "default",
        scale: InverseGamma | None = None,
        scale_samples: int = 100,
        K0=None,
        P0=None,
        x0=None,
        y_scale: float = 1.0,
        dt: float = 1.0,
    ):
        self.options = arguments(locals())
        self.model = plant = _plant(Phi, H, B)
        if method not in ("rpem", "plr") or (method == "plr" and plant.n > 1):
            raise InputError(
                f'method must be "rpem", or "plr" for a scalar state, got {method!r} with {plant.n} state(s): '
                "the pseudo-linear row H Phi nu moves K along one direction only"
            )
        self._set_units(dt, y_scale)
        usual = plant.gain(USUAL)
        check_taken("AdaptiveGain", memory)
        is_walk = memory is None or isinstance(memory, RandomWalk)
        is_absolute = not isinstance(memory, SEQUENCES)
        self._set_prior(usual, is_absolute)
        prior = np.diag(self.prior_covariance)[plant.n :].copy()
        memory = self._resolve_memory(RandomWalk(prior / 1600) if memory is None else memory, prior)
        check_scale(scale, proper=True)
        self.scale = scale or UNTOLD
        if detector is not None and not answers(type(memory), on_alarm):
            raise InputError(
                f"detector frees K at an alarm, and {type(self.memory).__name__} has no answer to alarms: leave it "
                "out, or take RandomWalk(q) or Constant()"
            )
        signal, probes, detector = self._resolve_detector(detector, is_absolute)
        low, high, radius = _limits(limits, plant, self._s0[plant.n :])
        poles, moves = plant.closed
        form = GainForm(
            n=float(plant.n), inputs=float(plant.inputs), score=float(method == "rpem"), absolute=float(is_absolute),
            whitened=float(is_absolute and not is_walk),
            start=float(plant.n if x0 is None else 0), wait=float(WAIT if is_absolute and scale is None else 0),
            samples=float(validation.count("scale_samples", scale_samples, least=2)), unit=self.y_scale**2,
            settle=float(SETTLE), signal=float(signal), low=low, high=high, radius=radius,
            memory_size=float(state_size(memory, plant.n)), detector_size=float(detector.state_size(plant.n)),
            Phi=plant.Phi.ravel(), H=plant.H, B=plant.B.ravel(), dead_beat=plant.dead_beat,
            cap=prior, poles=poles, moves=moves.ravel(),
            reopen=_restart(restart, is_absolute), probes=probes.ravel(),
        )  # fmt: skip
        self.policies = (form, LeastSquares(1.0), memory, resolve_gate(gate, plant.N), KnownScale(), detector)
        self.dtype = GAIN.dtype(form)
        self.scratch_size = SCRATCH.size(form)

    def _set_prior(self, usual, is_absolute):
        n, options = self.model.n, self.options
        x0 = np.zeros(n) if options["x0"] is None else validation.vector("x0", np.atleast_1d(options["x0"]), n)
        K0 = usual if options["K0"] is None else validation.vector("K0", np.atleast_1d(options["K0"]), n)
        P = np.diag(usual**2) * (1.0 if is_absolute else VAGUE)
        P = P if options["P0"] is None else validation.covariance("P0", options["P0"], n)
        P = P if is_absolute else P / self.y_scale**2
        self._s0 = np.concatenate([x0, K0])
        (self._U0, self._D0), self.prior_covariance = factors_of(P), np.zeros((2 * n, 2 * n))
        self.prior_covariance[n:, n:] = P

    def _resolve_memory(self, memory, prior) -> Any:
        """Return the kernel's memory."""
        if np.any(np.asarray(getattr(memory, "phi", 1.0)) != 1.0):
            raise InputError(
                f"phi must be 1 here: K would relax to 0, a filter that listens to nothing, got {memory.phi!r}"
            )
        n, is_walk = self.model.n, isinstance(memory, RandomWalk)
        share = UNTOLD if is_walk or isinstance(memory, SEQUENCES) else NEAR
        found = resolve_memory(memory, Setting(np.ones(n), prior, share, 1.0, n, (self._s0[n:], self._U0, self._D0)))
        return found._replace(matched=()) if is_walk else found  # the same here: P is absolute

    def _resolve_detector(self, detector, is_absolute):
        """Return what the detector listens to, the gains of its probes (M, n), and the kernel's detector."""
        n, none = self.model.n, np.zeros((0, self.model.n))
        if detector is None:
            return INNOVATION, none, Silent()
        if isinstance(detector, GainProbes):
            probes = _probes(detector.gains, self.model)
            return PROBES, probes, detector.resolve(len(probes))
        if isinstance(detector, PullTest) and is_absolute:
            raise InputError("PullTest needs a memory with a gain sequence, such as Constant(): use GainProbes")
        if isinstance(detector, PullTest):
            return PULL, none, detector.resolve(n)
        return INNOVATION, none, resolve_detector(detector, np.ones(n))

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = super().start(series)
        state["probes"] = state["x"][..., None, :]
        state["count"], state["chi2"] = 2 * self.scale.alpha, 2 * self.scale.beta * self.y_scale**2
        if self.policies[0].whitened:
            state["relative"] = 2 * NEAR.alpha, 2 * NEAR.beta
        return state

    # --- reading a state -----------------------------------------------------------------------------------

    def kalman_gain(self, state) -> np.ndarray:
        """Return the learnt gain K (n,)."""
        return np.array(state["theta"])

    mean = kalman_gain

    def sigma2(self, state) -> float:
        """Return the innovation variance."""
        return float(self._innovation_variance(state))

    def _innovation_variance(self, state) -> np.ndarray:
        return np.where(state["count"] > 0, state["chi2"] / np.maximum(state["count"], 1e-300), self.y_scale**2)

    def unit_of(self, state) -> Any:
        """Return what `covariance` is relative to: the innovation variance under a gain sequence, else one or near."""
        form = self.policies[0]
        if form.whitened:
            return state["relative"][..., 1] / state["relative"][..., 0]
        return np.ones_like(state["count"]) if form.absolute else self._innovation_variance(state)

    def _covariance(self, state) -> np.ndarray:
        """Return the covariance of [x; K] given all so far, relative to `unit_of`."""
        n, W, K = self.model.n, state["W"], state["theta"]
        P, hk = ud.unpack(state["U"], state["D"]), K @ self.model.H
        c, unit = self._innovation_variance(state), self.unit_of(state)
        relative = np.where(unit > 0, c / np.where(unit > 0, unit, 1.0), 1.0)
        share = np.where(hk > 0, relative / np.where(hk > 0, hk, 1.0), 0.0)
        full = np.empty((*P.shape[:-2], 2 * n, 2 * n))
        full[..., n:, n:], full[..., :n, n:] = P, W @ P
        full[..., n:, :n] = np.swapaxes(W @ P, -1, -2)
        full[..., :n, :n] = W @ P @ np.swapaxes(W, -1, -2) + share[..., None, None] * K[..., :, None] * K[..., None, :]
        return full

    def _theta_units(self) -> np.ndarray:
        """Return the squared units of K in those of y: none, x is in units of its own."""
        return np.ones(self.model.n)

    def scale_posterior(self, state) -> tuple[float, float]:
        """Return (alpha, beta) of the innovation variance."""
        return float(state["count"]) / 2, float(state["chi2"]) / 2

    def loglik(self, state) -> float:
        """Return the sum of log predictive densities of the samples so far (Gaussian, learnt variance)."""
        return float(state["score"])

    def model_of(self, state) -> Model:
        """Return the innovations model A(q) y = B(q) u + C(q) e a state amounts to; A and B known, C from the gain."""
        return self.model_at(*self.parameters_of(state))

    def model_at(self, K, P) -> Model:
        """Return the innovations model of a gain and its covariance."""
        form, values, covariance = self.model.canonical(K, P)
        return Model(form, values, covariance, self.dt)


def _plant(Phi, H, B) -> GainPlant:
    given, Phi = Phi, np.atleast_2d(validation.floats("Phi", Phi))
    n = len(Phi)
    if Phi.shape != (n, n) or not n or not np.isfinite(Phi).all():
        raise InputError(f"Phi must be a finite square matrix or a number, got {given!r}")
    H = np.eye(n)[0] if H is None else validation.floats("H", H)
    if H.ndim == 2 and len(H) > 1:
        raise InputError(f"H has {len(H)} rows, but one output is all that AdaptiveGain takes: use one filter for each")
    given, B = B, np.zeros((n, 0)) if B is None else validation.floats("B", B)
    if B.ndim < 2 and B.size == n:
        B = B.reshape(n, 1)
    if B.ndim != 2 or len(B) != n or not np.isfinite(B).all():
        raise InputError(f"B must be a finite ({n}, k) matrix, got {given!r}")
    plant = GainPlant(Phi, validation.vector("H", H.ravel(), n), B)
    if plant.rank < n:
        raise InputError(
            "the gain cannot be learnt: a state that y does not show (Phi, H unobservable), or one that Phi forgets at "
            "once (Phi singular). Leave such states out"
        )
    return plant


def _limits(limits, plant, K0) -> tuple[float, float, float]:
    """Return the limits of H K and the radius of the poles as the kernel wants them."""
    if isinstance(limits, str) and limits == "default":
        limits = (0.0, 1.0) if plant.n == 1 and abs(plant.Phi[0, 0]) <= 1 else "stable"
    if limits is None:
        return -np.inf, np.inf, 0.0
    if isinstance(limits, str) and limits == "stable":
        if not max(abs(plant.poles(K0))) < RADIUS:
            raise InputError(f"K0 must keep the filter stable: Phi (I - K0 H) has a pole beyond {RADIUS}")
        return -np.inf, np.inf, RADIUS
    is_pair = np.shape(limits) == (2,) and all(isinstance(limit, int | float | np.number) for limit in limits)
    if plant.n > 1 or not is_pair or not limits[0] < limits[1]:
        raise InputError(f'limits must be (low, high) of H K for a scalar state, "stable" or None, got {limits!r}')
    if any(abs(plant.Phi[0, 0] * (1 - limit)) > 1 for limit in limits):
        raise InputError(f"limits must keep the filter stable, abs(Phi (1 - H K)) <= 1, got {limits!r}")
    return float(limits[0]), float(limits[1]), 0.0


def _restart(restart, is_walk) -> np.ndarray:
    """Return the (up, down) answers to an alarm."""
    pair = validation.each("restart", (0.5 if is_walk else 26.5) if restart is None else restart, 2)
    if not np.all((0 < pair) & (pair <= 1) if is_walk else pair > 1):
        what = "a share of the prior deviation, above 0 and at most 1," if is_walk else "a number of samples above 1"
        raise InputError(f"restart must be {what} with this memory, got {restart!r}")
    return pair


def _probes(gains, plant) -> np.ndarray:
    """Return the gains (M, n) of the probes."""
    if gains is None:
        return np.array([plant.gain(r) for r in RATIOS]) if plant.n > 1 else np.array(GRID)[:, None] / plant.H
    gains = validation.floats("gains", gains)
    gains = gains[:, None] if gains.ndim == 1 and plant.n == 1 else gains
    if gains.ndim != 2 or gains.shape[1] != plant.n or not len(gains):
        raise InputError(f"gains of the probes must be (M, {plant.n}), got shape {gains.shape}")
    if not np.isfinite(gains).all() or not all(max(abs(plant.poles(K))) < 1 for K in gains):
        raise InputError("a probe is unstable, or no number: Phi (I - K H) has a pole outside the unit circle")
    return gains
