"""A jump of one parameter at some moment, against its walking all the time (5.15), dense; of one series."""

import numpy as np

STEP, KEPT, LONE = 4, 8, 5.0


class Moments:
    """psi e/T and psi^2/T of the filter that never forgets, summed up; every fourth sample they are kept."""

    def __init__(self, n, learnt):
        self.n, self.learnt = n, learnt
        self.forget()

    def forget(self):
        self.count, self.kept = 0, []
        self.sums = np.zeros(3 + 2 * self.n)  # energy, samples, log evidence over the bank's, score, known

    def see(self, bank, new, taken, s, row):
        """The innovation of the filter before it has learnt, and what the weights say of it."""
        part = (1 - taken.rho[s, 0]) / taken.St[s, 0]
        e, over = taken.e[s, 0], np.log(new.w[s, 0] / bank.w[s, 0])
        parts = [part * e * e / taken.s2[s, 0], 1 - taken.rho[s, 0], over]
        self.sums = self.sums + np.concatenate([parts, part * row * e, part * row * row])
        self.count += 1

    def gains(self, square, nu, chi2):
        """Log evidence of a sum of squares that is less by so much."""
        if not self.learnt:
            return 0.5 * square / (chi2 / nu)
        return -0.5 * nu * np.log1p(-np.minimum(square / chi2, 0.99))

    def walked(self, i, q, s2):
        """How much smaller the squares are, and log|I + Q M|, if parameter i walks from the oldest moment on."""
        cuts = [sums for _, sums, _ in self.kept] + [self.sums]
        v, m = (np.diff([cut[3 + at * self.n + i] for cut in cuts]) for at in (0, 1))
        steps = np.arange(1, len(v) + 1)
        Q = STEP * q * np.minimum.outer(steps, steps).astype(float)  # covariance of what it is off by in each block
        G = np.eye(len(v)) + Q * m.astype(float)
        return v.astype(float) @ np.linalg.solve(G, Q @ v.astype(float)), np.linalg.slogdet(G)[1]

    def judge(self, new, s, inverse, q, louder):
        """Log odds over those at which it is told, those over the bank, and who jumped when; None while not.

        ``louder``: log odds of another level of the noise over the bank.
        """
        if self.count % STEP:
            return None
        n, found = self.n, None
        nu, chi2 = new.nu[s, 0], new.chi2[s, 0]
        quiet = [k for k, (w, *_) in enumerate(self.kept) if w[0] >= w[-1]]
        since = [self.sums - self.kept[k][1] for k in quiet]
        if quiet:
            score, known = (np.array([one[3 + at * n : 3 + (at + 1) * n] for one in since]) for at in (0, 1))
            wide = 1 / (known + 1 / (LONE * inverse))
            square = score**2 * wide
            if square.max() > 8 * chi2 / nu:
                found = self.weigh(quiet, since, score, known, wide, square, nu, chi2, inverse, q, louder)
        if found is None:
            self.kept = [*self.kept, (new.w[s].copy(), self.sums, q.copy())][-KEPT:]
        return found

    def most(self, new, s, inverse):
        """How many variances of noise a jump of one parameter at some moment explains, at most."""
        since = [self.sums - sums for _, sums, _ in self.kept]
        sums = np.reshape(since, (-1, 3 + 2 * self.n))
        score, known = sums[:, 3 : 3 + self.n], sums[:, 3 + self.n :]
        return np.max(score**2 / (known + 1 / (LONE * inverse)), initial=0.0) / (new.chi2[s, 0] / new.nu[s, 0])

    def weigh(self, quiet, since, score, known, wide, square, nu, chi2, inverse, q, louder):
        n, prior = self.n, 1e-3 * STEP
        ratios = np.exp(np.minimum(self.gains(square, nu, chi2), 300)) / np.sqrt(1 + LONE * inverse * known)
        each = ratios.mean(1)
        jump, over_bank, none = prior * each.sum(), 0.0, 1.0
        for one, ratio in zip(since, each):
            energy, count, beside = one[:3]
            over_bank += prior * ratio * np.exp(min(beside, 300))
            if self.learnt and count > 1:
                level = 0.5 * (energy - count) - 0.5 * count * np.log(max(energy / count, 0.01)) - 1
                none += prior * np.exp(min(level, 300)) / np.sqrt(count)
        walks = [self.walked(i, self.kept[0][2][i], chi2 / nu) for i in range(n)]
        walk = np.mean([np.exp(min(self.gains(x, nu, chi2), 300) - d / 2) for x, d in walks])
        odds, over = np.log(jump / none) / np.log(100), np.log(min(over_bank, jump / walk))
        if odds <= 1 or over <= max(louder, 0.0):
            return None
        w = ratios / ratios.sum()
        best = quiet[np.unravel_index(np.argmax(ratios), ratios.shape)[0]]
        since = STEP * (len(self.kept) - best)
        return odds, over, w, wide, wide * score, np.sum(w * square), self.kept[best][0], since

    def follow(self, new, s, found):
        """The bank is the filter that never forgets, after the jump."""
        _, _, w, wide, moved, less, weights, _ = found
        s2 = new.chi2[s, 0] / new.nu[s, 0]
        shift = (w * moved).sum(0)
        P = new.P[s, 0] + np.diag((w * (wide + moved**2 / s2)).sum(0)) - np.outer(shift, shift) / s2
        new.theta[s], new.P[s], new.nu[s] = new.theta[s, 0] + shift, P, new.nu[s, 0]
        new.chi2[s] = new.chi2[s, 0] - (min(less, 0.99 * new.chi2[s, 0]) if self.learnt else 0.0)
        new.w[s] = weights
        self.forget()
