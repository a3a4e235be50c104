"""The observer of a known plant on regular samples: golden cases, dense least squares, deviations, bad inputs."""

import math
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from paper_motor import CONSTANT, COSINE, GOLDEN, MOTOR, SIGMA
from scipy.linalg import expm
from windows_of_motors import FS, INF, SILENT, SOFT, observed

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.models.plant import Augmented


@cache
def motor(samples, q2=1.0, torque=0.0):
    """Exact [x; q1; q_c; q_s] of the paper's motor (without load torque: as published), and what 24 sin t does to x."""
    A = np.zeros((9, 9))  # x, q1, q_c, q_s, sin, cos, torque
    A[:3, :3] = MOTOR.A
    A[2, 3:7] = 5, 5, 0, 10
    A[4, 5], A[5, 4], A[6, 7], A[7, 6], A[1, 8] = -50, 50, 1, -1, 0.2
    z, P = np.array([[1, 0, 3, 1, q2, 0, 0, 24, torque], [0, 0, 0, 0, 0, 0, 0, 24, 0.0]]).T, expm(A * FS)
    found = z[None]
    while len(found) < samples:  # by doubling
        found, P = np.concatenate([found, P @ found]), P @ P
    return found[:samples, :6, 0], found[:samples, :3, 1]


def run(window, disturbances, noise=0.0, samples=2001, q2=1.0, **options):
    """Trace on the motor's samples, and estimates of x with what the input does put back."""
    truth, forced = motor(samples, q2)
    trace = observed(window, disturbances, **options).scan(truth[:, 0] - forced[:, 0] + noise)
    return trace, trace.x + forced, truth


def dense(system, dt, hold, y, u, noise_std):
    """z and std at a window's end as in the textbook: every row written out from its start, and solved."""
    Phi, G0, G1 = system.discretise(dt, hold)
    F, f, rows, values = np.eye(system.m), np.zeros(system.m), [], []
    for t in range(len(y)):
        if t:
            F, f = Phi @ F, Phi @ f + G0 @ u[t - 1] + G1 @ u[t]
        for i in np.flatnonzero(~np.isnan(y[t])):
            rows.append(system.H[i] @ F / noise_std[i])
            values.append((y[t, i] - system.H[i] @ f - system.D[i] @ u[t]) / noise_std[i])
    for j in np.flatnonzero(np.isfinite(system.prior_std)):
        rows.append(np.eye(system.m)[j] / system.prior_std[j])
        values.append(0.0)
    scale = np.linalg.norm(rows, axis=0)
    Q, R = np.linalg.qr(np.array(rows) / scale)
    C = F / scale @ np.linalg.inv(R)
    return C @ Q.T @ values + f, np.linalg.norm(C, axis=1)


# --- golden cases ------------------------------------------------------------------------------------------


def test_dc_motor_noise_free():
    expected = GOLDEN["dc_motor_noise_free"]
    _, x, _ = run(2.001, (CONSTANT, COSINE))  # still filling: from 51 samples on
    for t, value in expected["expect"]["x"].items():
        error = abs(x[round(float(t) / FS)] - value)
        assert np.all(error < expected["tol"]["exact_least_squares_from_50_samples"]), (t, error)
    _, x, truth = run(0.05, (CONSTANT, COSINE))
    assert np.all(abs(x - truth[:, :3])[49:].max(0) < [1e-10, 1e-10, 1e-8])


@pytest.mark.parametrize("name", GOLDEN["window_least_squares"]["expect"]["estimate"])
def test_window_least_squares(name):
    expect = GOLDEN["window_least_squares"]["expect"]
    k = np.arange(1001)
    noise = 0.015 * (2 * np.modf((k + 1) * (math.sqrt(5) - 1) / 2)[0] - 1)
    kind, length = name.split("_L")
    disturbances = {"hard4": CONSTANT, "hard6": (CONSTANT, COSINE), "soft6": SOFT}[kind]
    trace, x, _ = run(int(length) * FS, disturbances, noise, samples=1001)
    estimate = np.concatenate([x[-1], trace.disturbances[-1]])
    np.testing.assert_allclose(estimate, expect["estimate"][name], rtol=1e-7)
    np.testing.assert_allclose(trace.std[-1], expect["std"][name], rtol=1e-7)


