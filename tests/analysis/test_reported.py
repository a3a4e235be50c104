"""What an identification says of its own numbers: which forecast is quoted, which changes are told."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import driftwise as dw
from driftwise.analysis.change_log import Change, surest
from driftwise.analysis.forecast_summary import ForecastSummary, Own


def plant(samples=800, noise=0.05, rest=0, seed=1):
    """Return input and output of a first-order plant, at rest for so many samples."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([0.0, 1.0, 2.0], samples // 4), 4)
    u[:rest] = 0.0
    y = np.zeros(samples)
    for t in range(1, samples):
        y[t] = 0.8 * y[t - 1] + 0.2 * u[t - 1] + noise * rng.standard_normal()
    return u, y


@pytest.fixture(scope="module")
def found():
    u, y = plant()
    return dw.identify({"valve": u, "level": y})


def summary(like, errors: float) -> ForecastSummary:
    """Return a summary of forecasts whose errors are so many times as large."""
    own = Own(like)
    own.innovation = errors * own.innovation
    return ForecastSummary(30).add(own)


# --- the forecast that is quoted -------------------------------------------------------------------------------


def test_a_forecast_worse_than_the_last_value_is_not_the_one_that_is_quoted(found):
    worse = summary(found.trace, 10.0)
    told = dataclasses.replace(found, forecast_summary=worse)
    assert min(found.naive.values()) < worse.rmse and found.own_summary.rmse < min(found.naive.values())
    assert told.quoted is told.own_summary and told.is_useful
    assert told.answer.startswith("All models together forecast worse than the last value")
    assert f"{told.own_summary.fit:.1f} % of the movement" in told.words
    assert f"{worse.fit:.1f} % of the movement" not in told.words
    assert found.quoted is found.forecast_summary and "worse than" not in found.words


def test_a_forecast_clearly_worse_than_that_of_the_named_model_is_not_the_one_that_is_quoted(found):
    """The words name a model; their forecast is no worse than what it has shown."""
    worse, hardly = summary(found.trace, 1.05), summary(found.trace, 1.01)
    told = dataclasses.replace(found, forecast_summary=worse)
    assert worse.rmse < min(found.naive.values()) and told.quoted is told.own_summary
    assert f"{told.own_summary.fit:.1f} % of the movement" in told.words and "worse than" not in told.words
    assert not dataclasses.replace(found, forecast_summary=hardly).is_alone


def test_where_no_forecast_beats_the_last_value_no_model_is_offered(found):
    worse = summary(found.trace, 10.0)
    told = dataclasses.replace(found, forecast_summary=worse, own_summary=summary(found.trace, 9.0))
    assert not told.is_useful and told.answer.startswith("No forecast of level can be relied on")
    assert f"{told.own_summary.rmse:.3g} off" in told.answer
    blind = dataclasses.replace(told, effects=told.effects._replace(error=1.0))
    assert "Gain" in told.answer and "Gain" not in blind.answer  # of the response in hindsight, where that is any good


def test_the_page_and_the_terminal_show_the_numbers_of_the_words(found, tmp_path, capsys):
    from driftwise.report.terminal import show_identification

    told = dataclasses.replace(found, forecast_summary=summary(found.trace, 10.0))
    told.report(tmp_path / "page.html")
    show_identification(told, title="plant", taken=0.1, notes=[])
    fit = f"{told.own_summary.fit:.1f}"
    page, said = (tmp_path / "page.html").read_text(), capsys.readouterr().out
    assert f">{fit} <small>" in page and f"{fit} %" in said and f"{told.forecast_summary.fit:.1f} %" not in said


def test_the_size_that_is_printed_is_the_one_that_is_judged(found):
    for one in (found.forecast_summary, found.own_summary):
        assert one.verdicts.find("NIS").value == pytest.approx(one.nis)


def test_the_deviates_of_a_single_model_are_standard_normal(found):
    z = Own(found.trace).normal_score[50:]
    assert abs(z.mean()) < 0.15 and 0.85 < z.std() < 1.1
    assert np.corrcoef(z, found.trace.innovation[50:])[0, 1] > 0.95


# --- modes -----------------------------------------------------------------------------------------------------


