"""Acceptance checks of the joint filter: numerics that hold exactly, statistics that hold on average.

Seeds are fixed. The confidence of a statistical bound is stated where it is not many standard errors wide.
"""

import numpy as np
import pytest
from oracle import dense, exact, golden
from oracle.simulate import canonical, polynomial_noise
from scipy import stats

import driftwise as dw

# section 3.2 of the paper prints -a: poles .5 .6 .8, noise zeros .2 .4 .7
PRINTED = np.array([0.24, -1.18, 1.9])
TRUE_D = np.array([-0.056, 0.5, -1.3])


# --- numerics ----------------------------------------------------------------------------------------------


def second_order_record(T, seed, scale=1.0):
    """n = 2 with input and direct term, equation error R = .09."""
    rng = np.random.default_rng(seed)
    u = rng.standard_normal((1, T))
    noise = np.zeros((1, T, 2)), 0.3 * rng.standard_normal((1, T))
    y, _ = canonical(np.array([0.7, -1.5]), *noise, np.array([0.5, 1.0]), u, direct=0.2)
    return y[0] * scale, u[0]


@pytest.mark.parametrize("form", ["ud", "array"])
def test_huge_prior(form):
    """P0 = 1e16 I: the printed recursion breaks down (T <= 0); factored forms keep 12 digits."""
    y, u = second_order_record(200, 1)
    st, R, P0 = dense.Structure(2, 1, True), 0.09, 1e16
    noise = dense.Noise(np.zeros((7, 7)), np.zeros(7), R)
    s, P, T = exact.final(st, noise, np.zeros(7), P0 * np.eye(7), y, u, digits=60)
    est = dw.Joint(2, 1, True, noise=dw.models.EquationError(R), P0=P0, form=form)
    trace = est.scan(y, u, keep="covariance")
    assert np.abs(est.mean(trace.state) - s).max() <= 1e-12
    golden.assert_close(est.covariance(trace.state), P, 1e-12)
    assert trace.variance.min() > 0
    assert np.abs(trace.variance / T - 1).max() < 1e-4  # the first T are of size 1e16, and of R once s is known
    eigenvalues = np.linalg.eigvalsh(trace.covariance)
    assert np.all(eigenvalues[:, 0] >= -1e-14 * eigenvalues[:, -1])


def test_the_textbook_form_does_break_on_the_huge_prior():
    y, u = second_order_record(200, 1)
    noise = dense.Noise(np.zeros((7, 7)), np.zeros(7), 0.09)
    with np.errstate(all="ignore"):
        run = dense.run(dense.Structure(2, 1, True), noise, np.zeros(7), 1e16 * np.eye(7), y, u)
    assert min(run.T) <= 0


@pytest.mark.parametrize("form", ["ud", "array"])
def test_scaling_the_output_by_a_power_of_two_changes_no_bit(form):
    c = 2.0**30
    y, u = second_order_record(200, 2)
    y[[5, 60, 61]] = np.nan
    unit = np.array([1, 1, 0, 0, 1, 1, 1.0])  # x and b carry the unit of y, a does not

    def run(c):
        noise, units = dw.models.EquationError(0.09 * c**2), c**unit
        est = dw.Joint(2, 1, True, noise=noise, P0=5 * units**2, memory=dw.RandomWalk(1e-6 * units[2:] ** 2), form=form)
        trace = est.scan(c * y, u)
        state = trace.state
        mean, covariance = est.mean(state) / units, est.covariance(state) / np.outer(units, units)
        return mean, covariance, trace.prediction / c, trace.variance / c**2, trace.parameters_std / units[2:]

    for plain, scaled in zip(run(1.0), run(c), strict=True):
        assert np.array_equal(plain, scaled, equal_nan=True)


