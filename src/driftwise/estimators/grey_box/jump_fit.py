"""One parameter at a time may have jumped: the last samples are filtered anew under each hypothesis.

A state row keeps its last samples, and what was known before them. Every few samples each parameter i is freed, alone,
at each of several instants tau: theta_i gains the variance of a jump there. Their likelihoods, against that of no jump,
say whether something jumped, which, and when. What is known from then on is the mixture of these filters, by mean and
covariance: the other parameters stay what they were.

A jump comes between two samples, nobody knows where: in the middle, and x then has what the rest of the step may make
of it, S_i a g with g uniform within half a step, as noise. Without that, a jump that is large against the noise is told
a second time, where the remainder of its first step has gone into other parameters. Of residuals that are not white,
as `colour` knew them before, log likelihoods count by as much less as variances are larger.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...engine import ud, validation
from ...engine.errors import InputError, refuse_class
from ...engine.status import BAD_VALUE, JUMP, MISSING_OUTPUT, REJECTED
from ...models.scale import KnownScale
from ...results.snapshot import register
from .row import SINCE, STATISTIC, WHICH

KEPT = 256  # samples; what is known is noted at every 128th
EVERY = 16  # samples after which the hypotheses are weighed
REACH = 96  # samples back in which a jump may have been
COARSE, FINE = 12, 3  # samples between the places that are tried, before each about the best is
TURNS = 4  # filters of each hypothesis, each about the jump that the one before found
WITHIN = 3**-0.5  # deviation of an instant that is anywhere within half a step of the middle, in half steps
PROMISING = 1.0  # log odds from which a closer look is taken
SURE = 0.95  # weight from which one parameter is named; until then it is waited for, while the jump is within reach
MISSING = 1e300
WIDE, SIGMA2 = -4, -3  # in a note: the largest factor of the bars for residuals that are not white, and the noise


@register
class JumpFit(NamedTuple):
    """Single parameters jump, by some ``size`` (of the transformed ones: 0.3 is about 30 % of a positive parameter).

    ``odds``: how much likelier than no jump one must be, all parameters and instants together. Bad at: jumps of several
    parameters at once, jumps within the start, drift, and jumps that show only after more than eighty samples.
    """

    size: float = 0.3
    odds: float = 20.0


def resolve_jumps(jumps: Any) -> JumpFit | None:
    """Return a checked policy, or None."""
    if jumps is None or isinstance(jumps, str):
        if jumps not in (None, "fit"):
            raise InputError(f"jumps must be None, 'fit' or JumpFit(size, odds), got {jumps!r}")
        return None if jumps is None else JumpFit()
    if not isinstance(jumps, JumpFit):
        refuse_class("jumps", jumps)
        raise InputError(f"jumps must be None, 'fit' or JumpFit(size, odds), got {jumps!r}")
    return JumpFit(validation.positive("size", jumps.size), validation.positive("odds", jumps.odds))


class Jumping:
    """The compiled loop of a grey box, stopped every few samples to weigh whether a parameter has jumped."""

    def __init__(self, est, jumps: JumpFit):
        self.est, self.jumps = est, jumps
        p, k = est.model.outputs, est.model.inputs
        self._nothing = np.full((1, p), np.nan)
        self.names = ["x", "theta", "D", "U", "held", "noise", "dP"]  # of what is noted
        self.sizes = [np.size(est.bare.start()[name]) for name in self.names]
        self.note_size = sum(self.sizes) + 4
        self.fields = [
            ("kept", "f8"),
            ("kept_y", "f8", (KEPT, p)), ("kept_u", "f8", (KEPT, k + 1)), ("notes", "f8", (2, self.note_size)),
        ]  # fmt: skip

    def wrap(self, drive):
        """Return ``drive`` with the hypotheses in it."""

        def run(rows, ys, us, outs, spec, scratch):
            states = rows.view(self.est.dtype)[:, 0]
            for i, state in enumerate(states):
                self._run(drive, rows[i : i + 1], state, ys[i], us[i], outs[i], spec, scratch)

        return run

    def _run(self, drive, row, state, y, u, out, spec, scratch):
        p, at = self.est.model.outputs, 0
        while at < len(y):
            if state["is_new"] > 0:  # fresh, or put elsewhere by a start
                state["kept"] = 0.0
            kept = int(state["kept"])
            if kept in (0, KEPT // 2):
                state["notes"][int(kept > 0)] = self._note(state)
            part = slice(at, min(at + EVERY - kept % EVERY, len(y)))
            drive(row, y[None, part], u[None, part], out[None, part], spec, scratch)
            self._keep(state, y[part], u[part], out[part, 3 * p : 4 * p].astype(int))
            if state["kept"] % EVERY == 0 and self._is_started(state):
                self._weigh(state, out[part.stop - 1])
            if state["kept"] >= KEPT:
                self._shift(state)
            at = part.stop

    def _is_started(self, state) -> bool:
        """Say whether the samples of a start have been fitted, all of them: before, anything looks like a jump."""
        return self.est.starting is None or state["begun"] >= self.est.starting.samples

    def _note(self, state) -> np.ndarray:
        more = [state["wide"].max(initial=1.0), self.est.sigma2(state), state["time"], state["samples"]]
        return np.concatenate([*(np.ravel(state[name]) for name in self.names), more])

    def _keep(self, state, y, u, status) -> None:
        """Write samples down; one that the filter did not take is missing."""
        k, at = self.est.model.inputs, slice(int(state["kept"]), int(state["kept"]) + len(y))
        state["kept_y"][at] = np.where(status & (MISSING_OUTPUT | REJECTED | BAD_VALUE), MISSING, y)
        state["kept_u"][at, :k] = np.where(np.isnan(u[:, :k]), MISSING, u[:, :k])
        steps = np.arange(1 - len(u), 1) * self.est.dt
        state["kept_u"][at, k] = u[:, k] if u.shape[1] > k else state["time"] + steps
        state["kept"] += len(y)

    def _shift(self, state) -> None:
        """Forget the older half of what is kept."""
        half = KEPT // 2
        for name in ("kept_y", "kept_u"):
            state[name][:half] = state[name][half:].copy()
        state["notes"][0] = state["notes"][1]
        state["kept"] -= half

    # --- hypotheses ----------------------------------------------------------------------------------------

    def _weigh(self, state, out) -> None:
        """Weigh the hypotheses; where a jump wins, go on with the mixture of their filters."""
        kept = int(state["kept"])
        back = np.arange(max(kept - REACH, 1), kept - 1)
        if (found := self._hypotheses(state, back[::COARSE], COARSE, 1)) is None or found[0] < PROMISING:
            return
        if (found := self._hypotheses(state, back[::FINE], FINE, 1)) is None:
            return
        best = back[::FINE][found[1].argmax(axis=1)]  # of each parameter
        near = np.unique(np.clip(best[:, None] + np.arange(1 - FINE, FINE), 1, kept - 1))
        if (found := self._hypotheses(state, near, 1, TURNS)) is None:
            return
        if found[0] < np.log(self.jumps.odds):
            return
        of_each = found[1].sum(axis=1)
        if of_each.max() > SURE or kept - best[np.argmax(of_each)] > REACH - EVERY:
            self._install(state, out, *found)

    def _hypotheses(self, state, taus, step, turns):
        """Return log odds of a jump, the weight of each parameter and instant (m, S), their filters, and instants."""
        est, kept = self.est, int(state["kept"])
        m = est.model.N - est.model.n
        y, u = np.array(state["kept_y"][:kept]), np.array(state["kept_u"][:kept])
        y, u = np.where(y == MISSING, np.nan, y), np.where(u == MISSING, np.nan, u)
        reached, at, gains, filters = self._noted(state["notes"][0]), 0, [], []
        each, size = range(m), self.jumps.size
        for tau in taus.tolist():
            reached, at = self._filter(reached, y[at:tau], u[at:tau]), tau
            begun, spread = self._freed(reached, u[tau - 1 : tau + 1])
            jump = np.zeros(m)
            for _ in range(turns):
                rows = begun.copy()
                rows["theta"][each, each] += jump
                ended = self._filter(self._arrived(rows, u[tau : tau + 1], spread), y[tau:], u[tau:])
                moved = ended["theta"][each, each] - reached["theta"][0]
                # the prior of a jump is about 0, not about where the filter was begun
                off = -0.5 * (moved**2 - (moved - jump) ** 2) / size**2
                with np.errstate(invalid="ignore"):  # what diverged, and is no hypothesis
                    value = (ended["score"][:m] - ended["score"][m] + off) / state["notes"][0][WIDE]
                jump = np.clip(moved, -4 * size, 4 * size)
            gains.append(np.where(np.isfinite(value), value, -np.inf))
            filters.append(ended[:m])
        if not gains or not np.isfinite(most := np.max(gains)):
            return None
        weights = np.exp(np.array(gains).T - most)
        places = m * REACH / step  # of as many hypotheses as there might be
        return most + np.log(weights.sum() / places), weights / weights.sum(), np.array(filters).T, taus

    def _freed(self, reached, u):
        """Return the filter half a sample on, for each parameter with that one freed, and once more as it is.

        And S (m, n): what a jump of one makes of the state in the second half of the step.
        """
        est, size, h = self.est, self.jumps.size, 1e-3 * self.jumps.size
        n, m, k = est.model.n, est.model.N - est.model.n, est.model.inputs
        spread = np.zeros((m, n))
        if est.formulas.is_continuous:
            middle = np.append(u[0, :k], 0.5 * (u[0, k] + u[1, k]))
            reached = self._filter(reached, self._nothing, middle[None])
            rows = np.repeat(reached, 2 * m)
            rows["D"] = 0.0
            rows["theta"] += h * np.vstack([np.eye(m), -np.eye(m)])
            x = self._filter(rows, self._nothing, u[1:])["x"]
            spread = (x[:m] - x[m:]) / (2 * h)
        begun, P = np.repeat(reached, m + 1), ud.unpack(reached["U"][0], reached["D"][0])
        for i in range(m):
            self._spread(begun[i], P, np.eye(n + m)[n + i] * size)
        return begun, spread

    def _arrived(self, rows, u, spread):
        """Return the filters at the sample after, before its outputs: the jump was anywhere within the step."""
        if not self.est.formulas.is_continuous:
            return rows
        rows = self._filter(rows, self._nothing, u)
        for row, own in zip(rows, spread):
            more = np.concatenate([own, np.zeros(len(spread))]) * (self.jumps.size * WITHIN)
            self._spread(row, ud.unpack(row["U"], row["D"]), more)
        return rows

    def _spread(self, row, P, along):
        """Write the covariance P, more uncertain along some direction, into a state."""
        U, row["D"] = ud.factor(P + np.outer(along, along))
        row["U"] = U[ud.packed_indices(len(along))]

    def _noted(self, note):
        """Return the filter as it was noted, noise and covariance with their scale."""
        row = self.est.bare.start(1)
        for name, part in zip(self.names, np.split(note[:-4], np.cumsum(self.sizes)[:-1])):
            row[name] = part.reshape(row[name].shape)
        _, s2, row["time"], row["samples"] = note[-4:]
        row["D"], row["noise"], row["dP"] = row["D"] * s2, row["noise"] * np.sqrt(s2), row["dP"] * s2
        row["score"] = 0.0
        return row

    def _filter(self, rows, y, u):
        """Return rows after these samples."""
        bare, rows = self.est.bare, rows.copy()
        S, T = len(rows), len(y)
        if T:
            outs = np.empty((S, T, bare.n_columns))
            with np.errstate(all="ignore"):
                bare.drive(
                    rows.view(float).reshape(S, -1), np.repeat(y[None], S, 0), np.repeat(u[None], S, 0), outs,
                    bare.spec, bare.scratch(),
                )  # fmt: skip
        return rows

    def _install(self, state, out, odds, weights, filters, taus) -> None:
        """Go on with the mixture's mean and covariance, and tell the jump."""
        est = self.est
        n, N, p, s2 = est.model.n, est.model.N, est.model.outputs, float(state["notes"][0][SIGMA2])
        w, rows = weights.ravel(), filters.ravel()
        live = w > 1e-6
        w, rows = w[live] / w[live].sum(), rows[live]
        means = np.concatenate([rows["x"], rows["theta"]], axis=1)
        mean = w @ means
        P = sum(a * (ud.unpack(row["U"], row["D"]) + np.outer(d, d)) for a, row, d in zip(w, rows, means - mean))
        state["x"], state["theta"] = mean[:n], mean[n:]
        state["dP"] = np.tensordot(w, rows["dP"], 1) / s2
        U, state["D"] = ud.factor(P / s2)
        state["U"] = U[ud.packed_indices(N)]
        if not isinstance(est.scale, KnownScale):
            alpha, beta = est.scale
            state["chi2"] = 2 * ((alpha + 0.5 * state["observed"]) * s2 - beta)
        of_each = weights.sum(axis=1)
        since = state["kept"] - taus[int(np.argmax(weights.sum(axis=0)))]
        state["is_new"], state["kept"] = 1.0, 0.0
        state["counted"], state["blocks"], state["chain"] = 0.0, 0.0, 0.0
        if est.starting is not None:
            est.starting.end(state)
        state["status"] = int(state["status"]) | JUMP
        out[3 * p : 4 * p] = out[3 * p : 4 * p].astype(int) | JUMP
        if len(out) > 4 * p:
            out[4 * p + STATISTIC], out[4 * p + SINCE] = odds, since
            out[4 * p + WHICH] = int(np.argmax(of_each)) if of_each.max() > SURE else -1
        first = est.n_columns
        out[first : first + N] = mean[: max(len(out) - first, 0)]
        out[first + N :] = np.sqrt(np.diag(P))[: max(len(out) - first - N, 0)]
