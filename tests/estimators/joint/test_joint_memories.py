"""What memories do to the joint filter: against full matrices, and against the regression that it is."""

import numpy as np
import pytest
from scipy.signal import lfilter

import driftwise as dw
from driftwise import memory as m
from driftwise.memory.auto_state import open_parts

A, B, SIGMA = [-1.5, 0.7], [1.0, 0.5], 0.1


def record(samples=200, missing=0.0, seed=1):
    y, u = dw.simulate(A, B, samples=samples, noise_std=SIGMA, seed=seed)
    lost = np.random.default_rng(seed).random(samples) < missing
    return np.where(lost, np.nan, y), np.asarray(u)


# --- with the state given by the data it is a regression -----------------------------------------------------------


REGRESSIONS = {
    "gain floor": m.GainFloor(30),
    "exponential": m.ExponentialForgetting(0.97),
    "variable": m.VariableForgetting(40),
    "directional": m.DirectionalForgetting(0.95),
    "window": m.Window(25),
    "constant": dw.Constant(),
    "reset": dw.RestartOnChange(dw.detect.VarianceCUSUM(threshold=1.0), m.GainReset(5), settle=10),
}


@pytest.mark.parametrize("name", REGRESSIONS)
def test_under_equation_error_it_is_arx(name):
    """The state of the joint filter is known given theta: no memory that forgets can tell it from a regression."""
    y, u = record()
    P0 = np.diag([0.0, 0.0, *4 * [100.0]])  # nothing came before: the state was zero
    noise = dw.models.EquationError(SIGMA**2)
    joint = dw.Joint(2, inputs=1, memory=REGRESSIONS[name], noise=noise, P0=P0).scan(y, u)
    arx = dw.ARX(2, 2, memory=REGRESSIONS[name], variance=SIGMA**2, P0=100.0, at_rest=True).scan(y, u)
    for which in ("parameters", "parameters_std", "prediction", "variance"):
        np.testing.assert_allclose(getattr(joint, which), getattr(arx, which), rtol=1e-9, atol=1e-9, err_msg=which)
    np.testing.assert_array_equal(joint.status & dw.Status.JUMP, arx.status & dw.Status.JUMP)


# --- full matrices -------------------------------------------------------------------------------------------------


class Dense:
    """The filter of x+ = shift x - a y + b u + d v, y = x_1 + v, as a textbook writes it, v of variance R."""

    def __init__(self, n, d, R, P):
        self.n, self.d, self.R, self.s, self.P = n, np.asarray(d, float), R, np.zeros(3 * n), P.copy()

    def step(self, y, u):
        """Take a sample; return prediction, its variance, and s, P given the sample."""
        n, h = self.n, np.eye(3 * self.n)[0]
        yhat, T = h @ self.s, h @ self.P @ h + self.R
        K = self.P @ h / T
        s, P = self.s + K * (y - yhat), self.P - np.outer(K, K) * T
        F = np.eye(3 * n)
        F[:n, :n] = np.eye(n, k=1) - np.outer(self.d, h[:n])
        F[:n, n : 2 * n], F[:n, 2 * n :] = -y * np.eye(n), u * np.eye(n)
        self.s, self.P = F @ s, F @ P @ F.T
        self.s[:n] += self.d * y
        return yhat, T, s, P

    def parts(self):
        """Return p(theta) and p(x | theta): covariance of theta, slope A and covariance of x given theta."""
        n, P = self.n, self.P
        Ptt, Pxt = P[n:, n:], P[:n, n:]
        slope = Pxt @ np.linalg.inv(Ptt)
        return Ptt, slope, P[:n, :n] - slope @ Pxt.T

    def join(self, Ptt, slope, Pxx):
        """Let P be what these amount to."""
        self.P = np.block([[Pxx + slope @ Ptt @ slope.T, slope @ Ptt], [Ptt @ slope.T, Ptt]])


def forgotten(dense, lam, state):
    Ptt, slope, Pxx = dense.parts()
    dense.join(Ptt / lam, slope, Pxx / lam if state else Pxx)


def drifted(dense, phi, Q):
    n = dense.n
    F = np.eye(3 * n)
    F[n:, n:] = phi
    dense.s, dense.P = F @ dense.s, F @ dense.P @ F.T
    dense.P[n:, n:] += Q


