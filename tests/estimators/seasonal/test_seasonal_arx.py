"""A season beside a difference equation: what it forecasts, and that it is an estimator like any other."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.analysis.laws import LAWS, example
from driftwise.engine.errors import InputError
from driftwise.estimators import SeasonalARX

COMPILED = {"law_compiled_equals_plain", "law_fleet_of_known_sizes"}  # of estimators that are one compiled step
KINDS = {
    "a season": SeasonalARX(2, season=4, offset=True),
    "two seasons, inputs": SeasonalARX(1, (2, 1), (1, 0), season=(4, 12), gain=0.1, memory=dw.AutoMemory()),
    "forgets": SeasonalARX(1, 1, 1, season=5, memory=dw.ExponentialForgetting(0.98)),
}


@pytest.mark.parametrize("name", KINDS)
def test_it_obeys_the_laws(name):
    est = KINDS[name]
    for law in LAWS:
        if law.__name__ not in COMPILED:
            law(est, *example(est))


def months(T=240, noise=0.2, seed=3):
    """Return a record with a season of twelve, and the season."""
    rng = np.random.default_rng(seed)
    season = np.resize(2 * rng.standard_normal(12), T)
    return season + noise * rng.standard_normal(T), season


def test_the_last_season_is_a_regressor():
    """With gain 1 and without other lags it is the regression on y[t-s] that anyone can write down."""
    y, _ = months()
    seasonal = SeasonalARX(0, season=12, lags=1).scan(y)
    past = np.concatenate([np.zeros(12), y[:-12]])
    plain = dw.ARX(0, 1, 0).scan(y, past)
    assert np.allclose(seasonal.prediction, plain.prediction, rtol=0, atol=1e-12)


def test_the_mean_of_seasons_has_less_noise():
    y, _ = months()
    last, mean = (SeasonalARX(0, season=12, gain=gain).scan(y).innovation[60:].std() for gain in (1.0, 0.05))
    assert mean < 0.85 * last


def test_a_forecast_of_two_seasons_has_them():
    y, season = months(244)
    est = SeasonalARX(1, season=12, gain=0.1, offset=True)
    mean, std = est.predict(est.scan(y[:220]).state, horizon=24)
    assert np.abs(mean - season[220:]).max() < 0.5 and np.all(std > 0)


def test_a_forecast_is_what_a_run_over_missing_samples_says():
    y, _ = months()
    est = SeasonalARX(2, season=12)
    state = est.scan(y).state
    assert np.allclose(est.predict(state, horizon=12)[0], est.scan(np.full(12, np.nan), state=state).prediction)


def test_where_samples_are_missing_the_season_stays():
    y, season = months()
    y[100:130] = np.nan
    trace = SeasonalARX(1, season=12, gain=0.1).scan(y)
    assert np.abs(trace.prediction[100:130] - season[100:130]).max() < 0.6


def test_it_is_saved_and_goes_on(tmp_path):
    y, _ = months()
    est = KINDS["a season"]
    whole, first = est.scan(y), est.scan(y[:101])
    dw.save_state(est, first.state, tmp_path / "state.json")
    again, state = dw.load_state(tmp_path / "state.json")
    assert np.array_equal(again.scan(y[101:], state=state).prediction, whole.prediction[101:])


def test_a_poisoned_season_is_learnt_anew():
    y, _ = months()
    est = KINDS["a season"]
    state = est.scan(y[:100]).state.copy()
    state["profile"] = np.nan
    assert np.isfinite(est.scan(y[100:], state=state).prediction[-60:]).all()


@pytest.mark.parametrize("season", [1, 0, (), (12, 12), 2.5, 10**7])
def test_what_is_no_season_is_refused(season):
    with pytest.raises(InputError, match="season"):
        SeasonalARX(1, season=season)
