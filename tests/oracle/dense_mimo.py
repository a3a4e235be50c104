"""Several outputs (section 7.3) as moments of full matrices: one joint Gaussian vector, products by quadratic forms.

    x^i_{k+1}(t+1) = x^i_k(t) - sum_j a_ijk y_j + sum_l b_ilk u_l + w         (x^i_0 = 0, k = 0 .. nu_i - 1)
    y_i = x^i_{nu_i} - sum_{j<i, nu_ij = nu_i+1} a_{ij,nu_i} y_j + sum_l b_{il,nu_i} u_l + w_n,i

Salut's order: [x^1; x^2; ..; r^1; r^2; ..], r^i = a_i1k, a_i2k, .., b_i1k, .. for k < nu_i, then those of k = nu_i.
A sample: the vector v = [s ; w ; w_n ; u] is Gaussian; the outputs are appended in order, with exact mean, variance and
covariance; a measured one is conditioned on, a missing one stays an element of v; then s(t+1) is a quadratic map of v.
"""

from typing import NamedTuple

import numpy as np

A, B = "a", "b"


class Plant(NamedTuple):
    """Structure, and where each parameter stands: `at[kind, i, j, k]`."""

    nu: tuple
    inputs: int
    at: dict
    size: int

    @property
    def n(self):
        return sum(self.nu)


class Noise(NamedTuple):
    Q: np.ndarray
    S: np.ndarray
    R: np.ndarray


def plant(nu, inputs=0, direct=False):
    at, here = {}, sum(nu)

    def put(*key):
        nonlocal here
        at[key] = here
        here += 1

    for i in range(len(nu)):
        nus = [nu[i] if i == j else min(nu[i] + 1, nu[j]) if i > j else min(nu[i], nu[j]) for j in range(len(nu))]
        for j in range(len(nu)):
            for k in range(min(nus[j], nu[i])):
                put(A, i, j, k)
        for l in range(inputs):
            for k in range(nu[i]):
                put(B, i, l, k)
        for j in range(i):
            if nus[j] == nu[i] + 1:
                put(A, i, j, nu[i])
        for l in range(inputs if direct else 0):
            put(B, i, l, nu[i])
    return Plant(tuple(nu), inputs, at, here)


def state(p, i, k):
    """Index of x^i_k, k = 1 .. nu_i."""
    return sum(p.nu[:i]) + k - 1


# --- complete samples: theorem 3 with block matrices -------------------------------------------------------------


def matrices(p, y, u):
    """F (N, N) and H (outputs, N) for known data; y in H is frozen, since outputs come in order."""
    F, H = np.eye(p.size), np.zeros((len(p.nu), p.size))
    F[: p.n] = 0
    for i, nu in enumerate(p.nu):
        H[i, state(p, i, nu)] = 1
        for k in range(1, nu):
            F[state(p, i, k + 1), state(p, i, k)] = 1
    for (kind, i, j, k), m in p.at.items():
        datum = -y[j] if kind == A else u[j]
        if k == p.nu[i]:
            H[i, m] = datum
        else:
            F[state(p, i, k + 1), m] = datum
    return F, H


def theorem3(p, noise, s, P, y, u):
    """All outputs at once: returns s+, P+, e, T (matrix)."""
    Q, S = np.zeros((p.size, p.size)), np.zeros((p.size, len(p.nu)))
    Q[: p.n, : p.n], S[: p.n] = noise.Q, noise.S
    F, H = matrices(p, y, u)
    T = H @ P @ H.T + noise.R
    L = F @ P @ H.T + S
    e = y - H @ s
    K = L @ np.linalg.inv(T)
    return F @ s + K @ e, F @ P @ F.T + Q - K @ T @ K.T, e, T


# --- any sample: moments ------------------------------------------------------------------------------------------


