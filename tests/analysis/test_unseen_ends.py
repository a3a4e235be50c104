"""Where the end of an answer is not seen, a slower plant and one that answers less are told as either."""

from types import SimpleNamespace

import numpy as np
from driftwise_studies.score.claims.checking import is_told
from driftwise_studies.score.claims.plant import Jump as Drawn

from driftwise.analysis.change_log import ChangeLog
from driftwise.analysis.readings import all_gains, endless
from driftwise.analysis.segmentation import hindsight


def filling(seed, tau, samples=900, at=500, factor=2.3, noise=0.5):
    """Return y, u of a plant with two inputs; both gains are multiplied at a sample."""
    rng, p = np.random.default_rng(seed), np.exp(-1 / tau)
    u = np.repeat(rng.uniform(-1, 1, (samples // 15, 2)), 15, axis=0)
    y = np.zeros(samples)
    for t in range(1, samples):
        y[t] = p * y[t - 1] + (1 - p) * (factor if t >= at else 1.0) * u[t - 1].sum()
    return y + noise * np.diff(y).std() * rng.standard_normal(samples), u


def test_a_store_whose_gains_all_rise_is_told_as_either():
    y, u = filling(1, tau=1500.0)
    log = ChangeLog(["valve", "pump"])
    log.add(y, u, np.arange(900.0))
    assert endless(log.hindsight.response) == [True, True]
    (change,) = log.changes
    assert abs(change.since - 500) < 4
    assert change.moved.startswith(
        "the plant's response changed: the plant became faster, its time constants 0.435 times"
    )
    assert change.moved.endswith(", or all gains rose to 2.3 of what they were; the record cannot tell which")


def test_no_other_reading_where_ends_are_seen():
    seen = hindsight(*filling(3, tau=8.0))
    assert endless(seen.response) == [False, False]
    assert not all_gains(seen.response.with_speed(500), 0, SimpleNamespace(at=500, calm=1.0))


def test_the_judge_takes_either_reading_of_the_input_it_names():
    words = "the plant's response changed: the plant became faster, its time constants 0.5 times as long, or {} doubled"
    claim = {"kind": "change", "value": 400, "subject": words.format("the gain from valve")}
    plant = SimpleNamespace(jumps=(Drawn("gain", 401, 2.0, 0), Drawn("gain", 401, 2.0, 1), Drawn("lag", 401, 0.5)))
    case = SimpleNamespace(plant=plant, dt=1.0, tolerance=9.0, written=SimpleNamespace(inputs=("valve", "heater")))
    assert [is_told(case, k, claim) for k in range(3)] == [True, False, True]
    every = claim | {"subject": words.format("all gains")}
    assert [is_told(case, k, every) for k in range(3)] == [True, True, True]
