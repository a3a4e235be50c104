"""`Fleet`: a row of numbers for each key, advanced together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..engine import validation
from ..engine.errors import InputError
from ..estimators.base import Step, is_estimator
from ..models.markup import columns, markup
from . import store
from .crew import Crew


def _on_gpu(estimator, threads, lanes) -> Crew:
    """Return the crew of a GPU."""
    from .cuda import CudaCrew

    if threads is not None or lanes is not None:
        raise InputError("threads and lanes are the processor's: leave them out with device='cuda'")
    return CudaCrew(estimator)


def _listed(keys: Iterable) -> Iterable:
    """Return keys, and refuse a text, whose letters are hardly meant to be keys."""
    if isinstance(keys, str | bytes):
        raise InputError(f"keys must be several, as in [{keys!r}], got {keys!r}")
    return keys


def check_learns(estimator) -> None:
    """Raise InputError for an observer, whose fleet is no run: results are about parameters of scaled models."""
    if estimator.is_observer:
        raise InputError(
            "a run over a table is for estimators that learn parameters of scaled samples; observers of a known plant "
            "are many in dw.Fleet(est, keys), or in est.update_batch(est.start(series), y, u)"
        )


class Fleet:
    """Many series of one kind of estimator: add, drop, and advance them, any subset in any order.

    The numbers are those that the estimator gives each series on its own, bit for bit, whatever the order of the keys,
    the stretches in which samples come, and the number of threads.

    Parameters
    ----------
    estimator : the settings of each series, unless it gets its own
        ``Joint``, ``ARX`` and its kin, ``JointMIMO``, ``ARXMIMO``; not with ``start="algebraic"``. Observers, as
        ``StateSpace`` and ``GreyBox``, too: those that pause for fits, of a start or of jumps, go one by one.
    keys : iterable, optional
        Names of the first series: numbers, text, anything hashable.
    threads : int, optional
        As many as there are cores if omitted.
    lanes : bool, optional
        Whether eight series at a time may share a processor register: three to five times the speed on clean samples,
        the same bits, one more loop to compile (seconds, once, by gcc or clang; without them one series at a time). If
        omitted, from the five millionth sample on.
    device : "cpu" or "cuda"
        Where the series live: "cuda" is an NVIDIA GPU, and they stay there until ``states`` and the like ask for them.

    Raises
    ------
    InputError
        Where keys, shapes or settings do not fit.

    Notes
    -----
    Bad at: fleets of very different models (each kind and order needs a fleet of its own), instants (samples count as
    ``dt`` apart, also those of a `ContinuousJoint`), and few samples at a time: a call takes as long as a few hundred.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> fleet = dw.Fleet(dw.AR(1), ["pump 1", "pump 2"])
    >>> y, _ = dw.simulate([-0.8], [0.0], samples=500, noise_std=1.0, seed=1)
    >>> keys = np.repeat(["pump 2", "pump 1"], 500)
    >>> step = fleet.scan(keys, np.concatenate([y, -y]))
    >>> fleet.mean("pump 1").round(1), bool(fleet.mean("pump 1") == fleet.mean("pump 2"))
    (array([-0.8]), True)
    """

    def __init__(
        self,
        estimator,
        keys: Iterable = (),
        *,
        threads: int | None = None,
        lanes: bool | None = None,
        device: str = "cpu",
    ):
        if not is_estimator(estimator) or estimator.members:
            raise InputError(f"a fleet needs one of driftwise's estimators, such as ARX(2, 2), got {estimator!r}")
        if estimator.starting is not None and not estimator.pauses:
            raise InputError("a fleet takes each sample as it comes: leave start='algebraic' out")
        if threads is not None:
            validation.count("threads", threads, least=1)
        if device not in ("cpu", "cuda"):
            raise InputError(f"device must be 'cpu' or 'cuda', got {device!r}")
        self.crew = Crew(estimator, threads, lanes) if device == "cpu" else _on_gpu(estimator, threads, lanes)
        self.estimators = [estimator]
        self._specs = estimator.spec[None].copy()
        self._index: dict[Any, int] = {}
        self._own = np.empty((0, self.crew.width))
        self._group = np.empty(0, np.int64)
        self.add(keys)

    def __repr__(self):
        return f"Fleet({self.estimators[0]!r}, {len(self)} series)"

    def _repr_html_(self):
        return markup(repr(self)) + columns({"series": self.keys, "samples": self.states["samples"].tolist()}, limit=10)

    def __len__(self) -> int:
        return len(self._index)

    def __contains__(self, key) -> bool:
        return key in self._index

    @property
    def keys(self) -> list:
        """The keys, in the order they were added."""
        return list(self._index)

    @property
    def states(self) -> np.ndarray:
        """The states (S,), in the order of ``keys``: a view, good until series are added or dropped.

        Of a fleet on a GPU it is good until the next samples; what is written into it counts.
        """
        return self._rows[: len(self)].view(self.estimators[0].dtype).reshape(-1)

    @property
    def _rows(self) -> np.ndarray:
        """The states as rows of numbers, and room for more; brought here, if they live on a GPU."""
        self.crew.fetch(self._own)
        return self._own

    # --- members -------------------------------------------------------------------------------------------

    def add(self, keys: Iterable, estimator=None) -> None:
        """Add series that begin afresh, with an estimator of their own if given (same kind, same orders)."""
        keys = list(_listed(keys))
        if len(set(keys)) < len(keys) or not self._index.keys().isdisjoint(keys):
            twice = next(key for key, count in Counter([*self._index, *keys]).items() if count > 1)
            raise InputError(f"every key names one series: {twice!r} is there twice")
        number = 0 if estimator is None else self._settings(estimator)
        before, after = len(self), len(self) + len(keys)
        if not keys:
            return
        rows = self._rows
        if after > len(rows):  # grown in place where the system can
            room = max(after, len(rows) + len(rows) // 4)
            rows.resize((room, self.crew.width), refcheck=False)
            self._group.resize(room, refcheck=False)
        rows[before:after] = self.estimators[number].start().reshape(1).view(np.float64)
        self._group[before:after] = number
        self._index.update(zip(keys, range(before, after)))

    def begin(self, at, estimator) -> None:
        """Let the series of these rows (n,) begin afresh, with an estimator of their own (same kind, same orders)."""
        number = self._settings(estimator)
        self._rows[at] = self.estimators[number].start().reshape(1).view(np.float64)
        self._group[at] = number

    def _settings(self, estimator) -> int:
        """Return the number of an estimator's settings."""
        own, first = Crew(estimator), self.crew
        same = [(c.kinds, c.sizes, c.width, c.numbers, c.outputs, c.inputs) for c in (own, first)]
        if same[0] != same[1]:
            raise InputError(
                f"one fleet has one kind of estimator: {estimator!r} has other policies or orders than "
                f"{self.estimators[0]!r}. Give it a fleet of its own."
            )
        for number, other in enumerate(self.estimators):
            if other is estimator:
                return number
        if own.drive:
            raise InputError("series whose estimators pause for fits have one estimator: another needs its own fleet")
        self.estimators.append(estimator)
        self._specs = np.vstack([self._specs, estimator.spec])
        return len(self.estimators) - 1

    def drop(self, keys: Iterable) -> None:
        """Forget series; the others stay in order."""
        gone = [self._row(key) for key in _listed(keys)]
        stay = np.ones(len(self), bool)
        stay[gone] = False
        names = [key for key, is_left in zip(self._index, stay) if is_left]
        self._own, self._group = self._rows[: len(self)][stay], self._group[: len(self)][stay]
        self._index = dict(zip(names, range(len(names))))

    def _row(self, key) -> int:
        try:
            return self._index[key]
        except (KeyError, TypeError):
            like = next((k for k in self._index if str(k) == str(key)), None)
            cause = "add it first" if like is None else f"there is {like!r}, and numbers are not text"
            raise InputError(f"there is no series {key!r} in this fleet of {len(self)}; {cause}") from None

    def rows_of(self, keys) -> np.ndarray:
        """Return the row number of each key, (n,)."""
        return np.fromiter(map(self._row, keys.tolist() if isinstance(keys, np.ndarray) else _listed(keys)), np.int64)

    def estimator_of(self, key):
        """Return the estimator with the settings of one series."""
        return self.estimators[self._group[self._row(key)]]

    def state(self, key) -> np.ndarray:
        """Return the state of one series, as its estimator's `update` takes it."""
        return self.states[self._row(key)].copy()

    def mean(self, key) -> np.ndarray:
        """Return what is estimated of one series, as its estimator's `mean` does."""
        return self.estimator_of(key).mean(self.state(key))

    # --- keeping -------------------------------------------------------------------------------------------

    def save(self, path) -> None:
        """Write the fleet to one Parquet file in one step: whoever looks sees the old file or the new one, whole.

        Every bit of every state survives, and settings and keys (text and numbers) are in the file, with a checksum.

        Raises
        ------
        InputError
            Where a key is neither text nor a number.

        Examples
        --------
        >>> import tempfile, driftwise as dw
        >>> path = f"{tempfile.mkdtemp()}/fleet.parquet"
        >>> dw.Fleet(dw.AR(1), ["pump 1", 2]).save(path)
        >>> dw.Fleet.load(path).keys
        ['pump 1', 2]
        """
        store.write(self, path)

    @classmethod
    def load(cls, path, estimator=None, *, threads: int | None = None, device: str = "cpu") -> Fleet:
        """Return a fleet as it was saved, also by an earlier version.

        Parameters
        ----------
        path : file that `save` wrote
        estimator : needed only where a policy is your own: the estimator that the fleet was made with
        threads, device : as for a new one

        Raises
        ------
        InputError
            Where the file was cut short or altered, or is of a later version than this one.
        """
        return cls._of(store.read(path, estimator), threads=threads, device=device)

    @classmethod
    def _of(cls, kept, **options) -> Fleet:
        """Return the fleet that was kept; its memory is that of ``kept``."""
        first, *others = kept.estimators
        fleet = cls(first, **options)
        for other in others:
            fleet._settings(other)
        fleet._own, fleet._group = kept.rows, kept.group
        fleet._index = dict(zip(kept.keys, range(len(kept.keys))))
        return fleet

    # --- running -------------------------------------------------------------------------------------------

    def update_batch(self, keys, y, u=None) -> Step:
        """Take one sample of each of these series (all of them if ``keys`` is None); return what it showed.

        Parameters
        ----------
        keys : (n,) keys in any order, or None
        y : (n,) or (n, p) outputs; NaN where missing
        u : (n,) or (n, k) inputs; NaN where missing

        Returns
        -------
        Step of arrays shaped like y
        """
        at = np.arange(len(self)) if keys is None else self.rows_of(keys)
        return self._step(at, y, u)

    def scan(self, keys, y, u=None) -> Step:
        """Take a long table: the samples of each series in the order they stand in, mixed with others in any way.

        Keys that are new begin afresh. Parameters and result are as in `update_batch`.
        """
        keys = np.asarray(keys)
        names, first, codes = np.unique(keys, return_index=True, return_inverse=True)
        listed = names.tolist()
        self.add(listed[i] for i in np.argsort(first) if listed[i] not in self._index)
        return self._step(self.rows_of(listed)[codes], y, u)

    def _step(self, at, y, u) -> Step:
        p, k, n = self.crew.outputs, self.crew.inputs, len(at)
        y = validation.numbers("y", y)
        if y.shape not in ((n, p), (n,) if p == 1 else None):
            raise InputError(f"y must have {n} rows like keys{'' if p == 1 else f' and {p} columns'}, got {y.shape}")
        us = validation.simultaneous(u, n, k)
        outs = self.advance(at, y.reshape(n, p), us, self.estimators[0].step_columns)
        prediction, innovation, variance, status = (outs[:, p * i : p * i + p].reshape(y.shape) for i in range(4))
        return Step(prediction, innovation, variance, status.astype(int))

    def advance(self, at, ys, us, columns: int | None = None) -> np.ndarray:
        """Take samples (n, p), (n, k) of the rows ``at`` (n,); return what each showed, (n, columns): no checks."""
        columns = 4 * self.crew.outputs if columns is None else columns
        return self.crew.advance(self._own, at, ys, us, self._specs, self._group, columns)
