"""The oracle of a second start: of one series, begun anew among the first samples, from the rows that agree."""

import numpy as np

from oracle.banks import outer, start, update


class Second:
    """Of one series: a filter that begins anew among the first samples, and what it is better by than all others."""

    def __init__(self, mean, wide, nu):
        n = len(mean)
        self.age, self.score, self.struck = 0, 0.0, 0.0
        self.filter = start(1, 1, n, 1.0, nu, 0.0)
        self.filter.theta[0, 0], self.filter.P[0, 0] = mean, np.diag(wide)

    def is_over(self, n):
        return self.score < -14 or (self.age >= n + 40 and self.score <= 2.5)

    def see(self, row, y, outliers, learnt, evidence, phi):
        """Take a sample in; how often there are outliers it counts itself."""
        pi = outliers * min((self.struck + 0.2) / (self.age + 20), 0.25)
        says = row @ self.filter.P[0, 0] @ row + 1 < 100  # in units of the noise: no regressor is new to it
        self.filter, taken = update(self.filter, row[None], np.array([y]), learnt, pi)
        self.struck += taken.rho[0, 0]
        self.filter.theta, self.filter.P = self.filter.theta * phi, self.filter.P * outer(phi, phi)
        self.age += 1
        if says and self.age > len(phi) + 10:
            self.score += min(taken.evidence[0] - evidence, 2.5)

    def concede(self, trial):
        """The bank becomes what a trial has decided, and that predicted better than it did."""
        self.score -= max(trial.found[1], trial.found[0] + trial.alone, trial.found[2]) - trial.beside

    def has_won(self, trial):
        return self.score > 5 and not self.is_explained(trial)

    def is_explained(self, trial):
        """Whether a trial that runs explains as much."""
        return trial is not None and trial.age > 0 and self.score < max(trial.found[1:]) - trial.beside + 5


class Rows:
    """Of one series: the last 3 n + 10 rows, the next in place of the oldest, and which of them agree."""

    def __init__(self, n):
        self.taken, self.psi, self.y = 0, np.zeros((3 * n + 10, n)), np.zeros(3 * n + 10)

    def keep(self, row, y):
        k = self.taken % len(self.y)
        self.psi[k], self.y[k], self.taken = row, y, self.taken + 1

    def agreeing(self, inverse):
        """Least trimmed squares from every third stretch of n + 2 rows, then twice those within four deviations.

        Of the last ones also their variance, which the next four deviations are of.
        """
        B, n = self.psi.shape
        h, best = int(0.55 * B), (np.inf, None)

        def squares(who):
            A = self.psi[who].T @ self.psi[who] + np.diag(1e-6 / inverse.astype(float))
            return (self.y - self.psi @ np.linalg.solve(A, self.psi[who].T @ self.y[who])) ** 2

        for k in range(0, B - n - 1, 3):
            r2 = squares(slice(k, k + n + 2))
            for _ in range(2):
                r2 = squares(r2 <= np.sort(r2)[h - 1])
            best = min(best, (np.sort(r2)[:h].sum(), r2), key=lambda found: found[0])
        r2, limit = best[1], 16 * best[0] / h * B / (B - n) / 0.176
        for _ in range(2):
            r2 = squares(r2 <= limit)
            limit = 16 * r2[r2 <= limit].sum() / max((r2 <= limit).sum() - n, 1)
        return r2 <= limit, limit / 16

    def pay(self, agree, s2, before):
        """Whether what they agree to is worth four logs for each that is left out."""
        kept = agree.sum() - self.psi.shape[1]
        return s2 < before and kept * np.log(before / s2) / 2 > 4 * (~agree).sum()

    def begin(self, second, inverse, learnt, before=None):
        """A filter that begins with those that agree, if some do not; and pay for them, if sigma^2 was this before."""
        agree, s2 = self.agreeing(inverse)
        if before is not None and not self.pay(agree, s2, before):
            return None
        if agree.all() or np.any((self.psi[agree] ** 2).sum(0) < 0.1 * (self.psi**2).sum(0)):
            return None
        for k in np.roll(np.arange(len(agree)), -(self.taken % len(agree))):
            if agree[k]:
                row, y = self.psi[k].astype(np.longdouble)[None], np.array([self.y[k]], np.longdouble)
                second.filter, _ = update(second.filter, row, y, learnt, 0.0)
        second.age, second.struck = self.psi.shape[1] + 10, 0.2 * (~agree).sum()
        return second
