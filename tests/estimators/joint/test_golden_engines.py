"""The golden cases through the other engines they apply to: several outputs (with one), and the batch least squares.

The several-output engine takes no noise on the parameters (G01, G09, G10) and the batch none without noise (G03 - G05).
"""

import numpy as np
import pytest
from oracle import golden
from test_golden import continued, follow
from test_golden import joint as single

import driftwise as dw

SPLIT = [None, False]  # one output: nothing to split, but both ways run


def several(given, **options):
    """The several-output estimator of a golden case."""
    one = single(given)
    noise, n = one.options["noise"], one.model.n
    S = np.atleast_1d(noise.S)[:n]
    noise = dw.models.NoiseCovariance(np.atleast_2d(noise.Q)[:n, :n], S[:, None], [[noise.R]])
    kept = {name: one.options[name] for name in ("s0", "P0")}
    return dw.JointMIMO((n,), one.model.inputs, one.model.direct, noise=noise, **kept, **options)


def columns(y):
    return np.asarray(y)[:, None]


def followed(est, y, u=None):
    got, states = follow(est, columns(y), u)
    return {**got, "e": np.ravel(got["e"]), "T": np.ravel(got["T"])}, states


@pytest.mark.parametrize("split", SPLIT)
@pytest.mark.parametrize("name", ["G02", "G15", "G16"])
def test_theorem_3_with_several_outputs(name, split):
    given, expected, tolerance = golden.case(name)
    est = several(given, split=split)
    got, states = followed(est, given["y"], given.get("u"))
    for key in got.keys() & expected.keys():
        golden.assert_close(got[key], expected[key], tolerance, f"{name} {key}")
    golden.assert_close(est.loglik(states[-1]), expected["loglik"], tolerance, f"{name} loglik")


@pytest.mark.parametrize(("name", "accuracy"), [("G03", 1e-10), ("G04", 1e-14)])
def test_deadbeat_with_several_outputs(name, accuracy):
    given, expected, _ = golden.case(name)
    printed = expected["a_printed_after5"]
    got, states = followed(several(given), continued(given["y"], printed, 200))
    golden.assert_close(got["T"][:6], expected["T_first6"], 1e-6)
    golden.assert_close(-got["s"][4][3:], expected["a_printed_after4"], 1e-8)
    golden.assert_close(got["P"][4], expected["P_after4"], 1e-8)
    assert np.abs(-got["s"][5][3:] - printed).max() <= accuracy
    assert all(not state["D"].any() for state in states[5:])
    assert np.array_equal(got["s"][-1][3:], got["s"][5][3:])


def test_deadbeat_with_input_and_several_outputs():
    given, expected, tolerance = golden.case("G05")
    got, _ = followed(several(given), given["y"], given["u"])
    golden.assert_close(got["T"][:4], expected["T_first4"], 1e-9)
    golden.assert_close(got["P"][2], expected["P_after2"], tolerance)
    golden.assert_close(got["s"][3][1:], expected["r_after3"], tolerance)
    assert not np.any(got["P"][3])


@pytest.mark.parametrize("name", ["G02", "G15", "G16"])
def test_batch_least_squares(name):
    """The last state and the likelihood. It starts by the recursion: so twenty times the case, too."""
    given, expected, _ = golden.case(name)
    if name == "G16":
        noise, n = dw.models.NoisePolynomial(given["d"], given["var_v"]), 1
    else:
        n = int(given["n"])
        noise = dw.models.NoisePolynomial(given["S"][:n] / given["R"], given["R"])
    inputs = int(given.get("u") is not None)
    est = dw.Joint(n, inputs, given.get("direct", False), noise=noise, s0=given["s0"], P0=given["P0"], floor=0.0)
    y, u = given["y"], given.get("u")
    state = est.batch(y, u)
    golden.assert_close(est.loglik(state), expected["loglik"], 1e-10)
    if "s" in expected:
        golden.assert_close(est.mean(state), expected["s"][-1], 1e-9)
        golden.assert_close(est.covariance(state), expected["P"][-1], 1e-9)
    long = np.tile(y, 20), None if u is None else np.tile(u, 20)
    golden.assert_close(est.mean(est.batch(*long)), est.mean(est.scan(*long).state), 1e-9)
