"""A trial of `AutoMemory` (5.15), dense, of one series: as it was, set free, of unknown sigma^2."""

import numpy as np
from scipy.special import logsumexp

from oracle.banks import Bank, predict, update


class Trial:
    """Of one series: three filters as banks of one, and the sensitivity F of the first to its own start."""

    def __init__(self, bank, inverse, surprise, learnt):
        n, self.age, is_surprise = len(inverse), 0, surprise >= 9
        self.gap = 1 if is_surprise else 16
        self.leader, self.w = int(np.argmax(bank.w[0])), bank.w.copy()
        one = Bank(*(getattr(bank, f)[:, [self.leader]] for f in ("theta", "P", "w", "nu", "chi2")))
        one.w = np.ones((1, 1))
        self.copies, self.before = [one.at([0]) for _ in range(3)], one.s2[0, 0]
        _, free, level = self.copies
        wide = max(16.0, min(surprise, 4e6) / n)
        free.P = free.P + np.diag(wide * inverse)
        if free.nu[0, 0] > 4:
            free.nu[:], free.chi2[:] = 4.0, 4 * self.before
        level.nu[:] = 1.0 if is_surprise else 2.0
        level.chi2[:] = level.nu * self.before * (3 if is_surprise else 1)
        level.P = level.P / (3 if is_surprise else 1)  # relative to that
        self.found = np.array([0.0, np.clip(0.5 * np.log(256 / wide), -1, 0), 0.0])
        self.beside, self.alone, self.which = 0.0, 0.0, 0
        self.F, self.score, self.known = np.eye(n), np.zeros(n), np.zeros(n)
        self.shown = self.moved = np.zeros(3)
        self.learnt, self.told = learnt, False

    @property
    def hope(self):
        best = max(self.found[1], self.found[0] + self.alone, self.found[2]) - self.found[0]
        return best + np.log(1e-3 * self.gap)

    @property
    def of_jump(self):
        """The log odds of a jump against none, if none is told."""
        best = max(self.found[1], self.found[0] + self.alone) - self.found[0]
        return -np.inf if self.told else best + np.log(1e-3 * self.gap)

    def yields(self, clean):
        """Whether a surprise begins another, ``clean`` samples after the last outlier."""
        known = 0.0 if clean >= 2 else max(self.beside - self.found[0], 0.0)
        return not self.told and (self.gap > 1 or self.age >= len(self.F) + 1) and self.hope < -1 + known

    def is_over(self):
        if self.told:
            return self.age >= 100 or max(self.against[0], self.against[2]) < np.log(1e-5)
        if self.age >= 32:
            return self.age >= 100 or self.hope < -1
        return self.age >= len(self.F) + 1 and self.hope < -6

    def see(self, row, y, pi, inverse, evidence):
        """Take a sample in; the probability of an outlier to each."""
        rho = np.zeros(3)
        for k in range(3 if self.learnt else 2):
            b = self.copies[k]
            new, taken = update(b, row[None], np.array([y]), self.learnt, pi)
            rho[k], self.found[k] = taken.rho[0, 0], self.found[k] + taken.evidence[0]
            if k == 0:
                gain, c = (1 - rho[0]) / taken.St[0, 0], row @ self.F
                self.known += gain * c**2
                self.score += gain * c * taken.e[0, 0]
                self.F = self.F - gain * np.outer(b.P[0, 0] @ row, c)
                fits = 0.5 * self.score**2 / (self.known + 1 / (5 * inverse)) / new.s2[0, 0]
                if fits.max() > 0:
                    self.which = int(np.argmax(fits))
                logs = fits - 0.5 * np.log1p(5 * inverse * self.known)
                self.alone = logsumexp(logs) - np.log(len(logs)) if fits.max() > 2 else 0.0
            if k == 2:
                new.P = new.P * b.s2[0, 0] / new.s2[0, 0]
            self.copies[k] = new
        if not self.learnt:
            self.found[2] = -np.inf
        self.age, self.beside = self.age + 1, self.beside + evidence
        return rho

    def judge(self, jumps, pi, known, seen, inverse):
        if self.told:
            return self.reconsider()
        prior, none = np.log(1e-3 * self.gap), self.found[0] - self.beside
        against = self.found - self.beside + [prior + self.alone, prior, prior]
        if not jumps:
            against[:2] = -np.inf
        best, level = max(against[:2]), against[2]
        shy = min(1 / 8, 5e-4 / max(pi, 5e-4))
        if known > 0.01:
            same, free, _ = self.copies
            far = np.mean((free.theta[0, 0] - same.theta[0, 0]) ** 2 / inverse) / same.s2[0, 0]
            shy *= 16 / max(far, 16)
        self.odds = max((best - max(none, level)) / np.log(100 / 8 / shy), 0.0)
        self.weigh(against, shy * min(1.0, 200 * np.mean(np.diag(self.copies[0].P[0, 0]) / inverse)))
        least = -2.0 if seen > 200 else 4.0
        if self.odds > 1 and self.age >= 2 and best > least:
            return "jump"
        if level > max(none + np.log(1000), best + np.log(20)) and self.age >= 8 and level > max(least, 2.0):
            return "noise level"
        return None

    def weigh(self, against, shy):
        top = max(against.max(), 0.0)
        shown = np.exp(against - top)
        total = np.exp(-top) + shown.sum()
        moved = shown.copy()
        moved[:2] *= shy
        every = np.exp(-top) + moved.sum()
        clear = (shown > 0.05 * total) & (against.max() >= -4)
        self.shown, self.moved = np.where(clear, shown / total, 0), np.where(clear, moved / every, 0)

    @property
    def of_level(self):
        """Log odds of another level of the noise against the bank."""
        return self.found[2] + np.log(1e-3 * self.gap) - self.beside

    def tell(self, evidence):
        """The bank is what jumped, with this log evidence: from now on the others are weighed against that."""
        self.beside = evidence
        self.told, self.age, self.found[1], self.shown, self.moved = True, 1, -np.inf, np.zeros(3), np.zeros(3)

    def reconsider(self):
        prior, self.odds = np.log(1e-3 * self.gap), 0.0
        self.against = np.array([self.found[0], -np.inf, self.found[2] + prior]) - self.beside
        self.weigh(self.against, 1.0)
        same, _, level = self.against
        if level > max(same + np.log(1000), np.log(100)):
            return "noise level"
        return "no jump" if same > max(level, np.log(100)) else None

    def jumped(self, inverse):
        """The first copy if its likeliest parameter jumped."""
        v = 1 / (self.known[self.which] + 1 / (5 * inverse[self.which]))
        b, f = self.copies[0].at([0]), self.F[:, self.which]
        b.theta, b.P = b.theta + v * self.score[self.which] * f, b.P + v * np.outer(f, f)
        return b

    def predict(self, phi, alm, cap, mixed):
        for k, b in enumerate(self.copies):
            share = self.before / b.s2[0, 0] if k == 2 else 1.0
            self.copies[k] = predict(b, phi, share * alm[None, [self.leader]], cap, np.array([mixed]))
        self.F = phi[:, None] * self.F
