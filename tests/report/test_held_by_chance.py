"""What bands hold of a few plots is marked where chance does not explain it, and nowhere else."""

import numpy as np

import driftwise as dw
from driftwise.report import track_report, tracks_page
from driftwise.tracking.plots import plots


def test_few_plots_may_be_out_by_chance_and_many_not():
    assert tracks_page._held(0.912, 60) == "good"  # 5 or 6 of 60 for 3: once in twenty records
    assert tracks_page._held(0.912, 2000) == "warn"
    assert tracks_page._held(0.80, 60) == "bad"
    assert tracks_page._held(1.0, 60) == "good" and tracks_page._held(1.0, 2000) == "warn"
    assert tracks_page._held(float("nan"), 0) == ""


def test_plots_that_are_judged_are_those_of_tracks_long_enough():
    rng, t = np.random.default_rng(2), 1.7e9 + 4.0 * np.arange(60)
    found = dw.track(plots(t, 100.0 * np.stack([t - t[0], t - t[0]], axis=1) + rng.standard_normal((60, 2)), key="A"))
    rows = track_report.rows(found)
    assert track_report.judged(rows, "coverage") == 60
    assert track_report.judged([rows[0]._replace(coverage=float("nan"))], "coverage") == 0
