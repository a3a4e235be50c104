"""Physical parameters of a plant that is written as formulas, sample by sample, with its state."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np

from ...detect.gate import InnovationGate, resolve_gate
from ...engine import ud, validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...memory.settings import Setting, state_size
from ...models import formula_kernels, formulas
from ...models.scale import InverseGamma, KnownScale, resolve_scale
from ...results.physical_sentences import modes_words
from ...results.smoothed import width
from ..common.given_state import COUNT
from ..common.memories import memory_of_joint, prior_of_parameters, watch_of_joint
from ..common.observer import Observed, Observer, check_names
from ..common.priors import factors_of
from ..common.settings import arguments
from ..common.times import instants
from . import step as _step  # noqa: F401  (registers the step)
from .beforehand import at_the_start, check_numbers
from .identifiability import unlearnt
from .jump_fit import Jumping, resolve_jumps
from .row import GREY_BOX, GREY_SAMPLE, SCRATCH, GreyBoxForm
from .simulated import Simulated
from .smoothed import GreyBoxSmoothed
from .start import Starting, resolve_start
from .summary import GreyBoxSummary
from .trace import GreyBoxTrace
from .transform import KINDS, NORMAL_95, deviation, to_units, transformed

UNKNOWN_NOISE = 0.1  # of y_scale: deviation of an output's noise where nothing is said, until the start finds it
METHODS = "joint", "rpem"
COUNTED = 2.0  # alpha and beta of sigma^2, where it is learnt about a noise that is known to begin with


class GreyBox(Simulated, Observer):
    """Named physical parameters of a plant in formulas, with their units and bars, on-line, beside its state.

        x' = f(x, u, theta) + w   (or the next x),        y = h(x, u, theta) + v

    State and parameters are jointly Gaussian, U D U'; positive parameters are estimated as logarithms, those between
    bounds on a logistic scale. Steps of any length are exact with their slopes by every parameter where the formulas
    are linear in the state, else they are taken by Runge and Kutta's method, and differentiated along with it.

    Parameters
    ----------
    plant : str, path or Formulas
        Name of a plant of the library (``driftwise.models.formulas.library()``), a TOML file of formulas, its text, or
        what ``formulas.from_function`` makes of a Python function.
    method : "joint" or "rpem"
        The joint Gaussian filter of state and parameters, which takes the gain of its state for known, or recursive
        prediction error identification by the exact gradient of the likelihood, in which the gain and the variance of
        an innovation depend on the parameters (`gain_slopes`): where noise acts on the state, it ends nearer to what
        a batch fit does, for about three times the time. The first is what a wide prior stands better.
    memory : policy
        How the past of the parameters is forgotten; any of `driftwise.memory`. Settings are in units of the
        *transformed* parameters (``RandomWalk(1e-6)``: a positive one moves by 0.1 % per second; of a discrete plant,
        and with every other memory, per sample).
    gate : InnovationGate, optional
        Treat outliers of each output as missing.
    scale : InverseGamma, optional
        Noise, walks and priors are relative to an unknown sigma^2 with this prior. Without ``noise`` in the formulas
        it is learnt anyway, about what the start finds.
    start : "batch", BatchStart or None
        How the filter begins: its first samples are fitted at once, several times and from many places of the prior,
        and it goes on from there (status STARTED). None: from the prior alone, which a wide one does not stand.
    jumps : "fit", JumpFit or None
        Look for jumps of single parameters: every 16 samples the last 96 are filtered anew with each parameter freed
        alone, at several instants. A jump that is likely enough is told, named and dated, and the others stay.
    y_scale : float or (p,)
        Typical size of the outputs, where the formulas say no ``noise``.
    dt : float
        Seconds between samples that come without instants.

    Raises
    ------
    InputError
        Where a formula or number does not fit; the message names the line.

    Notes
    -----
    Notes on the record so far, as which parameters it cannot tell apart, are ``est.notes_of(state)``. Bad at: plants
    that switch or saturate (the filter is Gaussian: status CURVED where the bars are not to be believed), walks of the
    state so large that they explain the record without the plant. Where what the formulas leave over is not white, bars
    of constant parameters are as wide as it makes them (`colour`), if it is correlated over less than a fiftieth of the
    record.

    References
    ----------
    Ljung (1979), "Asymptotic behavior of the extended Kalman filter as a parameter estimator for linear systems",
    IEEE Trans. AC-24, 36-50. Bierman (1977), chapters V-VI.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> current = np.repeat(np.random.default_rng(1).choice([-1.0, 0.0, 1.0], 60), 10)
    >>> est = dw.GreyBox("battery")
    >>> volts = est.simulate(current, {"R0": 0.02, "R1": 0.015, "C1": 1500.0}, noise=5e-4, seed=1)
    >>> trace = est.scan(volts, current)
    >>> [f"{name} {value:.3f} ± {std:.3f}" for name, value, std in trace.summary().parameters[:2]]
    ['R0 0.020 ± 0.000', 'R1 0.015 ± 0.000']
    """

    for_instants = "GreyBox takes any"
    trace_kind = GreyBoxTrace
    sample_layout = GREY_SAMPLE
    is_growing, hold, irregular = True, "zoh", True
    simulates = True
    unknown_parts = ("first_y", "first_u")

    def __init__(
        self,
        plant,
        *,
        method: str = "joint",
        memory: Any = Constant(),
        gate: InnovationGate | None = None,
        scale: InverseGamma | None = None,
        start: Any = "batch",
        jumps: Any = None,
        y_scale=1.0,
        dt: float = 1.0,
    ):
        self.formulas = found = formulas.read(plant)
        validation.one_of("method", method, METHODS)
        self.options = arguments(locals()) | {"plant": found.text}
        self.options.pop("found")
        n, m, k, p = found.n, len(found.free), found.inputs, found.p
        self.outputs = p if p > 1 else None
        names = found.state_names, found.names, found.input_names, found.output_names
        self.model: Any = Observed(n, n + m, n + m, k, p, *names)
        check_names(self.model)
        self._set_units(dt, y_scale)
        stated = [one.noise for one in found.outputs_]
        self.knows_noise = all(r is not None for r in stated)
        self.noise_std = np.array(stated) if self.knows_noise else None
        self._noise = np.array(
            [UNKNOWN_NOISE * size if r is None else r for r, size in zip(stated, np.broadcast_to(self.y_scale, p))]
        )
        self._s0 = np.array([s.start for s in found.states] + [transformed(one, one.start) for one in found.free])
        std = np.array([s.std for s in found.states] + [deviation(one) for one in found.free], float)
        self.prior_covariance = np.diag(std**2)
        self._U0, self._D0 = factors_of(self.prior_covariance)
        is_relative = scale is not None or not self.knows_noise
        self.scale = resolve_scale(scale or (InverseGamma(COUNTED, COUNTED) if is_relative else None), is_relative, m)
        kinds = np.array([KINDS[one.kind] for one in found.free])
        units = np.where(kinds == KINDS["linear"], std[n:] ** 2, 1.0)
        found_jumps = resolve_jumps(jumps)
        detector, settle, slopes = watch_of_joint(memory, n + m, units)
        if found_jumps and not isinstance(memory, Constant):
            raise InputError(f"jumps are looked for by fits, between which parameters are Constant(), not {memory!r}")
        colours = float(start is not None and isinstance(memory, Constant))
        setting = Setting(
            units, std[n:] ** 2, self.scale, 1.0, m, prior_of_parameters(self._s0, self._U0, self._D0, n), n
        )
        memory, fades, learns = memory_of_joint(memory, setting)
        is_timed = found.is_continuous and getattr(memory, "per_second", False)
        walk = np.diag([s.walk**2 for s in found.states])
        bounds = np.array([[one.origin, min(one.high, 1e300)] for one in found.free])
        form = GreyBoxForm(
            float(n), float(k), float(p), float(m), float(detector.state_size(m)), float(state_size(memory, m)), fades,
            learns, slopes, colours, float(method == "rpem"), float(found.is_continuous), float(found.is_linear),
            float(is_timed), float(walk.any()), self.dt, settle, kinds,
            bounds[:, 0], bounds[:, 1], walk.ravel(), self._s0, std[n:],
        )  # fmt: skip
        kernel_scale = InverseGamma(0.0, 0.0) if fades and is_relative else self.scale
        kernels = formula_kernels.kernels_of(found)
        self.policies = (form, kernels, memory, resolve_gate(gate, n + m), kernel_scale, detector)
        self.scratch_size = SCRATCH.size(form)
        start = resolve_start(start)
        self.starting = None if start is None else Starting(self, start)
        check_numbers(self)
        self.jumping = None if found_jumps is None else Jumping(self, found_jumps)
        self.pauses = bool(self.starting or self.jumping)
        self.dtype = GREY_BOX.dtype(
            form, more=[one for part in (self.starting, self.jumping) if part for one in part.fields]
        )

    def _started(self, drive):
        """Return a loop with the fits of jumps, and that of the start, in it."""
        return super()._started(drive if self.jumping is None else self.jumping.wrap(drive))

    def __repr__(self):
        return super().__repr__().replace(f"plant={self.formulas.text!r}", f"plant=<{self.formulas.name}>")

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state, n = super().start(series), self.model.n
        state["x"], state["theta"] = self._s0[:n], self._s0[n:]
        state["fitted"] = self._s0[n:]
        state["D"], state["U"], state["noise"], state["is_new"] = self._D0, self._U0, self._noise, 1.0
        state["wide"] = 1.0
        state["bend"] = np.where(self.policies[0].kinds == KINDS["linear"], 0.0, 0.5)  # that of exp
        if self.policies[0].fades and isinstance(self.scale, InverseGamma):
            state["counts"][..., COUNT], state["chi2"] = 2 * self.scale.alpha, 2 * self.scale.beta
        return state

    # --- running -------------------------------------------------------------------------------------------

    def predict(self, state, u=None, horizon: int | None = None, *, time=None) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation, (h,) or (h, p), of the next h outputs, given the inputs to come.

        Parameters
        ----------
        state : one state, as `update` or a trace leaves it
        u : (h,) or (h, k) inputs to come; omitted where the plant has none
        horizon : h, the length of ``u`` if omitted
        time : (h,) instants; steps of dt if omitted
        """
        u = validation.inputs_to_come(u, horizon, self.model.inputs)
        nothing = np.full((len(u), self.outputs) if self.outputs else len(u), np.nan)
        ahead = self.scan(nothing, u if self.model.inputs else None, state=state, keep="innovations", time=time)
        return ahead.prediction, np.sqrt(ahead.variance)

    def _instants(self, time, samples, state) -> np.ndarray:
        """Return the instants of samples; a stream's next one has a short way in."""
        if samples == 1 and isinstance(time[0], float) and math.isfinite(time[0]) and state is not None:
            if time[0] > state["time"] and state["samples"] > 0:
                return np.array([time[0]])
        return instants(time, (samples,), state, repeats=True)

    # --- reading a state -----------------------------------------------------------------------------------

    def mean(self, state) -> np.ndarray:
        """Return E [x ; transformed parameters], given all samples so far."""
        return np.concatenate([state["x"], state["theta"]], axis=-1)

    def covariance(self, state) -> np.ndarray:
        """Return the covariance of [x ; transformed parameters], wider where residuals are not white (`colour`)."""
        P = np.asarray(self.sigma2(state))[..., None, None] * ud.unpack(state["U"], state["D"])
        wide = np.ones(P.shape[:-1])
        wide[..., self.model.n :] = np.sqrt(state["wide"])
        return P * wide[..., None] * wide[..., None, :]

    def estimate(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return state and parameters, in their units, and their standard deviations."""
        n, P = self.model.n, self.covariance(state)
        values, rates = to_units(self.formulas.free, state["theta"])
        std = np.sqrt(np.diagonal(P, axis1=-2, axis2=-1))
        std = np.concatenate([std[..., :n], std[..., n:] * rates], axis=-1)
        return np.concatenate([state["x"], values], axis=-1), std

    def parameters_of(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return the parameters in their units, and their covariance (by slopes)."""
        values, rates = to_units(self.formulas.free, state["theta"])
        n = self.model.n
        return values, self.covariance(state)[n:, n:] * np.outer(rates, rates)

    def intervals(self, state, deviations: float = NORMAL_95) -> dict[str, tuple[float, float]]:
        """Return the interval of each parameter, 95 % by default: not symmetric, but positive where it must be."""
        n, theta = self.model.n, np.asarray(state["theta"])
        std = np.sqrt(np.diag(self.covariance(state)))[n:]
        low, high = (to_units(self.formulas.free, theta + way * std)[0] for way in (-deviations, deviations))
        return {name: (float(a), float(b)) for name, a, b in zip(self.names, low, high)}

    def notes_of(self, state) -> list[str]:
        """Return in sentences what the record so far does not tell: parameters that cannot be told apart, say."""
        found, modes = unlearnt(self, state), int(state["modes"])
        if modes > 1:
            one, other = (to_units(self.formulas.free, state[name])[0] for name in ("fitted", "other"))
            said = [", ".join(f"{n} = {v:.3g}" for n, v in zip(self.names, values)) for values in (one, other)]
            samples = f"{int(state['fitted_of'])} samples"
            found.append(modes_words(modes, samples, said, math.exp(-float(state["other_loglik"]))))
        return found

    @cached_property
    def notes(self) -> list[str]:
        """What to know of the plant at its start before it is believed, in sentences."""
        return at_the_start(self)

    def summary(self) -> Any:
        """Return what is to sum up traces of it, one after the other."""
        return GreyBoxSummary(self)

    def sigma2(self, state):
        """Return the scale of noise, walks and priors learnt so far; 1 where it is known."""
        if isinstance(self.scale, KnownScale):
            return np.ones(np.shape(state["chi2"]))[()]
        if self.policies[0].fades:
            count = np.asarray(state["counts"][..., COUNT])
            return np.where(count >= 1, state["chi2"] / np.maximum(count, 1.0), np.maximum(state["chi2"], 1.0))[()]
        alpha, beta = self.scale
        return (beta + 0.5 * state["chi2"]) / np.maximum(alpha + 0.5 * state["observed"], 0.5)

    def loglik(self, state) -> float:
        """Return log p(y) of all samples so far: the evidence (of those that a start fitted, by Laplace)."""
        return float(state["score"])

    def degrees_of_freedom(self, is_used, observed) -> np.ndarray:
        """Return those of each prediction: infinite where the scale is known."""
        if isinstance(self.scale, KnownScale):
            return np.full(is_used.shape, np.inf)
        used = is_used.reshape(len(is_used), -1)
        each = used.sum(axis=1)
        found = np.maximum(2 * self.scale.alpha + observed + np.cumsum(each) - each, 1.0)
        return np.broadcast_to(found.reshape(-1, *[1] * (is_used.ndim - 1)), is_used.shape).copy()

    # --- looking back --------------------------------------------------------------------------------------

    def smooth(self, y, u=None, *, state=None, lag=None, keep: str = "std", time=None) -> GreyBoxSmoothed:
        """Return state and parameters at every sample, given the whole record.

        The record is filtered; then the plant is made linear about the path that this leads to, smoothed, and made
        linear about the path that is then the most probable, until it stays where it is (`smoother`). Parameters that
        are constant are the same at all samples, and no longer those of a filter whose early slopes were taken far off.
        A jump that was told frees its parameter there.

        Parameters
        ----------
        y, u, state, time : as for `scan`
        lag : None; only whole records are smoothed
        keep : "means", "std" or "covariance"

        Returns
        -------
        GreyBoxSmoothed
            ``x`` and ``parameters``, with ``_std``, ``of(name)``, ``covariance`` (T, N, N), and ``moved``: by how many
            deviations the path moved at last (.001 where it is settled).

        Notes
        -----
        Bad at: walks of the state that are large, where the most probable path is not that of the most probable
        parameters (their likelihood sums over all paths: ``method="rpem"``), and memories that forget (refused).

        References
        ----------
        Bell (1994), "The iterated Kalman smoother as a Gauss-Newton method", SIAM J. Optimization 4, 626-636.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> current = np.repeat(np.random.default_rng(1).choice([-1.0, 0.0, 1.0], 30), 10)
        >>> est = dw.GreyBox("battery")
        >>> volts = est.simulate(current, {"R0": 0.02, "R1": 0.015, "C1": 1500.0}, noise=5e-4, seed=1)
        >>> R0, std = est.smooth(volts, current).of("R0")
        >>> f"{1e3 * R0[0]:.2f} ± {1e3 * std[0]:.2f} mOhm"
        '20.00 ± 0.04 mOhm'
        """
        from .smoother import smooth

        if lag is not None:
            raise InputError(f"lag must be None: GreyBox looks back over whole records, got {lag!r}")
        width(keep, self.model.N)
        begun = self.start() if state is None else np.array(state)
        trace = self.scan(y, u, state=begun, time=time)
        if not len(trace):
            raise InputError("y is empty: there is nothing to smooth")
        with np.errstate(all="ignore"):  # of paths that are tried
            table, moved = smooth(self, trace, begun, keep)
        return GreyBoxSmoothed(self, trace.y, trace.u, table, keep, trace.state, moved, trace.time)