def test_default_prior_follows_the_scale_of_the_data():
    c, k = 2.0**30, 2.0**-12
    y, u = second_order_record(200, 3)
    plain = dw.Joint(2, 1, True).scaled_to(y, u)
    scaled = dw.Joint(2, 1, True).scaled_to(c * y, k * u)
    units = np.array([c, c, 1, 1, c / k, c / k, c / k])
    expected, got = plain.scan(y, u), scaled.scan(c * y, k * u)
    assert np.array_equal(plain.mean(expected.state), scaled.mean(got.state) / units)
    assert np.array_equal(expected.prediction, got.prediction / c)


@pytest.mark.parametrize("form", ["ud", "array"])
def test_growing_signal_is_held_by_the_floor(form):
    """|y| reaches 1e28 and its round-off 1e12, far above R = 1: it destroys the weak direction."""
    printed = np.array([0.24, -1.19, 0.484])
    y, _ = canonical(-printed, np.zeros((1, 1000, 3)), np.zeros((1, 1000)), x0=[-5.0, 2.0, 10.0])

    def error(floor):
        est = dw.Joint(3, noise=dw.models.EquationError(1.0), P0=1e12, floor=floor, form=form)
        trace = est.scan(y[0])
        return np.abs(-est.mean(trace.state)[3:] - printed).max(), trace.status

    with_floor, status = error(1e-12)
    assert with_floor <= 1e-6
    assert status[-1] & dw.Status.FLOORED
    assert not status[0] & dw.Status.FLOORED
    assert error(0.0)[0] > 1e-3


@pytest.mark.parametrize("form", ["ud", "array"])
def test_recursion_equals_batch_least_squares(form):
    """Without parameter walk: prefilter y and u by 1/C, add the columns of x(0), one least squares."""
    rng = np.random.default_rng(11)
    T, st, b = 2000, dense.Structure(3, 1, True), np.array([0.3, -0.5, 1.0])
    u = rng.standard_normal((1, T))
    y, _ = canonical(-PRINTED, *polynomial_noise(TRUE_D, rng.standard_normal((1, T))), b, u, direct=0.4)
    s0, P0 = np.zeros(st.size), 100 * np.eye(st.size)
    mean, covariance = exact.ridge(st, 1.0, s0, P0, y[0], u[0], TRUE_D)
    est = dw.Joint(3, 1, True, noise=dw.models.NoisePolynomial(TRUE_D, 1.0), s0=s0, P0=P0, form=form)
    state = est.scan(y[0], u[0]).state
    assert np.abs(est.mean(state)[3:] - mean[3:]).max() <= 1e-9
    assert np.abs(est.covariance(state)[3:, 3:] - covariance[3:, 3:]).max() <= 1e-9


# --- statistics --------------------------------------------------------------------------------------------


def printed_records(seeds=300, T=1000):
    v = np.random.default_rng(1979).standard_normal((seeds, T))
    return canonical(-PRINTED, *polynomial_noise(TRUE_D, v))


def over_records(est, y, u=None):
    """A trace per record."""
    return [est.scan(y[i], *([] if u is None else [u[i]])) for i in range(len(y))]


def final_means(est, traces):
    return np.array([est.mean(trace.state) for trace in traces])


def ljung_box(e, lags=10):
    """p-value without degrees-of-freedom correction: recursive innovations are white as they come."""
    T, e = len(e), e - e.mean()
    r = np.array([e[k:] @ e[:-k] for k in range(1, lags + 1)]) / (e @ e)
    return stats.chi2.sf(T * (T + 2) * np.sum(r**2 / (T - np.arange(1, lags + 1))), lags)


def rejection_rate(traces):
    return np.mean([ljung_box(t.innovation / np.sqrt(t.variance)) < 0.01 for t in traces])


@pytest.fixture(scope="module")
def records():
    return printed_records()


def run_with(d, records):
    est = dw.Joint(len(d), noise=dw.models.NoisePolynomial(d, 1.0), P0=100.0)
    traces = over_records(est, records[0])
    return -final_means(est, traces)[:, len(d) :], traces


