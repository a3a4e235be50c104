"""The Gramian against the golden cases and the dense transition matrices; causes in words."""

import numpy as np
import pytest
from oracle import dense, golden

import driftwise as dw

A, B = [-1.5, 0.7], [1.0, 0.5]
T = 120
WHITE = np.random.default_rng(0).standard_normal((T, 2))


def plant(u, noise_std=0.0, samples=T, **options):
    return dw.simulate(A, B, samples=samples, u=u, noise_std=noise_std, seed=1, **options)


def dense_rows(st, y, u, d):
    """H_t Phi(t, 0) with F - d H in place of F (S/R = d): products of full matrices."""
    Phi, rows = np.eye(st.size), []
    gain = np.concatenate([d, np.zeros(st.size - st.n)])
    for t in range(len(y)):
        H = dense.row(st, u[t])
        rows.append(H @ Phi)
        Phi = (dense.transition(st, y[t], u[t]) - np.outer(gain, H)) @ Phi
    return np.array(rows)


def test_golden_gramians():
    given, expected, _ = golden.case("G06")
    for i, case in enumerate(given["cases"]):
        found = dw.analysis.identifiability(case["y"], case["u"], order=given["n"], direct=True)
        golden.assert_close(found.gramian, expected["gramian"][i], 1e-9, case["name"])
        assert found.rank == expected["rank"][i]
        assert found.is_identifiable == (found.rank == found.unknowns == 7)
        if expected["det"][i]:
            assert np.linalg.det(found.gramian) == pytest.approx(expected["det"][i], rel=1e-9)


@pytest.mark.parametrize(
    "st", [dense.Structure(1), dense.Structure(3), dense.Structure(2, 1, True), dense.Structure(3, 2)]
)
@pytest.mark.parametrize("is_coloured", [False, True])
def test_gramian_is_that_of_the_transition_matrices(st, is_coloured):
    rng = np.random.default_rng(st.size)
    y, u = rng.standard_normal(40), rng.standard_normal((40, st.inputs))
    d = np.poly(rng.uniform(-0.9, 0.9, st.n))[:0:-1] if is_coloured else np.zeros(st.n)
    O = dense_rows(st, y, u, d)
    found = dw.analysis.identifiability(
        y, u if st.inputs else None, order=st.n, direct=st.direct, d=d if is_coloured else None
    )
    golden.assert_close(found.gramian, O.T @ O, 1e-11)
    G, n = O.T @ O, st.n
    schur = G[n:, n:] - G[n:, :n] @ np.linalg.pinv(G[:n, :n]) @ G[:n, n:]
    golden.assert_close(found.parameter_gramian, schur, 1e-10)
    unit = np.sqrt(np.diag(schur))
    values = np.linalg.eigvalsh(schur / np.outer(unit, unit))
    np.testing.assert_allclose([f.eigenvalue for f in found.directions], values, atol=1e-10)
    assert found.rank == np.linalg.matrix_rank(O) == st.size


def test_rows_are_the_derivatives_of_the_filters_own_prediction():
    """A change of s(t0), known exactly, moves the prediction of the running filter by the row times the change."""
    y, u = plant(WHITE[:20, 0], 0.1, samples=20)
    n, N, s0 = 2, 7, np.random.default_rng(3).standard_normal(7)

    def predictions(s0):
        est = dw.Joint(2, 1, True, noise=dw.models.NoisePolynomial((0.2, -0.5), 1.0), s0=s0, P0=0.0)
        return est.scan(y, u).prediction

    h = 1e-4
    O = np.column_stack([(predictions(s0 + h * e) - predictions(s0 - h * e)) / (2 * h) for e in np.eye(N)])
    found = dw.analysis.identifiability(y, u, order=n, direct=True, d=[0.2, -0.5])
    golden.assert_close(found.gramian, O.T @ O, 1e-7)


