"""The growing window: exact from the first sample on, whatever is known at the start and whatever wanders."""

import math
from functools import cache

import numpy as np
import pytest
from oracle.algebraic import growing_estimates, window_estimate_exact
from paper_motor import GOLDEN, MOTOR, SIGMA
from scipy.linalg import expm

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.engine import compile

NAMED = dw.Plant([[0, 1, 0], [0, 0, 1], [0, -2, -10]], [0, 0, 2], states=("angle", "speed", "current"), inputs="u")


def dense(est, y, u, time):
    """Return what the joint Gaussian of the whole record says at each instant; a straight line is two held numbers."""
    system, steps = est.plant, np.diff(time, append=time[-1] + 1.0)
    slope = np.diff(u[:, 0], append=0.0) / steps if est.hold == "foh" else np.zeros(len(u))
    return growing_estimates(
        system.A, system.H, time, y.reshape(len(y), -1) - u @ system.D.T, est.noise_std, system.walk,
        B=np.column_stack([system.B[:, 0], np.zeros(system.m)]), G=[[0.0, 1.0], [0.0, 0.0]],
        v=np.column_stack([u[:, 0], slope]), prior=np.concatenate([est.x_std, system.prior_std[system.n :]]),
    )  # fmt: skip


def agree(est, y, u, time, digits):
    """Compare in units of the deviations, predictions where a sample is missing; return how many there were."""
    trace, T, count = est.scan(y, u, time=time), len(y), 0
    predictions, variances = trace.prediction.reshape(T, -1), trace.variance.reshape(T, -1)
    for t, found in enumerate(dense(est, y, u, time)):
        if found is None or not trace.ready[t]:
            continue
        count += 1
        assert abs((trace.estimates[t] - found.z) / found.std).max() < digits, t
        assert abs(trace.std[t] / found.std - 1).max() < digits, t
        if np.isnan(y[t]).all():
            H, ahead = est.plant.H, est.plant.H @ found.z + est.plant.D @ u[t]
            variance = np.diag(H @ found.P @ H.T) + est.noise_std**2
            assert abs((predictions[t] - ahead) / np.sqrt(variance)).max() < digits
            assert abs(variances[t] / variance - 1).max() < digits
    return count


def noisy(samples, outputs, seed):
    """Return y with gaps and u: any numbers of the size of their noise will do to compare two computations."""
    rng = np.random.default_rng(seed)
    y = 0.05 * rng.standard_normal((samples, outputs))
    y[rng.random(y.shape) < 0.15] = np.nan
    return (y if outputs > 1 else y[:, 0]), rng.standard_normal((samples, 1))


def test_constant_unknowns_are_dense_least_squares():
    """Six modes, anchored at first and handed over later, against sixty digits."""
    torque = dw.models.Polynomial([0, 0, 1], np.inf), dw.models.Sinusoid(50.0, [0, 0, 1], np.inf)
    est = dw.WindowObserver(NAMED, math.inf, noise_std=0.01, disturbances=torque, hold="zoh", dt=1e-3)
    y, u = noisy(60, 1, 0)
    trace, system, time = est.scan(y, u), est.plant, 1e-3 * np.arange(60)
    assert trace.ready[8] and not trace.ready[5]
    for t in (8, 12, 20, 59):
        found = window_estimate_exact(
            system.A, system.H, time[: t + 1], y[: t + 1], 0.01, B=system.B, G=[[0.0]], v=u[: t + 1]
        )
        assert abs((trace.estimates[t] - found.z) / found.std).max() < 1e-9, t
        assert abs(trace.std[t] / found.std - 1).max() < 1e-9, t


def test_a_walk_counts_from_the_first_sample_on_at_any_instants():
    """No prior, a prior and a walk at once; two outputs, gaps, straight-line inputs, steps from 0.2 to 30 dt."""
    plant = dw.Plant(
        [[0, 1, 0], [0, 0, 1], [0, -2, -10]], [0, 0, 2], [[1, 0, 0], [0, 0, 1]], [0, 0.3], outputs=("angle", "i")
    )
    load = dw.models.Polynomial([0, 1, 0], [np.inf, 0.5], degree=1, walk=3.0)
    est = dw.WindowObserver(
        plant, math.inf, noise_std=(0.01, 0.2), disturbances=load, hold="foh", dt=0.01, irregular=True,
        x_std=[np.inf, 2.0, np.inf],
    )  # fmt: skip
    y, u = noisy(40, 2, 1)
    y[[15, 30]] = np.nan
    time = np.cumsum(0.01 * np.exp(np.random.default_rng(2).uniform(np.log(0.2), np.log(30), 40)))
    time[10:20] = time[9] + 0.01 * np.arange(1, 11)
    assert agree(est, y, u, time, 1e-9) > 30


# --- the DC motor of Tian (2009), corrected -------------------------------

