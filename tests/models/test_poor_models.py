"""Models and measures of what was hardly measured: infinite where nothing is known, never a warning or a NaN."""

import numpy as np
import pytest
from scipy.signal import lfilter

import driftwise as dw
from driftwise.models.canonical import Canonical
from driftwise.models.continuous import ContinuousModel
from driftwise.models.convert_mimo import ModelMIMO
from driftwise.models.structure import Structure


def test_a_continuous_model_of_nothing():
    est = dw.ContinuousJoint(2, 1, dt=0.1)
    model = est.scan([np.nan, np.nan], [0.0, 0.0]).model()
    assert np.all(model.poles == 0) and np.isinf(model.poles_std).all()
    assert np.isinf(model.dc_gain).all() and np.isinf(model.dc_gain_std).all()


def test_a_continuous_integrator_and_a_double_pole():
    integrator = ContinuousModel(Canonical(2, 1), np.array([0.3, 0.0, 0.0, 2.0]), 1e-4 * np.eye(4))
    assert np.isinf(integrator.dc_gain).all() and np.isinf(integrator.dc_gain_std).all()
    G, C = integrator.frequency_response([0.0, 1.0])
    assert np.isclose(G[0, 1], 2.0 / (1j * (1j + 0.3))) and np.isfinite(C[0, 1]).all()
    double = ContinuousModel(Canonical(2, 1), np.array([2.0, 1.0, 0.0, 2.0]), 1e-4 * np.eye(4))
    assert np.isinf(double.poles_std).all() and double.dc_gain[0] == 2.0


def test_several_outputs_of_which_none_was_measured():
    est = dw.JointMIMO((3, 1), 1)
    model = est.model_of(est.scan(np.full((5, 2), np.nan), np.ones(5)).state)
    assert np.all(model.poles == 0) and np.isinf(model.poles_std[:2]).all() and not np.isnan(model.poles_std).any()
    assert np.isfinite(model.dc_gain).all()


def test_several_outputs_with_an_integrator():
    values = np.array([-1.0, 0.0, 1.0, 0.0, -0.5, 1.0])
    model = ModelMIMO(Structure((1, 1), 1), values, 1e-4 * np.eye(6))
    assert np.isinf(model.dc_gain[0]).all() and np.isinf(model.dc_gain_std[0]).all()
    G, C = model.frequency_response([0.0, 0.5])
    z = np.exp(0.5j)
    assert np.allclose(G[:, 0, 1], [1 / (z - 1), 1 / (z - 0.5)]) and np.isfinite(C[:, :, 1]).all()


@pytest.mark.parametrize("inputs", [1, 2])
def test_gains_with_direct_terms_and_coloured_noise(inputs):
    """Standard deviations by finite differences of the gains; the direct terms stand behind the c's."""
    form = Canonical(2, inputs, True, True)
    rng = np.random.default_rng(3)
    m = form.N - form.n
    values = np.concatenate([[-0.9, 0.3], rng.standard_normal(m - 2)])
    root = 1e-3 * rng.standard_normal((m, m))
    model = dw.models.Model(form, values, root @ root.T)

    def gains(theta):
        b = theta[2 : 2 + 2 * inputs].reshape(inputs, 2).sum(axis=1)
        return (b + theta[-inputs:]) / (1 + theta[0] + theta[1])

    J = np.array([(gains(values + 1e-6 * e) - gains(values - 1e-6 * e)) / 2e-6 for e in np.eye(m)]).T
    std = np.sqrt(np.diag(J @ model.covariance @ J.T))
    assert np.allclose(model.dc_gain, gains(values), rtol=1e-12)
    assert np.allclose(model.dc_gain_std, std, rtol=1e-4)
    half = np.ptp(model.dc_gain_interval(0.95), axis=1) / 2
    assert np.allclose(half, 1.959964 * std, rtol=1e-2)


def test_the_residuals_pay_for_every_unknown():
    y, _ = dw.simulate([-0.7], d=[0.4], samples=40, noise_std=1.0, seed=2)
    bound, unit = (dw.models.cramer_rao_of_record(y, a=[-0.7], d=[0.4], noise_variance=v) for v in (None, 1.0))
    one = np.zeros(40)
    one[0] = 1.0
    e, h = lfilter([1.0, -0.7], [1.0, 0.4], y), lfilter([1.0], [1.0, 0.4], one)
    e = e - h * (h @ e) / (h @ h)
    assert np.allclose(unit.information / bound.information, e @ e / (40 - 3), rtol=1e-9)


def test_whiteness_knows_no_size():
    z = np.random.default_rng(0).standard_normal(200)
    z[17] = np.nan
    for scale in (2.0**-900, 2.0**700):
        assert dw.results.ljung_box(scale * z) == dw.results.ljung_box(z)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: dw.models.confidence_ellipse(np.diag([np.inf, np.inf])).points(), "infinite"),
        (lambda: dw.models.minimum_phase([1e300]), "range"),
        (lambda: dw.models.cramer_rao([], [], samples=10), "empty"),
        (lambda: dw.models.cramer_rao_of_record([1.0, 2.0], a=[], d=[]), "empty"),
    ],
)
def test_what_has_no_answer_is_told(call, words):
    with pytest.raises(dw.InputError, match=words):
        call()
