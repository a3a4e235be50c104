"""What a run amounts to: fit, calibration, whiteness, parameters - accumulated in constant memory."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np

from ..engine.status import Status
from ..models.markup import markup
from .bands import quantile, share_within
from .events import runs
from .numbers import SECONDS, finite
from .stable import moduli
from .whiteness import LEAST, Correlations, Nis, Whiteness, score, verdict

HAPPENED = {"noise_rises": Status.NOISE, "outliers": Status.OUTLIER, "at_rest": Status.AT_REST}
SET_ASIDE = Status.REJECTED | Status.OUTLIER


class ModelSummary:
    """What a run says of the model as a whole; of one output or of several, the summary of a run begins with it."""

    def __init__(self, estimator):
        self.estimator, self.state, self.samples = estimator, estimator.start(), 0

    @property
    def words(self) -> str:
        """The run in a few plain sentences."""
        raise NotImplementedError

    @property
    def parameters(self) -> list[tuple[str, float, float]]:
        """(name, value, standard deviation) of each parameter."""
        raise NotImplementedError

    def __str__(self):
        return self.words

    def __repr__(self):
        return f"{type(self).__name__}({self.samples} samples of {self.estimator!r})"

    def _repr_html_(self):
        return markup(self.words, parameters=self.parameters)

    def _forget(self) -> None:
        """Forget what was computed of the run so far: more of it comes."""
        for kind in type(self).__mro__:
            for name, value in vars(kind).items():
                if isinstance(value, cached_property):
                    self.__dict__.pop(name, None)

    @cached_property
    def loglik(self) -> float:
        """Log evidence of the run."""
        return self.estimator.loglik(self.state)

    @cached_property
    def model(self) -> Any:
        """The model at the end of the run."""
        return self.estimator.model_of(self.state)

    @cached_property
    def is_enough(self) -> bool:
        """Whether more outputs were measured than there are unknowns."""
        raise NotImplementedError

    def _bars(self, std) -> np.ndarray:
        """Return standard deviations, infinite where too little was measured."""
        return np.asarray(std) if self.is_enough else np.full(np.shape(std), math.inf)

    @cached_property
    def poles(self) -> list[tuple[complex, float]]:
        """(pole, standard deviation) of each pole, largest first."""
        return [(complex(p), float(s)) for p, s in zip(self.model.poles, self._bars(self.model.poles_std))]

    @cached_property
    def unlearned(self) -> list[tuple[str, float]]:
        """(direction, ratio of posterior to prior variance) of the combinations the data did not teach."""
        found = [(r, v) for r, v in self.directions if r > 0.5]
        return [(combination(v, self.estimator.names), r) for r, v in found]

    @cached_property
    def directions(self) -> list[tuple[float, np.ndarray]]:
        """(ratio of posterior to prior variance, direction) of all combinations, the least learned first."""
        return self.estimator.information_ratio(self.state)


class Summary(ModelSummary):
    """Numbers of a run; add one trace after the other, memory does not grow.

    Outliers, those of a gate and those that a memory tells, are left out of NIS, coverage and whiteness (those of a
    gate out of the fit as well), and so are the first ``settle`` measured samples (by default 2 N): there the prior
    speaks. NIS and coverage also wait until the learnt scale has ten degrees of freedom.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> summary = dw.ARX(1, 1).scan(y, u).summary()
    >>> summary.samples, round(summary.fit), round(summary.noise_std, 1)
    (400, 96, 0.1)
    """

    def __init__(self, estimator, settle: int | None = None):
        super().__init__(estimator)
        self.settle = 2 * estimator.model.N if settle is None else settle
        self.origin: str | None = None  # the time stamp of second 0, if it is known
        self.unit = SECONDS  # of dt and time
        self._words: dict[tuple, str] = {}
        self.unknowns = estimator.model.N
        self.is_static = not estimator.order  # a regression without memory: no poles, no zeros, no steady state
        self.observed = self.missing_outputs = self.missing_inputs = 0
        self.rejected = self.bad_values = self.jumps = 0
        self.last_jump = math.nan  # its time
        self.last_moved = ""  # what it moved, if that is known
        self.happened = dict.fromkeys(HAPPENED, (0, math.nan))  # how many samples, and when the last time
        self._count, self._mean, self._m2 = 0, 0.0, 0.0  # of y
        self._squares, self._nis, self._nis_spread, self._covered, self._scored = 0.0, 0.0, 0.0, 0, 0
        self._lags = Correlations()

    def add(self, trace: Any) -> Summary:
        """Take in one more stretch of the run."""
        self._forget()
        self._words.clear()
        self.state = trace.state
        status, used, innovation, variance, dof = (
            trace.status, trace.is_used, trace.innovation, trace.variance, trace.dof
        )  # fmt: skip
        mixture = trace.mixture() if trace.is_mixture else ()
        late = self.observed + np.cumsum(used) > self.settle
        self.samples += len(used)

        def count(bit):
            return int(np.count_nonzero(status & int(bit)))

        self.missing_outputs += count(Status.MISSING_OUTPUT)
        self.missing_inputs += count(Status.MISSING_INPUT)
        self.rejected += count(Status.REJECTED)
        self.bad_values += count(Status.BAD_VALUE)
        jumped = np.flatnonzero(status & int(Status.JUMP))
        if len(jumped):
            last = trace.jumps()[-1]
            self.jumps, self.last_jump, self.last_moved = self.jumps + len(jumped), last.time, last.weighed
        for name, bit in HAPPENED.items():
            where = runs(status, bit)
            if len(where):
                more = int((where[:, 1] - where[:, 0] + 1).sum())
                self.happened[name] = self.happened[name][0] + more, float(trace.time[where[-1, 1]])
        self.observed += int(np.count_nonzero(used))

        measured = np.isfinite(innovation) & late & ((status & int(Status.REJECTED)) == 0)
        y, e = trace.y[measured], innovation[measured]
        self._count, self._mean, self._m2 = pool(self._count, self._mean, self._m2, y)
        self._squares += float(np.einsum("i,i->", e, e))

        is_usual = (status & int(SET_ASIDE)) == 0
        scored = used & late & is_usual & (variance > 0) & (dof >= LEAST)
        e, T, dof = innovation[scored], variance[scored], dof[scored]
        total, spread, _ = score(e, T, dof)
        self._nis, self._nis_spread = self._nis + total, self._nis_spread + spread
        z = np.full(len(used), np.nan)
        z[scored] = e / np.sqrt(T)
        if mixture:
            parts = (part[scored] for part in mixture)
            self._covered += int(np.count_nonzero(share_within(abs(e), *parts) <= 0.95))
        else:
            self._covered += int(np.count_nonzero(is_inside(abs(z[scored]), dof)))
        self._scored += len(dof)
        self._lags.add(z.clip(-4, 4))  # one giant must not drown the rest
        return self

    # --- the numbers ---------------------------------------------------------------------------------------

    @cached_property
    def is_enough(self) -> bool:
        """Whether more outputs were measured than there are unknowns."""
        return self.observed > self.unknowns

    @cached_property
    def rmse(self) -> float:
        """Root mean square one-step prediction error."""
        return math.sqrt(self._squares / self._count) if self._count else math.nan

    @cached_property
    def fit(self) -> float:
        """One-step fit, 100 (1 - rmse / std y) percent: 0 is as good as the mean."""
        std = math.sqrt(self._m2 / self._count) if self._count else 0.0
        return 100 * (1 - self.rmse / std) if std > 0 else math.nan

    @cached_property
    def noise_std(self) -> float:
        """Standard deviation of the noise w_n, given or learnt."""
        return math.sqrt(self.estimator.policies[1].R * self.estimator.sigma2(self.state))

    @cached_property
    def nis(self) -> float:
        """Mean normalised innovation squared; 1 when the error bars mean what they say."""
        return self._nis / self._scored if self._scored else math.nan

    @cached_property
    def nis_interval(self) -> Nis:
        """NIS with the interval that holds it 95 times in 100 under the right model."""
        return self.nis_within(0.95)

    def nis_within(self, level: float) -> Nis:
        """Return NIS with the interval that holds it with that probability under the right model."""
        return verdict(self._nis, self._nis_spread, self._scored, level)

    @cached_property
    def coverage(self) -> float:
        """Fraction of samples inside their 95 % prediction band."""
        return self._covered / self._scored if self._scored else math.nan

    @cached_property
    def correlations(self) -> np.ndarray:
        """Autocorrelation of the standardised innovations at lags 0 to 20, gaps left out."""
        return self._lags.correlations

    @cached_property
    def bias(self) -> float:
        """Mean of the innovations, in their predicted standard deviations."""
        return self._lags.mean

    @cached_property
    def whiteness(self) -> Whiteness:
        """Ljung-Box verdict at 1 % on 20 lags (fewer on short records)."""
        return self._lags.whiteness

    @cached_property
    def parameters(self) -> list[tuple[str, float, float]]:
        """(name, value, standard deviation) of each parameter."""
        est = self.estimator  # a model may hold zeros beside the parameters, and not hold an offset
        values, P = est.parameters_of(self.state)
        return [(n, float(v), float(s)) for n, v, s in zip(est.names, values, self._bars(np.sqrt(np.diag(P))))]

    @cached_property
    def poles(self) -> list[tuple[complex, float]]:
        """(pole, standard deviation) of each pole, largest first; none of a regression without memory."""
        return [] if self.is_static else super().poles

    @cached_property
    def moduli(self) -> list[tuple[complex, float]]:
        """(pole, standard deviation of its modulus in discrete time) of each pole, largest first: what ``|p|`` is ±."""
        if self.is_static:
            return []
        poles = self.poles
        spreads = moduli(self.model, self.estimator.dt)[1] if self.is_enough else (math.inf for _ in poles)
        return [(p, float(spread)) for (p, _), spread in zip(poles, spreads)]

    @cached_property
    def notes(self) -> list[str]:
        """What is not an ordinary standard deviation in the model, in words."""
        return list(dict.fromkeys(self.model.notes)) if self.is_enough and not self.is_static else []

    @cached_property
    def drift(self):
        """How fast each parameter drifts (`Recursive.drift_of`); None where the memory knows of no drift."""
        return self.estimator.drift_of(self.state)

    @cached_property
    def prior_share(self) -> float:
        """How much of the least known combination the default prior still makes up; 0 where a prior was given."""
        options = self.estimator.options
        if self.estimator.holds_poles:
            return 0.0  # its prior is meant
        if options.get("P0") is not None or not self.is_enough:
            return 0.0
        names, small = self.state.dtype.names or (), 0.03 * self.estimator.y_scale
        most = math.inf if "top" in names and float(self.state["top"]) < small else 0.5  # else nothing excites it
        return min(max((r for r, _ in self.directions if r <= most), default=0.0), 1.0)

    @property
    def words(self) -> str:
        """The run in a few plain sentences; they are written once for each way of telling the time."""
        way = self.unit, self.origin
        if way not in self._words:
            from .paragraphs import of_run

            self._words[way] = of_run(self)
        return self._words[way]

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, ready for JSON (NaN becomes None)."""
        model, w, inputs = self.model, self.whiteness, 0 if self.is_static else self.model.form.inputs
        gains = zip(model.dc_gain, model.dc_gain_std, model.dc_gain_interval()) if inputs else ()
        data = {
            "samples": self.samples, "observed": self.observed, "missing_outputs": self.missing_outputs,
            "missing_inputs": self.missing_inputs, "rejected": self.rejected, "bad_values": self.bad_values,
            "jumps": self.jumps, "last_jump": self.last_jump,
            **{name: {"samples": count, "last": when} for name, (count, when) in self.happened.items()},
            "fit": self.fit, "rmse": self.rmse, "noise_std": self.noise_std, "nis": self.nis,
            "nis_interval": [self.nis_interval.low, self.nis_interval.high], "coverage": self.coverage,
            "whiteness": w._asdict(), "loglik": self.loglik,
            "parameters": [{"name": n, "value": v, "std": s} for n, v, s in self.parameters],
            "drift": None if self.drift is None else self.drift.as_dict(),
            "poles": [
                {"real": p.real, "imag": p.imag, "modulus": abs(p), "std": s, "method": how}
                for (p, s), how in zip(self.poles, model.method)
            ],
            "dc_gain": [{"value": float(g), "std": float(s), "interval": i.tolist()} for g, s, i in gains],
            "zeros": [
                [{"real": float(z.real), "imag": float(z.imag), "std": float(d)} for z, d in zip(*found)]
                for found in ((model.zeros(i), model.zeros_std(i)) for i in range(inputs))
            ],
            "notes": self.notes,
            "unlearned": [{"direction": d, "ratio": r} for d, r in self.unlearned],
            "words": self.words,
        }  # fmt: skip
        return finite(data)


