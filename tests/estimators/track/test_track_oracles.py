"""Tracks against plain NumPy, long numbers, filterpy and numerical integration: nothing shared with what is checked."""

import math
from functools import cache

import mpmath as mp
import numpy as np
import pytest
import scipy.integrate
import scipy.stats
from oracle.motion import Follower
from oracle.motion_members import van_loan

import driftwise as dw
from driftwise.estimators.track import bank, circle, linear, pole
from driftwise.models import manoeuvre

CONSTANTS = ("forgetting", "learning_rate", "doubt", "noise", "tails")


@cache
def flown(coordinates=2, is_stated=False):
    """Return estimator, times, plots, stated covariances: straight, a turn, straight; irregular, missed, one wild."""
    rng = np.random.default_rng(3)
    t = 1e5 + np.cumsum(rng.choice([4.0, 4.0, 4.0, 3.5, 8.2, 4.3], 60))
    course = np.radians(3) * np.clip(t - t[25], 0, 60)
    step = 200 * np.diff(t, prepend=t[0] - 4)[:, None] * np.stack([np.sin(course), np.cos(course)], axis=1)
    y = (1e4 + np.cumsum(step, axis=0) + 40 * rng.standard_normal((60, 2)))[:, :coordinates]
    y[45] += 2000
    y[[1, 17, 33, 34]] = np.nan
    R = 1600 * np.eye(coordinates) * rng.uniform(0.5, 2, (60, 1, 1)) if is_stated else None
    return dw.TrackEstimator(250.0, coordinates=coordinates), t, y, R


def close(got, expected, rtol):
    """Compare relative to the largest number of the array."""
    got, expected = np.asarray(got, float), np.asarray(expected, float)
    assert got.shape == expected.shape and np.isfinite(got).all()
    return np.max(abs(got - expected)) <= rtol * np.max(abs(expected))


@cache
def left(coordinates=2):
    """Return estimator, times and plots of a boat at rest, seen every three minutes, which leaves."""
    rng = np.random.default_rng(5)
    t = np.cumsum(np.concatenate([np.full(24, 180.0), np.full(12, 30.0)]) * rng.uniform(0.98, 1.02, 36))
    y = 3.0 * np.maximum(t - t[23] + 120.0, 0.0)[:, None] * [0.6, 0.8] + 1.5 * rng.standard_normal((36, 2))
    return dw.TrackEstimator("boat", coordinates=coordinates), t, y[:, :coordinates], None


@cache
def shot_away(coordinates=2):
    """Return estimator, times and plots of a drone that hovers, and is off from one plot to the next."""
    rng = np.random.default_rng(5)
    t = np.cumsum(0.2 * rng.uniform(0.8, 1.2, 50))
    step = 4.0 * np.diff(t, prepend=t[0]) * np.where(t > t[24], 1.0, 0.1)
    y = np.cumsum(np.stack([step, np.zeros(50)], axis=1), axis=0) + 0.01 * rng.standard_normal((50, 2))
    return dw.TrackEstimator(20.0, coordinates=coordinates), t, y[:, :coordinates], None


@cache
def stayed(coordinates=2):
    """Return estimator, times and plots of a straight flight whose position stays behind twice and catches up."""
    rng = np.random.default_rng(5)
    t = np.cumsum(4.0 * rng.uniform(0.9, 1.1, 70))
    y = 200.0 * t[:, None] * [0.6, 0.8] + 20.0 * rng.standard_normal((70, 2))
    for begin, old in ((30, (1.0, 0.7, 0.3)), (50, (1.6, 1.2, 0.8, 0.4))):
        y[begin : begin + len(old)] -= 200.0 * np.outer(old, [0.6, 0.8])
    return dw.TrackEstimator(250.0, coordinates=coordinates), t, y[:, :coordinates], None


