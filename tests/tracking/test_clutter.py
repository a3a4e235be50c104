"""Clutter: its density is local where plots say so, and that of the field where they say nothing."""

import math

import numpy as np
import pytest
from driftwise_studies.score.motions import crowd

from driftwise.tracking import clutter
from driftwise.tracking.clutter import SHAPE, Clutter, Density
from driftwise.tracking.existence import Existence
from driftwise.tracking.live import Live, Plot


def at(east, north, time=0.0):
    return Plot(time, east, north, (math.nan,) * 4, math.nan, "", "", "")


def rows(places, weight=1.0):
    return np.column_stack([np.zeros(len(places)), places, np.arange(len(places)), np.full(len(places), weight)])


def begun(id, odds):
    track = Live(id, "", np.zeros(1), None, {})
    track.odds = odds
    return track


def test_where_nothing_ever_was_the_density_falls_and_where_much_was_it_is_theirs():
    rng = np.random.default_rng(1)
    spot = rng.normal(200.0, 50.0, (300, 2))
    density = Density(rows(np.concatenate([spot, rng.uniform(0, 1000, (100, 2))])), 100.0, 1e6)
    inside, beside = (
        np.mean([density.at(at(*z)).all for z in np.add(x, rng.normal(0, 20.0, (40, 2)))]) for x in (200.0, 800.0)
    )
    mean = 3.0 / (2 * math.pi * 2500.0)  # three a scan, normal; log density falls by .16 on average
    assert inside == pytest.approx(math.log(mean) - 0.16, abs=0.5)
    assert beside == pytest.approx(math.log(1e-6), abs=0.5)  # one a scan in the field: not the mean of four
    point = Density(rows(np.full((400, 2), 200.0)), 100.0, 1e6).at(at(200.0, 200.0)).all
    assert point == pytest.approx(math.log(100 * 4.005e-6))  # an object not yet known may lie there


def test_one_disc_is_the_posterior_mean_of_a_gamma_prior(monkeypatch):
    monkeypatch.setattr(clutter, "DISCS", 2)
    places = np.array([[0.0, 0.0]] * 7 + [[400.0, 0.0]] * 5)
    whole = 12.5 / (1e6 * 10.0)
    seen = 1e6 / 4 * 10.0  # half the radius
    grid = np.linspace(1e-9, 60 * whole, 400_000)  # Poisson times gamma, summed
    weight = grid ** (SHAPE - 1 + 7) * np.exp(-grid * (SHAPE / whole + seen))
    mean = np.sum(grid * weight) / np.sum(weight)
    assert Density(rows(places), 10.0, 1e6).at(at(0.0, 0.0)).all == pytest.approx(math.log(mean), rel=1e-5)


def test_old_plots_are_forgotten_and_full_tables_know_how_many_scans_they_are_of(monkeypatch):
    monkeypatch.setattr(clutter, "REMEMBERED", (100, 64))
    kept, one = Clutter(), begun(1, 0.0)
    for time in range(400):
        kept.append(at(0.0, 0.0, float(time // 4)), one)
    table, scans = kept.since(0.0, 100.0, 1.0)
    assert len(table) == 64 and scans == 16.0
    table, scans = kept.since(0.0, 190.0, 1.0)
    assert len(table) == 40 and scans == 100.0
    kept.remove(one)
    assert kept.since(0.0, 190.0, 1.0)[1] == 100.0 and not len(kept.table)


def test_a_plot_counts_as_much_as_it_is_likely_that_it_is_nobodys():
    known, one, other = Existence(), begun(1, 0.0), begun(2, -math.log(3.0))
    for track in (one, one, other):
        known.clutter.append(at(0.0, 0.0), track)
    assert known.clutter.table[:, 4] == pytest.approx([0.5, 0.5, 0.75])
    known.scored(one, 0.0, math.log(9.0), 0.0)  # another plot that is nine times as likely of an object
    assert known.clutter.table[:, 4] == pytest.approx([0.1, 0.1, 0.75])
    known.gave_up(other)  # never confirmed
    assert known.clutter.table[:, 4] == pytest.approx([0.1, 0.1, 1.0], abs=1e-5)
    known.is_somebody(one, True)
    assert known.clutter.table[:, 3].tolist() == [2.0]
    places = np.random.default_rng(2).uniform(0, 1000, (60, 2))
    found = [
        Density(rows(p, w), 10.0, 1e6).at(at(500.0, 500.0)) for p, w in ((places, 1.0), (np.tile(places, (4, 1)), 0.25))
    ]
    assert found[0].all == pytest.approx(found[1].all, abs=1e-9)
    others = Density(rows(np.concatenate([places[:59], places[59:]]), 1.0), 10.0, 1e6).at(at(*places[59]))
    assert others.beside(begun(59, 0.0)) == pytest.approx(Density(rows(places[:59]), 10.0, 1e6).at(at(*places[59])).all)


def test_among_patches_objects_keep_their_tracks_and_few_tracks_are_of_nobody():
    found = np.array([crowd.count(crowd.draw(0, k, patchy=True)) for k in (4, 33, 49)]).sum(axis=0)
    total = crowd.Counted(*found)  # sixteen when the density was nearly that of the field
    assert total.false <= 4 and total.whole == total.objects, total
