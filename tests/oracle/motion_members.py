"""The members of the oracle of tracks: straight and curved flight, circles, legs, poles; plain NumPy."""

import math

import numpy as np
import scipy.linalg
import scipy.stats

from driftwise.estimators.track import bank, circle, legs, pole


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
        quiet = np.arange(n) < legs.QUIET
        self.ends = np.where(quiet, legs.CALM, legs.LASTS)
        follows = np.where(quiet[:, None] & quiet, 0.0, self.pi)  # from, to: no quiet leg on a quiet one
        self.follows = follows / follows.sum(axis=1, keepdims=True)

    def predict(self, d, T, unit, g):
        ended = self.share * (1 - (1 - self.ends) ** (d / T))
        stays, new = self.share - ended, ended @ self.follows
        before, self.share = (self.x.copy(), self.P.copy()), stays + new
        begun = [self.moments(w / w.sum()) for w in (ended[:, None] * self.follows).T]
        for j, (x, P) in enumerate(begun):  # of those that stay and those that begin
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
