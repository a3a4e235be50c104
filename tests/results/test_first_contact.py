"""What somebody types in the first minutes, and what it then shows: print, a notebook, an index, an order, a plant."""

import pickle

import numpy as np
import pytest

import driftwise as dw
from driftwise.models.markup import markup


@pytest.fixture(scope="module")
def record():
    return dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)


@pytest.fixture(scope="module")
def trace(record):
    y, u = record
    return dw.ARX(1, 1).scan(y, u)


def test_a_summary_prints_its_sentences(trace):
    s = trace.summary()
    assert str(s) == s.words and "object at 0x" not in repr(s)
    assert "300 samples of ARX(" in repr(s)
    y = np.column_stack([trace.y, trace.y[::-1]])
    several = dw.ARXMIMO(2, 0, na=1, nb=0).scan(y).summary()
    assert str(several) == several.words and "object at 0x" not in repr(several)


def test_an_observer_prints_its_sentences():
    plant = dw.Plant([[0, 1], [0, 0]], [0, 1])
    s = dw.WindowObserver(plant, window=20, dt=0.1, noise_std=0.1, disturbances=(), hold="zoh").scan(
        np.zeros(50), np.zeros(50)
    )
    assert str(s.summary()) == s.summary().words and "object at 0x" not in repr(s.summary())
    assert "<p>" in s._repr_html_()


def test_a_notebook_shows_sentences_and_parameters(trace):
    for shown in (trace, trace.summary()):
        html = shown._repr_html_()
        assert trace.summary().words.split(".")[0] in html and "<td>a1</td>" in html
    assert "<td>b1</td>" in trace.model()._repr_html_()
    assert f"{trace.model().values[0]:.6g}" in trace.model()._repr_html_()


def test_names_are_no_markup():
    html = markup("one\ntwo < three", [("<b>x</b>", 1.0, 0.25)])
    assert html.startswith("<p>one</p><p>two &lt; three</p><table>")
    assert "<td>&lt;b&gt;x&lt;/b&gt;</td><td>1</td>" in html


def test_the_index_of_pandas_comes_back(record):
    pd = pytest.importorskip("pandas")
    y, u = record
    hours = pd.date_range("2024-03-01", periods=len(y), freq="h")
    trace = dw.ARX(1, 1).scan(pd.Series(y, hours), pd.Series(u, hours))
    frame = trace.to_frame()
    assert frame.index.equals(hours) and frame.loc[hours[7], "y"] == y[7]
    names = pd.Index([f"sample {i}" for i in range(len(y))])
    assert dw.Joint(1, 1).scan(pd.Series(y, names), u).to_frame().index.equals(names)
    plain = dw.ARX(1, 1).scan(y, u).to_frame()
    assert plain.index.equals(pd.RangeIndex(len(y)))
    pd.testing.assert_frame_equal(plain, frame.reset_index(drop=True))
    assert dw.ARX(1, 1).scan(list(y), list(u)).index is None  # a list has an index too: a method


def test_a_simulated_record_is_no_array(trace):
    made = trace.model().simulate(trace.u)
    for wrong in (lambda: trace.y - made, lambda: made - trace.y, lambda: np.asarray(made), lambda: trace.y + made):
        with pytest.raises(dw.InputError, match=r"take its \.y"):
            wrong()
    y, u = made
    assert (trace.y - made.y).shape == trace.y.shape and np.array_equal(y, made.y) and u is made.u
    again = pickle.loads(pickle.dumps(made))
    assert np.array_equal(again.y, y)


@pytest.mark.parametrize(
    "n, word",
    [(1, "A first"), (2, "A second"), (4, "A 4th"), (8, "An 8th"), (11, "An 11th"), (12, "A 12th"), (13, "A 13th"),
     (18, "An 18th"), (21, "A 21st"), (32, "A 32nd"), (63, "A 63rd"), (80, "An 80th"), (111, "A 111th")],
)  # fmt: skip
def test_orders_in_words(n, word):
    from driftwise.results.numbers import article, ordinal

    assert f"{article(n)} {ordinal(n)}" == word


def test_an_order_of_twenty_two_is_not_the_22th(record):
    y, _ = record
    assert "A 22nd-order model" in dw.AR(22).scan(np.tile(y, 3)).summary().words


@pytest.mark.parametrize(
    "matrices", [(lambda x: x,), ([[0.0]], lambda x: x), ([[0.0]], [1.0], np.sin), ("[[0, 1], [0, 0]]",)]
)
def test_a_plant_is_matrices(matrices):
    with pytest.raises(dw.InputError, match=r"[ABC] must be a matrix of numbers, got (a function|text)"):
        dw.Plant(*matrices)
    with pytest.raises(TypeError):
        dw.Plant()


@pytest.mark.parametrize("memory", [dw.ExponentialForgetting, dw.memory.DirectionalForgetting])
def test_one_weight_for_each_parameter_is_answered_with_what_does_it(memory, record):
    with pytest.raises(dw.InputError, match=r"one weight for all parameters, got \[0.99, 0.95\].*RandomWalk\(\[q"):
        dw.ARX(1, 1, memory=memory([0.99, 0.95]))
    dw.ARX(1, 1, memory=dw.RandomWalk([1e-4, 1e-6])).scan(*record)


def test_a_plant_stays_a_named_tuple():
    plant = dw.Plant([[0, 1], [0, -2]], [0, 3], [1, 0], states=("angle", "speed"))
    assert pickle.loads(pickle.dumps(plant)) == plant and plant._replace(states=None).states is None
    assert repr(plant).startswith("Plant(A=") and plant._fields[:4] == ("A", "B", "C", "D")
