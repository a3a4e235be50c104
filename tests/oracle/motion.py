"""Tracks in plain NumPy from the textbook: every model of motion as matrices, the mixture of all, what it tells.

Singer (1970), Li and Jilkov (2003): F and Q by Van Loan's exponential, noise of a plot 1 and scaled afterwards.
Salut, Aguilar, Favier and Alengrin (1979), 3.3: the measured differences w make the state (x2, x3 per coordinate, phi)
linear; here with correlated noises in one step. Nothing is shared with the package but its table of constants.
"""

import copy
import math

import numpy as np
import scipy.linalg
import scipy.stats

from driftwise.estimators.track import bank, circle, departure, judging, learning, legs, pole, step, unforeseen

TINY = 1e-12  # no evidence is quite nothing


def van_loan(A, W, d):
    """Return F and Q of x' = A x + noise of intensity W over d seconds, by halves where much is forgotten."""
    n = len(A)
    if np.max(np.abs(np.diag(A))) * d > 1.0:  # exp(-A d) would take all digits
        F, Q = van_loan(A, W, 0.5 * d)
        return F @ F, F @ Q @ F.T + Q
    E = scipy.linalg.expm(np.block([[-A, W], [np.zeros((n, n)), A.T]]) * d)
    F = E[n:, n:].T
    return F, F @ E[:n, n:]


class Linear:
    """A Kalman filter per coordinate in units of the plots' variance, whose scale follows the innovations."""

    def __init__(self, order, forget, noise, gap, fastest, unit):
        self.order, self.forget, self.noise = order, forget, noise
        C = len(unit)
        self.x, self.scale = np.zeros((C, order)), np.ones(C)
        self.P = np.array([np.diag([1.0, fastest**2 / u, gap**-4.0][:order]) for u in unit])

    def predict(self, d, T, unit, g):
        A = np.diag(np.ones(self.order - 1), 1)
        A[-1, -1] = -self.forget / T
        W = np.zeros_like(A)
        W[-1, -1] = self.noise / T ** (2 * self.order - 1)
        F, Q = van_loan(A, W, d)
        self.x = self.x @ F.T
        self.P = F @ self.P @ F.T + Q
        return self.x[:, 0].copy(), (self.P[:, 0, 0] + g) * unit * self.scale

    def correct(self, y, unit, g):
        for c in range(len(y)):
            K = self.P[c, :, 0] / (self.P[c, 0, 0] + g[c])
            self.x[c] += K * (y[c] - self.x[c, 0])
            left = np.eye(self.order) - np.outer(K, np.eye(self.order)[0])
            self.P[c] = left @ self.P[c] @ left.T + g[c] * np.outer(K, K)

    def widen(self, vv, d, T, unit):
        """Let a velocity of this variance have begun at any time, as likely at each, of the last d seconds."""
        for c, r in enumerate(unit * self.scale):
            self.P[c, :2, :2] += vv / r * np.array([[d * d / 3, d / 2], [d / 2, 1.0]])
        return self.x[:, 0].copy(), self.P[:, 0, 0] * unit * self.scale

    def acceleration(self, T, unit):
        """Return what is expected, or what white noise on the velocity does between two plots."""
        if self.order == 3:
            return math.hypot(*self.x[:, 2])
        return math.sqrt(self.noise * np.max(unit * self.scale)) / T**2

    def bends(self, unit):
        """Return whether the acceleration is beyond twice its standard deviation."""
        return self.order == 3 and np.sum(self.x[:, 2] ** 2) > 4 * np.sum(self.P[:, 2, 2] * unit * self.scale)

    def state(self, T, unit):
        """Return mean and covariance of position, velocity and acceleration of each coordinate."""
        C = len(unit)
        x, V = np.zeros((C, 3)), np.zeros((C, 3, C, 3))
        x[:, : self.order] = self.x
        for c in range(C):
            r = unit[c] * self.scale[c]
            V[c, : self.order, c, : self.order] = self.P[c] * r
            if self.order == 2:
                V[c, 2, c, 2] = self.noise * r / T**4
        return x.ravel(), V.reshape(3 * C, 3 * C)


def turned(z, d):
    """Return (E, vE, N, vN, omega) d seconds on along a circle; z may be complex, for a derivative by a tiny step."""
    E, vE, N, vN, omega = z
    x = omega * d
    s = d * (np.sin(x) / x if abs(x) > 1e-12 else 1.0)
    c = d * (np.sin(x / 2) ** 2 / (x / 2) if abs(x) > 1e-12 else x / 2)
    return np.array(
        [
            E + vE * s + vN * c, vE * np.cos(x) + vN * np.sin(x), N + vN * s - vE * c,
            vN * np.cos(x) - vE * np.sin(x), omega,
        ]
    )  # fmt: skip


