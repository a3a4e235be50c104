"""The trace: what an estimator said at every sample of a record."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..engine.atomic import replaced
from ..engine.errors import InputError
from ..engine.saved import check_states, reading
from ..engine.status import Status
from ..engine.validation import floats
from . import verbs
from .bands import half_width, quantile
from .frames import as_frame

SUFFIX = ".npz"
KEEP = ("innovations", "means", "std", "covariance")
UNUSED = Status.MISSING_OUTPUT | Status.REJECTED | Status.EXACT | Status.SKIPPED


def width(keep: str, N: int, head: int, kept=KEEP) -> int:
    """Return the number of columns the driver writes for each sample: ``head``, then means and what is sure of them."""
    if keep not in kept:
        raise InputError(f"keep must be one of {', '.join(kept)}, got {keep!r}")
    return head + (0, N, 2 * N, N + N * (N + 1) // 2)[KEEP.index(keep)]


class Trace:
    """Columns of one run, time first: what every estimator says at every sample.

    ``prediction``, ``innovation`` and ``variance`` belong to y(t) given the samples before it. An estimator of one
    output has them (T,), one of several (T, p). ``state`` continues where the trace ends. A row of ``table`` has the
    ``columns`` that the estimator declares, each for every output, then what its kind of trace knows.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1).scan(y, u)
    >>> trace.prediction.shape, trace.parameters.shape, trace.names
    ((400,), (400, 2), ['a1', 'b1'])
    >>> round(float(abs(trace.innovation[10:]).max()), 1)
    0.4
    """

    begun: Any = None  # the state before the first sample
    index: Any = None  # that of a pandas y: its data frame has it again
    is_stamped = False  # whether the samples came with instants that the estimator went by

    def __init__(self, estimator, y, u, table, keep, state, observed_before=0.0, time=None):
        self.estimator, self.keep, self.state = estimator, keep, state
        self.y, self.u, self.table = y.copy(), u.copy(), table
        self.observed_before = np.asarray(observed_before, float)
        self.time = floats("time", self._times(len(y)) if time is None else time)
        if self.time.shape != (len(y),):
            raise InputError(f"time must be ({len(y)},) like y, got shape {self.time.shape}")

    def __len__(self):
        return len(self.y)

    def __repr__(self):
        return f"Trace({len(self)} samples of {self.estimator!r}, keep={self.keep!r})"

    def summary(self) -> Any:
        """Return what the run amounts to."""
        raise NotImplementedError

    def _repr_html_(self):
        return self.summary()._repr_html_()

    @cached_property
    def dt(self) -> float:
        """Seconds between samples."""
        return self.estimator.dt

    def _times(self, samples: int) -> np.ndarray:
        """Return the instants of samples that came without any: those of the state's count."""
        times = np.arange(samples, dtype=float)
        times += float(self.state["samples"]) - samples
        times *= self.dt
        return times

    # --- columns -------------------------------------------------------------------------------------------

    def _column(self, name: str) -> np.ndarray:
        """Return what the estimator declares under a name, (T,), with several outputs (T, p)."""
        if name not in self.estimator.columns:
            raise InputError(f"{type(self.estimator).__name__} does not record it: recursive estimators do")
        at = self.estimator.columns[name]
        return self.table[:, at.start] if self.estimator.outputs is None else self.table[:, at]

    @property
    def prediction(self) -> np.ndarray:
        """Prediction of y(t) from the samples before it, (T,) or (T, p)."""
        return self._column("prediction")

    @property
    def innovation(self) -> np.ndarray:
        """y(t) minus its prediction; NaN where y is missing, (T,) or (T, p)."""
        return self._column("innovation")

    @property
    def variance(self) -> np.ndarray:
        """Squared scale of the prediction error (its variance where the noise is known), (T,) or (T, p)."""
        return self._column("variance")

    @property
    def status(self) -> np.ndarray:
        """Bits of `driftwise.Status`, (T,) or (T, p)."""
        return self._column("status").astype(np.int64)

    @property
    def is_used(self) -> np.ndarray:
        """Whether the sample taught the filter anything, (T,) or (T, p)."""
        return (self.status & int(UNUSED)) == 0

    @property
    def dof(self) -> np.ndarray:
        """Degrees of freedom of the Student-t prediction; infinite where the noise is known, (T,) or (T, p)."""
        if "dof" in self.estimator.columns:
            return self._column("dof")
        return self.estimator.degrees_of_freedom(self.is_used, self.observed_before)

    @property
    def is_mixture(self) -> bool:
        """Whether predictions are mixtures, so that bands are quantiles of their own."""
        at = self.estimator.columns.get("mixture", slice(0, 0))
        return at.stop > at.start

    def mixture(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return what the predictions of a mixture are made of: weights, offsets, scales (T, M), and dof (T,)."""
        parts = self.table[:, self.estimator.columns["mixture"]]
        parts = parts.reshape(len(self), parts.shape[1] // 3, 3)
        return parts[..., 0], parts[..., 1], np.sqrt(parts[..., 2]), self.dof

    def band(self, level: float = 0.95) -> np.ndarray:
        """Half-width of the prediction interval at each sample (Student-t where the scale is learnt), (T,) or (T, p).

        Where the memory is a mixture (`AutoMemory`, `MultipleModel`, `IMM`), it is that of the mixture.
        """
        if not 0 < level < 1:
            raise InputError(f"level is a share between 0 and 1, got {level!r}. Is it a percentage? 95 % is 0.95")
        if self.is_mixture:
            return half_width(level, *self.mixture())
        dof, variance = self.dof, self.variance
        return quantile(0.5 + level / 2, dof) * np.sqrt(variance)

    # --- out -----------------------------------------------------------------------------------------------

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns by name, as `to_frame` and the command line write them.

        With several outputs those of each end in its number (prediction.2).
        """
        table = {"time": self.time, **self._named("y"), **self._inputs()}
        for name in self._shown():
            table |= self._named(name)
        return {name: np.ascontiguousarray(c) for name, c in table.items()}

    def _shown(self) -> list[str]:
        """What `columns` begins with."""
        more = [name for name in ("weight", "statistic") if name in self.estimator.columns]
        return ["prediction", "innovation", "variance", "dof", "status", *more]

    def _named(self, name: str) -> dict[str, np.ndarray]:
        """Return a column under its name, with several outputs under a name for each."""
        column = getattr(self, name)
        if column.ndim == 1:
            return {name: column}
        return {f"{name}.{i + 1}" if column.shape[1] > 1 else name: c for i, c in enumerate(column.T)}

    def _inputs(self) -> dict[str, np.ndarray]:
        return {f"u{i + 1}" if self.u.shape[1] > 1 else "u": c for i, c in enumerate(self.u.T)}

    def to_frame(self, backend: str = "pandas") -> Any:
        """Return the columns as a data frame of "pandas", "polars" or "pyarrow" (through narwhals).

        In pandas it has the index that y had.
        """
        frame = as_frame(self.columns(), backend)
        return frame if self.index is None or backend != "pandas" else frame.set_index(self.index)

    def plot(self, **options) -> Any:
        """Draw measured and predicted output, parameters and innovations with 2-sigma bands; return the Axes.

        Options: ``labels``, a dict of names with units for the axes; ``figure`` to draw into. Several outputs are drawn
        side by side, each with the parameters of its equation; of an observer every estimate.
        """
        return verbs.call("plot" if self.estimator.outputs is None else "plot outputs", self, **options)

    def report(self, path, **options) -> Any:
        """Write one self-contained HTML page that opens without a network; for one output, or an observer."""
        if self.estimator.outputs is not None:
            raise InputError(
                "report() is for one output. trace.summary().words says in sentences what it would say, trace.summary()"
                ".as_dict() in numbers, trace.plot()[0, 0].figure.savefig(path) keeps the picture"
            )
        return verbs.call("report", self, path, **options)

    def save(self, path) -> None:
        """Write the trace, with the estimator's settings and final state, to one ``.npz`` file."""
        from .snapshot import describe

        path = os.fspath(path)
        with replaced(path if path.endswith(SUFFIX) else path + SUFFIX) as beside, open(beside, "wb") as file:
            np.savez_compressed(
                file, header=describe(self.estimator), y=self.y, u=self.u, outs=self.table, time=self.time,
                state=np.atleast_1d(self.state).view(np.float64), extra=np.array([self.observed_before]),
                keep=self.keep,
            )  # fmt: skip

    @classmethod
    def load(cls, path) -> Any:
        """Return a saved trace, of the kind its estimator makes.

        Raises
        ------
        InputError
            Where the file is no such file, was altered, or is of another version.
        """
        from . import upgrade
        from .snapshot import rebuild

        path = Path(path)
        path = path if path.exists() else Path(f"{path}{SUFFIX}")
        with reading(path, "Trace.save"), np.load(path, allow_pickle=False) as f:
            est, keep, table = rebuild(str(f["header"])), str(f["keep"]), f["outs"]
            if not issubclass(est.trace_kind, cls):
                raise InputError(f"it holds the trace of {est!r}, which is no {cls.__name__}: use Trace.load")
            table = upgrade.table(est, table, est.table_width(keep))
            if table.shape != (len(f["y"]), est.table_width(keep)) or len(f["u"]) != len(table):
                raise InputError(f"its table has the shape {table.shape}, which a trace of {est!r} has not")
            state = check_states(upgrade.rows(est, f["state"].ravel()).view(est.dtype).reshape(()), est.unknown_parts)
            return est.trace_kind(est, f["y"], f["u"], table, keep, state, f["extra"][0], f["time"])
