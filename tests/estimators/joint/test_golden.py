"""The golden cases through the public interface, in every numerical form they apply to.

Cases whose S reaches the parameters (G01, G09, G10) have no UD form: there the array form is chosen. Their UD
counterpart is a comparison with the dense oracle, which the golden cases check in `test_mutants.py`.
"""

import numpy as np
import pytest
from oracle import dense, exact, golden

import driftwise as dw

PLAIN = ["G01", "G02", "G15", "G16"]
FORMS = {"G01": [None, "array"], "G02": ["ud", "array"], "G15": ["ud", "array"], "G16": ["ud", "array"]}


def joint(given, **options):
    """The estimator of a golden case."""
    if "d" in given:  # G16
        d, var_v = given["d"][0], given["var_v"]
        given = given | {"n": 1, "Q": np.diag([d * d * var_v, 0.0]), "S": [d * var_v, 0.0], "R": var_v}
    if "p0" in given:  # dead-beat
        given = given | {"s0": np.zeros(2 * given["n"]), "P0": given["p0"]}
    N = len(given["s0"])
    noise = dw.models.NoiseCovariance(given.get("Q", np.zeros((N, N))), given.get("S", np.zeros(N)), given["R"])
    inputs = int(given.get("u") is not None)
    direct = given.get("direct", False)
    return dw.Joint(given["n"], inputs, direct, noise=noise, s0=given["s0"], P0=given["P0"], **options)


def follow(est, y, u=None):
    """Feed a record sample by sample; e, T, s, P and the state after each sample."""
    state, rows = est.start(), []
    for t in range(len(y)):
        state, step = est.update(state, y[t], *([] if u is None else [u[t]]))
        rows.append((step.innovation, step.variance, est.mean(state), est.covariance(state), state))
    e, T, s, P, states = zip(*rows, strict=True)
    return {"e": e, "T": T, "s": s, "P": P}, states


@pytest.mark.parametrize(("name", "form"), [(name, form) for name in PLAIN for form in FORMS[name]])
def test_theorem_3(name, form):
    given, expected, tolerance = golden.case(name)
    est = joint(given, form=form)
    got, states = follow(est, given["y"], given.get("u"))
    for key in got.keys() & expected.keys():
        golden.assert_close(got[key], expected[key], tolerance, f"{name} {key}")
    golden.assert_close(est.loglik(states[-1]), expected["loglik"], tolerance, f"{name} loglik")
    if name == "G02":
        golden.assert_close(-got["s"][-1][3:6], expected["a_printed_sign"], tolerance)


def test_evidence_is_the_integral_over_the_parameter():
    given, _, _ = golden.case("G16")
    est = joint(given)
    _, states = follow(est, given["y"])
    integral = exact.evidence_by_quadrature(given["y"], given["d"][0], given["var_v"], given["s0"], given["P0"])
    golden.assert_close(est.loglik(states[-1]), integral, 1e-10)


def continued(y, printed, T):
    """The dead-beat records of the golden file go on by their own recursion."""
    y = list(y)
    while len(y) < T:
        y.append(printed[2] * y[-1] + printed[1] * y[-2] + printed[0] * y[-3])
    return np.array(y)


@pytest.mark.parametrize(("name", "accuracy"), [("G03", 1e-10), ("G04", 1e-14)])
def test_deadbeat(name, accuracy):
    """R = 0: six samples give a exactly, P is exactly zero, and nothing moves afterwards."""
    given, expected, _ = golden.case(name)
    printed = expected["a_printed_after5"]
    y = continued(given["y"], printed, 1000)
    est = joint(given, form="ud")
    got, states = follow(est, y)
    golden.assert_close(got["T"][:6], expected["T_first6"], 1e-6)
    golden.assert_close(got["e"][:6], expected["e_first6"], 1e-6)
    golden.assert_close(-got["s"][4][3:], expected["a_printed_after4"], 1e-8)
    golden.assert_close(got["P"][4], expected["P_after4"], 1e-8)
    golden.assert_close(got["s"][5][:3], expected["x_pred_after5"], 1e-9)
    golden.assert_close(got["s"][-1][:3][-1], continued(y, printed, 1001)[-1], 1e-9)
    assert np.abs(-got["s"][5][3:] - printed).max() <= accuracy
    for t in range(5, len(y)):
        assert not states[t]["D"].any()
        assert not np.any(got["P"][t])
        assert np.array_equal(got["s"][t][3:], got["s"][5][3:]), "a must stay bit-identical"
    for t in range(6, len(y)):
        assert got["T"][t] == 0
        assert abs(got["e"][t]) < 1e-9 * np.abs(y[: t + 1]).max()
        assert int(states[t]["status"]) & dw.Status.EXACT