class Circle:
    """An extended Kalman filter of a coordinated turn, both coordinates corrected at once."""

    H = np.eye(5)[[0, 2]]

    def __init__(self, noise, gap, fastest, unit):
        self.noise, self.scale, self.x = noise, np.ones(2), np.zeros(5)
        self.P = np.diag([unit[0], fastest**2, unit[1], fastest**2, circle.FIRST / gap**2])

    def predict(self, d, T, unit, g):
        h = 1e-30
        F = np.stack([turned(self.x + 1j * h * e, d).imag / h for e in np.eye(5)], axis=1)
        one = self.noise * np.mean(unit * self.scale) / T**3 * np.array([[d**3 / 3, d**2 / 2], [d**2 / 2, d]])
        self.x = turned(self.x, d)
        self.P = F @ self.P @ F.T + scipy.linalg.block_diag(one, one, circle.RATE * d / T**3)
        self.most = circle.SHARPEST / T
        return self.x[[0, 2]].copy(), np.diag(self.P)[[0, 2]] + g * unit * self.scale

    def correct(self, y, unit, g):
        R = np.diag(g * unit * self.scale)
        K = np.linalg.solve(self.H @ self.P @ self.H.T + R, self.H @ self.P).T
        self.x = self.x + K @ (y - self.x[[0, 2]])
        left = np.eye(5) - K @ self.H
        self.P = left @ self.P @ left.T + K @ R @ K.T
        self.x[4] = np.clip(self.x[4], -self.most, self.most)

    def widen(self, vv, d, T, unit):
        one = vv * np.array([[d * d / 3, d / 2], [d / 2, 1.0]])
        self.P += scipy.linalg.block_diag(one, one, 0.0)
        return self.x[[0, 2]].copy(), np.diag(self.P)[[0, 2]]

    def acceleration(self, T, unit):
        return abs(self.x[4]) * math.hypot(self.x[1], self.x[3])

    def bends(self, unit):
        return self.x[4] ** 2 > 4 * self.P[4, 4]

    def state(self, T, unit):
        E, vE, N, vN, omega = self.x
        J = np.zeros((6, 5))
        J[0, 0] = J[1, 1] = J[3, 2] = J[4, 3] = 1.0
        J[2, 3], J[2, 4], J[5, 1], J[5, 4] = omega, vN, -omega, -vE
        return np.array([E, vE, omega * vN, N, vN, -omega * vE]), J @ self.P @ J.T


