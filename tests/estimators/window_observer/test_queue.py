"""The window over samples at any instants: a queue of segments joined by orthogonal transformations."""

import mpmath
import numpy as np
import pytest
from paper_motor import CONSTANT, COSINE, GOLDEN, MOTOR, SIGMA

import driftwise as dw
from driftwise.engine import compile
from driftwise.engine.errors import InputError
from driftwise.engine.expm import exponential
from driftwise.engine.qr import triangularise
from driftwise.engine.status import MISSING_OUTPUT, NOT_READY
from driftwise.estimators.window_observer.gains import Design
from driftwise.models.plant import Augmented


def moves(plant, t, hold):
    """Return Phi, G0, G1 from each instant to the next, with SciPy's exponential."""
    still = np.eye(plant.m), np.zeros((plant.m, plant.inputs)), np.zeros((plant.m, plant.inputs))
    found = {step: plant.discretise(step, hold) if step else still for step in set(np.diff(t))}
    return [found[step] for step in np.diff(t)]


def run(steps, u, z):
    """Return the states (T, m) from z on."""
    found = [np.array(z, float)]
    for i, (Phi, G0, G1) in enumerate(steps):
        found.append(Phi @ found[-1] + G0 @ u[i] + G1 @ u[i + 1])
    return np.array(found)


def dense(plant, steps, held, y, u, noise):
    """Return z and its covariance at the last of the samples held: all rows at once, unknown at the first of them."""
    F, f, rows, target = np.eye(plant.m), np.zeros(plant.m), [], []
    for i in held:
        if i > held[0]:
            Phi, G0, G1 = steps[i - 1]
            F, f = Phi @ F, Phi @ f + G0 @ u[i - 1] + G1 @ u[i]
        rows.append(plant.H @ F / noise[:, None])
        target.append((y[i] - plant.H @ f - plant.D @ u[i]) / noise)
    X, b = np.concatenate(rows), np.concatenate(target)
    X, b = X[~np.isnan(b)], b[~np.isnan(b)]
    told = np.isfinite(plant.prior_std)
    X = np.vstack([X, np.diag(1 / plant.prior_std)[told]])
    b = np.concatenate([b, np.zeros(told.sum())])
    scale = np.linalg.norm(X, axis=0)
    if len(b) < plant.m or np.linalg.cond(X / scale) > 1e12:
        return None
    Q, R = np.linalg.qr(X / scale)
    C = F @ (np.linalg.inv(R) / scale[:, None])
    return C @ (Q.T @ b) + f, C @ C.T


# --- the pieces --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reach", [1e-3, 0.1, 0.5, 3.0, 40.0, -2.0])
def test_exponential_with_the_integrals_of_held_and_straight_inputs(reach):
    rng = np.random.default_rng(7)
    for n, k in ((1, 1), (3, 2), (6, 1), (2, 4), (4, 0)):
        A, B = rng.standard_normal((n, n)) - 2 * np.sqrt(n) * np.eye(n), rng.standard_normal((n, k))
        t = reach / abs(A).sum(1).max()
        F, whole, slope = np.empty(n * n), np.empty(n * k), np.empty(n * k)
        exponential(A.ravel(), B.ravel(), n, k, t, F, whole, slope, np.full((5, n * max(n, k)), np.nan))
        M = np.zeros((n + 2 * k, n + 2 * k))
        M[:n, :n], M[:n, n : n + k], M[n : n + k, n + k :] = A, B, np.eye(k) / t
        with mpmath.workdps(40):  # SciPy's has errors of 3e-15
            E = np.array(mpmath.expm(mpmath.matrix(M) * t, method="taylor").tolist(), float)
        for found, expected, unit in ((F, E[:n, :n], 1), (whole, E[:n, n : n + k], 0), (slope, E[:n, n + k :], 0)):
            expected = expected.ravel()
            assert abs(found - expected).max(initial=0) <= 3e-15 * abs(expected).max(initial=unit)


def test_triangle_keeps_every_sum_of_squares():
    rng = np.random.default_rng(1)
    X, y, w = rng.standard_normal((9, 4)) * 10.0 ** rng.uniform(-3, 3, 9)[:, None], rng.standard_normal(9), np.ones(4)
    for rows in (2, 4, 9):
        M = np.ascontiguousarray(np.column_stack([X, y])[:rows].T)
        left = triangularise(M, rows, 4)
        kept = M.T[: min(rows, 4)]
        assert np.all(np.tril(kept[:, :4], -1) == 0)
        total = np.sum((X[:rows] @ w - y[:rows]) ** 2)
        assert np.isclose(np.sum((kept[:, :4] @ w - kept[:, 4]) ** 2) + left, total, rtol=1e-13)


