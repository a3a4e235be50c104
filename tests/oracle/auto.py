"""`AutoMemory` (5.14, 5.15), dense, many series at once; shares no code with the library.

A bank of NVR 0, .1 and one learnt mode, outliers, and on suspicion a trial of its likeliest filter: as it was (or one
parameter jumped), set free, of unknown sigma^2. The learner is recursive maximum likelihood (5.8) of the learnt mode
itself, in units relative to its sigma^2. In extended precision: a prior 5e4 wide eats digits of P - K psi' P, and what
is left must be right to 1e-7.
"""

import numpy as np

from oracle.banks import Run, Units, forecast, mix, moments, outer, predict, start, update, where
from oracle.moments import Moments
from oracle.retrospect import Late
from oracle.second_start import Rows, Second
from oracle.suspicion import Loud, Most, Quiet, Suspicion
from oracle.trial import Trial

SPEEDS = np.array([[0.9997, 5e-5, 2.5e-4], [3e-4, 0.9994, 3e-4], [2e-4, 5e-5, 0.99975]])


def solved(A, g):
    """A^-1 g of every series; LAPACK has no more than doubles."""
    return np.linalg.solve(A.astype(float), g.astype(float)[..., None])[..., 0]


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

    def forget(self, s):
        """Nothing is known of the speeds of this series."""
        self.eta[s], self.J[s], self.cross[s], self.corner[s] = self.eta0, np.eye(self.n) / self.sd**2, 0, self.sd**-2
        self.dtheta[s] = self.dP[s] = 0

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
        eta = np.clip(self.eta + np.clip(solved(solve, g), -1, 1), *self.bounds)
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


def shy(bank, eta):
    """theta, P and sigma^2 of a bank whose mean is weighed by what is at stake."""
    slow, pace, say = bank.w[:, 0], np.exp(eta.mean() / 2), bank.w * 1.0
    say[:, 1:-1] *= 0.05
    say[:, -1] *= 1 - slow / (slow + bank.w[:, -1]) * pace / (0.003 + pace)
    theta = np.einsum("sm,smi->si", say / say.sum(1, keepdims=True), bank.theta)
    off = bank.theta - theta[:, None]
    P = np.einsum("sm,smij->sij", bank.w, bank.s2[..., None, None] * bank.P + outer(off, off))
    return theta, P, np.sum(bank.w * bank.s2, axis=1)


def blend(bank, eta, trial, inverse):
    """theta, P and sigma^2 of what is shown."""
    theta, P, s2 = shy(bank, eta)
    parts = [(1 - trial.shown.sum(), 1 - trial.moved.sum(), theta[0], P[0], s2[0])]
    for k in range(3):
        b = trial.jumped(inverse) if k == 0 and trial.shown[0] > 0 and not trial.told else trial.copies[k]
        if trial.shown[k] > 0:
            parts.append((trial.shown[k], trial.moved[k], b.theta[0, 0], b.P[0, 0] * b.s2[0, 0], b.s2[0, 0]))
    mean = sum(v * m for _, v, m, *_ in parts)
    return (
        mean,
        sum(w * (V + np.outer(m - mean, m - mean)) for w, _, m, V, _ in parts),
        sum(w * s for w, *_, s in parts),
    )


