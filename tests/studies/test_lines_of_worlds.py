"""What is said to be attainable of each line: the same as the mixtures of `ceiling` where those have an answer."""

import numpy as np
import pytest
from draws import slow
from driftwise_studies.score.worlds import ceiling, draw, lines
from driftwise_studies.score.worlds.simulation import records, regressors
from driftwise_studies.score.worlds.system import changed


def found(system, seed=3, samples=700):
    """Return what both say of the jumps of a record."""
    r = records(system, [seed], samples)
    psi = regressors(system, r.y, r.u)[0]
    given = (system, psi, r.y[0], r.sigma[0], r.theta[0], r.jumps[0], r.moved[0])
    return ceiling.of_record(*given), lines.of_record(*given)


@pytest.mark.parametrize("number", [slow(9), 2])
def test_who_is_told_q_finds_what_the_ceiling_finds(number):
    there, (told, held) = found(changed(draw(0, number), rest=(0, False)))
    for j, (_, all_but_when, statistics) in enumerate(there):
        assert told[j, 0, 0] == all_but_when.told and told[j, 1, 1] == statistics.told
        np.testing.assert_allclose(held[j, :2], [all_but_when.held, statistics.held], atol=1e-9)


def test_outputs_that_were_wrong_or_missing_are_as_they_would_have_been():
    system = draw(0, 19)
    assert system.outliers[0] and not system.of_process
    r = records(system, range(2))
    y = lines.clean(system, r, range(2))
    seen = np.isfinite(r.y) & ~r.outliers
    np.testing.assert_array_equal(y[seen], r.y[seen])
    assert np.isfinite(y).all() and np.abs(y - r.y)[r.outliers & np.isfinite(r.y)].min() > system.sigma


def test_a_loop_that_felt_what_was_wrong_has_no_such_outputs():
    system = next(s for s in (draw(0, k) for k in range(300)) if s.input[0] == "closed loop" and s.missing[0])
    assert lines.clean(system, records(system, [0]), [0]) is None
