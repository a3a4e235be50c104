"""What is left to predict is warned of where it would move a digit of how much is said to be predicted."""

import numpy as np
import pytest
from scipy.signal import lfilter

from driftwise.analysis.forecast_summary import ForecastSummary
from driftwise.analysis.forecast_verdicts import unsaid


def summary(size: float, colour: float) -> ForecastSummary:
    """Return the summary of a forecast whose errors have some size and colour, of an output of deviation one."""
    rng = np.random.default_rng(480303)
    y, e = rng.standard_normal(2000), rng.standard_normal(2200)
    e = np.sqrt(1 - colour**2) * lfilter([1.0], [1.0, -colour], e)[200:]
    return ForecastSummary().add(Forecast(y, size * e, e))


class Forecast:
    """A forecast in the numbers that a summary reads."""

    def __init__(self, y, innovation, normal_score):
        self.y, self.innovation, self.normal_score = y, innovation, normal_score
        self.log_score, self.is_used = np.zeros(len(y)), np.ones(len(y), bool)

    def __len__(self):
        return len(self.y)


@pytest.mark.parametrize(("size", "colour", "is_fine"), [(0.001, 0.5, True), (0.1, 0.5, False), (0.1, 0.0, True)])
def test_what_is_left_is_warned_of_where_it_would_show(size, colour, is_fine):
    """Of what predicts 99.9 % a colour is left that nobody would see; of 90 % it is two points of them."""
    verdict = {one.name: one for one in summary(size, colour).verdicts}["whiteness"]
    assert verdict.is_fine == is_fine


def test_the_share_that_does_not_show_is_that_of_a_digit():
    for fit in (-20.0, 30.0, 90.0, 99.0):
        left = 100 - fit
        assert left * (1 - np.sqrt(1 - unsaid(fit))) == pytest.approx(0.1)
    assert unsaid(99.95) == np.inf
