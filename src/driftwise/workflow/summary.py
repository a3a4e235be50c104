"""What a run amounts to: fit, calibration, whiteness, parameters - accumulated in constant memory."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..kernel.status import Status
from ..models.convert import Model
from .trace import Trace, quantile

LAGS = 20


class Whiteness(NamedTuple):
    """Ljung-Box test of the standardised innovations.

    No degrees of freedom are taken off: recursive innovations are exactly white under the right model.
    """

    statistic: float
    lags: int
    p_value: float
    is_white: bool


class Summary:
    """Numbers of a run; add one trace after the other, memory does not grow.

    The first ``settle`` measured samples (by default 2 N) are left out of fit, NIS, coverage and whiteness: there the
    prior speaks. NIS and coverage also wait until the learnt scale has ten degrees of freedom.
    """

    def __init__(self, estimator, settle: int | None = None):
        self.estimator = estimator
        self.settle = 2 * estimator.model.N if settle is None else settle
        self.state = estimator.start()
        self.samples = self.observed = self.missing_outputs = self.missing_inputs = 0
        self.rejected = self.bad_values = 0
        self._count, self._mean, self._m2 = 0, 0.0, 0.0  # of y
        self._squares, self._nis, self._covered, self._scored = 0.0, 0.0, 0, 0
        self._products, self._tail = np.zeros(LAGS + 1), np.zeros(0)

    def add(self, trace: Trace) -> Summary:
        """Take in one more stretch of the run."""
        status = trace.status
        self.state = trace.state
        used = trace.is_used
        late = self.observed + np.cumsum(used) > self.settle
        self.samples += len(trace)

        def count(bit):
            return int(np.count_nonzero(status & int(bit)))

        self.missing_outputs += count(Status.MISSING_OUTPUT)
        self.missing_inputs += count(Status.MISSING_INPUT)
        self.rejected += count(Status.REJECTED)
        self.bad_values += count(Status.BAD_VALUE)
        self.observed += int(np.count_nonzero(used))

        measured = np.isfinite(trace.innovation) & late & ((status & int(Status.REJECTED)) == 0)
        y, e = trace.y[measured], trace.innovation[measured]
        self._pool(y)
        self._squares += float(np.einsum("i,i->", e, e))

        scored = used & late & (trace.variance > 0) & (trace.dof >= 10)
        e, T, dof = trace.innovation[scored], trace.variance[scored], trace.dof[scored]
        z = e / np.sqrt(T)
        # a Student error has variance dof / (dof - 2): the ratio to it is 1 on average
        self._nis += float(np.sum(z * z * (1 - 2 / dof)))
        self._covered += int(np.count_nonzero(abs(z) <= quantile(0.975, dof))) if len(z) else 0
        self._scored += len(z)
        self._correlate(z.clip(-4, 4))  # one giant must not drown the rest
        return self

    def _pool(self, y):
        """Merge mean and sum of squares of y (Chan et al. 1979)."""
        if len(y):
            delta, total = float(y.mean()) - self._mean, self._count + len(y)
            self._m2 += float(np.sum((y - y.mean()) ** 2)) + delta * delta * self._count * len(y) / total
            self._mean += delta * len(y) / total
            self._count = total

    def _correlate(self, z):
        joined = np.concatenate([self._tail, z])
        new = len(self._tail)
        for k in range(LAGS + 1):
            first = max(new, k)
            if first < len(joined):
                self._products[k] += np.einsum("i,i->", joined[first:], joined[first - k : len(joined) - k])
        self._tail = joined[-LAGS:]

    # --- the numbers ---------------------------------------------------------------------------------------

    @property
    def is_enough(self) -> bool:
        """Whether more outputs were measured than there are unknowns."""
        return self.observed > self.estimator.model.N

    @property
    def rmse(self) -> float:
        """Root mean square one-step prediction error."""
        return math.sqrt(self._squares / self._count) if self._count else math.nan

    @property
    def fit(self) -> float:
        """One-step fit, 100 (1 - rmse / std y) percent: 0 is as good as the mean."""
        std = math.sqrt(self._m2 / self._count) if self._count else 0.0
        return 100 * (1 - self.rmse / std) if std > 0 else math.nan

    @property
    def noise_std(self) -> float:
        """Standard deviation of the noise w_n, given or learnt."""
        return math.sqrt(self.estimator.policies[1].R * self.estimator.sigma2(self.state))

    @property
    def nis(self) -> float:
        """Mean normalised innovation squared; 1 when the error bars mean what they say."""
        return self._nis / self._scored if self._scored else math.nan

    @property
    def coverage(self) -> float:
        """Fraction of samples inside their 95 % prediction band."""
        return self._covered / self._scored if self._scored else math.nan

    @property
    def correlations(self) -> np.ndarray:
        """Autocorrelation of the standardised innovations at lags 0 to 20."""
        return self._products / self._products[0] if self._products[0] > 0 else self._products * math.nan

    @property
    def whiteness(self) -> Whiteness:
        """Ljung-Box verdict at 1 % on 20 lags (fewer on short records)."""
        from scipy.special import gammaincc

        n = self._scored
        lags = min(LAGS, max(1, n // 5))
        if n < 10:
            return Whiteness(math.nan, lags, math.nan, True)
        r = self.correlations[1 : lags + 1]
        statistic = float(n * (n + 2) * np.sum(r * r / (n - np.arange(1, lags + 1))))
        p = float(gammaincc(lags / 2, statistic / 2))
        return Whiteness(statistic, lags, p, bool(p > 0.01))

    @property
    def loglik(self) -> float:
        """Log evidence of the run."""
        return self.estimator.loglik(self.state)

    @property
    def model(self) -> Model:
        """The model at the end of the run."""
        return self.estimator.model_of(self.state)

    @property
    def parameters(self) -> list[tuple[str, float, float]]:
        """(name, value, standard deviation) of each parameter."""
        model = self.model
        std = np.sqrt(np.diag(model.covariance)) if self.is_enough else np.full(len(model.values), math.inf)
        return [(n, float(v), float(s)) for n, v, s in zip(model.names, model.values, std)]

    @property
    def poles(self) -> list[tuple[complex, float]]:
        """(pole, standard deviation) of each pole, largest first."""
        model = self.model
        std = model.poles_std if self.is_enough else np.full(len(model.poles), math.inf)
        return [(complex(p), float(s)) for p, s in zip(model.poles, std)]

    @property
    def unlearned(self) -> list[tuple[str, float]]:
        """(direction, ratio of posterior to prior variance) of the combinations the data did not teach."""
        found = [(r, v) for r, v in self.estimator.excitation(self.state) if r > 0.5]
        return [(_words(v, self.estimator.names), r) for r, v in found]

    @property
    def words(self) -> str:
        """The run in a few plain sentences."""
        from .wording import paragraph

        return paragraph(self)

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, ready for JSON (NaN becomes None)."""
        model, w = self.model, self.whiteness
        data = {
            "samples": self.samples, "observed": self.observed, "missing_outputs": self.missing_outputs,
            "missing_inputs": self.missing_inputs, "rejected": self.rejected, "bad_values": self.bad_values,
            "fit": self.fit, "rmse": self.rmse, "noise_std": self.noise_std, "nis": self.nis, "coverage": self.coverage,
            "whiteness": w._asdict(), "loglik": self.loglik,
            "parameters": [{"name": n, "value": v, "std": s} for n, v, s in self.parameters],
            "poles": [{"real": p.real, "imag": p.imag, "modulus": abs(p), "std": s} for p, s in self.poles],
            "dc_gain": [{"value": float(g), "std": float(s)} for g, s in zip(model.dc_gain, model.dc_gain_std)],
            "unlearned": [{"direction": d, "ratio": r} for d, r in self.unlearned],
            "words": self.words,
        }  # fmt: skip
        return _finite(data)


def _words(direction, names) -> str:
    """Write a direction as a combination of parameters, its large entries only."""
    direction = direction * np.sign(direction[np.argmax(abs(direction))])
    big = [(c, n) for c, n in zip(direction, names) if abs(c) > 0.2]
    return " ".join(f"{'-' if c < 0 else '+'} {abs(c):.2f} {n}" for c, n in big).removeprefix("+ ").replace("1.00 ", "")


def _finite(value):
    """Replace what JSON cannot hold by None."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
