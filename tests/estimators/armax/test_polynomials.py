"""The polynomial family: golden cases, gradients, gaps against a Kalman filter, efficiency, batch estimates."""

import json
from pathlib import Path

import numpy as np
import pytest
from oracle.polynomial import System, rpem
from scipy.optimize import least_squares

import driftwise as dw
from driftwise.engine import compile
from driftwise.estimators.armax import regressors as polynomials

PERRIOT = {
    case["name"]: case
    for case in json.loads((Path(__file__).parents[2] / "golden" / "perriot.json").read_text())["cases"]
}
SYSTEMS = {
    "ARMA": System(a=[-1.5, 0.7], c=[-0.5, 0.3]),
    "ARMAX": System(a=[-1.5, 0.7], b=[[1.0, 0.5]], nk=[1], c=[-1.0, 0.2], f=[[]]),
    "OE": System(b=[[1.0, 0.5]], nk=[1], f=[[-1.5, 0.7]]),
    "BJ": System(b=[[1.0, 0.5]], nk=[1], c=[0.5], d=[-0.8], f=[[-1.2, 0.5]]),
    "BJ, two inputs, offset": System(
        b=[[1.0, 0.5], [0.3]], nk=[1, 0], c=[0.5, 0.2], d=[-0.7], f=[[-1.2, 0.5], [-0.6]], offset=0.4
    ),
}


def estimator(name, **options):
    """The estimator of a system's orders."""
    s, kind = SYSTEMS[name], name.partition(",")[0]
    orders = dict(na=len(s.a), nc=len(s.c), nd=len(s.d), nb=tuple(map(len, s.b)), nf=tuple(map(len, s.f)), nk=s.nk)
    wanted = {"ARMA": ("na", "nc"), "ARMAX": ("na", "nb", "nc", "nk"), "OE": ("nb", "nf", "nk"),
              "BJ": ("nb", "nc", "nd", "nf", "nk")}[kind]  # fmt: skip
    if s.offset is not None:
        options["offset"] = True
    return getattr(dw, kind)(**{k: orders[k] for k in wanted}, **options)


def inputs(s, u):
    return u if s.b else None


def fleet(name, y, u, **options):
    """The final states of a fleet on records (S, T), and the steps."""
    est = estimator(name, **options)
    est = est.scaled_to(y[0], inputs(SYSTEMS[name], u[0]))
    states, steps = est.update_batch(est.start(len(y)), y, inputs(SYSTEMS[name], u))
    return est, states, steps


@pytest.mark.parametrize(
    ("case", "est", "order", "sign"),
    [
        (
            "armax111_plr_posterior_residual",
            dw.ARMAX(1, 1, 1, method="plr", variance=1.0, P0=2.0, at_rest=True),
            [0, 1, 2],
            [-1, 1, 1],
        ),
        ("armax111_rpem", dw.ARMAX(1, 1, 1, variance=1.0, P0=2.0, at_rest=True), [0, 1, 2], [-1, 1, 1]),
        ("oe11_plr", dw.OE(1, 1, method="plr", variance=1.0, P0=2.0, at_rest=True), [1, 0], [-1, 1]),
    ],
)
def test_golden(case, est, order, sign):
    """Gains 1/2, 1/3, .. are least squares with P0 = gamma_0 / R_0; the file's AR entries are -a."""
    case = PERRIOT[case]
    trace = est.scan(case["input"]["y"], case["input"]["u"])
    for got, expected in (
        (trace.parameters[:, order] * sign, np.array(case["expected"]["theta"])[:, 0]),
        (trace.innovation, np.ravel(case["expected"]["eps"])),
    ):
        assert np.max(abs(got - expected) / np.maximum(abs(expected), 1e-3)) <= case["rtol"]


@pytest.mark.parametrize("name", SYSTEMS)
def test_gradient_is_the_derivative_of_the_prediction(name):
    """With P = 0 nothing moves: psi of the last sample stands at the head of the scratch."""
    s = SYSTEMS[name]
    (y,), (u,) = s.records(1, 60, 0.5, seed=3)
    est = estimator(name, theta0=s.theta, P0=0.0, variance=0.25)
    expected, phi = s.gradient(y, u), estimator(name, theta0=s.theta, P0=0.0, variance=0.25, method="plr")
    for T in (5, 17, 60):
        for e, is_gradient in ((est, True), (phi, False)):
            scratch = e.scratch()
            e.drive(
                e._rows(e.start()), y[None, :T, None].copy(), u[None, :T].copy(), np.empty((1, T, 4)), e.spec, scratch
            )
            far = np.max(abs(scratch[: e.model.N] - expected[T - 1])) / np.max(abs(expected[T - 1]))
            assert (far < 1e-8) == is_gradient


