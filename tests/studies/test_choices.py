"""Choices of the bank, made otherwise for a while."""

from __future__ import annotations

import numpy as np
import pytest
from driftwise_studies.score.choices import OTHERWISE, chosen, judged

import driftwise as dw
from driftwise.analysis import candidates, identifier


@pytest.mark.parametrize("words", OTHERWISE)
def test_a_choice_is_another_until_it_is_judged(words):
    for name, value in OTHERWISE[words].items():
        place = candidates if hasattr(candidates, name) else identifier
        before = getattr(place, name)
        with chosen({name: value}):
            assert getattr(place, name) is value
            assert value != before
        assert getattr(place, name) is before


def test_fewer_structures_forecast_another():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=300, noise_std=0.3, seed=1)
    now = judged(y, u)
    with chosen({"ONE": [(1, 1, 0)]}):
        other = judged(y, u)
    assert 50 < now[0] < 100
    assert now != other
    assert judged(np.ones(300), u) is None
