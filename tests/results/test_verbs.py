"""The table of verbs names functions that are there, and says what has none."""

from importlib import import_module

import numpy as np
import pytest

import driftwise as dw
from driftwise.results.verbs import VERBS


@pytest.mark.parametrize("place", [place for kinds in VERBS.values() for place in kinds.values()])
def test_a_verb_is_a_function(place):
    module, _, name = place.partition(":")
    assert callable(getattr(import_module(f"driftwise.{module}"), name))


def test_a_result_without_the_verb_says_which_have_it():
    trace = dw.ModelAverage([dw.AR(1)]).scan(np.zeros(3))
    with pytest.raises(dw.InputError, match=r"no plot of AverageTrace: of ParameterTrace, .* there is"):
        trace.plot()


def test_traces_of_other_kinds_are_saved_too(tmp_path):
    y = np.random.default_rng(0).standard_normal(40)
    plots = np.cumsum(np.random.default_rng(1).standard_normal((20, 2)), axis=0)
    traces = dw.ModelAverage([dw.AR(1)]).scan(y), dw.TrackEstimator("uav").scan(np.arange(20.0), plots)
    for trace in traces:
        trace.save(tmp_path / "t.npz")
        back = dw.Trace.load(tmp_path / "t.npz")
        assert type(back) is type(trace) and back.columns().keys() == trace.columns().keys()
        assert all(np.array_equal(back.columns()[k], c, equal_nan=True) for k, c in trace.columns().items())
