"""Seasons that the clock suggests compete in `identify`: they help where they are, and cost nothing where not."""

import numpy as np
import pytest
from driftwise_studies.score.seasonal_worlds import WORLDS

import driftwise as dw
from driftwise.analysis import seasons
from driftwise.analysis.candidates import candidates
from driftwise.analysis.identifier import Identifier
from driftwise.engine.errors import InputError
from driftwise.tables import autoread


def world(kind, seed):
    """Return y and the seasons of a drawn record."""
    y, _, of = WORLDS[kind](np.random.default_rng(seed))
    return y, of


def error(y, of=()):
    """Return the mean squared error of the second half."""
    return float(np.nanmean(Identifier(0, 1.0, of).add(y).innovation[len(y) // 2 :] ** 2))


@pytest.mark.parametrize(
    "kind, most", [("steady_months", 0.8), ("growing_months", 0.7), ("moving_months", 0.5), ("days", 0.9)]
)
def test_squared_errors_are_smaller_with_the_season(kind, most):
    drawn = [world(kind, seed) for seed in range(6)]
    assert np.mean([np.log(error(y, of) / error(y)) for y, of in drawn]) < np.log(most)


@pytest.mark.parametrize("kind", ["no_months", "no_days"])
def test_a_season_that_is_none_costs_nothing(kind):
    drawn = [world(kind, seed) for seed in range(8)]
    assert np.mean([np.log(error(y, of) / error(y)) for y, of in drawn]) < np.log(1.005)


def test_no_forecast_uses_a_later_sample():
    y, of = world("steady_months", 1)
    other = y.copy()
    other[150:] = 1000.0 - other[150:]
    a, b = (Identifier(0, 1.0, of).add(x).prediction for x in (y, other))
    assert np.array_equal(a[:151], b[:151])


def test_a_piece_goes_on_from_the_one_before():
    y, of = world("hours", 2)
    none = np.empty((1000, 0))
    one, two = Identifier(0, 1.0, of), Identifier(0, 1.0, of)
    for identifier in (one, two):
        identifier._begin(y[:600], none[:600])
    parts = [two._scan(y[at], none[at]).prediction for at in (slice(0, 417), slice(417, 1000))]
    assert np.array_equal(np.concatenate(parts), one._scan(y[:1000], none).prediction)


def test_what_a_clock_suggests():
    day = 86_400.0
    assert seasons.of_clock(30.44 * day) == (12,) and seasons.of_clock(91.3 * day) == (4,)
    assert seasons.of_clock(3600.0) == (24, 168) and seasons.of_clock(day) == (7,)
    assert seasons.of_clock(900.0) == (96, 672) and seasons.of_clock(60.0) == seasons.of_clock(7 * day) == ()
    assert seasons.held((24, 168), 300) == (24,)


def written(path, y):
    """Write months and passengers."""
    stamps = [f"{1990 + i // 12}-{i % 12 + 1:02d}" for i in range(len(y))]
    path.write_text("month,passengers\n" + "\n".join(f"{at},{value:.2f}" for at, value in zip(stamps, y)))
    return str(path)


def test_months_have_a_year_and_the_words_say_so(tmp_path):
    y, _ = world("growing_months", 4)
    found = dw.identify(written(tmp_path / "air.csv", y))
    assert found.chosen.candidate.seasons == (12,)
    assert "A season of 12 samples (a year) takes" in found.answer
    claim = next(claim for claim in found.claims if claim.kind == "season")
    best = min(rival.rmse for rival in found.rivals if not rival.candidate.seasons)
    assert claim.value == pytest.approx(1 - (found.chosen.rmse / best) ** 2)
    ahead, std = found.predict(horizon=24)
    assert np.isfinite(ahead).all() and np.all(std > 0)
    _, step = found.update(found.trace.state, float(y[-12]))
    assert abs(step.prediction - ahead[0]) < 1e-9 * abs(ahead[0])
    assert "A season of 12" in found.report(tmp_path / "page.html").read_text(encoding="utf-8")
    assert dw.identify(tmp_path / "air.csv", season=()).chosen.candidate.seasons == ()


def test_without_a_clock_it_may_be_said():
    y, _ = world("steady_months", 1)
    assert not dw.identify({"y": y}).chosen.candidate.seasons
    found = dw.identify({"y": y}, season=12)
    assert found.chosen.candidate.seasons == (12,) and "(a year)" not in found.answer
    with pytest.raises(InputError, match="season"):
        dw.identify({"y": y}, season=1)


def test_a_season_may_stand_beside_inputs():
    rng = np.random.default_rng(0)
    y, of = world("steady_months", 3)
    u = rng.standard_normal(len(y))
    y = y + 3 * np.concatenate([[0.0], u[:-1]])
    identifier = Identifier(1, 1.0, of)
    identifier.add(y, u[:, None])
    assert identifier.chosen.candidate.seasons == of


def test_names_of_candidates_are_different():
    names = [c.name for c in candidates(2, samples=1000, seasons=(24, 168))]
    assert len(set(names)) == len(names) and "SeasonalARX(3,3,0; last 24, 168)" in names


def test_working_days_have_no_week_of_seven():
    days = np.datetime64("2020-01-06") + np.arange(280)
    days = days[np.arange(280) % 7 < 5]
    table, _ = autoread.read({"date": days.astype("datetime64[s]"), "price": np.random.default_rng(3).normal(size=200)})
    assert table.sampling.rest is not None
    assert seasons.of_table(table) == ()


def test_no_mode_is_told_of_what_a_season_leaves():
    rng, t = np.random.default_rng(7), np.arange(289)
    cloud = np.full(289, 0.8)
    for k in range(1, 289):
        cloud[k] += 0.97 * (cloud[k - 1] - 0.8) + 0.03 * rng.normal()
    sun = np.maximum(0, 0.1 - np.cos(2 * np.pi * t / 48)) * cloud
    found = dw.identify({"time": np.datetime64("2021-05-01T00:00") + 30 * t, "sun": np.round(sun, 4)})
    assert found.chosen.candidate.seasons == (48,)
    assert not {claim.kind for claim in found.claims} & {"pole", "time constant"}