def test_soft_beats_hard():
    std = {n: observed(0.5, q).design.std[2] for n, q in {"4": CONSTANT, "6": (CONSTANT, COSINE), "soft": SOFT}.items()}
    expect = GOLDEN["soft_beats_hard"]["expect"]
    assert std["6"] / std["soft"] == pytest.approx(expect["hard6_over_soft6"], rel=1e-5)
    assert std["6"] / std["4"] == pytest.approx(expect["hard6_over_hard4"], rel=1e-5)


def test_double_integrator_gains():
    case = GOLDEN["double_integrator_fir"]
    for L in case["given"]["L"]:
        est = dw.WindowObserver(dw.Plant([[0, 1], [0, 0]]), L * 0.1, noise_std=1.0, dt=0.1)
        expected = [[float(Fraction(v)) for v in row] for row in case["expect"][f"L={L}"]]
        np.testing.assert_allclose(est.gains, expected, atol=1e-12)


def test_end_point_weights_keep_their_digits():
    """1001 points, degree 5, where powers of the sample index (scipy.signal.savgol_coeffs) sum to 2e-9."""
    case = GOLDEN["savgol_conditioning"]
    w = dw.WindowObserver(dw.Plant(np.eye(6, k=1)), 1001.0, noise_std=1.0, dt=1.0).gains[0]
    for got, key in ((w.sum(), "sum"), (w[-1], "last"), (w[0], "first")):
        assert got == pytest.approx(case["expect"][key], abs=1e-9)


def test_automatic_epsilon():
    """The estimate is ready by itself as soon as its deviation allows; hard annihilation never within a second."""
    tolerance, expect = [0.015, 0.25, 1.2], GOLDEN["auto_epsilon"]["expect"]
    for disturbances, name in ((CONSTANT, "hard4"), (SOFT, "soft6_prior2")):
        trace, _, _ = run(1.0, disturbances, samples=600, tolerance=tolerance)
        first = int(np.argmax(trace.ready))
        assert abs((first + 1) * FS - expect[name]) < 0.0101
        assert np.isnan(trace.estimates[:first]).all() and np.isinf(trace.std[:first]).all()
        assert np.all((trace.status[:first] & dw.Status.NOT_READY) > 0) and trace.ready[first:].all()
        assert trace.events()[0].text == f"ready at {first * FS:g} s"
    with pytest.raises(dw.InputError, match=r"never meets the tolerance .* smallest usable one is 16\.\d+ s"):
        observed(1.0, (CONSTANT, COSINE), tolerance=tolerance)


# --- against the textbook, and theory ----------------------------------------------------------------------


UNSTABLE = dw.Plant([[0, 1], [9, -1]], [0, 1], [1, 0], [0.2])
CASES = {
    "two outputs, one with a direct term": (
        MOTOR._replace(C=[[1, 0, 0], [0, 0, 1]], D=[0, 0.3]), 0.08, 2e-3, (0.01, 0.1),
        (CONSTANT._replace(prior_std=2.0), dw.models.Sinusoid(20.0, [0, 1, 5], INF)),
    ),
    "unstable": (
        UNSTABLE, 0.9, 0.03, (0.01,),
        (dw.models.Polynomial([0, 1], (INF, 0.0), 1, outputs=0.1), dw.models.Sinusoid(7.0, [1, 0], 0.5)),
    ),
}  # fmt: skip


