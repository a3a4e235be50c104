"""Two windows of one plant against each other: the statistic, its law, its promise, and faults it finds."""

import numpy as np
import pytest
from driftwise_studies.papers.tian import faults
from oracle import algebraic
from scipy.linalg import block_diag

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.detect.parity import over_window, parity_statistic, whitening
from driftwise.estimators.window_observer.gains import Design
from driftwise.estimators.window_observer.horizon import Horizon
from driftwise.estimators.window_observer.parity import white
from driftwise.models.plant import Augmented

DT, SIGMA = 0.05, [0.3, 0.1]
SPRING = dw.Plant([[0, 1], [-4, -0.5]], [[0, 0.2], [1, 0]], [[1, 0], [0, 1]], [[0, 0.5], [0, 0]])
PUSH = dw.models.Polynomial([0, 1], np.inf)
SOFT = (dw.models.Polynomial([0, 1], 0.4), dw.models.Sinusoid(3.0, [0, 1], 0.8))


def simulate(system, z0, u, rng, hold="foh", std=SIGMA):
    Phi, G0, G1 = system.discretise(DT, hold)
    z = np.empty((len(u), system.m))
    z[0] = z0
    for t in range(1, len(u)):
        z[t] = Phi @ z[t - 1] + G0 @ u[t - 1] + G1 @ u[t]
    return z @ system.H.T + u @ system.D.T + std * rng.standard_normal((len(u), system.outputs))


def observer(window=0.75, disturbances=PUSH, plant=SPRING, **options):
    options = dict(noise_std=SIGMA, hold="foh", dt=DT, detector=dw.detect.Parity()) | options
    return dw.WindowObserver(plant, window, disturbances=disturbances, **options)


def record(samples=200, seed=0):
    """y and u of the spring; the force jumps at sample 120."""
    rng, system = np.random.default_rng(seed), Augmented(SPRING, PUSH)
    u = rng.standard_normal((samples, 2))
    y = simulate(system, [1.0, -2.0, 0.5], u, rng)
    late = simulate(system, [0.0, 0.0, 4.0], np.zeros_like(u[120:]), rng, std=0.0)
    y[120:] += late
    return y, u


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_the_statistic_is_that_of_two_dense_windows(hold):
    rng, system, L = np.random.default_rng(1), Augmented(SPRING, PUSH), 15
    u = rng.standard_normal((40, 2))
    y = simulate(system, [1.0, -2.0, 0.5], u, rng, hold)
    trace = observer(hold=hold).scan(y, u)
    # the oracle's input generator: u held (v = u), or a straight line (v = [u, slope], G its dynamics)
    slope = np.vstack([np.diff(u, axis=0) / DT, np.zeros(2)]) if hold == "foh" else np.zeros_like(u)
    B, G = np.hstack([system.B, 0 * system.B]), np.kron([[0, 1], [0, 0]], np.eye(2))
    threshold = dw.detect.Parity().threshold(3)
    for t in (2 * L - 1, 35, 39):
        kept = slice(t - 2 * L + 1, t + 1)
        expected, _, _ = algebraic.two_window_parity(
            system.A, system.H, np.arange(2 * L) * DT, (y - u @ system.D.T)[kept], SIGMA, L, B=B, G=G,
            v=np.hstack([u, slope])[kept],
        )  # fmt: skip
        np.testing.assert_allclose(trace.statistic[t] * threshold, expected, rtol=1e-8)
    assert np.all(trace.statistic[: 2 * L - 1] == 0)


def test_a_stream_computes_what_the_record_function_does():
    y, u = record()
    for disturbances, window in ((PUSH, 0.75), (SOFT, 0.8)):
        est = observer(window, disturbances, detector=dw.detect.Parity(restart=False))
        trace, system, L = est.scan(y, u), est.plant, est.length
        Phi, G0, G1 = system.discretise(DT, "foh")
        steps = np.vstack([np.zeros(system.m), u[:-1] @ G0.T + u[1:] @ G1.T])
        z = trace.estimates.copy()
        z[: L - 1] = np.nan
        V = white(Horizon(system, DT, SIGMA), L)
        expected = parity_statistic(z, Phi, steps, V, L) / dw.detect.Parity().threshold(len(V))
        np.testing.assert_allclose(trace.statistic[2 * L - 1 :], expected[2 * L - 1 :], rtol=1e-8, atol=1e-10)


def test_what_the_inputs_do_over_a_window_is_a_plain_sum():
    rng, Phi = np.random.default_rng(0), np.array([[1.0, 0.3], [0.0, 1.1]])
    steps = rng.standard_normal((30, 2))
    for L in (1, 6, 13):
        plain = sum(np.linalg.matrix_power(Phi, j) @ steps[29 - j] for j in range(L))
        np.testing.assert_allclose(over_window(Phi, steps, L)[-1], plain, rtol=1e-12)