def test_a_mode_that_is_over_before_it_swings_is_a_decay(found):
    from driftwise.analysis.claims import _mode
    from driftwise.results.stable import is_integrator, swings

    def said(p, std, angle):
        return " ".join(claim.text for claim in _mode(p, std, angle, found.table))

    fast = 0.66 + 0.06j  # half a swing takes 35 samples, after 8 a twentieth is left
    assert not swings(fast)
    assert said(fast, 0.06, 0.02).startswith("Time constant 2.43 samples (a pair of poles)")
    slow = 0.9 + 0.2j
    assert swings(slow)
    assert "dies out with time constant 12.3 samples" in said(slow, 0.001, 0.001)
    assert not is_integrator(0.7173, 0.2)
    assert is_integrator(0.98, 0.02)
    uncertain = 0.7 + 0.3j  # but it is gone in four samples
    assert "dies out" in said(uncertain, 0.2, 0.02)
    assert said(uncertain, 0.2, 0.2) == "", "its period is not known"


def test_the_period_of_a_mode_is_told_with_where_it_lies():
    from driftwise.results.stable import turns

    rng, inside, spreads = np.random.default_rng(6), 0, []
    for _ in range(60):
        e = rng.normal(size=700)
        y = np.zeros(700)
        for k in range(2, 700):
            y[k] = 1.7 * y[k - 1] - 0.95 * y[k - 2] + e[k]
        trace = dw.AR(2).scan(y)
        model, angle = trace.model(), np.angle(0.85 + 1j * np.sqrt(0.95 - 0.85**2))
        i = int(np.argmax(np.asarray(model.poles).imag))
        spreads.append(turns(model, 1.0)[i])
        inside += abs(np.angle(model.poles[i]) - angle) < 1.96 * spreads[-1]
    assert 52 <= inside, f"{inside} of 60"  # below at a chance of .008
    assert np.mean(spreads) < 0.05


def test_the_bar_of_a_modulus_is_the_same_everywhere():
    from driftwise.results.stable import moduli

    y, u = dw.simulate([-1.6, 0.68], [1.0, 0.5], samples=300, noise_std=0.3, seed=1)
    s = dw.ARX(2, 2).scan(y, u).summary()
    (_, spread), _ = s.moduli
    assert spread == pytest.approx(moduli(s.model, 1.0)[1][0]) and spread < s.poles[0][1]


# --- changes ---------------------------------------------------------------------------------------------------


def change(since: int, odds: float, moved="the level fell by 1") -> Change:
    return Change(since, float(since), (since - 1, since + 2), (since - 1.0, since + 2.0), odds, moved)


MANY = [change(10 * k, odds=150.0 + k) for k in range(30)]
MANY[25], MANY[27] = change(250, odds=11149.0), change(270, odds=9000.0, moved="the level rose by 2.5")


def test_the_surest_changes_are_kept_in_order_of_time():
    kept = surest(MANY)
    assert len(kept) == 20 and {MANY[25], MANY[27]} < set(kept)
    assert [c.since for c in kept] == sorted(c.since for c in kept)
    assert [c.since for c in surest(MANY, 2)] == [250, 270]


def test_the_surest_changes_are_told_and_the_last_is_the_last(found, tmp_path):
    told = dataclasses.replace(found, changes=surest(MANY), alarms=30, last=MANY[-1])
    assert "At sample 270 (sample 269 to sample 272) the level rose by 2.5 (odds 9000:1)." in told.answer
    assert "At sample 250" in told.answer and "There are 27 more changes." in told.answer
    page = Path(told.report(tmp_path / "page.html")).read_text()
    assert "last 290" in page and "the surest 20 of 30" in page and ">30</div>" in page


def test_the_first_movement_of_a_plant_is_no_change_of_it():
    """Before it nothing is known but the level: what the parameters have there is the prior."""
    u, y = plant(600, noise=0.0, rest=200)
    found = dw.identify({"valve": u, "level": np.round(y, 3)}, output="level", input="valve")
    assert all(abs(change.since - 200) > 10 for change in found.changes) and "from 0 to" not in found.answer


# --- numbers ---------------------------------------------------------------------------------------------------


def test_numbers_that_nobody_reads_are_words():
    from driftwise.analysis.forecast_verdicts import off
    from driftwise.results.numbers import odds_words
    from driftwise.results.verdicts import Verdict

    assert off(1.0404) == "2 % too narrow" and off(0.25) == "50 % too wide"
    assert off(1e4) == "too narrow by a factor of 100" and "e+" not in off(1e20)
    assert odds_words(53.2) == "53:1" and odds_words(1e9) == "beyond a million to one"
    assert Verdict("NIS", 3.1e6, (0.8, 1.25), False, "").shown == "> 1 million"