# --- equal to least squares on the samples of the window ---------------------------------------------------


def test_golden_irregular_and_missing():
    case = GOLDEN["irregular_missing"]
    given, expect = case["given"], case["expect"]
    y = np.array([np.nan if v is None else v for v in given["y"]])
    plant, load_ = dw.Plant([[0, 1], [-4, -0.6]], [0, 2], [1, 0]), dw.models.Polynomial([0, 1], np.inf)
    est = dw.WindowObserver(plant, 5.0, noise_std=1.0, disturbances=load_, hold="zoh", dt=0.1, irregular=True)
    trace = est.scan(y, np.array(given["u"], float), time=given["t"])
    value, std = est.estimate(trace.state)
    assert abs(value - expect["estimate"]).max() < case["tol"]
    assert abs(std**2 - expect["cov_diag_unit_noise"]).max() < case["tol"] * 10


def _everything():
    """A plant with an unstable mode, two inputs and outputs, direct terms; disturbances with a prior and without."""
    A = [[0, 1, 0, 0], [-4, -0.6, 0.3, 0], [0, 0, -30, 2], [0.2, 0, 0, 4]]
    B, C, D = [[0, 0], [1, 0], [0, 5], [0.5, 1]], [[1, 0, 0.5, 0], [0, 0, 1, 1]], [[0.5, 0], [0, 2]]
    disturbances = (
        dw.models.Polynomial([0, 1, 0, 0], (2.0, 3.0), degree=1),
        dw.models.Sinusoid(9.0, [0, 0, 0, 1], 1.5),
        dw.models.Polynomial([0, 0, 0, 0], np.inf, outputs=[1.0, 0.0]),
    )
    return dw.Plant(A, B, C, D), disturbances


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_every_estimate_equals_dense_least_squares(hold):
    """Bursts, equal instants, gaps within and beyond the window, missing outputs one by one, a queue that is full."""
    plant, disturbances = _everything()
    noise, window, dt, capacity = np.array([0.1, 0.3]), 1.0, 0.05, 18
    est = dw.WindowObserver(
        plant, window, noise_std=noise, disturbances=disturbances, hold=hold, dt=dt, irregular=True, capacity=capacity
    )
    rng = np.random.default_rng(3)
    step = rng.exponential(dt, 160)
    step[[30, 31, 90]], step[70], step[120], step[40:60] = 0.0, 0.8, 1.3, 0.02
    t = 5.0 + np.cumsum(step)
    u, y = rng.standard_normal((160, 2)), rng.standard_normal((160, 2))
    y[rng.random((160, 2)) < 0.2] = np.nan
    trace = est.scan(y, u, time=t)
    system, compared, full = Augmented(plant, disturbances), 0, 0
    steps = moves(system, t, hold)
    for i in range(160):
        held = np.flatnonzero(t[: i + 1] > t[i] - window * (1 - 1e-9))
        full += len(held) > capacity
        held = held[-capacity:]
        expected = dense(system, steps, held, y, u, noise)
        if expected is None:
            assert trace.status[i, 0] & NOT_READY
            assert np.isnan(trace.estimates[i]).all()
            assert np.isinf(trace.std[i]).all()
            continue
        z, std = expected[0], np.sqrt(np.diag(expected[1]))
        compared += 1
        assert np.allclose(trace.std[i], std, rtol=1e-6)
        assert np.all(abs(trace.estimates[i] - z) < 1e-6 * std + 1e-9 * abs(z)), i
    assert compared > 120
    assert full > 10


def test_prediction_is_that_of_the_window_before():
    """With the interval as it came: H z + D u, and the variance that the estimate and the new noise leave."""
    plant, disturbances = _everything()
    noise = np.array([0.1, 0.3])
    est = dw.WindowObserver(plant, 1.0, noise_std=noise, disturbances=disturbances, hold="foh", dt=0.05, irregular=True)
    rng = np.random.default_rng(4)
    t = np.cumsum(rng.exponential(0.05, 30))
    u, y = rng.standard_normal((30, 2)), rng.standard_normal((30, 2))
    t[-1] = t[-2] + 0.3
    trace, system = est.scan(y, u, time=t), Augmented(plant, disturbances)
    held = np.flatnonzero(t[:-1] > t[-2] - 1)
    steps = moves(system, t, "foh")
    z, P = dense(system, steps, held, y, u, noise)
    Phi, G0, G1 = steps[-1]
    expected = system.H @ (Phi @ z + G0 @ u[-2] + G1 @ u[-1]) + system.D @ u[-1]
    variance = np.diag(system.H @ Phi @ P @ Phi.T @ system.H.T) + noise**2
    assert np.allclose(trace.prediction[-1], expected, rtol=1e-8)
    assert np.allclose(trace.variance[-1], variance, rtol=1e-8)
    assert np.array_equal(trace.innovation[-1], y[-1] - trace.prediction[-1])