PHI, Q = np.diag([0.99, 0.97, 0.98, 0.95]), np.diag([1e-4, 2e-4, 1e-3, 5e-4])
COUPLED = PHI + 0.02 * np.eye(4, k=1)
LINKED = Q + 1e-5
CASES = {
    "forgotten": (dict(memory=m.ExponentialForgetting(0.98)), lambda f: forgotten(f, 0.98, False)),
    "forgotten, the state too": (
        dict(memory=m.ExponentialForgetting(0.98), forget_state=True),
        lambda f: forgotten(f, 0.98, True),
    ),
    "drift": (dict(memory=m.Drift(tuple(np.diag(PHI)), tuple(np.diag(Q)))), lambda f: drifted(f, PHI, Q)),
    "drift of matrices": (dict(memory=m.Drift(COUPLED, LINKED)), lambda f: drifted(f, COUPLED, LINKED)),
}


@pytest.mark.parametrize("d", [(0.0, 0.0), (0.4, -0.2)], ids=["equation error", "polynomial"])
@pytest.mark.parametrize("name", CASES)
def test_forgetting_and_drift_of_full_matrices(name, d):
    options, forget = CASES[name]
    y, u = record(200)
    root = 0.3 * np.random.default_rng(3).standard_normal((6, 6)) + np.eye(6)
    est = dw.Joint(2, inputs=1, noise=dw.models.NoisePolynomial(d, SIGMA**2), P0=4.0 * root @ root.T, **options)
    begun = est.scan(y[:60], u[:60]).state  # until then a variance may be held at its prior's
    trace = est.scan(y[60:], u[60:], state=begun)
    assert not (trace.status & dw.Status.CAPPED).any()
    back = [1, 0, 3, 2, 5, 4]  # Salut counts backwards
    dense = Dense(2, d[::-1], SIGMA**2, est.covariance(begun)[np.ix_(back, back)])
    dense.s[:] = est.mean(begun)[back]
    for t in range(len(trace)):
        yhat, T, s, P = dense.step(y[60 + t], u.ravel()[60 + t])
        np.testing.assert_allclose([trace.prediction[t], trace.variance[t]], [yhat, T], rtol=1e-8)
        np.testing.assert_allclose(np.concatenate([trace.x[t], trace.parameters[t]]), s, rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(trace.parameters_std[t], np.sqrt(np.diag(P)[2:]), rtol=1e-7)
        forget(dense)
    np.testing.assert_allclose(est.mean(trace.state)[back], dense.s, rtol=1e-7, atol=1e-9)


def test_a_correction_by_the_memory_is_that_of_the_filter():
    """Least squares through p(theta) p(x | theta) is least squares of (x, theta), gaps and colour included."""
    y, u = record(missing=0.2)
    for noise in (
        dw.models.EquationError(SIGMA**2),
        dw.models.OutputError(SIGMA**2),
        dw.models.NoisePolynomial([0.3, -0.2], SIGMA**2),
    ):
        # jumps so rare that they never are: what is left is one Kalman filter
        never = m.BayesianChangePoint(1e-9, 1e300, 2)
        plain, mixed = (
            dw.Joint(2, inputs=1, noise=noise, memory=memory).scan(y, u) for memory in (dw.Constant(), never)
        )
        for which in ("x", "x_std", "parameters", "parameters_std", "prediction", "variance"):
            found, sought = getattr(mixed, which), getattr(plain, which)
            np.testing.assert_allclose(found, sought, rtol=1e-6, atol=1e-9, err_msg=which)


# --- outliers ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("at", [300, 350, 400])
def test_an_output_that_is_certainly_wrong_is_as_good_as_missing(at):
    """Neither the state nor its bars know of an outlier of thirty deviations: they are those of a gap."""
    y, u = record(500)
    est = dw.Joint(2, inputs=1, memory=m.AutoMemory("outliers"))
    gap, glitch = y.copy(), y.copy()
    gap[at], glitch[at] = np.nan, y[at] + 30 * SIGMA
    missing, wrong = est.scan(gap, u), est.scan(glitch, u)
    after = slice(at + 1, at + 6)
    assert wrong.status[at] & dw.Status.OUTLIER
    assert np.abs((wrong.x - missing.x)[after] / missing.x_std[after]).max() < 0.2
    np.testing.assert_allclose(wrong.x_std[after], missing.x_std[after], rtol=0.1)


# --- a plant that follows its own past -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "memory", [m.AutoMemory(), m.MultipleModel(), m.IMM()], ids=lambda memory: type(memory).__name__
)
def test_an_output_error_is_known_soon_when_nobody_tells_its_size(memory):
    """A prior as wide as the data is no noise: multiplied by itself it would hold sigma^2 up for ever."""
    found, noise = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u = rng.standard_normal(60)
        y = lfilter([0.0, 1.0, 0.5], [1.0, -1.2, 0.5], u) + 0.1 * rng.standard_normal(60)
        est = dw.Joint(2, inputs=1, noise=dw.models.OutputError(), memory=memory).scaled_to(y, u)
        trace = est.scan(y, u)
        found.append(np.abs(trace.parameters[-1] - [-1.2, 0.5, 1.0, 0.5]).max())
        noise.append(trace.summary().noise_std)
    assert np.quantile(found, 0.9) < 0.06
    assert 0.07 < min(noise) and max(noise) < 0.15


