"""Bars where residuals are not white: held against the exact variance of a weighted sum of coloured noise."""

import numpy as np
import pytest
from scipy.linalg import toeplitz

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.estimators.grey_box import colour

T = 2000


def coloured(kind, rng, samples=T):
    """Return noise (samples,) of variance one, and its correlations by lag."""
    lags = np.arange(samples)
    if kind == "white":
        return rng.standard_normal(samples), 1.0 * (lags == 0)
    if kind == "regression":
        e = rng.standard_normal(samples)
        for k in range(1, samples):
            e[k] = 0.8 * e[k - 1] + 0.6 * e[k]
        return e, 0.8**lags
    return np.convolve(rng.standard_normal(samples + 7), np.ones(8) / 8**0.5, "valid"), np.maximum(1 - lags / 8, 0)


def factors(kind, count=20):
    """Return the factors that are found of sums with weights of three kinds, and what they truly are."""
    rng, found, truth = np.random.default_rng(3), [], []
    for _ in range(count):
        nu, by_lag = coloured(kind, rng)
        w = np.stack(
            [np.ones(T), np.repeat(rng.choice([-1.0, 1.0], T // 20), 20), rng.standard_normal(T)], axis=1
        )  # of a mean, of a gain while an input is switched, and of a gain with a white input
        state = {
            "chain": np.zeros((1, colour.WEIGHTS + 6)),
            "blocks": np.zeros((colour.LEVELS * colour.KEPT, 3)),
            "counted": np.zeros(1),
        }
        colour.fill(state, nu[:, None], w[:, None])
        found.append([colour.factor_of(state["blocks"], j) for j in range(3)])
        if len(truth) < 3:
            truth.append(np.einsum("tj,tj->j", w, toeplitz(by_lag) @ w) / (w**2).sum(axis=0))
    return np.array(found), np.mean(truth, axis=0)


@pytest.mark.parametrize("kind, most", [("regression", 1.15), ("moving", 1.45)])
def test_factors_of_coloured_noise_are_those_of_its_correlations(kind, most):
    """A moving average is no regression on the noise before: blocks correct what that says, as far as they are long."""
    found, truth = factors(kind)
    assert truth[0] > 5 and truth[2] == pytest.approx(1.0, rel=0.1)
    ratio = found / truth
    assert np.all(ratio.mean(axis=0) > 0.85) and np.all(ratio.mean(axis=0) < most) and np.all(ratio.std(axis=0) < 0.3)


def test_white_noise_is_left_alone():
    found, _ = factors("white")
    assert np.mean(found > 1) < 0.05 and found.max() < 1.5


def test_blocks_taken_one_by_one_are_those_taken_at_once():
    rng, blocks = np.random.default_rng(1), np.zeros((colour.LEVELS * colour.KEPT, 2))
    c, v = rng.standard_normal((77, 2)), rng.random((77, 2))
    for k in range(77):
        colour.take_blocks(blocks, k + 1.0, c[k].copy(), v[k].copy())
    sums = [colour.TOTAL, colour.MEAN, colour.SQUARE]
    own, at_once = (one.reshape(colour.LEVELS, colour.KEPT, 2) for one in (blocks, colour._blocks(c, v)))
    assert np.allclose(own[:, sums], at_once[:, sums])
    pairs = c[:76].reshape(38, 2, 2).sum(axis=1)
    assert np.allclose(own[1, colour.TOTAL], (pairs**2).sum(axis=0))
    odd = [level for level in range(colour.LEVELS) if (77 >> level) % 2]
    assert np.allclose(own[odd], at_once[odd])


def test_bars_of_a_plant_are_wider_where_its_noise_is_coloured_and_only_there():
    u = np.repeat(np.random.default_rng(1).choice([-1.0, 0.0, 1.0], 60), 10)
    est, truth = dw.GreyBox("battery"), {"R0": 0.02, "R1": 0.015, "C1": 1500.0}
    clean = est.simulate(u, truth, noise=0.0)
    off, wide = {}, {}
    for kind in ("white", "regression"):
        rng, z = np.random.default_rng(5), []
        for _ in range(4):
            trace = est.scan(clean + 5e-4 * coloured(kind, rng, len(u))[0], u)
            std = np.sqrt(np.diag(est.covariance(trace.state)))[2:]
            z.append((trace.state["theta"] - est.transformed(truth)) / std)
            assert np.allclose(trace.transformed[1][-1], std)
        off[kind], wide[kind] = np.sqrt(np.mean(np.square(z))), np.array(trace.state["wide"])
    assert np.all(wide["regression"] > 2) and wide["white"].max() < 1.6
    assert 0.5 < off["white"] < 1.3 and 0.5 < off["regression"] < 1.5


def test_what_is_known_of_the_colour_goes_along_with_a_stream():
    u = np.repeat(np.random.default_rng(1).choice([-1.0, 0.0, 1.0], 30), 10)
    est = dw.GreyBox("battery")
    y = est.simulate(u, noise=0.0) + 5e-4 * coloured("regression", np.random.default_rng(2), len(u))[0]
    y[[40, 270]] = np.nan
    whole, first = est.scan(y, u), est.scan(y[:251], u[:251])
    assert same(est.scan(y[251:], u[251:], state=first.state).state, whole.state)


def test_coloured_noise_is_no_jump():
    """Of white residuals the likelihoods of these records would tell sixteen."""
    u = np.repeat(np.random.default_rng(1).choice([-1.0, 0.0, 1.0], 60), 10)
    est, rng = dw.GreyBox("battery", jumps="fit"), np.random.default_rng(7)
    for _ in range(3):
        assert est.scan(est.simulate(u, noise=0.0) + 5e-4 * coloured("regression", rng, len(u))[0], u).jumps() == []