def test_prior_of_zero_leaves_out():
    """All of a disturbance; or the slope of a ramp, which is then a constant."""
    plant, _ = _everything()
    rng = np.random.default_rng(8)
    t, y, u = np.cumsum(rng.exponential(0.05, 60)), rng.standard_normal((60, 2)), rng.standard_normal((60, 2))
    found = []
    for q in (
        [dw.models.Polynomial([0, 1, 0, 0], 2.0)],
        [dw.models.Polynomial([0, 1, 0, 0], (2.0, 0.0), degree=1)],
        [dw.models.Polynomial([0, 1, 0, 0], 2.0), dw.models.Sinusoid(9.0, [0, 0, 0, 1], 0.0)],
    ):
        options = dict(noise_std=[0.1, 0.3], disturbances=q, hold="foh", dt=0.05, irregular=True)
        trace = dw.WindowObserver(plant, 1.0, **options).scan(y, u, time=t)
        assert np.all(trace.std[-1, 5:] == 0)
        assert np.all(trace.estimates[-1, 5:] == 0)
        found.append(np.concatenate([trace.estimates[30:, :5], trace.std[30:, :5]]))
    assert np.allclose(found[0], found[1], rtol=1e-8, atol=1e-10)
    assert np.allclose(found[0], found[2], rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("stamped", [False, True])
def test_regular_samples_give_what_fixed_gains_give(stamped):
    """Every sample after filling; and with a clock of rounded instants, the same samples in the window."""
    plant, samples = Augmented(MOTOR, (CONSTANT, COSINE)), 150
    design = Design(plant, 1e-3, samples, [SIGMA], "foh")
    rng = np.random.default_rng(0)
    t = 1e-3 * np.arange(900)
    u = 24 * np.sin(t)[:, None]
    z = run(moves(plant, t, "foh"), u, [1, 0, 3, 1, 1, 0])
    y = z[:, :1] + SIGMA * rng.standard_normal((900, 1))
    est = dw.WindowObserver(
        MOTOR, 0.15, noise_std=SIGMA, disturbances=(CONSTANT, COSINE), hold="foh", dt=1e-3, irregular=True
    )
    trace = est.scan(y[:, 0], u, time=t if stamped else None)
    for i in range(samples - 1, 900):
        part = slice(i - samples + 1, i + 1)
        expected = np.einsum("mlp,lp->m", design.gains, y[part])
        expected += np.einsum("mlk,lk->m", design.input_gains, u[part])
        assert np.all(abs(trace.estimates[i] - expected) < 6e-9 * design.std)
    assert np.allclose(trace.std[samples - 1 :], design.std, rtol=1e-8)
    assert trace.state["queue"][3] == 1e-3, "intervals equal but for rounding are not found once"


# --- exact, honest, for ever -------------------------------------------------------------------------------


def test_exponential_intervals_with_missing_samples():
    """Noise-free to round-off; with noise the deviations are honest (60 series, 6 numbers each: 3.3 sigma)."""
    series, samples, plant = 60, 800, Augmented(MOTOR, (CONSTANT, COSINE))
    est = dw.WindowObserver(
        MOTOR, 0.5, noise_std=SIGMA, disturbances=(CONSTANT, COSINE), hold="foh", dt=1e-3, irregular=True
    )
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.exponential(1e-3, samples))
    u = 24 * np.sin(t)[:, None]
    z = run(moves(plant, t, "foh"), u, [1, 0, 3, 1, 1, 0])
    lost = rng.random(samples) < 0.2
    y = np.where(lost, np.nan, z[:, 0])
    trace = est.scan(y, u, time=t)
    assert abs(trace.estimates[500:, :3] - z[500:, :3]).max() < 4e-10
    noisy = y + rng.uniform(-0.015, 0.015, (series, samples))
    states, _ = est.update_batch(est.start(series), noisy, np.tile(u, (series, 1, 1)), time=np.tile(t, (series, 1)))
    V = est.policies[0].V.reshape(6, 6)
    errors = np.linalg.solve(V @ states["C"], (states["z"] - z[-1])[..., None])
    assert 0.75 < np.mean(errors**2) < 1.25