def two_estimates(system, L, draws, rng, prior):
    """d (draws, m) of two windows; the disturbances are drawn at the start of the older one."""
    step = system.discretise(DT)[0]
    Phi, rows = np.linalg.matrix_power(step, L), [system.H @ np.linalg.matrix_power(step, i) for i in range(2 * L)]
    K = Design(system, DT, L, SIGMA).gains.reshape(system.m, -1)
    z0 = np.concatenate([rng.standard_normal((draws, 2)), rng.standard_normal((draws, len(prior))) * prior], axis=1)
    y = z0 @ np.concatenate(rows).T + np.tile(SIGMA, 2 * L) * rng.standard_normal((draws, 4 * L))
    return y[:, y.shape[1] // 2 :] @ K.T - y[:, : y.shape[1] // 2] @ K.T @ Phi.T, Phi


@pytest.mark.parametrize("L", [8, 40])
def test_the_law_is_chi_square_with_priors_too(L):
    """A prior is no data: counted in each window anew, short windows would look far too much alike."""
    rng, draws = np.random.default_rng(2), 2000
    system = Augmented(SPRING, SOFT)
    d, Phi = two_estimates(system, L, draws, rng, [0.4, 0.8, 0.8])
    horizon = Horizon(system, DT, SIGMA)
    statistic = np.sum((d @ white(horizon, L).T) ** 2, axis=1)
    assert abs(statistic.mean() - 5) < 4 * np.sqrt(10 / draws) and 7 < statistic.var() < 14
    own = np.hstack(horizon.errors(L))
    twice = np.sum((d @ whitening(np.hstack([own, Phi @ own])).T) ** 2, axis=1)
    assert twice.mean() < 4 or L == 40


def test_what_is_known_exactly_is_left_out():
    """A fast mode has died within the window: its estimate and its prediction are both exact."""
    plant = dw.Plant(block_diag([[0, 1], [0, 0]], -200.0), None, [[1, 0, 1]])
    V = white(Horizon(Augmented(plant), DT, [0.1]), 40)
    assert V.shape == (2, 3) and np.isfinite(V).all()
    left_out = dw.models.Sinusoid(3.0, [0, 1], 0.0)
    assert white(Horizon(Augmented(SPRING, (PUSH, left_out)), DT, SIGMA), 15).shape == (3, 5)


def test_false_alarms_are_at_most_what_was_promised():
    rng, system = np.random.default_rng(3), Augmented(SPRING, PUSH)
    y = np.stack([simulate(system, [1, 1, 1], np.zeros((2000, 2)), rng) for _ in range(20)])
    est = observer(detector=dw.detect.Parity(false_alarms="1 per 200"))
    _, steps = est.update_batch(est.start(20), y, np.zeros_like(y))
    alarms = np.count_nonzero(steps.status[..., 0] & dw.Status.JUMP)
    assert 20 < alarms < 20 * 2000 / 200


def test_an_alarm_empties_the_window():
    y, u = record()
    trace = observer().scan(y, u)
    (alarm,) = trace.jumps()
    assert 120 <= alarm.sample < 135 and "the last 0.75 s contradict the 0.75 s before" in alarm.text
    assert trace.ready[alarm.sample] and not trace.ready[alarm.sample + 1] and trace.ready[alarm.sample + 3]
    assert np.all(trace.statistic[alarm.sample + 1 : alarm.sample + 30] == 0)
    after = np.arange(len(y)) > alarm.sample + 3
    error = (trace.disturbances[after, 0] - 4.5) / trace.disturbances_std[after, 0]
    assert np.mean(error**2) < 2
    lasting = observer(detector=dw.detect.Parity(restart=False)).scan(y, u)
    (alarm,) = lasting.jumps()
    assert "samples)" in alarm.text and np.array_equal(lasting.statistic[:124], trace.statistic[:124])
    np.testing.assert_array_equal(lasting.estimates, observer(detector=None).scan(y, u).estimates)


def test_stream_halves_fleet_and_saved_state_are_the_record(tmp_path):
    y, u = record()
    y[60, 0] = np.nan
    est = observer()
    whole = est.scan(y, u)
    first = est.scan(y[:125], u[:125])
    dw.save_state(est, first.state, tmp_path / "state")
    again, state = dw.load_state(tmp_path / "state")
    second = again.scan(y[125:], u[125:], state=state)
    assert same(np.concatenate([first.table, second.table]), whole.table)
    state, statuses = est.start(), []
    for t in range(len(y)):
        state, step = est.update(state, y[t], u[t])
        statuses.append(step.status)
    assert np.array_equal(statuses, whole.status) and same(state, whole.state)
    states, steps = est.update_batch(est.start(2), np.stack([y, y]), np.stack([u, u]))
    assert same(states[1], whole.state) and np.array_equal(steps.status[1], whole.status)


def test_windows_with_gaps_are_not_tested():
    y, u = record()
    y[60] = np.nan
    statistic = observer().scan(y, u).statistic
    assert np.all(statistic[60 : 60 + 30] == 0) and np.all(statistic[29:60] > 0) and statistic[90] > 0


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: observer(np.inf), "two windows of regular samples"),
        (lambda: observer(irregular=True), "two windows of regular samples"),
        (lambda: observer(detector=dw.detect.Parity(probability=1e-6, false_alarms="never")), "rate of false alarms"),
        (lambda: observer(detector=dw.detect.Parity(probability=2.0)), "probability must lie"),
        (lambda: observer(disturbances=dw.models.Polynomial([0, 1], [1.0, np.inf], degree=1)), "hold for both windows"),
    ],
)
def test_tests_that_cannot_be(make, words):
    with pytest.raises(dw.InputError, match=words):
        make()


def test_the_motor_with_a_resistance_ten_percent_off():
    """T = 1 s, threshold 1e-6, 100 records: found after .25 to .4 s, none missed, no false alarm, residuals blind."""
    found = faults.run("R +10 %", 1.0, 100)
    assert found.missed == 0 and 0.25 < found.typical < 0.4 and not found.false.any()
    assert np.isinf(found.residual).all() and 3.7 < found.mean.mean() < 4.4


@pytest.mark.slow
@pytest.mark.parametrize("section", [faults.section, faults.frequency])
def test_the_sections_of_the_reproduction_confirm_their_findings(section):
    assert [v.name for v in section(20).verdicts if not v.confirmed] == []
