"""Parameters of a continuous transfer function in closed form, from integrals only, then refined by least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...models.canonical import Canonical
from ...models.continuous import ContinuousModel
from ...models.convert import Model
from ..common.times import instants
from . import discrete, verdict
from .search import Found, find


@dataclass(frozen=True)
class Identification:
    """What a record says about a continuous plant, A(p) y = B(p) u + d.

    ``names`` label the rows of ``values`` and ``covariance``, everything estimated: a, b, the initial state x (that of
    ``model.A``, measured first) and the disturbance's amplitudes q. The deviations are Cramer and Rao's: white noise on
    y, the model taken for true. Amplitudes: q0 + q1 t + q2 t^2/2 + .., then cos and sin of each frequency, from the
    first measured sample on.
    """

    model: ContinuousModel
    closed_form: np.ndarray  # a1..an, b1..bn of each input, from integrals alone
    names: list[str]
    values: np.ndarray
    covariance: np.ndarray
    final_state: np.ndarray  # at the last sample, and the covariance of [it; values]
    final_covariance: np.ndarray
    residual_std: float
    condition: float  # of the refined problem, its columns of length one
    closed_form_condition: float
    unidentified: tuple[str, ...]
    verdict: str
    hold: str

    @property
    def initial_state(self) -> np.ndarray:
        """State at the first measured sample, (n,)."""
        first = self.values.size - self.disturbance.size - self.model.form.n
        return self.values[first : first + self.model.form.n]

    @property
    def disturbance(self) -> np.ndarray:
        """Amplitudes of the disturbance."""
        return self.values[len(self.values) - sum(name.startswith("q") for name in self.names) :]

    def discrete(self, dt: float) -> Model:
        """Return the model at samples ``dt`` apart: Salut's canonical a and b, and b0 where the input is "foh".

        Its covariance is that of the continuous parameters through the exact Jacobian. The covariance is singular where
        sampling makes more parameters than there were (``zeros`` below order - 1, or "foh").
        """
        dt, n, k = validation.size("dt", dt), self.model.form.n, self.model.form.inputs
        form = Canonical(n, k, self.hold == "foh" and k > 0)
        J = discrete.slopes(form, self.model.values, dt, self.hold)
        J = np.where(abs(J).max(axis=0) > 0, J, 0.0)
        with np.errstate(invalid="ignore"):
            covariance = J @ self.model.covariance @ J.T
        return Model(form, discrete.canonical(form, self.model.values, dt, self.hold), covariance, dt)


def algebraic_identification(
    y,
    u=None,
    *,
    order: int,
    zeros: int | None = None,
    dt: float | None = None,
    time=None,
    hold: str | None = None,
    disturbance: int = -1,
    frequencies=(),
    refine: bool = True,
    noise_std: float | None = None,
) -> Identification:
    """Return the continuous model A(p) y = B(p) u + d of a record: no initial guess, no derivative, no filter to tune.

    Multiplying by s^(g+1) prod (s^2 + w^2) and differentiating often enough in s leaves an equation that holds neither
    the initial state nor the disturbance and is linear in the parameters; divided by a power of s it holds nothing but
    iterated integrals of t^i y and t^i u (Fliess and Sira-Ramirez 2003). Least squares over the instants in the
    last three quarters solves it. That answer starts a Gauss-Newton search on the samples themselves, which reaches the
    Cramer-Rao bound.

    Parameters
    ----------
    y : (T,) outputs
        NaN where missing: bridged by a straight line for the integrals, left out of the refinement.
    u : (T,) or (T, k) inputs, complete
    order : int
        Number of poles n.
    zeros : int, optional
        Degree m of B, at most order - 1, which is the default.
    dt, time : float, or (T,) instants
        Seconds between samples, or increasing instants, as irregular as you like.
    hold : "zoh" or "foh"
        What u does between samples: stay, or go straight to the next one. There is no default: the wrong one costs far
        more than the noise (1-3 % of the parameters, for a square wave).
    disturbance : int
        Degree of an unknown polynomial d(t): 0 a constant, 1 a ramp, -1 none.
    frequencies : sequence of float
        rad/s, of sinusoids of unknown amplitude and phase in d(t).
    refine : bool
        Whether to search on from the closed form.
    noise_std : float, optional
        Standard deviation of the noise on y, for the covariance; that of the residuals if omitted.

    Raises
    ------
    InputError
        Where a number does not fit, an input is missing, or there are fewer measured samples than unknowns.

    Notes
    -----
    Bad at: noise that enters the plant (its colour biases the search, and the deviations are too small), records that
    hardly excite it (see ``verdict``), samples so far apart that y is no straight line between them (the closed form
    is then off; the search may still arrive), orders far above the truth. Dead time is not estimated.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> t = 0.01 * np.arange(401)
    >>> u = 1 - 2.0 * (np.arange(401) // 100 % 2)
    >>> y, u = dw.models.simulate_continuous([0.8, 4.0], [0.0, 3.0], time=t, u=u, noise_std=0.01, seed=1)
    >>> found = dw.estimators.algebraic_identification(y, u, order=2, zeros=0, dt=0.01, hold="zoh")
    >>> for name, value, std in zip(found.names[:3], found.values, np.sqrt(np.diag(found.covariance))):
    ...     print(f"{name} {value:.3f} ± {std:.3f}")
    a1 0.798 ± 0.002
    a2 3.997 ± 0.005
    b2 3.002 ± 0.007
    """
    n = validation.count("order", order, least=1)
    t, y, u, hold = _record(y, u, dt, time, hold)
    m = n - 1 if zeros is None else validation.count("zeros", zeros)
    if m >= n:
        raise InputError(f"zeros must be below order = {n}, got {m}: a plant that answers at once has no such model")
    degree, frequencies = validation.degree("disturbance", disturbance), validation.frequencies(frequencies)
    noise = None if noise_std is None else validation.positive("noise_std", noise_std)
    is_measured = np.isfinite(y)
    unknowns = 2 * n + u.shape[1] * (m + 1) + degree + 1 + 2 * len(frequencies)
    if np.count_nonzero(is_measured) <= unknowns:
        raise InputError(
            f"y has {np.count_nonzero(is_measured)} measured samples but there are {unknowns} unknowns (parameters, "
            "initial state, disturbance): a longer record or a lower order is needed"
        )
    first, last = np.flatnonzero(is_measured)[[0, -1]]
    t, y, u = t[first : last + 1], y[first : last + 1], u[first : last + 1]
    return summarise(find(t, y, u, n, m, hold, degree, frequencies, validation.yes("refine", refine)), noise)


def summarise(found: Found, noise: float | None = None) -> Identification:
    """Return a search's result in the user's units and words."""
    plan, n, k = found.plan, found.plan.n, found.plan.u.shape[1]
    form = Canonical(n, k)
    own = [*range(n), *(n * (l + 1) + i for l in range(k) for i in range(n - plan.m - 1, n))]  # those not known zero
    parameters = [form.names[i] for i in own]
    amplitudes = [f"q{i}" for i in range(len(plan.S))]
    names = [*parameters, *(f"x{i + 1}" for i in range(n)), *amplitudes]

    spare = np.count_nonzero(found.is_measured) - len(names)
    error = found.y_unit * np.sqrt(found.fit.rss / spare)
    sigma = (error if noise is None else noise) / found.y_unit
    values = found.units * np.concatenate([found.fit.a, found.fit.linear])
    root = sigma * found.units[:, None] * found.root
    groups = [*parameters, *["the initial state"] * n, *["the disturbance"] * len(amplitudes)]
    hidden = verdict.blind(groups, found.singular, found.directions)
    lost = np.array([name in {g for group in hidden for g in group} for name in groups])
    covariance = _unknown(root @ root.T, lost)

    x, J = found.final()
    x_root = sigma * J @ found.root * found.state_units[:, None]
    both = np.concatenate([x_root, root])
    lost_too = np.concatenate([(abs(J) @ np.where(lost, 1.0, 0.0)) > 0, lost])
    full, full_covariance = np.zeros(form.N - n), np.zeros((form.N - n, form.N - n))
    full[own], full_covariance[np.ix_(own, own)] = values[: len(own)], covariance[: len(own), : len(own)]
    closed = np.concatenate([found.closed[0], found.closed[1].ravel()]) * found.parameter_units
    measured = found.y[found.is_measured]
    said = verdict.words(
        hidden, parameters, values[: len(own)], np.sqrt(np.diag(covariance))[: len(own)],
        found.parameter_units[own], plan.u, error, noise,
        found.y_unit * float(measured.std()),
    )  # fmt: skip
    s = found.singular
    return Identification(
        ContinuousModel(form, full, full_covariance), closed, names, values, covariance,
        x * found.state_units, _unknown(both @ both.T, lost_too), error,
        float(s[0] / s[-1]) if s[-1] > 0 else np.inf, found.closed_condition,
        tuple(name for name, gone in zip(parameters, lost) if gone), said, plan.hold,
    )  # fmt: skip


def _unknown(P, lost) -> np.ndarray:
    """Let what the record cannot see be known not at all."""
    P = np.array(P)
    P[lost] = P[:, lost] = 0.0
    P[lost, lost] = np.inf
    return P


def _record(y, u, dt, time, hold):
    """Return instants, outputs, inputs (T, k) and the hold."""
    y = validation.numbers("y", y)
    k = 0 if u is None else 1 if np.ndim(u) < 2 else np.shape(u)[1]
    y, u = validation.record(y, u, k)
    if np.isnan(u).any():
        raise InputError(
            f"u is NaN at sample {int(np.argwhere(np.isnan(u))[0, 0])}: its effect is integrated, so every value must "
            "be known. Was it held at the last one? Then write that down"
        )
    hold = validation.hold(hold, k)
    if (dt is None) == (time is None):
        raise InputError("give either dt (seconds between samples) or time (their instants), exactly one of them")
    t = validation.size("dt", dt) * np.arange(len(y)) if time is None else instants(time, (len(y),))
    return t, y, u, hold
