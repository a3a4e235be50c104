"""The algebraic observer against truth, least squares and the naive way; laws; what it refuses."""

import math

import numpy as np
import pytest
from oracle.algebraic_motor import dc_motor
from paper_motor import GOLDEN, INTO, MOTOR, SIGMA
from scipy.linalg import expm

import driftwise as dw
from driftwise.analysis.laws import LAWS, example
from driftwise.estimators.algebraic_observer.filter import observer_form
from driftwise.estimators.algebraic_observer.theorem import Theorem
from driftwise.models.plant import Augmented

H = 1e-3
THEOREM = Theorem([0, 2, 10, 1], [2], 0, [50])  # of this motor


def observer(**options):
    given = dict(into=INTO, dt=H, hold="foh", frequencies=[50.0], noise_std=SIGMA)
    return dw.AlgebraicObserver(MOTOR, **given | options)


@pytest.fixture(scope="module")
def motor():
    """The paper's motor in closed form: x (10001, 3), its third derivative, the input 24 sin t."""
    return dc_motor(np.arange(10001) * H)


# --- the filter --------------------------------------------------------------------------------------------


def test_noise_free_motor(motor):
    case = GOLDEN["dc_motor_noise_free"]
    trace = observer().scan(motor.x[:, 0], motor.u)
    third = trace.of("d3y")[0]
    for time, x in case["expect"]["x"].items():
        i = round(float(time) / H)
        assert np.all(abs(trace.x[i] - x) < case["tol"]["theorem_filter_from_t_0p05"]), time
        assert abs(third[i] - case["expect"]["y3"][time]) < case["tol"]["theorem_y3"], time
    disturbance = 1 + np.cos(50 * np.arange(10001) * H)
    assert abs(trace.disturbances[150:, 0] - disturbance[150:]).max() < 3e-4  # amplitudes of 1
    assert abs(trace.of("y_e")[0] - trace.x[:, 0])[5:].max() < 1e-12
    assert abs(trace.innovation[150:]).max() < 1e-6
    assert np.flatnonzero(trace.ready)[0] == 5 and np.isnan(trace.estimates[:5]).all()


def naive(y, u, hold, samples):
    """x3 of the motor by holding t^k y and t^k u, as one writes the theorem down first."""
    N, T = THEOREM.N, THEOREM
    A, By, Bu = observer_form(T)
    t = np.arange(samples + 1) * H
    v = np.vstack([(-t) ** (N - j) * y[: samples + 1] for j in range(N + 1)]).T @ By
    v += np.vstack([(-t) ** (N - j) * u[: samples + 1] for j in range(N + 1)]).T @ Bu
    E = expm(
        np.block([[A * H, np.eye(N) * H, np.zeros((N, N))], [np.zeros((N, 2 * N)), np.eye(N)], [np.zeros((N, 3 * N))]])
    )
    Phi, whole, slope = E[:N, :N], E[:N, N : 2 * N], E[:N, 2 * N :]
    now, then = (whole, 0 * whole) if hold == "zoh" else (whole - slope, slope)
    xi = np.zeros(N)
    for i in range(samples):
        xi = Phi @ xi + now @ v[i] + then @ v[i + 1]
    z: list[float] = []
    for mu in range(3):
        alpha = sum(float(c) * t[-1] ** p * z[h] for h in range(mu) for p, c in T.alpha(mu, h).items())
        z.append((np.linalg.matrix_power(A, mu)[0] @ xi - alpha) / (-t[-1]) ** N)
    return 5 * z[2]


def test_holding_the_products_is_the_naive_way(motor):
    y, u, x3 = motor.x[:151, 0], motor.u[:151], motor.x[150, 2]
    assert 5 < abs(naive(y, u, "foh", 150) - x3) < 9
    assert 500 < abs(naive(y, u, "zoh", 150) - x3) < 800
    assert abs(observer().scan(y, u).x[-1, 2] - x3) < 5e-5


