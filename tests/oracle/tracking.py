"""Textbook twins of the recursive estimators in plain NumPy: dense matrices, one line an equation."""

import json
from pathlib import Path

import numpy as np

GOLDEN = Path(__file__).parents[1] / "golden" / "perriot.json"


def golden(name):
    """Input and expected values of one case of Perriot-Mathonna's golden file, as arrays where they are lists."""
    case = next(c for c in json.loads(GOLDEN.read_text())["cases"] if c["name"] == name)
    return [
        {k: np.array(v, float) if isinstance(v, list) else v for k, v in case[part].items()}
        for part in ("input", "expected")
    ]


def regressors(y, u, na, nb):
    """Rows (-y(t-1).. -y(t-na), u(t-1)..u(t-nb)), zero before the record."""
    past = lambda s, k: np.concatenate([np.zeros(k), s[:-k]])  # noqa: E731
    return np.stack([-past(y, i + 1) for i in range(na)] + [past(u, i + 1) for i in range(nb)], axis=1)


def stochastic_approximation(nu, y, gains, R, theta):
    """Perriot-Mathonna's eqs. 4-5: R <- R + g (nu nu' - R), theta <- theta + g R^-1 nu eps; thetas, last R."""
    thetas, R, theta = [], np.array(R), np.array(theta)
    for g, row, value in zip(gains, nu, y):
        R = R + g * (np.outer(row, row) - R)
        theta = theta + g * np.linalg.solve(R, row * (value - row @ theta))
        thetas.append(theta)
    return np.array(thetas), R


def kalman(phi, y, Q, R, theta, P):
    """Parameters on a random walk, P <- P + Q first: thetas (T, N), innovations, their variances, last P."""
    thetas, errors, variances, theta, P = [], [], [], np.array(theta), np.array(P)
    for row, value in zip(phi, y):
        P = P + Q
        S = row @ P @ row + R
        K = P @ row / S
        e = value - row @ theta
        theta, P = theta + K * e, P - np.outer(K, K) * S
        thetas.append(theta), errors.append(e), variances.append(S)
    return np.array(thetas), np.array(errors), np.array(variances), P


def ridge(phi, y, theta0, P0):
    """Posterior mean, covariance and chi2 of unit-noise least squares with a Gaussian prior."""
    L = np.linalg.cholesky(np.linalg.inv(P0)).T
    A, b = np.vstack([L, phi]), np.concatenate([L @ theta0, y])
    theta = np.linalg.lstsq(A, b, rcond=None)[0]
    return theta, np.linalg.inv(A.T @ A), float(np.sum((b - A @ theta) ** 2))
