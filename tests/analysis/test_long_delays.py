"""How far delays are looked for in records that are long and slow."""

import numpy as np

from driftwise.analysis.delays import ORDER, longest_delay
from driftwise.engine import bounds


def test_no_delay_is_looked_for_that_no_model_takes():
    y = np.cumsum(np.random.default_rng(2).standard_normal(20_000))
    assert 500 < longest_delay(y) <= bounds.MOST["nk"] - ORDER