def test_deviations_against_least_squares(motor):
    """The asymptotic price of the theorem; least squares on all samples from its own dense rows."""
    case = GOLDEN["efficiency_undamped_mode"]
    std = observer().scan(motor.x[:, 0], motor.u).x_std
    system = Augmented(MOTOR, (dw.models.Polynomial(INTO, np.inf), dw.models.Sinusoid(50.0, INTO, np.inf)))
    Phi, _, _ = system.discretise(H)
    rows = np.empty((10001, 6))
    rows[0] = system.H[0]
    for k in range(10000):
        rows[k + 1] = rows[k] @ Phi
    for t, ratio in zip(case["given"]["t"], case["expect"]["ratio"]):
        L = round(t / H)
        _, R = np.linalg.qr(rows[: L + 1])
        least = SIGMA * np.linalg.norm(np.linalg.solve(R.T, np.linalg.matrix_power(Phi, L)[2]))
        assert abs(std[L, 2] / least - ratio) < case["tol"], t
    np.testing.assert_allclose(std[150], [3.9e-3, 0.47, 158], rtol=0.01)  # the paper's epsilon


def test_deviations_after_gaps_are_those_of_every_noise_sample_on_its_own():
    """Estimates are linear in y, so are filled samples: responses to a 1 at each measured one, squared and summed."""
    T, missing, sigma = 90, [20, 21, 22, 37, 60, 61], 0.1
    est = observer(noise_std=sigma, dt=0.1, frequencies=[2.0])
    measured = [k for k in range(T) if k not in missing]
    y = np.zeros((len(measured), T))
    y[np.arange(len(measured)), measured] = 1.0
    y[:, missing] = np.nan
    traces = [est.scan(row, np.zeros(T)) for row in y]
    response = np.array([trace.estimates for trace in traces])
    ready = traces[0].ready
    assert ready[14:].all()
    expected = sigma * np.sqrt((response[:, ready] ** 2).sum(axis=0))
    np.testing.assert_allclose(traces[0].std[ready], expected, rtol=1e-6)
    ahead = np.array([trace.prediction for trace in traces])[:, 15:]
    expected = sigma**2 * ((ahead**2).sum(axis=0) + 1.0)
    np.testing.assert_allclose(traces[0].variance[15:], expected, rtol=1e-6)


@pytest.mark.slow
def test_deviations_and_innovations_are_honest(motor):
    rng, u = np.random.default_rng(0), motor.u[:4001]
    est, seeds = observer(), 40
    y = motor.x[:4001, 0] + SIGMA * math.sqrt(3) * rng.uniform(-1, 1, (seeds, 4001))
    y[:, 1500:1800] = np.where(rng.random((seeds, 300)) < 0.3, np.nan, y[:, 1500:1800])  # taken as predicted
    y[:, 2500:2600] = np.nan
    states, steps = est.update_batch(est.start(seeds), y, np.tile(u, (seeds, 1)))
    values, std = est.estimate(states)
    truth = [*motor.x[4000], 1 + math.cos(50 * 4.0)]
    nees = ((values[:, :4] - truth) / std[:, :4]) ** 2
    assert np.all(abs(nees.mean(0) - 1) < 4 * math.sqrt(2 / seeds)), nees.mean(0)
    late = steps.innovation[:, 200:] ** 2 / steps.variance[:, 200:]
    assert abs(np.nanmean(late) - 1) < 0.02
    filled = int(dw.Status.MISSING_OUTPUT | dw.Status.FILLED)
    assert np.all(steps.status[:, 2500:2600] == filled) and np.isfinite(values).all()
    learnt = observer(noise_std=None)  # the same filter, the variance relative: no gain, so the estimates are equal
    again, _ = learnt.update_batch(learnt.start(seeds), y, np.tile(u, (seeds, 1)))
    np.testing.assert_allclose(learnt.estimate(again)[1], std, rtol=0.05)


def test_a_sample_missing_at_the_start_begins_anew(motor):
    y, u = motor.x[:400, 0].copy(), motor.u[:400]
    y[[0, 3]] = np.nan
    trace = observer().scan(y, u)
    later = observer().scan(y[4:], u[4:])
    assert np.flatnonzero(trace.ready)[0] == 4 + 5
    np.testing.assert_array_equal(trace.estimates[9:], later.estimates[5:])


