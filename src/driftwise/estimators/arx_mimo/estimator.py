"""ARX with several outputs: one recursive equation for each, side by side on the same lags."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...detect.gate import InnovationGate
from ...engine import ud, validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...models.convert_mimo import ModelMIMO
from ...models.equation import Equations
from ...models.scale import InverseGamma, KnownScale
from ..arx.estimator import Recursive
from ..arx.speeds import read as read_speeds
from ..base import Estimator
from ..common.columns import RECURSIVE_SAMPLE
from ..common.posterior import directions
from ..common.priors import WIDTH, in_order
from ..common.settings import arguments
from . import step as _step  # noqa: F401  (registers the step)
from .row import SEVERAL, Channel, Several, scratch_size


class Part(NamedTuple):
    """What the prior and the memory of one equation need to know of it."""

    N: int
    inputs: int
    n: int = 0
    coloured: bool = False
    constants: int = 0

    @property
    def names(self) -> list[str]:
        """Its numbers: their prior has been put in order."""
        return [str(i) for i in range(self.N)]


class OneOfSeveral(Recursive):
    """Policies, prior and posterior of one equation; its state is that of all (`ARXMIMO._part`)."""

    _shows_mixture = False  # a trace of several outputs has no room for it

    def __init__(self, form, units, options):
        self.options, self._units, self.model = options, units, Part(len(units), len(np.atleast_1d(options["u_scale"])))
        self._prepare(form)

    def _theta_units(self) -> np.ndarray:
        return self._units


class ARXMIMO(Estimator):
    """Parameters of A(q) y = B(q) u + e with several outputs, by recursive least squares, with the memory you choose.

        y_i(t) = -sum_j A_ij(q) y_j(t) + sum_l B_il(q) u_l(t) + offset_i + e_i(t),        i = 1..p

    Each equation has parameters of its own and sees the past only, so least squares falls apart into one recursion for
    each (Soderstrom and Stoica 1989, chapter 7), with its own variance, memory, detector and gate; the lags are shared.
    A missing output skips its own equation, and is predicted where others regress on it; the errors of what was
    predicted are carried, and corrected by what is measured next, as a Kalman filter does. A sample costs O(sum N_i^2).

    Parameters
    ----------
    outputs, inputs : int
        Number of outputs p and of inputs k.
    na : int, (p,) or (p, p)
        Number of past values of y_j in the equation of y_i: ``na[i][j]``; one number for all, or for an equation.
    nb, nk : int, (p,) or (p, k)
        Number of coefficients of input l in the equation of y_i, and its delay in samples; 0 acts at once.
    memory, gate, offset, missing, at_rest, dt : as in `ARX`, for every equation on its own
    variance : float or (p,), optional
        Variance of each e_i; learnt if omitted (Student-t bands).
    scale : InverseGamma, optional
        Prior of each variance.
    theta0, P0 : dictionary, and scalar or dictionary, optional
        Prior mean and covariance by name, such as ``{"a1.11": -0.8}`` and ``{"a1.11": 0.01}``, the latter without links
        between equations (a matrix as a dictionary of dictionaries). What is not named is as by default.
    y_scale, u_scale : float or (p,), float or (k,)
        Typical size of the data, for the default prior; `scaled_to` sets them.

    Raises
    ------
    InputError
        Where a number does not fit; the message says which and why.

    Notes
    -----
    Bad at: outputs that act on others within a sample (`JointMIMO` has a0; here they end in the correlation of e),
    noise on the measurements (biased, as `ARX`), and linked e_i where regressors differ: the bars hold but could be
    shorter (Zellner 1962).

    Examples
    --------
    >>> import driftwise as dw
    >>> truth = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.0]
    >>> y, u = dw.models.simulate_mimo((2, 1), truth, samples=800, inputs=1, noise_std=0.1, seed=1)
    >>> est = dw.ARXMIMO(2, 1, na=[[2, 2], [1, 1]], nb=[2, 1], memory=dw.ExponentialForgetting(0.995))
    >>> trace = est.scaled_to(y, u).scan(y, u)
    >>> [f"{name} {value:.1f}" for name, value in zip(trace.names, trace.parameters[-1])][:4]
    ['a1.11 -1.2', 'a2.11 0.5', 'a1.12 0.0', 'a2.12 -0.1']
    """

    sample_layout = RECURSIVE_SAMPLE
    is_split = True
    link_words = "each equation is right, but the bars of poles and gains leave the link out"

    def __init__(
        self,
        outputs: int,
        inputs: int = 0,
        na=2,
        nb=2,
        nk=1,
        *,
        memory: Any = Constant(),
        gate: InnovationGate | None = None,
        offset: bool = False,
        variance=None,
        scale: InverseGamma | None = None,
        missing: str = "predict",
        at_rest: bool = False,
        theta0=None,
        P0=None,
        y_scale=1.0,
        u_scale=1.0,
        dt: float = 1.0,
    ):
        self.options = arguments(locals())
        p, k = validation.count("outputs", outputs, least=1), validation.count("inputs", inputs)
        tables = (_table("na", na, p, p), _table("nb", nb, p, k), _table("nk", nk, p, k))
        self.model = form = Equations(*tables, validation.yes("offset", offset))
        for i, (a, b) in enumerate(zip(form.na, form.nb)):
            if not any(a + b):
                raise InputError(f"the equation of output {i + 1} has no regressor: na[{i}] and nb[{i}] are all zero")
        self.outputs = p
        self._set_units(dt, y_scale, u_scale)
        self.unknowns, self.groups = form.sizes, [[i] for i in range(p)]
        first = self.parts[0]
        is_reference = scale is None and not isinstance(first.scale, KnownScale)
        self.scale = InverseGamma(0.5, 1e-20) if is_reference else first.scale
        self.spent = np.array(form.sizes, float) * is_reference
        self._s0 = np.concatenate([part._s0 for part in self.parts])
        self._D0 = np.concatenate([part._D0 for part in self.parts])
        self._U0 = np.concatenate([part._U0 for part in self.parts])
        self.prior_covariance = _blocks([part.prior_covariance for part in self.parts])
        shape = self._several()
        self.policies = (shape, *first.policies[1:])
        self.dtype = SEVERAL.dtype(shape)
        self.scratch_size = scratch_size(shape, max(part.scratch_size for part in self.parts))

    # --- settings ------------------------------------------------------------------------------------------

    def _sample_sizes(self) -> tuple[int, ...]:
        return self.model.outputs, 0

    @cached_property
    def parts(self) -> list[Any]:
        """The policies of each equation, each with its part of the prior."""
        form, options, found = self.model, self.options, []
        p, N, at = form.outputs, form.N, form.theta_at
        units = form.units(self.y_scale, self.u_scale)
        theta0, P0 = options["theta0"], options["P0"]
        theta0 = in_order("theta0", theta0, form.names, np.zeros(N), several=p > 1)
        P0 = in_order("P0", P0, form.names, WIDTH * units, several=p > 1)
        theta0 = None if theta0 is None else validation.vector("theta0", theta0, N)
        P0 = None if P0 is None else validation.covariance("P0", P0, N)
        own = np.equal.outer(*2 * [np.repeat(np.arange(p), form.sizes)])
        if P0 is not None and np.any(P0[~own]):
            raise InputError("P0 links parameters of different equations, which are estimated apart: make those zero")
        variance = options["variance"]
        variances = [None] * p if variance is None else validation.sizes("variance", variance, p).tolist()
        for i in range(p):
            mine = slice(at[i], at[i + 1])
            channel = Channel(
                N=0.0, na=0.0, inputs=0.0, deep=0.0, registers=0.0, memory_size=0.0, detector_size=0.0, missing=0.0,
                settle=0.0,
                fill=form.reach(i), offset=float(form.has_offset), mixture_columns=0.0,
                past=np.array(form.na[i], float), nb=np.array(form.nb[i], float), nk=np.array(form.nk[i], float),
            )  # fmt: skip
            given = dict(
                theta0=None if theta0 is None else theta0[mine], P0=None if P0 is None else P0[mine, mine],
                variance=variances[i], y_scale=float(self.y_scale[i]), u_scale=self.u_scale,
            )  # fmt: skip
            found.append(OneOfSeveral(channel, units[mine], {**options, **given}))
        return found

    def _several(self) -> Several:
        """Return the kernel's sizes, with the policies of every equation behind one another."""
        form, specs = self.model, [part.spec for part in self.parts]
        channels = [part.policies[0] for part in self.parts]

        def ends(sizes):
            return np.cumsum([0, *sizes]).astype(float)

        return Several(
            outputs=form.outputs, inputs=form.inputs, past=form.past, deep=form.deep, missing=channels[0].missing,
            theta_at=ends(form.sizes), U_at=ends(N * (N - 1) // 2 for N in form.sizes),
            memory_at=ends(c.memory_size for c in channels), detector_at=ends(c.detector_size for c in channels),
            spec_at=ends(map(len, specs)), spec=np.concatenate(specs),
        )  # fmt: skip

    def _theta_units(self) -> np.ndarray:
        """Return the squared units of theta."""
        return self.model.units(self.y_scale, self.u_scale)

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = super().start(series)
        for i, part in enumerate(self.parts):
            one = part.start()
            state["count"][..., i], state["chi2"][..., i] = one["count"], one["chi2"]
        return state

    # --- reading a state -----------------------------------------------------------------------------------

    def mean(self, state) -> np.ndarray:
        """Return the parameters, in the order of ``names``."""
        return np.array(state["theta"])

    def _part(self, state, i) -> dict[str, np.ndarray]:
        """Return the numbers of equation i, under the names that the state of one output has."""
        shape = self.policies[0]
        tables = dict(
            theta=shape.theta_at,
            D=shape.theta_at,
            U=shape.U_at,
            memory_state=shape.memory_at,
            detector_state=shape.detector_at,
        )
        found = {name: state[name][..., int(at[i]) : int(at[i + 1])] for name, at in tables.items()}
        return found | {
            name: state[name][..., i] for name in ("observed", "count", "chi2", "logdet", "score", "weight")
        }

    def _each(self, state):
        """Return (estimator, state) of each equation."""
        return [(part, self._part(state, i)) for i, part in enumerate(self.parts)]

    def covariance(self, state) -> np.ndarray:
        """Return the covariance of theta(t+1 | t); relative to each output's sigma^2 where that is unknown."""
        return _blocks([ud.unpack(one["U"], one["D"]) for _, one in self._each(state)])

    def sigma2(self, state) -> np.ndarray:
        """Return the estimate of the scale sigma^2 of each output, (p,); 1 where the noise is known.

        Each is relative to y_scale^2; the noises in units of y are ``trace.summary().noise_std``.
        """
        return np.array([part.sigma2(one) for part, one in self._each(state)])

    def scale_posterior(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return (alpha, beta), (p,) each, of the inverse-gamma posterior of sigma^2; infinite where it is known."""
        alpha, beta = np.array([part.scale_posterior(one) for part, one in self._each(state)]).T
        return alpha, beta

    def drift_of(self, state):
        """Return how fast the parameters of each equation drift (`Recursive.drift_of`): a list, one for each output."""
        self._rows(state)
        at = self.model.theta_at
        return [
            read_speeds(part, one, self.names[at[i] : at[i + 1]]) for i, (part, one) in enumerate(self._each(state))
        ]

    def loglik(self, state) -> float:
        """Return log p(y_1..y_t), parameters (and scales) integrated out: the sum over the equations."""
        return sum(part.loglik(one) for part, one in self._each(state))

    def information_ratio(self, state) -> list[tuple[float, np.ndarray]]:
        """Return (ratio, direction) pairs: posterior over prior variance along directions of theta, worst first."""
        return directions(self.covariance(state), np.diag(self.prior_covariance))

    def noise_covariance(self, state) -> np.ndarray:
        """Return the covariance Lambda (p, p) of e: the variances given or learnt, and what links them.

        A link comes from the samples where both outputs were there, a sample with variances T_i, T_j weighing
        1/(T_i T_j); it fades with the memory.
        """
        weights, s = np.array(state["weights"]), np.sqrt(self.sigma2(state))
        r = np.divide(state["products"], weights * s * s[:, None], out=np.zeros_like(weights), where=weights > 0)
        r = r.clip(-1.0, 1.0)
        np.fill_diagonal(r, 1.0)
        std = s * np.sqrt([part.policies[1].R for part in self.parts])
        return r * std * std[:, None]

    def model_of(self, state) -> ModelMIMO:
        """Return the model a state amounts to, with the covariance of its parameters."""
        scaled = [part.sigma2(one) * ud.unpack(one["U"], one["D"]) for part, one in self._each(state)]
        return self.model_at(np.array(state["theta"]), _blocks(scaled))

    def model_at(self, theta, P) -> ModelMIMO:
        """Return the model of a parameter vector and its covariance; offsets are left out."""
        form, at = self._canonical
        return ModelMIMO(form, theta[at], P[np.ix_(at, at)], self.dt)

    @cached_property
    def _canonical(self):
        return self.model.canonical()


def _table(name, value, rows: int, columns: int) -> tuple[tuple[int, ...], ...]:
    """Return orders as rows of whole numbers, from one number, one for each row, or all."""
    value = value.tolist() if isinstance(value, np.ndarray) else value
    lines = list(value) if isinstance(value, list | tuple) else [value] * rows
    found = []
    for line in lines:
        numbers = validation.counts(name, line)
        found.append(numbers if isinstance(line, list | tuple) else numbers * columns)
    if len(found) != rows or any(len(line) != columns for line in found):
        raise InputError(
            f"{name} must be a whole number, {rows} of them (one for each equation), or a table of {rows} rows and "
            f"{columns} columns, got {value!r}"
        )
    return tuple(found)


def _blocks(parts) -> np.ndarray:
    """Return the block diagonal of matrices (..., n_i, n_i)."""
    N = sum(part.shape[-1] for part in parts)
    full, at = np.zeros((*parts[0].shape[:-2], N, N)), 0
    for part in parts:
        end = at + part.shape[-1]
        full[..., at:end, at:end] = part
        at = end
    return full
