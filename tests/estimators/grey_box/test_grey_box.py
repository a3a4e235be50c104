"""The joint filter of state and physical parameters against filters that share no code with it."""

import re

import numpy as np
import pytest
import scipy.optimize

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.estimators.grey_box.row import SCRATCH
from driftwise.estimators.grey_box.start import Batch, BatchStart
from driftwise.estimators.grey_box.transition import step_plant
from driftwise.models.formulas import read

CELL = """
[states]
v1 = {unit = "V", std = 0.01, walk = 1e-4}
rest = {unit = "V", start = 3.7, std = 0.5, walk = 1e-4}
[inputs]
i = {unit = "A"}
[outputs]
v = {unit = "V", noise = 1e-3}
[parameters]
R0 = {unit = "Ohm", start = 0.01}
R1 = {unit = "Ohm", start = 0.02, low = 0.001, high = 0.1}
C1 = {unit = "F", start = 1000, factor = 3}
[formulas]
dv1 = "(i - v1 / R1) / C1"
drest = "0"
v = "rest + R0 * i + v1"
"""


def square(seed, samples, every=10):
    return np.repeat(np.random.default_rng(seed).choice([-1.0, 0.0, 1.0], samples // every + 1), every)[:samples]


def extended(step, show, z, P, Q, R, y, u, times):
    """Return the mean, covariance and log p(y) of the textbook's extended Kalman filter, slopes by complex steps.

    One output that comes three deviations off is taken in iterated, in six turns (Jazwinski 1970, theorem 8.2).
    """

    def slope(f, z):
        return np.array([np.imag(f(z + 1e-30j * e)) / 1e-30 for e in np.eye(len(z))]).T

    loglik = 0.0
    for t in range(len(y)):
        if t:
            dt = times[t] - times[t - 1]
            F = slope(lambda z, t=t, dt=dt: step(z, u[t - 1], dt), z)
            P = F @ P @ F.T + Q(z, dt)
            z = step(z, u[t - 1], dt)
        there = ~np.isnan(y[t])
        H = slope(lambda z, t=t: show(z, u[t]), z)[there]
        e, S = y[t, there] - show(z, u[t])[there], H @ P @ H.T + R[np.ix_(there, there)]
        at, is_far = z, len(e) == 1 and abs(e[0]) > 3 * np.sqrt(S[0, 0].real)
        for _ in range(5 * is_far):
            at = z + P @ H.T @ np.linalg.inv(S) @ e
            H = slope(lambda z, t=t: show(z, u[t]), at)[there]
            e, S = y[t, there] - show(at, u[t])[there] - H @ (z - at), H @ P @ H.T + R[np.ix_(there, there)]
        K = P @ H.T @ np.linalg.inv(S)
        z, P = z + K @ e, P - K @ H @ P
        loglik -= 0.5 * (e @ np.linalg.solve(S, e) + np.linalg.slogdet(2 * np.pi * S)[1])
    return z.real, P.real, loglik.real


def expm(A):
    """Return the exponential of a complex matrix, by its series: SciPy's loses small imaginary parts."""
    halvings = max(int(np.ceil(np.log2(abs(A).sum(axis=1).max() + 1e-9))) + 3, 0)
    E = term = np.eye(len(A), dtype=complex)
    for k in range(1, 20):
        term = term @ A / 2**halvings / k
        E = E + term
    for _ in range(halvings):
        E = E @ E
    return E


def cell_step(z, u, dt):
    R1 = 0.001 + 0.099 / (1 + np.exp(-z[3]))
    C1 = np.exp(z[4])
    M = np.array([[-1 / (R1 * C1), u[0] / C1], [0, 0]])
    return np.concatenate([(expm(M * dt) @ np.array([z[0], 1]))[:1], z[1:]])


def test_it_is_the_extended_kalman_filter_of_state_and_parameters():
    est = dw.GreyBox(CELL, start=None)
    rng = np.random.default_rng(3)
    time, u = np.cumsum(rng.uniform(0.5, 20.0, 80)), square(1, 80)
    y = est.simulate(u, {"R0": 0.02, "R1": 0.015, "C1": 1500.0}, time=time, seed=2)
    y[rng.random(80) < 0.1] = np.nan

    def noise(z, dt):  # Van Loan by SciPy
        R1 = 0.001 + 0.099 / (1 + np.exp(-z[3]))
        a = -1 / (R1 * np.exp(z[4]))
        return np.diag([1e-8 * (np.exp(2 * a * dt) - 1) / (2 * a), 1e-8 * dt, 0, 0, 0])

    z = np.array([0, 3.7, np.log(0.01), np.log(0.019 / 0.08), np.log(1000)])
    std = np.array([0.01, 0.5, np.log(5) / 1.959963984540054, 1.8, np.log(3) / 1.959963984540054])
    mean, P, loglik = extended(
        cell_step, lambda z, u: np.array([z[1] + np.exp(z[2]) * u[0] + z[0]]), z, np.diag(std**2), noise,
        np.eye(1) * 1e-6, y[:, None], u[:, None], time,
    )  # fmt: skip
    begun = est.start()
    begun["bend"] = 0.0  # formulas are not taken anew where they bend
    state = est.scan(y, u, time=time, state=begun).state
    np.testing.assert_allclose(est.mean(state), mean, rtol=1e-8)
    np.testing.assert_allclose(est.covariance(state), P, rtol=1e-6, atol=1e-9 * abs(P).max())
    assert est.loglik(state) == pytest.approx(loglik, rel=1e-9)


def known(text):
    """Return the text of a cell whose one free parameter hardly may differ from its start."""
    lines = text.replace("start = 0.01}", "start = 0.01, fixed = true}").replace("factor = 3}", "fixed = true}")
    return lines.replace("low = 0.001, high = 0.1}", "factor = 1.0000001}")


def test_a_linear_plant_whose_parameters_are_known_is_filtered_as_by_state_space():
    est = dw.GreyBox(known(CELL), start=None, gate=dw.InnovationGate(4.0))
    time, u = np.cumsum(np.random.default_rng(3).uniform(0.5, 20.0, 90)), square(1, 90)
    y = est.simulate(u, time=time, seed=2)
    y[[11, 40]] += 0.05
    A = [[-1 / (0.02 * 1000), 0], [0, 0]]
    twin = dw.StateSpace(
        A, [[1 / 1000], [0]], [1, 1], [0.01], Q=[1e-8, 1e-8], R=1e-6, x0=[0, 3.7], P0=[1e-4, 0.25], continuous=True,
        gate=dw.InnovationGate(4.0, settle=18),
    )  # fmt: skip
    trace, other = est.scan(y, u, time=time), twin.scan(y, u, time=time)
    np.testing.assert_allclose(trace.x, other.estimates, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(trace.variance, other.variance, rtol=1e-6)
    assert est.loglik(trace.state) == pytest.approx(twin.loglik(other.state), rel=1e-7)


def test_a_static_plant_linear_in_its_parameters_is_a_regression():
    text = """
    [inputs]
    u = {}
    w = {}
    [outputs]
    y = {noise = 0.3}
    [parameters]
    a = {free = true, start = 0, std = 10}
    b = {free = true, start = 1, std = 5}
    [formulas]
    y = "a * u + b * w"
    """
    est, rng = dw.GreyBox(text, start=None), np.random.default_rng(0)
    u = rng.standard_normal((60, 2))
    y = u @ [2.0, -1.0] + 0.3 * rng.standard_normal(60)
    twin = dw.Regression(["u", "w"], theta0=[0, 1], P0=[100, 25], variance=0.09, offset=False)
    mean, std = est.estimate(est.scan(y, u).state)
    other = twin.scan(y, u)
    np.testing.assert_allclose(mean, other.parameters[-1], rtol=1e-9)
    np.testing.assert_allclose(std, other.parameters_std[-1], rtol=1e-9)


def test_every_way_of_feeding_samples_gives_the_same_bits_also_through_the_start():
    est = dw.GreyBox(CELL, start=BatchStart(48), dt=2.0)
    u = square(2, 120)
    y = est.simulate(u, {"R0": 0.015, "C1": 1400.0}, seed=1)
    y[[0, 1, 30]] = np.nan
    dw.check_estimator(est, y, u)


PENDULUM = """
[states]
phi = {unit = "rad", start = 0.5, std = 0.3}
w = {unit = "rad/s", std = 0.5}
[outputs]
angle = {unit = "rad", noise = 0.01}
[parameters]
k = {unit = "s^-2", start = 20}
d = {unit = "1/s", start = 0.3}
[formulas]
dphi = "w"
dw = "-k * sin(phi) - d * w"
angle = "phi"
"""


def test_a_plant_that_bends_is_the_extended_filter_of_the_same_runge_kutta_steps():
    est, dt = dw.GreyBox(PENDULUM, start=None, dt=0.05), 0.05
    y = est.simulate(samples=60, parameters={"k": 25.0}, x0=[0.6, 0.1], seed=1)

    def step(z, u, dt):
        def f(x):
            return np.array([x[1], -np.exp(z[2]) * np.sin(x[0]) - np.exp(z[3]) * x[1]])

        x, steps = z[:2], steps_at(z)
        h = dt / steps
        for _ in range(steps):
            k1 = f(x)
            k2 = f(x + h / 2 * k1)
            k3 = f(x + h / 2 * k2)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + f(x + h * k3))
        return np.concatenate([x, z[2:]])

    def steps_at(z):
        slopes = [1.0, np.exp(z[2].real) * abs(np.cos(z[0].real)) + np.exp(z[3].real)]
        return int(max(slopes) * dt / 0.1) + 1

    std = np.array([0.3, 0.5, *[np.log(5) / 1.959963984540054] * 2])
    z = np.array([0.5, 0.0, np.log(20), np.log(0.3)])
    mean, P, loglik = extended(
        step, lambda z, u: z[:1], z, np.diag(std**2), lambda z, dt: np.zeros((4, 4)), np.eye(1) * 1e-4, y[:, None],
        np.zeros((60, 0)), dt * np.arange(60),
    )  # fmt: skip
    begun = est.start()
    begun["bend"] = 0.0
    state = est.scan(y, state=begun).state
    np.testing.assert_allclose(est.mean(state), mean, rtol=1e-8)
    np.testing.assert_allclose(est.covariance(state), P, rtol=1e-6, atol=1e-9 * abs(P).max())
    assert est.loglik(state) == pytest.approx(loglik, rel=1e-9)


def test_a_stiff_step_is_that_of_the_exponential_and_its_slopes_those_of_complex_steps():
    plant = read(CELL)
    theta = np.array([0.01, 2e-3, 5.0])
    x, u, seconds = np.array([0.3, 3.6]), np.array([1.5]), 7.0  # 700 time constants
    est = dw.GreyBox(CELL, start=None)
    form, kind = est.policies[:2]
    room = SCRATCH.open(form, est.scratch())
    room.values[:], room.rates[:] = theta, 1.0
    step_plant(form, kind, x, u, seconds, 3, room)

    def exact(x, theta):
        a = -1 / (theta[1] * theta[2])
        return np.array([x[0] * np.exp(a * seconds) + (np.exp(a * seconds) - 1) / a * u[0] / theta[2], x[1]])

    np.testing.assert_allclose(room.next, exact(x, theta), rtol=1e-12)
    for j in range(3):
        slope = exact(x, theta + 1e-30j * np.eye(3)[j]).imag / 1e-30
        np.testing.assert_allclose(room.J[:, 2 + j], slope, rtol=1e-11, atol=1e-14)
    assert plant.is_linear


def test_a_resistance_that_only_shows_late_is_found_although_it_was_far_off():
    """Its logarithm is off by four of its deviations at the first edge of the current, where a step would overshoot."""
    u = np.r_[np.zeros(300), np.repeat([-30.0, 0.0], 50), np.full(50, -30.0)]
    text = CELL.replace("start = 0.01}", "start = 4e-4, factor = 2}").replace("noise = 1e-3", "noise = 3e-4")
    est = dw.GreyBox(text.replace("walk = 1e-4}", "walk = 5e-4}"), start=None)
    trace = est.scan(est.simulate(u, {"R0": 1.6e-3}, seed=1), u)
    low, high = trace.interval("R0")
    assert low[302] < 1.6e-3 < high[302] and trace.parameters[-1, 0] == pytest.approx(1.6e-3, rel=0.02)


# --- the start ----------------------------------------------------------------------------------------------


def best_fit(est, y, u, around):
    """Return the parameters of the most likely ones near a point, and their log likelihood, by SciPy."""
    batch = Batch(est, y[:, None], np.column_stack([u, np.arange(len(u)) * est.dt]))
    found = scipy.optimize.minimize(lambda z: -batch.run(z[None])[1][0], around, method="Nelder-Mead",
                                    options={"maxiter": 600, "fatol": 1e-6, "xatol": 1e-6})  # fmt: skip
    return found.x, -found.fun, batch


def test_from_wide_priors_the_filter_ends_where_a_batch_fit_of_the_whole_record_does():
    u = square(5, 300)
    for seed in range(2):
        est = dw.GreyBox(CELL.replace("walk = 1e-4", "walk = 0"))
        truth = est.likely(np.random.default_rng(seed))
        y = est.simulate(u, truth, seed=seed)
        state = est.scan(y, u).state
        z, best, batch = best_fit(est, y, u, est.transformed(truth))
        assert batch.run(np.asarray(state["theta"])[None])[1][0] > best - 2
        off = (state["theta"] - z) / np.sqrt(np.diag(est.covariance(state)))[2:]
        assert np.all(abs(off) < 1)


def test_two_sets_of_parameters_that_explain_the_record_are_both_told():
    text = """
    [states]
    a = {std = 0.01}
    b = {std = 0.01}
    [inputs]
    u = {}
    [outputs]
    y = {noise = 0.01}
    [parameters]
    fast = {start = 0.3, unit = "s", factor = 8}
    slow = {start = 0.4, unit = "s", factor = 8}
    [formulas]
    da = "(u - a) / fast"
    db = "(u - b) / slow"
    y = "a + b"
    """
    est = dw.GreyBox(text, dt=0.1)
    u = square(1, 300)
    trace = est.scan(est.simulate(u, {"fast": 0.2, "slow": 1.0}, seed=1), u)
    assert trace.state["modes"] == 2
    assert "2 sets of parameters explained the first 128 samples almost equally well" in trace.summary().words


# --- what is said -------------------------------------------------------------------------------------------


def test_a_jump_of_a_resistance_is_named_sized_and_dated():
    est, u = dw.GreyBox(CELL.replace("walk = 1e-4", "walk = 1e-5"), memory=dw.AutoMemory()), square(1, 900)
    truth = {"R0": 0.02, "R1": 0.015, "C1": 1500.0}
    before, after = (est.simulate(u, truth | {"R0": R0}, seed=1) for R0 in (0.02, 0.026))
    trace = est.scan(np.where(np.arange(900) < 500, before, after), u)
    (event,) = trace.jumps()
    assert event.parameter == "R0" and event.direction == 1 and abs(event.time - 500) < 12
    size = int(re.search(r"R0 rose by (\d+) %", event.text)[1])
    assert 25 < size < 35 and f"R0 rose by {size} %" in trace.summary().words
    low, high = trace.interval("R0")
    assert low[-1] < 0.026 < high[-1] and np.all(low > 0)


def test_parameters_that_cannot_be_told_apart_are_named_with_what_is_known_of_them():
    text = known(CELL).replace("factor = 1.0000001", "factor = 50").replace("1000, fixed = true", "1000, factor = 50")
    est, u = dw.GreyBox(text), np.zeros(300)  # a cell that relaxes with no current tells R1 C1 alone
    y = est.simulate(u, {"R1": 0.02, "C1": 1500.0}, x0=[0.5, 3.7], seed=1)
    trace = dw.GreyBox(
        est.formulas.text.replace('v1 = {unit = "V", std = 0.01', 'v1 = {unit = "V", start = 0.5, std = 0.01')
    ).scan(y, u)
    words = trace.summary().words
    said = re.search(r"R1 and C1 cannot be told apart from this input; their product is ([\d.]+) ± ([\d.]+) s\.", words)
    assert abs(float(said[1]) - 30) < 3 * float(said[2]) < 2


def test_a_state_a_trace_and_a_page_are_written_and_read(tmp_path):
    est = dw.GreyBox(CELL, memory=dw.RandomWalk(1e-7))
    u = square(1, 200)
    trace = est.scan(est.simulate(u, seed=1), u)
    trace.save(tmp_path / "cell.npz")
    again = dw.load(tmp_path / "cell.npz") if hasattr(dw, "load") else type(trace).load(tmp_path / "cell.npz")
    assert same(again.table, trace.table) and again.summary().words == trace.summary().words
    page = trace.report(tmp_path / "cell.html").read_text()
    assert "R0 (Ohm)" in page and "Physical parameters" in page
    mean, std = est.predict(trace.state, u[:50])
    assert mean.shape == std.shape == (50,) and np.all(std > 9e-4)


@pytest.mark.parametrize(
    "change, said",
    [
        (("R0 * i", "R2 * i"), "unknown name 'R2'"),
        (("R0 * i", "root(R0) * i"), "unknown function 'root'"),
        (
            ("start = 0.02, low", "start = 0.2, low"),
            r"\[parameters\] R1: its bounds 0.001 .. 0.1 exclude its start 0.2",
        ),
        (('C1 = {unit = "F"', 'C1 = {unit = "H"'), "dv1 = "),
        (('"R0 * i', '"log(i - 2) + R0 * i'), "v = log"),
        (("v1 / R1", "v1 / (R1 - 0.02)"), r"dv1 = .* gives no number at i = 0, v1 = 0, R1 = 0.02, C1 = 1000"),
    ],
)
def test_what_does_not_fit_is_a_sentence_that_names_the_line(change, said):
    assert change[0] in CELL or change[0] == '"R0 * i'
    text = CELL.replace('"rest + R0 * i', '"R0 * i + rest').replace(*change)
    with pytest.raises(dw.InputError, match=said):
        dw.GreyBox(text)


def test_what_is_odd_at_the_start_is_a_note():
    assert dw.GreyBox(CELL).notes == []
    assert "unstable: v1 grows" in dw.GreyBox(CELL.replace("(i - v1", "(i + v1")).notes[0]
    twice = CELL.replace("drest = ", 'dgone = "0"\ndrest = ').replace("rest + R0", "rest + gone + R0")
    twice = twice.replace("[inputs]", 'gone = {unit = "V", std = 1}\n[inputs]')
    assert "rest, gone cannot be told from v (unobservable)" in dw.GreyBox(twice).notes[0]
    assert "stiff" in dw.GreyBox(PENDULUM, dt=100.0).notes[0]


def test_a_formula_that_gives_no_number_in_a_run_is_named_with_what_it_was_given():
    text = PENDULUM.replace('"phi"', '"sqrt(phi)"')
    est = dw.GreyBox(text, start=None, dt=0.05)
    trace = est.scan(np.sqrt(0.5) * np.ones(40))
    assert trace.status[-1] & int(dw.Status.UNDEFINED) or np.isfinite(trace.prediction).all()
    state = est.start()
    state["x"][0] = -1.0
    trace = est.scan(np.full(5, np.nan), state=state)
    (event,) = [e for e in trace.events() if e.kind == "UNDEFINED"]
    assert event.text.startswith("angle = sqrt(phi) gives no number at phi = -1")


def test_a_parameter_at_its_bound_for_long_and_bars_over_which_the_plant_bends_are_told():
    est = dw.GreyBox(CELL.replace("high = 0.1", "high = 0.022"))
    u = square(1, 400)
    wide = dw.GreyBox(CELL)
    trace = est.scan(wide.simulate(u, {"R1": 0.05}, seed=1), u)
    assert trace.status[-1] & int(dw.Status.AT_EDGE) and "at the edge" in trace.summary().words
    assert wide.scan(np.full(3, 3.7), np.zeros(3)).status[-1] & int(dw.Status.CURVED)
