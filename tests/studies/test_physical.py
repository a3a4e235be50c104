"""Recorded plants: the batch fit is the dense Gaussian's, and what `GreyBox` meets on recordings it goes on meeting."""

import os
from pathlib import Path

import numpy as np
import pytest
from driftwise_studies.score.tasks import carriage_batch, physical
from driftwise_studies.score.tasks.prediction_error import deviations, fit, innovations
from scipy.linalg import expm
from scipy.signal import lfilter
from scipy.stats import multivariate_normal

FOLDER = Path(os.environ.get("DRIFTWISE_DATA", Path(__file__).parents[3] / "shared" / "data")) / "sysid"


def solder(samples, seed=0):
    """Return instants, inputs and outputs of the plant `SOLDER`, and the mean and covariance of these outputs."""
    rng, tau, W, r = np.random.default_rng(seed), 50.0, 0.45**2, 0.67**2
    t, u = np.cumsum(rng.uniform(0.5, 9.0, samples)), rng.choice([150.0, 450.0], samples)
    mean, P, step = np.array([200.0]), np.zeros((samples, samples)), []
    for k in range(samples - 1):
        f = float(expm(np.array([[-(t[k + 1] - t[k]) / tau]]))[0, 0])
        mean = np.append(mean, f * mean[-1] + (1 - f) * (50 + 0.5 * u[k]))
        step.append((f, W * tau / 2 * (1 - f**2)))
    P[0, 0] = 25.0
    for k, (f, q) in enumerate(step):
        P[k + 1, : k + 1] = P[: k + 1, k + 1] = f * P[k, : k + 1]
        P[k + 1, k + 1] = f**2 * P[k, k] + q
    V = P + r * np.eye(samples)
    return t, u, mean, V, rng.multivariate_normal(mean, V)


def test_innovations_of_the_batch_fit_are_those_of_the_dense_gaussian():
    t, u, mean, V, y = solder(40)
    y[7] = np.nan
    e, S = innovations(physical.batch("solder", 0.45, 0.67), np.zeros((1, 3)), t, u, y)
    there = np.isfinite(y)
    loglik = -0.5 * np.sum(e[there] ** 2 / S[there] + np.log(2 * np.pi * S[there]))
    assert loglik == pytest.approx(multivariate_normal(mean[there], V[np.ix_(there, there)]).logpdf(y[there]))


def test_a_batch_fit_finds_a_simulated_plant_within_its_bars():
    t, u, *_, y = solder(250, seed=1)
    found = fit(physical.batch("solder", 0.45, 0.67), t, u, y)
    for name, true in (("gain", 0.5), ("tau", 50.0), ("ambient", 50.0)):
        assert abs(found.values[name] - true) < 3 * found.bars[name] < 0.6 * true


def test_bars_of_a_fit_are_as_wide_as_correlated_residuals_make_them_and_white_ones_leave_them():
    rng, errors = np.random.default_rng(0), {0.0: [], 0.8: []}
    X = np.column_stack([np.ones(600), np.repeat(rng.standard_normal(60), 10)])
    for rho, found in errors.items():
        for _ in range(200):
            e = lfilter([1.0], [1.0, -rho], rng.standard_normal(900))[300:]
            e /= np.std(e)
            b = np.linalg.lstsq(X, e, rcond=None)[0]
            std, white = deviations(-X, e - X @ b, 600)
            found.append([b[0] / std[0], b[0] / white[0]])
    own, white = np.mean(np.square(errors[0.8]), axis=0)
    assert own < 1.5 and white > 6
    assert 0.5 < np.mean(np.square(errors[0.0]), axis=0)[0] < 1.2


def test_the_carriage_by_batch_is_found_within_its_bars_of_thinned_positions():
    rng, dt, T = np.random.default_rng(0), 0.01, 3000
    u = np.repeat(rng.choice([-4.0, 0.0, 4.0], T // 50), 50) + np.sin(0.03 * np.arange(T))
    q, v, y = 0.0, 0.0, np.empty(T)
    for k in range(T):
        y[k] = q + 1e-6 * rng.standard_normal()
        a = (carriage_batch.GAIN * u[k] - 180.0 * v - 22.0 * np.sign(v) + 3.0) / 90.0
        q, v = q + dt * v + 0.5 * dt * dt * a, v + dt * a + 3e-3 * np.sqrt(dt) * rng.standard_normal()
    y[np.arange(T) % 3 > 0] = np.nan
    found = carriage_batch.fit(u, y, 3e-3, 1e-6, dt)
    for name, true in (("M", 90.0), ("Fv", 180.0), ("Fc", 22.0), ("offset", -3.0)):
        assert abs(found.values[name] - true) < 3 * found.bars[name] < 0.2 * abs(true)


@pytest.mark.slow
@pytest.mark.parametrize("file", physical.TASKS)
def test_what_is_met_on_recordings(file):
    if not (FOLDER / file).exists():
        pytest.skip(f"{FOLDER / file} is not there; set DRIFTWISE_DATA to the folder of recordings")
    found = physical.TASKS[file](FOLDER)
    assert found and all(verdict.confirmed for verdict in found), found
