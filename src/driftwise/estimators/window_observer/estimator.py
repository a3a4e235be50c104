"""State and disturbances of a known plant, by least squares on the samples of a window."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...detect.gate import Always
from ...detect.parity import Parity
from ...detect.resolve import resolve_detector
from ...detect.watch import Silent
from ...engine import validation
from ...engine.errors import InputError
from ...engine.layout import layout_of
from ...memory.constant import Constant
from ...models.plant import Augmented
from ...models.scale import InverseGamma, KnownScale
from ..common.observer import Observed, Observer, check_names
from ..common.settings import arguments
from . import fir, growing, queue
from .gains import LONGEST
from .tuning import Tuned, tune_walks, tune_window

SETTLE = 20  # innovations before the detector counts


class WindowObserver(Observer):
    """State and disturbances of a known plant from the samples of the last ``window`` seconds, and how sure they are.

    The plant is augmented by the disturbances, z = [x; q], and z at the newest sample is estimated by least squares
    from the samples of the window alone: unbiased, of least variance, forgetting all that is older. It needs no gain,
    no initial state and no derivative, with any number of inputs and outputs. A full window of L samples costs
    m L (p + k) products, one with samples missing some sixty times that.

    Parameters
    ----------
    plant : Plant
        x' = A x + B u, y = C x + D u.
    window : float
        Seconds of memory: round(window/dt) samples. Infinite: all samples since the first.
    noise_std : float, (p,), or None
        Standard deviation of the white noise on each output. None: one for all, learnt from the innovations; then no
        disturbance may have a finite prior, which is absolute.
    disturbances : Polynomial or Sinusoid, or a sequence of them
        Their prior deviations hold at the window's start, anew for every window.
    hold : "zoh" or "foh"
        What u does between its samples: held, or a straight line. Needed where the plant has inputs.
    dt : float
        Seconds between samples; the typical ones where ``irregular``.
    irregular : bool
        Samples come at instants of their own (``time=``). A sample is in the window while it is less
        than round(window/dt) dt old, which on regular samples keeps the same ones; a gap as long empties it.
    capacity : int
        Most samples an irregular window holds; beyond, the oldest leaves early. Default 1.5 window/dt + 1.
    tolerance : float, (n,) or (m,), optional
        Largest standard deviation, of each element of z, that counts as ready. Until all are met the estimate is NaN,
        its deviation infinite, the status NOT_READY.
    derived : dict, optional
        Further outputs by name, each a row on x or z, or a pair of rows on x or z and on u.
    detector : Parity, PageHinkley, GLR or VarianceCUSUM, optional
        `Parity` compares the estimates of consecutive windows of regular samples, and may empty the window. The others
        watch the innovations: an alarm is told (JUMP), the window forgets by itself.
    x0, x_std : (n,) and number or (n,)
        Prior of the first state; with an infinite window only.

    Attributes
    ----------
    plant : Augmented
        A, B, H, D, names and priors of z.
    design : Design
        Of a finite window of regular samples: ``std`` of z, ``condition``, ``gains`` and ``input_gains``.

    Raises
    ------
    InputError
        Where a number does not fit, a mode cannot be seen, or the window is too short; the message says which.

    Notes
    -----
    Source: Tian (2009) for the problem; Kwon et al. (1999) for the estimate, the unbiased filter of finite memory.

    Bad at: a plant that is not the one given (the deviations know of noise only), noise that is not white, a prior
    deviation that is too tight (every deviation is then wrong, silently), disturbances without a prior that hardly
    reach the output within the window (true deviations, huge).

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> t = np.arange(200) * 0.01
    >>> y = t**2 / 2 + 0.01 * np.random.default_rng(0).standard_normal(200)
    >>> cart = dw.Plant([[0, 1], [0, 0]], states=("position", "speed"))
    >>> push = dw.models.Polynomial([0, 1], np.inf, name="push")
    >>> trace = dw.WindowObserver(cart, 1.0, noise_std=0.01, disturbances=push, dt=0.01).scan(y)
    >>> [f"{name} {trace.of(name)[0][-1]:.2f} +- {trace.of(name)[1][-1]:.2f}" for name in ("speed", "push")]
    ['speed 1.99 +- 0.01', 'push 1.00 +- 0.03']
    """

    tuned: Tuned | None = None  # what `tune` found
    design: Any = None  # of a finite window of regular samples

    def __init__(
        self,
        plant: Any,
        window: float,
        *,
        noise_std: Any,
        disturbances: Any = (),
        hold: str | None = None,
        dt: float | None = None,
        irregular: bool = False,
        capacity: int | None = None,
        tolerance: Any = None,
        derived: dict[str, Any] | None = None,
        detector: Any = None,
        x0: Any = None,
        x_std: Any = np.inf,
    ):
        self.options = arguments(locals())
        self.plant = system = Augmented(plant, disturbances)
        self.outputs = system.outputs if system.outputs > 1 else None
        self.hold = validation.hold(hold, system.inputs)
        if dt is None:
            raise InputError("dt must be given: the seconds between samples (the typical ones where irregular=True)")
        self.dt, self.irregular = validation.size("dt", dt), validation.yes("irregular", irregular)
        self.window = _window(window)
        self.is_growing = math.isinf(self.window)
        self.length = 0 if self.is_growing else round(self.window / self.dt)  # samples in a window
        if not (self.is_growing or self.length):
            raise InputError(f"window must hold samples: {self.window:g} s is less than half of dt = {self.dt:g} s")
        self.noise_std = None if noise_std is None else validation.sizes("noise_std", noise_std, system.outputs)
        self._refuse_what_the_form_ignores()
        self.capacity = (
            math.ceil(1.5 * self.length) + 1 if capacity is None else validation.count("capacity", capacity, 1)
        )
        self._refuse_what_no_memory_holds()
        self._set_prior(x0, x_std)
        system.require_observable()
        rows, feeds, more = _derived({} if derived is None else derived, system)
        n, m, p = system.n, system.m, system.outputs
        self.model = Observed(
            n, m, m + len(more), system.inputs, p, system.names[:n], system.names[n:] + more, system.input_names,
            system.output_names,
        )  # fmt: skip
        check_names(self.model)
        self.derived_rows, self.derived_feeds = rows, feeds
        self.scale = InverseGamma(0.5, 1e-20) if noise_std is None else KnownScale()
        self.parity = detector if isinstance(detector, Parity) else None
        if self.parity is not None and (self.is_growing or self.irregular):
            raise InputError(
                "Parity compares two windows of regular samples: it needs a finite window and no irregular="
            )
        kernel_detector = Silent() if detector is None or self.parity is not None else resolve_detector(detector)
        self.tolerance = np.concatenate([validation.tolerance(tolerance, n, m), np.full(len(more), np.inf)])
        self._common: dict[str, Any] = dict(
            n=n, m=m, inputs=system.inputs, outputs=p, dt=self.dt, settle=SETTLE, H=system.H.ravel(),
            D=system.D.ravel(), r=np.ones(p) if self.noise_std is None else self.noise_std**2, rows=rows.ravel(),
            feeds=feeds.ravel(), tolerance=self.tolerance, detector_size=kernel_detector.state_size(0),
        )  # fmt: skip
        self._form, form = self._build()
        self.policies = (form, KnownScale(), Constant(), Always(), self.scale, kernel_detector)
        self.dtype = layout_of(form).dtype(form)
        self.scratch_size = self._form.scratch_size(form)

    def _build(self) -> tuple[Any, Any]:
        """Return the module of the form, and the form."""
        module: Any = growing if self.is_growing else queue if self.irregular else fir
        return module, module.build(self, self._common)

    def _refuse_what_the_form_ignores(self):
        options, system = self.options, self.plant
        is_prior = bool(np.any(np.isfinite(validation.floats("x_std", options["x_std"]))))
        if not self.is_growing and (options["x0"] is not None or is_prior):
            raise InputError("x0 and x_std are the prior of the first state, which a window forgets: window=math.inf")
        if not self.is_growing and np.any(system.walk > 0):
            raise InputError(
                "a disturbance with a walk wanders on within the window, and a window knows none: leave walk out, or "
                "take window=math.inf"
            )
        if options["capacity"] is not None and (self.is_growing or not self.irregular):
            raise InputError(
                "capacity is for a finite window with irregular=True; others know how many samples they hold"
            )
        absolute = np.any(np.isfinite(system.prior_std) & (system.prior_std > 0)) or np.any(system.walk > 0)
        if self.noise_std is None and (absolute or is_prior):
            raise InputError(
                "noise_std=None learns the noise, and all deviations relative to it; prior_std, x_std and walk are "
                "absolute. State noise_std, or leave these infinite (walk: 0)"
            )

    def _refuse_what_no_memory_holds(self):
        most = self.capacity if self.irregular and not self.is_growing else self.length
        if most > LONGEST:
            raise InputError(
                f"a window of {self.window:g} s would hold {most} samples, and {LONGEST} are the most. Is window or dt "
                "in the wrong unit? To look back at everything take window=math.inf, or keep every tenth sample"
            )

    def _set_prior(self, x0, x_std):
        n = self.plant.n
        self.x0 = np.zeros(n) if x0 is None else validation.vector("x0", np.atleast_1d(x0), n)
        found = validation.floats("x_std", x_std)
        if found.shape not in ((), (n,)) or np.isnan(found).any() or np.any(found < 0):
            raise InputError(f"x_std must be at least 0 (inf: nothing is known), a number or ({n},), got {x_std!r}")
        self.x_std = np.full(n, found)
        if np.any(self.x0[np.isinf(self.x_std)]):
            raise InputError(f"x0 says nothing where x_std is infinite: state how sure it is, got {x0!r} and {x_std!r}")

    # --- running -------------------------------------------------------------------------------------------

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = super().start(series)
        fresh = getattr(self._form, "fresh", None)
        if fresh is not None:
            fresh(self.policies[0], state)
        return state

    def tune(self, y, u=None, *, time=None, which=None, noise: bool = False) -> WindowObserver:
        """Return the same estimator with what a record is most likely under: walks, or the length of a window.

        An infinite window gets the walks of its disturbances (0: the record shows none), and the noise where asked; the
        likelihood is exact from the first sample on. A finite one gets the length that predicts the next sample best.
        ``found.tuned`` has what was found, how likely the record is under all else that was tried, and a sentence.

        Parameters
        ----------
        y, u, time : as for `scan`
        which : numbers of the disturbances to tune, counted from 0; all if omitted
        noise : bool, find noise_std too, by one factor for all outputs

        Notes
        -----
        Bad at: a history unlike what is to come (what did not move in the record will hardly be followed), noise that
        is not white, and a plant that is wrong: its error is taken for a walk, or for one that asks for a short memory.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> rng = np.random.default_rng(0)
        >>> inflow = np.cumsum(0.3 * rng.standard_normal(2000))
        >>> level = np.zeros(2000)
        >>> for t in range(1, 2000):
        ...     level[t] = 0.9 * level[t - 1] + 0.1 * inflow[t - 1]
        >>> tank, leak = dw.Plant([[-1.0536]]), dw.models.Polynomial([1.0536], np.inf)
        >>> est = dw.WindowObserver(tank, np.inf, noise_std=0.05, disturbances=leak, dt=0.1)
        >>> found = est.tune(level + 0.05 * rng.standard_normal(2000))
        >>> print(f"{found.tuned.walk[0]:.2f}, the truth is {0.3 / np.sqrt(0.1):.2f}")
        0.95, the truth is 0.95
        """
        y = validation.numbers("y", y)
        measured = np.count_nonzero(np.isfinite(y))
        if measured <= self.plant.m:
            raise InputError(
                f"y has {measured} measured values and there are {self.plant.m} unknowns: nothing to tune by"
            )
        if self.is_growing:
            return tune_walks(self, y, u, time, which, validation.yes("noise", noise))
        if which is not None or noise:
            raise InputError("a finite window has no walks to tune: which and noise are of window=math.inf")
        return tune_window(self, y, u, time)

    @property
    def gains(self) -> np.ndarray:
        """The gains of the full window on its outputs, the oldest sample first, (m, L) or (m, L, p)."""
        if self.design is None:
            raise InputError("only a finite window of regular samples has fixed gains")
        return self.design.gains[..., 0] if self.model.outputs == 1 else self.design.gains

    # --- reading a state -----------------------------------------------------------------------------------

    def _values(self, state):
        more = state["z"] @ self.derived_rows.T + state["held"] @ self.derived_feeds.T
        return np.concatenate([state["z"], more], axis=-1)

    def loglik(self, state) -> float:
        """Return the sum of log predictive densities of the outputs, from the first that was predicted."""
        return float(state["score"])


def _window(window) -> float:
    if isinstance(window, float) and window == math.inf:
        return window
    return validation.positive("window", window)


def _derived(derived, system):
    """Return rows on z (d, m), rows on u (d, k), and names."""
    if not isinstance(derived, dict):
        raise InputError(f"derived must be a dict of names with rows, got {derived!r}")
    n, m, k = system.n, system.m, system.inputs
    rows, feeds = np.zeros((len(derived), m)), np.zeros((len(derived), k))
    for i, (name, given) in enumerate(derived.items()):
        if name in system.names or name in system.output_names or name in system.input_names:
            raise InputError(f"derived output {name!r} has the name of a state, disturbance, input or output")
        on_u: Any = np.zeros(k)
        if isinstance(given, tuple | list) and len(given) == 2 and np.ndim(given[0]) == 1:
            given, on_u = given
        row = validation.floats(f"derived[{name!r}]", given)
        if row.shape not in ((n,), (m,)) or not np.isfinite(row).all():
            raise InputError(f"derived[{name!r}] must be a row of {n} numbers on x or {m} on z, got {given!r}")
        rows[i, : row.size], feeds[i] = row, validation.vector(f"derived[{name!r}] on u", np.atleast_1d(on_u), k)
    return rows, feeds, list(derived)
