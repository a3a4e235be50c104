"""The trace: what an estimator said at every sample of a record."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..engine.errors import InputError
from ..engine.status import Status
from ..engine.validation import count, floats
from ..models.convert import Model
from ..models.scale import KnownScale
from . import verbs
from .bands import half_width, quantile, unpack
from .events import Event, events_of, jumps_of, watched
from .frames import as_frame

KEEP = ("innovations", "means", "std", "covariance")
UNUSED = Status.MISSING_OUTPUT | Status.REJECTED | Status.EXACT | Status.SKIPPED


def width(keep: str, N: int, head: int = 4) -> int:
    """Return the number of columns the driver writes for each sample."""
    if keep not in KEEP:
        raise InputError(f"keep must be one of {', '.join(KEEP)}, got {keep!r}")
    return head + (0, N, 2 * N, N + N * (N + 1) // 2)[KEEP.index(keep)]


class Trace:
    """Columns of one run, time first; what each one means stands in ``docs/conventions.md``.

    ``prediction``, ``innovation`` and ``variance`` belong to y(t) given the samples before it; ``x`` and
    ``parameters`` to x(t) and theta given the samples up to t. ``state`` continues where the trace ends.
    """

    is_stamped = False  # whether the samples came with instants that the estimator went by

    def __init__(self, estimator, y, u, outs, keep, state, observed_before=0.0, time=None):
        self.estimator, self.keep, self.state = estimator, keep, state
        self.y, self.u = y.copy(), u.copy()
        self.table, self.observed_before = outs, observed_before
        self.dt = estimator.dt
        self.begun: Any = None  # the state before the first sample
        if time is None:
            time = self.dt * (float(state["samples"]) - len(y) + np.arange(len(y)))
        self.time = floats("time", time)
        if self.time.shape != self.y.shape:
            raise InputError(f"time must be ({len(y)},) like y, got shape {self.time.shape}")

    def __len__(self):
        return len(self.y)

    def __repr__(self):
        return f"Trace({len(self)} samples of {self.estimator!r}, keep={self.keep!r})"

    # --- columns -------------------------------------------------------------------------------------------

    @property
    def prediction(self) -> np.ndarray:
        """Prediction of y(t) from the samples before it, (T,)."""
        return self.table[:, 0]

    @property
    def innovation(self) -> np.ndarray:
        """y(t) minus its prediction; NaN where y is missing, (T,)."""
        return self.table[:, 1]

    @property
    def variance(self) -> np.ndarray:
        """Squared scale of the prediction error (its variance where the noise is known), (T,)."""
        return self.table[:, 2]

    @property
    def status(self) -> np.ndarray:
        """Bits of `driftwise.Status`, (T,)."""
        return self.table[:, 3].astype(np.int64)

    def _extra(self, name):
        if name not in self.estimator.columns:
            raise InputError(f"{type(self.estimator).__name__} does not record it: recursive estimators do")
        return self.table[:, self.estimator.columns[name].start]

    @property
    def weight(self) -> np.ndarray:
        """Effective number of samples behind the estimate, 1/gain, (T,)."""
        return self._extra("weight")

    @property
    def statistic(self) -> np.ndarray:
        """The detector's statistic relative to its threshold: 1 and more is an alarm, (T,)."""
        return self._extra("statistic")

    @property
    def is_used(self) -> np.ndarray:
        """Whether the sample taught the filter anything, (T,)."""
        return (self.status & int(UNUSED)) == 0

    @property
    def dof(self) -> np.ndarray:
        """Degrees of freedom of the Student-t prediction; infinite where the noise is known, (T,)."""
        if "dof" in self.estimator.columns:
            return self._extra("dof")
        scale = self.estimator.scale
        if isinstance(scale, KnownScale):
            return np.full(len(self), np.inf)
        before = self.observed_before + np.concatenate([[0], np.cumsum(self.is_used)[:-1]])[: len(self)]
        return 2 * np.maximum(scale.alpha + before / 2, 0.5)

    def mixture(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return what the predictions of a mixture are made of: weights, offsets, scales (T, M), and dof (T,)."""
        parts = self.table[:, self.estimator.columns["mixture"]].reshape(len(self), -1, 3)
        return parts[..., 0], parts[..., 1], np.sqrt(parts[..., 2]), self.dof

    @property
    def is_mixture(self) -> bool:
        """Whether predictions are mixtures, so that bands are quantiles of their own."""
        at = self.estimator.columns.get("mixture", slice(0, 0))
        return at.stop > at.start

    def _columns(self, first, count, least):
        if KEEP.index(self.keep) < KEEP.index(least):
            raise InputError(f"this trace kept {self.keep!r} only; run scan(..., keep={least!r})")
        first += self.estimator.n_columns
        return self.table[:, first : first + count]

    @property
    def x(self) -> np.ndarray:
        """State x(t) given the samples up to t, measured state first, (T, n)."""
        return self._columns(0, self.estimator.model.n, "means")

    @property
    def parameters(self) -> np.ndarray:
        """Parameters in the order of ``names``, (T, m)."""
        model = self.estimator.model
        return self._columns(model.n, model.N - model.n, "means")

    @property
    def names(self) -> list[str]:
        """Names of the parameter columns."""
        return self.estimator.names

    @property
    def _std(self):
        N = self.estimator.model.N
        if self.keep == "covariance":
            return np.sqrt(np.einsum("tii->ti", self.covariance).clip(0))
        return self._columns(N, N, "std")

    @property
    def x_std(self) -> np.ndarray:
        """Standard deviations of ``x``, (T, n)."""
        return self._std[:, : self.estimator.model.n]

    @property
    def parameters_std(self) -> np.ndarray:
        """Standard deviations of ``parameters``, (T, m)."""
        return self._std[:, self.estimator.model.n :]

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of [x ; parameters], (T, N, N); needs keep="covariance"."""
        N = self.estimator.model.N
        return unpack(self._columns(N, N * (N + 1) // 2, "covariance"), N)

    def band(self, level: float = 0.95) -> np.ndarray:
        """Half-width of the prediction interval at each sample (Student-t where the scale is learnt), (T,).

        Where the memory is a mixture (`AutoMemory`, `MultipleModel`, `IMM`), it is that of the mixture.
        """
        if not 0 < level < 1:
            raise InputError(f"level is a share between 0 and 1, got {level!r}. Is it a percentage? 95 % is 0.95")
        if self.is_mixture:
            return half_width(level, *self.mixture())
        return quantile(0.5 + level / 2, self.dof) * np.sqrt(self.variance)

    # --- results -------------------------------------------------------------------------------------------

    def model(self, at: int = -1) -> Model:
        """Return the model at a sample (the last by default), with the covariance of its parameters.

        Sample -1 uses the final state; any other needs keep="covariance", or "std" for a diagonal one.
        """
        est, form = self.estimator, self.estimator.model
        if at in (-1, len(self) - 1):
            return est.model_of(self.state)
        if self.keep == "covariance":
            P = self.covariance[at, form.n :, form.n :]
        else:
            P = np.diag(self.parameters_std[at] ** 2)
        if hasattr(est, "model_at"):
            return est.model_at(self.parameters[at].copy(), P)
        return Model(form, self.parameters[at].copy(), P, self.dt)

    def predict(self, u=None, horizon: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (h,) and standard deviation (h,) of the outputs that follow, given the inputs to come."""
        return self.estimator.predict(self.state, u, horizon)

    def summary(self):
        """Return the constant-memory `Summary` of this trace."""
        from .summary import Summary

        return Summary(self.estimator).add(self)

    def events(self, limit: int = 10_000) -> list[Event]:
        """Return what happened besides ordinary samples, in order, at most ``limit`` entries.

        A run of the same thing is one event.
        """
        return events_of(self, limit)

    def diagnose(self):
        """Return verdicts on this run, each a number, a threshold and what to do: a `Diagnosis`, to be printed.

        NIS, coverage and whiteness of the predictions (thresholds: 99 %, and no closer than matters in practice),
        excitation, identifiability, stability (99 %), drift against jump (odds of 100:1), the age of the last news
        about a parameter, and missing, rejected and saturated samples where there are any.

        Notes
        -----
        Where nothing is wrong a verdict of chance fails in at most one run of a hundred. Drift and jumps are weighed
        where the memory is ``Constant``; other memories say themselves what they found. Bad at: several faults at once,
        each of which may look like the others, and records of fewer samples than twenty times the unknowns.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> b = np.where(np.arange(600)[:, None] < 400, [1.0, 0.5], [2.0, 0.5])
        >>> y, u = dw.simulate([-1.5, 0.7], b, samples=600, noise_std=0.1, seed=1)
        >>> trace = dw.ARX(2, 2).scaled_to(y, u).scan(y, u)
        >>> found = trace.diagnose()
        >>> [verdict.name for verdict in found.not_fine]
        ['NIS', 'coverage', 'whiteness', 'drift or jump']
        >>> print(found.find("drift or jump").advice)
        the parameters jumped, b1 by +1 at sample 401 (odds beyond a million to one against drift): try
        memory=RestartOnChange() or AutoMemory()
        """
        return verbs.call("diagnose", self)

    def jumps(self, limit: int = 10_000) -> list[Event]:
        """Return an event for each alarm: when, about what, since when, on what evidence."""
        return jumps_of(self, limit)

    @property
    def odds(self) -> float | None:
        """The odds at which a memory that weighs explanations tells a jump (statistic 1); None where none does."""
        return getattr(self.estimator.options.get("memory"), "odds", None)

    @property
    def watches(self) -> str:
        """What tells the jumps: the "width" or the "level" of the innovations, or "", the memory itself."""
        return watched(self.estimator.options)

    @property
    def has_bars(self) -> bool:
        """Whether the trace kept parameters with their deviations."""
        return self.keep in ("std", "covariance")

    def alarm(self, k):
        """Return statistic, since and which of the detector, None where the estimator does not write them."""
        return self.table[k, 5:8] if "which" in self.estimator.columns else None

    def what_changed(self, event, samples: int = 100):
        """Return which parameter no longer fits after a jump: a `ScoreTest` of the samples since it began.

        Parameters
        ----------
        event : one of ``jumps()``, or a sample: the first one after the change
        samples : how many samples to judge by

        Notes
        -----
        The parameters from before are held, and each one's score is taken raw (`score_test`): more than nine in ten
        runs of ARX(2, 2) name the right one, which the detector, in a hurry, cannot. Bad at: fewer samples than
        parameters, and several that changed at once. For least squares, prediction error, pseudolinear regression.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> a = np.where(np.arange(2000)[:, None] < 1500, [-1.5, 0.7], [-1.45, 0.7])
        >>> y, u = dw.simulate(a, [1.0, 0.5], samples=2000, noise_std=0.1, seed=1)
        >>> trace = dw.ARX(2, 2, memory=dw.RestartOnChange()).scaled_to(y, u).scan(y, u)
        >>> trace.jumps()[0].text
        'jump: the innovations widened, it began about 2 samples ago (statistic 1.06 times its threshold)'
        >>> trace.what_changed(trace.jumps()[0])
        chi2 = 1080.0 on 4 degrees of freedom (p = 1.6e-232); most of all a1 up (+32.7 sd)
        """
        if isinstance(event, Event):
            event = event.sample if event.since is None else event.since
        return verbs.call("what_changed", self, event, samples)

    def state_before(self, sample: int):
        """Return the state just before a sample, bit for bit as it was: replay an event from there."""
        if not count("sample", sample) < len(self):
            raise InputError(f"sample must lie between 0 and {len(self) - 1}, got {sample!r}")
        if self.begun is None:
            raise InputError("a trace that was read back does not know the state it began with: run it again")
        u = self.u[:sample] if self.u.shape[1] else None
        time = self.time[:sample] if self.is_stamped else None
        return self.estimator.scan(self.y[:sample], u, state=self.begun, keep="innovations", time=time).state

    def to_frame(self, backend: str = "pandas") -> Any:
        """Return the columns as a data frame of "pandas", "polars" or "pyarrow" (through narwhals)."""
        return as_frame(self.columns(), backend)

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns by name, as `to_frame` and the command line write them."""
        u = {f"u{i + 1}" if self.u.shape[1] > 1 else "u": c for i, c in enumerate(self.u.T)}
        table = {"time": self.time, "y": self.y, **u, "prediction": self.prediction, "innovation": self.innovation}
        table |= {"variance": self.variance, "dof": self.dof, "status": self.status}
        if "weight" in self.estimator.columns:
            table |= {"weight": self.weight, "statistic": self.statistic}
        n = self.estimator.model.n
        if self.keep != "innovations":
            table |= {f"x{n - i}": c for i, c in enumerate(self.x.T)} | dict(zip(self.names, self.parameters.T))
        if self.keep in ("std", "covariance"):
            table |= {f"x{n - i}_std": c for i, c in enumerate(self.x_std.T)}
            table |= {f"{name}_std": c for name, c in zip(self.names, self.parameters_std.T)}
        return {name: np.ascontiguousarray(c) for name, c in table.items()}

    def plot(self, **options) -> Any:
        """Draw measured and predicted output, parameters and innovations with 2-sigma bands; return the Axes."""
        return verbs.call("plot", self, **options)

    def report(self, path, **options) -> Any:
        """Write one self-contained HTML page that opens without a network."""
        return verbs.call("report", self, path, **options)

    # --- keeping -------------------------------------------------------------------------------------------

    def save(self, path) -> None:
        """Write the trace, with the estimator's settings and final state, to one ``.npz`` file."""
        from .snapshot import describe

        header = describe(self.estimator)
        extra = np.array([self.observed_before])
        state = np.atleast_1d(self.state).view(np.float64)
        np.savez_compressed(
            path,
            header=header,
            y=self.y,
            u=self.u,
            outs=self.table,
            time=self.time,
            state=state,
            extra=extra,
            keep=self.keep,
        )

    @classmethod
    def load(cls, path) -> Trace:
        """Return a saved trace."""
        from .snapshot import rebuild

        path = Path(path)
        with np.load(path if path.exists() else f"{path}.npz", allow_pickle=False) as f:
            est = rebuild(str(f["header"]))
            state = f["state"].view(est.dtype).reshape(())
            return est.trace_kind(est, f["y"], f["u"], f["outs"], str(f["keep"]), state, f["extra"][0], f["time"])
