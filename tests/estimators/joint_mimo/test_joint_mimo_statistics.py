"""Error bars of several outputs mean what they say: squared error over covariance, per parameter, over 200 records."""

import numpy as np
import pytest
from draws import slow
from oracle.by_name import by_name

import driftwise as dw

RECORDS, SAMPLES = 200, 150
CENTRE = np.array([-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.4])  # (2, 1), one input
WIDTH, STD = 0.07, (0.3, 0.2)
Q, S = np.zeros((3, 3)), np.zeros((3, 2))
LINKED = dw.models.NoiseCovariance(Q, S, [[0.09, 0.054], [0.054, 0.04]])  # correlation .9
APART = dw.models.EquationError(np.square(STD))


def nees(noise, assumed, missing=0.0, split=None, only=slice(None)):
    """Mean over records whose parameters and first state are drawn from the prior: the theory says 1."""
    est = dw.JointMIMO((2, 1), 1)
    P0 = np.concatenate([np.full(3, 0.1), np.full(9, WIDTH)]) ** 2
    s0 = np.concatenate([np.zeros(3), CENTRE])[est.model.salut]  # (the way back is the same)
    est = dw.JointMIMO((2, 1), 1, noise=assumed, s0=by_name(est, s0), P0=by_name(est, P0), split=split)
    found = []
    for seed in range(RECORDS):
        rng = np.random.default_rng(10**5 + seed)
        theta, x0 = CENTRE + WIDTH * rng.standard_normal(9), 0.1 * rng.standard_normal(3)
        given = dict(noise=noise) if isinstance(noise, dw.models.NoiseCovariance) else dict(noise_std=STD)
        y, u = dw.models.simulate_mimo(
            (2, 1), theta, samples=SAMPLES, inputs=1, u=rng.standard_normal(SAMPLES), x0=x0, missing=missing,
            seed=seed, **given,
        )  # fmt: skip
        m = est.scan(y, u, keep="innovations").model()
        error = (m.values - theta)[only]
        found.append(error @ np.linalg.solve(m.covariance[only, only], error) / len(error))
    return np.mean(found)


@pytest.mark.parametrize(
    "noise, split, missing, low, high",
    [
        pytest.param(APART, None, 0.0, 0.9, 1.1, id="split"),
        pytest.param(LINKED, None, 0.3, 0.8, 1.3, id="linked, lost"),
        slow(APART, None, 0.3, 0.8, 1.3, id="split, lost"),
        slow(APART, False, 0.0, 0.9, 1.1, id="coupled"),
        slow(APART, False, 0.3, 0.8, 1.3, id="coupled, lost"),
        slow(LINKED, None, 0.0, 0.9, 1.1, id="linked"),
    ],
)
def test_error_bars_are_honest(noise, split, missing, low, high):
    """Complete: exact, so 1 with a standard error of sqrt(2 / 9 / 200) = .033; 30 % of each output lost: moments."""
    value = nees(noise, noise, missing, split)
    print(f"{'linked' if noise is LINKED else 'apart'}, split {split}, lost {missing:.0%}: {value:.3f} per parameter")
    assert low < value < high


@pytest.mark.slow
def test_splitting_linked_noise_is_wrong():
    """Where w_n1 and w_n2 are correlated, y_1(t) is no innocent regressor of y_2(t): split, a0.21 is biased."""
    a0 = slice(8, 9)
    right, wrong = nees(LINKED, LINKED, only=a0), nees(LINKED, APART, only=a0)
    print(f"a0.21, noises correlated by .9: coupled {right:.2f}, split {wrong:.0f}")
    assert 0.7 < right < 1.3  # one degree of freedom, standard error .1
    assert wrong > 10


@pytest.mark.parametrize("lost_y", [slow(0.0), 0.2])
def test_lost_inputs_with_a_direct_term(lost_y):
    """The case where one output is not `Joint`: the error of a held input stays an unknown that y(t) tells about.

    20 % of white inputs lost, direct term 1.5 (as in test_missing_inputs.py, which bounds `Joint` by 2.2).
    """
    truth, total = np.array([-1.2, 0.5, 1.0, 0.5, 1.5]), 0.0
    for seed in range(RECORDS):
        rng = np.random.default_rng(10**6 + seed)
        u = rng.standard_normal(300)
        y, _ = dw.simulate(truth[:2], truth[2:4], direct=1.5, samples=300, noise_std=0.3, u=u, seed=seed)
        u[rng.random(300) < 0.2] = np.nan
        y[rng.random(300) < lost_y] = np.nan
        m = dw.JointMIMO(2, 1, True, noise=dw.models.EquationError(0.09), P0=100.0).scan(y, u).model()
        error = m.values - truth
        total += error @ np.linalg.solve(m.covariance, error) / len(truth)
    print(f"inputs lost 20%, outputs lost {lost_y:.0%}: {total / RECORDS:.2f} per parameter")
    assert 0.8 < total / RECORDS < 1.5
