"""The paper's recursion against the golden cases, and against forms that share no code with it."""

import json
from pathlib import Path

import numpy as np
import pytest
from driftwise_studies.papers.perriot import engine, factors

FILE = Path(__file__).parents[1] / "golden" / "perriot.json"
CASES = {case["name"]: case for case in json.loads(FILE.read_text())["cases"]}


def assert_case(got, expected, tolerance=1e-10):
    got, expected = np.asarray(got, float), np.asarray(expected, float)
    assert got.shape == expected.shape
    assert np.max(np.abs(got - expected) / np.maximum(np.abs(expected), 1e-3)) <= tolerance


def run(name, change=None, **options):
    given = CASES[name]["input"]
    structure = engine.Structure(**{key: np.array(value) for key, value in given["structure"].items()})
    y, u = np.array(given["y"])[:, None], np.array(given["u"])[:, None]
    change = change or engine.Information(np.atleast_2d(given["R0"]))
    theta0 = given.get("theta0", given.get("K0"))
    return engine.run(structure, y, u, given["gamma"], change, theta0, **options), change


@pytest.mark.parametrize(
    "name, built",
    [
        ("arx11_decreasing", engine.registers(na=1, nb=1)),
        ("armax111_plr_posterior_residual", engine.registers(na=1, nb=1, nc=1)),
        ("oe11_plr", engine.registers(nf=1, nb=1)),
        ("armax111_rpem", engine.registers(na=1, nb=1, nc=1)),
    ],
)
def test_golden_structures(name, built):
    given, expected = CASES[name]["input"], CASES[name]["expected"]
    for made, listed in zip(built, engine.Structure(**given["structure"])):
        assert np.array_equal(made, np.array(listed))
    found, change = run(name, gradient=given.get("grad") == "rpem")
    assert_case(found.theta, expected["theta"])
    assert_case(found.eps.ravel(), np.ravel(expected["eps"]))
    assert_case(change.R, expected["R_last"])
    assert_case(found.x, expected["x_last"])
    factored, _ = run(
        name, engine.Factored(np.array(given["R0"]), given["gamma0"]), gradient=given.get("grad") == "rpem"
    )
    assert_case(factored.theta, expected["theta"])


def test_golden_hampton():
    given, expected = CASES["hampton_as_engine"]["input"], CASES["hampton_as_engine"]["expected"]
    for made, listed in zip(engine.hampton(given["Phi"]), engine.Structure(**given["structure"])):
        assert np.array_equal(made, np.array(listed))
    found, _ = run("hampton_as_engine", posterior=False)
    assert_case(found.theta[:, 0, 0], expected["K"])
    assert_case(found.eps[:, 0], expected["eps"])
    naive, _ = run("hampton_as_engine", posterior=True)
    assert np.abs(naive.theta[:, 0, 0] - expected["K"]).max() > 0.01


@pytest.mark.parametrize("form", ["R", "UD"])
def test_golden_reset(form):
    case = CASES["reset_gain_equals_forgetting_factor"]
    given, expected = case["input"], case["expected"]
    R0 = np.array(given["R0"])
    change = engine.Information(R0) if form == "R" else engine.Factored(R0, given["gamma0"])
    y, u = np.array(given["y"])[:, None], np.array(given["u"])[:, None]
    found = engine.run(engine.registers(na=1, nb=1), y, u, given["gamma"], change, np.zeros((1, 2)))
    assert_case(found.theta, expected["theta"])
    assert_case(engine.forgetting(given["gamma"], given["gamma0"]), expected["lambda"])


def test_golden_gain_sequences():
    given, expected = CASES["gain_sequences"]["input"], CASES["gain_sequences"]["expected"]
    n = given["n"]
    assert_case(engine.weighted(n, 1.0), expected["one_over_n"])
    assert_case(engine.limited(n, given["N"]), expected["step_limit"])
    assert_case(engine.weighted(n, given["p"]), expected["forgetting_08"])
    assert_case(engine.weighted(n, given["p2"]), expected["forgetting_0996"])


