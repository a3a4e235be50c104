"""Lags that jump: the drawn plants, who is told everything of them, and the claim held against the truth."""

from dataclasses import replace

import numpy as np
import pytest
from driftwise_studies.score.claims import checking
from driftwise_studies.score.claims.checking import FALSE, TRUE, Case, check
from driftwise_studies.score.claims.drawing import draw
from driftwise_studies.score.claims.lags import changing, plain
from driftwise_studies.score.claims.oracle import ask
from driftwise_studies.score.claims.plant import SLOWEST, Jump, Plant
from driftwise_studies.score.claims.simulation import record, response
from driftwise_studies.score.claims.tables import Written

PLAIN = Plant(
    0, frozenset(), 1200, 2.0, (0.8 + 0j,), ((1.0,),), (3.0,), (1,), "white", 5.0, 4.0, "equation", 0.8
)  # fmt: skip
FASTER = "the plant became faster: 63 % of the answer to a step of valve took 4 s, before 9 s"
BOTH = "the plant's response changed: the gain from valve rose from 2 to 3, or the plant became slower, its time .."


def test_gains_stay_where_a_lag_jumps_and_answers_take_as_much_longer():
    plant = replace(plain(5, 4), jumps=(Jump("lag", 300, 2.0, SLOWEST),), samples=900)
    y = response(plant, np.ones((900, len(plant.gains))))
    assert y[290] == pytest.approx(sum(plant.gains), rel=0.02) and y[-1] == pytest.approx(sum(plant.gains), rel=0.02)
    (_, before), (at, after) = plant.poles_at()
    assert at == 300 and -1 / np.log(abs(after).max()) == pytest.approx(-2 / np.log(abs(before).max()))
    assert plant.slowest == pytest.approx(2 * plant.time_constants[0])


def test_some_files_have_a_lag_that_jumps_beside_no_gain_that_does():
    files = [draw(7, number) for number in range(90)]
    lagging = [plant for plant in files if "lag jump" in plant.troubles]
    assert 2 < len(lagging) < 20
    assert all({jump.what for jump in plant.jumps} & {"lag", "gain"} == {"lag"} for plant in lagging)


def test_who_is_told_everything_knows_a_lag_by_its_size_and_when_an_answer_is_done_at_the_end():
    plants = [replace(PLAIN, jumps=(Jump("lag", 600, size),)) for size in (2.0, 1.001)]
    large, small = (ask(plant, record(plant, 1)) for plant in plants)
    assert large.log_odds[0] > checking.TELLABLE > 1 > small.log_odds[0]
    assert large.named_odds[0] > checking.TELLABLE
    (time, bar), (plain_time, _) = large.times[0], small.times[0]
    assert 1.5 < (time - 1) / (plain_time - 1) < 2.5 and 0 < bar < 2
    assert large.gains[0] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("what", "subject", "at", "verdict"),
    [("lag", FASTER, 603, TRUE), ("lag", FASTER, 900, FALSE), ("gain", FASTER, 603, FALSE), ("lag", BOTH, 603, TRUE),
     ("gain", BOTH, 603, TRUE), ("level", BOTH, 603, FALSE), ("lag", "the gain from valve rose", 603, FALSE)],
)  # fmt: skip
def test_a_plant_that_became_faster_is_true_of_a_lag_that_jumped_then(what, subject, at, verdict):
    plant = replace(PLAIN, jumps=(Jump(what, 600, 0.5),), troubles=frozenset({f"{what} jump"}))
    data, affine = record(plant, 1), {"y": (0.0, 1.0), "valve": (0.0, 1.0)}
    written = Written("plant.csv", "plain", "seconds", "en", ("y",), ("valve",), ("time_s",), 2.0, {}, affine)
    case = Case(plant, data, written, ask(plant, data), {"dt": 2.0, "forecast": {"fit": 50.0}, "claims": []})
    said = {"kind": "change", "subject": subject, "value": at, "interval": [at - 5, at + 5], "odds": 1e6, "text": ""}
    assert check(case, said) == verdict


def test_each_kind_of_the_study_is_drawn():
    for kind in ("slowest mode", "pole", "reversal", "friction"):
        y, u, at, factor, slack = changing(1, 2, kind)
        assert np.isfinite(y).all() and len(u) == len(y) and factor > 0 and slack > 0
        assert (at > 0) == (kind != "friction")