@pytest.mark.parametrize(
    "record",
    [
        (flown, 2, False),
        (flown, 2, True),
        (flown, 1, True),
        (left, 2),
        (left, 1),
        (shot_away, 2),
        (shot_away, 1),
        (stayed, 2),
        (stayed, 1),
    ],
)
def test_all_it_tells_equals_matrices_written_from_the_textbook(record):
    make, coordinates, *stated = record
    est, t, y, R = make(coordinates, *stated)
    trace = est.scan(t, y, R)
    follower = Follower(est.speed, coordinates, **{name: est.options[name] for name in CONSTANTS})
    waited = []
    for k in range(len(t)):
        told = follower.take(t[k], y[k], None if R is None else np.diag(R[k]))
        waited.append(bool(follower.waiting))
        is_wild = waited[-1] and np.isfinite(y[k]).all() and follower.doubt > 0.5
        assert bool(trace.status[k] & int(dw.Status.OUTLIER)) == is_wild, k
        if not k:
            continue
        assert close(trace.prediction[k], told["prediction"], 1e-12), k
        assert close(trace.variance[k], told["variance"], 1e-10), k
        assert close(trace.weights[k], told["weights"], 1e-10), k
        assert close(trace.tails()[k] @ np.array(bank.COUNTED), told["spreading"], 1e-10), k
        state = np.stack([trace.position[k], trace.velocity[k], trace.acceleration[k]], axis=1)
        scale = [1, 1e-3, 1e-4]  # km, m/s, dm/s2: each to its own digits
        assert close(state / scale, told["state"] / scale, 1e-10), k
        unit = np.tile([1.0, 4.0, 16.0], coordinates)
        assert close(trace.spread[k] * np.outer(unit, unit), told["spread"] * np.outer(unit, unit), 1e-9), k
        assert close(trace.manoeuvre[k], told["manoeuvre"], 1e-10), k
        if np.isfinite(y[k]).all():
            assert close(trace.log_score[k], told["log_score"], 1e-10), k
            assert np.max(abs(scipy.stats.norm.cdf(trace.normal_score[k]) - told["lower"])) < 1e-10, k
            assert trace.onset[k] == told["onset"], k
        if "pole" in told:
            assert close([trace.pole[k], trace.pole_sd[k]], [told["pole"], told["pole_sd"]], 1e-10), k
        if coordinates == 2 and k % 20 == 3:
            _, S = est.predict(est.scan(t[:k], y[:k], None if R is None else R[:k]).state, t[k])
            assert close(S[0, 1], told["cross"], 1e-7), k
    assert (trace.onset.any() or make is not flown) and (any(waited) or make is stayed)
    assert not (make is stayed and trace.onset.any())


# --- one model of motion at a time --------------------------------------------------------------------------


@pytest.mark.parametrize("alpha, d", [(0.2, 1e-5), (0.05, 0.7), (0.05, 19.9), (0.05, 20.1), (0.3, 1e6), (0.0, 12.0)])
def test_singers_response_and_noise(alpha, d):
    """Against integrals in long numbers."""
    with mp.workdps(30):
        a, h = mp.mpf(alpha), mp.mpf(d)
        p = (lambda s: (a * s + mp.expm1(-a * s)) / a**2) if alpha else (lambda s: s * s / 2)
        v = (lambda s: -mp.expm1(-a * s) / a) if alpha else (lambda s: s)
        f = (lambda s: mp.exp(-a * s)) if alpha else (lambda s: mp.mpf(1))
        assert np.allclose(manoeuvre.response(alpha, d), [float(x(h)) for x in (p, v, f)], rtol=1e-12, atol=0)
        cuts = [0, h] if alpha * d < 30 else [0, 10, 50, 200, 1000, h]
        pairs = [(p, p), (p, v), (p, f), (v, v), (v, f), (f, f)]
        expected = [float(mp.quad(lambda s, x=x, y=y: x(s) * y(s), cuts, method="gauss-legendre")) for x, y in pairs]
    assert np.allclose(manoeuvre.spread(alpha, d), expected, rtol=1e-11, atol=0)


def members(gap, fastest, unit):
    """Return a row in which all linear members have started."""
    row = np.zeros(bank.row_size(len(unit)))
    row[bank.PERIOD] = math.log(gap)
    linear.begin(row, len(unit), bank.period(row), fastest, np.array(unit))
    return row


@pytest.mark.parametrize("i", range(bank.KALMAN))
def test_linear_members_are_kalman_filters(i):
    """Against filterpy, with F and Q by Van Loan's exponential; uncompiled."""
    filters = pytest.importorskip("filterpy.kalman")
    rng, T, r, fastest = np.random.default_rng(i), 3.0, 7.0, 30.0
    order = 2 if i < bank.LINES else 3
    forget, noise = (bank.STRAIGHT + bank.CURVED)[i]
    A, W = np.diag(np.ones(order - 1), 1), np.zeros((order, order))
    A[-1, -1], W[-1, -1] = -forget / T, noise * r / T ** (2 * order - 1)
    kf = filters.KalmanFilter(order, 1)
    kf.P, kf.H, kf.x = np.diag([r, fastest**2, r / T**4][:order]), np.eye(1, order), np.zeros((order, 1))
    row = members(T, fastest, [r])
    at = bank.at_linear(1, i, 0)
    for k in range(30):
        d, y, g = rng.choice([T, 0.1, 7.3]), 50 * rng.standard_normal(), rng.uniform(0.5, 2)
        kf.F, kf.Q = van_loan(A, W, d)
        kf.predict()
        linear.predict_all(row, 1, bank.period(row), d)
        assert np.isclose(row[at], kf.x[0, 0], rtol=1e-10, atol=1e-10), k
        kf.update(y, R=g * r)
        linear.correct(row, at, i, y - row[at], g)
        x, P = [0, linear.V, linear.A][:order], [linear.PP, linear.PV, linear.VV]
        found = np.zeros((3, 3))
        found[(0, 0, 1), (0, 1, 1)] = row[[at + k for k in P]]
        if order == 3:
            found[(0, 1, 2), (2, 2, 2)] = row[[at + k for k in (linear.PA, linear.VA, linear.AA)]]
        assert np.allclose(row[[at + k for k in x]], kf.x[:, 0], rtol=1e-9, atol=1e-9), k
        unit = np.outer(*[[1, T, T * T][:order]] * 2) / r
        assert np.allclose(found[:order, :order] * unit * r, np.triu(kf.P) * unit, rtol=1e-8, atol=1e-9), k


