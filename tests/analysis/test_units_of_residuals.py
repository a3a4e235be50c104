"""What is tested in residuals knows no unit."""

import numpy as np
import pytest

from driftwise.analysis.residual_tests import correlate, moves, prewhitened, squares


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e-200, 1e99, 1e200])
def test_residual_tests_know_no_unit(size):
    rng = np.random.default_rng(2)
    u, z = rng.standard_normal((600, 1)), rng.standard_normal(600)
    y = np.convolve(u[:, 0], [0.5, 0.3])[:600]
    assert moves(size * y) == pytest.approx(moves(y), rel=1e-9)
    assert np.allclose(prewhitened(size * y) / size, prewhitened(y), rtol=1e-6, equal_nan=True)
    one, other = (correlate(z, k * y, range(5), 0.99) for k in (1.0, size))
    assert np.allclose(one.deviations, other.deviations)
    one, other = (squares(z, k * y, k * u, k * y, [1], 2, 0.99) for k in (1.0, size))
    assert np.allclose(one, other)
