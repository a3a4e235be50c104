"""A model that was chosen is chosen again when it predicts otherwise than it says, whatever is killed meanwhile."""

import json

import numpy as np
import pytest

import driftwise as dw
from driftwise.live.choosing import Choice
from driftwise.live.config import parse
from driftwise.live.core import Core
from driftwise.live.decode import Chunk
from driftwise.live.fit import ASKED, COLLECTED, LAGS, Fit
from driftwise.live.sources.base import Parcel
from driftwise.live.store.sqlite import SqliteStore

NOW, CHANGE, SAMPLES, WINDOW = 2e9, 600, 1600, 200


def plant(seed=3):
    """Return outputs of a first order that becomes a resonance, about a level."""
    e = np.random.default_rng(seed).standard_normal(SAMPLES)
    y = np.zeros(SAMPLES)
    for t in range(2, SAMPLES):
        y[t] = (0.7 * y[t - 1] if t < CHANGE else 1.6 * y[t - 1] - 0.9 * y[t - 2]) + e[t]
    return y + 50.0


def opened(folder):
    config = parse(f'[model]\nidentify = {WINDOW}\n[store]\npath = "{folder}"\n')
    return Core(config, SqliteStore(folder), None)


def fed(folder, y, kill=0.0, seed=1):
    """Let a service take a record, killed as often as said; return it and all that it told."""
    rng, core, at, told = np.random.default_rng(seed), opened(folder), 0, []
    kills = 0
    while at < len(y):
        last = min(at + int(rng.integers(1, 60)), len(y))
        chunk = Chunk("p", [1e9 + t for t in range(at, last)], {"value": y[at:last].tolist()})
        told += core.take([Parcel([chunk], None, ("file", last), ())], NOW)
        at = last
        if rng.random() < 0.5 and (series := core.choosing.asking()) is not None:
            choice = core.choosing.choose(series)
            if rng.random() > kill:
                told += core.chosen(series, choice)
        if rng.random() < 0.7:
            core.commit()
        if rng.random() < kill:
            core.store.close()
            core, kills = opened(folder), kills + 1
            at = core.places.get("file", 0)
    core.commit()
    return core, core.store.events(0, None), kills


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    return fed(tmp_path_factory.mktemp("once"), plant())


def test_a_plant_that_becomes_another_gets_another_model(once):
    core, events, _ = once
    first, second = (event for event in events if event.kind == "model")
    assert "predicts otherwise than it says" in first.sentence and "whiteness" in first.sentence
    assert CHANGE + WINDOW <= first.time - 1e9 + 1 <= CHANGE + 3 * WINDOW
    assert "takes the place of" in second.sentence and second.time >= first.time + WINDOW
    series = core.series["p"]
    assert second.sentence.startswith(core.roster.model(series))
    rows = core.roster.groups[series.group]
    assert [len(group.fleet) for group in core.roster.groups] == [0, 1]
    # its state is that of a fleet of that model on all samples since the diagnosis
    est, y = rows.fleet.estimators[0], plant()[int(first.time - 1e9) + 1 :]
    level = rows.intake.levels[0][0, 0]
    assert level == pytest.approx(y[:32].mean())
    fleet = dw.Fleet(rows.fleet.estimator_of("p"), ["p"])
    fleet.update_batch(["p"], y[:1] - level)
    for value in y[1:]:
        fleet.update_batch(["p"], [value - level])
    assert rows.fleet.state("p").tobytes() == fleet.state("p").tobytes(), est
    # and nothing was told or kept twice
    history = np.concatenate([some for _, some in core.history.recent])
    assert sorted(history[:, 1].tolist()) == [1e9 + t for t in range(SAMPLES)]
    assert core.picture.columns["count"][series.slot] == SAMPLES


def test_whatever_is_killed(once, tmp_path):
    core, events, kills = fed(tmp_path, plant(), kill=0.15)
    assert kills > 3
    ours, theirs = ({one.key: one for one in some.series.values()} for some in (core, once[0]))
    states = [
        some.roster.groups[one["p"].group].fleet.state("p").tobytes() for some, one in ((core, ours), (once[0], theirs))
    ]
    assert states[0] == states[1]
    # that it stays told: what and when it was asked; when the answer came may differ
    found = [next((event.kind, event.time) for event in some if event.kind == "model") for some in (events, once[1])]
    assert found[0] == found[1]
    core.store.close()
    again = opened(tmp_path)
    assert again.roster.model(again.series["p"]) == once[0].roster.model(once[0].series["p"])
    assert again.picture.columns["count"][0] == SAMPLES


