"""Louder noise among outliers is told, though each of these begins another trial; parameters that rest stay."""

import numpy as np
import pytest

import driftwise as dw

STEP, SAMPLES, RECORDS, N = 900, 1300, 60, 3


def records(seed: int, times: float, share: float):
    """Return regressors and outputs of parameters that are 1, whose noise becomes louder among wrong numbers."""
    rng = np.random.default_rng(seed)
    for _ in range(RECORDS):
        psi = rng.choice([-1.0, 1.0], (SAMPLES, N))
        sigma = np.where(np.arange(SAMPLES) < STEP, 1.0, times)
        e = sigma * rng.standard_normal(SAMPLES)
        wrong = 20.0 * sigma * rng.choice([-1.0, 1.0], SAMPLES) * (rng.random(SAMPLES) < share)
        yield psi, psi.sum(axis=1) + e + wrong


@pytest.mark.parametrize("seed", [1, 2])
def test_what_is_known_survives_louder_noise_among_outliers(seed):
    """The fast filter followed it in one record of eight, for hundreds of samples."""
    est = dw.Regression(N, memory=dw.AutoMemory())
    squares, soon = [], 0
    for times in (2.0, 2.5):
        for psi, y in records(seed, times, 0.04):
            trace = est.scan(y, psi)
            squares.append(((trace.parameters[STEP + 50 :] - 1.0) ** 2).mean())
            soon += np.any(trace.status[STEP : STEP + 60] & int(dw.Status.NOISE))
    assert np.sqrt(np.mean(squares)) < 0.1 and soon >= 0.75 * 2 * RECORDS  # .13 to .17, .58 to .67
