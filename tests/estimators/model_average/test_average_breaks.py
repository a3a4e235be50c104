"""The model average across breaks between runs, where short gaps come in between."""

import numpy as np
import pytest
from driftwise_studies.score.rigs import draw

from driftwise.analysis.identifier import Identifier


@pytest.mark.parametrize("number", [1, 2, 3])
def test_short_gaps_do_not_hide_what_breaks_teach(number):
    y, u = draw("skipped", 31, number)
    y, u = y[:4000], u[:4000]
    seen = np.flatnonzero(np.isfinite(y))
    trace = Identifier(1, 1.0).add(y, u)
    half = len(seen) // 2
    error, step = (y - trace.prediction)[seen[half:]], np.diff(y[seen])[half - 1 :]
    assert np.square(error).sum() < 0.5 * np.square(step).sum()
