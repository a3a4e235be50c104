"""Another start is no better for a wrong number on a regressor that it has not seen move."""

import numpy as np
import pytest

import driftwise as dw

RECORDS, SAMPLES, RESTS, AGAIN = 40, 110, 45, 82


def worst_errors(seed: int) -> np.ndarray:
    """Return of each record the largest error from `AGAIN` on, in deviations; y is wrong where the last input moves."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(RECORDS):
        psi = rng.choice([-1.0, 0.0, 0.0, 1.0], (SAMPLES, 3))
        psi[RESTS:AGAIN, 2] = 0.0
        psi[AGAIN, 2] = 1.0
        y = psi @ [1.0, -0.7, 1.2] + 0.3 * rng.standard_normal(SAMPLES)
        wrong = [4, 15, AGAIN, 95]
        y[wrong] += 3.6 * rng.choice([-1.0, 1.0], len(wrong))
        trace = dw.Regression(3, memory=dw.AutoMemory()).scan(y, psi)
        found.append(np.abs(trace.parameters[AGAIN:] - [1.0, -0.7, 1.2]).max() / 0.3)
    return np.array(found)


@pytest.mark.parametrize("seed", [3, 10])
def test_an_outlier_where_an_input_moves_again_moves_no_gain(seed):
    assert (worst_errors(seed) > 4.0).sum() == 0