def test_a_step_of_the_input_needs_no_derivative():
    """u jumps, b has all its terms: under zoh state, disturbance and derivatives are exact all the same."""
    plant = dw.Plant([[0, 1, 0], [0, 0, 1], [-3, -4, -2]], [2.0, -1.0, 1.5], [1, 0, 0])
    system = Augmented(plant, dw.models.Polynomial([0, 0, 1], np.inf))
    Phi, G, _ = system.discretise(0.01)
    rng, z = np.random.default_rng(3), np.array([1.0, -2, 0.5, 0.7])
    u, states = np.repeat(rng.standard_normal(6), 50), np.empty((300, 4))
    for k in range(300):
        states[k] = z
        z = Phi @ z + G[:, 0] * u[k]
    est = dw.AlgebraicObserver(plant, into=[0, 0, 1], dt=0.01, hold="zoh", noise_std=1e-3)
    trace = est.scan(states[:, 0], u)
    late = slice(60, None)
    np.testing.assert_allclose(trace.x[late], states[late, :3], atol=2e-3)
    np.testing.assert_allclose(trace.disturbances[late, 0], states[late, 3], atol=2e-2)
    C, A, B = np.eye(3)[0], np.array(plant.A, float), np.array(plant.B)
    np.testing.assert_allclose(trace.of("dy")[0][late], states[late, 1] + C @ B * u[late], atol=1e-3)
    second = (states[:, :3] @ A.T @ A.T)[:, 0] + C @ A @ B * u
    np.testing.assert_allclose(trace.of("d2y")[0][late], second[late], atol=2e-3)


def test_load_torque_is_why_the_channel_is_checked():
    """A torque breaks assumption (2): the derivatives are right, and x3 = (J/K1) y'' wrong by p/K1 = 1 A."""
    torque = [0, 0.2, 0]
    with pytest.raises(dw.InputError, match=r"assumption \(2\) .* C A D = 0.2.*WindowObserver has no such condition"):
        observer(into=torque, frequencies=())
    Phi, G0, G1 = Augmented(MOTOR, dw.models.Polynomial(torque, 1.0)).discretise(H, "foh")
    u, z = 24 * np.sin(np.arange(1001) * H), np.empty((1001, 4))
    z[0] = [1, 0, 3, 1]
    for k in range(1000):
        z[k + 1] = Phi @ z[k] + G0[:, 0] * u[k] + G1[:, 0] * u[k + 1]
    est = dw.AlgebraicObserver.of_equation([0, 2, 10, 1], [2], dt=H, hold="foh", noise_std=SIGMA)
    second = est.scan(z[:, 0], u).of("d2y")[0]
    assert abs(5 * second[-1] - z[-1, 2] - 1.0) < GOLDEN["load_torque"]["tol"]["paper"]


def test_a_million_samples_do_no_harm():
    """Time is counted in samples and the states are divided by t^N: nothing grows."""
    t = np.arange(1_000_001) * H
    y = np.sin(3 * t + 1)
    est = dw.AlgebraicObserver(dw.Plant([[0, 3], [-3, 0]]), into=[0, 1], dt=H, noise_std=SIGMA, tolerance=[0.01, 0.1])
    trace = est.scan(y)
    assert abs(trace.x[-1] - [y[-1], math.cos(3 * t[-1] + 1)]).max() < 1e-6
    assert np.all(trace.x_std[-1] < 3 * SIGMA * 2 / 1000) and np.isfinite(trace.state["chi"]).all()
    first = int(np.flatnonzero(trace.ready)[0])
    assert trace.x_std[first, 0] <= 0.01 and trace.x_std[first, 1] <= 0.1 and 10 < first < 2000
    paper = dw.AlgebraicObserver(dw.Plant([[0, 3], [-3, 0]]), into=[0, 1], dt=H, noise_std=SIGMA, epsilon=0.3)
    assert np.flatnonzero(paper.scan(y[:500]).ready)[0] == 300


# --- laws and the door -------------------------------------------------------------------------------------