def test_unseen_directions_change_nothing():
    """Moving theta along an unseen direction, with the right x(t0), reproduces the same record."""
    u = np.sin(0.4 * np.arange(T))
    y, _ = plant(u)
    found = dw.analysis.identifiability(y, u, order=2, direct=True)
    assert len(found.unseen) == 1
    O = dense_rows(dense.Structure(2, 1, True), y, u[:, None], np.zeros(2))
    v = found.unseen[0].vector
    change = np.concatenate([v[1::-1], v[3:1:-1], v[4:]])  # to Salut's order
    x = np.linalg.lstsq(O[:, :2], -O[:, 2:] @ change, rcond=None)[0]
    assert np.max(abs(O @ np.concatenate([x, change]))) < 1e-9


def test_grades_of_excitation():
    """The order of excitation: white, step, one sinusoid, constant, zero."""
    inputs = [WHITE[:, 0], np.arange(T) > 20.0, np.sin(0.3 * np.arange(T)), np.ones(T), np.zeros(T)]
    found = [dw.analysis.identifiability(*plant(np.asarray(u, float), 0.3), order=2, direct=True) for u in inputs]
    assert [f.rank for f in found] == [7, 7, 6, 5, 4]
    assert found[0].worst > 0.02 > 0.01 > found[1].worst > 1e-5
    assert [f.worst for f in found[2:]] == [0, 0, 0]
    assert "weakest" in dw.analysis.identifiability(*plant(np.asarray(inputs[1], float)), order=2, direct=True).words


@pytest.mark.parametrize(
    ("u", "order", "noise_std", "says"),
    [
        (np.zeros(T), 2, 0.2, "along b1, b2, b0. The input is zero"),
        (3.0 * np.ones(T), 2, 0.2, "along b1 - b0, b2 - b0. The input is constant"),
        (np.cos(2 * np.pi * np.arange(T) / 12.5), 2, 0.2, "single sinusoid of period 12.5 samples"),
        (np.sin(0.3 * np.arange(T)) + 1, 3, 0.0, "exciting of order 3 only, and 7 are needed"),
    ],
)
def test_poor_inputs_are_named(u, order, noise_std, says):
    found = dw.analysis.identifiability(*plant(u, noise_std), order=order, direct=True)
    assert not found.is_identifiable
    assert says in found.words


def test_other_causes_are_named():
    y, u = plant(WHITE[:, 0])
    cancelled = dw.analysis.identifiability(y, u, order=3)
    assert cancelled.rank == cancelled.unknowns - 1
    assert "a model of order 2 explains the record: a pole and a zero cancel" in cancelled.words
    short = dw.analysis.identifiability(y[:4], u[:4], order=2)
    assert "4 usable samples are fewer than the 6 unknowns" in short.words
    free = dw.analysis.identifiability(0.8 ** np.arange(30.0), order=2)
    assert free.unseen[0].words == "a1 - 0.8 a2" and "fewer than 2 modes" in free.words
    both = np.column_stack([WHITE[:, 0], 2 * WHITE[:, 0]])
    y, _ = dw.simulate(A, [B, [0.3, 0.2]], samples=T, u=both, noise_std=0.1)
    tied = dw.analysis.identifiability(y, both, order=2)
    assert len(tied.unseen) == 2 and "inputs move together" in tied.words
    assert [d.words for d in tied.unseen] == ["b1.1 - 0.5 b1.2", "b2.1 - 0.5 b2.2"]
    assert "output is zero" in dw.analysis.identifiability(np.zeros(30), order=1).words


def test_rows_that_touch_a_gap_are_left_out():
    y, u = plant(WHITE[:, 0], 0.1)
    y[[0, 30, 31]], u[60] = np.nan, np.nan
    found = dw.analysis.identifiability(y, u, order=2)
    touched = {0, 1, 2, 30, 31, 32, 33, 61, 62}  # without a direct term u(60) is not in row 60
    assert found.lost_rows == len(touched) and found.rows == T - len(touched)
    O = dense_rows(dense.Structure(2, 1), np.nan_to_num(y), np.nan_to_num(u)[:, None], np.zeros(2))
    keep = [t for t in range(T) if t not in touched]
    golden.assert_close(found.gramian, O[keep].T @ O[keep], 1e-11)
    assert found.is_identifiable and found.rank < found.unknowns  # x(t0) is lost with the first rows, r is not