def relative_state_error(traces, records, settled=500):
    """Error of x(t | t) over the standard deviation of x, per component x_1..x_n."""
    estimate = np.array([trace.x for trace in traces])[:, settled:, ::-1]  # a trace has the measured state first
    x = records[1][:, settled:-1, -estimate.shape[-1] :]
    return np.sqrt(np.mean((estimate - x) ** 2, axis=(0, 1))) / x.std(axis=(0, 1))


def mean_square(traces, settled=500):
    return np.mean([trace.innovation[settled:] ** 2 for trace in traces])


def mahalanobis2(vector, cloud):
    gap = np.asarray(vector) - cloud.mean(axis=0)
    return gap @ np.linalg.solve(np.cov(cloud.T), gap)


def test_paper_test_1(records):
    """True d: the distribution of the estimate, the paper's own draw inside it, white innovations."""
    a, traces = run_with(TRUE_D, records)
    assert np.all(np.abs(a.mean(axis=0) - [0.2387, -1.1753, 1.8956]) <= [0.008, 0.014, 0.008])
    assert np.all(np.abs(a.std(axis=0) / [0.0307, 0.0562, 0.0307] - 1) <= 0.15)  # 3.7 standard errors
    assert mahalanobis2([0.18, -1.05, 1.83], a) < 11.34
    assert rejection_rate(traces) < 0.04  # nominal .01 in 300 records: exceeded with probability 1e-5
    assert mean_square(traces) == pytest.approx(1.004, abs=0.015)
    nis = np.mean([trace.innovation**2 / trace.variance for trace in traces])
    assert nis == pytest.approx(1.0, abs=0.01)  # 300 000 chi2(1): 4 standard errors


def test_paper_test_2(records):
    """A wrong d: it converges to the wrong place, predicts position well, and whiteness says so."""
    a, traces = run_with([0.5, 0.06, 0.5], records)
    limit = golden.case("G13")[1]["a_star"][1]
    assert np.all(np.abs(a.mean(axis=0) - limit) <= 0.01)
    assert relative_state_error(traces, records) == pytest.approx([1.89, 1.58, 0.38], abs=0.03)
    assert mean_square(traces) == pytest.approx(1.125, abs=0.03)
    assert rejection_rate(traces) > 0.99


def test_paper_test_3(records):
    a, _ = run_with([-0.125, 0.75, -1.5], records)
    assert np.all(np.abs(a.mean(axis=0) - [0.3839, -1.5025, 2.0843]) <= [0.008, 0.014, 0.008])
    assert mahalanobis2([0.33, -1.39, 2.02], a) < 11.34


def test_paper_test_4(records):
    """An order too low."""
    a, traces = run_with([0.25, -1.0], records)
    assert np.all(np.abs(a.mean(axis=0) - [-0.6219, 1.5420]) <= 0.008)
    assert relative_state_error(traces, records)[-1] < 0.15
    assert mean_square(traces) == pytest.approx(1.012, abs=0.015)


def lightly_damped(seeds, T, sigma, seed, *, output_error):
    """n = 2, poles .85 exp(+-.5i), white input; sigma is either equation or measurement noise."""
    rng = np.random.default_rng(seed)
    a, b = np.array([0.85**2, -1.7 * np.cos(0.5)]), np.array([0.5, 1.0])
    u, v = rng.standard_normal((2, seeds, T))
    noise = polynomial_noise(a if output_error else np.zeros(2), sigma * v)
    y, _ = canonical(a, *noise, b, u)
    return y, u, np.concatenate([a, b])


def nees_each(est, states, truth):
    """Normalised squared error of the parameters over their number, per record."""
    n = est.model.n
    errors = [est.mean(state)[n:] - truth for state in states]
    blocks = [est.sigma2(state) * est.covariance(state)[n:, n:] for state in states]
    return np.array([e @ np.linalg.solve(P, e) for e, P in zip(errors, blocks, strict=True)]) / len(truth)


def nees(est, states, truth):
    return nees_each(est, states, truth).mean()