def test_a_turn_is_a_circle():
    """Mean against the integrated equations of motion, covariance against finite differences of them; uncompiled."""
    T, unit, d = 4.0, np.array([100.0, 64.0]), 5.0

    def flow(z):
        def motion(_, s):
            return [s[1], s[4] * s[3], s[3], -s[4] * s[1], 0.0]  # to the right: East gains what North had

        return scipy.integrate.solve_ivp(motion, (0, d), z, rtol=1e-12, atol=1e-10, method="DOP853").y[:, -1]

    rng = np.random.default_rng(2)
    for omega in (0.05, -0.2, 0.0):
        row = members(T, 250.0, unit)
        at = bank.at_circle(2, 0)
        circle.begin(row, 2, 0, bank.period(row), 250.0, unit)
        z = np.array([10.0, 120.0, -30.0, -160.0, omega])
        root = rng.standard_normal((5, 5)) * np.array([8.0, 3, 8, 3, 0.01])[:, None]
        before = root @ root.T
        upper = np.triu_indices(5)
        row[at : at + 5], row[at + circle.P : at + bank.CIRCULAR] = z, before[upper]
        circle.predict(row, 2, 0, bank.period(row), d, unit, *np.zeros((3, 5, 5)))
        h = np.array([1e-2, 1e-3, 1e-2, 1e-3, 1e-6])
        F = np.stack([(flow(z + h * e) - flow(z - h * e)) / (2 * h @ e) for e in np.eye(5)], axis=1)
        q = bank.TURNS[0] * unit.mean() / T**3
        _, Q = van_loan(np.array([[0.0, 1], [0, 0]]), np.diag([0, q]), d)
        after = F @ before @ F.T + np.block(
            [[Q, np.zeros((2, 3))], [np.zeros((2, 2)), Q, np.zeros((2, 1))], [np.zeros((1, 4)), circle.RATE * d / T**3]]
        )
        assert np.allclose(row[at : at + 5], flow(z), rtol=1e-9, atol=1e-7)
        sd = np.sqrt(np.diag(after))
        found = row[at + circle.P : at + bank.CIRCULAR] / np.outer(sd, sd)[upper]
        assert np.allclose(found, (after / np.outer(sd, sd))[upper], rtol=0, atol=1e-6)


@pytest.mark.parametrize("rho", bank.RADII)
def test_the_manoeuvre_pole_is_one_regression(rho):
    """One pole of both coordinates, all differences at once: w_k - phi w_(k-1) = (1 - rho q)^2 nu, a joint Gaussian."""
    i, n, unit, r, first = bank.RADII.index(rho), 24, np.array([4.0, 9.0]), np.array([2.0, 5.0]), 0.1
    nu = np.random.default_rng(i).standard_normal((n + 2, 2)) * np.sqrt(r)
    w = nu[2:] - 2 * rho * nu[1:-1] + rho**2 * nu[:-2]
    for k in range(1, n):
        w[k] += 0.5 * w[k - 1]
    row = np.zeros(bank.row_size(2))
    pole.begin(row, 2, i, unit)
    at, last = bank.at_pole(2, i), pole.size(2)
    of_phi = at + last + bank.triangle(last) - 1
    row[of_phi] = first  # within the bound, so that none is held
    for k in range(n):
        for c in range(2):
            pole.measure(row, 2, i, c, w[k, c], r[c], np.zeros((1, 5)))
        assert pole.step(row, 2, i, w[k], *np.zeros((2, 5, 5))) == 0.0
    # unknown: phi and its steps, per coordinate the two states before the first difference and the noises
    prior = [first, *[pole.WALK] * n]
    for c in range(2):
        prior += [pole.LOOSE * unit[c]] * 2 + [r[c]] * n
    H = np.zeros((2, n, len(prior)))
    for c in range(2):
        x2, x3, noise = (1 + n + c * (2 + n) + j for j in range(3))
        for k in range(n):
            H[c, k, noise + k] = 1.0
            if k > 0:
                H[c, k, noise + k - 1] = -2 * rho
                H[c, k, :k] = w[k - 1, c]
            if k > 1:
                H[c, k, noise + k - 2] = rho**2
        H[c, 0, x3] = H[c, 1, x2] = 1.0
    H, told = H.reshape(2 * n, -1), np.array(prior) * (np.arange(len(prior)) <= n)
    gain = np.linalg.solve(H @ np.diag(prior) @ H.T, H @ told)
    assert np.isclose(row[at + last - 1], gain @ w.T.ravel(), rtol=1e-10)
    assert np.isclose(row[of_phi], told.sum() - gain @ H @ told, rtol=1e-10)
    assert row[of_phi] < 0.5 * first


