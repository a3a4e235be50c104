"""The filter of a user's own matrices: a position and a speed in a plane, measured in the plane, beside others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import driftwise as dw

from .clock import alternate, ratio
from .verdicts import Verdict, at_least, at_most, not_measured

SOURCE = "bench/state_space.py"
F = np.kron([[1.0, 1.0], [0.0, 1.0]], np.eye(2))
H = np.eye(2, 4)
Q = 0.01 * np.kron([[1 / 3, 1 / 2], [1 / 2, 1.0]], np.eye(2))
R, P0 = 4.0 * np.eye(2), 100.0 * np.eye(4)
FEW = 2000  # samples that the slow ones are given


def verdicts(samples: int = 100_000) -> Iterator[Verdict]:
    """Yield the cost of a sample in a record, beside others who were checked to answer the same, and of a call."""
    y = np.random.default_rng(0).standard_normal((samples, 2)).cumsum(axis=0)
    est = dw.StateSpace(F, H=H, Q=Q, R=R, P0=P0)
    whole, few = est.scan(y, keep="means").estimates[-1], est.scan(y[:FEW], keep="means").estimates[-1]
    for name, run, count, bound in (("filterpy", _filterpy, FEW, 50), ("statsmodels", _statsmodels, samples, 1)):
        what, expected = f"record, 4 states, 2 outputs: times as fast as {name}", f">= {bound} x"
        try:
            peer: Callable = partial(run, y[:count])
            np.testing.assert_allclose(peer(), whole if count == samples else few, rtol=1e-6)
        except ImportError as error:
            yield not_measured(what, expected, SOURCE, str(error))
            continue
        value, mine, other = ratio(partial(est.scan, y, keep="means"), peer, rounds=7)
        times = samples / count / value
        note = f"{other / count * 1e6:.2f} us a sample, ours {mine / samples * 1e6:.2f} us"
        yield at_least(what, times, bound, "x", SOURCE, note).beside(name, 1 / times)
    yield from _calls(est, y[:FEW])


def _calls(est, y) -> Iterator[Verdict]:
    rows, spec, scratch, drive = est.start(1).view("f8").reshape(1, -1), est.spec, est.scratch(), est.drive
    one_y, one_u, out = np.empty((1, 1, 2)), np.empty((1, 1, 0)), np.empty((1, 1, est.step_columns))

    def raw():
        for value in y:
            one_y[0, 0] = value
            drive(rows, one_y, one_u, out, spec, scratch)

    def friendly():
        state = est.start()
        for value in y:
            state, _ = est.update(state, value)

    raw_us, friendly_us = np.median(alternate(raw, friendly, rounds=7), axis=0) / len(y) * 1e6
    yield at_most("StateSpace, 4 states, 2 outputs: one sample, raw call", raw_us, 1.5, "us", SOURCE)
    yield at_most("StateSpace, 4 states, 2 outputs: one sample, est.update", friendly_us, 10, "us", SOURCE)


def _filterpy(y) -> np.ndarray:
    from filterpy.kalman import KalmanFilter

    peer = KalmanFilter(4, 2)
    peer.F, peer.H, peer.Q, peer.R, peer.P = F, H, Q, R, P0.copy()
    peer.update(y[0])
    for value in y[1:]:
        peer.predict()
        peer.update(value)
    return peer.x[:, 0]


def _statsmodels(y) -> np.ndarray:
    from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

    peer = KalmanFilter(2, 4, k_posdef=4, tolerance=0)  # 0: its gain is never taken for settled
    peer.bind(y)
    peer["transition"], peer["design"], peer["state_cov"], peer["obs_cov"] = F, H, Q, R
    peer["selection"] = np.eye(4)
    peer.initialize_known(np.zeros(4), P0)
    return peer.filter().filtered_state[:, -1]