def test_ten_thousand_samples_and_no_growth_where_adding_and_subtracting_diverges():
    plant = Augmented(MOTOR, CONSTANT)
    t = 1e-3 * np.arange(10_000)
    u = np.zeros((10_000, 1))
    step = plant.discretise(1e-3, "zoh")
    Phi, z = step[0], run([step] * 9_999, u, [1, 0, 3, 1])
    est = dw.WindowObserver(MOTOR, 0.5, noise_std=SIGMA, disturbances=CONSTANT, hold="zoh", dt=1e-3, irregular=True)
    error = abs(est.scan(z[:, 0], u, time=t).estimates - z)[500:]
    scale = abs(z).max(axis=0)
    assert (error / scale).max() < 1e-9
    assert error[-2000:].max() < 10 * error[:2000].max()

    back, old = np.linalg.inv(Phi), np.linalg.matrix_power(np.linalg.inv(Phi), 500)[0]
    M, b, worst = np.zeros((4, 4)), np.zeros(4), 0.0
    for i in range(10_000):
        M, b = back.T @ M @ back, back.T @ b
        M[0, 0] += 1.0
        b[0] += z[i, 0]
        if i >= 500:
            M, b = M - np.outer(old, old), b - old * z[i - 500, 0]
        if i >= 500 and i % 500 == 0:
            worst = max(worst, np.max(abs(np.linalg.lstsq(M, b, rcond=None)[0] - z[i]) / scale))
    assert not worst < 1.0


def test_unstable_plant_for_ever():
    """A double integrator and a mode that grows fifty-fold in a window, held by feedback; instants of their own."""
    A, B = np.array([[0, 1, 0], [0, 0, 1], [0, 0, 4.0]]), np.array([[0], [0], [1.0]])
    plant = dw.Plant(A, B, [1, 0, 0])
    system, rng = Augmented(plant), np.random.default_rng(2)
    T = 20_000
    t = np.cumsum(rng.choice([0.005, 0.01, 0.015], T))
    K = np.array([[8.0, 12.0, 10.0]])  # (s + 2)^3
    move = {step: system.discretise(step, "zoh")[:2] for step in (0.005, 0.01, 0.015)}
    x, u = np.empty((T, 3)), np.empty((T, 1))
    x[0] = 1, 0, 0
    for i in range(T):
        u[i] = -K @ (x[i] - [np.sin(0.3 * t[i]), 0, 0])
        if i + 1 < T:
            Phi, G0 = move[min(move, key=lambda s: abs(s - (t[i + 1] - t[i])))]
            x[i + 1] = Phi @ x[i] + G0 @ u[i]
    est = dw.WindowObserver(plant, 1.0, noise_std=0.01, hold="zoh", dt=0.01, irregular=True)
    error = abs(est.scan(x[:, 0], u, time=t).estimates - x)[200:]
    assert error.max() < 1e-9
    assert error[-5000:].max() < 10 * error[:5000].max()


# --- the door, the clock, the laws -------------------------------------------------------------------------


def _small():
    plant = dw.Plant([[0, 1], [0, -1]], [0, 1], [1, 0])
    return dw.WindowObserver(
        plant, 0.5, noise_std=0.1, disturbances=dw.models.Polynomial([0, 1], 2.0), hold="zoh", dt=0.05, irregular=True
    )


def test_gap_as_long_as_the_window_empties_it():
    est = _small()
    t = np.concatenate([0.05 * np.arange(12), 0.55 + 0.499 + 0.05 * np.arange(6)])
    t = np.concatenate([t, t[-1] + 0.5 + 0.05 * np.arange(6)])
    trace = est.scan(np.sin(t), np.ones(24), time=t)
    ready = np.asarray(trace.status) & NOT_READY == 0
    assert ready[12] and np.isfinite(trace.prediction[12]), "a gap within the window is bridged"
    assert not ready[18] and np.isnan(trace.prediction[18]) and np.isinf(trace.variance[18])
    assert np.isnan(trace.estimates[18]).all() and np.isinf(trace.std[18]).all()
    fresh = est.scan(np.sin(t[18:]), np.ones(6), time=t[18:])
    assert np.array_equal(fresh.estimates, trace.estimates[18:], equal_nan=True)


def test_only_missing_outputs_fill_a_window_that_knows_nothing():
    est = _small()
    trace = est.scan(np.concatenate([np.ones(10), np.full(12, np.nan)]), np.ones(22))
    assert trace.status[-1] == MISSING_OUTPUT | NOT_READY
    assert np.isfinite(trace.state.reshape(1).view(float)).all()