PLAIN = MOTOR._replace(B=None)


def observer(modes, prior_std=np.inf, **options):
    """Return the growing window of four modes (a constant voltage) or six (and a line of 50 rad/s)."""
    voltage = [dw.models.Polynomial([0, 0, 5], prior_std), dw.models.Sinusoid(50.0, [0, 0, 5], prior_std)][
        : modes // 2 - 1
    ]
    return dw.WindowObserver(PLAIN, math.inf, noise_std=SIGMA, disturbances=voltage, dt=1e-3, **options)


@cache
def truth(samples):
    """Return z (samples, 6) of the motor left to itself; what a known u adds moves estimate and truth alike."""
    Phi, z = expm(observer(6).plant.A * 1e-3), np.empty((samples, 6))
    z[0] = 1, 0, 3, 1, 1, 0
    for k in range(1, samples):
        z[k] = Phi @ z[k - 1]
    return z


@pytest.mark.parametrize("name", ["hard4_L500", "hard6_L500", "soft6_L500", "hard4_L1000", "hard6_L150"])
def test_golden_least_squares(name):
    """From the first of L samples on, the growing window is the window of L: 60-digit references."""
    expected = GOLDEN["window_least_squares"]["expect"]
    kind, length = name.split("_L")
    noise = 0.015 * (2 * ((np.arange(1, 1002) * (math.sqrt(5) - 1) / 2) % 1) - 1)
    est = observer(int(kind[-1]), 2.0 if kind.startswith("soft") else np.inf)
    trace = est.scan((truth(1001)[:, 0] + noise)[-int(length) :])
    W = np.zeros((5, 5))  # the motor under 24 sin t, from rest
    W[:3, :3], W[2, 3], W[3, 4], W[4, 3] = PLAIN.A, 240, 1, -1
    known = np.zeros(est.plant.m)
    known[:3] = expm(W)[:3, 4]
    np.testing.assert_allclose(trace.estimates[-1] + known, expected["estimate"][name], rtol=1e-7)
    np.testing.assert_allclose(trace.std[-1], expected["std"][name], rtol=1e-7)


# Table of section 4 of the theory: root mean square errors over 2-10 s, 200 seeds
TABLE = [
    ("growing least squares, 6 modes", observer(6), (3.9e-4, 8.7e-3, 2.18)),
    ("growing least squares, 4 modes", observer(4), (3.5e-4, 5.3e-4, 0.069)),
    ("honest prior (10, 10, 30, 2, 2, 2)", observer(6, 2.0, x_std=[10, 10, 30]), (3.5e-4, 5.3e-4, 0.072)),
]


@pytest.mark.parametrize("est, expected", [row[1:] for row in TABLE], ids=[row[0] for row in TABLE])
def test_the_table_of_the_theory(est, expected):
    z, errors, squares = truth(10001), [], []
    for seed in range(10):
        trace = est.scan(z[:, 0] + np.random.default_rng(seed).uniform(-0.015, 0.015, len(z)))
        errors.append(trace.x[2000:] - z[2000:, :3])
        squares.append(trace.innovation[100:] ** 2 / trace.variance[100:])
    rms = np.sqrt(np.mean(np.square(errors), axis=(0, 1)))
    np.testing.assert_allclose(rms, expected, rtol=0.25)  # ten seeds of the table's two hundred
    assert 0.97 < np.mean(squares) < 1.03


def test_ten_thousand_samples_lose_no_digits():
    """A mode that decays by 98 time constants, and noise-free data: nothing grows, before the hand-over or after."""
    z = truth(10001)
    trace = observer(6).scan(z[:, 0])
    np.testing.assert_allclose(trace.x[20:], z[20:, :3], rtol=0, atol=1e-8)
    np.testing.assert_allclose(trace.x[1000:], z[1000:, :3], rtol=0, atol=1e-10)


# --- what users meet ---------------------------------------------------------------------------------------


def test_laws():
    """Priors of all kinds, a walk, and instants of their own; several outputs are in the comparison above."""
    load = dw.models.Polynomial([0, 1, 0], np.inf, walk=0.5)
    options = dict(noise_std=0.1, disturbances=load, hold="zoh", dt=0.05)
    est = dw.WindowObserver(NAMED, math.inf, **options, x_std=[np.inf, 1.0, 0.0])
    dw.check_estimator(est)
    y, u = noisy(50, 1, 3)
    other = dw.WindowObserver(NAMED, math.inf, **options, irregular=True)
    time = np.cumsum(np.random.default_rng(4).uniform(0.01, 0.1, 50))
    whole, state = other.scan(y, u, time=time), other.start()
    for t in range(50):
        state, step = other.update(state, y[t], u[t], time=time[t])
        assert same(np.array(step), whole.table[t, :4])
    assert same(state, whole.state)
    assert same(other.scan(y, u, time=0.05 * np.arange(50)).ready, other.scan(y, u).ready)


