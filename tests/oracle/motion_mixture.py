"""The mixture of all models of motion along one path, in plain NumPy: what it expects, judges, learns and tells.

Singer (1970), Li and Jilkov (2003): F and Q by Van Loan's exponential, noise of a plot 1 and scaled afterwards.
Salut, Aguilar, Favier and Alengrin (1979), 3.3: the measured differences w make the state (x2, x3 per coordinate, phi)
linear; here with correlated noises in one step. Nothing is shared with the package but its table of constants.
"""

import math

import numpy as np

from driftwise.estimators.track import bank, courses, departure, judging, learning, legs, onset, step, unforeseen
from oracle.motion_courses import Courses
from oracle.motion_members import Circle, Legs, Linear, Pole

TINY = 1e-12  # no evidence is quite nothing


def log_normal(e, v):
    return -0.5 * np.log(2 * np.pi * v) - 0.5 * e * e / v


class Mixture:
    """All members and their weights along one path: plots are expected, and taken in, one at a time."""

    def __init__(self, speed, C, *, forgetting, learning_rate, doubt, noise, tails):
        self.speed, self.C = speed, C
        self.forgetting, self.rate, self.noise, self.tails = forgetting, learning_rate, noise, tails
        self.doubt_of_others = -doubt
        self.seen = 0

    def _enter(self, t, y, R):
        self.seen, self.time, self.first = 1, t, y
        self.shown = 1.0  # plots that have shown how large the noise is
        self.last = self.velocity = np.zeros(self.C)
        self.stated = R
        self.trust = 1.0 if R is None else step.CLAIM
        self.manoeuvre, self.is_told, self.waiting, self.doubt = step.STARTS, False, None, 0.0
        self.refused = None
        self.surprise, self.still, self.grain = np.zeros((3, self.C))
        self.lead, self.courses = 0.0, None
        self.counts = np.array(learning.PRIOR)

    def _start(self, d):
        self.period = self.gap = self.shortest = d
        typical = (0.1 * self.speed * d) ** 2
        self.log = np.log(np.full(self.C, typical) if self.stated is None else self.stated)
        unit = np.exp(self.log)
        self.kalman = [Linear(2, a, q, d, self.speed, unit) for a, q in bank.STRAIGHT]
        self.kalman += [Linear(3, a, q, d, self.speed, unit) for a, q in bank.CURVED]
        self.kalman += [Circle(q, d, self.speed, unit) for q in bank.TURNS if self.C == 2]
        self.kalman += [Legs(self.speed, unit, self.kalman[-1])] if self.C == 2 else []
        self.poles = None
        self.weight = np.full(len(self.kalman) + len(bank.RADII), self.doubt_of_others)
        self.weight[: len(bank.STRAIGHT)] = [-{100.0: 2, 1e3: 1}.get(q, 0) for _, q in bank.STRAIGHT]

    def _weights(self, known):
        weight = self.weight.copy()
        if self.C == 2:  # legs have more while they hold a turn
            weight[len(self.kalman) - 1] += judging.TURNED * self.kalman[-1].share[legs.STRAIGHTS :].sum()
        w = np.where(known, np.exp(weight - weight[known].max()), 0.0)
        return w / w.sum()

    def _expect(self, t, R):
        """Take everything on to a time: what each expects, relative to the first plot, and the mixture."""
        d, C, self.is_early = t - self.time, self.C, self.seen == 1
        if self.is_early:
            self._start(d)
        else:
            before, slow = self.period, max(d, self.gap)
            if self.seen > learning.KNOWN and slow * learning.FASTER < self.shortest:
                self.seen = learning.ANEW
            forgotten = self.shortest * max(slow / self.shortest, 1.0) ** (1 / learning.PACES)
            self.shortest = min(slow, forgotten)
            self.period *= (d / before) ** (1 / min(self.seen, learning.PERIODS))
            for member in self.poles:
                member.rescale(self.period / before)
        self.d, self.ahead = d, d / self.period
        self.unit = np.maximum(np.exp(self.log), self.grain**2 / 12)
        self.g = np.ones(C) if R is None or self.stated is None else np.asarray(R) / self.stated
        told = [m.predict(d, self.period, self.unit, self.g) for m in self.kalman]
        if not self.is_early:
            told += [m.predict(self.ahead, self.last, self.velocity, d, self.unit, self.g) for m in self.poles]
        known = np.arange(len(self.weight)) < len(told)
        mean, S = (np.full((len(self.weight), C), np.nan) for _ in range(2))
        mean[: len(told)], S[: len(told)] = np.array(told).transpose(1, 0, 2)
        first = len(self.kalman)
        if C == 2:
            known[first - 1] = not self.kalman[-1].hides
        known[first:] &= (np.abs(mean[first:] - self.last) < judging.MADDEST * self.speed * d).all(axis=1)
        self.known, self.mean, self.S = known, mean, S
        self.w = w = self._weights(known)
        self.m = w[known] @ mean[known]
        apart = mean[known] - self.m
        self.V = np.diag(w[known] @ S[known]) + apart.T @ (w[known][:, None] * apart)

    def _parts(self, y):
        """Return the log density of each scale of the tails, (C, J)."""
        v = np.array(bank.SCALES) * np.diag(self.V)[:, None]
        return np.log(self.counts / self.counts.sum()) + log_normal((y - self.m)[:, None], v)

    def _unforeseen(self):
        """Return the share of what no plot has shown, and by what it is wider than the mixture, (C,)."""
        few = unforeseen.BEFOREHAND
        cells = np.where((self.still > 0) & (self.grain == 0), max(3.8 * self.speed, *self.grain), 0.0)
        share, wider = few / (self.seen + few), (0.1 * self.speed * self.d) ** 2 + cells**2
        if self.seen >= 2 and self._may_leave():
            share, wider = share + departure.OFTEN * (1 - share), wider + (self.speed * self.d) ** 2 / 18
        return share, wider

    def _may_leave(self):
        slow = np.linalg.norm(self.velocity) <= departure.REST * self.speed
        return slow and self.d >= departure.TAKES

    def _density(self, y):
        return np.logaddexp.reduce(self._parts(y), axis=1).sum()

    def _fade(self):
        return 1 - 1 / min(self.tails, learning.YOUNG + self.seen)

    def _departed(self, y):
        """Return the density of a coordinate of a plot if the object left its rest; 0 where it did not."""
        if not self._may_leave() or np.linalg.norm(y - self.last) > self.speed * self.d:
            return 0.0
        left = departure.OFTEN / (2 * self.speed * self.d)
        return left if (left > np.exp(self._parts(y)[:, : bank.WILD]).sum(axis=1)).any() else 0.0

    def _absorb(self, t, y, leaves=False):
        self._watch(y)
        before = self._loudness()
        if leaves:
            self._leave()
        else:
            self._learn_tails(y)
        self._judge(y)
        self._learn(t, y)
        rise = (self._loudness() - before) / self.C
        if rise > onset.LOUDER:  # all were too sure
            self.courses, self.lead = None, -onset.RESTS
        self.shown = min(max(self.shown * np.exp(min(onset.STEADY - rise, 0)), 1) + 1, self.seen)

    @staticmethod
    def _needed(T):
        odds = min(onset.ODDS * math.sqrt(max(onset.PATIENCE / T, 1)), onset.MOST_ODDS)
        return odds / (1 + odds)

    def _loudness(self):
        w = self.w[: bank.KALMAN] / self.w[: bank.KALMAN].sum()
        return np.sum(self.log + w @ np.log([m.scale for m in self.kalman[: bank.KALMAN]]))

    def _leave(self):
        """Widen all members by the velocities of the class."""
        vv, own, n = self.speed**2, self.g * self.unit, len(self.kalman)
        for i, m in enumerate(self.kalman):
            mean, S = m.widen(vv, self.d, self.period, self.unit)
            self.mean[i], self.S[i] = mean, S + own * m.scale
            self.known[i] = not (isinstance(m, Legs) and m.hides)
        for i, m in enumerate(self.poles, n):
            m.widen(vv, self.period)
            self.S[i] = m.predict(self.ahead, self.last, self.velocity, self.d, self.unit, self.g)[1]
        w, known = self.w, self.w > 0
        self.m = w[known] @ self.mean[known]
        apart = self.mean[known] - self.m
        self.V = np.diag(w[known] @ self.S[known]) + apart.T @ (w[known][:, None] * apart)

    def _watch(self, y):
        """How likely the target is in a manoeuvre by the courses it may take."""
        w = self.w[: bank.KALMAN] / self.w[: bank.KALMAN].sum()
        r = self.g * self.unit * np.exp(w @ np.log([m.scale for m in self.kalman[: bank.KALMAN]]))
        held = min(self.lead + 1, 0)
        if self.courses is None or held < 0:
            self.lead, self.courses = held, Courses(self.speed / judging.GENTLE, y - self.last, r, self.d)
            return
        self.courses.take(y - self.last, r, self.d, self.period, self.counts, self.shown)
        moves = self.courses.mu[courses.MOVES :].sum()
        others = (1 - moves) * (1 + onset.DOUBTED / self.shown)
        self.lead = moves / (moves + others) if self.seen > onset.SOONEST else 0.0

    def _judge(self, y):
        known, unit, C = self.known, self.unit, self.C
        freedom = np.full((len(known), 1), judging.FREEDOM)
        if C == 2:
            freedom[len(self.kalman) - 1] = legs.FREEDOM
        z2 = (y - self.mean) ** 2 / self.S
        usual, louder = -0.5 * (freedom + 1) * np.log1p(z2 / freedom), judging.LOUDER - 0.5 * np.log(np.maximum(z2, 1))
        usual = np.where(usual < judging.LOUDER, np.maximum(usual, louder), usual)
        score = (usual - 0.5 * np.log(self.S)).sum(axis=1)
        if C == 2:  # some turn explains any plot
            straight = max(score[i] for i, (alpha, _) in enumerate(bank.STRAIGHT) if alpha == 0)
            score[len(self.kalman) - 1] = min(score[len(self.kalman) - 1], straight + judging.LOUDEST)
        score = np.where(known, score, -np.inf)
        likelihood = np.exp(score - score.max())
        likelihood = np.where(known, likelihood, self.w @ likelihood)  # who says nothing is no evidence
        # whether it manoeuvres: the members that see an acceleration beyond the gentle, against those that see none
        least, kalman = self.speed / judging.GENTLE, len(self.kalman)
        sees = np.array([i > 0 and m.acceleration(self.period, unit) > least for i, m in enumerate(self.kalman)])
        w, likelihood = self.w[:kalman], likelihood[:kalman]
        calm = (w @ (likelihood * ~sees) + TINY) / (w @ ~sees + TINY)
        moving = (w @ (likelihood * sees) + TINY * calm) / (w @ sees + TINY)  # no evidence where none sees one
        is_sure = sees & np.array([m.bends(unit) for m in self.kalman])
        lead = (2 * w @ is_sure - w.sum()) / (w.sum() + 2 * TINY)
        before = max(self.manoeuvre, lead)
        before = before * (1 - step.ENDS) + (1 - before) * step.STARTS
        self.manoeuvre = before * moving / (before * moving + (1 - before) * calm)
        self.weight = self.forgetting * self.weight
        of_all = np.log(max(self.w @ np.exp(score - score.max()), 1e-300))  # who is silent goes with all others
        self.weight += self.rate * np.where(known, score - score.max(), of_all)
        self.weight -= self.weight.max()

    def _learn_tails(self, y):
        C = self.C
        if not self.is_early:
            parts = self._parts(y)[:, : bank.WILD]
            found = np.exp(parts - np.logaddexp.reduce(parts, axis=1)[:, None]).sum(axis=0)
            self.counts = self.counts * self._fade() ** C
            self.counts[: bank.WILD] += found
            self.counts = np.maximum(self.counts, learning.LEAST_COUNT * np.array(learning.PRIOR))
            self.counts[bank.WILD] = max(self.counts[bank.WILD], learning.LEAST_WILD)

    def _learn(self, t, y):
        d, ahead, unit, g, S = self.d, self.ahead, self.unit, self.g, self.S
        velocity, early = (y - self.last) / d, self.is_early
        if not early and self.seen <= learning.LEARNT_BY:  # second differences
            e = y - self.last - d * self.velocity
            noise = 1 + (1 + d / self.gap) ** 2 + (d / self.gap) ** 2  # n_k - (1 + h) n_k-1 + h n_k-2
            z = np.maximum(e * e / noise / g, 1e-8 * unit)
            self.log = self.log + (np.log(z) + learning.LOG_MEAN - self.log) / (self.seen - 1 + self.trust)
        pace, most = max(1 / self.noise, 1 / (self.seen + 3)), np.maximum(learning.MOST, self.surprise)

        def grow(z2, scale):
            much = np.where(np.minimum(z2, self.surprise) > learning.LOUD, learning.AT_ONCE, pace)
            calm = (z2 < learning.CALM).all(axis=-1, keepdims=True) & may_ease
            eased = np.where(calm & (scale > learning.TAUGHT), learning.EASED, 1 + (np.minimum(z2, most) - 1) * much)
            return np.ones_like(z2) if early else eased

        may_ease = self.C == 2 and learning.FRESH < self.seen < learning.TRIED
        may_ease = may_ease and (self.surprise < learning.CALM_BEFORE).all()

        scales = np.array([m.scale for m in (*self.kalman, *([] if early else self.poles))])
        scales = np.concatenate([scales, np.ones((len(self.mean) - len(scales), self.C))])
        factors = grow((y - self.mean) ** 2 / S, scales)
        factors[~self.known] = 1.0
        for member, factor in zip(self.kalman, factors):
            member.correct(y, unit, g)
            member.scale = member.scale * (grow(member.z2, member.scale) if isinstance(member, Legs) else factor)
        if early:
            self.poles = [Pole(rho, unit) for rho in bank.RADII]
        else:
            w = (velocity - self.velocity) * self.period
            for member, factor in zip(self.poles, factors[len(self.kalman) :]):
                member.correct(w, ahead, unit, g)
                member.scale = member.scale * factor
        self.surprise = self._surprise(y)
        self.gap, self.velocity, self.last = d, velocity, y
        self.time, self.seen = t, self.seen + 1

    def _surprise(self, y):
        """Return the squared deviations of a plot in the mixture of all but legs, to whom nothing is one."""
        others = self.w * (np.arange(len(self.w)) != len(self.kalman) - 1) if self.C == 2 else self.w
        if not others.sum() > judging.LEAST_REST:
            return (y - self.m) ** 2 / np.diag(self.V)
        w, used = others / others.sum(), others > 0
        m = w[used] @ self.mean[used]
        return (y - m) ** 2 / (w[used] @ (self.S[used] + (self.mean[used] - m) ** 2))

    def _tell(self, found, w):
        known = w[: len(self.kalman)] / w[: len(self.kalman)].sum()
        states = [member.state(self.period, self.unit) for member in self.kalman]
        x = sum(p * s[0] for p, s in zip(known, states))
        V = sum(p * (s[1] + np.outer(s[0] - x, s[0] - x)) for p, s in zip(known, states))
        if self.poles is not None and self.seen > 2:
            share = w[len(self.kalman) :] / w[len(self.kalman) :].sum()
            phi = np.array([member.z[-1] for member in self.poles])
            found["pole"] = share @ phi
            found["pole_sd"] = math.sqrt(share @ [p.P[-1, -1] for p in self.poles] + share @ (phi - share @ phi) ** 2)
        x = x.reshape(self.C, 3)
        x[:, 0] += self.first
        found |= {"state": x, "spread": V, "manoeuvre": self.manoeuvre}
