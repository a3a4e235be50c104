"""A(q) y = sum B/F u + offset + C/D e by SciPy's filters and dense algebra; shares no code with the library."""

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter


@dataclass
class System:
    """Coefficient lists without the leading one; B of each input with its delay."""

    a: list = field(default_factory=list)
    b: list = field(default_factory=list)
    nk: list = field(default_factory=list)
    c: list = field(default_factory=list)
    d: list = field(default_factory=list)
    f: list = field(default_factory=list)
    offset: float | None = None

    @property
    def theta(self):
        parts = [self.a, *self.b, self.c, self.d, *self.f, [] if self.offset is None else [self.offset]]
        return np.array([x for part in parts for x in part], float)

    def at(self, theta):
        """The system of the same orders with other coefficients."""
        theta, out, at = list(theta), [], 0
        for part in [self.a, *self.b, self.c, self.d, *self.f]:
            out.append(theta[at : at + len(part)])
            at += len(part)
        k = len(self.b)
        offset = None if self.offset is None else theta[at]
        return System(out[0], out[1 : 1 + k], self.nk, out[1 + k], out[2 + k], out[3 + k :], offset)

    @property
    def polynomials(self):
        one = [1.0]
        B = [[0.0] * nk + list(b) for b, nk in zip(self.b, self.nk)]
        F = [one + list(f) for f in self.f]
        return one + list(self.a), B, one + list(self.c), one + list(self.d), F

    def innovations(self, y, u):
        """e (T,) of a record from rest."""
        A, B, C, D, F = self.polynomials
        v = lfilter(A, [1.0], y) - (self.offset or 0.0)
        for l in range(len(B)):
            v = v - lfilter(B[l], F[l], u[..., l])
        return lfilter(D, C, v)

    def gradient(self, y, u, step=1e-5):
        """-de/dtheta (T, N) by central differences."""
        t = self.theta
        moved = [(self.at(t + s), self.at(t - s)) for s in step * np.eye(len(t))]
        return np.stack([(q.innovations(y, u) - p.innovations(y, u)) / (2 * step) for p, q in moved], axis=-1)

    def simulate(self, u, e):
        """y of inputs (.., T, k) and noise (.., T) from rest."""
        A, B, C, D, F = self.polynomials
        y = lfilter(C, np.convolve(A, D), e) + lfilter([1.0], A, np.full(e.shape, self.offset or 0.0))
        for l in range(len(B)):
            y = y + lfilter(B[l], np.convolve(A, F[l]), u[..., l])
        return y

    def records(self, series, samples, std, seed=0, hold=3):
        """(y (S, T), u (S, T, k)) with random signs held for a few samples as inputs."""
        rng = np.random.default_rng(seed)
        k = len(self.b)
        u = np.repeat(rng.choice([-1.0, 1.0], (series, samples // hold + 1, k)), hold, axis=1)[:, :samples]
        return self.simulate(u, std * rng.standard_normal((series, samples))), u

    def information(self, y, u, std):
        """Fisher information of records (S, T), their mean."""
        psi = [self.gradient(y[s], u[s]) for s in range(len(y))]
        return np.mean([p.T @ p for p in psi], axis=0) / std**2

    def filtered(self, y, u, std):
        """One-step predictions and their variances (T,), by a Kalman filter on the noise C/(A D) e: y may have gaps."""
        A, _, C, D, _ = self.polynomials
        known = self.simulate(u, np.zeros(len(y)))
        den = np.convolve(A, D)
        n = max(len(den), len(C), 2) - 1
        a, c = np.zeros(n), np.zeros(n)
        a[: len(den) - 1], c[: len(C) - 1] = den[1:], C[1:]
        Phi, H = np.eye(n, k=1), np.eye(1, n)[0]
        Phi[:, 0] -= a
        G = c - a
        x, P = np.zeros(n), np.zeros((n, n))
        mean, variance = np.empty(len(y)), np.empty(len(y))
        for t in range(len(y)):
            mean[t], T = known[t] + H @ x, H @ P @ H + std**2
            variance[t] = T
            Q = std**2 * np.outer(G, G)
            if np.isnan(y[t]):
                x, P = Phi @ x, Phi @ P @ Phi.T + Q
            else:
                K = (Phi @ P @ H + std**2 * G) / T
                x, P = Phi @ x + K * (y[t] - mean[t]), Phi @ P @ Phi.T + Q - np.outer(K, K) * T
        return mean, variance, x, P, Phi


def rpem(system, y, u, theta, P):
    """Parameters (T, N) of the textbook recursion, dense: signals and derivatives kept whole, in lists over time."""
    form, N = system, len(theta)
    k = len(form.b)
    w, dw = [[] for _ in range(k)], [[] for _ in range(k)]
    v, dv, e, de, out = [], [], [], [], []
    zero = np.zeros(N)

    def past(signal, t, lag, none=0.0):
        return signal[t - lag] if t >= lag else none

    def equations(theta, t):
        """w, v, e of sample t and their derivatives, straight from their definitions."""
        s = form.at(theta)
        at = 0

        def unit(i):
            return np.eye(N)[i]

        vt, dvt = y[t] - (s.offset or 0.0), np.zeros(N)
        if s.offset is not None:
            dvt = dvt - unit(N - 1)
        for i, a in enumerate(s.a):
            vt += a * past(y, t, i + 1)
            dvt = dvt + unit(i) * past(y, t, i + 1)
        at = len(s.a)
        first_f = at + sum(map(len, s.b)) + len(s.c) + len(s.d)
        ws, dws = [], []
        for l in range(k):
            wl, dwl = 0.0, np.zeros(N)
            for j, b in enumerate(s.b[l]):
                x = past(u[:, l], t, s.nk[l] + j)
                wl += b * x
                dwl = dwl + unit(at + j) * x
            for j, f in enumerate(s.f[l]):
                wl -= f * past(w[l], t, j + 1)
                dwl = dwl - unit(first_f + j) * past(w[l], t, j + 1) - f * past(dw[l], t, j + 1, zero)
            ws.append(wl), dws.append(dwl)
            vt, dvt = vt - wl, dvt - dwl
            at += len(s.b[l])
            first_f += len(s.f[l])
        et, det = vt, dvt
        for j, d in enumerate(s.d):
            et += d * past(v, t, j + 1)
            det = det + unit(at + len(s.c) + j) * past(v, t, j + 1) + d * past(dv, t, j + 1, zero)
        for j, c in enumerate(s.c):
            et -= c * past(e, t, j + 1)
            det = det - unit(at + j) * past(e, t, j + 1) - c * past(de, t, j + 1, zero)
        return ws, dws, vt, dvt, et, det

    for t in range(len(y)):
        *_, et, det = equations(theta, t)
        psi = -det
        T = psi @ P @ psi + 1.0
        theta = theta + P @ psi * (et / T)
        P = P - np.outer(P @ psi, P @ psi) / T
        ws, dws, vt, dvt, et, det = equations(theta, t)
        for l in range(k):
            w[l].append(ws[l]), dw[l].append(dws[l])
        v.append(vt), dv.append(dvt), e.append(et), de.append(det)
        out.append(theta)
    return np.array(out)
