"""The gate, as its docstring has it: so many outliers in a row are a change, and then a while is believed."""

import numpy as np
import pytest

import driftwise as dw


@pytest.mark.parametrize("patience, settle", [(2, 4), (3, 1), (1, 10)])
def test_after_so_many_rejections_in_a_row_a_while_is_believed(patience, settle):
    """Constant regressor, wild numbers from sample 50 on, which a mean of all never comes near."""
    y = np.zeros(120)
    y[50:] = 1e3 * (-1.0) ** np.arange(70)
    gate = dw.InnovationGate(5.0, patience=patience, settle=settle)
    trace = dw.Regression(1, variance=1.0, gate=gate, at_rest=True).scan(y, np.ones((120, 1)))
    rejected = (trace.status & int(dw.Status.REJECTED)) != 0
    assert not rejected[:50].any()
    round_ = [True] * patience + [False] * (1 + settle)  # the one that shows the change, and those after it
    expected = np.resize(round_, 70)
    np.testing.assert_array_equal(rejected[50:], expected)


def test_one_outlier_is_no_change():
    y = np.zeros(80)
    y[[30, 50]] = 1e3
    trace = dw.Regression(1, variance=1.0, gate=dw.InnovationGate(5.0, patience=2), at_rest=True).scan(
        y, np.ones((80, 1))
    )
    rejected = (trace.status & int(dw.Status.REJECTED)) != 0
    assert np.flatnonzero(rejected).tolist() == [30, 50] and abs(trace.parameters[-1, 0]) < 1e-6