def test_equal_instants_are_two_measurements_and_earlier_ones_are_refused():
    est = _small()
    t, y = 0.05 * np.arange(8), np.sin(np.arange(8))
    twice = est.scan(np.append(y, y[-1]), np.ones(9), time=np.append(t, t[-1]))
    assert np.all(twice.std[-1] < twice.std[-2])
    state = est.scan(y, np.ones(8), time=t).state
    est.update(state, 0.0, 1.0, time=t[-1])
    with pytest.raises(InputError, match="not after"):
        est.update(state, 0.0, 1.0, time=t[-1] - 1e-9)
    with pytest.raises(InputError, match="time must increase"):
        est.scan(y, np.ones(8), time=t[::-1])


def test_bad_sizes_of_the_window_are_refused():
    plant = dw.Plant([[0, 1], [0, -1]], None, [1, 0])
    options = dict(noise_std=0.1, dt=0.05, irregular=True)
    with pytest.raises(InputError, match="smallest usable one"):
        dw.WindowObserver(plant, 0.05, **options)
    with pytest.raises(InputError, match="less than half"):
        dw.WindowObserver(plant, 0.01, **options)
    with pytest.raises(InputError, match="capacity"):
        dw.WindowObserver(plant, 0.5, capacity=1, **options)


def test_laws():
    dw.check_estimator(_small())


def test_the_same_samples_at_instants_of_their_own_give_the_same_bits():
    """One by one, as a record, in two halves, in a fleet: regular stretches and others, missing ones, a gap."""
    plant, disturbances = _everything()
    est = dw.WindowObserver(
        plant, 1.0, noise_std=[0.1, 0.3], disturbances=disturbances, hold="foh", dt=0.05, irregular=True
    )
    rng = np.random.default_rng(9)
    step = rng.exponential(0.05, 120)
    step[40:80], step[100] = 0.05, 1.2
    t, y, u = np.cumsum(step), rng.standard_normal((120, 2)), rng.standard_normal((120, 2))
    y[rng.random((120, 2)) < 0.2], u[rng.random((120, 2)) < 0.1] = np.nan, np.nan
    whole = est.scan(y, u, time=t)
    state = est.start()
    for i in range(120):
        state, _ = est.update(state, y[i], u[i], time=t[i])
    first = est.scan(y[:55], u[:55], time=t[:55])
    second = est.scan(y[55:], u[55:], time=t[55:], state=first.state)
    states, _ = est.update_batch(est.start(2), np.stack([y[::-1], y]), np.stack([u, u]), time=np.stack([t, t]))
    for found in (state, second.state, states[1]):
        assert found.tobytes() == whole.state.tobytes()
    assert np.array_equal(np.concatenate([first.table, second.table]), whole.table, equal_nan=True)


def test_samples_without_an_instant_are_one_dt_apart_however_late():
    est = _small()
    state = est.scan(np.sin(np.arange(20)), np.ones(20)).state
    late = state.copy()
    late["time"] += 1e9
    y = np.cos(np.arange(20))
    soon, then = est.scan(y, np.ones(20), state=state), est.scan(y, np.ones(20), state=late)
    assert np.allclose(soon.estimates, then.estimates, rtol=1e-12)


def test_clock_of_large_numbers():
    """Seconds since 1970: instants are rounded to 0.2 us, and the estimate to what that leaves."""
    est = _small()
    t = 0.05 * np.arange(40)
    y, u = np.sin(t), np.ones(40)
    near, far = est.scan(y, u, time=t), est.scan(y, u, time=1.7e9 + t)
    assert np.allclose(near.estimates[10:], far.estimates[10:], rtol=1e-4, atol=1e-4)


def test_uncompiled_equals_compiled():
    """With a mode that grows, and the straight lines of an input: every branch of a segment."""
    plant, disturbances = _everything()
    est = dw.WindowObserver(
        plant, 0.6, noise_std=[0.1, 0.3], disturbances=disturbances, hold="foh", dt=0.05, irregular=True
    )
    rng = np.random.default_rng(6)
    t = np.cumsum(rng.exponential(0.05, 60))
    y, u = rng.standard_normal((60, 2)), rng.standard_normal((60, 2))
    fast = est.scan(y, u, time=t)
    rows, outs = est._rows(est.start()), np.empty((1, *fast.table.shape))
    stamped = np.column_stack([u, t])[None]
    with np.errstate(all="ignore"):
        compile.plain_driver(*map(type, est.policies))(rows, y[None], stamped, outs, est.spec, est.scratch())
    assert np.allclose(outs[0], fast.table, rtol=1e-9, atol=1e-12, equal_nan=True)