@pytest.mark.parametrize("name", ["G03", "G04"])
def test_deadbeat_array_form(name):
    given, expected, _ = golden.case(name)
    got, _ = follow(joint(given, form="array"), given["y"])
    golden.assert_close(got["T"][:5], expected["T_first6"][:5], 1e-6)
    golden.assert_close(-got["s"][4][3:], expected["a_printed_after4"], 1e-8)
    golden.assert_close(got["P"][4], expected["P_after4"], 1e-8)
    for t in (5, 8):
        golden.assert_close(-got["s"][t][3:], expected["a_printed_after5"], 1e-9)
    golden.assert_close(got["s"][5][:3], expected["x_pred_after5"], 1e-9)


@pytest.mark.parametrize("form", ["ud", "array"])
def test_deadbeat_with_input(form):
    given, expected, tolerance = golden.case("G05")
    got, _ = follow(joint(given, form=form), given["y"], given["u"])
    golden.assert_close(got["T"][:4], expected["T_first4"], 1e-9)
    golden.assert_close(got["s"][2][1:], expected["r_after2"], tolerance)
    golden.assert_close(got["P"][2], expected["P_after2"], tolerance)
    for t in range(3, len(given["y"])):
        golden.assert_close(got["s"][t][1:], expected["r_after3"], tolerance)
        golden.assert_close(got["P"][t], np.zeros((4, 4)), 0.0 if form == "ud" else tolerance)


def test_missing_sample():
    given, expected, tolerance = golden.case("G09")
    est = joint(given)
    state, step = est.update(est.start(), np.nan, given["u"])
    golden.assert_close(est.mean(state), expected["s"], tolerance)
    golden.assert_close(est.covariance(state), expected["P"], tolerance)
    assert np.isnan(step.innovation)
    assert step.status & dw.Status.MISSING_OUTPUT


def test_missing_sample_ud():
    """The UD form where it applies: the same case without noise on the parameters."""
    given, _, tolerance = golden.case("G09")
    n, N = given["n"], len(given["s0"])
    on_state = np.arange(N) < n
    Q, S = np.where(np.outer(on_state, on_state), given["Q"], 0.0), np.where(on_state, given["S"], 0.0)
    est = joint(given | {"Q": Q, "S": S}, form="ud")
    state, _ = est.update(est.start(), np.nan, given["u"])
    noise = dense.Noise(Q, S, given["R"])
    expected = dense.missing_step(dense.Structure(n, 1, True), noise, given["s0"], given["P0"], [given["u"]])
    golden.assert_close(est.mean(state), expected[0], tolerance)
    golden.assert_close(est.covariance(state), expected[1], tolerance)


def test_unknown_scale():
    given, expected, tolerance = golden.case("G10")
    est = joint(given, scale=dw.models.InverseGamma(given["alpha0"], given["beta0"]))
    got, states = follow(est, given["y"], given["u"])
    before = [est.start(), *states[:-1]]
    trace = [(*est.scale_posterior(state), T) for state, T in zip(before, got["T"], strict=True)]
    golden.assert_close(trace, expected["trace"], tolerance, "alpha, beta, squared Student scale")
    golden.assert_close(est.scale_posterior(states[-1]), [expected["alpha"], expected["beta"]], tolerance)
    golden.assert_close(est.loglik(states[-1]), expected["loglik"], tolerance, "log marginal likelihood")
    plain = golden.case("G01")[1]
    golden.assert_close(got["s"], plain["s"], tolerance, "the mean does not depend on the scale")
    golden.assert_close(got["P"], plain["P"], tolerance, "covariance relative to sigma^2")