def test_noise_is_learnt_where_nothing_else_is_absolute():
    """Deviations are those of least squares times the noise found (compiled code is the same as with noise known)."""
    y = truth(400)[:, 0] + SIGMA * np.random.default_rng(0).standard_normal(400)
    est = dw.WindowObserver(
        PLAIN, math.inf, noise_std=None, disturbances=dw.models.Polynomial([0, 0, 5], np.inf), dt=1e-3
    )
    est.__dict__["drive"] = compile.plain_driver(*map(type, est.policies))
    trace, known = est.scan(y), observer(4).scan(y)
    np.testing.assert_allclose(trace.x[-1], known.x[-1], rtol=1e-9)
    np.testing.assert_allclose(trace.std[-1], known.std[-1], rtol=0.15)
    assert np.isinf(trace.std[5]).all() and np.isnan(trace.x[5]).all()


def test_a_state_that_is_known_is_where_it_starts():
    """x0 without doubt: the first samples teach nothing about x, and predictions are those of the plant."""
    est = dw.WindowObserver(NAMED, math.inf, noise_std=1.0, hold="zoh", dt=0.1, x0=[1, -1, 2], x_std=0.0)
    y, u = noisy(30, 1, 5)
    trace, x = est.scan(y, u), np.array([1.0, -1.0, 2.0])
    Phi, G, _ = est.plant.discretise(0.1)
    for t in range(30):
        np.testing.assert_allclose(trace.x[t], x, rtol=1e-12)
        assert trace.prediction[t] == pytest.approx(x[0], rel=1e-12) and trace.variance[t] == 1.0
        x = Phi @ x + G @ u[t]


def test_an_unstable_plant_lost_in_a_gap_starts_again():
    plant = dw.Plant([[0, 1], [9, 0]])
    est = dw.WindowObserver(plant, math.inf, noise_std=0.1, disturbances=dw.models.Polynomial([0, 1], np.inf), dt=0.1)
    y = np.full(700, np.nan)
    y[:20], y[-20:] = np.cosh(0.3 * np.arange(20)), np.cosh(0.3 * np.arange(20))
    trace = est.scan(y)
    assert np.sum((trace.status & int(dw.Status.LOST)) > 0) == 1 and np.isfinite(trace.state["zhat"]).all()
    lost = np.flatnonzero(trace.status & int(dw.Status.LOST))[0]
    assert trace.ready[lost - 1] and not trace.ready[lost] and trace.ready[-1]
    np.testing.assert_allclose(trace.x[-1, 0], y[-1], atol=0.3)


def test_a_tolerance_says_when_it_is_ready():
    """The automatic epsilon of the theory: 0.39 s for four modes, 0.18 s for six with an honest prior."""
    for est, seconds in ((observer(4, tolerance=[0.015, 0.25, 1.2]), 0.39),
                         (observer(6, 2.0, tolerance=[0.015, 0.25, 1.2]), 0.18)):  # fmt: skip
        trace = est.scan(truth(600)[:, 0])
        first = int(np.argmax(trace.ready))
        assert abs(trace.time[first] - seconds) < 0.011 and np.isnan(trace.x[first - 1]).all()


# --- tuning ------------------------------------------------------------------------------------------------


def walking(walk, samples, seed, prior_std=np.inf):
    """Return an observer of a cart under a force that walks, and its output with noise of deviation 0.01."""
    force = dw.models.Polynomial([0, 1], prior_std, walk=walk)
    est = dw.WindowObserver(dw.Plant([[0, 1], [0, 0]]), math.inf, noise_std=0.01, disturbances=force, dt=0.02)
    rng, system, z = np.random.default_rng(seed), est.plant, np.zeros(3)
    Phi, W = system.discretise(0.02)[0], np.linalg.cholesky(system.noise(0.02) + 1e-30 * np.eye(3))
    y = np.empty(samples)
    for t in range(samples):
        y[t] = z[0] + 0.01 * rng.standard_normal()
        z = Phi @ z + W @ rng.standard_normal(3)
    return est, y


def test_tune_finds_walk_and_noise():
    est, y = walking(2.0, 3000, 0)
    start = dw.WindowObserver(**{**est.options, "noise_std": 0.1})
    found = start.tune(y, noise=True)
    assert found.tuned.walk[0] == pytest.approx(2.0, rel=0.2) and found.noise_std[0] == pytest.approx(0.01, rel=0.05)
    trace = found.scan(y)
    assert np.nanmean(trace.innovation[10:] ** 2 / trace.variance[10:]) == pytest.approx(1.0, abs=0.02)
    tuned = found.tuned
    assert tuned.loglik >= tuned.logliks.max() and tuned.gain > 100
    assert abs(math.log(tuned.tried[0, tuned.logliks[0].argmax()] / tuned.walk[0])) < math.log(10) / 2
    assert "walks by" in tuned.words and "Noise deviation 0.0" in tuned.words


