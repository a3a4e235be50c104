"""Tracks in plain NumPy from the textbook: every model of motion as matrices, the mixture of all, what it tells.

Singer (1970), Li and Jilkov (2003): F and Q by Van Loan's exponential, noise of a plot 1 and scaled afterwards.
Salut, Aguilar, Favier and Alengrin (1979), 3.3: the measured differences w make the state (x2, x3 per coordinate, phi)
linear; here with correlated noises in one step. Nothing is shared with the package but its table of constants.
"""

import copy
import math

import numpy as np
import scipy.linalg

from driftwise.estimators.track import bank, circle, pole, step

TINY = 1e-12  # no evidence is quite nothing


def van_loan(A, W, d):
    """Return F and Q of x' = A x + noise of intensity W over d seconds."""
    n = len(A)
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

    def correct(self, w, ahead, unit, g):
        """One step of the predictor: measure w, go on to the next."""
        R = np.diag(g * unit * self.scale / ahead**2)
        F = np.zeros_like(self.P)
        F[-1, -1] = 1.0
        for c in range(len(w)):
            F[2 * c + 1, 2 * c], F[2 * c + 1, -1] = 1.0, w[c]
        S = self.H @ self.P @ self.H.T + R
        M = F @ self.P @ self.H.T + self.G @ R
        K = M @ np.linalg.inv(S)
        self.z = F @ self.z + K @ (w - self.H @ self.z)
        self.P = F @ self.P @ F.T + self.G @ R @ self.G.T - K @ S @ K.T
        self.P = 0.5 * (self.P + self.P.T)
        self.P[-1, -1] += pole.WALK
        if abs(self.z[-1]) > pole.LARGEST:  # held, and learnt anew
            self.z[-1] = math.copysign(pole.LARGEST, self.z[-1])
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
        self.forgetting, self.rate, self.doubt, self.noise, self.tails = forgetting, learning_rate, -doubt, noise, tails
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
        self.manoeuvre, self.is_told = step.STARTS, False
        self.counts = np.array(step.PRIOR)

    def _start(self, d):
        self.period = d
        typical = (0.1 * self.speed * d) ** 2
        self.log = np.log(np.full(self.C, typical) if self.stated is None else self.stated)
        unit = np.exp(self.log)
        self.kalman = [Linear(2, a, q, d, self.speed, unit) for a, q in bank.STRAIGHT]
        self.kalman += [Linear(3, a, q, d, self.speed, unit) for a, q in bank.CURVED]
        self.kalman += [Circle(q, d, self.speed, unit) for q in bank.TURNS if self.C == 2]
        self.poles = None
        self.weight = np.full(len(self.kalman) + len(bank.RADII), self.doubt)
        self.weight[: len(bank.STRAIGHT)] = 0.0

    def _weights(self, known):
        w = np.where(known, np.exp(self.weight - self.weight[known].max()), 0.0)
        return w / w.sum()

    def _take(self, t, y, R):
        if not self.seen:
            return self._enter(t, y, R)
        d, C, is_early = t - self.time, self.C, self.seen == 1
        if is_early:
            self._start(d)
        else:
            before = self.period
            self.period *= (d / before) ** (1 / min(self.seen, step.PERIODS))
            for member in self.poles:
                member.rescale(self.period / before)
        unit, ahead = np.exp(self.log), d / self.period
        g = np.ones(C) if R is None or self.stated is None else np.asarray(R) / self.stated
        # what each expects, relative to the first plot
        told = [m.predict(d, self.period, unit, g) for m in self.kalman]
        if not is_early:
            told += [m.predict(ahead, self.last, self.velocity, d, unit, g) for m in self.poles]
        known = np.arange(len(self.weight)) < len(told)
        mean, S = (np.full((len(self.weight), C), np.nan) for _ in range(2))
        mean[known], S[known] = np.array(told).transpose(1, 0, 2)
        # the mixture
        w = self._weights(known)
        m = w[known] @ mean[known]
        base = w[known] @ (S[known] + (mean[known] - m) ** 2)
        spreading = self.counts @ np.array(bank.SCALES) / self.counts.sum()
        found = {"prediction": m + self.first, "base": base, "weights": w, "spreading": spreading}
        if C == 2:
            found["cross"] = np.sum(w[known] * (mean[known] - m).prod(axis=1))
        if y is not None:
            self._judge(found, y - self.first, unit, m, base, mean, S, w, known, is_early)
            self._learn(found, y - self.first, d, ahead, unit, g, mean, S)
            self.time, self.seen = t, self.seen + 1
            w = self._weights(known)
        self._tell(found, w, unit)
        return found

    def _judge(self, found, y, unit, m, base, mean, S, w, known, is_early):
        e, shares = y - m, self.counts / self.counts.sum()
        v = np.array(bank.SCALES) * base[:, None]
        part = np.log(shares) + log_normal(e[:, None], v)
        density = np.logaddexp.reduce(part, axis=1)
        lower = np.array([[0.5 * math.erfc(-a / math.sqrt(2 * b)) for b in row] for a, row in zip(e, v)]) @ shares
        found |= {"log_score": density, "lower": lower}
        z2 = (y - mean[known]) ** 2 / S[known]
        score = (-0.5 * np.log(S[known]) - 0.5 * (step.FREEDOM + 1) * np.log1p(z2 / step.FREEDOM)).sum(axis=1)
        likelihood = np.exp(score - score.max())
        # whether it manoeuvres: the members that see an acceleration beyond the gentle, against those that see none
        least = self.speed / step.GENTLE
        sees = [i > 0 and m.acceleration(self.period, unit) > least for i, m in enumerate(self.kalman)]
        w, likelihood, sees = w[: len(sees)], likelihood[: len(sees)], np.array(sees)
        calm = (w @ (likelihood * ~sees) + TINY) / (w @ ~sees + TINY)
        moving = (w @ (likelihood * sees) + TINY * calm) / (w @ sees + TINY)  # no evidence where none sees one
        is_sure = sees & np.array([m.bends(unit) for m in self.kalman])
        lead = (2 * w @ is_sure - w.sum()) / (w.sum() + 2 * TINY)
        before = max(self.manoeuvre, lead)
        before = before * (1 - step.ENDS) + (1 - before) * step.STARTS
        self.manoeuvre = before * moving / (before * moving + (1 - before) * calm)
        found["onset"] = not self.is_told and self.manoeuvre > step.TOLD_ABOVE
        self.is_told = found["onset"] or (self.is_told and self.manoeuvre >= step.OVER_BELOW)
        self.weight = self.forgetting * self.weight
        self.weight[known] += self.rate * (score - score.max())
        self.weight -= self.weight.max()
        if not is_early:
            fade = 1 - 1 / min(self.tails, step.YOUNG + self.seen)
            found_by = np.exp(part - density[:, None]).sum(axis=0)
            self.counts = np.maximum(fade**self.C * self.counts + found_by, step.LEAST_COUNT * np.array(step.PRIOR))

    def _learn(self, found, y, d, ahead, unit, g, mean, S):
        velocity, early = (y - self.last) / d, self.seen == 1
        if not early and self.seen <= step.LEARNT_BY:  # second differences
            step_before = self.gap
            e = y - self.last - d * self.velocity
            noise = 1 + (1 + d / step_before) ** 2 + (d / step_before) ** 2  # n_k - (1 + h) n_k-1 + h n_k-2
            z = np.maximum(e * e / noise / g, 1e-8 * unit)
            self.log = self.log + (np.log(z) + step.LOG_MEAN - self.log) / (self.seen - 1 + self.trust)
        pace = max(1 / self.noise, 1 / (self.seen + 3))
        grow = np.ones_like(S) if early else 1 + (np.minimum((y - mean) ** 2 / S, step.WILD) - 1) * pace
        for member, factor in zip(self.kalman, grow):
            member.correct(y, unit, g)
            member.scale = member.scale * factor
        if early:
            self.poles = [Pole(rho, unit) for rho in bank.RADII]
        else:
            w = (velocity - self.velocity) * self.period
            for member, factor in zip(self.poles, grow[len(self.kalman) :]):
                member.correct(w, ahead, unit, g)
                member.scale = member.scale * factor
        self.gap, self.velocity, self.last = d, velocity, y

    def _tell(self, found, w, unit):
        known = w[: len(self.kalman)] / w[: len(self.kalman)].sum()
        states = [member.state(self.period, unit) for member in self.kalman]
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
