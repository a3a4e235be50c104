"""What is said of a season: nothing where an output is measured so seldom that nobody can know of one."""

from __future__ import annotations

import numpy as np
from driftwise_studies.score.claims.audit import write
from driftwise_studies.score.claims.drawing import draw
from driftwise_studies.score.claims.simulation import record

import driftwise as dw


def test_the_last_value_of_an_output_that_is_seldom_measured_is_no_season(tmp_path):
    """Quarters, of which every seventh is measured: the last one is as far back as a year and three quarters."""
    plant = draw(1194156384, 94)
    found = dw.identify(str(write(plant, record(plant, 1194156384), 1194156384, tmp_path).path))
    assert found.chosen.candidate.seasons == (4,)
    assert set(np.diff(np.flatnonzero(np.isfinite(found.forecast.y)))) == {7}
    assert not [claim for claim in found.claims if claim.kind == "season"]


def test_a_season_that_is_there_is_said(tmp_path):
    rng, t = np.random.default_rng(3), np.arange(1500)
    x = 20 + 5 * np.cos(2 * np.pi * t / 24) + 2 * np.sin(2 * np.pi * t / 12) + rng.standard_normal(1500)
    stamps = np.datetime64("2021-03-01T00") + t
    file = tmp_path / "hours.csv"
    file.write_text("\n".join(["time,load", *(f"{stamp},{y:.4f}" for stamp, y in zip(stamps, x))]))
    (claim,) = [claim for claim in dw.identify(str(file)).claims if claim.kind == "season"]
    assert "24 samples (a day)" in claim.text
