"""Recorded plants: the batch fit is the dense Gaussian's, and what `GreyBox` meets on recordings it goes on meeting."""

import os
from pathlib import Path

import numpy as np
import pytest
from driftwise_studies.score.tasks import physical
from driftwise_studies.score.tasks.prediction_error import fit, innovations
from scipy.linalg import expm
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


@pytest.mark.slow
@pytest.mark.parametrize("file", physical.TASKS)
def test_what_is_met_on_recordings(file):
    """Missed, and known: a viscous friction 3.07 % off, and end values beyond bars that take residuals for white."""
    if not (FOLDER / file).exists():
        pytest.skip(f"{FOLDER / file} is not there; set DRIFTWISE_DATA to the folder of recordings")
    missed = {"carriage: Fv", *(f"{name}: ours (batch)" for name in ("carriage", "cell"))}
    found = physical.TASKS[file](FOLDER)
    assert found and all(verdict.confirmed for verdict in found if verdict.name not in missed), found
