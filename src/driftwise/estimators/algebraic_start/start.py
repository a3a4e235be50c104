"""The start of a recursive filter: its first samples are identified at once, and it goes on from that posterior."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...engine import validation
from ...engine.errors import InputError, refuse_class
from ...engine.status import BAD_VALUE, MISSING_OUTPUT, NOT_STARTED, REJECTED, STARTED
from ...engine.ud import factor_root, unpack_root
from ...memory.constant import Constant
from ...memory.random_walk import RandomWalk
from ...memory.restart_on_change import RestartOnChange
from ...models.canonical import Canonical
from ...models.noise import Unknown
from ...models.scale import KnownScale
from ...results.snapshot import register

EACH = 5  # samples for each unknown, state or parameter, unless said otherwise
LEAST = 40  # and at least so many


@register
class AlgebraicStart(NamedTuple):
    """Identify the first samples at once (`algebraic_identification`), and let the filter go on from there.

    The filter runs as ever while its first samples are kept in its state; with the last of them mean and covariance
    become those of their least squares fit (status `STARTED`, in force from the next sample on). Where they cannot tell
    the parameters, or the errors do not look like noise, the filter keeps its own (`NOT_STARTED`).

    ``samples``: how many, from the first measured output on; 5 for each state and parameter, but at least 40, if None.
    ``hold``: what u does between samples, "zoh" (stay) or "foh" (go straight to the next, which makes a direct term).
    ``zeros``: degree of B in continuous time, order - 1 if None; a lower one that is true halves the errors.
    ``disturbance``: degree of an unknown polynomial in these samples, -1 for none; an input that never changes (a
    column of ones) or an offset is one of degree 0 by itself.

    Worth it under `OutputError`, whose posterior is approximate and needs a good beginning: errors become 3 to 15 times
    smaller. Bad at: plants that no continuous model has (a pole on the negative real axis); `EquationError`, where the
    filter alone is exact already. There the fit is not the best one, and its covariance says so: J+ H H' J+' R, with
    H the colour of the filter's noise on y.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, noise="output", seed=1)
    >>> est = dw.Joint(1, inputs=1, noise=dw.models.OutputError(), start=dw.estimators.AlgebraicStart(60))
    >>> trace = est.scaled_to(y, u).scan(y, u)
    >>> trace.parameters[-1].round(1).tolist()
    [-0.8, 1.0]
    """

    samples: int | None = None
    hold: str = "zoh"
    zeros: int | None = None
    disturbance: int = -1


def resolve_start(start) -> AlgebraicStart | None:
    """Return a checked policy, or None."""
    if start is None:
        return None
    start = AlgebraicStart() if isinstance(start, str) and start == "algebraic" else start
    if not isinstance(start, AlgebraicStart):
        refuse_class("start", start)
        raise InputError(f"start must be None, 'algebraic' or AlgebraicStart(samples, hold), got {start!r}")
    validation.one_of("hold", start.hold, ("zoh", "foh"))
    if start.samples is not None:
        validation.count("samples", start.samples, least=1)
    validation.degree("disturbance", start.disturbance)
    return start


def prepare(est, start, noise, form: Canonical, at, states: int) -> Starting | None:
    """Return what makes the start of an estimator, None without one; refuse what does not fit it.

    ``at`` says where in ``form`` its parameters stand; those beyond them is an offset, a last input that is one.
    """
    start = resolve_start(start)
    if start is None:
        return None
    n, parameters = form.n, est.model.N - est.model.n
    has_offset = parameters > len(at)
    inputs = form.inputs - has_offset
    if isinstance(noise, Unknown):
        raise InputError("a start needs a noise whose polynomial is known: UnknownPolynomial learns its own")
    if not noise.R > 0:
        raise InputError("a start needs noise: with variance 0 the filter is exact after as many samples as unknowns")
    if inputs and form.direct != (start.hold == "foh"):
        has, makes = ("a", "no") if form.direct else ("no", "a")
        raise InputError(
            f"the model has {has} direct term, but hold={start.hold!r} makes {makes} direct term: say "
            f"AlgebraicStart(hold={'foh' if form.direct else 'zoh'!r}) if u does that between samples"
        )
    zeros = n - 1 if start.zeros is None else validation.count("zeros", start.zeros)
    if zeros >= n:
        raise InputError(f"zeros must be below the order, {n}, got {zeros}")
    degree = max(start.disturbance, 0 if has_offset else -1)
    unknowns = 2 * n + inputs * (zeros + 1) + degree + 1
    advised = max(LEAST, EACH * (n + parameters))
    samples = advised if start.samples is None else start.samples
    if samples <= unknowns:
        raise InputError(
            f"a start from {samples} samples cannot tell {unknowns} unknowns (parameters, state, disturbance): give it "
            f"more, such as {advised}"
        )
    select = np.zeros((parameters, form.N - n))
    select[range(len(at)), at] = 1.0
    if has_offset:
        select[-1, n * form.inputs : n * (form.inputs + 1)] = 1.0
        select[-1, n * (form.inputs + 1) + inputs :] = 1.0
    return Starting(
        est, samples, inputs,
        dict(
            form=form, select=select, has_offset=has_offset, states=states, zeros=zeros,
            hold=start.hold if inputs else "zoh",
            disturbance=start.disturbance, dt=est.dt, noise=noise, R=float(noise.R),
            is_known=isinstance(est.scale, KnownScale),
        ),
    )  # fmt: skip


def prepare_equation(est, noise) -> Starting | None:
    """Return the same for a difference equation, where it is that of a sampled continuous plant."""
    equation, options = est.model, est.options
    form, at = equation.canonical()
    if len(at) < form.N - form.n or not equation.na:
        raise InputError(
            "a start needs the equation of a sampled plant: na = n of at least 1, and for each input nb = n, "
            "nk = 1 (hold='zoh') or nb = n + 1, nk = 0 (hold='foh'); "
            f"got na = {equation.na}, nb = {equation.nb}, nk = {equation.nk}"
        )
    if options["method"] != "ls" or not isinstance(options["memory"], Constant | RandomWalk | RestartOnChange):
        raise InputError(
            "a start replaces estimate and covariance, which only method='ls' with memory Constant(), RandomWalk(q) or "
            "RestartOnChange() has no other record of"
        )
    extra = int(equation.has_offset)
    at = np.where(at < form.n * (equation.inputs + 1), at, at + form.n * extra)
    return prepare(est, options["start"], noise, Canonical(form.n, form.inputs + extra, form.direct), at, 0)


class Starting:
    """The compiled loop of an estimator, split where a series has seen enough samples to be started."""

    def __init__(self, est, samples: int, inputs: int, task: dict[str, Any]):
        self.est, self.samples, self.inputs, self.task = est, samples, inputs, task

    @property
    def fields(self) -> list[tuple]:
        """What a state keeps for it, after everything else: how many samples it has, and these samples."""
        return [("begun", "f8"), ("first_y", "f8", (self.samples,)), ("first_u", "f8", (self.samples, self.inputs))]

    def wrap(self, drive):
        """Return ``drive`` with the start in it."""

        def run(rows, ys, us, outs, spec, scratch):
            states = rows.view(self.est.dtype)[:, 0]
            if np.all(states["begun"] >= self.samples):
                return drive(rows, ys, us, outs, spec, scratch)
            ends = [self._end(state["begun"], y[:, 0]) for state, y in zip(states, ys)]
            if min(ends) > ys.shape[1]:  # nobody has enough yet
                drive(rows, ys, us, outs, spec, scratch)
                for state, y, u, out in zip(states, ys, us, outs):
                    self._keep(state, y[:, 0], u, out[:, 3])
                return None
            for i, end in enumerate(ends):
                one, parts = slice(i, i + 1), (slice(end), slice(end, None))
                for part in parts:
                    drive(rows[one], ys[one, part], us[one, part], outs[one, part], spec, scratch)
                    if part.stop is not None and states["begun"][i] < self.samples:
                        self._keep(states[i], ys[i, part, 0], us[i, part], outs[i, part, 3])
                        if states["begun"][i] == self.samples:
                            status = self.begin(states[i])
                            outs[i, end - 1, 3] += status
            return None

        return run

    def _end(self, begun, y) -> int:
        """Return after how many of these samples there are enough; more than there are, if that is later."""
        if begun >= self.samples:
            return 0
        first = 0 if begun else int(np.argmax(np.append(np.isfinite(y), True)))
        return first + self.samples - int(begun)

    def _keep(self, state, y, u, status) -> None:
        """Write samples down, from the first measured one on; one that the filter did not take is missing."""
        begun = int(state["begun"])
        first = 0 if begun else int(np.argmax(np.append(np.isfinite(y), True)))
        y, u, status = y[first:], u[first:], status[first:].astype(int)
        at = slice(begun, begun + len(y))
        state["first_y"][at] = np.where(status & (MISSING_OUTPUT | REJECTED | BAD_VALUE), np.nan, y)
        state["first_u"][at] = u
        state["begun"] = begun + len(y)

    def begin(self, state) -> int:
        """Put the posterior of the kept samples in place of the state's own, if it is worth it; return the status."""
        from .posterior import Task, posterior

        est, n = self.est, self.task["states"]
        prior = unpack_root(est._U0, est._D0)[n:, n:]
        y, u = np.array(state["first_y"]), np.array(state["first_u"])
        state["first_y"], state["first_u"] = 0.0, 0.0  # no more NaN in the state
        start = posterior(Task(self.samples, **self.task), y, u, est._s0[n:], prior)
        if start is None:
            state["status"] += NOT_STARTED
            return NOT_STARTED
        state["x"], state["theta"] = start.mean[:n], start.mean[n:]
        state["D"], state["U"] = factor_root(start.root)
        state["in_a_row"], state["detector_state"] = 0.0, 0.0
        if not isinstance(est.scale, KnownScale):
            # The evidence stays that of the predictions made; chi2 becomes what the samples would have shown.
            before = est.loglik(state)
            state["chi2"] = est.start()["chi2"] + float(state["observed"]) * start.sigma2
            change = 2 * (est.loglik(state) - before)
            state["logdet"] += change if np.isfinite(change) else 0.0
        state["status"] += STARTED
        return STARTED