@pytest.mark.parametrize("factors", [(1e9, 1.0), (1.0, 1e-7), (1e-6, 1e6)])
def test_units_do_not_change_the_verdict(factors):
    y, u = plant(WHITE[:, 0], 0.1)
    before = dw.analysis.identifiability(y, u, order=2)
    after = dw.analysis.identifiability(factors[0] * y, factors[1] * u, order=2)
    assert (after.rank, after.is_identifiable) == (before.rank, True)
    assert after.worst == pytest.approx(before.worst, rel=1e-9)
    y, u = plant(WHITE[:, 0])  # a cancelled pole and zero, whose direction has entries of different units
    before = dw.analysis.identifiability(y, u, order=3)
    after = dw.analysis.identifiability(factors[0] * y, factors[1] * u, order=3)
    gain = np.repeat([1.0, factors[0] / factors[1]], 3)
    one, other = before.unseen[0].vector * gain, after.unseen[0].vector
    np.testing.assert_allclose(other / abs(other).max(), one / abs(one).max() * np.sign(one @ other), rtol=1e-6)


def test_long_records_are_taken_in_stretches():
    y, u = dw.simulate(A, B, samples=9000, noise_std=0.1)
    whole = dw.analysis.identifiability(y, u, order=2, d=[0.3, 0.1])
    O = dense_rows(dense.Structure(2, 1), y, u[:, None], np.array([0.3, 0.1]))
    golden.assert_close(whole.gramian, O.T @ O, 1e-11)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: dw.analysis.identifiability([1.0, 2.0], order=0), "order"),
        (lambda: dw.analysis.identifiability([], order=1), "empty"),
        (lambda: dw.analysis.identifiability([np.nan] * 5, order=1), "no row of the record is complete"),
        (lambda: dw.analysis.identifiability([1.0, np.nan, 2.0], order=1, d=[0.5]), "gap"),
        (lambda: dw.analysis.identifiability([1.0, 2.0], order=1, d=[1.5]), "minimum_phase"),
        (lambda: dw.analysis.identifiability([1.0, 2.0], [1.0], order=1), "simultaneous"),
        (lambda: dw.analysis.identifiability([1.0, np.inf], order=1), "infinite"),
        (lambda: dw.analysis.identifiability([1.0, 2.0], 3.0, order=1), "u must be"),
    ],
)
def test_bad_input_has_a_clear_answer(call, says):
    with pytest.raises(dw.InputError, match=says):
        call()


@pytest.mark.parametrize("y_unit, u_unit", [(1, 0), (0, 1), (1, 1), (-1, 0), (0, -1), (-1, -1)])
@pytest.mark.parametrize("direct", [False, True])
def test_it_does_not_depend_on_units_however_large(y_unit, u_unit, direct):
    """1e199, whose square is no number: all is that of the plain record, but for the units of b."""
    y_unit, u_unit = 2.0 ** (660 * y_unit), 2.0 ** (660 * u_unit)
    y, u = plant(WHITE[:, 0], noise_std=0.1)
    plain = dw.analysis.identifiability(y, u, order=2, direct=direct)
    found = dw.analysis.identifiability(y * y_unit, u * u_unit, order=2, direct=direct)
    assert (found.rank, found.worst) == (plain.rank, plain.worst)
    theta_units = np.array([1.0, 1.0] + [y_unit / u_unit] * (len(plain.names) - 2))
    for one, other in zip(found.directions, plain.directions, strict=True):
        assert one.eigenvalue == other.eigenvalue
        change = other.vector * theta_units
        np.testing.assert_array_equal(one.vector, change / change[np.flatnonzero(other.vector == 1.0)[0]])
    np.testing.assert_array_equal(found.gramian[:2, :2], plain.gramian[:2, :2])


def test_regressors_are_told_apart_in_any_unit():
    X = np.random.default_rng(3).standard_normal((200, 2))
    regression = dw.Regression(["p", "q"])
    plain = dw.analysis.identifiable.taught(regression, X[:, 0], X)
    large = dw.analysis.identifiable.taught(regression, X[:, 0], X * 2.0**700)
    assert (large.rank, large.worst, large.words) == (plain.rank, plain.worst, plain.words)