class Legs:
    """An interacting multiple model of motions at fixed turn rates: E + iN and its velocity, complex, in each."""

    def __init__(self, fastest, unit, turn):
        n, self.turn = len(bank.LEG_RATES), turn
        self.share, self.scale, self.pi = np.array(bank.LEG_SHARES), np.ones(2), np.array(bank.LEG_SHARES)
        self.x, self.P = np.zeros((n, 2), complex), np.zeros((n, 2, 2), complex)
        self.P[:] = np.diag([np.mean(unit), fastest**2])  # half of E[x x*], which each coordinate has
        self.ends = np.where(np.array(bank.LEG_RATES) == 0.0, legs.CALM, legs.LASTS)

    def predict(self, d, T, unit, g):
        ended = self.share * (1 - (1 - self.ends) ** (d / T))
        stays, new = self.share - ended, self.pi * ended.sum()
        x, P = self.moments(ended / ended.sum())
        before, self.share = (self.x.copy(), self.P.copy()), stays + new
        for j in range(len(new)):  # of those that stay and those that begin
            a = np.array([stays[j], new[j]]) / self.share[j]
            both, their = np.stack([before[0][j], x]), np.stack([before[1][j], P])
            self.x[j] = a @ both
            apart = both - self.x[j]
            self.P[j] = np.einsum("k,kij->ij", a, their + 0.5 * apart[:, :, None] * apart[:, None].conj())
        self.noise = self.intensity(T, unit)
        for j, rate in enumerate(np.array(bank.LEG_RATES) / T):
            turn = np.exp(-1j * rate * d)
            F = np.array([[1.0, (1 - turn) / (1j * rate) if rate else d], [0.0, turn]])
            self.x[j] = F @ self.x[j]
            Q = self.noise[j] * np.array([[d**3 / 3, d**2 / 2], [d**2 / 2, d]])
            self.P[j] = F @ self.P[j] @ F.conj().T + Q
        mean, inner = self.place(T, unit)
        return mean, inner + g * unit * self.scale

    def place(self, T, unit):
        """Return where the mixture is, and each coordinate's variance; say whether anyone could tell a turn."""
        x, _ = self.moments(self.share)
        apart = self.x[:, 0] - x[0]
        inner = self.share @ (self.P[:, 0, 0].real[:, None] + np.stack([apart.real, apart.imag], axis=1) ** 2)
        size2, vague = self.share @ np.abs(self.x[:, 1]) ** 2, self.share @ self.P[:, 1, 1].real * 2
        self.hides = size2 * T**2 <= np.mean(unit * self.scale) or size2 <= legs.KNOWN * vague
        return np.array([x[0].real, x[0].imag]), inner

    def widen(self, vv, d, T, unit):
        self.P += vv * np.array([[d * d / 3, d / 2], [d / 2, 1.0]])
        return self.place(T, unit)

    def moments(self, w):
        """Return mean and half the covariance of a mixture of the legs."""
        x = w @ self.x
        apart = self.x - x
        return x, np.einsum("k,kij->ij", w, self.P + 0.5 * apart[:, :, None] * apart[:, None].conj())

    def intensity(self, T, unit):
        """Return that of the white acceleration of each leg."""
        white = np.array(bank.LEG_NOISES) * np.mean(unit * self.scale) / T**3
        return white + legs.BETWEEN * np.abs(np.array(bank.LEG_RATES) * self.x[:, 1]) ** 2 / T

    def correct(self, y, unit, g):
        R = g * unit * self.scale
        S, e = self.P[:, :1, 0].real + R, y - np.stack([self.x[:, 0].real, self.x[:, 0].imag], axis=1)
        student = scipy.stats.multivariate_t(shape=np.eye(2), df=legs.FREEDOM)
        w = self.share * student.pdf(e / np.sqrt(S)) / np.sqrt(S.prod(axis=1))
        w = np.maximum(w / w.sum(), legs.FAINTEST)
        self.share = w / w.sum()
        self.z2 = self.share @ (e * e / S)
        r = np.mean(R)
        for j in range(len(w)):
            K = self.P[j][:, 0] / (self.P[j, 0, 0] + r)
            self.x[j] += K * (e[j, 0] + 1j * e[j, 1])
            left = np.eye(2) - np.outer(K, [1.0, 0.0])
            self.P[j] = left @ self.P[j] @ left.conj().T + r * np.outer(K, K.conj())

    def accelerations(self, T):
        return -1j * np.array(bank.LEG_RATES) / T * self.x[:, 1]

    def acceleration(self, T, unit):
        """Return that of the mixture; none where it is likelier to go straight on."""
        self.period, a = T, self.accelerations(T)
        mean = self.share @ a
        return abs(mean) if abs(mean) ** 2 > self.share @ np.abs(a - mean) ** 2 else 0.0

    def bends(self, unit):
        a = self.accelerations(self.period)
        mean = self.share @ a
        return abs(mean) ** 2 > 4 * self.share @ np.abs(a - mean) ** 2

    def state(self, T, unit):
        """Return mean and covariance of E, vE, aE, N, vN, aN; the rate is that of the member whose rate walks."""
        rate, x = self.turn.x[4], self.share @ self.x
        x4 = np.array([x[0].real, x[1].real, x[0].imag, x[1].imag])
        V = np.zeros((4, 4))
        for w, z, half in zip(self.share, self.x, self.P):
            e = np.array([z[0].real, z[1].real, z[0].imag, z[1].imag]) - x4
            V += w * (np.block([[half.real, -half.imag], [half.imag, half.real]]) + np.outer(e, e))
        J = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, rate], [0, 0, 1, 0], [0, 0, 0, 1], [0, -rate, 0, 0]])
        vague = self.turn.P[4, 4] + self.share @ (np.array(bank.LEG_RATES) / T - rate) ** 2
        slope = np.array([0, 0, x4[3], 0, 0, -x4[1]])
        white = self.share @ np.array(bank.LEG_NOISES) * np.mean(unit * self.scale) / T**4
        return J @ x4, J @ V @ J.T + vague * np.outer(slope, slope) + white * np.diag([0, 0, 1, 0, 0, 1])


