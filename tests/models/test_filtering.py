"""A rational filter, against SciPy's and against the recursion written out."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.signal import lfilter

from driftwise.models.filtering import linear_filter, many_filters

CASES = [([1.0], [1.0]), ([0.0, 1.0, 0.5], [1.0, -1.5, 0.7]), ([2.0, 1.0], [0.5]), ([1.0], [2.0, -1.9]),
         ([1.0, 0.3, 0.1, 0.2], [1.0, -0.2, 0.1, 0.05, -0.4]), ([1.0], [1.0, -1.02])]  # fmt: skip


@pytest.mark.parametrize("b, a", CASES)
@pytest.mark.parametrize("shape", [(400,), (400, 3), (2,), (2, 1), (400, 0)])
def test_it_is_that_of_scipy(b, a, shape):
    x = np.random.default_rng(1).standard_normal(shape)
    y = lfilter(b, a, x, axis=0) if x.size else x
    np.testing.assert_allclose(linear_filter(b, a, x), y, rtol=1e-9, atol=1e-12 * max(abs(y).max(initial=1.0), 1.0))


def test_it_is_the_recursion():
    x = np.random.default_rng(2).standard_normal(50)
    y = np.zeros(50)
    for t in range(50):
        y[t] = 0.9 * (y[t - 1] if t else 0.0) - 0.5 * (y[t - 2] if t > 1 else 0.0) + x[t] + 0.4 * (x[t - 1] if t else 0)
    np.testing.assert_allclose(linear_filter([1.0, 0.4], [1.0, -0.9, 0.5], x), y, atol=1e-12)


@pytest.mark.parametrize("samples", [0, 1, 2, 300])
def test_many_filters_are_each_that_of_scipy(samples):
    rng = np.random.default_rng(3)
    b, a = rng.standard_normal((5, 4)), np.column_stack([rng.uniform(1, 2, 5), rng.uniform(-0.3, 0.3, (5, 2))])
    x = rng.standard_normal(samples)
    y = [lfilter(p, q, x) if samples else x for p, q in zip(b, a)]
    np.testing.assert_allclose(many_filters(b, a, x), y, rtol=1e-9, atol=1e-12)


def test_a_record_is_validated_without_scipy_signal():
    program = (
        "import sys, driftwise as dw\n"
        "y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)\n"
        "dw.ARX(1, 1).scan(y, u).validate().steps\n"
        "print([name for name in ('scipy.signal', 'scipy.stats', 'scipy.ndimage') if name in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "[]"