@pytest.mark.parametrize(("a", "b"), [([-1.06, 0.23], [-0.9, 0.66]), ([-1.32, 0.42], [1.13, -0.65])])
def test_samples_that_a_wide_prior_explains_say_nothing_of_sigma(a, b):
    """A pole that a zero nearly hides is known late: who takes small innovations for little noise is sure of one."""
    off = []
    for seed in range(24):
        y, u = dw.simulate(a, b, samples=150, noise_std=0.2, noise="output", seed=seed)
        est = dw.Joint(2, inputs=1, noise=dw.models.OutputError(), memory=m.AutoMemory()).scaled_to(y, u)
        trace = est.scan(y, u)
        off.append(((trace.parameters - [*a, *b]) / trace.parameters_std)[50:])
    assert np.sqrt(np.mean(np.square(off))) < 3.7  # 2.3 with sigma told: a Gaussian for what is none; it was 4.5


# --- jumps ---------------------------------------------------------------------------------------------------------


def jumping(seed, samples=420, at=300):
    """A plant in Salut's form whose b1 and b2 jump by seven deviations: b2 takes a sample longer to show than b1."""
    rng = np.random.default_rng(seed)
    u, v = rng.standard_normal(samples), 0.2 * rng.standard_normal(samples)
    theta, x, y = np.array([-1.0, 0.3, 1.0, 0.5]), np.zeros(2), np.empty(samples)
    step = 1.4 * rng.choice([-1.0, 1.0], 2)
    for t in range(samples):
        if t == at:
            theta = theta + np.concatenate([np.zeros(2), step])
        y[t] = x[0] + v[t]
        x = np.append(x[1:], 0.0) - theta[:2] * y[t] + theta[2:] * u[t]
    return y, u, theta


def test_after_a_jump_the_samples_that_are_half_old_teach_nothing_wrong():
    """What the state still owes to the old parameters is not held against the new ones, for hundreds of samples."""
    wrong = []
    for seed in range(20):
        y, u, theta = jumping(seed)
        trace = dw.Joint(2, inputs=1, memory=m.AutoMemory()).scan(y, u)
        assert len(trace.jumps()) >= 1
        wrong.append(np.abs(trace.parameters[-1] - theta).max())
    assert np.median(wrong) < 0.03 and max(wrong) < 0.15


def test_what_may_be_a_jump_teaches_no_speed_of_drift():
    """A jump of b1 by 2.5 deviations of the noise, twenty records: speeds rose fourfold, now twofold."""
    rises = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u, v = rng.standard_normal(340), 0.2 * rng.standard_normal(340)
        y, x = np.zeros(340), 0.0
        for t in range(340):
            y[t] = x + v[t]
            x = 0.7 * y[t] + (0.5 if t < 300 else 1.0) * u[t]
        est = dw.Joint(1, 1, noise=dw.models.EquationError(), memory=dw.AutoMemory()).scaled_to(y, u)
        before = est.scan(y[:300], u[:300]).state
        after = est.scan(y[300:], u[300:], state=before).state
        learnt = [np.ravel(open_parts(None, state["memory_state"].ravel(), 2).learner.eta) for state in (before, after)]
        rises.append(np.mean(learnt[1] - learnt[0]))
    assert np.mean(rises) < 1.0
