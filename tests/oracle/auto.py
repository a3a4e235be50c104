"""`AutoMemory` (5.14, 5.15), dense, many series at once; shares no code with the library.

A bank of NVR 0, .1 and one learnt mode, outliers, and a challenger against a rival. The learner is recursive maximum
likelihood (5.8) of the learnt mode itself, in units relative to its sigma^2.
"""

from dataclasses import dataclass, replace

import numpy as np

from oracle.banks import Bank, Run, Units, forecast, mix, outer, predict, start, staying, update, where


class Learner:
    """Log NVR of each parameter, up the likelihood of one mode (5.8); log sigma^2 is a nuisance that shares."""

    def __init__(self, S, n, learnt=True, memory=300.0, first=1e-2, sd=4.0, tau=2.0, bounds=(1e-6, 10.0)):
        self.n, self.learnt, self.memory, self.sd, self.tau = n, learnt, memory, sd, tau
        self.eta0, self.bounds = np.log(first), np.log(bounds)
        self.eta = np.full((S, n), self.eta0)
        self.J = np.tile(np.eye(n) / sd**2, (S, 1, 1))
        self.cross, self.corner = np.zeros((S, n)), np.full(S, 1 / sd**2)
        self.dtheta, self.dP = np.zeros((S, n, n)), np.zeros((S, n, n, n))

    def correct(self, bank, taken, psi):
        """Sensitivities through the correction (2.3) of the last mode, as far as it takes the sample; its z, dS, de."""
        e, St, part = taken.e[:, -1:], taken.St[:, -1:], 1 - taken.rho[:, -1:]
        K = np.einsum("sij,sj->si", bank.P[:, -1], psi) / St
        v = np.einsum("spij,sj->spi", self.dP, psi)
        dS, de = np.einsum("spi,si->sp", v, psi), -np.einsum("spi,si->sp", self.dtheta, psi)
        K_, part = K[:, None], part[..., None]
        moved = (v - K_ * dS[..., None]) * (e / St)[..., None] + K_ * de[..., None]
        changed = outer(K_, v) + outer(v, K_) - dS[..., None, None] * outer(K_, K_)
        self.dtheta, self.dP = self.dtheta + part * moved, self.dP - part[..., None] * changed
        lost = abs(dS) > 2 * St  # not a part of S any more, since modes were mixed: begin again
        self.dtheta[lost] = self.dP[lost] = dS[lost] = de[lost] = 0
        size = np.sqrt(taken.s2[:, -1:] * St)
        return e / size, dS / St, np.clip(de / size, -10, 10), part[..., 0]

    def climb(self, z, dS, de, part, moves):
        """One step of eta, where it moves."""
        n, keep, sd, tau = self.n, 1 - 1 / self.memory, self.sd, self.tau
        g = -0.5 * part * (dS * (1 - z**2) + 2 * z * de)
        g -= ((self.eta - self.eta0) / sd**2 + (self.eta - self.eta.mean(1, keepdims=True)) / tau**2) / self.memory
        prior = np.eye(n) / sd**2
        J = keep * self.J + prior / self.memory + part[..., None] * (outer(dS, dS) / 2 + outer(de, de))
        cross, corner = keep * self.cross + dS / 2, keep * self.corner + 1 / (sd**2 * self.memory) + 0.5
        solve = J + (np.eye(n) - 1 / n) / tau**2
        if self.learnt:
            solve = solve - outer(cross, cross) / corner[:, None, None]
        eta = np.clip(self.eta + np.clip(np.linalg.solve(solve, g[..., None])[..., 0], -1, 1), *self.bounds)
        for name, new in (("eta", eta), ("J", J), ("cross", cross), ("corner", corner)):
            old = getattr(self, name)
            setattr(self, name, np.where(moves.reshape((-1,) + (1,) * (old.ndim - 1)), new, old))

    def predict(self, phi, q, P=None, cap=np.inf):
        """Through the time update; a variance of the mode, P, that has reached its cap gains nothing."""
        i = np.arange(self.n)
        if P is not None:
            q = np.where(P[:, i, i] < cap, np.minimum(q, cap), 0)
        self.dtheta, self.dP = self.dtheta * phi, self.dP * outer(phi, phi)
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
        cv = replace(cv, chi2=2 * 3 * cv.s2, nu=np.full_like(cv.nu, 2.0))
    return ch, cv