@pytest.mark.parametrize("hold", ["zoh", "foh"])
@pytest.mark.parametrize("name", CASES)
def test_every_window_is_a_dense_least_squares(name, hold):
    """Filling, full, and with samples missing; a prior deviation of zero is one that is tiny."""
    plant, window, dt, noise_std, disturbances = CASES[name]
    row = np.arange(1.0, len(plant.A) + 1)
    est = dw.WindowObserver(
        plant, window, noise_std=noise_std, disturbances=disturbances, hold=hold, dt=dt, derived={"sum": (row, [2.0])}
    )
    rng, L, p = np.random.default_rng(1), est.length, est.model.outputs
    y, u = rng.standard_normal((3 * L, p)), rng.standard_normal((3 * L, 1))
    y[: 2 * L - 3][rng.random((2 * L - 3, p)) < 0.2] = np.nan
    trace = est.scan(y if p > 1 else y[:, 0], u)
    assert 1 < np.argmax(trace.ready) < 12 and trace.ready[-L:].all()
    system = Augmented(
        plant, [q._replace(prior_std=np.where(np.array(q.prior_std) == 0, 1e-7, q.prior_std)) for q in disturbances]
    )
    for t in [*range(12, L, 5), *range(L, 3 * L, 7)]:
        first = max(0, t - L + 1)
        z, std = dense(system, dt, hold, y[first : t + 1], u[first : t + 1], noise_std)
        assert np.all(abs(trace.estimates[t, : len(z)] - z) < 1e-7 * (std + 1e-5)), t
        np.testing.assert_allclose(trace.std[t, : len(z)], std, rtol=1e-8, atol=2e-7)
    np.testing.assert_allclose(trace.of("sum")[0], trace.x @ row + 2 * u[:, 0], rtol=1e-12)


def test_an_unstable_plant_has_the_deviation_of_least_squares():
    """Five seconds of x'' = 9 x + q: 0.0791, where the published theorem has 79.5."""
    plant, q = dw.Plant([[0, 1], [9, 0]]), dw.models.Polynomial([0, 1], INF)
    est = dw.WindowObserver(plant, 5.001, noise_std=1.0, disturbances=q, dt=1e-3)
    np.testing.assert_allclose(est.design.std[:2], [0.0791, 0.2522], rtol=1e-3)
    trace = dw.WindowObserver(plant, 0.5, noise_std=1.0, disturbances=q, dt=1e-2).scan(
        np.cosh(3 * 1e-2 * np.arange(900))
    )
    truth = np.cosh(3 * trace.time)
    assert np.max(abs(trace.x[49:, 0] / truth[49:] - 1)) < 1e-12  # 1e11 by then


def test_load_torque():
    """It does not enter where the paper wants it, and is one more disturbance here."""
    truth, forced = motor(1001, torque=1.0)
    trace = observed(0.5, (CONSTANT, COSINE)).scan(truth[:, 0] - forced[:, 0])
    assert np.max(abs(trace.x + forced - truth[:, :3])[499:, 2]) > 0.1  # the wrong model: what the check can see
    torque = dw.models.Polynomial([0, 0.2, 0], INF)
    truth, forced = motor(1001, q2=0.0, torque=1.0)
    trace = observed(0.5, torque).scan(truth[:, 0] - forced[:, 0] - _of_constant(1001))
    assert np.max(abs(trace.disturbances[499:] - 1.0)) < 1e-9
    error = trace.x + forced + _of_constant(1001, all_of_it=True) - truth[:, :3]
    assert np.max(abs(error[499:])) < 1e-9


def _of_constant(samples, all_of_it=False):
    """What q1 = 1 does to x from rest."""
    found = motor(samples, 0.0)[0] - motor(samples, 0.0)[0]
    Phi, _, _ = Augmented(SILENT, CONSTANT).discretise(FS)
    z = np.array([0, 0, 0, 1.0])
    for t in range(samples):
        found[t, :3], z = z[:3], Phi @ z
    return found[:, :3] if all_of_it else found[:, 0]