def test_one_that_is_no_better_does_not_take_its_place(tmp_path):
    y, core = np.concatenate([plant(), plant()[CHANGE:]]), opened(tmp_path)
    at = 0

    def feed(last):
        nonlocal at
        events = core.take(
            [Parcel([Chunk("p", [1e9 + t for t in range(at, last)], {"value": y[at:last].tolist()})])], NOW
        )
        at = last
        return events

    feed(WINDOW)
    series = core.choosing.asking()
    core.chosen(series, Choice("AR(1), chosen by 200 samples", lambda: dw.AR(1, offset=True), np.nan))
    assert not core.choosing.series
    worse = "AR(5), chosen by 200 samples"
    asked = []
    for patience in (2.0, 4.0):
        while not core.choosing.series:
            feed(at + 20)
        asked.append(at)
        feed(at + WINDOW)
        series = core.choosing.asking()
        fit = core.roster.groups[0].fit
        assert fit["patience"][0] == patience and fit["score"][0] < 0
        (event,) = core.chosen(series, Choice(worse, None, float(fit["score"][0]) - 1.0))
        assert event.sentence == f"the model stays AR(1), chosen by 200 samples: {worse}, predicts no better"
        core.commit()
        core.store.close()
        core = opened(tmp_path)
        assert not core.choosing.series and core.series["p"].samples == []
    assert asked[1] == asked[0] + 2 * WINDOW, "a window to choose by, and one of rest"
    while not core.choosing.series and at < len(y):
        feed(at + 20)
    assert core.choosing.series and at == asked[1] + 3 * WINDOW, "of rest are two now"


def outs(e, variance=1.0):
    """Return what a fleet shows of samples whose errors are these."""
    return np.column_stack([np.zeros(len(e)), e, np.full(len(e), variance), np.zeros(len(e))])


@pytest.mark.parametrize(
    ("size", "pole", "told"), [(1.0, 0.0, False), (1.3, 0.0, True), (0.8, 0.0, True), (1.0, 0.5, True)]
)
def test_what_is_no_fit(size, pole, told):
    """Errors of the wrong size, or that follow from those before; however the samples are cut."""
    rng = np.random.default_rng(8)
    e = rng.standard_normal(5000)
    for t in range(1, len(e)):
        e[t] = pole * e[t - 1] + np.sqrt(1 - pole**2) * e[t]
    whole, cut = Fit(500), Fit(500)
    found = whole.take(np.zeros(5000, int), outs(size * e))
    parts = np.split(size * e, np.sort(rng.integers(0, 5000, 40)))
    assert np.concatenate([cut.take(np.zeros(len(part), int), outs(part)) for part in parts]).tolist() == found.tolist()
    assert cut.table.tolist() == whole.table.tolist()
    asked = np.flatnonzero(found == ASKED)
    assert asked.tolist() == ([999] if told else [])
    assert (found[1000:] == COLLECTED).all() == told
    assert len(whole.names) == 9 + 2 * LAGS


def test_a_jump_or_a_glitch_is_no_other_model():
    e = np.random.default_rng(9).standard_normal(20_000)
    e[::400] = 60.0
    e[::4000] = -1e6
    assert not Fit(500).take(np.zeros(len(e), int), outs(e)).any()


def test_sound_models_are_asked_for_seldom():
    """Of three hundred series with true error bars, each of twenty windows, hardly one is asked for."""
    rng = np.random.default_rng(10)
    fit = Fit(500)
    at = np.repeat(np.arange(300), 10_000)
    assert np.count_nonzero(fit.take(at, outs(rng.standard_normal(len(at)))) == ASKED) <= 2


def test_words_are_those_of_the_limits():
    fit = Fit(100)
    fit.take(np.zeros(200, int), outs(3.0 * np.random.default_rng(1).standard_normal(200)))
    low, high, most = fit.fine
    assert f"NIS {fit['nis'][0]:.3g}, fine {low:.3g} to {high:.3g}" in fit.words(0)
    assert json.dumps(fit.words(0)) and 0.6 < low < 0.8 and high > 1.25 and most > 0.1
