"""Short records with a step near an end: where it is, how large, and that the same number draws the same record."""

import numpy as np
from driftwise_studies.score.claims.late_steps import ALONE, BOTH, KINDS, LONG, STEPS, late_step, table


def test_a_step_is_where_it_is_said_to_be():
    for number in range(8):
        y, u, seasons, at = late_step(3, number, ALONE)
        assert 80 <= len(y) <= 300 and u.shape == (len(y), 0) and not seasons
        assert (at < 0.41 * len(y)) == (number % 4 == 3)
        assert abs(y[at:].mean() - y[:at].mean()) > 0.5


def test_what_else_is_drawn():
    for kind in KINDS:
        (y, u, _, at), (again, *_) = (late_step(3, 2, kind) for _ in range(2))
        assert np.array_equal(y, again) and np.isfinite(y).all() and len(u) == len(y)
        assert (at < len(y)) == (kind in STEPS) and (len(y) >= 1000) == (LONG in kind)
        assert u.shape[1] == (2 if "inputs" in kind or kind == "gain" else 0)
    assert late_step(3, 2, BOTH)[2][0] in (4, 12)


def test_steps_are_counted(monkeypatch):
    monkeypatch.setattr("driftwise_studies.score.claims.late_steps.KINDS", (ALONE,))
    assert "| level alone | 3 |" in table(3, 3)
