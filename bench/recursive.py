"""Recursive least squares beside padasip's and river's, and what the members of the family cost beside ARX."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import driftwise as dw

from .clock import alternate, ratio
from .verdicts import Verdict, at_least, at_most, for_information, not_measured

SOURCE = "bench/recursive.py"
P = 0.99


def verdicts(samples: int = 20_000) -> Iterator[Verdict]:
    """Yield speed and endurance of y = phi' theta + e with four regressors, forgetting 0.99, then the family's."""
    rng = np.random.default_rng(1)
    phi = rng.standard_normal((samples, 4))
    y = phi @ [-1.2, 0.5, 0.7, 0.8] + 0.2 * rng.standard_normal(samples)
    est = dw.Regression(4, memory=dw.ExponentialForgetting(P))

    def stream():
        state = est.start()
        for k in range(samples):
            state, _ = est.update(state, y[k], phi[k])

    trace = est.scan(y, phi)
    for name, peer in {"padasip FilterRLS": _padasip, "river BayesianLinearRegression": _river}.items():
        found: list[float] = []
        try:
            peer(y, phi, found)
        except ImportError as error:
            yield not_measured(
                f"least squares, a record, {name.split()[0]}'s time over ours", ">= 100 x", SOURCE, str(error)
            )
            continue
        np.testing.assert_allclose(found[-1000:], trace.prediction[-1000:], atol=1e-6)
        seconds = (
            alternate(lambda p=peer: p(y, phi), lambda: est.scan(y, phi, keep="means"), stream, rounds=5) / samples
        )
        us, short = np.median(seconds, axis=0) * 1e6, name.split()[0]
        value, one = (float(np.median(seconds[:, 0] / seconds[:, i])) for i in (1, 2))
        note = f"{name} {us[0]:.1f} us a sample, ours {us[1]:.3f} us"
        told = at_least(f"least squares, a record, {short}'s time over ours", value, 100, "x", SOURCE, note)
        yield told.beside(name, 1 / value)
        note = f"est.update {us[2]:.1f} us"
        told = for_information(f"least squares, a stream, {short}'s time over ours", one, "x", SOURCE, note)
        yield told.beside(name, 1 / one)
        alike, longer = _alike(100_000)
        with np.errstate(all="ignore"):
            died = _first_bad(peer, longer, alike)
        yield for_information(f"two equal regressors, forgetting {P}: {short} fails at sample", died, "", SOURCE)
    alike, longer = _alike(100_000)
    e = est.scan(longer, alike).innovation[-1000:]
    name = f"two equal regressors, forgetting {P}: error of the last 1000 of 100 000 samples over the noise"
    yield at_most(name, float(np.sqrt(np.mean(e**2)) / 0.2), 1.1, "", SOURCE)
    yield _against_statsmodels(y[:3000], phi[:3000])

    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=10_000, noise_std=0.1, seed=1)
    plain = dw.ARX(2, 2)
    members = (dw.ARX(2, 2, method="nlms"), dw.ARX(2, 2, method="iv"), dw.ARMAX(2, 2, 1, method="plr"),
               dw.ARMAX(2, 2, 1), dw.OE(2, 2), dw.BJ(2, 1, 1, 2))  # fmt: skip
    for member in members:
        value, ours, theirs = ratio(lambda: member.scan(y, u), lambda: plain.scan(y, u), rounds=7)
        note = f"{ours / len(y) * 1e9:.0f} ns a sample, ARX(2, 2) {theirs / len(y) * 1e9:.0f} ns"
        name = f"{type(member).__name__}, {member.options['method']}, record, keep std"
        yield for_information(name, value, "x ARX", SOURCE, note)


def _against_statsmodels(y, phi) -> Verdict:
    """Return the time of `RecursiveLS`, which never forgets, over ours."""
    name = "least squares without forgetting, a record, statsmodels' time over ours"
    try:
        from statsmodels.regression.recursive_ls import RecursiveLS
    except ImportError as error:
        return not_measured(name, "no budget (x)", SOURCE, str(error))
    est = dw.Regression(4)

    def theirs():
        return RecursiveLS(y, phi).fit().recursive_coefficients.filtered.T

    np.testing.assert_allclose(theirs()[100:], est.scan(y, phi).parameters[100:], atol=1e-4)
    value, other, mine = ratio(theirs, lambda: est.scan(y, phi, keep="means"), rounds=5)
    note = f"RecursiveLS {other / len(y) * 1e6:.1f} us a sample, ours {mine / len(y) * 1e6:.3f} us"
    return for_information(name, value, "x", SOURCE, note).beside("statsmodels RecursiveLS", 1 / value)


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
