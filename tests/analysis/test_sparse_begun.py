"""Where few samples follow each other a delay is no free number, and changes are looked for before all fits."""

import numpy as np
import pytest
from scipy.signal import lfilter

from driftwise.analysis.beginnings import before_any
from driftwise.analysis.response_orders import begin, plainest
from driftwise.analysis.response_record import recorded

SINCE, EVERY = 240, 6


def sparse(seed: int, T: int = 700):
    """Return y (T,), every sixth of it seen, whose level steps, and u (T, 3), the last two of which do nothing."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(size=(T // 20 + 1, 3)), 20, axis=0)[:T]
    y = lfilter([0, 0.03], [1, -0.97], u[:, 0]) + 0.2 * rng.normal(size=T)
    y[SINCE:] += 1.5
    y[np.arange(T) % EVERY > 0] = np.nan
    return y, u


def test_delays_of_inputs_that_do_nothing_are_short():
    """Free, they were the longest that fit best by chance, 10 samples on average."""
    delays = [begin(recorded(*sparse(seed))[0]).nk[1:] for seed in range(6)]
    assert np.mean(delays) < 7


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_a_step_is_seen_before_any_response_is_fitted(seed):
    """A response without it may have taken it for its answer."""
    places = before_any(plainest(recorded(*sparse(seed))[0]))
    assert any(kind == "level" and abs(at - SINCE) <= EVERY for at, kind, _ in places)