@pytest.mark.parametrize("name", SYSTEMS)
def test_recursion_is_the_textbook_one(name):
    """Every sample, while theta moves: signals and derivatives of the past are those of the parameters then."""
    s = SYSTEMS[name]
    (y,), (u,) = s.records(1, 40, 0.5, seed=5)
    est = estimator(name, theta0=0.7 * s.theta, P0=0.001, variance=1.0, at_rest=True)
    trace = est.scan(y, inputs(s, u))
    assert not np.any(trace.status & int(dw.Status.PROJECTED)), "the twin knows no projection"
    expected = rpem(s, y, u, 0.7 * s.theta, 0.001 * np.eye(len(s.theta)))
    np.testing.assert_allclose(trace.parameters, expected, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("name", SYSTEMS)
def test_gaps_are_a_kalman_filters(name):
    """Known parameters, outputs missing: prediction and variance of every sample are exact (to the doubt cut off)."""
    s = SYSTEMS[name]
    (y,), (u,) = s.records(1, 300, 0.5, seed=7)
    rng = np.random.default_rng(0)
    y[rng.random(300) < 0.3] = np.nan
    y[100:130] = np.nan
    trace = estimator(name, theta0=s.theta, P0=0.0, variance=0.25, at_rest=True).scan(y, inputs(s, u))
    mean, variance, *_ = s.filtered(y, u, 0.5)
    np.testing.assert_allclose(trace.prediction, mean, atol=5e-4)
    np.testing.assert_allclose(trace.variance, variance, rtol=3e-6)
    if not s.a and not s.c and not s.d:
        assert not np.any(trace.status & int(dw.Status.FILLED)), "output error does not look at y"


@pytest.mark.parametrize(("name", "std"), [("ARMAX", 1.0), ("ARMAX", 0.1), ("OE", 1.0), ("BJ", 1.0), ("ARMA", 1.0)])
@pytest.mark.parametrize("lost", [(0.1, 0.0), (0.3, 0.0)])
def test_nis_under_gaps(name, std, lost):
    s = SYSTEMS[name]
    y, u = s.records(60, 2000, std, seed=7)
    rng = np.random.default_rng(3)
    gap = rng.random(y.shape) < lost[0]
    _, _, steps = fleet(name, np.where(gap, np.nan, y), u)
    late = np.arange(2000) >= 1000
    z2 = steps.innovation**2 / steps.variance
    after = np.roll(gap, 1, axis=1) & ~gap & late
    plain = ~gap & late
    assert abs(z2[plain].mean() - 1) < 0.05  # 42 000 values: 4 standard errors are 0.03
    assert abs(z2[after].mean() - 1) < 0.09  # 5 000 and more: 4 standard errors are 0.08
    assert 0.93 < np.mean(z2[plain] < 3.84) < 0.965


@pytest.mark.parametrize(("name", "std"), [("ARMAX", 1.0), ("ARMAX", 0.1), ("OE", 0.5), ("BJ", 1.0)])
def test_prediction_error_method_is_efficient(name, std):
    """rmse within 1.1 of the Cramer-Rao bound over 200 records of 4000 samples, in all directions together."""
    s = SYSTEMS[name]
    y, u = s.records(200, 4000, std, seed=1)
    est, states, steps = fleet(name, y, u)
    error = est.mean(states) - s.theta
    info = s.information(y[:10], u[:10], std)
    distance = np.einsum("si,ij,sj->s", error, info, error) / len(s.theta)
    assert 0.9 < np.sqrt(distance.mean()) < 1.1
    reported = np.mean([est.sigma2(x) * np.diag(est._theta_covariance(x)) for x in states], axis=0)
    np.testing.assert_allclose(np.sqrt(reported / np.diag(np.linalg.inv(info))), 1.0, atol=0.1)
    assert np.all(abs(error.mean(axis=0)) < 4 * error.std(axis=0) / np.sqrt(200) + 0.1 * np.sqrt(reported))
    assert abs(np.mean(steps.innovation[:, 2000:] ** 2 / steps.variance[:, 2000:]) - 1) < 0.02


@pytest.mark.parametrize("method", ["rpem", "plr"])
def test_output_error_is_unbiased_where_least_squares_is_not(method):
    """White input: least squares tends to .8 w/(w + noise) = .732, w the variance of the noise-free output."""
    s = System(b=[[1.0]], nk=[1], f=[[-0.8]])
    w = 1 / (1 - 0.64)
    std = np.sqrt(w * (0.8 / 0.732 - 1))
    y, u = s.records(50, 4000, std, seed=2, hold=1)
    oe, arx = dw.OE(1, 1, method=method), dw.ARX(1, 1)
    pole = [-e.mean(e.update_batch(e.start(50), y, u)[0])[:, i] for e, i in ((oe, 1), (arx, 0))]
    se = [p.std() / np.sqrt(50) for p in pole]
    assert abs(pole[0].mean() - 0.8) < 4 * se[0] + 1e-3
    assert abs(pole[1].mean() - 0.732) < 4 * se[1] + 1e-3


def test_the_plant_is_found_under_a_wrong_noise_model():
    """OE and BJ(nc = 1, nd = 0) where the noise is autoregressive: no bias in B and F."""
    s = System(b=[[1.0, 0.5]], nk=[1], d=[-0.8], f=[[-1.2, 0.5]])
    y, u = s.records(60, 4000, 0.5, seed=4)
    for est, at in ((dw.OE(2, 2), [0, 1, 2, 3]), (dw.BJ(2, 1, 0, 2), [0, 1, 3, 4])):
        error = est.mean(est.update_batch(est.start(60), y, u)[0])[:, at] - [1.0, 0.5, -1.2, 0.5]
        assert np.all(abs(error.mean(axis=0)) < 4 * error.std(axis=0) / np.sqrt(60) + 2e-3)


@pytest.mark.parametrize("name", SYSTEMS)
def test_recursive_is_near_the_batch_estimate(name):
    """One record of 5000 samples: within half a standard deviation of the minimum of the sum of squares."""
    s = SYSTEMS[name]
    (y,), (u,) = s.records(1, 5000, 0.5, seed=11)
    batch = least_squares(lambda t: s.at(t).innovations(y, u), s.theta, x_scale=0.1).x
    trace = estimator(name).scaled_to(y, inputs(s, u)).scan(y, inputs(s, u))
    std = trace.parameters_std[-1]
    assert np.max(abs(trace.parameters[-1] - batch) / std) < 0.5


def test_halving_the_step_saves_a_vague_start(monkeypatch):
    """OE(2, 2) from a wide prior: without the projection more starts are lost (uncompiled, rule switched off)."""
    s = SYSTEMS["OE"]
    y, u = s.records(40, 250, 1.0, seed=6, hold=1)
    est = dw.OE(2, 2, P0=100.0, variance=1.0)
    lost = []
    for radius in (polynomials.RADIUS, 1e6):
        monkeypatch.setattr(polynomials, "RADIUS", radius)
        rows, outs = est._rows(est.start(40), is_one=False), np.empty((40, 250, 4))
        with np.errstate(all="ignore"):
            compile.plain_driver(*map(type, est.policies))(rows, y[..., None], u, outs, est.spec, est.scratch())
        error = abs(rows.view(est.dtype)["theta"].reshape(40, 4) - s.theta).max(axis=1)
        lost.append(np.mean(~(error < 0.5)))
    assert lost[0] < lost[1] - 0.1


def test_a_step_too_far_is_halved():
    """c = .9, e = 1, then 1.1: least squares says 1.45; 1.175 and 1.0375 are outside too, .96875 is inside."""
    trace = dw.ARMA(0, 1, theta0=[0.9], P0=1.0, variance=1.0).scan([1.0, 2.0])
    assert trace.parameters[1, 0] == pytest.approx(0.96875, abs=1e-15)
    assert trace.status[1] == dw.Status.PROJECTED


def test_projection_is_reported_and_holds():
    s = System(a=[-0.5], c=[0.98])
    y, _ = s.records(1, 400, 1.0, seed=1)
    trace = dw.ARMA(1, 1).scan(y[0])
    assert np.any(trace.status & int(dw.Status.PROJECTED))
    assert np.all(abs(trace.parameters[:, 1]) <= polynomials.RADIUS)


def test_a_memory_follows_a_change():
    one, two = System(b=[[1.0]], nk=[1], f=[[-0.8]]), System(b=[[2.0]], nk=[1], f=[[-0.5]])
    y1, u1 = one.records(1, 2000, 0.2, seed=1)
    y2, u2 = two.records(1, 2000, 0.2, seed=2)
    y, u = np.append(y1, y2), np.concatenate([u1[0], u2[0]])
    trace = dw.OE(1, 1, memory=dw.ExponentialForgetting(0.99)).scan(y, u)
    for at, s in ((1999, one), (3999, two)):
        assert np.all(abs(trace.parameters[at] - s.theta) < 4 * trace.parameters_std[at])
    never = dw.OE(1, 1).scan(y, u).parameters[-1]
    assert np.max(abs(never - two.theta)) > 0.1


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: dw.ARMAX(1, 1, 1, theta0=[-0.5, 1.0, -1.2]), "zero of C outside"),
        (lambda: dw.OE((1, 1), (0, 1), theta0=[1.0, 1.0, 1.1]), "zero of F2 outside"),
        (lambda: dw.OE(1, 1, method="ls"), "method must be one of rpem, plr"),
        (lambda: dw.OE((1, 2), (1, 2, 3)), "nf must be one number, or one for each of the 2 inputs"),
        (lambda: dw.BJ(1, -1), "nc must be a whole number"),
        (lambda: dw.ARMA(0, 0), "no parameter"),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(dw.InputError, match=words):
        make()


