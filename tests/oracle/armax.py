"""The joint filter with an unknown noise polynomial, as full matrices: s = [x ; a ; b of each input ; d ; b_n].

    x(t+1) = E x - a y + b u + d v,    y = H s + v,    v white of variance R

Given y the product d v = d (y - H s) has two unknown factors; `step` keeps its exact first two moments (method
"ekf"), leaves out the second-order terms ("rml"), or takes the residual for a known input ("els").
"""

import numpy as np


def transition(n, inputs, direct, y, u, v):
    E, I = np.eye(n, k=-1), np.eye(n)
    G = np.hstack([-y * I, *(value * I for value in u), v * I, np.zeros((n, inputs * direct))])
    return np.block([[E, G], [np.zeros_like(G.T), np.eye(G.shape[1])]])


def row(n, inputs, direct, u):
    size = n * (3 + inputs) + inputs * direct
    H = np.zeros(size)
    H[n - 1] = 1
    if direct:
        H[size - inputs :] = u
    return H


def step(n, inputs, direct, R, s, P, y, u, method="ekf", sigma2=1.0):
    """s(t+1 | t) and its covariance from s(t | t-1); P, R relative to sigma2. A NaN y is missing."""
    H, a, d = row(n, inputs, direct, u), slice(n, 2 * n), slice(n * (2 + inputs), n * (3 + inputs))
    x, lift = slice(0, n), np.eye(len(s), n)
    T = H @ P @ H + R
    if y == y:
        K = P @ H / T
        s, P = s + K * (y - H @ s), P - np.outer(K, K) * T
        v = y - H @ s
        F = transition(n, inputs, direct, y, u, v)
        c, Tx = (P @ H)[d], H @ P @ H
        A = F if method == "els" else F - np.outer(lift @ s[d], H)
        s_next, P_next = F @ s, A @ P @ A.T
        if method == "ekf":
            s_next[x] -= sigma2 * c
            P_next[x, x] += sigma2 * (Tx * P[d, d] + np.outer(c, c))
        return s_next, P_next
    F = transition(n, inputs, direct, H @ s, u, 0.0)
    c, Tx = (P @ H)[a], H @ P @ H
    g = (s[d] if method != "els" else 0) - s[a]
    A = F - np.outer(lift @ s[a], H)
    s_next, P_next = F @ s, A @ P @ A.T
    s_next[x] -= sigma2 * c
    between = P[d, d] + P[a, a] - P[d, a] - P[a, d] if method == "ekf" else P[a, a]
    P_next[x, x] += np.outer(g, g) * R + sigma2 * (Tx * P[a, a] + np.outer(c, c) + R * between)
    return s_next, P_next


def draw_next(n, inputs, direct, R, s, P, y, u, draws, rng):
    """Samples of s(t+1) given y: draw s(t) from its law given y, and push it through the equation itself."""
    H = row(n, inputs, direct, u)
    if y == y:
        T = H @ P @ H + R
        K = P @ H / T
        s, P = s + K * (y - H @ s), P - np.outer(K, K) * T
    S = rng.multivariate_normal(s, P, draws)
    v = y - S @ H if y == y else np.sqrt(R) * rng.standard_normal(draws)
    z = S @ H + v
    x = np.zeros((draws, n))
    x[:, 1:] = S[:, : n - 1]
    x -= S[:, n : 2 * n] * z[:, None]
    for l in range(inputs):
        x += S[:, n * (2 + l) : n * (3 + l)] * u[l]
    x += S[:, n * (2 + inputs) : n * (3 + inputs)] * v[:, None]
    return np.hstack([x, S[:, n:]])