class Moments:
    """A Gaussian vector that grows by quadratic functions of itself: (constant, linear, list of (weight, i, j))."""

    def __init__(self, mean, cov):
        self.mean, self.cov = mean, cov

    def of(self, functions):
        """Mean, covariance, and covariance with the vector, of several quadratic functions."""
        size, means, slopes, squares = len(self.mean), [], [], []
        for constant, linear, products in functions:
            l, M = np.zeros(size), np.zeros((size, size))
            for index, weight in linear:
                l[index] += weight
            for weight, i, j in products:
                M[i, j] += weight / 2
                M[j, i] += weight / 2
            means.append(constant + l @ self.mean + self.mean @ M @ self.mean + np.sum(M * self.cov))
            slopes.append(l + 2 * M @ self.mean)
            squares.append(M @ self.cov)
        J = np.array(slopes)
        second = [[2 * np.sum(one * other.T) for other in squares] for one in squares]
        return np.array(means), J @ self.cov @ J.T + np.array(second), J @ self.cov

    def append(self, function):
        mean, var, cross = self.of([function])
        self.mean = np.append(self.mean, mean)
        self.cov = np.block([[self.cov, cross.T], [cross, var]])

    def condition_on_last(self, value):
        """Return the innovation and its variance; drop the element."""
        e, T, c = value - self.mean[-1], self.cov[-1, -1], self.cov[:-1, -1]
        self.mean = self.mean[:-1] + (c / T * e if T > 0 else 0)
        self.cov = self.cov[:-1, :-1] - (np.outer(c, c) / T if T > 0 else 0)
        return e, T


def _terms(p, i, k, where, known):
    """Constant, linear and product terms of -sum a_ijk y_j + sum b_ilk u_l of one equation."""
    linear, products = [], []
    for (kind, i2, j, k2), m in p.at.items():
        if (i2, k2) == (i, k):
            sign = -1 if kind == A else 1
            if (kind, j) in known:
                linear.append((m, sign * known[kind, j]))
            else:
                products.append((sign, m, where[kind, j]))
    return linear, products


def sample(p, noise, s, P, y, u, u_var, outputs=None, others=None):
    """One sample of the filter that covers ``outputs`` (all by default); NaN is a missing output.

    ``others`` maps an output outside to its (mean, variance) where it is missing: an independent uncertain datum.
    Returns s(t|t), P(t|t), s(t+1|t), P(t+1|t), and per output of the filter prediction and variance. s, P are those
    of the whole plant; a filter of some outputs leaves the other rows alone.
    """
    outputs = range(len(p.nu)) if outputs is None else outputs
    others = others or {}
    N, n, count = p.size, p.n, len(p.nu)
    known = {(B, l): u[l] for l in range(p.inputs) if u_var[l] == 0}
    known |= {(A, j): y[j] for j in range(count) if y[j] == y[j]}
    blocks = [
        P,
        np.block([[noise.Q, noise.S], [noise.S.T, noise.R]]),
        np.diag(u_var),
        np.diag([v for _, v in others.values()]),
    ]
    blocks[3] = blocks[3].reshape(len(others), len(others))
    mean = np.concatenate([s, np.zeros(n + count), u, [m for m, _ in others.values()]])
    cov, here = np.zeros((len(mean), len(mean))), 0
    for block in blocks:
        cov[here : here + len(block), here : here + len(block)] = block
        here += len(block)
    v = Moments(mean, cov)
    where = {(B, l): N + n + count + l for l in range(p.inputs)}
    where |= {(A, j): N + n + count + p.inputs + c for c, j in enumerate(others)}
    seen = []
    for i in outputs:
        linear, products = _terms(p, i, p.nu[i], where, known)
        v.append((0.0, [(state(p, i, p.nu[i]), 1.0), (N + n + i, 1.0), *linear], products))
        if y[i] == y[i]:
            prediction = v.mean[-1]
            seen.append((prediction, v.condition_on_last(y[i])[1]))
        else:
            where[A, i] = len(v.mean) - 1
            seen.append((v.mean[-1], v.cov[-1, -1]))
    now = v.mean[:N].copy(), v.cov[:N, :N].copy()
    functions = []
    for i, nu in enumerate(p.nu):
        for k in range(nu):
            if i in outputs:
                linear, products = _terms(p, i, k, where, known)
                shifted = [(state(p, i, k), 1.0)] if k else []
                functions.append((0.0, [*shifted, (N + state(p, i, k + 1), 1.0), *linear], products))
            else:
                functions.append((0.0, [(state(p, i, k + 1), 1.0)], []))
    functions += [(0.0, [(m, 1.0)], []) for m in range(n, N)]
    s, P, _ = v.of(functions)
    return *now, s, P, seen