def run_auto(y, psi, phi, told=None, levels=(0.0, 1e-1), expect="both", P0=1e4):
    """Events are (series, sample, kind); `told` is sigma^2 where it is known, P0 relative to it."""
    y, psi, phi, P0 = (np.asarray(x, np.longdouble) for x in (y, psi, phi, P0))
    S, T, n = psi.shape
    learnt, M = told is None, len(levels) + 1
    units, A, learner = Units(S, n), SPEEDS, Learner(S, n, learnt)
    inc, out = start(S, M, n, P0, *((1 - n, 0.0) if learnt else (2.0, 2 * told))), Run.of(S, T, n, M)
    cap, trials, views = 2 * P0, [None] * S, [None] * S  # of a view: mean, P, sigma^2
    seconds, quiet, struck_before = [None] * S, np.zeros(S), np.zeros(S)
    lates = [Late(n, learnt, phi) for _ in range(S)]
    rows, looks, most = [Rows(n) for _ in range(S)], [Moments(n, learnt) for _ in range(S)], [Most() for _ in range(S)]

    def later(s, here):
        """A filter that knows nothing yet."""
        found = Second(here, np.minimum(P0, 1e6 * over[s]), 1 - n if learnt else 2.0)
        found.filter.chi2[:] = 0.0 if learnt else 2 * told
        return found

    sums, shown = [Suspicion(n) for _ in range(S)], inc.s2[:, 0]  # sigma^2 so far
    alm, inverse, struck, counted, clean = np.zeros((S, M, n)), np.zeros((S, n)), np.zeros(S), np.zeros(S), np.zeros(S)
    for k in range(T):
        seen = np.isfinite(y[:, k])
        yk, row = np.where(seen, y[:, k], 0), psi[:, k]
        over, rest = units.see(row, seen)
        for s in np.flatnonzero(seen & (quiet > 0)):  # drift is that of the noise before it was louder
            louder = shown[s] / quiet[s]
            over[s] /= louder if louder >= 1.2 else 1.0
            quiet[s] *= louder >= 1.2
        inverse = np.where(seen[:, None], over, inverse)
        pi = (expect != "jumps") * np.minimum((struck + 0.2) / (counted + 20), 0.25)
        corrected, taken = update(inc, row, yk, learnt, pi[:, None], rest=rest)
        new = where(seen, corrected, inc)
        mean, out.S[:, k] = forecast(inc, row, learnt, heavy=False)
        for s in range(S):
            if views[s] is not None:
                m, V, s2 = views[s]
                mean[s], out.S[s, k] = row[s] @ m, row[s] @ V @ row[s] + s2
        eps = out.eps[:, k] = np.where(seen, yk - mean, np.nan)
        out.evidence[:, k] = taken.evidence

        # the learner follows its mode
        before = learner.dtheta, learner.dP
        step = learner.correct(inc, taken, row)
        learner.dtheta, learner.dP = (np.where(seen.reshape((-1,) + (1,) * (x.ndim - 1)), x, old)
                                      for x, old in zip((learner.dtheta, learner.dP), before))  # fmt: skip
        learner.climb(*step, seen & ~rest & (units.count > 2 * n))

        # the trials
        for s in np.flatnonzero(seen):
            here = moments(inc.at([s]))[0][0] if views[s] is None else views[s][0]
            rho, what, views[s] = float(np.sum(corrected.w[s] * taken.rho[s])), None, None
            if not rest[s] and units.count[s] > 4 * n:
                surprise = eps[s] ** 2 / out.S[s, k]
                suspected = sums[s].see(row[s], eps[s] / np.sqrt(out.S[s, k]), out.S[s, k] / shown[s])
                suspected = suspected or units.count[s] < 100
                most[s].hear(eps[s] ** 2 * shown[s] / out.S[s, k], shown[s])
                if (suspected or surprise >= 9) if trials[s] is None else surprise >= 9 and trials[s].yields(clean[s]):
                    trials[s], struck_before[s] = Trial(inc.at([s]), over[s], surprise, learnt), struck[s]
            is_late, has_calmed = learnt and expect != "jumps" and units.count[s] >= 200 and not rest[s], False
            if is_late and units.count[s] == 200:
                seconds[s] = None
            if is_late and seconds[s] is None and pi[s] > 0.01 and 4 * most[s].says < shown[s]:
                seconds[s] = Quiet(inc.at([s]), most[s].says)
            is_told = trials[s] is not None and trials[s].told
            if is_late and seconds[s] is None and sums[s].energy > 16 and not is_told:
                seconds[s] = Loud(inc.at([s]))
            if is_late and seconds[s] is not None:
                seconds[s].see(row[s], yk[s], pi[s], taken.evidence[s], phi)
                has_calmed = seconds[s].has_won(trials[s], shown[s])
                if has_calmed:
                    is_louder, before = seconds[s].filter.s2[0, 0] > shown[s], quiet[s] if quiet[s] > 0 else shown[s]
                    for name in ("theta", "P", "nu", "chi2"):
                        getattr(new, name)[s] = getattr(seconds[s].filter, name)[0]
                    trials[s], learner.dtheta[s], learner.dP[s], quiet[s] = None, 0, 0, is_louder * before
                    sums[s].calm()
                    if is_louder:
                        slow, fast, what = seconds[s].weight, 0.01 * (M - 2), "noise level"
                        new.w[s] = 0.01
                        new.w[s, 0] = min(slow, 1 - fast - 1e-6)
                        new.w[s, -1] = 1 - new.w[s, 0] - fast
                        out.events.append((int(s), k, what))
                if has_calmed or seconds[s].is_over():
                    seconds[s] = None
            if not rest[s] and units.count[s] < 200:
                rows[s].keep(row[s], yk[s])
            if not rest[s] and 2 * n < units.count[s] < 200:
                is_over, more = seconds[s] is None or seconds[s].is_over(n), rows[s].taken - len(rows[s].y)
                if is_over:
                    seconds[s] = later(s, here)
                begun, is_asked = None, (more == 0 and seconds[s].score <= 0) or (is_over and more > 0)
                if expect != "jumps" and is_asked:
                    begun = rows[s].begin(later(s, here), over[s], learnt)
                elif expect != "jumps" and learnt and more > 0 and more % 5 == 0 and seconds[s].score <= 2.5:
                    own = seconds[s].filter
                    before = min(shown[s], own.s2[0, 0]) if own.nu[0, 0] >= 1 else shown[s]
                    begun = rows[s].begin(later(s, here), over[s], learnt, before)
                    if begun is not None:
                        begun.score = -2.5
                if begun is not None:  # with this row, too, which it has not predicted
                    seconds[s] = begun
                else:
                    seconds[s].see(row[s], yk[s], expect != "jumps", learnt, taken.evidence[s], phi)
                    if seconds[s].has_won(trials[s]):
                        for name in ("theta", "P", "nu", "chi2"):
                            getattr(new, name)[s] = getattr(seconds[s].filter, name)[0]
                        learner.forget(s)
                        trials[s] = seconds[s] = None
            trial = trials[s]
            if trial is not None and not rest[s]:
                own = trial.see(row[s], yk[s], pi[s], over[s], taken.evidence[s])
                known = (expect != "jumps") * min((struck_before[s] + 0.2) / (counted[s] + 20), 0.25)
                what = trial.judge(expect != "outliers", pi[s], known, units.count[s], over[s])
                out.odds[s, k] = trial.odds
                rho = (1 - trial.shown.sum()) * rho + trial.shown @ own
                if what == "jump":
                    is_one = trial.found[0] + trial.alone > trial.found[1]
                    winner = trial.jumped(over[s]) if is_one else trial.copies[1]
                    learner.dtheta[s] = learner.dP[s] = 0
                elif what == "no jump":
                    winner, learner.dtheta[s], learner.dP[s] = trial.copies[0], 0, 0
                elif what:
                    winner = trial.copies[2]
                    level, before = winner.s2[0, 0], quiet[s] if quiet[s] > 0 else trial.before
                    learner.dP[s] *= trial.before / level
                    quiet[s] = before if level > 1.2 * before else 0.0
                    if not quiet[s]:
                        learner.eta[s] = np.clip(learner.eta[s] + np.log(before / level), *learner.bounds)
                if what and seconds[s] is not None:
                    seconds[s].concede(trial)
                if what:
                    struck[s] = struck[s] if what == "no jump" else struck_before[s]
                    for name in ("theta", "P", "nu", "chi2"):
                        getattr(new, name)[s] = getattr(winner, name)[0]
                    new.w[s] = trial.w[0]
                    is_new = what == "jump" and not lates[s].is_known(k, trial.age)
                    if is_new or (what == "noise level" and winner.s2[0, 0] >= trial.before):
                        out.events.append((int(s), k, what))
                elif not trial.is_over() and trial.shown.any():
                    views[s] = blend(new.at([s]), learner.eta[s], trial, over[s])
                if what == "jump":
                    trial.tell(max(trial.found[1], trial.found[0] + trial.alone) + np.log(1e-3 * trial.gap))
                    sums[s].calm()
                elif what or trial.is_over():
                    trials[s] = None
                    sums[s].calm()
                    out.odds[s, k] *= what is not None
            elif trial is not None:  # at rest what was probable stays so
                rho *= 1 - trial.shown.sum()
                out.odds[s, k] = trial.odds
                if trial.shown.any():
                    views[s] = blend(new.at([s]), learner.eta[s], trial, over[s])
            if what or has_calmed:
                looks[s].forget()
            elif expect != "outliers" and units.count[s] > 200 and not rest[s]:
                looks[s].see(inc, new, taken, s, row[s])
                louder = -np.inf if trials[s] is None else trials[s].of_level
                found = looks[s].judge(new, s, over[s], alm[s, -1], louder)
                if found:
                    looks[s].follow(new, s, found)
                    learner.dtheta[s] = learner.dP[s] = 0
                    views[s], what, out.odds[s, k] = None, "jump", found[0]
                    if trials[s] is not None:
                        trials[s].tell(trials[s].beside + found[1])
                    sums[s].calm()
                    if not lates[s].is_known(k, found[-1]):
                        out.events.append((int(s), k, what))
            is_over = what == "jump" or (what and trial is not None and trial.told) or has_calmed
            if is_over or not (rest[s] or (expect != "outliers" and units.count[s] > 250)):
                lates[s].forget()
            elif not rest[s]:
                explained = looks[s].most(new, s, over[s])
                tried = -np.inf if trials[s] is None else trials[s].of_jump
                says = row[s], yk[s], 1 - taken.rho[s, 0]
                late = lates[s].see(k, new, s, *says, alm[s, -1], over[s], explained, tried)
                if late is not None:
                    out.odds[s, k] = late / np.log(100)
                    out.events.append((int(s), k, "jump"))
            if views[s] is None:
                views[s] = tuple(part[0] for part in shy(new.at([s]), learner.eta[s]))
            clean[s] = 0 if rho > 0.5 else clean[s] + 1
            if what is None and rho > 0.5:
                out.events.append((int(s), k, "outlier"))
            if what is None and not rest[s]:
                struck[s], counted[s] = 0.998 * struck[s] + rho, 0.998 * counted[s] + 1
        out.write(k, new)
        for s in range(S):
            if views[s] is not None:
                out.theta[s, k], out.P[s, k] = views[s][0], np.diag(views[s][1])
        now = [out.s2[s, k] if views[s] is None else views[s][2] for s in range(S)]
        shown = np.where(seen, now, shown)

        # predict; a missing row and one at rest are not mixed
        q = np.exp(learner.eta) * inverse
        learner.predict(phi, q, new.P[:, -1], cap)
        alm[:, :-1], alm[:, -1] = np.array(levels)[:, None] * inverse[:, None], q
        mixes = seen & ~rest
        inc = predict(where(mixes, mix(new, A), new), phi, alm, cap, mixes)
        for s in range(S):
            lates[s].pause += 1
            if trials[s] is not None:
                trials[s].predict(phi, alm[s], cap, mixes[s])
            if views[s] is not None:
                m, V, s2 = views[s]
                c = (inc.w[s] * inc.s2[s]) @ alm[s] / (inc.w[s] @ inc.s2[s])
                views[s] = phi * m, V * outer(phi, phi) + s2 * np.diag(c), s2
    return out
