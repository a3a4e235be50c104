"""A drifting regression with four regressors, by everybody who can: a record, a stream, a sample appended."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import driftwise as dw

from .clock import alternate
from .peers import BATCH, P0, PEERS, Q, R
from .verdicts import Verdict, for_information, not_measured

SOURCE = "bench/rivals.py"
BEHIND = {
    "C -O3 -march=native, textbook": "no U D factors, no status, nothing checked, order known to the compiler",
    "fast-kalman": "C++ behind one thin call; our est.update copies the state, so that the old one stays",
}


def data(samples: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return y and the regressors."""
    rng = np.random.default_rng(seed)
    h = rng.standard_normal((samples, 4))
    return h @ [-1.2, 0.5, 0.7, 0.8] + 0.2 * rng.standard_normal(samples), h


def verdicts(samples: int = 2_000, many: int = 10) -> Iterator[Verdict]:
    """Yield the time of each over ours, on a record and in a stream, and what one sample more costs."""
    est = dw.Regression(4, memory=dw.RandomWalk(Q), variance=R, P0=P0)
    y, h = data(samples)
    ours = est.scan(y, h).parameters
    long_y, long_h = np.tile(y, many), np.tile(h, (many, 1))

    def record():
        est.scan(long_y, long_h, keep="means")

    def stream():
        state = est.start()
        for t in range(samples):
            state, _ = est.update(state, y[t], h[t])

    def raw():
        rows, out, scratch = est.start(1).view("f8").reshape(1, -1), np.empty((1, 1, 4)), est.scratch()
        ys, hs = y.reshape(-1, 1, 1, 1), h.reshape(-1, 1, 1, 4)
        for t in range(samples):
            est.drive(rows, ys[t], hs[t], out, est.spec, scratch)

    for name, peer in PEERS.items():
        try:
            np.testing.assert_allclose(peer(y, h), ours, atol=1e-7)
        except (ImportError, OSError) as error:
            yield not_measured(f"drifting regression, {name}", "no budget (x)", SOURCE, str(error))
            continue
        rounds = 7 if name in BATCH else 3
        seconds = alternate(lambda p=peer: p(long_y, long_h), record, rounds=rounds) / len(long_y)
        yield _against("a record", name, seconds, "")
        if name not in BATCH:
            seconds = alternate(lambda p=peer: p(y, h), stream, raw, rounds=rounds) / samples
            note = f", by the raw call {np.median(seconds[:, 2]) * 1e6:.2g} us"
            yield _against("a stream", name, seconds, note)
    try:
        yield _appended()
    except ImportError as error:
        yield not_measured("a drifting level, one sample more: statsmodels", "no budget (x)", SOURCE, str(error))


def _against(what: str, name: str, seconds: np.ndarray, note: str) -> Verdict:
    """Return how long the other takes over ours, from the seconds (rounds, 2 or more) of both."""
    ratio = float(np.median(seconds[:, 0] / seconds[:, 1]))
    each = np.median(seconds, axis=0) * 1e6
    note = f"{name} {each[0]:.3g} us a sample, ours {each[1]:.3g} us{note}"
    verdict = for_information(f"drifting regression, {what}: {name}'s time over ours", ratio, "x", SOURCE, note)
    return verdict.beside(name, 1 / ratio, BEHIND.get(name, ""))


def _appended(samples: int = 500) -> Verdict:
    """Return what one sample more costs those who filter whole records: statsmodels' results can be extended."""
    from statsmodels.tsa.statespace.structural import UnobservedComponents

    y = data(samples)[0]
    est = dw.Regression(1, memory=dw.RandomWalk(Q), variance=R, P0=1e6)
    state = est.scan(y[:-1], np.ones(samples - 1)).state
    results = UnobservedComponents(y[:-1], "llevel").filter([R, Q])

    def theirs():
        return results.extend(y[-1:])

    def ours():
        for _ in range(1000):
            found = est.update(state, y[-1], 1.0)
        return found[0]

    np.testing.assert_allclose(theirs().filtered_state[0, -1], est.mean(ours())[-1], atol=1e-5)
    seconds = alternate(theirs, ours, rounds=11)
    mine, other = np.median(seconds[:, 1]) / 1000, np.median(seconds[:, 0])
    note = f"UnobservedComponents, results.extend {other * 1e6:.0f} us, est.update {mine * 1e6:.1f} us"
    name = "a drifting level, one sample more: statsmodels' time over ours"
    return for_information(name, other / mine, "x", SOURCE, note).beside("statsmodels", mine / other)