def run_auto(y, psi, phi, told=None, levels=(0.0, 1e-1), expect="both", P0=1e4):
    """Events are (series, sample, kind); `told` is sigma^2 where it is known, P0 relative to it."""
    S, T, n = psi.shape
    learnt, M, pi, ripe = told is None, len(levels) + 1, 0.0 if expect == "jumps" else 0.01, 1 + (expect != "jumps")
    units, A, learner = Units(S, n), staying(M, 0.999), Learner(S, n, learnt)
    inc, out = start(S, M, n, P0, *((1 - n, 0.0) if learnt else (2.0, 2 * told))), Run.of(S, T, n, M)
    prior, cap = np.log(1 / 200), 2 * P0
    trial = Trial(np.zeros(S, bool), inc.at(slice(None)), inc.at(slice(None)), np.zeros(S), np.zeros(S), np.zeros(S))
    alm, inverse, everything = np.zeros((S, M, n)), np.zeros((S, n)), slice(None)
    for k in range(T):
        seen = np.isfinite(y[:, k])
        yk, row = np.where(seen, y[:, k], 0), psi[:, k]
        over, rest = units.see(row, seen)
        inverse = np.where(seen[:, None], over, inverse)

        def correct(bank, rows, row=row, yk=yk, rest=rest):
            return update(bank, row[rows], yk[rows], learnt, pi, rest=rest[rows])

        corrected, taken = correct(inc, everything)
        new, l0 = where(seen, corrected, inc), taken.evidence
        mean, out.S[:, k] = forecast(inc, row, learnt, heavy=False)
        _, variance = forecast(inc, row, learnt)
        eps = out.eps[:, k] = np.where(seen, yk - mean, np.nan)
        out.evidence[:, k] = l0

        # the learner follows its mode
        before = learner.dtheta, learner.dP
        step = learner.correct(inc, taken, row)
        learner.dtheta, learner.dP = (np.where(seen.reshape((-1,) + (1,) * (x.ndim - 1)), x, old)
                                      for x, old in zip((learner.dtheta, learner.dP), before))  # fmt: skip
        learner.climb(*step, seen & ~rest & (units.count > 2 * n))

        # a challenger and a rival
        jumped = louder = np.zeros(S, bool)
        if expect != "outliers":
            fresh = np.flatnonzero(seen & ~trial.on & (eps**2 > 9 * variance) & (units.count > 4 * n))
            ch, cv = challenge(inc.at(fresh), over[fresh], learnt)
            trial.ch.put(fresh, ch)
            trial.cv.put(fresh, cv)
            trial.bj[fresh], trial.bv[fresh], trial.age[fresh] = prior, prior if learnt else -np.inf, 0
            trial.on[fresh] = True
            on = np.flatnonzero(trial.on & seen)
            ch, chs = correct(trial.ch.at(on), on)
            cv, cvs = correct(trial.cv.at(on), on)
            trial.ch.put(on, ch)
            trial.cv.put(on, cv)
            trial.bj[on] += chs.evidence - l0[on]
            trial.bv[on] += cvs.evidence - l0[on]
            trial.age[on] += 1
            bj, bv, age = trial.bj, trial.bv, trial.age
            live = trial.on & seen
            jumped = live & (bj > np.log(5)) & (age >= ripe) & (bj > bv + np.log(3))
            louder = live & ~jumped & (bv > np.log(20)) & (age >= 8) & (bv > bj)
            dropped = live & ~jumped & ~louder & (((bj < -6) & (bv < -6)) | (age >= 16))
            new = where(jumped, trial.ch, where(louder, trial.cv, new))
            trial.on &= ~(jumped | louder | dropped)
            out.odds[:, k] = np.where(trial.on | jumped, np.maximum(bj / np.log(5), 0), 0)
            learner.dtheta[jumped] = learner.dP[jumped] = 0
        struck = seen & ~jumped & ~louder & (np.sum(corrected.w * taken.rho, axis=1) > 0.5)
        for what, which in (("jump", jumped), ("noise level", louder), ("outlier", struck)):
            out.events += [(int(s), k, what) for s in np.flatnonzero(which)]
        out.write(k, new)

        # predict; a missing row and one at rest are not mixed
        q = np.exp(learner.eta) * inverse
        learner.predict(phi, q, new.P[:, -1], cap)
        alm[:, :-1], alm[:, -1] = np.array(levels)[:, None] * inverse[:, None], q

        def go(bank, rows, mixes=seen & ~rest):
            return predict(where(mixes[rows], mix(bank, A), bank), phi, alm[rows], cap, mixes[rows])

        inc = go(new, everything)
        on = np.flatnonzero(trial.on)
        if len(on):
            trial.ch.put(on, go(trial.ch.at(on), on))
            trial.cv.put(on, go(trial.cv.at(on), on))
    return out
