"""The simulator: every option is what it says, and what it cannot do it explains."""

import numpy as np
import pytest
import scipy.signal

import driftwise as dw
from driftwise.models.canonical import Canonical

A, B = np.array([-1.5, 0.7]), np.array([1.0, 0.5])


def disturbances(record, u, direct=False):
    """Return (w, w_n, steps of theta) that the record's own truth leaves."""
    y, theta, x = record.y, record.parameters, record.x
    n = x.shape[1]
    u = u.reshape(len(y), -1)
    k = u.shape[1]
    b = theta[:, n : n + n * k].reshape(len(y), k, n)
    v = y - x[:, 0] - (np.sum(theta[:, n + n * k :] * u, axis=1) if direct else 0)
    shifted = np.column_stack([x[:, 1:], np.zeros(len(y))])
    drive = shifted - theta[:, :n] * y[:, None] + np.einsum("tk,tki->ti", u, b)
    return x[1:] - drive[:-1], v[:-1], np.diff(theta, axis=0)


def test_pair_and_truth():
    record = dw.simulate(A, B, samples=50, noise_std=0.1)
    y, u = record
    assert y is record.y and u is record.u and len(record) == 2
    assert record.parameters.shape == (50, 4) and record.x.shape == (50, 2)
    w, v, steps = disturbances(record, u)
    np.testing.assert_allclose(w, 0, atol=1e-12)
    assert not steps.any() and v.std() > 0.05


def test_model_is_the_plant_it_says():
    m = dw.models.Model(Canonical(2, 2, True), np.r_[A, B, 0.2, -0.3, 0.4, 0.1], np.eye(8))
    u = np.random.default_rng(0).standard_normal((60, 2))
    y, back = m.simulate(u)
    same, _ = dw.simulate(A, [B, [0.2, -0.3]], direct=[0.4, 0.1], samples=60, u=u)
    assert np.array_equal(y, same) and np.array_equal(back, u)
    free, none = dw.models.Model(Canonical(2), A, np.eye(2)).simulate(samples=30, x0=[1.0, -0.4])
    expected = [(np.linalg.matrix_power(m.A, t) @ [1.0, -0.4])[0] for t in range(30)]
    np.testing.assert_allclose(free, expected, atol=1e-12)
    assert none is None
    assert np.array_equal(dw.simulate(m, samples=40, seed=3).y, m.simulate(samples=40, seed=3).y)


def test_additions_do_not_move_inputs_and_noise():
    plain = dw.simulate(A, B, samples=300, noise_std=0.1, seed=2)
    more = dw.simulate(A, B, samples=300, noise_std=0.1, seed=2, drift=1e-9, missing=0.2, missing_inputs=0.3)
    known, fed = np.isfinite(more.y), np.isfinite(more.u)
    np.testing.assert_allclose(more.y[known], plain.y[known], atol=1e-5)
    assert np.array_equal(more.u[fed], plain.u[fed])
    assert 0.1 < 1 - known.mean() < 0.3 and 0.2 < 1 - fed.mean() < 0.4
    two = dw.simulate(A, [B, B], samples=2000, missing_inputs=0.25).u
    assert abs(np.isnan(two).mean() - 0.25) < 0.03
    assert abs((np.isnan(two).sum(axis=1) == 1).mean() - 2 * 0.25 * 0.75) < 0.05  # element by element


def test_drift_is_a_walk_of_the_stated_size():
    std = np.array([0.0, 1e-4, 3e-3, 1e-3])
    record = dw.simulate(A, B, samples=20_000, noise_std=0.1, drift=std, seed=4)
    steps = np.diff(record.parameters, axis=0)
    np.testing.assert_allclose(steps.std(axis=0), std, rtol=0.03)  # 20 000 steps: half a percent
    assert record.parameters[0].tolist() == [*A, *B]
    w, _, _ = disturbances(record, record.u)
    np.testing.assert_allclose(w, 0, atol=1e-9)


def test_jumps_set_what_they_name_from_their_sample_on():
    jumps = {30: {"a": [-0.5, 0.1]}, 60: [-0.2, 0.0, 2.0, 1.0], 10: {"b": [0.0, 1.0]}}
    theta = dw.simulate(A, B, samples=100, jumps=jumps).parameters
    assert theta[[9, 10, 29, 30, 59, 60, 99]].tolist() == [
        [-1.5, 0.7, 1, 0.5], [-1.5, 0.7, 0, 1], [-1.5, 0.7, 0, 1], [-0.5, 0.1, 0, 1], [-0.5, 0.1, 0, 1],
        [-0.2, 0, 2, 1], [-0.2, 0, 2, 1],
    ]  # fmt: skip
    walking = dw.simulate(A, B, samples=100, jumps={40: {"a": [-0.5, 0.1]}}, drift=0.01, seed=1).parameters
    assert walking[40, :2].tolist() == [-0.5, 0.1]
    assert walking[40, 2] != 1.0 and abs(walking[41, 0] + 0.5) < 0.05
    direct = dw.simulate([-0.5], [1.0], direct=[0.3], samples=9, jumps={4: {"direct": [0.9]}}).parameters
    assert direct[[3, 4], 2].tolist() == [0.3, 0.9]


