"""A wrong number among the regressors of an `ARX` does not make its past outputs large for good."""

import numpy as np
import pytest
from driftwise_studies.papers.abid.systems import system

import driftwise as dw


@pytest.mark.parametrize("name, share", [("b", 0.9), ("d", 0.93)])
def test_what_drifts_and_jumps_after_a_wrong_number_is_followed_as_before(name, share):
    """Sample 300 is off by a million deviations: errors after it are what they were, and bars hold."""
    s = system(name, 8)
    est = dw.ARX(2, 2, memory=dw.AutoMemory(phi=tuple(s.phi)), at_rest=True)
    errors, inside = [], []
    for wrong in (0.0, 1e6):
        y = s.y.copy()
        y[:, 300] += wrong * np.sqrt(s.sigma2)
        traces = [est.scan(*each) for each in zip(y, s.u)]
        error = np.array([trace.parameters for trace in traces]) - s.theta
        errors.append(np.sqrt(np.mean(error[:, 330:] ** 2)))
        inside.append(
            np.mean(abs(error) < 1.96 * np.array([trace.parameters_std for trace in traces]), axis=(0, 2))[330:].mean()
        )
    assert errors[1] <= 1.1 * errors[0] and min(inside) >= share
