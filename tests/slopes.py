"""The slopes of a response against differences of what it leaves."""

import numpy as np


def check_slopes(now) -> None:
    """Assert that each slope of a response is that of a central difference."""
    slopes, theta = now.steep(), now.theta
    for j in range(len(theta)):
        h = 1e-6 * max(abs(theta[j]), 1e-2) * np.eye(1, len(theta), j)[0]
        by_difference = (now.at(theta - h).left - now.at(theta + h).left) / (2 * h[j])
        assert np.allclose(slopes[:, j], by_difference, atol=1e-4 * abs(by_difference).max() + 1e-9)