# --- what is told of the forecast and of the motion ----------------------------------------------------------


def test_density_band_and_score_are_those_of_one_distribution():
    """The density of a plot, point by point, integrates to the variance, the band and the score.

    What a wild plot would have in it counts in the variance as nine of the others do.
    """
    est, t, y, _ = flown()
    trace, k = est.scan(t, y), 40
    state = est.scan(t[:k], y[:k]).state
    mean, S = est.predict(state, t[k])
    assert np.array_equal(mean, trace.prediction[k]) and np.allclose(np.diag(S), trace.variance[k], rtol=1e-14)
    assert est.density(state, t[k], y[k]) == pytest.approx(trace.log_score[k].sum(), rel=1e-12)
    e = np.linspace(-400, 400, 20001) * math.sqrt(S[0, 0])
    p = np.exp([est.density(state, t[k], mean + [a, 0.0]) for a in e])
    p /= np.trapezoid(p, e)
    base, rare = (trace.table[k, est.columns[name]].flat[0] for name in ("base", "unforeseen"))
    whole = S[0, 0] + (1 - rare) * base * (trace.tails()[k] @ (np.array(bank.SCALES) - bank.COUNTED))
    assert np.trapezoid(p * e**2, e) == pytest.approx(whole, rel=1e-6)
    below = scipy.integrate.cumulative_simpson(p, x=e, initial=0)
    band, found = trace.band(0.95)[k, 0], trace.innovation[k, 0]
    assert np.interp(band, e, below) - np.interp(-band, e, below) == pytest.approx(0.95, abs=1e-4)
    assert scipy.stats.norm.cdf(trace.normal_score[k, 0]) == pytest.approx(np.interp(found, e, below), abs=1e-4)


def test_speed_course_and_turn_rate_have_the_deviations_of_their_functions():
    """Against central differences, and against 10^5 draws of the state."""
    est, t, y, _ = flown()
    trace = est.scan(t, y)

    def functions(s):
        vE, aE, vN, aN = s[..., 1], s[..., 2], s[..., 4], s[..., 5]
        course = np.arctan2(vE, vN)
        return np.stack([np.hypot(vE, vN), course, (aE * vN - aN * vE) / (vE**2 + vN**2)], axis=-1)

    for k in (12, 30, 33, 50):  # straight, turning, missed, after
        s = np.stack([trace.position[k], trace.velocity[k], trace.acceleration[k]], axis=1).ravel()
        V, h = trace.spread[k], 1e-4
        J = np.stack([(functions(s + h * e) - functions(s - h * e)) / (2 * h) for e in np.eye(6)], axis=1)
        sd = np.sqrt(np.diag(J @ V @ J.T))
        told = [trace.speed[k], np.exp(1j * np.radians(trace.course[k])), trace.turn_rate[k]]
        speed, course, turn_rate = functions(s)
        assert np.allclose(told, [speed, np.exp(1j * course), turn_rate], rtol=1e-9, atol=1e-15)
        assert np.allclose([trace.speed_sd[k], np.radians(trace.course_sd[k]), trace.turn_rate_sd[k]], sd, rtol=1e-6)
        drawn = functions(np.random.default_rng(k).multivariate_normal(s, V, 100_000))
        drawn[:, 1] = (drawn[:, 1] - functions(s)[1] + np.pi) % (2 * np.pi) - np.pi
        assert np.allclose(np.std(drawn, axis=0), sd, rtol=0.1)
    assert 0 <= trace.course.min() and trace.course.max() < 360
