"""Do the error bars mean what they say? Missing samples, an unknown noise scale, noise on the sensor."""

from __future__ import annotations

import numpy as np

import driftwise as dw

from .records import canonical, coloured, nees
from .verdict import Scaled, Section, Table, Verdict, numbers

SOURCE = "this package's study, docs/decisions/noise.md"


def section(seeds: int) -> Section:
    """Run the statistical checks; the numbers of records are for 300 seeds, times seeds / 300."""
    scaled = Scaled(seeds)
    table, sensor = output_error(scaled)
    return Section(
        "Do the error bars mean what they say?",
        [
            "NEES / dim is the squared error of the parameters over their covariance and number: 1 when the "
            "covariance is honest.",
            "Noise on the sensor alone makes the noise polynomial equal to the unknown a. One could plug in "
            "the estimate; driftwise's OutputError is a bilinear filter instead (docs/decisions/noise.md), so the "
            "row below judges that.",
        ],
        [table],
        [],
        [missing(scaled), student(scaled), *sensor],
    )


def _lightly_damped(records, T, sigma, seed, *, on_sensor):
    """Return y, u and [a ; b] of a plant of order 2, poles .85 exp(+-.5i), white input."""
    rng = np.random.default_rng(seed)
    a, b = np.array([0.85**2, -1.7 * np.cos(0.5)]), np.array([0.5, 1.0])
    u, v = rng.standard_normal((2, records, T))
    y, _ = canonical(a, *coloured(a if on_sensor else np.zeros(2), sigma * v), b=b, u=u)
    return y, u, np.concatenate([a, b])


def missing(scaled: Scaled) -> Verdict:
    """30 % of the outputs missing, four parameters, after 100 and after 400 samples."""
    records = scaled.records(100)
    y, u, truth = _lightly_damped(records, 400, 0.5, 21, on_sensor=False)
    y[np.random.default_rng(22).random(y.shape) < 0.3] = np.nan
    est = dw.Joint(2, 1, noise=dw.models.EquationError(0.25), P0=1.0)
    early, _ = est.update_batch(est.start(records), y[:, :100], u[:, :100])
    late, _ = est.update_batch(early, y[:, 100:], u[:, 100:])
    found = nees(est, early, truth).mean(), nees(est, late, truth).mean()
    low, high = 1 - scaled.wide(0.2), 1 + scaled.wide(0.3)
    return Verdict(
        f"30 % of the outputs missing, {records} records: NEES / dim at 100, at 400",
        numbers(found, 2),
        f"in [{max(low, 0):.2f}, {high:.2f}] (EKF 4.4, 1.9; feeding the prediction ≥ 100)",
        all(low < f < high for f in found),
        SOURCE,
    )


def student(scaled: Scaled) -> Verdict:
    """Records of 8 samples, scale and parameters drawn from the prior: 95 % Student intervals, one by one."""
    rng = np.random.default_rng(31)
    records, T, alpha, beta = scaled.records(2000, least=50), 8, 2.0, 1.0
    sigma = np.sqrt(beta / rng.gamma(alpha, size=records))[:, None]
    s0, P0 = np.array([0.0, 0.0, 0.3, -0.8, 0.5, 1.0]), np.array([1.0, 1, 0.04, 0.04, 0.2, 0.2])
    s = s0 + sigma * np.sqrt(P0) * rng.standard_normal((records, 6))
    u, noise = rng.standard_normal((records, T)), sigma * rng.standard_normal((records, T))
    y, _ = canonical(s[:, 2:4], np.zeros((records, T, 2)), noise, b=s[:, 4:], u=u, x0=s[:, :2])
    est = dw.Joint(2, 1, noise=dw.models.EquationError(1.0), scale=dw.models.InverseGamma(alpha, beta), s0=s0, P0=P0)
    traces = [est.scan(y[i], u[i]) for i in range(records)]
    rate = np.mean([np.abs(trace.innovation) <= trace.band(0.95) for trace in traces])
    tolerance = scaled.wide(0.006)
    return Verdict(
        f"noise scale unknown: 95 % intervals, {records} × {T} samples",
        f"cover {rate:.4f}",
        f".95 ± {tolerance:.3f}",
        bool(abs(rate - 0.95) <= tolerance),
        SOURCE,
    )


def output_error(scaled: Scaled):
    """White noise on the sensor: not knowing d, against knowing it, against ignoring it."""
    records = scaled.records(100)
    y, u, truth = _lightly_damped(records, 1000, 0.5, 41, on_sensor=True)
    found = {}
    for name, noise in {
        "OutputError() (bilinear filter)": dw.models.OutputError(0.25),
        "NoisePolynomial(d = a), the oracle": dw.models.NoisePolynomial(truth[:2], 0.25),
        "EquationError()": dw.models.EquationError(0.25),
    }.items():
        est = dw.Joint(2, 1, noise=noise, P0=100.0)
        states, _ = est.update_batch(est.start(records), y, u)
        errors = np.array([est.mean(state)[2:] - truth for state in states])
        found[name] = np.sqrt(np.mean(errors**2, axis=0)), nees(est, states, truth).mean()
    (learning, bars), (knowing, _), (ignoring, biased) = found.values()
    ratio, slack = (learning / knowing)[:2].max(), 1.3 * scaled.wide(1.0) ** 0.5
    limit = 1 + scaled.wide(0.5)
    rows = [[name, *(f"{v:.4f}" for v in rmse), f"{value:.2f}"] for name, (rmse, value) in found.items()]
    table = Table(
        f"White measurement noise, order 2, σ = .5, 1000 samples, {records} records: root mean square errors",
        ["noise model", "a_0", "a_1", "b_0", "b_1", "NEES / dim"],
        rows,
    )
    return table, [
        Verdict(
            "noise on the sensor: OutputError (a bilinear filter, the estimate is not plugged in)",
            f"rmse of a {ratio:.2f} × the oracle's, NEES / dim {bars:.2f}",
            f"≤ {slack:.2f} × the oracle, NEES / dim < {limit:.2f}",
            bool(ratio <= slack and bars < limit),
            SOURCE,
        ),
        Verdict(
            "equation error where the noise is on the sensor",
            f"rmse of a {(ignoring / knowing)[:2].min():.0f} × the oracle's, NEES / dim {biased:.0f}",
            "> 30 × and > 30: it must not be used here",
            bool((ignoring / knowing)[:2].min() > 30 and biased > 30),
            SOURCE,
        ),
    ]
