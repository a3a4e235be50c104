"""AUTO-C of the theory of adaptive noise (5.14), dense, many series at once; shares no code with the library.

A bank with one learnt mode, outliers, and a challenger against a rival; the learner is recursive maximum likelihood
(5.8) with the exact gradient of 2.3.
"""

from dataclasses import dataclass, replace

import numpy as np

from oracle.banks import Bank, Run, Units, forecast, mix, outer, predict, start, staying, update, where


class Learner:
    """Recursive maximum likelihood of (log NVR_1..n, log sigma^2), hierarchical (5.8): the side filter of AUTO-C."""

    def __init__(self, S, n, P0, told, learnt=True, memory=150.0, first=1e-2, sd=4.0, tau=1.5, bounds=(1e-6, 10.0)):
        self.n, self.p, self.learnt, self.told = n, n + learnt, learnt, told
        self.memory, self.sd, self.tau = memory, sd, tau
        self.low, self.high = np.full(self.p, np.log(bounds[0])), np.full(self.p, np.log(bounds[1]))
        self.eta0 = np.full(self.p, np.log(first))
        if learnt:
            self.eta0[n] = np.log(told)
            self.low[n], self.high[n] = self.eta0[n] - 9, self.eta0[n] + 9
        self.eta = np.tile(self.eta0, (S, 1))
        self.J0 = np.eye(self.p) / sd**2
        self.J = np.tile(self.J0, (S, 1, 1))
        self.theta, self.P = np.zeros((S, n)), np.tile(P0 * np.eye(n), (S, 1, 1))
        self.dtheta, self.dP = np.zeros((S, self.p, n)), np.zeros((S, self.p, n, n))

    @property
    def s2(self):
        return np.exp(self.eta[:, self.n]) if self.learnt else np.full(len(self.eta), self.told)

    def q(self, inverse):
        return np.exp(self.eta[:, : self.n]) * self.told * inverse

    def correct(self, k, psi, y, moves, winsor):
        """One filter step with its sensitivities (2.3), then one step of eta where `moves`."""
        n, noise = self.n, np.arange(self.p) == self.n
        Pp = np.einsum("sij,sj->si", self.P, psi)
        s2 = self.s2
        S = np.einsum("si,si->s", Pp, psi) + s2
        e = y - np.einsum("si,si->s", self.theta, psi)
        e = np.clip(e, -winsor * np.sqrt(S), winsor * np.sqrt(S))
        K, r = Pp / S[:, None], (e / S)[:, None]
        v = np.einsum("spij,sj->spi", self.dP, psi)
        dS = np.einsum("spi,si->sp", v, psi) + noise * s2[:, None]
        de = -np.einsum("spi,si->sp", self.dtheta, psi)
        K_ = K[:, None]
        self.theta = self.theta + K * e[:, None]
        self.P = self.P - outer(K, Pp)
        self.P = (self.P + self.P.swapaxes(1, 2)) / 2
        self.dtheta = self.dtheta + (v - K_ * dS[..., None]) * r[..., None] + K_ * de[..., None]
        self.dP = self.dP - outer(K_, v) - outer(v, K_) + dS[..., None, None] * outer(K_, K_)
        if k < 2 * n:
            return
        S = S[:, None]
        g = -0.5 * (dS / S * (1 - e[:, None] ** 2 / S) + 2 * e[:, None] * de / S)
        info = outer(dS / S, dS / S) / 2 + outer(de, de) / S[..., None]
        J = (1 - 1 / self.memory) * self.J + self.J0 / self.memory + info
        g = g - (self.eta - self.eta0) / (self.sd**2 * self.memory)
        g[:, :n] -= (self.eta[:, :n] - self.eta[:, :n].mean(axis=1, keepdims=True)) / (self.tau**2 * self.memory)
        solve = J.copy()
        solve[:, :n, :n] += (np.eye(n) - 1 / n) / self.tau**2
        move = np.clip(np.linalg.solve(solve, g[..., None])[..., 0], -1, 1)
        self.J = np.where(moves[:, None, None], J, self.J)
        self.eta = np.where(moves[:, None], np.clip(self.eta + move, self.low, self.high), self.eta)

    def predict(self, phi, q):
        i = np.arange(self.n)
        turn = outer(phi, phi)
        self.theta, self.P = self.theta * phi, self.P * turn
        self.P[:, i, i] += q
        self.dtheta, self.dP = self.dtheta * phi, self.dP * turn
        self.dP[:, i, i, i] += q


@dataclass
class Trial:
    """At most one per series: a challenger whose parameters jumped, and a rival whose noise variance rose."""

    on: np.ndarray
    ch: Bank
    cv: Bank
    bj: np.ndarray
    bv: np.ndarray
    age: np.ndarray


