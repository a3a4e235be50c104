"""Tracks in plain NumPy from the textbook: every model of motion as matrices, the mixture of all, what it tells.

Here: plots that may be wild, and the mixtures that go on side by side while it is not known. Nothing is shared with
the package but its table of constants.
"""

import copy
import math

import numpy as np

from driftwise.estimators.track import bank, onset, output, step
from oracle.motion_mixture import Mixture, log_normal


class Follower(Mixture):
    """The whole estimator: one plot at a time, ``take`` returns by name what it told."""

    def take(self, t, y, R=None):
        """Take a plot with stated variances R; NaN is none, and leaves everything as it was."""
        y = np.asarray(y, float)
        if np.isfinite(y).all():
            return self._take(t, y, R)
        return copy.deepcopy(self)._take(t, None, R) if self.seen else None

    def _take(self, t, y, R):
        """A plot that seems wild waits for the next: two followers, one that believes it, go on side by side."""
        if not self.seen:
            return self._enter(t, y, R)
        doubter, believer, p = copy.deepcopy(self), copy.deepcopy(self), self.doubt
        doubter.waiting = believer.waiting = None
        if self.waiting:
            believer._expect(self.waiting[0], self.waiting[2])
            left = believer._departed(self.waiting[1])
            believer._absorb(self.waiting[0], self.waiting[1], left > 0)
            believer._expect(t, R)
        doubter._expect(t, R)
        best = believer if self.waiting and p <= 0.5 else doubter
        m, V, share = best.m, best.V, min(p, 1 - p)
        if self.waiting:
            rival = doubter if best is believer else believer
            apart = rival.m - m
            m = m + share * apart
            V = (1 - share) * V + share * (rival.V + (1 - share) * np.outer(apart, apart))
        base, shares = np.diag(V), best.counts / best.counts.sum()
        scales = np.array(bank.SCALES)
        rare, wider = best._unforeseen()
        spreading = shares @ np.array(bank.COUNTED)
        found = {"prediction": m + self.first, "base": base, "weights": best.w, "spreading": spreading, "onset": False}
        found["variance"] = (1 - rare) * base * spreading + rare * (base + wider)
        if self.C == 2:
            found["cross"] = V[0, 1] * ((1 - rare) * spreading + rare)
        if y is None:
            best._tell(found, best.w)
            return found
        y = y - self.first
        e, v = y - m, np.column_stack([scales * base[:, None], base + wider])
        shares = np.append((1 - rare) * shares, rare)
        found["log_score"] = np.logaddexp.reduce(np.log(shares) + log_normal(e[:, None], v), axis=1)
        lower = np.array([[0.5 * math.erfc(-a / math.sqrt(2 * b)) for b in row] for a, row in zip(e, v)]) @ shares
        found["lower"] = lower
        chosen, refused = doubter, self.refused
        if self.waiting:
            if best._density(y) + math.log(1 - share) < rival._density(y) + math.log(share):
                best = rival
            chosen = (self.refused and self._lost(t, y, R, best, m, base)) or best
            if chosen is doubter:
                chosen.counts = chosen.counts * chosen._fade() ** self.C
                chosen.counts[bank.WILD] += self.C
                refused = self.waiting
        kept = copy.deepcopy(self)
        part = np.exp(chosen._parts(y))
        far = part[:, scales > 10].sum(axis=1)
        waits = chosen is doubter and self.seen >= step.EARLIEST and np.max(far / part.sum(axis=1)) > 0.5
        if waits:
            kept.counts, kept.waiting, kept.refused = chosen.counts.copy(), (t, y, R), refused
            wild = part[:, bank.WILD]
            if np.linalg.norm(y - chosen.m) > self.speed * (t - self.time):
                far = wild + step.MADE * (far - wild)
            left = chosen._departed(y)
            kept.doubt = np.clip(np.max(wild / (far + left)), 1 - step.SUREST, step.SUREST)
            before = {}
            chosen._tell(before, chosen.w)
        chosen._absorb(t, y, waits and left > 0)
        if not waits:
            chosen.refused = None
            found["onset"] = not chosen.is_told and chosen.lead > self._needed(chosen.period)
            chosen.is_told = found["onset"] or (chosen.is_told and chosen.lead >= onset.OVER_BELOW)
        chosen._tell(found, chosen._weights(chosen.known))
        if waits:
            x, apart = found["state"], (before["state"] - found["state"]).ravel()
            found["state"] = x + kept.doubt * apart.reshape(x.shape)
            inner = before["spread"] + (1 - kept.doubt) * np.outer(apart, apart)
            found["spread"] = (1 - kept.doubt) * found["spread"] + kept.doubt * inner
        if (kept if waits else chosen).seen >= output.KNOWN:
            misses = output.MISSES * np.minimum(np.broadcast_to(chosen.g, self.C), 1.0) * (base + e**2)
            found["spread"] = found["spread"] + np.diag(np.column_stack([misses, np.zeros((self.C, 2))]).ravel())
        self.__dict__ = kept.__dict__ if waits else chosen.__dict__
        return found

    def _lost(self, t, y, R, best, m, base):
        """Return one that went where two plots in a row were refused, if that path is likelier than three accidents."""
        wild = lambda e, v: math.log(step.ANY) - 0.5 * self.C * math.log(np.sum(e**2 + v))  # noqa: E731
        rival, p = [copy.deepcopy(self) for _ in range(2)], self.doubt
        other, path = copy.deepcopy(self), copy.deepcopy(self)
        other.waiting = path.waiting = None
        other._expect(self.waiting[0], self.waiting[2])
        other._absorb(self.waiting[0], self.waiting[1], other._departed(self.waiting[1]) > 0)
        other._expect(t, R)
        alone = copy.deepcopy(self)
        alone._expect(t, R)
        told = np.log(best.counts / best.counts.sum()) + log_normal(
            (y - m)[:, None], np.array(bank.SCALES) * base[:, None]
        )
        all_wild = max(other._density(y) + math.log(1 - p), alone._density(y) + math.log(p)) - math.log(p)
        all_wild = max(all_wild, np.logaddexp.reduce(told, axis=1).sum(), wild(y - m, base))
        for one, (at, place, stated) in zip(rival, ((*self.refused[:2], None), self.waiting)):
            one._expect(at, stated)
            all_wild += max(one._density(place), wild(place - one.m, np.diag(one.V)))
        path._expect(self.refused[0], None)
        total = math.log(step.LOST) - self.C * math.log(2 * self.speed * path.d)
        path._absorb(*self.refused[:2], True)
        path._expect(self.waiting[0], self.waiting[2])
        total += path._density(self.waiting[1])
        path._absorb(*self.waiting[:2])
        gone = copy.deepcopy(path)
        gone._expect(t, R)
        return gone if total + gone._density(y) > all_wild else None
