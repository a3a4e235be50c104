"""The oracles against one another and against what is known exactly."""

from fractions import Fraction

import numpy as np
import pytest

from oracle import dense, exact, golden, ptx


def record(st, T, seed):
    rng = np.random.default_rng(seed)
    return rng.standard_normal(T), rng.standard_normal((T, st.inputs))


def deadbeat(printed, x0, T):
    """Exact outputs of the noise-free system x+ = E x + printed * x_n."""
    x, y = [Fraction(x) for x in x0], []
    for _ in range(T):
        y.append(x[-1])
        x = [shifted + Fraction(a) * x[-1] for shifted, a in zip([0, *x[:-1]], printed, strict=True)]
    return np.array(y)


@pytest.mark.parametrize(("name", "printed"), [("G03", ["0.24", "-1.18", "1.9"]), ("G04", ["0.24", "-1.19", "0.484"])])
def test_deadbeat_is_exact_in_rationals(name, printed):
    given, expected, _ = golden.case(name)
    st = dense.Structure(3)
    y = deadbeat(printed, [-5, 2, 10], 9)
    golden.assert_close(y, given["y"], 1e-15)
    noise = dense.Noise(exact.rational(np.zeros((6, 6), int)), exact.rational([0] * 6), Fraction(0))
    run = dense.run(st, noise, exact.rational([0] * 6), exact.rational(100 * np.eye(6, dtype=int)), y[:5])
    golden.assert_close(-run.s[4][3:], expected["a_printed_after4"], 1e-12)
    golden.assert_close(run.P[4], expected["P_after4"], 1e-12)
    s, P = run.s[4], run.P[4]
    for t in range(5, 9):
        s, P, e, T, _ = dense.step(st, noise, s, P, y[t], [])
        assert (T == e == 0) == (t > 5)
        assert not P.any()
        assert list(-s[3:]) == [Fraction(a) for a in printed]
        if t == 5:
            golden.assert_close(s[:3], expected["x_pred_after5"], 1e-12)


@pytest.mark.parametrize("st", [dense.Structure(1), dense.Structure(2, 1, True), dense.Structure(3, 2)])
@pytest.mark.parametrize("coloured", [False, True])
def test_recursion_is_batch_least_squares(st, coloured):
    """Sections 1.5, 7.9: without parameter walk theorem 3 is ridge regression on data prefiltered by 1/C."""
    rng = np.random.default_rng(st.n)
    y, u = record(st, 40, st.n)
    d = -np.poly(rng.uniform(-0.8, 0.8, st.n))[:0:-1] if coloured else np.zeros(st.n)
    w = np.concatenate([d, np.zeros(st.size - st.n)])
    var = 0.3
    root = rng.standard_normal((st.size, st.size)) / st.size
    s0, P0 = rng.standard_normal(st.size) / 2, root @ root.T + np.eye(st.size)
    run = dense.run(st, dense.Noise(np.outer(w, w) * var, w * var, var), s0, P0, y, u)
    mean, covariance = exact.ridge(st, var, s0, P0, y, u, d)
    golden.assert_close(run.s[-1][st.n :], mean[st.n :], 1e-10)
    golden.assert_close(run.P[-1][st.n :, st.n :], covariance[st.n :, st.n :], 1e-10)


def test_long_arithmetic_agrees_with_doubles():
    given, expected, _ = golden.case("G01")
    noise = dense.Noise(given["Q"], given["S"], given["R"])
    s, P, T = exact.final(dense.Structure(2, 1, True), noise, given["s0"], given["P0"], given["y"], given["u"])
    for got, wanted in ((s, expected["s"][-1]), (P, expected["P"][-1]), (T, expected["T"])):
        golden.assert_close(got, wanted, 1e-15)


def test_quadrature_gives_the_golden_evidence():
    given, expected, _ = golden.case("G16")
    value = exact.evidence_by_quadrature(given["y"], given["d"][0], given["var_v"], given["s0"], given["P0"])
    assert value == pytest.approx(float(expected["loglik"]), abs=1e-12)


def test_missing_sample_by_simulation():
    """G09 checks the moments; this checks that the formula means what its name says, with two inputs."""
    st, draws = dense.Structure(1, 2, True), 400_000
    rng = np.random.default_rng(7)
    root = rng.standard_normal((st.size + 1, st.size + 1)) * 0.4
    joint = root @ root.T
    noise = dense.Noise(joint[:-1, :-1], joint[:-1, -1], joint[-1, -1])
    s0, u = rng.standard_normal(st.size), np.array([0.7, -0.4])
    root = rng.standard_normal((st.size, st.size)) * 0.5
    mean, covariance = dense.missing_step(st, noise, s0, root @ root.T, u)
    s = s0 + rng.standard_normal((draws, st.size)) @ root.T
    w = rng.multivariate_normal(np.zeros(st.size + 1), joint, draws)
    y = s @ dense.row(st, u) + w[:, -1]
    after = s + w[:, :-1]
    after[:, 0] = -s[:, 1] * y + s[:, 2:4] @ u + w[:, 0]
    standard = np.sqrt(np.diag(covariance))
    assert np.abs((after.mean(axis=0) - mean) / standard).max() < 5 / np.sqrt(draws)
    assert np.abs((np.cov(after.T) - covariance) / np.outer(standard, standard)).max() < 0.02


