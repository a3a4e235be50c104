"""The python-control bridge: the estimator's own numbers, the regulator against dlqr, a loop that survives a jump."""

import numpy as np
import pytest

import driftwise as dw

control = pytest.importorskip("control")

from driftwise.adapters.control import MISSING, create_adaptive_controller, create_adaptive_iosystem  # noqa: E402
from driftwise.adapters.regulator import Lagged, cautious_gain  # noqa: E402


@pytest.mark.parametrize(
    "est", [dw.ARX(2, 2, memory=dw.AutoMemory(), dt=0.5), dw.Joint(2, inputs=1)], ids=["ARX", "Joint"]
)
def test_the_system_says_what_the_estimator_says(est):
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=60, noise_std=0.1, seed=1)
    y[20], u[30] = np.nan, np.nan
    system = create_adaptive_iosystem(est)
    sent = [np.where(np.isnan(v), MISSING, v) for v in (y, u)]
    response = control.input_output_response(system, est.dt * np.arange(60), sent)
    trace, m = est.scan(y, u), len(est.names)
    said = np.stack([trace.prediction, np.sqrt(trace.variance)])
    assert np.allclose(response.outputs[:2], said, rtol=1e-9, atol=1e-12)  # round-off: there y was missing
    after = system.dynamics(0, response.states[:, -1], [y[-1], u[-1]])  # the state, sample 60 seen
    assert after.tobytes() == trace.state.tobytes()
    if isinstance(est, dw.ARX):  # parameters before a sample are those after the last
        assert np.allclose(response.outputs[2 : 2 + m, 1:], trace.parameters[:-1].T, rtol=1e-12, atol=1e-12)
    assert system.dt == est.dt and system.output_labels[2 : 2 + m] == est.names


@pytest.mark.parametrize("na, nb, nk", [(2, 2, 1), (1, 1, 3), (0, 2, 2), (3, 1, 1)])
def test_certain_parameters_give_the_linear_quadratic_regulator(na, nb, nk):
    rng = np.random.default_rng(na)
    a = np.atleast_1d(np.poly(rng.uniform(-0.9, 0.9, na)))[1:]
    form, theta = Lagged(na, nb, nk), np.concatenate([a, rng.uniform(0.5, 1, nb)])
    F, G = form.matrices(theta)
    Q = np.zeros((form.size, form.size))
    Q[0, 0], Q[-1, -1] = 2.0, 0.3
    K, _, _ = control.dlqr(F, G[:, None], Q, [[0.5]])
    mine = cautious_gain(form, theta, np.zeros((na + nb, na + nb)), tracking=2.0, integral=0.3, effort=0.5)
    assert np.allclose(mine, K[0], rtol=1e-6, atol=1e-7)
    y, u, r, total = rng.standard_normal(12), rng.standard_normal(12), 0.7, 0.0  # the state is the equation's
    for t in range(5, 11):
        y[t + 1] = -theta[:na] @ y[t - np.arange(na)] + theta[na:] @ u[t + 1 - nk - np.arange(nb)]
        z = np.concatenate([y[t - np.arange(form.outputs)], u[t - 1 - np.arange(form.inputs)], [total]])
        after = F @ z + G * u[t] + r * np.eye(form.size)[-1]
        total += r - y[t + 1]
        assert np.allclose(after[[0, -1]], [y[t + 1], total])


def test_a_gain_that_is_not_known_makes_the_controller_shy():
    form, theta = Lagged(2, 2, 1), np.array([-1.6, 0.63, 0.1, 0.08])
    sizes = [np.abs(cautious_gain(form, theta, s**2 * np.diag([0, 0, 1, 1])))[0] for s in (0, 0.05, 0.2, 1)]
    assert np.all(np.diff(sizes) < 0) and sizes[-1] < 0.1 * sizes[0]
    assert cautious_gain(form, theta, 1e300 * np.eye(4)) is None  # nothing finite: the tuner keeps what it had


def loop(controller, jump, samples=300, dither=0.1, lost=None):
    """The plant's gain is multiplied by ``jump`` at 150; returns r - y and u."""

    def plant(t, x, inputs, params):
        u, e = inputs
        b = jump if t + 1 >= 150 else 1.0
        return np.array([1.6 * x[0] - 0.63 * x[1] + b * (0.1 * u + 0.08 * x[2]) + e, x[0], u])

    def sensor(t, x, u, params):
        return [MISSING if lost is not None and t in lost else x[0]]

    system = control.nlsys(plant, sensor, inputs=["u", "e"], outputs=["y"], states=3, dt=1, name="plant")
    closed = control.interconnect([system, controller], inputs=["r", "e", "v"], outputs=["y", "u"], check_unused=False)
    rng, t = np.random.default_rng(0), np.arange(samples)
    r = np.where(t // 50 % 2, 1.0, -1.0)
    signals = [r, 0.05 * rng.standard_normal(samples), dither * rng.choice([-1.0, 1.0], samples)]
    y, u = control.input_output_response(closed, t, signals).outputs
    return r - y, u


def tuner(**options):
    est = dw.ARX(2, 2, memory=dw.AutoMemory())
    return create_adaptive_controller(est, limits=(-10, 10), name="tuner", **options)


def rms(x):
    return np.sqrt(np.mean(x**2))


def test_the_adaptive_loop_survives_a_jump_that_the_fixed_one_does_not():
    known = cautious_gain(Lagged(2, 2, 1), np.array([-1.6, 0.63, 0.1, 0.08]), np.zeros((4, 4)))
    fixed, _ = loop(tuner(every=0, gain=known), jump=6.0)
    adaptive, u = loop(tuner(), jump=6.0)
    assert abs(rms(adaptive[100:150]) - rms(fixed[100:150])) < 0.1  # as good as knowing
    assert rms(fixed[200:]) > 1.5 and rms(adaptive[200:]) < 0.6  # most of which is the steps of r
    assert np.abs(u).max() <= 10


def test_a_design_of_ones_own_and_lost_samples():
    poles = [0.5, 0.45, 0.4, 0.35]
    error, _ = loop(tuner(design=lambda F, G: control.place(F, G, poles)), jump=1.0, lost={120, 121, 140})
    assert rms(np.delete(error[100:], [20, 21, 40])) < 0.7


def test_without_a_dither_or_a_plant_it_stays_at_rest():
    _, u = loop(tuner(), jump=1.0, samples=60, dither=0.0)
    assert not u.any()  # documented: nothing excites, so nothing is learnt


@pytest.mark.parametrize(
    "est, options, words",
    [
        (dw.ARX(2, 2, 0), {}, "delay of at least 1"),
        (dw.Joint(2, inputs=1), {}, "ARX"),
        (dw.ARX(2, 2), dict(limits=(1, -1)), "limits"),
        (dw.ARX(2, 2), dict(caution=-1.0), "caution"),
        (dw.ARX(2, 2), dict(effort=0.0), "effort"),
        (dw.ARX(2, 2), dict(gain=[1.0]), "gain"),
    ],
)
def test_refusals(est, options, words):
    with pytest.raises(dw.InputError, match=words):
        create_adaptive_controller(est, **options)
    with pytest.raises(dw.InputError, match="estimator"):
        create_adaptive_iosystem(options)