def pool(count: int, mean: float, m2: float, y) -> tuple[int, float, float]:
    """Return count, mean and sum of squares about it with more values in (Chan et al. 1979)."""
    if not len(y):
        return count, mean, m2
    delta, total = float(y.mean()) - mean, count + len(y)
    m2 += float(np.sum((y - y.mean()) ** 2)) + delta * delta * count * len(y) / total
    return total, mean + delta * len(y) / total, m2


def is_inside(z, dof) -> np.ndarray:
    """Say which lie within their 95 % band; quantiles are computed only between those of most and least ``dof``."""
    if not len(z):
        return np.zeros(0, bool)
    narrow, wide = quantile(0.975, np.array([dof.max(), dof.min()]))
    found, near = z <= narrow, (z > narrow) & (z <= wide)
    found[near] = z[near] <= quantile(0.975, dof[near])
    return found


def combination(direction, names) -> str:
    """Write a direction as a combination of parameters, its large entries only."""
    big = [(c, n) for c, n in zip(direction, names) if abs(c) > 0.2]
    big = [(c * np.sign(big[0][0]), n) for c, n in big]
    return " ".join(f"{'-' if c < 0 else '+'} {abs(c):.2f} {n}" for c, n in big).removeprefix("+ ").replace("1.00 ", "")
