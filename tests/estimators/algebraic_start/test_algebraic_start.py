"""Algebraic identification: golden case, other arithmetic, what a record cannot tell, refusals, and as a start."""

import numpy as np
import pytest
from draws import slow
from driftwise_studies.papers.tian import identification, second_order, starts
from paper_motor import GOLDEN
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.signal import cont2discrete

import driftwise as dw
from driftwise.analysis.laws import example, same
from driftwise.estimators.algebraic_start import integrals, responses
from driftwise.estimators.algebraic_start.discrete import canonical

T = 0.01 * np.arange(401)
SQUARE = 1.0 - 2.0 * (np.arange(401) // 100 % 2)
# y'' + .8 y' + 4 y = 3 u + .5, which as an input of ones is exact
Y, _ = dw.models.simulate_continuous(
    [0.8, 4.0], [[0.0, 3.0], [0.0, 0.5]], time=T, u=np.column_stack([SQUARE, np.ones(401)]), x0=[0.3, -0.4]
)
NOISE = np.random.default_rng(3).standard_normal(401)


def identify(y=Y, u=SQUARE, **options):
    return dw.estimators.algebraic_identification(
        y, u, **{"order": 2, "zeros": 0, "dt": 0.01, "hold": "zoh", "disturbance": 0, **options}
    )


# --- golden ----------------------------------------------------------------------------------------------------


def test_golden_case_and_its_negative_control():
    case = GOLDEN["parameter_identification"]
    given, theta, tol = case["given"], case["expect"]["theta"], case["tol"]
    assert np.allclose(Y[:5], given["y_first"], rtol=1e-13) and np.allclose(Y[-3:], given["y_last"], rtol=1e-12)
    truth = np.array([theta["a1"], theta["a0"], theta["b0"]])
    found, wrong = identify(), identify(hold="foh")
    assert np.allclose(found.closed_form[[0, 1, 3]], truth, rtol=tol["rtol_algebraic"], atol=0)
    assert np.allclose(found.model.values[[0, 1, 3]], truth, rtol=tol["rtol_after_gauss_newton"], atol=0)
    assert found.closed_form[2] == 0 and found.disturbance == pytest.approx(0.5, rel=1e-10)
    assert found.initial_state == pytest.approx([0.3, -0.4], rel=1e-10)
    assert max(abs(wrong.closed_form[[0, 1, 3]] / truth - 1)) > 5e-3
    assert max(abs(wrong.model.values[[0, 1, 3]] / truth - 1)) > 5e-3


# --- the parts, by other arithmetic ----------------------------------------------------------------------------


def test_iterated_integrals_are_exact_for_broken_lines():
    """Against Cauchy's formula, piece by piece, with polynomials."""
    t, y = np.array([0.0, 0.2, 0.5, 0.6, 1.0]), np.array([1.0, -2.0, 0.5, 3.0, 1.0])
    J = integrals.iterated(t, y[:-1], y[1:], 3)
    for i, r in [(0, 1), (1, 2), (3, 4), (2, 4)]:
        total = 0.0
        for k in range(4):
            line = np.poly1d([(y[k + 1] - y[k]) / (t[k + 1] - t[k]), y[k]])(np.poly1d([1.0, -t[k]]))
            f = (np.poly1d([-1.0, 1.0]) ** (r - 1) * np.poly1d([1.0, 0.0]) ** i * line).integ()
            total += (f(t[k + 1]) - f(t[k])) / max(np.prod(np.arange(1, r)), 1)
        assert J[i, r, -1] == pytest.approx(total, rel=1e-13)


@pytest.mark.parametrize("irregular", [False, True])
@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_responses_and_slopes(hold, irregular):
    """Outputs against an ODE solver, slopes in a against differences."""
    rng, a = np.random.default_rng(0), np.array([0.7, 3.0, 1.5])
    t = np.sort(rng.uniform(0, 1, 8)) if irregular else np.linspace(0, 1, 8)
    t[0] = 0.0
    u = rng.standard_normal((8, 1))
    task = responses.plan(t, u, 3, 1, hold, 0, (5.0,))
    linear = rng.standard_normal(task.columns)
    Z, _ = responses.responses(task, a)
    b, x0, q = linear[:2], linear[2:5], linear[5:]

    def slope(s, x):
        k = min(np.searchsorted(t, s, side="right") - 1, 6)
        inside = u[k, 0] if hold == "zoh" else np.interp(s, t, u[:, 0])
        d = q[0] + q[1] * np.cos(5 * s) + q[2] * np.sin(5 * s)
        return np.append(x[1:], 0.0) - a * x[0] + np.append(0.0, b * inside) + [0, 0, d]

    x, y = x0, [x0[0]]
    for k in range(7):
        x = solve_ivp(slope, (t[k], t[k + 1] - 1e-13), x, rtol=1e-11, atol=1e-12).y[:, -1]
        y.append(x[0])
    assert np.allclose(Z[:, 0] @ linear, y, rtol=1e-8, atol=1e-9)
    assert np.allclose(Z[-1, :3] @ linear, x, rtol=1e-8, atol=1e-9)
    for i in range(3):
        up, down = (responses.responses(task, a + sign * 1e-6 * np.eye(3)[i])[0][:, 0] @ linear for sign in (1, -1))
        assert np.allclose(-(Z[:, -3:] @ linear)[:, 2 - i], (up - down) / 2e-6, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_discrete_model_and_its_covariance(hold):
    found = identify(Y + 0.01 * NOISE, zeros=1, hold=hold)
    model = found.discrete(0.1)
    A, B, C, D, _ = cont2discrete((*found.model.to_scipy(),), 0.1, hold)
    w = np.exp(1j * np.linspace(0.1, 3, 7))
    theirs = [(C @ np.linalg.solve(z * np.eye(2) - A, B) + D)[0, 0] for z in w]
    ours = [(model.C @ np.linalg.solve(z * np.eye(2) - model.A, model.B) + model.D)[0, 0] for z in w]
    assert np.allclose(ours, theirs, rtol=1e-11)
    values, rows = found.model.values, []
    for i in range(4):
        step = 1e-6 * np.eye(4)[i]
        up, down = (canonical(model.form, values + s * step, 0.1, hold) for s in (1, -1))
        rows.append((up - down) / 2e-6)
    J = np.array(rows).T
    assert np.allclose(model.covariance, J @ found.model.covariance @ J.T, rtol=1e-5, atol=1e-12)


def test_the_state_at_the_end_and_its_covariance():
    """Against the same plant stepped by matrix exponentials, and its slopes by differences."""
    found = identify(Y + 0.01 * NOISE)

    def last(a1, a2, b2, x1, x2, q):
        F = np.array([[-a1, 1, 0, 0], [-a2, 0, b2, q], [0, 0, 0, 0], [0, 0, 0, 0]])
        E, x = expm(0.01 * F)[:2], np.array([x1, x2])
        for value in SQUARE[:-1]:
            x = E @ np.array([*x, value, 1.0])
        return x

    assert np.allclose(found.final_state, last(*found.values), rtol=1e-9)
    steps = 1e-6 * np.eye(6)
    J = np.stack([(last(*found.values + h) - last(*found.values - h)) / 2e-6 for h in steps], axis=1)
    both = np.concatenate([J, np.eye(6)])
    assert np.allclose(found.final_covariance, both @ found.covariance @ both.T, rtol=1e-6, atol=1e-12)


def test_gaps_and_irregular_instants_cost_no_bias():
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.exponential(0.02, 200))
    u = np.where(t % 2 < 1, 1.0, -1.0)
    y, _ = dw.models.simulate_continuous([0.8, 4.0], [0.0, 3.0], time=t, u=u, x0=[0.3, -0.4], missing=0.2, seed=2)
    found = identify(y, u, dt=None, time=t, disturbance=-1)
    assert np.allclose(found.model.values, [0.8, 4.0, 0.0, 3.0], atol=1e-10)
    assert np.allclose(found.closed_form, [0.8, 4.0, 0.0, 3.0], rtol=5e-3)


def test_unknown_disturbances_and_units():
    """Ramp and sinusoid of unknown size; data in other units give the same answer in theirs, bit for bit."""
    u = SQUARE[:, None]
    t, w = T / T[-1], 6.0
    task = responses.plan(t, u, 2, 1, "zoh", 1, (w * T[-1],))
    linear = np.array([1.0, 30.0, 0.3, -1.0, 5.0, 2.0, 7.0, -3.0])  # in units of the record's length
    y = responses.responses(task, np.array([3.0, 60.0]))[0][:, 0] @ linear
    found = identify(y, zeros=1, disturbance=1, frequencies=(w,))
    assert np.allclose(found.values[:2] * T[-1] ** np.array([1, 2]), [3.0, 60.0], rtol=1e-9)
    assert np.allclose(found.disturbance * T[-1] ** np.array([2, 3, 2, 2]), linear[4:], rtol=1e-7)
    other = identify(2.0**20 * (Y + 0.01 * NOISE), 2.0**-9 * SQUARE)
    plain = identify(Y + 0.01 * NOISE)
    assert np.array_equal(other.model.values, plain.model.values * [1, 1, 0, 2.0**29])
    assert other.residual_std == 2.0**20 * plain.residual_std


# --- statistics ------------------------------------------------------------------------------------------------


def test_few_plants_are_identified_to_the_cramer_rao_bound():
    given = second_order.records(12, identification.STEP, identification.SAMPLES, identification.BASE)
    clean, noisy = identification.errors(given, 0.0), identification.errors(given, 0.02)
    assert abs(clean.refined).max() < 1e-10 and np.all(np.median(abs(clean.closed), axis=0) < 1.5e-4)
    assert 0.4 < np.mean((noisy.refined / noisy.bound) ** 2) < 1.9  # 36 squares of which 12 and 12 are correlated
    assert np.all(np.median(abs(noisy.closed), axis=0) < 2.5 * np.median(noisy.bound, axis=0))


def failed(section):
    return [f"{v.name}: {v.value}, expected {v.expected}" for v in section.verdicts if not v.confirmed]


@pytest.mark.slow
def test_the_table_of_errors():
    assert failed(identification.section(100)) == []


@pytest.mark.slow
def test_the_table_of_starts():
    assert failed(starts.section(200)) == []


@pytest.mark.slow
def test_few_starts():
    """The joint filter goes on from the fit of its first samples: near least squares, far from a wide prior."""
    given, noise = second_order.records(16, starts.STEP, starts.SAMPLES), 0.02
    none, started = (
        np.median(starts.filtered(given, noise, starts.STARTS[s]), axis=1) for s in (starts.NONE, starts.STARTED)
    )
    assert started[1] < 1.3 * np.median(starts.batch(given, noise)) and none[0] > 4 * started[0]


# --- what a record cannot tell ---------------------------------------------------------------------------------


def test_verdicts():
    noisy = Y + 0.01 * NOISE
    assert "All parameters are identifiable" in identify(noisy).verdict
    constant = identify(noisy, np.ones(401))
    assert constant.unidentified == ("b2",) and constant.covariance[2, 2] == np.inf
    assert "b2 cannot be told from the disturbance. Input 1 never changes" in constant.verdict
    assert identify(noisy, 0 * SQUARE, zeros=1).unidentified == ("b1", "b2")
    assert "times the stated noise" in identify(noisy, order=1, noise_std=0.01).verdict
    nothing = identify(0.01 * NOISE)
    assert "Hardly known" in nothing.verdict and "explains little" in nothing.verdict
    assert "lower order" in identify(noisy, order=5, zeros=4).verdict


def test_no_refinement_keeps_the_closed_form():
    rough = identify(Y + 0.01 * NOISE, refine=False)
    assert np.array_equal(rough.model.values, rough.closed_form) or np.allclose(
        rough.model.values, rough.closed_form, rtol=1e-14
    )
    assert rough.residual_std > identify(Y + 0.01 * NOISE).residual_std


REFUSED = [
    (dict(hold=None), "hold must say"),
    (dict(hold="linear"), "hold must say .* Got 'linear'"),
    (dict(order=0), "order must be a whole number of at least 1, got 0"),
    (dict(zeros=2), "zeros must be below order = 2, got 2"),
    (dict(time=T), "either dt .* or time"),
    (dict(dt=None), "either dt .* or time"),
    (dict(dt=-1.0), "dt must be a positive finite number"),
    (dict(dt=None, time=T[::-1]), "time must increase, but .*Is the file unsorted"),
    (dict(disturbance=-2), "disturbance is the degree of an unknown polynomial.*got -2"),
    (dict(frequencies=[0.0]), "a frequency of 0 is a constant"),
    (dict(frequencies=[3.0, 3.0]), "frequencies must be different"),
    (dict(frequencies=[np.inf]), "positive and finite, in rad/s"),
    (dict(noise_std=0.0), "noise_std must be a positive finite number"),
    (dict(refine="yes"), "refine must be True or False"),
    (dict(y=Y[:6], u=SQUARE[:6]), "6 measured samples but there are 6 unknowns"),
    (dict(y=np.full(401, np.nan)), "0 measured samples"),
    (dict(u=np.where(np.arange(401) == 7, np.nan, SQUARE)), "u is NaN at sample 7: its effect is integrated"),
    (dict(u=SQUARE[:9]), "must be simultaneous"),
    (dict(y=Y[:, None]), "one-dimensional"),
]


@pytest.mark.parametrize("options, message", REFUSED)
def test_refusals(options, message):
    with pytest.raises(dw.InputError, match=message):
        identify(**options)


# --- as a start ------------------------------------------------------------------------------------------------

OE = dict(noise=dw.models.OutputError(), start=dw.estimators.AlgebraicStart(30))
STARTED, NOT_STARTED = int(dw.Status.STARTED), int(dw.Status.NOT_STARTED)


@pytest.mark.parametrize(
    "est", [dw.Joint(2, 1, **OE), dw.ARX(2, 2, start=dw.estimators.AlgebraicStart(30))], ids=["Joint", "ARX"]
)
def test_laws_hold_with_a_start(est):
    """Stream, record, halves, fleet, save and load, NaN, scaling: the example does start."""
    assert np.any(est.scan(*example(est)).status & STARTED)
    dw.check_estimator(est)


def test_save_and_load_in_the_middle_of_the_start(tmp_path):
    est = dw.Joint(2, 1, **OE)
    y, u = example(est)
    whole = est.scan(y, u)
    at = int(np.flatnonzero(whole.status & STARTED)[0])
    half = est.scan(y[:15], u[:15]).state
    dw.save_state(est, half, tmp_path / "s.json")
    other, state = dw.load_state(tmp_path / "s.json")
    assert other.options["start"] == dw.estimators.AlgebraicStart(30)
    assert same(other.scan(y[15:], u[15:], state=state).state, whole.state)
    assert [event.sample for event in whole.events() if event.kind == "STARTED"] == [at]
    assert "begun" not in dw.Joint(2, 1, noise=dw.models.OutputError()).dtype.names


def test_a_fleet_starts_each_series_when_it_has_enough():
    est = dw.Joint(2, 1, **OE)
    y, u = example(est)
    later = y.copy()
    later[:20] = np.nan
    states, steps = est.update_batch(est.start(2), np.stack([y, later]), np.stack([u, u]))
    first = [int(np.flatnonzero(row & (STARTED | NOT_STARTED))[0]) for row in steps.status]
    assert first[0] == np.flatnonzero(np.isfinite(y))[0] + 29 and first[1] == np.flatnonzero(np.isfinite(later))[0] + 29
    assert same(states[1], est.scan(later, u).state)


@pytest.mark.parametrize("missing", [0.0, 0.1])
def test_the_started_state_is_that_of_least_squares(missing):
    """theta and its covariance are those of the identified model, sampled; sigma^2 that of its errors."""
    rng = np.random.default_rng(5)
    u = np.repeat(rng.choice([-1.0, 1.0], 20), 3)
    y, u = dw.models.simulate_continuous(
        [0.9, 4.0], [1.0, 3.0], time=0.2 * np.arange(60), u=u, x0=[1.0, 0.0], noise_std=0.02, seed=2
    )
    y[1:][rng.random(59) < missing] = np.nan
    est = dw.Joint(2, 1, noise=dw.models.OutputError(), dt=0.2, start=dw.estimators.AlgebraicStart(60))
    state = est.scan(y, u).state
    assert int(state["status"]) & STARTED
    found = dw.estimators.algebraic_identification(y, u, order=2, dt=0.2, hold="zoh")
    model, ours = found.discrete(0.2), est.model_of(state)
    assert np.allclose(state["theta"], model.values, rtol=2e-3)  # its own prior is in it
    spare = np.count_nonzero(np.isfinite(y)) - 6
    unit = est.sigma2(state) * spare / (np.count_nonzero(np.isfinite(y)) - 5)  # the scale's own count of unknowns
    assert np.allclose(np.diag(ours.covariance), np.diag(model.covariance), rtol=0.25)
    assert unit == pytest.approx(found.residual_std**2, rel=0.25)
    # x(60): what the plant does next
    ahead, _ = dw.models.simulate_continuous(
        [0.9, 4.0], [1.0, 3.0], time=0.2 * np.arange(61), u=np.append(u, 0.0), x0=[1.0, 0.0]
    )
    x, P = est.mean(state)[1], est.covariance(state)[1, 1] * est.sigma2(state)
    assert abs(x - ahead[60]) < 4 * np.sqrt(P) < 0.1


@pytest.mark.parametrize(
    "kind, noise",
    [
        slow("oe", dw.models.OutputError(0.0025)),
        slow("eq", dw.models.EquationError(0.0025)),
        ("d", dw.models.NoisePolynomial((0.3, -0.5), 0.0025)),
    ],
)
def test_the_covariance_is_that_of_the_filters_own_noise(kind, noise):
    """Mean square of error over deviation, 120 records: near one whatever colours the noise."""
    rng, S, M, d = np.random.default_rng(7), 120, 60, np.array([-0.5, 0.3])  # d1, d2 of w = d v
    a, b = np.array([-1.56, 0.79]), np.array([0.25, 0.23])
    y, x, v = np.empty((S, M)), 0.3 * rng.standard_normal((S, 2)), 0.05 * rng.standard_normal((S, M))
    u = np.repeat(rng.choice([-1.0, 1.0], (S, M // 3)), 3, axis=1)
    for t in range(M):
        y[:, t] = x[:, 0] + v[:, t]
        drive = x[:, :1] if kind == "oe" else y[:, t : t + 1]
        x = np.column_stack([x[:, 1], np.zeros(S)]) - a * drive + b * u[:, t : t + 1]
        x = x + d * v[:, t : t + 1] if kind == "d" else x
    est = dw.Joint(2, 1, noise=noise, dt=0.2, start=dw.estimators.AlgebraicStart(M))
    states, _ = est.update_batch(est.start(S), y, u)
    begun = (states["status"].astype(int) & STARTED) > 0
    assert begun.mean() > 0.75 + 0.2 * (kind == "oe")
    P = np.array([np.diag(est._covariance(state)) for state in states])
    squares = (np.concatenate([states["x"] - x, states["theta"] - np.append(a, b)], axis=1) ** 2 / P)[begun]
    assert np.all(abs(squares.mean(axis=0) - 1) < 0.5), squares.mean(axis=0)


def test_a_start_that_would_do_harm_is_left_out():
    """No input, errors that are no noise, a plant without a continuous model: the filter goes on as without a start."""
    u = np.repeat(np.random.default_rng(0).choice([-1.0, 1.0], 20), 3)
    slow, _ = dw.simulate([-1.5, 0.7], [1.0, 0.5], u=u, noise_std=0.1, seed=1)
    alternating, _ = dw.simulate([0.9], [1.0], u=u, samples=60, noise_std=0.01, seed=1)
    for order, y, v in [(2, slow, 0 * u), (1, alternating, u), (1, slow, u)]:
        options = dict(noise=dw.models.OutputError(), dt=1.0)
        trace = dw.Joint(order, 1, start=dw.estimators.AlgebraicStart(40), **options).scan(y, v)
        assert np.flatnonzero(trace.status & NOT_STARTED).tolist() == [39] and not np.any(trace.status & STARTED)
        plain = dw.Joint(order, 1, **options).scan(y, v)
        assert same(trace.table[:, :3], plain.table[:, :3])


STARTS_REFUSED = [
    (lambda: dw.Joint(2, 1, start="now"), "start must be None, 'algebraic' or AlgebraicStart"),
    (lambda: dw.Joint(2, 1, start=dw.estimators.AlgebraicStart), "brackets"),
    (lambda: dw.Joint(2, 1, start=dw.estimators.AlgebraicStart(6)), "6 samples cannot tell 6 unknowns.*such as 40"),
    (lambda: dw.Joint(2, 1, start=dw.estimators.AlgebraicStart(hold="soh")), "hold must be one of zoh, foh"),
    (lambda: dw.Joint(2, 1, start=dw.estimators.AlgebraicStart(zeros=2)), "zeros must be below the order, 2, got 2"),
    (lambda: dw.Joint(2, 1, start=dw.estimators.AlgebraicStart(disturbance=0.5)), "degree of an unknown polynomial"),
    (lambda: dw.Joint(2, 1, True, start="algebraic"), r"a direct term, but hold='zoh' makes no.*hold='foh'"),
    (lambda: dw.Joint(2, 1, start=dw.estimators.AlgebraicStart(hold="foh")), r"no direct term, but hold='foh' makes a"),
    (lambda: dw.Joint(2, 1, noise=dw.models.UnknownPolynomial(), start="algebraic"), "polynomial is known"),
    (lambda: dw.Joint(2, 1, noise=dw.models.OutputError(0.0), start="algebraic"), "a start needs noise"),
    (lambda: dw.ARX(2, 1, start="algebraic"), "equation of a sampled plant.*nb = n, nk = 1"),
    (lambda: dw.Regression(2, start="algebraic"), "equation of a sampled plant"),
    (
        lambda: dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.99), start="algebraic"),
        "memory Constant.*RandomWalk.*RestartOnChange",
    ),
    (lambda: dw.ARX(2, 2, method="iv", start="algebraic"), "only method='ls'"),
    (lambda: dw.Joint(2, 1, **OE).smooth(Y, SQUARE), "start=None"),
    (lambda: dw.Joint(2, 1, start="algebraic").batch(Y, SQUARE), "start=None"),
]


@pytest.mark.parametrize("make, message", STARTS_REFUSED)
def test_starts_refused(make, message):
    with pytest.raises(dw.InputError, match=message):
        make()
