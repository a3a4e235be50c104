"""What stands still: told from what moves, and from an object at rest once the errors of the sensor are known."""

import math

import numpy as np
import pytest
from scipy.stats import multivariate_t

from driftwise.tracking.live import TENTATIVE
from driftwise.tracking.plots import plots
from driftwise.tracking.stillness import BASE, SCORE, Errors, moving
from driftwise.tracking.tracker import Tracker


def test_a_thing_is_students_t_in_two_dimensions():
    rng = np.random.default_rng(1)
    rows = np.zeros((9, 200))
    rows[:, 1:3] = rng.normal(0, 3.0, (9, 2))
    rows[:, SCORE], rows[:, BASE] = rng.normal(-3, 1, (9, 2)), 1.0
    still = 0.0
    for n in range(2, 9):
        past = rows[:n, 1:3]
        variance = np.sum((past - past.mean(axis=0)) ** 2) / (2 * n - 2)
        t = multivariate_t(past.mean(axis=0), variance * (1 + 1 / n) * np.eye(2), df=2 * n - 2)
        still += t.logpdf(rows[n, 1:3])
    assert moving(rows) == pytest.approx(rows[2:, SCORE].sum() - still, rel=1e-9)
    assert moving(rows[:2]) == 0.0


def scene(spread, seed=0, scans=60):
    """Two boats that cross a field, and something in the middle of it that a radar sees as often, with this error."""
    rng, time = np.random.default_rng(seed), 3.0 * np.arange(scans)
    boats = [np.stack([100 + 5 * time, y + 0 * time], axis=1) + rng.normal(0, 3.0, (scans, 2)) for y in (200.0, 700.0)]
    middle = np.array([500.0, 450.0]) + rng.normal(0, spread, (scans, 2))
    parts = [(time, p) for p in (*boats, middle)]
    when = np.concatenate([t for t, _ in parts])
    order = np.argsort(when, kind="stable")
    return plots(when[order], np.concatenate([p for _, p in parts])[order])


@pytest.mark.parametrize("spread, least, most", [(3.0, 12, 12), (30.0, 8, 9)])
def test_at_rest_is_an_object_that_scatters_as_the_sensor_errs_and_what_scatters_more_is_none(spread, least, most):
    tracks = 0
    for seed in range(4):
        tracker = Tracker("boat")
        tracker.feed(scene(spread, seed))
        tracker.finish()
        tracks += len(tracker.tracks)
        assert np.mean(tracker.targets.existence.errors.seen[""]) == pytest.approx(math.log(9.0), abs=1.0)
    assert least <= tracks <= most  # two boats, and something at rest, four times


def test_errors_are_those_beside_the_variance_that_is_stated():
    tracker = Tracker("boat")
    tracker.feed(scene(3.0))
    live = next(iter(tracker.targets.live.values()))
    live.table, live.count = live.rows[:30].copy(), 30
    for stated in (math.nan, 36.0):
        live.table[:, [3, 6]] = stated
        errors = Errors()
        errors.note(live)
        factor = 1.0 if math.isnan(stated) else stated
        assert math.exp(errors.seen[""][0]) * factor == pytest.approx(9.0, rel=0.8)
        assert errors.resting(live) < -20.0  # it goes far


def test_a_track_that_is_not_sure_teaches_no_error():
    tracker = Tracker("boat")
    tracker.feed(scene(3.0))
    live, errors = next(iter(tracker.targets.live.values())), Errors()
    live.table, live.count, live.status = live.rows[:30].copy(), 30, TENTATIVE
    errors.note(live)
    assert not errors.seen and errors.resting(live) == 0.0