def test_unknown_option_is_named():
    with pytest.raises(TypeError, match="ARMA has no option 'nb'"):
        dw.ARMA(1, 1, nb=2)


def test_too_short_a_record_is_said_so():
    y, u = SYSTEMS["BJ"].records(1, 5, 0.1)
    assert "too few" in dw.BJ(2, 1, 1, 2).scan(y[0], u[0]).summary().words


@pytest.mark.parametrize("residual", ["a posteriori", "a priori"])
def test_pseudolinear_regression_by_either_residual_is_the_textbook(residual):
    """Extended least squares with a full covariance: past e by the parameters before, or after, each correction."""
    y, u = dw.simulate([-0.8], [1.0], d=[0.5], samples=300, noise_std=0.5, seed=4)
    theta, P, e, expected = np.zeros(3), 2.0 * np.eye(3), 0.0, []
    for t in range(300):
        phi = np.array([-y[t - 1], u[t - 1], e]) if t else np.zeros(3)
        innovation = y[t] - phi @ theta
        gain = P @ phi / (1.0 + phi @ P @ phi)
        theta, P = theta + gain * innovation, P - np.outer(gain, phi @ P)
        e = innovation if residual == "a priori" else y[t] - phi @ theta
        expected.append(theta)
    est = dw.ARMAX(1, 1, 1, method="plr", residual=residual, variance=1.0, P0=2.0, at_rest=True)
    trace = est.scan(y, u)
    np.testing.assert_allclose(trace.parameters, expected, atol=1e-10)