def test_a_long_window_and_a_long_run():
    """8 s of a plant with a fast stable pole, and 10^4 samples sliding: where other forms lose every digit."""
    truth, forced = (c[::4] for c in motor(10_000))
    options = dict(noise_std=SIGMA, disturbances=(CONSTANT, COSINE), dt=4 * FS)
    trace = dw.WindowObserver(SILENT, 8.0, **options).scan(truth[:, 0] - forced[:, 0])
    assert np.max(abs(trace.x + forced - truth[:, :3])[1999:]) < 1e-9
    _, x, truth = run(0.5, CONSTANT, samples=10_000, q2=0.0)
    error = abs(x - truth[:, :3])
    assert error[499:].max() < 1e-9
    assert error[-1000:].max() < 10 * error[499:1500].max() * abs(truth[-1000:, 0]).max()


@pytest.mark.parametrize("window", [0.25, 0.5, 1.0])
def test_deviations_are_honest(window):
    """Mean squares of error over deviation, 20 seeds of uniform noise; and of the innovations."""
    truth, forced = motor(10_000, 0.0)
    est, error, nis = observed(window, CONSTANT), [], []
    for seed in range(20):
        noise = np.random.default_rng(seed).uniform(-0.015, 0.015, 10_000)
        trace = est.scan(truth[:, 0] - forced[:, 0] + noise)
        error.append(np.mean(((trace.x + forced - truth[:, :3]) / trace.x_std)[2000:] ** 2))
        nis.append(np.mean(trace.innovation[2000:] ** 2 / trace.variance[2000:]))
    assert 0.85 < np.mean(error) < 1.15
    assert 0.98 < np.mean(nis) < 1.02


def test_soft_annihilation_of_the_papers_cosine():
    error = []
    for seed in range(10):
        noise = np.random.default_rng(seed).uniform(-0.015, 0.015, 10_000)
        _, x, truth = run(1.0, SOFT, noise, samples=10_000)
        error.append(np.mean((x - truth[:, :3])[2000:, 2] ** 2))
    assert 0.08 < np.sqrt(np.mean(error)) < 0.12  # 4.8 with hard annihilation


def test_a_second_sensor_with_a_direct_term():
    """Half a second, six modes: deviation of the current 6.9 A, with a current sensor of 2 A 0.165, of 0.2 A 0.017."""
    both = SILENT._replace(C=[[1, 0, 0], [0, 0, 1]])
    for sensor, expected in ((2.0, 0.165), (0.2, 0.017)):
        est = dw.WindowObserver(both, 0.5, noise_std=(SIGMA, sensor), disturbances=(CONSTANT, COSINE), dt=FS)
        assert est.design.std[2] == pytest.approx(expected, rel=0.03)


def test_noise_that_is_learnt_and_a_jump_that_is_told():
    truth, forced = motor(4000, 0.0)
    y = truth[:, 0] - forced[:, 0] + np.random.default_rng(0).normal(0, SIGMA, 4000)
    y[3000:] += 0.2
    est = dw.WindowObserver(SILENT, 0.3, noise_std=None, disturbances=CONSTANT, dt=FS, detector=dw.PageHinkley())
    trace = est.scan(y)
    before = est.scan(y[:3000])
    assert math.sqrt(est.sigma2(before.state)) == pytest.approx(SIGMA, rel=0.05)
    np.testing.assert_allclose(before.x_std[-1] / math.sqrt(est.sigma2(before.state)), est.design.std[:3], rtol=1e-12)
    assert not before.jumps() and 3000 <= trace.jumps()[0].sample < 3020
    assert trace.jumps()[0].text.startswith("jump: the innovations no longer fit the plant")
    assert trace.statistic.max() >= 1.0


# --- streams, gaps, what cannot be -------------------------------------------------------------------------