def test_noise_covariance_is_drawn_with_its_covariance():
    Q, S, R = np.array([[0.5, 0.1], [0.1, 0.3]]), np.array([0.2, -0.1]), 0.4  # Salut's order: last state measured
    record = dw.simulate([-0.5, 0.1], B, samples=40_000, noise=dw.models.NoiseCovariance(Q, S, R), seed=6)
    w, v, steps = disturbances(record, record.u)
    found = np.cov(np.column_stack([w[:, ::-1], v]).T)
    np.testing.assert_allclose(found, np.block([[Q, S[:, None]], [S, R]]), atol=0.015)  # 5 standard errors
    assert not steps.any()


def test_noise_covariance_may_reach_the_parameters():
    N = 6
    L = np.random.default_rng(7).standard_normal((N + 1, N + 1)) * np.r_[0.3, 0.3, [1e-3] * 4, 0.3][:, None]
    J = L @ L.T
    record = dw.simulate(
        [-0.2, 0.1], B, samples=4000, noise=dw.models.NoiseCovariance(J[:N, :N], J[:N, N], J[N, N]), seed=8
    )
    w, v, steps = disturbances(record, record.u)
    salut = np.column_stack([w[:, ::-1], steps[:, [1, 0]], steps[:, [3, 2]], v])
    unit = np.sqrt(np.diag(J))
    np.testing.assert_allclose(np.cov(salut.T) / np.outer(unit, unit), J / np.outer(unit, unit), atol=0.1)


def test_policies_of_joint_are_understood():
    same = dict(samples=200, seed=9)
    by_name = dw.simulate(A, B, noise="output", noise_std=0.3, **same).y
    assert np.array_equal(by_name, dw.simulate(A, B, noise=dw.models.OutputError(), noise_std=0.3, **same).y)
    by_name = dw.simulate(A, B, d=[0.2, 0.1], noise_std=0.3, **same).y
    assert np.array_equal(
        by_name, dw.simulate(A, B, noise=dw.models.NoisePolynomial([0.1, 0.2]), noise_std=0.3, **same).y
    )
    v = dw.simulate(A, B, noise=dw.models.EquationError(0.09), samples=20_000)
    assert np.std(disturbances(v, v.u)[1]) == pytest.approx(0.3, rel=0.03)
    y, u = dw.simulate(A, B, noise=dw.models.OutputError(0.01), samples=500)
    clean = scipy.signal.lfilter([0, *B], [1, *A], u)
    assert np.std(y - clean) == pytest.approx(0.1, rel=0.15)


@pytest.mark.parametrize(
    "call, words",
    [
        (dict(a=[-2.0], samples=2000, noise_std=1.0), r"unstable there \(largest pole 2\)"),
        (dict(a=A, b=[1.0], samples=5), r"b must list b1..b2"),
        (dict(a=A, b=B), "samples is missing"),
        (dict(a=A, b=B, samples=2.5), "whole number"),
        (dict(a=A, b=B, samples=-1), "whole number"),
        (dict(a=np.zeros((3, 2)), samples=5), r"one row per sample as \(5, n\)"),
        (dict(a=[np.nan], samples=5), "a must be finite"),
        (dict(a=["x"], samples=5), "a must hold numbers"),
        (dict(a=A, b=B, samples=5, u=np.ones(4)), r"u must be \(5, 1\) or \(5,\)"),
        (dict(a=A, b=B, samples=5, direct=[1, 2]), "direct must list b0"),
        (dict(a=A, b=B, samples=5, d=[1.0]), "d must list d1..d2"),
        (dict(a=A, b=B, samples=5, x0=[1.0]), r"x0 must be \(2,\)"),
        (dict(a=A, b=B, samples=5, missing=30), "in percent"),
        (dict(a=A, b=B, samples=5, missing_inputs=-0.1), "missing_inputs is a fraction"),
        (dict(a=A, b=B, samples=5, noise_std=-1), "noise_std is a standard deviation"),
        (dict(a=A, b=B, samples=5, noise="white"), "noise must be 'output', 'equation' or"),
        (dict(a=A, b=B, samples=5, noise=dw.models.OutputError(1.0), noise_std=1.0), "give one of them"),
        (dict(a=A, b=B, samples=5, drift=[1, 2]), "4 for a1, a2, b1, b2"),
        (dict(a=A, b=B, samples=5, drift=-0.1), "drift is a standard deviation"),
        (dict(a=A, b=B, samples=5, jumps={5: [0, 0, 0, 0]}), "sample 5 is none of 0 to 4"),
        (dict(a=A, b=B, samples=5, jumps={2: [0, 0]}), "a jump must list a1, a2, b1, b2"),
        (dict(a=A, b=B, samples=5, jumps={2: {"c": [0]}}), "may name a, b or direct"),
        (dict(a=A, b=B, samples=5, jumps={2: {"a": [0]}}), "the jump of a must list 2"),
        (dict(a=A, b=B, samples=5, jumps=[2]), "jumps must be a dictionary"),
        (dict(a=dw.models.Model(Canonical(2, 1), np.zeros(4), np.eye(4)), b=B, samples=5), "brings its own b"),
    ],
)
def test_wrong_input_is_explained(call, words):
    with pytest.raises(dw.InputError, match=words):
        dw.simulate(**call)