class Pole:
    """(1 - phi q) w = (1 - rho q)^2 nu with one phi for all coordinates: state (x2, x3) per coordinate and phi."""

    def __init__(self, rho, unit):
        self.rho, C = rho, len(unit)
        self.z, self.scale = np.zeros(2 * C + 1), np.ones(C)
        self.P = np.diag([*np.repeat(pole.LOOSE * unit, 2), pole.FIRST])
        self.H = np.eye(2 * C + 1)[1:-1:2]
        self.G = np.zeros((2 * C + 1, C))
        for c in range(C):
            self.G[2 * c : 2 * c + 2, c] = rho**2, -2 * rho

    def rescale(self, factor):
        D = np.diag([factor] * (len(self.z) - 1) + [1.0])
        self.z, self.P = D @ self.z, D @ self.P @ D

    def predict(self, ahead, last, velocity, d, unit, g):
        x3 = self.H @ self.z
        S = ahead**2 * np.diag(self.H @ self.P @ self.H.T) + g * unit * self.scale
        return last + d * velocity + ahead * x3, S

    def widen(self, vv, T):
        self.P += vv * T * T * self.H.T @ self.H

    def correct(self, w, ahead, unit, g):
        """One step of the predictor: measure w, go on to the next."""
        R = np.diag(g * unit * self.scale / ahead**2)
        F = np.zeros_like(self.P)
        F[-1, -1] = 1.0
        for c in range(len(w)):
            F[2 * c + 1, 2 * c], F[2 * c + 1, -1] = 1.0, w[c]
        S = self.H @ self.P @ self.H.T + R
        e = w - self.H @ self.z
        M = F @ self.P @ self.H.T + self.G @ R
        K = M @ np.linalg.inv(S)
        known = self.z + self.P @ self.H.T @ np.linalg.inv(S) @ e  # of the state, now that w is measured
        nu = R @ np.linalg.inv(S) @ e
        phi = known[-1]
        known[-1] = np.clip(phi, -pole.LARGEST, pole.LARGEST)  # before anything is built with it
        self.z = F @ known + self.G @ nu
        self.P = F @ self.P @ F.T + self.G @ R @ self.G.T - K @ S @ K.T
        self.P = 0.5 * (self.P + self.P.T)
        self.P[-1, -1] += pole.WALK
        if abs(phi) > pole.LARGEST:  # held, and learnt anew
            self.P[-1] = self.P[:, -1] = 0.0
            self.P[-1, -1] = pole.FIRST
        elif self.P[-1, -1] > pole.FIRST:  # nothing was learnt: no wider than at first
            D = np.diag([1.0] * (len(self.z) - 1) + [math.sqrt(pole.FIRST / self.P[-1, -1])])
            self.P = D @ self.P @ D


def log_normal(e, v):
    return -0.5 * np.log(2 * np.pi * v) - 0.5 * e * e / v


