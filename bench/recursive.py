"""Recursive least squares beside padasip's and river's, and what the members of the family cost beside ARX."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import driftwise as dw

from .clock import ratio
from .verdicts import Verdict, at_least, at_most, for_information

SOURCE = "bench/recursive.py"
P = 0.99


def verdicts(samples: int = 20_000) -> Iterator[Verdict]:
    """Yield speed and endurance of y = phi' theta + e with four regressors, forgetting 0.99, then the family's."""
    rng = np.random.default_rng(1)
    phi = rng.standard_normal((samples, 4))
    y = phi @ [-1.2, 0.5, 0.7, 0.8] + 0.2 * rng.standard_normal(samples)
    est = dw.Regression(4, memory=dw.Weighted(P))

    def stream():
        state = est.start()
        for k in range(samples):
            state, _ = est.update(state, y[k], phi[k])

    one = None
    for name, peer in {"padasip FilterRLS": _padasip, "river BayesianLinearRegression": _river}.items():
        try:
            peer(y[:1], phi[:1])
        except ImportError:
            continue
        value, ours, theirs = ratio(lambda: peer(y, phi), lambda: est.scan(y, phi, keep="means"), rounds=5)
        note = f"{name} {ours / samples * 1e6:.1f} us a sample, ours {theirs / samples * 1e6:.3f} us"
        yield at_least(
            f"least squares, a record, {name.split()[0]}'s time over ours", value, 100, "x", SOURCE, note
        ).beside(name, 1 / value)
        if one is None:
            one, _, theirs = ratio(lambda: peer(y, phi), stream, rounds=5)
            note = f"est.update {theirs / samples * 1e6:.1f} us"
            yield for_information(
                f"least squares, a stream, {name.split()[0]}'s time over ours", one, "x", SOURCE, note
            ).beside(name, 1 / one)
        alike, longer = _alike(100_000)
        with np.errstate(all="ignore"):
            died = _first_bad(peer, longer, alike)
        yield for_information(
            f"two equal regressors, forgetting {P}: {name.split()[0]} fails at sample", died, "", SOURCE
        )
    alike, longer = _alike(100_000)
    e = est.scan(longer, alike).innovation[-1000:]
    name = f"two equal regressors, forgetting {P}: error of the last 1000 of 100 000 samples over the noise"
    yield at_most(name, float(np.sqrt(np.mean(e**2)) / 0.2), 1.1, "", SOURCE)

    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=10_000, noise_std=0.1, seed=1)
    plain = dw.ARX(2, 2)
    members = (dw.ARX(2, 2, method="nlms"), dw.ARX(2, 2, method="iv"), dw.ARMAX(2, 2, 1, method="plr"),
               dw.ARMAX(2, 2, 1), dw.OE(2, 2), dw.BJ(2, 1, 1, 2))  # fmt: skip
    for member in members:
        value, ours, theirs = ratio(lambda: member.scan(y, u), lambda: plain.scan(y, u), rounds=7)
        note = f"{ours / len(y) * 1e9:.0f} ns a sample, ARX(2, 2) {theirs / len(y) * 1e9:.0f} ns"
        name = f"{type(member).__name__}, {member.options['method']}, record, keep std"
        yield for_information(name, value, "x ARX", SOURCE, note)


def _alike(samples):
    rng = np.random.default_rng(5)
    phi = rng.standard_normal((samples, 4))
    phi[:, 3] = phi[:, 2]
    return phi, phi @ [-1.2, 0.5, 0.7, 0.8] + 0.2 * rng.standard_normal(samples)


def _first_bad(peer, y, phi) -> int:
    """Return after how many samples the peer raises, predicts NaN, or errs by a thousand times the noise."""
    found: list[float] = []
    try:
        peer(y, phi, found)
    except (np.linalg.LinAlgError, ValueError, FloatingPointError):
        return len(found)
    bad = ~(np.abs(y - np.array(found)) < 200.0)
    return int(np.argmax(bad)) if bad.any() else len(y)


def _padasip(y, phi, predictions=None):
    from padasip.filters import FilterRLS

    filter = FilterRLS(4, mu=P, eps=1e-4)
    for k in range(len(y)):
        if predictions is not None:
            predictions.append(filter.predict(phi[k]))
        filter.adapt(y[k], phi[k])


def _river(y, phi, predictions=None):
    from river.linear_model import BayesianLinearRegression

    model = BayesianLinearRegression(alpha=1e-4, beta=25.0, smoothing=P)
    for k in range(len(y)):
        x = dict(enumerate(phi[k].tolist()))
        if predictions is not None:
            predictions.append(model.predict_one(x))
        model.learn_one(x, y[k])
