"""The golden cases pass on the textbook oracle; each known wrong filter fails the cases that should catch it.

A mutant is the oracle's own source with one line replaced; `wrong()` insists that the line is there once.
"""

import inspect
import types

import numpy as np
import pytest
from oracle import dense, golden


def wrong(line, replacement):
    """The dense oracle with one line changed, as a module of its own."""
    source = inspect.getsource(dense)
    assert source.count(f" {line}\n") == 1, f"the oracle must have this line exactly once: {line}"
    module = types.ModuleType("dense_mutant")
    exec(compile(source.replace(f" {line}\n", f" {replacement}\n"), "<mutant>", "exec"), module.__dict__)
    return module


def outcome(oracle, name):
    """What an oracle gives for a golden case: pairs (got, expected)."""
    given, expected, _ = golden.case(name)
    if name == "G16":
        d, var_v = given["d"], given["var_v"]
        given |= {"n": 1, "direct": False, "u": None, "R": var_v}
        given |= {"Q": np.diag([d[0] ** 2 * var_v, 0.0]), "S": np.array([d[0] * var_v, 0.0])}
    st = oracle.Structure(given["n"], int(given["u"] is not None), given["direct"])
    N = st.size
    noise = oracle.Noise(given.get("Q", np.zeros((N, N))), given.get("S", np.zeros(N)), given["R"])
    prior = st, noise, given["s0"], given["P0"]
    if name == "G09":
        s, P = oracle.missing_step(*prior, [given["u"]])
        return [(s, expected["s"]), (P, expected["P"])]
    if name == "G11":
        s, P = oracle.smooth(*prior, given["y"], given["u"][:, None])
        return [(s, expected["s"]), (P, expected["P"])]
    scale = (given["alpha0"], given["beta0"]) if name == "G10" else None
    run = oracle.run(*prior, given["y"], given["u"], scale=scale)
    if name == "G05":
        return [
            (run.T[:4], expected["T_first4"]),
            (run.s[2][1:], expected["r_after2"]),
            (run.P[2], expected["P_after2"]),
            (run.s[3][1:], expected["r_after3"]),
        ]
    if name == "G10":
        trace = [(alpha, beta, beta / alpha * T) for (alpha, beta), T in zip(run.scale, run.T, strict=True)]
        return [(trace, expected["trace"]), (run.loglik, expected["loglik"])]
    pairs = [(getattr(run, key), expected[key]) for key in ("e", "T", "K", "s", "P") if key in expected]
    return [*pairs, (run.loglik, expected["loglik"])]


def passes(oracle, name):
    tolerance = golden.case(name)[2]
    # G05 ends in T = 0 up to rounding; the printed form is only asked for what comes before
    tolerance = max(tolerance, 1e-9) if name == "G05" else tolerance
    with np.errstate(all="ignore"):  # a wrong filter may well reach the logarithm of a negative variance
        return all(golden.worst(got, expected) <= tolerance for got, expected in outcome(oracle, name))


FILTER_CASES = ["G01", "G02", "G05", "G09", "G10", "G11", "G15", "G16"]


@pytest.mark.parametrize("name", FILTER_CASES)
def test_oracle_passes(name):
    assert passes(dense, name)
    # the mutation mechanism itself changes nothing
    assert passes(wrong("e = y - H @ s", "e = y - H @ s"), name)


MATRICES = "F, H = transition(st, y, u), row(st, u)"
GAIN = "L = F @ P @ H + S"
RICCATI = "P_next = F @ P @ F.T + Q - np.outer(K, K) * T"
A_COLUMNS = "columns_a = [I * -y]"
GAP = "T, y_hat, c = H @ P @ H + R, H @ s, (P @ H)[a]"
IDENTITY_BLOCK = "lower_block = np.eye(G.shape[1], dtype=int)"

# wrong variant: (the oracle's line, what it becomes, golden cases that must notice)
MUTANTS = {
    "sign of a": (A_COLUMNS, "columns_a = [I * y]", "G01 G02 G15 G10 G16"),
    "S dropped": (GAIN, "L = F @ P @ H", "G01 G02 G10 G11 G16"),
    "sign of S": (GAIN, "L = F @ P @ H - S", "G01 G02 G10 G16"),
    "b_n in H dropped": (
        "directs = list(u) if st.direct else []",
        "directs = [0 * x for x in u] if st.direct else []",
        "G01 G15 G10",
    ),
    "predicted instead of measured y in F": (
        MATRICES,
        "H = row(st, u); F = transition(st, H @ s, u)",
        "G01 G02 G15 G10 G16",
    ),
    "lagged y in F": (
        MATRICES,
        "F, H = transition(st, vars(step).get('y', 0.0), u), row(st, u); step.y = y",
        "G01 G02 G15 G10 G16",
    ),
    "lower block of F zero": (
        IDENTITY_BLOCK,
        IDENTITY_BLOCK.replace("np.eye", "0 * np.eye"),
        "G01 G02 G15 G10 G16",
    ),
    "no shift in F": (
        "E, I = np.eye(n, k=-1, dtype=int), np.eye(n, dtype=int)",
        "E, I = np.eye(n, dtype=int), np.eye(n, dtype=int)",
        "G01 G02 G15 G10 G16",
    ),
    "parameter order reversed": (A_COLUMNS, "columns_a = [I[::-1] * -y]", "G01 G02 G15 G10"),
    "time update first": (
        MATRICES,
        MATRICES + "; s, P, F, Q = F @ s, F @ P @ F.T + Q, np.eye(len(s)), 0 * Q",
        "G01 G02 G15 G10 G16",
    ),
    "K K' without T": (RICCATI, RICCATI.replace(" * T", ""), "G01 G02 G15 G10 G16"),
    "S missing in P+": (RICCATI, "K2 = K - S / T; " + RICCATI.replace("K, K", "K2, K2"), "G01 G02 G10 G16"),
    "Q missing": (RICCATI, RICCATI.replace("+ Q ", ""), "G01 G02 G10 G16"),
    "parameter drift missing": (RICCATI, "Q = Q.copy(); Q[st.n :, st.n :] = 0; " + RICCATI, "G01 G10"),
    "R taken as a standard deviation": ("T = H @ P @ H + R", "T = H @ P @ H + R**2", "G01 G15 G10 G16"),
    "missing sample: no second-order terms (EKF)": (GAP, "T, y_hat, c = 0.0, H @ s, np.zeros(n)", "G09"),
    "missing sample: predicted y in F, no noise for it": (
        GAP,
        "F = transition(st, H @ s, u); return F @ s, F @ P @ F.T + Q",
        "G09",
    ),
    "missing sample: predicted y as if measured": (
        GAP,
        "return step(st, noise, s, P, H @ s, u)[:2]",
        "G09",
    ),
    "unknown scale without T": (
        "alpha, beta = alpha + 0.5, beta + e * e / (2 * T)",
        "alpha, beta = alpha + 0.5, beta + e * e / 2",
        "G10",
    ),
}


@pytest.mark.parametrize("mutant", MUTANTS)
def test_mutant_is_caught(mutant):
    line, replacement, caught_by = MUTANTS[mutant]
    assert {name for name in caught_by.split() if passes(wrong(line, replacement), name)} == set()


def test_parameter_order_goes_unseen_only_where_there_is_one_parameter():
    """The catch list of a mutant is not "everything": with n = 1 there is nothing to reverse."""
    line, replacement, _ = MUTANTS["parameter order reversed"]
    assert passes(wrong(line, replacement), "G16")
