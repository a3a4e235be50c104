"""A jump told late: what two filters, as they were some rows ago, say of each moment since (5.15); of one series.

Forward, moment by moment: A is what a shift at the moment still amounts to, so that score and information of the shift
are sums of A' psi e/T and A' psi psi' A/T. (The library goes backwards over the rows.)
"""

import numpy as np
from scipy.special import gammaln, logsumexp

KEPT, ANEW, LOOK, STEP, RATE, RECENT = 48, 16, 8, 4, 1e-3, 12
SIZES = 0.5, 8.0


class Late:
    """The last rows, and the filters as they were before them."""

    def __init__(self, n, learnt, phi):
        self.n, self.learnt, self.phi = n, learnt, np.asarray(phi, float)
        self.told = -np.inf
        self.forget()

    def forget(self):
        self.rows, self.filters, self.pause, self.last = [], {}, 0, -np.inf

    def is_known(self, k, since):
        """Whether a jump found at sample k that began ``since`` samples ago is one that was told late."""
        return k + 1 - self.told < 2 * KEPT + 1 and since + STEP > k + 1 - self.told

    def see(self, k, new, s, row, y, share, q, inverse, most, tried):
        """Log odds, where a jump is told at sample k; ``most``: variances that a jump of one parameter explains.

        ``tried``: log odds of a jump against none that a trial has come to.
        """
        self.rows.append((np.array(row, float), float(y), float(share > 0.5), self.pause))
        self.pause, count, found = 0, len(self.rows), None
        if count % LOOK:
            return None
        first = count // ANEW * ANEW - (KEPT if count % ANEW == 0 else KEPT - ANEW)
        is_likely = most > 10.0 or tried > 3.0 or self.last > -1.0
        self.last = self.weigh(first, np.array(inverse, float)) if first >= ANEW and is_likely else -np.inf
        found = self.last if self.last > np.log(6.0) else None
        if count % ANEW == 0:
            parts = [[float(part[s, m]) for part in (new.w, new.nu, new.chi2)] for m in (0, -1)]
            means = [[np.array(part[s, m], float) for part in (new.theta, new.P)] for m in (0, -1)]
            self.filters[count] = parts, means, np.array(q, float)
        if found is not None:
            self.told = k
            self.forget()
        return found

    def weigh(self, first, inverse):
        """The log odds of a jump, against none and against another level of the noise."""
        (slow, learnt), (one, other), q = self.filters[first]
        jumps, none = [], []
        for (w, *own), mean, drift in ((slow, one, 0 * q), (learnt, other, q)):
            says, moments = self.follow(first, *own, *mean, drift, inverse)
            says += np.log(max(w, RATE))
            none.append(says)
            for at, jump, level in moments:
                jumps += [says + jump] if len(self.rows) - at > RECENT else []
                none.append(says + level)
        says, _ = self.follow(first, *learnt[1:], *other, q + 0.1 * inverse, inverse)
        none.append(says + np.log(RATE))
        return logsumexp(jumps) - logsumexp(none)

    def follow(self, first, nu, chi2, theta, P, drift, inverse):
        """What a filter says of the rows as if nothing had happened, and of each moment: when, jump, level."""
        n, says, total, energy, squares, shares = self.n, 0.0, 0.0, 0.0, [], []
        is_learnt = self.learnt and nu >= 1.0
        s2, shifts = chi2 / nu, []
        for at, (psi, y, share, pause) in enumerate(self.rows[first:], first):
            turn = self.phi**pause
            theta, P = turn * theta, P * np.outer(turn, turn) + pause * np.diag(drift)
            shifts = [(m, turn[:, None] * A, score, known) for m, A, score, known in shifts]
            if at % STEP == 0:
                shifts.append((at, np.eye(n), np.zeros(n), np.zeros((n, n))))
            b = P @ psi
            T = psi @ b + 1.0
            e = y - psi @ theta
            shifts = [
                (m, A - share / T * np.outer(b, psi @ A), v + share * e / T * (psi @ A),
                 known + share / T * np.outer(psi @ A, psi @ A))
                for m, A, v, known in shifts
            ]  # fmt: skip
            theta, P = theta + share * e / T * b, P - share / T * np.outer(b, b)
            says -= 0.5 * share * np.log(T)
            total, energy = total + share, energy + share * e * e / T
            squares.append(share * e * e / T)
            shares.append(share)
        amount, every = nu + total, chi2 + energy
        if is_learnt:
            says += (
                gammaln(amount / 2)
                - gammaln(nu / 2)
                - 0.5 * total * np.log(chi2)
                - amount / 2 * np.log1p(energy / chi2)
            )
        else:
            says -= 0.5 * energy / s2

        def explains(square):
            return -0.5 * amount * np.log1p(-np.minimum(square / every, 0.99)) if is_learnt else 0.5 * square / s2

        moments = []
        for m, _, v, known in shifts:
            jump = logsumexp([self.of_size(explains, v, known, size * inverse) for size in SIZES]) - np.log(len(SIZES))
            level, after, loud = -np.inf, sum(shares[m - first :]), sum(squares[m - first :])
            if is_learnt and after > 1.0:
                before, rest = amount - after, max(every - loud, 0.01 * every)
                level = (
                    gammaln(before / 2) - gammaln(amount / 2) + amount / 2 * np.log(every) - before / 2 * np.log(rest)
                )
                level += np.log(s2) + gammaln(1 + after / 2) - (1 + after / 2) * np.log(2 * s2 + loud) + np.log(2)
            moments.append((m, np.log(RATE * STEP) + jump, np.log(RATE * STEP) + level))
        return says, moments

    def of_size(self, explains, v, known, wide):
        """The log evidence of a jump of one parameter or of all by these variances, of score v and information."""
        narrowed = 1 + wide * np.diag(known)
        jump = logsumexp(explains(v**2 * wide / narrowed) - 0.5 * np.log(narrowed)) - np.log(self.n)
        if self.n > 1:
            G = known + np.diag(1 / wide)
            gain = explains(v @ np.linalg.solve(G, v)) - 0.5 * np.linalg.slogdet(G * wide)[1]
            jump = np.logaddexp(np.log(0.7) + jump, np.log(0.3) + gain)
        return jump
