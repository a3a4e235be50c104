"""Noise that is a share of the level is told as that, and no moment is named; a step of the noise stays one."""

import numpy as np
import pytest
from draws import slow

import driftwise as dw
from driftwise.analysis.segmentation import NOISE, hindsight

NONE = np.zeros((600, 0))


def level(rng, growth: float) -> np.ndarray:
    """Return a level that grows so many times in six hundred samples, not quite evenly."""
    return np.exp(np.linspace(0, np.log(growth), 600) + 0.05 * np.sin(np.arange(600) / 60 + rng.uniform(0, 6)))


@pytest.mark.parametrize("power", [1.0, slow(0.5)])
def test_noise_that_grows_with_the_level_has_no_date(power):
    right = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        of = level(rng, 8.0 if power == 1.0 else 40.0)
        found = hindsight(of + 0.06 * of**power * rng.standard_normal(600), NONE)
        growth, told = found.growth(), [jump for jump in found.jumps() if jump.kind == NOISE]
        right += growth.power == power and not told
        share = 0.06 * float(np.median(of ** (power - 1)))
        assert not growth.power or growth.share == pytest.approx(share, rel=0.25)
    assert right >= 18


@pytest.mark.parametrize("growth", [slow(1.0), 4.0])
def test_a_step_of_the_noise_is_told_whatever_the_level_does(growth):
    told = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        y = 5 * level(rng, growth) + np.where(np.arange(600) < 350, 0.1, 0.3) * rng.standard_normal(600)
        found = hindsight(y, NONE)
        at = [jump.at for jump in found.jumps() if jump.kind == NOISE]
        told += not found.growth().power and len(at) == 1 and abs(at[0] - 350) < 30
    assert told >= 18


def test_the_words_say_so():
    rng = np.random.default_rng(1)
    of = level(rng, 8.0)
    found = dw.identify({"sales": of * (1 + 0.09 * rng.standard_normal(600))})
    assert "The noise grows with the level: it is about" in found.words and "the noise rose" not in found.words
    assert found.growth.share == pytest.approx(0.09, rel=0.2)


def test_what_crosses_zero_has_no_such_level():
    rng = np.random.default_rng(2)
    y = np.linspace(-1, 1, 600) * 10 + np.where(np.arange(600) < 350, 0.1, 0.3) * rng.standard_normal(600)
    assert not hindsight(y, NONE).growth().power
