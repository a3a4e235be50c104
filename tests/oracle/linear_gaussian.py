"""Small linear systems, drawn, and the dense joint Gaussian of all their states and outputs: no recursion."""

import numpy as np

import driftwise as dw

SYSTEMS = range(200)


def random_system(seed, T=8):
    """Return F, G, H, D, Q, R, x0, P0, y with gaps, u: stable and unstable, R and Q full, some Q of low rank."""
    rng = np.random.default_rng(seed)
    n, k, p = rng.integers(1, 5), rng.integers(0, 3), rng.integers(1, 4)
    F = rng.standard_normal((n, n))
    F *= rng.uniform(0.3, 1.05) / np.abs(np.linalg.eigvals(F)).max()
    G, H, D = rng.standard_normal((n, k)), rng.standard_normal((p, n)), rng.standard_normal((p, k))
    W, V, S = rng.standard_normal((n, rng.integers(1, n + 1))), rng.standard_normal((p, p)), rng.standard_normal((n, n))
    R, P0 = V @ V.T + 0.1 * np.eye(p), S @ S.T + 0.1 * np.eye(n)
    y, u = rng.standard_normal((T, p)), rng.standard_normal((T, k))
    y[rng.random((T, p)) < 0.2] = np.nan
    return F, G, H, D, W @ W.T, R, rng.standard_normal(n), P0, y, u


def dense(F, G, H, D, Q, R, x0, P0, y, u):
    """Return mean and covariance of the last state and log p(y)."""
    x, P, loglik = moments(F, G, H, D, Q, R, x0, P0, y, u)
    return x[-1], P[-1], loglik


def moments(F, G, H, D, Q, R, x0, P0, y, u):
    """Return mean and covariance of every state, and log p(y), from one Gaussian of all; matrices (T, .., ..)."""
    T, n = len(y), len(x0)
    mean, C = np.zeros((T, n)), np.zeros((T, n, T, n))
    mean[0], C[0, :, 0] = x0, P0
    for t in range(1, T):
        mean[t] = F[t] @ mean[t - 1] + G[t] @ u[t - 1]
        for s in range(t):
            C[t, :, s] = F[t] @ C[t - 1, :, s]
            C[s, :, t] = C[t, :, s].T
        C[t, :, t] = F[t] @ C[t - 1, :, t - 1] @ F[t].T + Q[t]
    seen = np.argwhere(~np.isnan(y))
    rows, e, noise = [], [], np.zeros((len(seen), len(seen)))
    for a, (t, i) in enumerate(seen):
        row = np.zeros((T, n))
        row[t] = H[t][i]
        rows.append(row.ravel())
        e.append(y[t, i] - H[t][i] @ mean[t] - D[t][i] @ u[t])
        for b, (s, j) in enumerate(seen):
            noise[a, b] = R[t][i, j] if s == t else 0.0
    M, e, C = np.array(rows), np.array(e), C.reshape(T * n, T * n)
    S = M @ C @ M.T + noise
    gain = np.linalg.solve(S, M @ C).T
    x, P = mean.ravel() + gain @ e, C - gain @ M @ C
    loglik = -0.5 * (e @ np.linalg.solve(S, e) + np.linalg.slogdet(2 * np.pi * S)[1])
    at = [slice(t * n, t * n + n) for t in range(T)]
    return x.reshape(T, n), np.array([P[i, i] for i in at]), loglik


def of(system, **more):
    F, G, H, D, Q, R, x0, P0, y, u = system
    k, is_one = G.shape[1], len(H) == 1
    est = dw.StateSpace(F, G if k else None, H, D if k else None, Q, R, x0=x0, P0=P0, **more)
    return est, (y[:, 0] if is_one else y), (u if k else None)


def each(matrices, T):
    return [np.broadcast_to(M, (T, *M.shape)) for M in matrices]
