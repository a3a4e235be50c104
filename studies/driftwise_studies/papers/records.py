"""Simulated records, many at once, from the canonical model written out (no code of the engine).

Section 3.2 of the paper lists -a (its poles .5, .6, .8 come out of x+ = E x + a_printed y + d v; with a minus sign a
pole would lie at -2.43). `PRINTED` has the paper's signs, the engine the other ones: this folder turns them round at
its border, `-PRINTED` going in and `-a` coming out.
"""

from __future__ import annotations

import numpy as np

PRINTED = np.array([0.24, -1.18, 1.9])
TRUE_D = np.array([-0.056, 0.5, -1.3])


def canonical(a, w, w_n, *, b=None, u=None, direct=0.0, x0=0.0):
    """Return y (S, T) and x (S, T, n) of x+ = E x - a y + b u + w, y = x_n + direct u + w_n.

    ``w`` (S, T, n), ``w_n`` (S, T), ``u`` (S, T); ``a`` and ``b`` are (n,), (S, n), or (T, 1, n) where they change.
    """
    records, T, n = w.shape
    x, y = np.zeros((records, T, n)), np.zeros((records, T))
    now = np.zeros((records, n)) + x0
    at = (lambda v, t: v[t]) if np.ndim(a) == 3 else (lambda v, t: v)
    for t in range(T):
        x[:, t] = now
        y[:, t] = now[:, -1] + w_n[:, t] + (0.0 if u is None else direct * u[:, t])
        after = w[:, t] - at(a, t) * y[:, t, None]
        after[:, 1:] += now[:, :-1]
        if u is not None:
            after += b * u[:, t, None]
        now = after
    return y, x


def coloured(d, v):
    """Return w = d v and w_n = v."""
    return v[..., None] * np.asarray(d, float), v


def paper_records(seeds: int, T: int = 1000):
    """Return y and x of section 3.2: x(0) = 0, v ~ N(0, 1)."""
    v = np.random.default_rng(1979).standard_normal((seeds, T))
    return canonical(-PRINTED, *coloured(TRUE_D, v))


def scan_all(est, y, u=None):
    """Return innovations (S, T), their variances, x(t | t) in Salut's order (S, T, n) and parameters (S, T, m)."""
    traces = [est.scan(y[i], None if u is None else u[i], keep="means") for i in range(len(y))]
    return (
        np.array([trace.innovation for trace in traces]),
        np.array([trace.variance for trace in traces]),
        np.array([trace.x[:, ::-1] for trace in traces]),
        np.array([trace.parameters for trace in traces]),
    )


def ljung_box(e, lags: int = 10):
    """Return the p-values of rows of ``e``; no correction of degrees of freedom, for innovations of a recursion."""
    from scipy.stats import chi2

    e = np.atleast_2d(e)
    T = e.shape[1]
    e = e - e.mean(axis=1, keepdims=True)
    power = np.sum(e * e, axis=1)
    k = np.arange(1, lags + 1)
    r = np.array([np.sum(e[:, j:] * e[:, :-j], axis=1) / power for j in k])
    return chi2.sf(T * (T + 2) * np.sum(r**2 / (T - k)[:, None], axis=0), lags)


def nees(est, states, truth):
    """Return the squared error of the parameters over their covariance and number, per state (Salut's order)."""
    n, found = est.model.n, []
    for state in states:
        error = est.mean(state)[n:] - truth
        found.append(error @ np.linalg.solve(est.sigma2(state) * est.covariance(state)[n:, n:], error) / len(truth))
    return np.array(found)