def test_residuals_are_told_apart_and_go_with_plr():
    y, _ = dw.simulate([-0.8], [1.0], d=[0.5], samples=300, noise_std=0.5, seed=4)
    before, after = (dw.ARMA(1, 1, method="plr", residual=r).scan(y) for r in ("a priori", "a posteriori"))
    assert abs(before.parameters - after.parameters)[50:].max() > 1e-3
    with pytest.raises(dw.InputError, match='goes with method="plr"'):
        dw.ARMAX(1, 1, 1, residual="a priori")
    with pytest.raises(dw.InputError, match="residual must be one of a posteriori, a priori"):
        dw.ARMAX(1, 1, 1, method="plr", residual="prior")


def test_residuals_a_priori_are_saved_obey_the_laws_and_live_with_gaps(tmp_path):
    est = dw.ARMAX(1, 1, 1, method="plr", residual="a priori")
    dw.check_estimator(est)
    y, u = dw.simulate([-0.8], [1.0], d=[0.5], samples=300, noise_std=0.5, seed=4, missing=0.2)
    trace = est.scan(y, u)
    trace.save(tmp_path / "run.npz")
    assert dw.Trace.load(tmp_path / "run.npz").estimator.options["residual"] == "a priori"
    assert np.isfinite(trace.parameters).all()