@pytest.mark.parametrize("st", [dense.Structure(1), dense.Structure(2, 1, True), dense.Structure(3, 2)])
def test_output_error_with_known_a_is_the_polynomial_c_equal_a(st):
    """Without doubt about a the simulation model is linear, and theorem 3 with d = a is exact."""
    rng = np.random.default_rng(st.n)
    y, u = record(st, 40, st.n)
    a, R = np.poly(rng.uniform(-0.8, 0.8, st.n))[:0:-1], 0.3
    s0 = rng.standard_normal(st.size)
    root = rng.standard_normal((st.size, st.size))
    s0[st.n : 2 * st.n], root[st.n : 2 * st.n] = a, 0.0
    w = np.concatenate([a, np.zeros(st.size - st.n)])
    expected = dense.run(st, dense.Noise(np.outer(w, w) * R, w * R, R), s0, root @ root.T, y, u)
    got = dense.run(st, dense.OutputError(R), s0, root @ root.T, y, u)
    golden.assert_close(got.s[-1], expected.s[-1], 1e-10)
    golden.assert_close(got.P[-1], expected.P[-1], 1e-10)
    assert got.loglik == pytest.approx(expected.loglik, rel=1e-12)


@pytest.mark.parametrize("measured", [True, False])
def test_output_error_by_simulation(measured):
    """One step from Gaussian s(t | t - 1): draws weighted by the likelihood of y, moved by the model itself."""
    st, draws, R, u = dense.Structure(2, 1, True), 1_000_000, 1.5, np.array([0.7])
    rng = np.random.default_rng(9)
    s0, root = rng.standard_normal(st.size), rng.standard_normal((st.size, st.size)) * 0.4
    y = dense.row(st, u) @ s0 + 0.5 if measured else np.nan
    got = dense.output_error_step(st, R, s0, root @ root.T, y, u)
    s = s0 + rng.standard_normal((draws, st.size)) @ root.T
    clean = s @ dense.row(st, u)
    weight = np.exp(-0.5 * (y - clean) ** 2 / R) if measured else np.ones(draws)
    after = s.copy()
    after[:, 0] = -s[:, 2] * clean + s[:, 4] * u
    after[:, 1] = s[:, 0] - s[:, 3] * clean + s[:, 5] * u
    standard = np.sqrt(np.diag(got.P))
    mean, covariance = np.average(after, axis=0, weights=weight), np.cov(after.T, aweights=weight)
    assert np.abs((mean - got.s) / standard).max() < 0.01
    assert np.abs((covariance - got.P) / np.outer(standard, standard)).max() < 0.02


def test_ptx_runs_as_its_manual_says():
    code = """
.visible .entry sum(
	.param .u64 sum_param_0,
	.param .u64 sum_param_1
)
{
	.reg .pred 	%p<3>;
	ld.param.u64 	%rd1, [sum_param_4];
	ld.param.u64 	%rd2, [sum_param_5];
	mov.u32 	%r1, %tid.x;
	mul.wide.s32 	%rd5, %r1, 8;
	add.s64 	%rd1, %rd1, %rd5;
	mov.u64 	%rd3, 0;
	mov.f64 	%fd1, 0d3FB999999999999A;

$L__BB0_1:
	fma.rn.f64 	%fd1, %fd1, %fd1, 0dBF847AE147AE147B;
	ld.global.f64 	%fd2, [%rd1];
	setp.leu.f64 	%p2, %fd2, 0d0000000000000000;
	selp.f64 	%fd2, 0dBFF0000000000000, %fd2, %p2;
	max.f64 	%fd2, %fd2, 0d7FF8000000000000;
	st.global.f64 	[%rd1], %fd2;
	add.s64 	%rd3, %rd3, 1;
	setp.lt.s64 	%p1, %rd3, %rd2;
	@%p1 bra 	$L__BB0_1;

	setp.gt.s32 	%p1, %r1, 1;
	@!%p1 bra 	$L__BB0_2;
	st.global.f64 	[%rd1], %fd1;

$L__BB0_2:
	ret;
}
"""
    numbers = np.array([np.nan, 3.0, 5.0])
    ptx.launch(code, [numbers], threads=3)
    once = 0.1  # squared, less 0.01, rounded once: three times
    for _ in numbers:
        once = float(Fraction(once) ** 2 - Fraction(0.01))
    # what is NaN is not above zero, and loses against a number
    np.testing.assert_array_equal(numbers, [-1.0, 3.0, once])
