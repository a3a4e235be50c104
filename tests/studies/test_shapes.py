"""Plants of other shapes: what is drawn is what it says, and what is told of them is true."""

import numpy as np
import pytest
from draws import slow
from driftwise_studies.score.claims.shapes import KINDS, crossing, is_true, main, shaped

from driftwise.analysis.identify import identify


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_drawn_has_an_end_or_none(kind):
    data = shaped(0, 1, kind)
    late = abs(data.step[-1] - data.step[-500]) / abs(data.step[-1])
    assert (late < 1e-3) == data.has_end and data.y.shape == data.u.shape and np.isfinite(data.y).all()
    assert not data.has_end or data.step[int(crossing(data.step)) + 1] / data.step[-1] >= 0.63


@pytest.mark.parametrize("number", [0, slow(1), slow(7)])
def test_plants_that_ring_are_told_by_as_many_modes_as_it_takes(number):
    """With three poles at most their gains were told wrong, by up to thirty of their bars."""
    data = shaped(0, number, "rings")
    verdicts = [is_true(data, claim) for claim in identify({"u": data.u, "y": data.y}, "y", ["u"]).claims]
    assert True in verdicts and False not in verdicts


def test_a_table_counts_what_is_false(capsys):
    main(["--records", "1", "--kinds", "leads"])
    assert capsys.readouterr().out.splitlines()[-1].startswith("| leads | 1 | 1 | 0 |")