def challenge(inc, inverse, learnt):
    i = np.arange(inverse.shape[1])
    ch, cv = inc.at(slice(None)), inc.at(slice(None))
    ch.P[..., i, i] += 100 * inverse[:, None]
    if learnt:
        cv = replace(cv, s2=3 * cv.s2, nu=np.full_like(cv.nu, 2.0))
    return ch, cv


def run_auto(
    y, psi, phi, told, levels=(0.0, 1e-4, 1e-2), expect="both", learnt=True, P0=1000.0, guard=True, units=None
):
    """AUTO-C (5.14): the fixed levels and one learnt mode, outliers, challenger and rival, guard at rest."""
    S, T, n = psi.shape
    M, pi = len(levels) + 1, 0.0 if expect == "jumps" else 0.01
    ripe, winsor = (1, np.inf) if expect == "jumps" else (2, 3.0)
    units, A = units or Units(n, guard=guard), staying(M, 0.995)
    inc, out, learner = start(S, M, n, P0, told), Run.of(S, T, n, M), Learner(S, n, P0, told, learnt)
    prior, blank = np.log(1 / 200), start(S, M, n, P0, told)
    trial = Trial(np.zeros(S, bool), blank, blank.at(slice(None)), np.zeros(S), np.zeros(S), np.zeros(S, int))
    alm, inverse = np.zeros((S, M, n)), np.zeros((S, n))
    for k in range(T):
        seen = np.isfinite(y[:, k]) & np.isfinite(psi[:, k]).all(axis=1)
        yk, row = np.where(seen, y[:, k], 0), np.where(seen[:, None], psi[:, k], 0)
        over, rest = units.see(k, row, seen)
        everything = slice(None)

        def correct(bank, rows, row=row, yk=yk, rest=rest):
            return update(bank, row[rows], yk[rows], learnt, pi, rest=rest[rows])

        corrected, l0 = correct(inc, everything)
        new = where(seen, corrected, inc)
        mean, out.S[:, k] = forecast(inc, row, learnt)
        eps = out.eps[:, k] = np.where(seen, yk - mean, np.nan)
        out.evidence[:, k] = l0

        jumped = np.zeros(S, bool)
        if expect != "outliers":
            fresh = np.flatnonzero(seen & ~trial.on & (eps**2 > 9 * out.S[:, k]) & (k > 4 * n))
            ch, cv = challenge(inc.at(fresh), over[fresh], learnt)
            trial.ch.put(fresh, ch)
            trial.cv.put(fresh, cv)
            trial.bj[fresh], trial.bv[fresh], trial.age[fresh] = prior, prior if learnt else -np.inf, 0
            trial.on[fresh] = True
            on = np.flatnonzero(trial.on & seen)
            ch, lj = correct(trial.ch.at(on), on)
            cv, lv = correct(trial.cv.at(on), on)
            trial.ch.put(on, ch)
            trial.cv.put(on, cv)
            trial.bj[on] += lj - l0[on]
            trial.bv[on] += lv - l0[on]
            trial.age[on] += 1
            bj, bv, age = trial.bj, trial.bv, trial.age
            live = trial.on & seen
            jumped = live & (bj > np.log(5)) & (age >= ripe) & (bj > bv + np.log(3))
            louder = live & ~jumped & (bv > np.log(20)) & (age >= 8) & (bv > bj)
            dropped = live & ~jumped & ~louder & (((bj < -6) & (bv < -6)) | (age >= 16))
            new = where(jumped, trial.ch, where(louder, trial.cv, new))
            trial.on &= ~(jumped | louder | dropped)
            for what, which in (("jump", jumped), ("noise level", louder)):
                out.events += [(int(s), k, what) for s in np.flatnonzero(which)]

        theta, P = out.write(k, new)
        learner.correct(k, row, yk, seen & ~rest, winsor)  # a missing row is zero here: nothing moves
        learner.theta[jumped], learner.P[jumped] = theta[jumped], P[jumped]
        learner.dtheta[jumped] = learner.dP[jumped] = 0
        inverse = np.where(seen[:, None], over, inverse)
        q = learner.q(inverse)
        learner.predict(phi, q)
        alm[:, :-1] = np.array(levels)[:, None] * inverse[:, None]
        alm[:, -1] = q / learner.s2[:, None]

        def step(bank, rows, seen=seen):
            return predict(where(seen[rows], mix(bank, A), bank), phi, alm[rows])

        inc = step(new, everything)
        on = np.flatnonzero(trial.on)
        if len(on):
            trial.ch.put(on, step(trial.ch.at(on), on))
            trial.cv.put(on, step(trial.cv.at(on), on))
    return out
