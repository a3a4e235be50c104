"""Parameters that move steadily are told once, with their speed; those that rest or jump are not."""

import json

import numpy as np
import pytest
from live_plant import parcel

from driftwise.cli.live import estimator_of
from driftwise.live.config import parse
from driftwise.live.core import Core
from driftwise.live.decode import Chunk
from driftwise.live.drift import EVEN, FAR, LOOK, RUN, Drift
from driftwise.live.sources.base import Parcel
from driftwise.live.store.sqlite import SqliteStore


def told(values, std=0.01, step=10.0):
    """Return what is told of one parameter's estimates, a look each."""
    drift = Drift(["b1"])
    looks = enumerate(np.atleast_1d(values), 1)
    return [one for k, v in looks for one in drift.look(0, k * LOOK, k * step, np.array([v]), np.array([std]))]


def test_a_ramp_is_told_once_with_its_speed():
    found = told(1.0 + 0.02 * np.arange(200))
    assert len(found) == 1
    one = found[0]
    assert (one.value - one.begin) / (one.time - one.begin_time) == pytest.approx(0.002)
    assert one.text == "b1 drifts by +0.002 per s since 10 s (from 1 to 1.2 in 100 s)"
    assert one.time == 10.0 * (RUN + 1)


def test_a_slow_ramp_is_seen_from_afar_and_once():
    rng = np.random.default_rng(2)
    found = told(1.0 + 0.002 * np.arange(400) + 0.004 * rng.standard_normal(400))
    assert len(found) == 1 and (found[0].value - found[0].begin) > FAR * 0.01


def test_what_turns_is_told_again():
    way = np.concatenate([np.arange(30), np.arange(30)[::-1]]) * 0.02
    assert [np.sign(one.value - one.begin) for one in told(way)] == [1.0, -1.0]


@pytest.mark.parametrize(
    "values",
    [
        np.where(np.arange(60) < 30, 1.0, 2.0) + 0.001 * np.arange(60),  # a jump, on a slope within the bars
        1.0 + 0.001 * np.arange(20),  # a slope within the error bars
        1.0 + 0.004 * np.random.default_rng(1).standard_normal(5000),
        2.0 - np.exp(-np.arange(60) / 2.0),  # an estimate that comes to rest
        np.full(60, np.nan),
    ],
)
def test_what_does_not_drift(values):
    assert 0.2 < EVEN < 0.5 and told(values) == []


def wearing(folder, size):
    """Return the drifts that are told of a pump whose gain wears down, so many samples a message, through restarts."""
    rng, T = np.random.default_rng(4), 3000
    u, b = rng.standard_normal(T), 1.0 - 0.5 * np.clip(np.arange(T) - 500, 0, T) / T
    y = np.zeros(T)
    for t in range(1, T):
        y[t] = 0.5 * y[t - 1] + b[t] * u[t - 1] + 0.05 * rng.standard_normal()
    config = parse(f'[model]\nmodel = "arx:1,1"\ninputs = ["u"]\n[store]\npath = "{folder}"\n')
    core, events = Core(config, SqliteStore(folder), estimator_of), []
    for k, first in enumerate(range(0, T, size)):
        at = range(first, min(first + size, T))
        chunk = Chunk("pump", [1e9 + t for t in at], {"value": y[at].tolist(), "u": u[at].tolist()})
        events += core.take([Parcel([chunk])], 2e9)
        core.commit()
        if k % 100 == 1:
            core.store.close()
            core = Core(config, SqliteStore(folder), estimator_of)
    core.store.close()
    return [(event.time, event.sentence) for event in events if event.kind == "drift"]


def test_it_is_told_the_same_however_samples_come_and_through_restarts(tmp_path):
    found = [wearing(tmp_path / str(size), size) for size in (17, 100, 3000)]
    assert found[0] == found[1] == found[2]
    assert len(found[0]) == 1 and found[0][0][1].startswith("b1 drifts by -")


@pytest.mark.slow
def test_a_month_alarms_as_often_as_promised():
    """Printed by scripts/live_month.py."""
    from scripts import live_month

    found, promised, (low, high) = live_month.months(range(live_month.MONTHS))
    assert low <= promised <= high
    assert found["drift"] <= 2
    delays = live_month.bearings(seed=2)
    assert np.mean(np.array(delays) <= live_month.WITHIN) >= 0.98 and np.median(delays) <= 10
    drifts = live_month.worn(2, live_month.wearing)
    assert len({event.key for event in drifts if event.sentence.startswith("b1")}) >= 11


def test_a_jump_is_told_with_its_doubt(tmp_path):
    y = np.random.default_rng(1).standard_normal((1, 600))
    y[0, 300:] += 5.0
    config = parse(f'[model]\nmodel = "ar:2"\njumps = "parameters:10000"\n[store]\npath = "{tmp_path}"\n')
    core = Core(config, SqliteStore(tmp_path), estimator_of)
    jumps = [event for event in core.take([parcel(y, 0, 600)], 2e9) if event.kind == "jump"]
    assert jumps and jumps[0].sentence.startswith("parameters jumped, perhaps ")
    assert json.loads(core.roster.words[0])[0].startswith("ar:2")
