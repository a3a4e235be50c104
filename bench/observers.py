"""Observers of a known plant: the paper's motor, six modes, 500 samples in the window, one output and one input."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

import driftwise as dw

from .clock import alternate, ratio
from .verdicts import Verdict, at_most, for_information

SOURCE = "bench/observers.py"
DT = 1e-3
MOTOR = dw.Plant([[0, 1, 0], [0, 0, 0.2], [0, -10, -10]], [0, 0, 10], [1, 0, 0])
MODES = (dw.models.Polynomial([0, 0, 5], np.inf), dw.models.Sinusoid(50.0, [0, 0, 5], 2.0))
NOISE = 0.0087


def verdicts(samples: int = 20_000) -> Iterator[Verdict]:
    """Yield the cost of a sample of each form, how it grows with the record, and the opponents."""
    rng = np.random.default_rng(0)
    u = 24 * np.sin(DT * np.arange(samples))
    y = np.cumsum(u) * 1e-4 + NOISE * rng.standard_normal(samples)
    time = np.cumsum(rng.exponential(DT, samples))
    options = dict(noise_std=NOISE, disturbances=MODES, hold="foh", dt=DT)
    regular = dw.WindowObserver(MOTOR, 0.5, **options)
    irregular = dw.WindowObserver(MOTOR, 0.5, irregular=True, **options)
    growing = dw.WindowObserver(MOTOR, np.inf, **options)
    theorem = dw.AlgebraicObserver(
        MOTOR, into=[0, 0, 5], degree=0, frequencies=(50.0,), hold="foh", dt=DT, noise_std=NOISE
    )

    def scan(est, count, stamps=None):
        return est.scan(y[:count], u[:count], time=None if stamps is None else stamps[:count])

    for what, est, stamps, bound in (
        ("window, regular", regular, None, 3.0),
        ("window, irregular", irregular, time, 40.0),
    ):
        half, whole = partial(scan, est, samples // 2, stamps), partial(scan, est, samples, stamps)
        seconds = alternate(whole, half, rounds=7)
        each = float(np.median(seconds[:, 0])) / samples * 1e6
        yield at_most(f"{what}: 500 samples, 6 modes, record", each, bound, "us a sample", SOURCE)
        grown = float(np.median(seconds[:, 0] / seconds[:, 1])) / 2
        yield at_most(f"{what}: cost of a sample in twice the record", grown, 1.1, "x", SOURCE)
    longer = dw.WindowObserver(MOTOR, 2.0, irregular=True, **options)
    value, mine, _ = ratio(partial(scan, longer, samples, time), partial(scan, irregular, samples, time), rounds=5)
    note = f"{mine / samples * 1e6:.1f} us a sample with 2000 samples in the window"
    yield at_most("window, irregular: four times the window", value, 1.5, "x", SOURCE, note)
    for what, est in (("window, all samples so far", growing), ("theorem of Tian, N = 6", theorem)):
        value, mine, other = ratio(partial(scan, est, samples), partial(scan, regular, samples), rounds=7)
        note = f"{mine / samples * 1e6:.2f} us a sample, window of 500 samples {other / samples * 1e6:.2f} us"
        yield for_information(f"{what}, record", value, "x a window", SOURCE, note)

    few = 1_000
    textbook = _textbook(regular)
    value, mine, other = ratio(partial(scan, regular, samples), lambda: textbook(y[:few], u[:few]), rounds=7)
    value *= few / samples
    note = f"NumPy, the same gains {other / few * 1e6:.1f} us a sample, ours {mine / samples * 1e6:.2f} us"
    yield for_information("window, regular: against its gains alone in NumPy", value, "x", SOURCE, note).beside(
        "NumPy", value
    )
    value, mine, other = ratio(partial(scan, growing, samples), lambda: _filterpy(growing, y[:few], u[:few]), rounds=5)
    value *= few / samples
    note = f"filterpy, 6 states {other / few * 1e6:.0f} us a sample, ours {mine / samples * 1e6:.2f} us"
    yield at_most("window, all samples so far: against filterpy", value, 0.1, "x", SOURCE, note).beside(
        "filterpy", value
    )
    pairs = list(zip(y[:few].tolist(), u[:few].tolist()))

    def stream():
        state = regular.start()
        for value, input in pairs:
            state, _ = regular.update(state, value, input)

    each = float(np.median(alternate(stream, rounds=7))) / few * 1e6
    yield for_information("window, regular: est.update", each, "us a sample", SOURCE)


def _textbook(est):
    """Return the regular window as anyone writes it: matrices of gains times what is in the window."""
    gains, feeds = est.design.gains[..., 0], est.design.input_gains[..., 0]

    def run(y, u):
        ys, us, found = np.zeros(gains.shape[1]), np.zeros(feeds.shape[1]), []
        for value, input in zip(y, u):
            ys[:-1], us[:-1] = ys[1:], us[1:]
            ys[-1], us[-1] = value, input
            found.append(gains @ ys + feeds @ us)
        return np.array(found)

    return run


def _filterpy(est, y, u):
    from filterpy.kalman import KalmanFilter

    Phi, G0, G1 = est.plant.discretise(DT, "foh")
    peer = KalmanFilter(6, 1, 1)
    peer.F, peer.H, peer.R, peer.P, peer.Q = Phi, est.plant.H, NOISE**2 * np.eye(1), 100 * np.eye(6), np.zeros((6, 6))
    for k in range(1, len(y)):
        peer.predict(u=np.array([[1.0]]), B=G0 * u[k - 1] + G1 * u[k])
        peer.update(y[k])
    return peer.x
