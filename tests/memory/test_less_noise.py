"""Some wrong numbers in a row look like louder noise; those that follow show that it is none."""

import numpy as np

import driftwise as dw

RECORDS, BURST = 12, 400
A, SIGMA = (-1.2, 0.5), 0.1


def records(seed: int, size: float):
    """Return outputs of an AR(2) with 3 % of wrong numbers, and eight among twelve samples."""
    rng = np.random.default_rng(seed)
    for _ in range(RECORDS):
        y, e = np.zeros(1200), SIGMA * rng.standard_normal(1200)
        for k in range(2, y.size):
            y[k] = e[k] - A[0] * y[k - 1] - A[1] * y[k - 2]
        wrong = rng.uniform(size=y.size) < 0.03
        wrong[BURST + rng.permutation(12)[:8]] = True
        yield y + wrong * size * SIGMA * rng.choice([-1.0, 1.0], y.size)


def test_sigma_returns_soon_after_a_burst_of_wrong_numbers():
    after, late = slice(BURST + 100, BURST + 200), 0
    est = dw.ARX(2, (), memory=dw.AutoMemory())
    for seed in range(100, 120):
        late += sum(np.median(est.scan(y).variance[after]) > 3.0 * SIGMA**2 for y in records(seed, 14.0))
    assert late <= 20  # of 240: 34 of 720 are; 134 of 720 if no quieter filter ever begins
