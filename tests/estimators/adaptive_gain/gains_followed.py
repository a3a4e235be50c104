"""Records whose gain changes, and how it is followed, for tests."""

import numpy as np

import driftwise as dw

PHI = 0.99
SLOW = dict(memory=dw.RandomWalk(8e-5), K0=0.0, P0=0.04, x0=0.0)


def records(runs, levels=(0.1, 0.3, 0.1, 0.3), seed=1, segment=500):
    """x, y (runs, T) and the best gain (T,); R = 1, Q from the gain; written out, not the library's own formula."""
    rng = np.random.default_rng(seed)
    K = np.repeat(levels, segment)
    Q = K / (1 - K) * (1 - PHI**2 * (1 - K))
    x = np.empty((runs, K.size))
    x[:, 0] = rng.standard_normal(runs) * np.sqrt(Q[0] / (1 - PHI**2))
    for t in range(1, K.size):
        x[:, t] = PHI * x[:, t - 1] + np.sqrt(Q[t - 1]) * rng.standard_normal(runs)
    return x, x + rng.standard_normal(x.shape), K


def run(est, y):
    """Gains and alarms (runs, T)."""
    outs = np.empty((*y.shape, est.n_columns + 2))
    rows = est._rows(est.start(len(y)), is_one=False)
    est.drive(rows, y[..., None].copy(), np.zeros((*y.shape, 0)), outs, est.spec, est.scratch())
    return outs[..., -1], outs[..., 6]
