"""Seasons in records that are long enough for most candidates to be left on the way."""

import numpy as np

import driftwise as dw
from driftwise.analysis import identifier


def hours(seed, inputs=0):
    """Return a table of hours with a day and a week, and columns that share the day."""
    rng = np.random.default_rng(seed)
    t = np.arange(4000)
    day, week = np.sin(2 * np.pi * t / 24) + 0.5 * np.sin(4 * np.pi * t / 24 + 1), (t // 24 % 7 < 5) * 1.0
    return {
        "time": np.datetime64("2024-01-01") + t * np.timedelta64(1, "h"),
        "load": 100 + 20 * day + 30 * week * (1 + day) + rng.standard_normal(len(t)),
    } | {f"u{j}": 5 * day + rng.standard_normal(len(t)) for j in range(inputs)}


def test_a_season_is_compared_with_the_best_model_without_one(monkeypatch):
    """Where every likely candidate has a season, one without is kept."""
    monkeypatch.setattr(identifier, "NARROW", 2000)
    found = dw.identify(hours(3), output="load", time="time")
    assert found.chosen.candidate.seasons == (24, 168)
    assert any(not rival.candidate.seasons for rival in found.rivals)
    assert "off the error variance of the best model without any" in found.words