@pytest.mark.parametrize("form", ["ud", "array"])
def test_missing_outputs_leave_honest_error_bars(form):
    """30 % missing, 100 records, four parameters: the mean NEES has standard error .07."""
    y, u, truth = lightly_damped(100, 400, 0.5, 21, output_error=False)
    y[np.random.default_rng(22).random(y.shape) < 0.3] = np.nan
    est = dw.Joint(2, 1, noise=dw.models.EquationError(0.25), P0=1.0, form=form)
    early = [trace.state for trace in over_records(est, y[:, :100], u[:, :100])]
    late = [trace.state for trace in over_records(est, y, u)]
    assert 0.8 < nees(est, early, truth) < 1.3
    assert 0.8 < nees(est, late, truth) < 1.3


def test_student_bands_cover_what_they_say():
    """2000 records of 8 samples with random scale, parameters from the prior: 16 000 independent trials.

    95 % bands; the standard error of the rate is .0017, the bound 3.5 of them.
    """
    rng = np.random.default_rng(31)
    records, T, alpha, beta = 2000, 8, 2.0, 1.0
    sigma = np.sqrt(beta / rng.gamma(alpha, size=records))[:, None]
    s0, P0 = np.array([0.0, 0.0, 0.3, -0.8, 0.5, 1.0]), np.array([1.0, 1, 0.04, 0.04, 0.2, 0.2])
    s = s0 + sigma * np.sqrt(P0) * rng.standard_normal((records, 6))
    u = rng.standard_normal((records, T))
    noise = np.zeros((records, T, 2)), sigma * rng.standard_normal((records, T))
    y, _ = canonical(s[:, 2:4], *noise, s[:, 4:], u, x0=s[:, :2])
    est = dw.Joint(2, 1, noise=dw.models.EquationError(1.0), scale=dw.models.InverseGamma(alpha, beta), s0=s0, P0=P0)
    traces = over_records(est, y, u)
    assert traces[0].dof == pytest.approx(2 * alpha + np.arange(T))
    inside = np.array([np.abs(trace.innovation) <= trace.band(0.95) for trace in traces])
    assert inside.mean() == pytest.approx(0.95, abs=0.006)


def test_output_error():
    """White measurement noise, 100 records: within 30 % of knowing d."""
    y, u, truth = lightly_damped(100, 1000, 0.5, 41, output_error=True)

    def rmse_and_nees(noise):
        est = dw.Joint(2, 1, noise=noise, P0=100.0)
        traces = over_records(est, y, u)
        r = final_means(est, traces)[:, 2:]
        return np.sqrt(np.mean((r - truth) ** 2, axis=0)), nees(est, [trace.state for trace in traces], truth)

    learning, learning_nees = rmse_and_nees(dw.models.OutputError(0.25))
    knowing, knowing_nees = rmse_and_nees(dw.models.NoisePolynomial(truth[:2], 0.25))
    equation, equation_nees = rmse_and_nees(dw.models.EquationError(0.25))
    assert 0.7 < knowing_nees < 1.35
    assert np.all(learning[:2] <= 1.3 * knowing[:2])
    assert learning_nees < 1.5
    assert np.all(equation[:2] > 30 * knowing[:2])
    assert equation_nees > 30


def test_output_error_of_a_plant_not_positive_real():
    """Re A(e^iw) < 0 somewhere: regressions on past outputs (extended least squares, PLR) settle at wrong models."""
    a, b = np.array([-1.8, 1.2, -0.3]), np.array([1.0, 0.5, 0.2])
    response = np.polyval([*a[::-1], 1.0], np.exp(-1j * np.linspace(0, np.pi, 500)))
    assert response.real.min() < 0
    truth, each = np.concatenate([a[::-1], b[::-1]]), []
    for seed in range(40):
        y, u = dw.simulate(a, b, samples=1000, noise_std=1.0, seed=seed)
        est = dw.Joint(3, 1).scaled_to(y, u)
        each.extend(nees_each(est, [est.scan(y, u).state], truth))
    assert np.median(each) < 2
