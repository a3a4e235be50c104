"""The start of a grey box: its first samples are fitted at once, from many places of the prior, and it goes on there.

The log likelihood of the kept samples, given the parameters (and the noise, where nobody said it), is that of the same
filter with the parameters held. Candidates drawn from the prior are tried; from the best of them, Fisher scoring climbs
(Gupta and Mehra, 1974): the steps of central differences see the filter's gain change as well. It is done anew when a
quarter, a half and all of the samples are there.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from ...engine import ud, validation
from ...engine.errors import InputError, refuse_class
from ...engine.status import BAD_VALUE, LOST, MISSING_OUTPUT, NOT_READY, NOT_STARTED, REJECTED, STARTED, UNDEFINED
from ...results.snapshot import register
from ..common.given_state import COUNT, SCORE
from .colour import fill, weigh_blocks

LONGER, NARROW = 4, 0.1  # times the samples, where some parameter's deviation is not below this
LEAST, EACH = 128, 32  # samples of a start: at least, and for each unknown
CANDIDATES, CLIMBS, TURNS = 24, 3, 30  # of the prior; the best of them, and steps from each
ASIDE, MET = 1.0, 0.02  # deviations of the prior between points to climb from, and between climbs that are one
SHARES, ENOUGH = (1.0, 0.5, 0.2, 0.05, 0.005), 1e-4  # of a step, that are tried; gain of a step from which one goes on
MISSING = 1e300  # what stands for NaN among the kept samples: a state is all numbers
STEP = 1e-4  # of central differences, in deviations of the prior
NOISE_STD = 1.5  # deviation of what is believed of the logarithm of a noise that nobody said
ALIKE, NEAR = 3.0, 3.0  # another mode: deviations apart, log likelihood within


@register
class BatchStart(NamedTuple):
    """Fit the first samples at once, and let the filter go on from there.

    Where a parameter is then known to no better than a tenth, twice and four times as many are fitted as well, if
    parameters are constant: the filter goes by slopes where the estimate is, and that is not near enough yet.

    ``samples``: how many are kept, from the first measured one on; 32 for each unknown, at least 128, if None. A
    quarter of them are fitted when they are there, then half, then all (status STARTED; NOT_STARTED: no fit found).
    Bad at: first samples in which nothing moves, which cannot tell the parameters.
    """

    samples: int | None = None


def resolve_start(start) -> BatchStart | None:
    """Return a checked policy, or None."""
    if start is None or (isinstance(start, str) and start == "batch"):
        return None if start is None else BatchStart()
    if not isinstance(start, BatchStart):
        refuse_class("start", start)
        raise InputError(f"start must be None, 'batch' or BatchStart(samples), got {start!r}")
    if start.samples is not None:
        validation.count("samples", start.samples, least=8)
    return start


class Fit(NamedTuple):
    """A climb's end: unknowns, their log posterior, the Fisher information with the prior's, states at the end."""

    z: np.ndarray
    value: float
    information: np.ndarray
    rows: np.ndarray

    @property
    def is_peaked(self) -> bool:
        """Whether there is a Gaussian about it: numbers that are none, or lie far from all others, leave none."""
        if not (np.isfinite(self.value) and np.isfinite(self.information).all()):
            return False
        try:
            return bool(np.isfinite(np.linalg.cholesky(self.information)).all())
        except np.linalg.LinAlgError:
            return False


class Starting:
    """The compiled loop of a grey box, stopped where a series has enough samples to be fitted."""

    def __init__(self, est, start: BatchStart):
        unknowns = est.model.N + (0 if est.knows_noise else est.model.outputs)
        self.est = est
        self.samples = max(LEAST, EACH * unknowns) if start.samples is None else start.samples
        self.most = self.samples * (LONGER if est.is_constant else 1)
        steps = [self.samples // 4, self.samples // 2, self.samples, 2 * self.samples, self.most]
        self.tries = sorted({min(max(step, 4), self.most) for step in steps})
        p, k = est.model.outputs, est.model.inputs
        self.fields = [
            ("begun", "f8"), ("fitted_of", "f8"),
            ("first_y", "f8", (self.most, p)), ("first_u", "f8", (self.most, k + 1)),
        ]  # fmt: skip

    def wrap(self, drive):
        """Return ``drive`` with the start in it."""
        p = self.est.model.outputs

        def run(rows, ys, us, outs, spec, scratch):
            states = rows.view(self.est.dtype)[:, 0]
            if np.all(states["begun"] >= self.most):
                return drive(rows, ys, us, outs, spec, scratch)
            T = ys.shape[1]
            for i, state in enumerate(states):
                one, at = slice(i, i + 1), 0
                while at < T:
                    end = min(at + self._left(state, ys[i, at:]), T)
                    part = slice(at, end)
                    drive(rows[one], ys[one, part], us[one, part], outs[one, part], spec, scratch)
                    if state["begun"] < self.most:
                        self._keep(state, ys[i, part], us[i, part], outs[i, part, 3 * p : 4 * p].astype(int))
                        self._mark(state, outs[i, part, 3 * p : 4 * p])
                        if state["begun"] in self.tries and at < end:
                            self.begin(state, outs[i, end - 1])
                    at = end
            return None

        return run

    def _left(self, state, y) -> int:
        """Return how many of these samples there are until the next fit."""
        begun = int(state["begun"])
        if begun >= self.most:
            return len(y)
        first = 0 if begun else int(np.argmax(np.append(np.isfinite(y).any(axis=1), True)))
        return first + next(n for n in self.tries if n > begun) - begun

    def _keep(self, state, y, u, status) -> None:
        """Write samples down, from the first measured one on; one that the filter did not take is missing."""
        begun, k = int(state["begun"]), self.est.model.inputs
        first = 0 if begun else int(np.argmax(np.append(np.isfinite(y).any(axis=1), True)))
        y, u, status = y[first:], u[first:], status[first:]
        if not len(y):
            return
        at = slice(begun, begun + len(y))
        state["first_y"][at] = np.where(status & (MISSING_OUTPUT | REJECTED | BAD_VALUE), MISSING, y)
        state["first_u"][at, :k] = np.where(np.isnan(u[:, :k]), MISSING, u[:, :k])
        steps = np.arange(1 - len(u), 1) * self.est.dt
        state["first_u"][at, k] = u[:, k] if u.shape[1] > k else state["time"] + steps
        state["begun"] = begun + len(y)

    def _mark(self, state, status) -> None:
        """Say of samples before the first fit that nothing is ready, where not even the noise is known."""
        begun = int(state["begun"])
        if not self.est.knows_noise and begun <= self.tries[0]:
            is_there = begun == self.tries[0]
            status[: len(status) - is_there] += NOT_READY
            state["ready"] = float(is_there)
            state["status"] = status[-1, -1]

    def begin(self, state, out) -> None:
        """Put the posterior of the kept samples in place of the state's own, and show it."""
        est, begun, p = self.est, int(state["begun"]), self.est.model.outputs
        y, u = np.array(state["first_y"][:begun]), np.array(state["first_u"][:begun])
        batch = Batch(est, np.where(y == MISSING, np.nan, y), np.where(u == MISSING, np.nan, u))
        fits = batch.fits(np.array(state["fitted"]))
        if fits:
            self._install(state, fits, batch)
            state["fitted_of"] = begun
            first, N = est.n_columns, est.model.N
            out[first : first + N] = est.mean(state)[: max(len(out) - first, 0)]
            out[first + N :] = np.sqrt(np.diag(est.covariance(state)))[: max(len(out) - first - N, 0)]
        is_known = bool(fits) and np.all(self._widths(state) < NARROW)
        if begun == self.most or (begun >= self.samples and is_known):
            self.end(state)
        status = STARTED if fits else NOT_STARTED
        state["status"] += status
        out[3 * p : 4 * p] += status

    def end(self, state) -> None:
        """Let there be no more fits."""
        state["begun"], state["first_y"], state["first_u"] = self.most, 0.0, 0.0

    def _widths(self, state) -> np.ndarray:
        """Return the deviations of the parameters that are estimated on a scale which bends."""
        est = self.est
        std = np.sqrt(np.diag(est.covariance(state)))[est.model.n :]
        return std[[one.kind != "linear" for one in est.formulas.free]]

    def _install(self, state, fits, batch) -> None:
        """Write the best fit into a state: the Gaussian about it, and what is to be said of others."""
        est, best, n, m = self.est, fits[0], batch.n, batch.m
        P = np.linalg.inv(best.information)
        L = np.linalg.cholesky(P[:m, :m])
        steps = 2 * batch.h[:m, None]
        A = (best.rows["x"][1 : 2 * m : 2] - best.rows["x"][2 : 2 * m + 1 : 2]) / steps  # dE[x | theta]/dtheta
        middle = best.rows[0]
        own = ud.unpack_root(middle["U"][: n * (n - 1) // 2], middle["D"][:n])
        root = np.block([[A.T @ L, own], [L, np.zeros((m, n))]])
        state["x"], state["theta"], state["noise"] = middle["x"], best.z[:m], middle["noise"]
        state["D"], state["U"] = ud.factor_root(root)
        state["in_a_row"], state["detector_state"], state["is_new"], state["edge"] = 0.0, 0.0, 1.0, 0.0
        state["bend"] = batch.bending(best, P) / np.sqrt(np.diag(P)[:m])
        if est.policies[0].exact:
            ends = ud.unpack(best.rows["U"], best.rows["D"])[1 : 2 * m + 1, :n, :n]
            state["dP"] = ((ends[::2] - ends[1::2]) / steps[:, None]).reshape(m, n * n)
        self._colour(state, *batch.scores(best, P[:m, :m]))
        state["fitted"] = best.z[:m]
        state["modes"], state["other"], state["other_loglik"] = len(fits), 0.0, 0.0
        if len(fits) > 1:
            state["other"], state["other_loglik"] = fits[1].z[:m], fits[1].value - best.value
        score = best.value + 0.5 * np.linalg.slogdet(P)[1] - np.log(batch.spread).sum()  # Laplace's evidence
        state["score"] = score
        if est.policies[0].fades:
            state["counts"][SCORE], state["chi2"] = -score, state["counts"][COUNT]
        else:
            state["chi2"] = state["observed"]

    def _colour(self, state, nu, w) -> None:
        """Say how white what the fit leaves over is."""
        form = self.est.policies[0]
        if form.colours:
            fill(state, nu, w)
            weigh_blocks(form, SimpleNamespace(**{name: state[name] for name in ("blocks", "wide", "U", "D")}))


class Batch:
    """The kept samples of a grey box, and how likely they are at any parameters (and noise, where it is unknown)."""

    def __init__(self, est, y, u):
        self.bare = est.bare
        self.y, self.u, self.n, self.m = y, u, est.model.n, est.model.N - est.model.n
        self.mean, self.spread = est._s0[self.n :], np.sqrt(np.diag(est.prior_covariance))[self.n :]
        self.noise = None
        if not est.knows_noise:
            self.noise = np.log([_roughness(column) for column in y.T])
            self.mean = np.append(self.mean, self.noise)
            self.spread = np.append(self.spread, np.full(len(self.noise), NOISE_STD))
        self.prior = np.where(np.arange(len(self.mean)) < self.m, self.spread**-2.0, 0.0)  # a noise has a flat one
        self.h, self.size = STEP * self.spread, len(self.mean)

    def run(self, zs) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return states (S,) at the end, log posteriors, innovations and their variances (S, T p), at points (S, q)."""
        bare, (T, p), S = self.bare, self.y.shape, len(zs)
        rows = bare.start(S)
        rows["theta"], rows["D"][:, self.n :] = zs[:, : self.m], 0.0
        if self.noise is not None:
            rows["noise"] = np.exp(np.clip(zs[:, self.m :], -300, 300))
        outs = np.empty((S, T, bare.n_columns))
        numbers = rows.view(float).reshape(S, -1)
        with np.errstate(all="ignore"):
            bare.drive(
                numbers, np.repeat(self.y[None], S, 0), np.repeat(self.u[None], S, 0), outs, bare.spec, bare.scratch()
            )
        is_sound = ~np.any(outs[:, :, 3 * p].astype(int) & (LOST | UNDEFINED), axis=1)
        value = rows["score"] - 0.5 * np.sum(((zs - self.mean) / self.spread)[:, : self.m] ** 2, axis=1)
        value = np.where(is_sound & np.isfinite(value), value, -np.inf)
        at = bare.columns["taken"].start
        e, V = (outs[:, :, at + i * p : at + (i + 1) * p].reshape(S, T * p) for i in (0, 1))
        return rows, value, e, V

    def fits(self, before) -> list[Fit]:
        """Return the best fit, and behind it others that explain the samples almost as well; [] where there is none."""
        rng = np.random.default_rng(0)
        zs = self.mean + self.spread * rng.standard_normal((CANDIDATES, self.size))
        zs[0], zs[1, : self.m] = self.mean, before
        zs, value = self._with_noise(zs)
        chosen = self._spread_out(zs, value)
        found = self._climb(chosen) if len(chosen) else []
        modes: list[Fit] = []
        for fit in sorted((fit for fit in found if fit.is_peaked), key=lambda fit: -fit.value):
            is_near = not modes or fit.value > modes[0].value - NEAR
            if is_near and all(_apart(fit, other, self.m) > ALIKE for other in modes):
                modes.append(fit)
        return modes

    def _spread_out(self, zs, value) -> np.ndarray:
        """Return the best points that lie apart from each other, (CLIMBS or fewer, q)."""
        chosen: list[int] = []
        for i in np.argsort(-value, kind="stable"):
            away = abs(zs[chosen] - zs[i])[:, : self.m] / self.spread[: self.m]
            if np.isfinite(value[i]) and len(chosen) < CLIMBS and np.all(away.max(axis=1, initial=0.0) > ASIDE):
                chosen.append(int(i))
        return zs[chosen]

    def _with_noise(self, zs) -> tuple[np.ndarray, np.ndarray]:
        """Return points and their log posteriors; an unknown noise becomes what the innovations there show."""
        zs = zs.copy()
        _, value, e, V = self.run(zs)
        if self.noise is not None:
            p = len(self.noise)
            ratio = (e * e / V).reshape(len(zs), -1, p)
            is_there = np.isfinite(ratio)
            count = is_there.sum(axis=1)
            ratio = np.where(is_there, ratio, 0.0).sum(axis=1) / np.maximum(count, 1)
            ratio = np.where(np.isfinite(value)[:, None] & (ratio > 0), ratio, 1.0)
            zs[:, self.m :] += 0.5 * np.log(ratio)
            value += 0.5 * np.sum(count * (ratio - 1 - np.log(ratio)), axis=1)  # as if all variances went with it
        return zs, value

    def _climb(self, zs) -> list[Fit]:
        """Return where Fisher scoring from each of these points ends; two that meet go on as one."""
        ended: list[Fit] = []
        before = np.full(len(zs), -np.inf)
        for turn in range(TURNS):
            fits = self._slopes(zs)
            rise = [fit.is_peaked and fit.value > before[i] + ENOUGH for i, (fit, _) in enumerate(fits)]
            still = [i for i, is_rising in enumerate(rise) if is_rising and turn < TURNS - 1]
            ended += [fit for i, (fit, _) in enumerate(fits) if i not in still]
            if not still:
                break
            steps = [_step(fits[i][0].information, fits[i][1], self.spread) for i in still]
            tried, value = self._with_noise(np.array([zs[i] + w * d for i, d in zip(still, steps) for w in SHARES]))
            most = value.reshape(len(still), -1).argmax(axis=1) + len(SHARES) * np.arange(len(still))
            going: list[int] = []
            for i in sorted(range(len(still)), key=lambda i: -fits[still[i]][0].value):
                if all(np.max(abs(tried[most[i]] - tried[most[l]]) / self.spread) > MET for l in going):
                    going.append(i)
            zs, before = tried[most[going]], np.array([fits[still[i]][0].value for i in going])
        return ended

    def _slopes(self, zs) -> list[tuple[Fit, np.ndarray]]:
        """Return a `Fit` at each point, and the gradient of the log posterior."""
        q, h = self.size, self.h
        around = np.concatenate([np.zeros((1, q)), np.stack([np.diag(h), -np.diag(h)], 1).reshape(2 * q, q)])
        rows, value, e, V = self.run((zs[:, None] + around).reshape(-1, q))
        W, found = 2 * q + 1, []
        for i, z in enumerate(zs):
            at = slice(W * i, W * (i + 1))
            v, own, logs = value[at], e[at], np.log(V[at])
            with np.errstate(invalid="ignore"):
                gradient = (v[1::2] - v[2::2]) / (2 * h)
            slopes = (own[1::2] - own[2::2]) / (2 * h[:, None]) * np.exp(-0.5 * logs[0])
            widths = (logs[1::2] - logs[2::2]) / (2 * h[:, None])
            slopes, widths = np.nan_to_num(slopes), np.nan_to_num(widths)
            information = slopes @ slopes.T + 0.5 * widths @ widths.T + np.diag(self.prior)
            found.append((Fit(z.copy(), float(v[0]), information, rows[at].copy()), np.nan_to_num(gradient)))
        return found

    def scores(self, best: Fit, P) -> tuple[np.ndarray, np.ndarray]:
        """Return the white innovations (T, p), and what they weigh in each parameter, (T, p, m): see `colour`."""
        m, p, h = self.m, self.y.shape[1], self.h[: self.m]
        steps = np.pad(np.diag(h), ((0, 0), (0, self.size - m)))
        _, _, e, V = self.run(best.z + np.concatenate([np.zeros((1, self.size)), steps, -steps]))
        psi = (e[m + 1 :] - e[1 : m + 1]) / (2 * h[:, None]) / np.sqrt(V[0])
        w = (P / np.diag(P)[:, None]) @ np.nan_to_num(psi)
        return (e[0] / np.sqrt(V[0])).reshape(-1, p), w.T.reshape(-1, p, m)

    def bending(self, best: Fit, P) -> float:
        """Return how far one deviation along some axis bends the record away from a straight line, in its noise.

        The curvature of Bates and Watts (1980), with the parameters' share of it.
        """
        d = np.linalg.cholesky(P).T
        _, _, e, V = self.run(best.z + np.concatenate([np.zeros((1, self.size)), d, -d]))
        q = self.size
        bent = 0.5 * (e[1 : q + 1] + e[q + 1 :] - 2 * e[0]) / np.sqrt(V[0])
        size = np.sqrt(np.nansum(bent**2, axis=1))
        return float(np.max(np.where(np.isfinite(size), size, 1e6)[: self.m]))


def _step(information, gradient, spread) -> np.ndarray:
    """Return a step of Fisher scoring, at most one deviation of the prior along each axis."""
    step = np.linalg.solve(information, gradient)
    return step / max(np.max(abs(step) / spread), 1.0)


def _apart(a: Fit, b: Fit, m: int) -> float:
    """Return how many deviations of the better one two fits lie apart."""
    difference = (a.z - b.z)[:m]
    P = np.linalg.inv(b.information)[:m, :m]
    return float(np.sqrt(difference @ np.linalg.solve(P, difference)))


def _roughness(y) -> float:
    """Return the deviation of white noise with the same third differences, to begin with."""
    rough = np.diff(y[np.isfinite(y)], 3)
    size = float(np.sqrt(np.mean(rough**2) / 20)) if len(rough) else 0.0
    return size if size > 0 else 1e-6 * max(float(np.nanmax(abs(y), initial=0.0)), 1e-9)