def test_the_order_of_the_equations_matters():
    case = CASES["arx11_decreasing"]
    naive, _ = run("arx11_decreasing", engine.Swapped(np.array(case["input"]["R0"])))
    assert np.abs(naive.theta - np.array(case["expected"]["theta"])).max() > 0.05


def test_two_outputs_share_one_R_or_need_the_whole():
    """PLR with two outputs is two single-output recursions; RPEM in U-D form is RPEM with R, Lam not diagonal."""
    rng = np.random.default_rng(0)
    u, v, Lam = rng.standard_normal((40, 1)), rng.standard_normal((40, 2)), np.array([[1.0, 0.3], [0.3, 0.5]])
    st, y, gains = engine.registers(na=1, nb=1, nc=1, p=2), np.zeros((40, 2)), 1 / np.arange(2.0, 42)
    for n in range(1, 40):
        y[n] = 0.5 * y[n - 1, ::-1] + u[n - 1] + v[n] + 0.3 * v[n - 1]
    whole = engine.run(st, y, u, gains, engine.Information(np.eye(10), Lam), np.zeros((2, 5)), gradient=True)
    factored = engine.run(st, y, u, gains, engine.Factored(np.eye(10), 1.0, Lam), np.zeros((2, 5)), gradient=True)
    assert np.abs(factored.theta - whole.theta).max() < 1e-11
    arx = engine.registers(na=1, nb=1, p=2, direct=True)
    both = engine.run(arx, y, u, gains, engine.Information(np.eye(4)), np.zeros((2, 4)))
    rows = np.hstack([np.vstack([np.zeros((1, 3)), np.hstack([y, u])[:-1]]), u])  # y_{n-1}, u_{n-1}, u_n
    ridge = rows.T @ rows + np.eye(4)  # gains 1/(n + 1) weigh R0 as one sample
    assert_case(both.theta[-1].T, np.linalg.solve(ridge, rows.T @ y), 1e-10)


def test_projection_keeps_the_model_stable():
    rng = np.random.default_rng(3)
    u = rng.standard_normal((300, 1))
    y = np.cumsum(u, axis=0) + rng.standard_normal((300, 1))
    st = engine.registers(nf=1, nb=1)
    change = engine.Information(0.1 * np.eye(2))
    found = engine.run(st, y, u, engine.weighted(np.arange(2, 302), 1.0), change, np.zeros((1, 2)), project=True)
    assert np.abs(found.theta[:, 0, 0]).max() <= 1 - 1e-3
    free = engine.run(
        st, y, u, engine.weighted(np.arange(2, 302), 1.0), engine.Information(0.1 * np.eye(2)), np.zeros((1, 2))
    )
    assert np.abs(free.theta[:, 0, 0]).max() > 1 - 1e-3


def test_factors_are_the_matrix_they_factor():
    rng = np.random.default_rng(4)
    A = rng.standard_normal((5, 5))
    P, q, row, e = A @ A.T, rng.random(5), rng.standard_normal((2, 5)), rng.standard_normal((2, 3))
    U, d = factors.factorise(P)
    assert_case(U * d @ U.T, P, 1e-13)
    U, d = factors.widen(U, d, q)
    P = P + np.diag(q)
    assert_case(U * d @ U.T, P, 1e-13)
    U, d, change = factors.correct(U, d, row, e)
    gain = P @ row.T @ np.linalg.inv(row @ P @ row.T + np.eye(2))
    assert_case(change, gain @ e, 1e-11)
    assert_case(U * d @ U.T, P - gain @ row @ P, 1e-11)


def test_a_random_walk_waits_for_a_noise_variance():
    change = engine.Walking(1e-3, 1.0)
    assert not change(0.0, np.ones((1, 1)), np.ones((1, 1))).any()
    assert change.Lam == 1.0
    assert change(0.0, np.ones((1, 1)), np.ones((1, 1))).any()
    assert engine.Walking(1e-3, 1.0, prior=(5, 1.0))(0.0, np.ones((1, 1)), np.ones((1, 1))).any()