def test_a_stream_tells_its_estimate():
    est = observed(0.1, CONSTANT, derived={"acceleration": [0, 0, 0.2]}, plant=MOTOR, hold="foh")
    y, u = np.sin(np.arange(150) * 0.01), np.ones(150)
    trace, state = est.scan(y, u), est.start()
    assert np.isnan(est.estimate(state)[0]).all() and np.isinf(est.estimate(state)[1]).all()
    for t in range(150):
        state, _ = est.update(state, y[t], u[t])
        assert same(np.concatenate(est.estimate(state)), np.concatenate([trace.estimates[t], trace.std[t]]))
    assert trace.names == ["q", "acceleration"] and trace.state_names == ["x1", "x2", "x3"]
    np.testing.assert_allclose(trace.of("acceleration")[0][-1], 0.2 * trace.x[-1, 2])
    np.testing.assert_allclose(trace.of("acceleration")[1][-1], 0.2 * trace.x_std[-1, 2])
    frame = trace.to_frame("pyarrow")
    assert frame.column_names[:3] == ["time", "y", "u"] and {"x3", "q_std", "acceleration"} < set(frame.column_names)


def test_instants_of_a_regular_clock():
    """They label the samples; they may not say anything else than dt, from one record to the next."""
    est, y = observed(0.05, CONSTANT), np.sin(np.arange(100) * 0.01)
    clock = 1e4 + FS * np.arange(100)
    trace, plain = est.scan(y, time=clock), est.scan(y)
    assert same(trace.time, clock) and same(trace.table, plain.table)
    assert same(plain.time, FS * np.arange(100)) and float(trace.state["time"]) == clock[-1]
    for run_ in (trace, plain):
        again = est.scan(y[60:], time=clock[60:] if run_ is trace else None, state=run_.state_before(60))
        assert same(again.table, run_.table[60:]) and same(again.state, run_.state)
    state, _ = est.update(trace.state, 0.0, time=clock[-1] + FS)
    assert state["samples"] == 101
    with pytest.raises(dw.InputError, match=r"one step is 0\.002 s: mark the samples .*say irregular=True"):
        est.update(trace.state, 0.0, time=clock[-1] + 2 * FS)
    for refused in (lambda: trace.covariance, lambda: trace.what_changed(3), trace.model):
        with pytest.raises(dw.InputError):
            refused()


def test_gaps(tmp_path):
    """A gap longer than the window empties it; nothing is extrapolated; a missing input is held."""
    est = observed(0.1, CONSTANT, plant=MOTOR, hold="foh")
    y, u = np.sin(np.arange(600) * 0.01), np.ones(600)
    y[200:350], u[450] = np.nan, np.nan
    trace = est.scan(y, u)
    assert trace.ready[4:290].all() and not trace.ready[299:350].any() and trace.ready[360:].all()
    assert np.isnan(trace.prediction[300:351]).all() and np.isinf(trace.variance[300:351]).all()
    assert trace.status[450] == dw.Status.MISSING_INPUT
    assert same(trace.estimates, est.scan(y, np.ones(600)).estimates)
    told = [event.text for event in trace.events()]
    assert told[1] == "output missing (150 samples)" and told[2].startswith("no longer ready at 0.2")
    trace.save(tmp_path / "trace.npz")
    back = dw.Trace.load(tmp_path / "trace.npz")
    assert same(back.estimates, trace.estimates) and [e.text for e in back.events()] == told
    assert trace.summary().as_dict()["ready"] == trace.ready.mean()


@pytest.mark.parametrize(
    "change",
    [
        lambda y: y[:0],
        lambda y: y[:1],
        lambda y: y * np.nan,
        lambda y: 0 * y,
        lambda y: 1e-150 * y,
        lambda y: 1e150 * y,
        lambda y: np.where(np.arange(len(y)) == 40, 9e59, y),
    ],
)
def test_no_record_leaves_anything_silent(change):
    est = observed(0.05, CONSTANT, plant=MOTOR, hold="foh")
    y = change(np.random.default_rng(0).standard_normal(120))
    trace = est.scan(y, np.ones(len(y)))
    assert np.isfinite(np.atleast_1d(trace.state).view(float)).all()
    assert same(np.isfinite(trace.estimates).all(1), trace.ready) and same(np.isfinite(trace.std).all(1), trace.ready)
    assert np.all(np.isfinite(trace.prediction) == np.isfinite(trace.variance))
    assert len(trace.summary().words) > 0