class Follower:
    """The whole estimator: one plot at a time, ``take`` returns by name what it told."""

    def __init__(self, speed, C, *, forgetting, learning_rate, doubt, noise, tails):
        self.speed, self.C = speed, C
        self.forgetting, self.rate, self.noise, self.tails = forgetting, learning_rate, noise, tails
        self.doubt_of_others = -doubt
        self.seen = 0

    def take(self, t, y, R=None):
        """Take a plot with stated variances R; NaN is none, and leaves everything as it was."""
        y = np.asarray(y, float)
        if np.isfinite(y).all():
            return self._take(t, y, R)
        return copy.deepcopy(self)._take(t, None, R) if self.seen else None

    def _enter(self, t, y, R):
        self.seen, self.time, self.first = 1, t, y
        self.last = self.velocity = np.zeros(self.C)
        self.stated = R
        self.trust = 1.0 if R is None else step.CLAIM
        self.manoeuvre, self.is_told, self.waiting, self.doubt = step.STARTS, False, None, 0.0
        self.surprise, self.still, self.grain, self.drift = np.zeros((4, self.C))
        self.lead = 0.0
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
        self.weight[: len(bank.STRAIGHT)] = 0.0

    def _weights(self, known):
        w = np.where(known, np.exp(self.weight - self.weight[known].max()), 0.0)
        return w / w.sum()

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
        chosen = doubter
        if self.waiting:
            if best._density(y) + math.log(1 - share) < rival._density(y) + math.log(share):
                best = rival
            chosen = best
            if chosen is doubter:
                chosen.counts = chosen.counts * chosen._fade() ** self.C
                chosen.counts[bank.WILD] += self.C
        kept = copy.deepcopy(self)
        part = np.exp(chosen._parts(y))
        far = part[:, scales > 10].sum(axis=1)
        waits = chosen is doubter and self.seen >= step.EARLIEST and np.max(far / part.sum(axis=1)) > 0.5
        if waits:
            kept.counts, kept.waiting = chosen.counts.copy(), (t, y, R)
            wild = part[:, bank.WILD]
            if np.linalg.norm(y - chosen.m) > self.speed * (t - self.time):
                far = wild + step.MADE * (far - wild)
            left = chosen._departed(y)
            kept.doubt = np.clip(np.max(wild / (far + left)), 1 - step.SUREST, step.SUREST)
            before = {}
            chosen._tell(before, chosen.w)
        chosen._absorb(t, y, waits and left > 0)
        if not waits:
            found["onset"] = not chosen.is_told and chosen.lead > step.TOLD_ABOVE
            chosen.is_told = found["onset"] or (chosen.is_told and chosen.lead >= step.OVER_BELOW)
        chosen._tell(found, chosen._weights(chosen.known))
        if waits:
            x, apart = found["state"], (before["state"] - found["state"]).ravel()
            found["state"] = x + kept.doubt * apart.reshape(x.shape)
            inner = before["spread"] + (1 - kept.doubt) * np.outer(apart, apart)
            found["spread"] = (1 - kept.doubt) * found["spread"] + kept.doubt * inner
        self.__dict__ = kept.__dict__ if waits else chosen.__dict__
        return found

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
        return few / (self.seen + few), (0.1 * self.speed * self.d) ** 2 + cells**2

    def _density(self, y):
        return np.logaddexp.reduce(self._parts(y), axis=1).sum()

    def _fade(self):
        return 1 - 1 / min(self.tails, learning.YOUNG + self.seen)

    def _departed(self, y):
        """Return the density of a coordinate of a plot if the object left its rest; 0 where it did not."""
        slow = np.linalg.norm(self.velocity) <= departure.REST * self.speed
        if not slow or self.d < departure.TAKES or np.linalg.norm(y - self.last) > self.speed * self.d:
            return 0.0
        left = departure.OFTEN / (2 * self.speed * self.d)
        return left if (left > np.exp(self._parts(y)[:, : bank.WILD]).sum(axis=1)).any() else 0.0

    def _absorb(self, t, y, leaves=False):
        self._watch(y)
        self._learn_tails(y)
        if leaves:
            self._leave()
        self._judge(y)
        self._learn(t, y)

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
        """Chi-squared of the fading mean of what straight flight misses, under the noise of those that lead."""
        i, fresh = judging.PLAIN, judging.FRESH
        w = self.w[: bank.KALMAN] / self.w[: bank.KALMAN].sum()
        level = np.exp(w @ np.log([m.scale for m in self.kalman[: bank.KALMAN]]))
        s = self.S[i] * level / self.kalman[i].scale
        e = y - self.mean[i]
        z = np.clip(e / np.sqrt(s), -judging.FARTHEST, judging.FARTHEST)
        self.drift = (1 - fresh) * self.drift + fresh * z
        behind = judging.BEHIND * self.speed / judging.GENTLE * self.period**2
        is_far = self.drift**2 @ np.maximum(s, (e / judging.FARTHEST) ** 2) > behind**2 and self.seen > judging.SOONEST
        self.lead = self.drift @ self.drift * (2 - fresh) / fresh if is_far else 0.0

    def _judge(self, y):
        known, unit, C = self.known, self.unit, self.C
        freedom = np.full((len(known), 1), judging.FREEDOM)
        if C == 2:
            freedom[len(self.kalman) - 1] = legs.FREEDOM
        z2 = (y - self.mean) ** 2 / self.S
        usual, louder = -0.5 * (freedom + 1) * np.log1p(z2 / freedom), judging.LOUDER - 0.5 * np.log(np.maximum(z2, 1))
        usual = np.where(usual < judging.LOUDER, np.maximum(usual, louder), usual)
        score = (usual - 0.5 * np.log(self.S)).sum(axis=1)
        score = np.where(known, score, -np.inf)
        likelihood = np.exp(score - score.max())
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
        self.surprise = (y - self.m) ** 2 / np.diag(self.V)
        self.gap, self.velocity, self.last = d, velocity, y
        self.time, self.seen = t, self.seen + 1

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