def test_tune_leaves_alone_what_it_is_not_asked_for():
    """Two disturbances, one of them tuned at irregular instants; and the noise of a plant that has none."""
    est, y = walking(2.0, 1000, 4)
    offset = dw.models.Polynomial([0, 0], 0.1, outputs=1.0, walk=0.003, name="offset")
    force = est.options["disturbances"]._replace(walk=0.0, prior_std=1.0)
    both = dw.WindowObserver(**{**est.options, "disturbances": (offset, force), "irregular": True, "x0": [0, 0],
                                "x_std": 0.1})  # fmt: skip
    found = both.tune(y, time=0.02 * np.arange(1000), which=1)
    assert found.tuned.walk[0] == 0.003 and found.tuned.walk[1] == pytest.approx(2.0, rel=0.4)
    assert found.tuned.words.startswith("Disturbance 1 walks by") and found.tuned.tried.shape[0] == 1
    bare = dw.WindowObserver(dw.Plant([[0.0]]), math.inf, noise_std=1.0, dt=0.02)
    noise = 0.05 * np.random.default_rng(0).standard_normal(1000)
    assert bare.tune(noise, noise=True).noise_std[0] == pytest.approx(np.std(noise, ddof=1), rel=1e-3)


def test_tune_says_where_a_record_shows_no_walk():
    _, y = walking(1e-9, 600, 3)
    found = walking(1.0, 2, 0)[0].tune(y)
    assert found.tuned.walk[0] == 0 and "at its lower limit" in found.tuned.words
    assert found.plant.walk[2] == 0


def test_the_likelihood_is_that_of_the_joint_gaussian():
    """Differences between walks are those of the restricted likelihood of all samples, the first ones included."""
    from driftwise.estimators.window_observer import growing

    values, dense_values = [], []
    for walk in (0.0, 3.0):
        est, _ = walking(walk, 2, 0)
        y = noisy(25, 1, 7)[0]
        values.append(growing.loglik(est, est.scan(y).state))
        Phi, Q = est.plant.discretise(0.02)[0], est.plant.noise(0.02)
        F = np.array([np.linalg.matrix_power(Phi, k) for k in range(25)])
        V, A = 1e-4 * np.eye(25), F[:, 0]
        for j in range(1, 25):
            G = np.array([F[k - j, 0] if k >= j else np.zeros(3) for k in range(25)])
            V = V + G @ Q @ G.T
        ok = ~np.isnan(y)
        V, A, e = V[ok][:, ok], A[ok], y[ok]
        Vi = np.linalg.inv(V)
        M = Vi - Vi @ A @ np.linalg.solve(A.T @ Vi @ A, A.T @ Vi)
        logdet = np.linalg.slogdet(V)[1] + np.linalg.slogdet(A.T @ Vi @ A)[1]
        dense_values.append(-0.5 * (logdet + e @ M @ e + (len(e) - 3) * math.log(2 * math.pi)))
    np.testing.assert_allclose(values, dense_values, rtol=1e-8)


def test_tune_chooses_a_window():
    """Long where the force stays, short where it walks: the next sample decides."""
    lengths = []
    for walk in (0.0, 30.0):
        est, y = walking(walk, 1200, 1)
        force = dw.models.Polynomial([0, 1], np.inf)
        est = dw.WindowObserver(est.options["plant"], 0.5, noise_std=0.01, disturbances=force, dt=0.02)
        found = est.tune(y)
        tuned = found.tuned
        lengths.append(round(found.window / 0.02))
        assert tuned.loglik == tuned.logliks.max() and f"{lengths[-1]} samples" in tuned.words
    assert lengths[0] > 200 and 5 < lengths[1] < 40


def test_tune_refuses_what_it_cannot_do():
    est, y = walking(1.0, 50, 0)
    with pytest.raises(dw.InputError, match="y has 0 measured values and there are 3 unknowns"):
        est.tune(np.nan * y)
    with pytest.raises(dw.InputError, match="which must name disturbances"):
        est.tune(y, which=[1])
    bare = dw.WindowObserver(est.options["plant"], math.inf, noise_std=0.01, dt=0.02)
    with pytest.raises(dw.InputError, match="no disturbance"):
        bare.tune(y)
    with pytest.raises(dw.InputError, match="has no walks to tune"):
        dw.WindowObserver(est.options["plant"], 0.5, noise_std=0.01, dt=0.02).tune(y, noise=True)
    learning = dw.WindowObserver(
        **{**est.options, "disturbances": dw.models.Polynomial([0, 1], np.inf), "noise_std": None}
    )
    with pytest.raises(dw.InputError, match="needs noise_std to start from"):
        learning.tune(y)