def walk(p, P, q, P0):
    """Random walk of the parameters, each held at its prior variance."""
    P, m = P.copy(), np.arange(p.n, p.size)
    P[m, m] += np.minimum(q, np.maximum(0.0, np.diag(P0 - P)[p.n :]))
    return P


class Run(NamedTuple):
    prediction: np.ndarray
    variance: np.ndarray
    now: list  # (s, P) given the sample
    s: list  # s(t+1 | t)
    P: list
    loglik: float


def run(p, noise, s, P, y, u, q=0.0, is_split=False):
    """A record, NaN where an output or an input is missing."""
    u, u_var = held(u)
    P0, rows, loglik = P, [], 0.0
    groups = [[i] for i in range(len(p.nu))] if is_split else [list(range(len(p.nu)))]
    owner = np.concatenate([np.repeat(range(len(p.nu)), p.nu), [i for (_, i, _, _) in p.at]])
    for t in range(len(y)):
        seen, now, after = {}, (s.copy(), P.copy()), (s.copy(), P.copy())
        for _ in range(2 if is_split else 1):  # the second time with what later outputs were predicted as
            for group in groups:
                mine = np.flatnonzero(np.isin(owner, group))
                others = {j: seen[j] for j in seen if j not in group and y[t, j] != y[t, j]}
                later = [j for j in range(len(p.nu)) if j not in group and j not in seen and y[t, j] != y[t, j]]
                others |= dict.fromkeys(later, (0.0, 0.0))  # no contemporaneous term: cannot matter to the prediction
                s1, P1, s2, P2, found = sample(p, noise, s, P, y[t], u[t], u_var[t], group, others)
                seen |= dict(zip(group, found))
                for (means, covs), (m, c) in ((now, (s1, P1)), (after, (s2, P2))):
                    means[mine] = m[mine]
                    covs[np.ix_(mine, mine)] = c[np.ix_(mine, mine)]
        s, P = after[0], walk(p, after[1], q, P0)
        prediction, variance = np.array([seen[i] for i in range(len(p.nu))]).T
        e = y[t] - prediction
        there = e == e
        loglik -= 0.5 * np.sum(np.log(2 * np.pi * variance[there]) + e[there] ** 2 / variance[there])
        rows.append((prediction, variance, now, s, P))
    return Run(*(list(c) for c in zip(*rows, strict=True)), loglik)


def held(u):
    """Each missing input as an AR(1) process predicts it, and the variance of that (0 where known)."""
    u, var = u.copy(), np.zeros_like(u)
    for column, spread in zip(u.T, var.T):
        values, steps, last, unsure = [], [], 0.0, 0.0
        for t, value in enumerate(column):
            if value == value:
                steps += [value - last] if values else []
                values.append(value)
                last, unsure = value, 0.0
            elif len(values) > 1:
                centre, width = np.mean(values), np.var(values)
                rho = max(1 - np.sum(np.square(steps)) / (2 * width * (len(values) - 1)), 0.0) if width > 0 else 1.0
                last, unsure = centre + rho * (last - centre), rho**2 * unsure + (1 - rho**2) * width
            column[t], spread[t] = last, unsure
    return u, var
