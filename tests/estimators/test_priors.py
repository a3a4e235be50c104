"""A prior by name: in any order it is the same prior, and what cannot be checked, or is no name, is refused."""

import numpy as np
import pytest

import driftwise as dw


def prior(est):
    """Mean and covariance of the first state, by name, in the estimator's own order."""
    state = est.start()
    return est.mean(state), est.covariance(state)


SEVERAL = [
    (lambda **given: dw.ARXMIMO(2, 1, na=1, nb=1, variance=1.0, **given), "theta0"),
    (lambda **given: dw.JointMIMO((2, 1), 1, noise=dw.models.EquationError(1.0), **given), "s0"),
]


@pytest.mark.parametrize("make, mean", SEVERAL)
def test_the_order_of_names_does_not_matter(make, mean):
    names = make().names
    values = {name: 0.1 * i for i, name in enumerate(names, 1)}
    variances = {name: 0.01 * i for i, name in enumerate(names, 1)}
    there = make(**{mean: values}, P0=variances)
    back = make(**{mean: dict(reversed(values.items()))}, P0=dict(reversed(variances.items())))
    for one, other in zip(prior(there), prior(back)):
        np.testing.assert_array_equal(one, other)
    y, u = np.random.default_rng(1).standard_normal((2, 50, 2))
    model = there.scan(np.full((1, 2), np.nan), np.zeros((1, 1))).model()  # nothing is learnt
    found = dict(zip(model.names, model.values)), dict(zip(model.names, np.diag(model.covariance)))
    for name in names:
        assert found[0][name] == pytest.approx(values[name]) and found[1][name] == pytest.approx(variances[name])
    np.testing.assert_array_equal(there.scan(y, u[:, :1]).table, back.scan(y, u[:, :1]).table)


@pytest.mark.parametrize("make, mean", SEVERAL)
def test_what_is_not_named_is_as_by_default(make, mean):
    plain, some = make(), make(**{mean: {"a1.11": -0.5}}, P0={"a1.11": 0.04})
    (m, P), (m1, P1) = prior(plain), prior(some)
    assert np.count_nonzero(m1 != m) == 1 and np.count_nonzero(P1 != P) == 1
    assert m1.sum() == -0.5 and np.isclose(np.diag(P1)[m1 != m], 0.04)


@pytest.mark.parametrize("make, mean", SEVERAL)
def test_numbers_in_a_row_and_names_that_are_none_are_refused(make, mean):
    count = make().model.N
    for wrong in ({mean: np.zeros(count)}, {"P0": np.ones(count)}, {"P0": np.eye(count)}):
        with pytest.raises(dw.InputError, match=r"of several outputs is given by name.*a1\.11"):
            make(**wrong)
    with pytest.raises(dw.InputError, match=rf"{mean} has 'a11', which is no name here: they are .*a1\.11"):
        make(**{mean: {"a11": 1.0}})
    with pytest.raises(dw.InputError, match="P0 has 'q'"):
        make(P0={"a1.11": {"a1.11": 1.0, "q": 0.1}})
    make(P0=3.0)


def test_a_matrix_by_name_needs_each_link_once():
    names = {"a1.11": {"a1.11": 1.0, "a1.12": 0.5}, "a1.12": {"a1.12": 2.0}}
    P = prior(dw.ARXMIMO(2, 0, na=1, nb=0, variance=1.0, P0=names))[1]
    np.testing.assert_allclose(P[:2, :2], [[1.0, 0.5], [0.5, 2.0]])


def test_one_output_takes_names_or_its_order():
    named, plain = dw.ARX(1, 1, theta0={"b1": 0.5, "a1": -0.8}), dw.ARX(1, 1, theta0=[-0.8, 0.5])
    np.testing.assert_array_equal(named.start(), plain.start())
    joint = dw.Joint(2, 1, s0={"a1": -1.2, "a2": 0.5, "x2": 3.0}, P0=1.0)
    salut = dw.Joint(2, 1, s0=[0.0, 3.0, 0.5, -1.2, 0.0, 0.0], P0=1.0)  # [x_1, x_2; a_0, a_1; b_0, b_1]
    np.testing.assert_array_equal(joint.start(), salut.start())


def test_labels_of_pandas_are_not_dropped():
    pd = pytest.importorskip("pandas")
    with pytest.raises(dw.InputError, match=r"theta0 is a Series.*: give theta0\.to_dict\(\)"):
        dw.ARX(1, 1, theta0=pd.Series({"b1": 0.5, "a1": -0.8}))


def test_a_prior_by_name_is_saved_with_the_estimator(tmp_path):
    est = dw.ARXMIMO(2, 0, na=1, nb=0, theta0={"a1.11": -0.5}, P0={"a1.11": 0.04})
    trace = est.scan(np.random.default_rng(0).standard_normal((20, 2)))
    trace.save(tmp_path / "run.npz")
    again = dw.Trace.load(tmp_path / "run.npz").estimator
    assert again.options["theta0"] == {"a1.11": -0.5}
    np.testing.assert_array_equal(again.start(), est.start())
