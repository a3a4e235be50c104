"""Late plots of a track: bit for bit the ordered result, and what comes too late refused and counted."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import driftwise as dw
from driftwise.estimators.track.late import LatePlots


def flown(n=30, seed=1):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.5, 3.0, n))
    path = np.stack([150 * time, 2000 * np.cos(time / 20)], axis=1)
    R = rng.uniform(100, 2000, n)[:, None, None] * np.eye(2)
    return time, path + 30 * rng.standard_normal((n, 2)), R


@settings(deadline=None, max_examples=15)
@given(st.lists(st.floats(0, 8), min_size=30, max_size=30), st.booleans())
def test_what_comes_within_the_lag_gives_the_state_of_the_order_of_time(delays, stated):
    time, plots, R = flown()
    late = LatePlots(dw.TrackEstimator(), lag=10.0)
    state, came = late.start(), np.argsort(time + np.array(delays), kind="stable")
    for k in came:
        state, step = late.update(state, time[k], plots[k], R[k] if stated else None)
        assert step is not None
    whole = late.estimator.scan(time, plots, R if stated else None)
    assert late.state_of(state).tobytes() == whole.state.tobytes()
    assert state["refused"] == 0 and state["late"] == np.sum(np.maximum.accumulate(came) != came)


def test_what_comes_too_late_changes_nothing_and_is_counted():
    time, plots, _ = flown()
    late = LatePlots("aircraft", lag=5.0, plots=4)
    state = late.start()
    for k in range(30):
        if k not in (3, 27):
            state, _ = late.update(state, time[k], plots[k])
    before = late.state_of(state).tobytes()
    for when in (time[3], time[-1], time[10] + 0.01):  # beyond the lag; taken; before all that are kept
        state, step = late.update(state, when, plots[3])
        assert step is None
    assert state["refused"] == 3 and late.state_of(state).tobytes() == before
    state, step = late.update(state, time[27], plots[27])
    kept = np.delete(np.arange(30), 3)
    assert late.state_of(state).tobytes() == late.estimator.scan(time[kept], plots[kept]).state.tobytes()
    mean, _covariance = late.predict(state, time[-1] + 2)
    np.testing.assert_array_equal(mean, late.estimator.predict(late.state_of(state), time[-1] + 2)[0])


def test_says_no_in_words():
    late = LatePlots("boat", lag=5.0)
    with pytest.raises(dw.InputError, match="finite"):
        late.update(late.start(), np.nan, (0, 0))
    with pytest.raises(dw.InputError, match="another estimator"):
        late.update(late.estimator.start(), 0.0, (0, 0))
    with pytest.raises(dw.InputError, match="lag"):
        LatePlots("boat", lag=-1)
