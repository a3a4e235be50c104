"""A regression on regressors of one's own, with a disturbance beside its parameters where the noise is coloured."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...memory.auto import AutoMemory
from ...memory.drift import Drift
from ...memory.likelihood_drift import LikelihoodDrift
from ...models.disturbance import Disturbance
from ...models.equation import Equation
from .estimator import ARX


class Regression(ARX):
    """Coefficients of y = phi' theta + d + e for regressors of your own: recursive least squares, tracking included.

    Parameters
    ----------
    regressors : int, or a list of names
        How many regressors ``phi`` has; they are handed over as ``u``.
    disturbance : Disturbance, optional
        Coloured noise d, a state beside the parameters (and the last of them in the trace). Without it the
        autocorrelation of the noise is taken for drift, and what was learnt at the last reference is carried on for
        ever. Needs ``memory=Drift(..)``, `AutoMemory` or `LikelihoodDrift`; the numbers of a `Drift` are those of the
        other parameters, relative to the *white* noise, of which there may be little (``Disturbance.ratio``).
    offset, memory, gate, ... : as for `ARX`

    Notes
    -----
    Bad at: a disturbance as slow as the drift. The record cannot tell them apart, and the memory decides.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> phi = np.random.default_rng(0).standard_normal((300, 2))
    >>> y = phi @ [2.0, -1.0] + 0.5
    >>> trace = dw.Regression(["slope", "other"], offset=True).scan(y, phi)
    >>> dict(zip(trace.names, trace.parameters[-1].round(3).tolist()))
    {'slope': 2.0, 'other': -1.0, 'offset': 0.5}
    """

    for_colour = "another regressor"

    def __init__(self, regressors=1, *, disturbance: Disturbance | None = None, **options):
        labels = tuple(map(str, regressors)) if isinstance(regressors, list | tuple | np.ndarray) else ()
        if len(set(labels)) < len(labels):
            raise InputError(f"regressors need different names, got {regressors!r}")
        m = len(labels) or validation.count("regressors", regressors, least=1)
        labels = labels or tuple(f"theta{i + 1}" for i in range(m))
        self.disturbance = _checked(disturbance)
        if disturbance is not None and options.get("method", "ls") != "ls":
            raise InputError(f"a disturbance is estimated by least squares, not by method={options['method']!r}")
        if disturbance is not None and options.get("start") is not None:
            raise InputError("an algebraic start knows of no disturbance: leave start= out")
        plain = ARX(0, (1,) * m, 0, **(options if disturbance is None else _bare(options)))
        self.__dict__.update(plain.__dict__)
        self.options = {"regressors": regressors, "disturbance": disturbance} | {
            k: options.get(k, v) for k, v in plain.options.items() if k not in ("na", "nb", "nk")
        }
        self.model = Equation(0, (1,) * m, (0,) * m, plain.model.has_offset, labels)
        if disturbance is not None:
            self._build(0, (1,) * m, 0, plain.model.has_offset, labels, True)

    def _memory(self, R) -> Any:
        memory = self.options["memory"]
        if self.disturbance is None:
            return memory
        pole, nvr, others = self.disturbance.pole, self.disturbance.nvr, self.model.N - 1
        if not isinstance(memory, Drift | AutoMemory | LikelihoodDrift):
            raise InputError(
                "a disturbance fades by itself, which memory=Drift(nvr=..), AutoMemory() and LikelihoodDrift() can "
                "say, "
                f"got {memory!r}"
            )
        if np.ndim(memory.phi) == 2 or (isinstance(memory, Drift) and np.ndim(memory.q) == 2):
            raise InputError("beside a disturbance, phi and q are a number, or one for each of the other parameters")
        changed: dict[str, Any] = {"phi": np.append(validation.each("phi", memory.phi, others), pole)}
        if isinstance(memory, Drift) and np.size(memory.nvr):
            changed["nvr"] = np.append(validation.each("nvr", memory.nvr, others), nvr)
        elif isinstance(memory, Drift) and np.size(memory.q):
            changed["q"] = np.append(validation.each("q", memory.q, others), nvr * R / self.y_scale**2)
        return memory._replace(**changed)

    def predict(self, state, u=None, horizon: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (h,) and standard deviation (h,) of the next h outputs, as `ARX.predict`; a disturbance fades."""
        if self.disturbance is None:
            return super().predict(state, u, horizon)
        if u is None:
            raise InputError("predict needs u: the regressors of the samples to come, (h, k)")
        h = len(np.atleast_1d(u)) if horizon is None else validation.count("horizon", horizon, 1)
        u, (theta, P) = validation.simultaneous(u, h, self.model.inputs), self.parameters_of(state)
        if not np.isfinite(u).all():
            raise InputError("the regressors to come must be known: u has NaN. Assume a value for them")
        pole, R = self.disturbance.pole, float(self.policies[1].R)
        speeds = None if isinstance(self.options["memory"], Drift) else self.drift_of(state)
        nvr = self.disturbance.nvr if speeds is None else float(speeds.nvr[-1])
        ahead = np.arange(h)
        rows = np.column_stack([u, np.ones((h, int(self.model.has_offset))), pole**ahead])
        new = R * nvr * np.concatenate([[0.0], np.cumsum(pole ** (2 * ahead))[:-1]])
        variance = np.einsum("hi,ij,hj->h", rows, P, rows) + self.sigma2(state) * (R + new)
        return rows @ theta, np.sqrt(variance)

    def smooth(self, *args, **options):
        """Return the parameters in hindsight, as `ARX.smooth`; not beside a disturbance."""
        self._refuse_hindsight()
        return super().smooth(*args, **options)

    def tune(self, *args, **options):
        """Return the estimator with the likeliest drift of a record, as `ARX.tune`; not beside a disturbance."""
        self._refuse_hindsight()
        return super().tune(*args, **options)

    def _refuse_hindsight(self):
        if self.disturbance is not None:
            raise InputError("smooth and tune know of no disturbance: make the estimator without disturbance= for them")


def _bare(options) -> dict:
    """Return the options that do not depend on how many parameters there are."""
    return {k: v for k, v in options.items() if k not in ("memory", "theta0", "P0")}


def _checked(disturbance) -> Disturbance | None:
    if disturbance is None:
        return None
    if not isinstance(disturbance, Disturbance):
        raise InputError(f"disturbance must be Disturbance(pole, ratio), got {disturbance!r}")
    if not 0 <= disturbance.pole < 1:
        raise InputError(
            f"pole is the share of a disturbance that remains, from 0 to below 1, got {disturbance.pole!r}"
        )
    validation.positive("ratio", disturbance.ratio)
    return disturbance