LAWFUL = {
    "input, two kinds of disturbance": observer(noise_std=0.1, dt=0.1, frequencies=[2.0]),
    "no input, noise learnt": dw.AlgebraicObserver(dw.Plant([[0, 1], [0, -1]]), into=[0, 1], degree=1, dt=0.1),
}


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
@pytest.mark.parametrize("name", LAWFUL)
def test_laws(name, law):
    law(LAWFUL[name], *example(LAWFUL[name]))


@pytest.mark.parametrize("y", [[], [1.0], [np.nan] * 30, [1e150] * 30, [0.0] * 30, [*[1.0] * 20, 9e59, *[1.0] * 9]])
def test_no_record_leaves_anything_that_is_not_finite(y):
    est = LAWFUL["no input, noise learnt"]
    trace = est.scan(np.array(y))
    assert np.isfinite(np.atleast_1d(trace.state).view(float)).all()
    assert np.all(np.isfinite(trace.estimates).all(1) == trace.ready)


def test_a_trace_is_saved_and_read_back(tmp_path):
    est = dw.AlgebraicObserver.of_equation([0, 2, 10, 1], [2], dt=0.1, hold="zoh", frequencies=[2.0], noise_std=0.1)
    trace = est.scan(*example(est))
    trace.save(tmp_path / "trace.npz")
    back = type(trace).load(tmp_path / "trace.npz")
    assert repr(back.estimator) == repr(est)
    np.testing.assert_array_equal(back.estimates, trace.estimates)
    assert list(trace.columns())[-10:-5] == ["pi", "y_e", "dy", "d2y", "d3y"]
    assert trace.summary().as_dict()["loglik"] is None  # the theorem has no likelihood


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: dw.AlgebraicObserver.of_equation([-9, 0, 1], dt=H), r"grows like exp\(3 t\), Re\(lambda\) > 0"),
        (lambda: observer(frequencies=[50, 50.0]), "frequencies must be different"),
        (lambda: observer(frequencies=[0]), "a frequency of 0 is a constant"),
        (lambda: observer(frequencies=[-1]), "must be positive and finite, in rad/s"),
        (lambda: observer(degree=-2), "at least -1"),
        (lambda: observer(into=None), "into must say how the disturbance enters"),
        (lambda: observer(degree=-1, frequencies=()), "but there is none"),
        (lambda: observer(hold=None), "hold must say what it does between them"),
        (lambda: observer(tolerance=[1, 2]), r"a number or \(3,\)"),
        (lambda: observer(epsilon=0), "epsilon must be a positive"),
        (
            lambda: dw.AlgebraicObserver(MOTOR._replace(C=[0, 1, 0]), degree=-1, dt=H, hold="foh"),
            r"the constant mode \(0\) cannot be seen",
        ),
        (
            lambda: dw.AlgebraicObserver(MOTOR._replace(C=np.eye(3)), into=INTO, dt=H, hold="foh"),
            "one output and at most one input, and the plant has 3 and 1: use WindowObserver",
        ),
        (
            lambda: dw.AlgebraicObserver(MOTOR._replace(B=np.eye(3)), into=INTO, dt=H, hold="foh"),
            "the plant has 1 and 3",
        ),
        (lambda: dw.AlgebraicObserver(MOTOR._replace(D=[1]), into=INTO, dt=H, hold="foh"), "no direct term"),
        (lambda: dw.AlgebraicObserver.of_equation([1, 2], dt=H), "with a_n = 1"),
        (lambda: dw.AlgebraicObserver.of_equation([1, 1], [1, 1], dt=H, hold="foh"), "m < n"),
        (lambda: dw.AlgebraicObserver.of_equation([1, 1], into=[1], dt=H), "an equation of y and u has none"),
    ],
)
def test_what_does_not_fit_is_refused(make, message):
    with pytest.raises(dw.InputError, match=message):
        make()


def test_what_an_observer_is_not_for():
    est = dw.AlgebraicObserver(MOTOR, into=[0, 0, 5], dt=1e-3, hold="foh")
    with pytest.raises(dw.InputError, match="WindowObserver finds walks"):
        est.tune(np.zeros(10))
    with pytest.raises(dw.InputError, match="does not look back"):
        est.smooth(np.zeros(10))
